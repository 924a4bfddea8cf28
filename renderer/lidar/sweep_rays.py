"""The rays of a lidar's sweep: where they go in its frame, and when."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

import kernel_cache.elementary as el
from renderer.lidar.mount import Floats
from renderer.lidar.sweep_config import LidarConfig


class SweepRays(NamedTuple):
    """Rays of a sweep in the order of their times.

    Attributes:
        directions: (n, 3) float64, unit, in the lidar's frame.
        times_s: (n,) float64, after the sweep's first.
        lines: (n,) uint16, number of the beam, from the lowest on.
    """

    directions: Floats
    times_s: Floats
    lines: NDArray[np.uint16]


def sweep_rays(config: LidarConfig, number: int) -> SweepRays:
    """Return the rays of a sweep; those of a spinning lidar are the same in each."""
    columns_s = np.asarray(np.arange(config.columns) * config.column_s, np.float64)
    if config.pattern == "rosette":
        return SweepRays(_rosette(config, number / config.rate_hz + columns_s), columns_s, np.zeros(config.columns, np.uint16))
    elevation = np.array(config.elevations_rad)
    after_s = np.arange(config.lines) * config.firing_s
    sense = -1.0 if config.clockwise else 1.0
    times_s = (columns_s[:, None] + after_s).ravel()
    turned = np.pi + sense * 2.0 * np.pi * config.rate_hz * times_s
    azimuth = turned + np.tile(np.broadcast_to(config.azimuths_rad, config.lines), config.columns)
    level, height = el.cos(elevation), el.sin(elevation)
    around = np.stack([el.cos(azimuth), el.sin(azimuth)], axis=1)
    directions = np.column_stack([around * np.tile(level, config.columns)[:, None], np.tile(height, config.columns)])
    ranks = np.argsort(np.argsort(elevation, kind="stable"), kind="stable").astype(np.uint16)
    return SweepRays(directions, times_s, np.tile(ranks, config.columns))


def _rosette(config: LidarConfig, times_s: Floats) -> Floats:
    """Return directions at times since the room's first sweep began."""
    aside = np.zeros((2, len(times_s)))
    for rate, angle in zip(config.prism_rates_hz, config.prism_angles_rad, strict=True):
        turned = 2.0 * np.pi * np.mod(rate * times_s, 1.0)
        aside += angle * np.stack([el.cos(turned), el.sin(turned)])
    off = np.sqrt((aside * aside).sum(axis=0))
    share = el.sin(off) / np.maximum(off, 1e-12)
    return np.column_stack([el.cos(off), share * aside[0], share * aside[1]])
