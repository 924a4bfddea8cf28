"""Designs with known answers."""

import itertools
import math

import pytest

from scene_synth_ros.sweep.designs import design_points
from scene_synth_ros.sweep.sweep_file import FactorSpec, Span, SweepFactor, SweepSpec

A = SweepFactor(name="a", spec=FactorSpec(factor="clutter"), values=(1, 2))
B = SweepFactor(name="b", spec=FactorSpec(factor="clutter"), values=("x", "y", "z"))
R = SweepFactor(name="r", spec=FactorSpec(factor="clutter", steps=3), span=Span(0.0, 1.0))
LOG = SweepFactor(name="log", spec=FactorSpec(factor="clutter", steps=3, scale="log"), span=Span(0.01, 100.0))


def test_a_grid_has_every_combination_the_last_factor_fastest() -> None:
    points = design_points(SweepSpec(design="grid", factors=(A, B)))
    assert [tuple(point.values()) for point in points] == list(itertools.product((1, 2), "xyz"))


def test_one_at_a_time_begins_with_the_base_and_walks_ranges_in_steps() -> None:
    points = design_points(SweepSpec(design="one_at_a_time", factors=(A, R, LOG)))
    singles = [{"a": 1}, {"a": 2}, {"r": 0.0}, {"r": 0.5}, {"r": 1.0}, {"log": 0.01}, {"log": 1.0}, {"log": 100.0}]
    assert points == [{}, *singles]


@pytest.mark.parametrize("samples", [1, 6, 12])
def test_a_latin_hypercube_has_one_sample_in_each_part_of_each_range(samples: int) -> None:
    points = design_points(SweepSpec(design="latin_hypercube", samples=samples, seed=4, factors=(R, B, LOG)))
    for name, share in (("r", lambda value: value), ("log", lambda value: (2.0 + math.log10(value)) / 4.0)):
        assert sorted(int(share(point[name]) * samples) for point in points) == list(range(samples))
    if samples % 3 == 0:
        assert sorted(str(point["b"]) for point in points) == sorted("xyz" * (samples // 3))


def test_a_latin_hypercube_depends_on_its_seed_alone() -> None:
    one, same, other = (design_points(SweepSpec(design="latin_hypercube", seed=seed, factors=(R, A))) for seed in (1, 1, 2))
    assert one == same != other
