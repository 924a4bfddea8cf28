"""Spots in the ceiling: even, inside, off walls and lamps, as often and as bright as configured."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from sample_scene import sample_scene

from grammar.appearance.lighting import read_lighting_config, sample_downlights
from scene_description import Room, Support
from scene_description.share import config_path

CONFIG = read_lighting_config(config_path("lighting.yaml")).downlights["kitchen"]
ALWAYS = replace(CONFIG, probability=1.0)
ROOM: Room = sample_scene().room


def rng(seed: int) -> np.random.Generator:
    return np.random.default_rng(seed)


def shaped(*corners: tuple[float, float]) -> Room:
    return replace(ROOM, polygon_m=corners, openings=(), height_m=2.5)


SQUARE = shaped((0.0, 0.0), (4.0, 0.0), (4.0, 3.0), (0.0, 3.0))
ELL = shaped((0.0, 0.0), (5.0, 0.0), (5.0, 2.0), (2.0, 2.0), (2.0, 5.0), (0.0, 5.0))


@pytest.mark.parametrize("room", [SQUARE, ELL])
def test_spots_lie_inside_and_off_the_walls(room: Room) -> None:
    for seed in range(20):
        spots = sample_downlights(rng(seed), ALWAYS, room, (), dark=True)
        assert spots
        for spot in spots:
            x, y, z = spot.position_m
            assert z == pytest.approx(2.494) and spot.direction == (0.0, 0.0, -1.0)
            walls = [x, y, 5.0 - x, 5.0 - y] if room is ELL else [x, y, 4.0 - x, 3.0 - y]
            assert min(walls) >= 0.49
            if room is ELL:
                assert x < 2.0 or y < 2.0  # not in the notch
                assert max(2.0 - x, 2.0 - y) >= 0.34


def test_a_known_grid() -> None:
    fixed = replace(ALWAYS, spacing_m=(1.0, 1.0), from_wall_m=0.5)
    places = {spot.position_m[:2] for spot in sample_downlights(rng(0), fixed, SQUARE, (), dark=True)}
    assert places == {(0.5 + i, 0.5 + j) for i in range(4) for j in range(3)}


def test_hanging_lamps_are_kept_clear() -> None:
    fixed = replace(ALWAYS, spacing_m=(1.0, 1.0), from_wall_m=0.5)
    lamp = replace(sample_scene().objects[0], position_m=(1.6, 1.5, 2.0), support=Support(kind="ceiling"))
    places = {spot.position_m[:2] for spot in sample_downlights(rng(0), fixed, SQUARE, (lamp,), dark=True)}
    assert len(places) == 11 and (1.5, 1.5) not in places


def test_odds_and_ranges_are_the_configured_ones() -> None:
    drawn = [sample_downlights(rng(seed), CONFIG, SQUARE, (), dark=True) for seed in range(600)]
    some = [spots for spots in drawn if spots]
    assert len(some) / 600 == pytest.approx(CONFIG.probability, abs=0.06)
    assert sum(spots[0].on for spots in some) / len(some) == pytest.approx(CONFIG.on_in_dark, abs=0.1)
    for spots in some:
        assert len({(spot.flux_lm, spot.color, spot.beam_rad, spot.on) for spot in spots}) == 1
        assert 350 <= spots[0].flux_lm <= 700 and 18 <= math.degrees(spots[0].beam_rad) <= 32
        assert spots[0].field_rad == pytest.approx(1.9 * spots[0].beam_rad)


def test_rooms_without_a_section_and_tiny_ones() -> None:
    assert sample_downlights(rng(0), None, SQUARE, (), dark=True) == ()
    tiny = shaped((0.0, 0.0), (0.8, 0.0), (0.8, 0.8), (0.0, 0.8))
    assert sample_downlights(rng(0), ALWAYS, tiny, (), dark=True) == ()
