"""Noise of ranges is judged by rays that meet what they should: those through glass and off mirrors are far away, however many."""

import numpy as np
import pytest

from scene_synth_ros.prove.ranges import noise

TRUE = np.linspace(0.5, 3.0, 4000)
SAID = {"noise_m": 0.01, "noise_share": 0.0, "resolution_m": 0.001}
NORMAL = np.random.default_rng(3).normal(size=4000)


def good(read: np.ndarray) -> bool:
    return all(verdict.good for verdict in noise("scan_noise", "scan", read, TRUE, SAID))


def test_rays_through_glass_are_no_noise() -> None:
    through = np.where(np.arange(4000) % 5 < 2, 1.7, 0.0)  # 40 % of them
    assert good(TRUE + 0.01 * NORMAL + through)


@pytest.mark.parametrize("read", [TRUE + 0.02 * NORMAL, TRUE + 0.2 * NORMAL, TRUE + 0.002 * NORMAL, TRUE + 0.5, 1.2 * TRUE])
def test_other_noise_is_told_and_so_are_ranges_that_are_all_wrong(read: np.ndarray) -> None:
    assert not good(read)
