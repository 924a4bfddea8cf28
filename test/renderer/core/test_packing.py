"""Packed lanes: those that are chosen, in order, wherever they land and however the processor does it."""

import numpy as np
import pytest
from numba import njit

from renderer.core import lanes as ln
from renderer.core import packing
from renderer.core.ray_packet import LANES


@pytest.mark.parametrize("feature", [packing._VECTOR_FEATURE, "none"])
def test_chosen_lanes_come_side_by_side_and_nothing_before_or_far_behind_changes(monkeypatch: pytest.MonkeyPatch, feature: str) -> None:
    monkeypatch.setattr(packing, "_VECTOR_FEATURE", feature)

    @njit
    def compress(source, begin, lanes, choice, target, at):  # type: ignore[no-untyped-def]
        packing._compress(source, begin, lanes, choice, target, at)

    rng = np.random.default_rng(7)
    for chance in (0.0, 0.2, 0.5, 0.9, 1.0):
        for at in (0, 3, 16, 37):
            lanes = rng.normal(size=ln.LANES_SIZE).astype(np.float32)
            positive = rng.random(LANES) < chance
            lanes[ln.BETA_R : ln.BETA_R + LANES] = np.where(positive, rng.random(LANES) + 1e-30, -rng.integers(0, 2, LANES))
            slots = rng.integers(-(2**31), 2**31, LANES).astype(np.int32)
            lanes[ln.WIDTH : ln.WIDTH + 3] = np.nan, np.inf, -0.0
            chosen = lanes[ln.BETA_R : ln.BETA_R + LANES] > 0
            for source, begin in ((lanes, ln.WIDTH), (slots, 0)):
                target = rng.integers(0, 100, 64).astype(source.dtype)
                before = target.copy()
                compress(source, begin, lanes, ln.BETA_R, target, at)
                packed = source[begin : begin + LANES][chosen]
                assert target[at : at + len(packed)].tobytes() == packed.tobytes()
                assert np.array_equal(target[:at], before[:at]) and np.array_equal(target[at + LANES :], before[at + LANES :])
