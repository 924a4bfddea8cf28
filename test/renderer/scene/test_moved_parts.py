"""Drawers and doors ajar, curtains half drawn, pictures askew: what moves, how far, and that all stays within the object's box."""

from __future__ import annotations

import math

import numpy as np
import pytest

from renderer.geometry.mesh import signed_volume
from renderer.geometry.shapes import blocks
from renderer.models import MODELS, build_model
from renderer.models.model import Parts, Size
from renderer.scene.moved_parts import fronts_of, moved_model
from scene_description import ModelReference

CASES = [(name, style) for name in ("nightstand", "dresser", "sideboard", "filing_cabinet", "tv_stand") for style in MODELS[name].styles]


def extent(parts: Parts) -> tuple[np.ndarray, np.ndarray]:
    points = np.concatenate([mesh.vertices for mesh in parts.values()])
    return points.min(axis=0), points.max(axis=0)


def moved(generator: str, style: str, size_m: Size, ajar: float, seed: int = 3) -> Parts:
    return moved_model(ModelReference(generator=generator, style=style, seed=seed, ajar=ajar), size_m)


def test_blocks_that_share_a_rectangle_are_one_front() -> None:
    mesh = blocks([(0, 0, 0), (0, 0.1, 0.1), (0, 1, 0)], [(0.1, 0.5, 0.5), (0.1, 0.4, 0.4), (0.1, 1.5, 0.5)])
    areas = np.array(sorted(fronts_of(mesh).tolist()))
    assert areas == pytest.approx(np.array([[0.0, 0.5, 0.0, 0.5], [1.0, 1.5, 0.0, 0.5]]))
    assert len(fronts_of(build_model("mug", "straight", 1, (0.1, 0.1, 0.1))["body"])) == 0


@pytest.mark.parametrize(("generator", "style"), CASES)
def test_an_open_front_fills_the_box_before_the_body(generator: str, style: str) -> None:
    size, reach = (0.65, 1.2, 0.8), 0.2
    for seed in range(4):
        parts = moved(generator, style, size, reach / size[0], seed)
        low, high = extent(parts)
        assert low == pytest.approx([-0.325, -0.6, 0.0], abs=1e-4) and high == pytest.approx([0.325, 0.6, 0.8], abs=1e-4)
        # the body keeps to its own depth, but for what stretches it to the box where a style has no front that opens
        shut = build_model(generator, style, seed, (size[0] - reach, *size[1:]))
        body = parts["body"].vertices[:, 0]
        opens = len(fronts_of(shut["drawers"])) > 0
        assert not opens or np.ptp(body) == pytest.approx(np.ptp(shut["body"].vertices[:, 0]), rel=0.2)
        assert all(signed_volume(mesh) > 0.0 for mesh in parts.values())


def test_a_picture_hangs_askew_within_its_box() -> None:
    size = (0.03, 0.6, 0.5)
    straight, askew = build_model("picture", "print", 1, size), moved("picture", "print", size, 1.0, 1)
    low, high = extent(askew)
    assert (low >= np.array([-0.015, -0.3, 0.0]) - 1e-5).all() and (high <= np.array([0.015, 0.3, 0.5]) + 1e-5).all()
    edge = [parts["canvas"].vertices[:, 1:].astype(float) for parts in (straight, askew)]
    slopes = [math.atan2(*(points[points[:, 0].argmax()] - points[points[:, 1].argmin()])[::-1]) for points in edge]
    assert abs(slopes[1]) == pytest.approx(0.06, abs=0.01) or abs(slopes[1] - slopes[0]) > 0.03


def test_a_drawn_curtain_covers_more_of_one_side() -> None:
    size = (0.1, 2.2, 2.3)
    for style in MODELS["curtain"].styles:
        before, after = (build_model("curtain", style, 2, size), moved("curtain", style, size, 1.0, 2))
        y = [parts["cloth"].vertices[:, 1] for parts in (before, after)]
        assert y[1][y[1] < 0.0].max() == y[0][y[0] < 0.0].max()
        assert y[1].max() == pytest.approx(y[0].max()) and y[1][y[0] > 0.0].min() < 0.5 * y[0][y[0] > 0.0].min()
