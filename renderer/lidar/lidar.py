"""The lidar of one room: its sweeps, each ray cast at its own time along the motion of the body that carries it."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from renderer.core.embree import SceneHandle
from renderer.core.kernel import entry
from renderer.core.random_numbers import make_frame_key
from renderer.core.ray_packet import LANES, make_packet
from renderer.lidar.divergence import spread
from renderer.lidar.echoes import Echoes, laser_surfaces, trace_echoes
from renderer.lidar.mount import STEP_S, Floats, steps_over
from renderer.lidar.reading import RangeErrors, limit_ranges
from renderer.lidar.returns import MODES, Returns, read_returns
from renderer.lidar.sweep_config import LidarConfig
from renderer.lidar.sweep_rays import SweepRays, sweep_rays
from renderer.scene.flat_scene import FlatScene
from scene_description.kinematics import kinematics, mounted_kinematics
from scene_description.motion import Motion
from scene_description.poses import quaternion_from_rpy

_LIDAR = 0x11DA53D
"""Tells the lidar's random numbers from those of cameras and of the planar scanner."""


class Sweep(NamedTuple):
    """One sweep of n rays.

    Attributes:
        rays: where they went in the lidar's frame, and when.
        ranges: (n, returns) float32, metres, what the lidar reads; infinite, of either sign, where nothing is measured.
        intensities: (n, returns) float32, remission, 1 for a white matt surface head-on.
        ideal: (n,) float32, the distance to the first surface, glass and mirrors too.
    """

    rays: SweepRays
    ranges: NDArray[np.float32]
    intensities: NDArray[np.float32]
    ideal: NDArray[np.float32]


class Lidar:
    """Sweeps one room; byte for byte the same for the same scene, configuration and number of the sweep.

    Threading: one sweep at a time.

    ``scene``: stays open for as long as the lidar is used; ``scene_key``: seeds the noise.

    Attributes:
        motion: of the body; may be replaced as more of it becomes known.
    """

    def __init__(self, scene: SceneHandle, flat: FlatScene, config: LidarConfig, motion: Motion, scene_key: int) -> None:
        self._scene, self._config, self.motion, self._scene_key = scene, config, motion, scene_key
        self._surfaces = laser_surfaces(flat)
        self._packet, self._lanes = make_packet(), np.zeros(2 * LANES, np.float32)
        self._turn = quaternion_from_rpy(config.mount_rotation_rad)
        self._rays: SweepRays | None = None
        self._spread: Floats = np.zeros((0, 1, 3))

    def sweep(self, number: int) -> Sweep:
        """Return a sweep by its number in the room; the first begins with the motion."""
        config = self._config
        if self._rays is None or config.pattern == "rosette":
            self._rays = sweep_rays(config, number)
            self._spread = spread(self._rays.directions, config.divergence_rad)
        echoes = self._trace(number / config.rate_hz, self._rays.times_s)
        kept = 2 if config.returns == "dual" else 1
        ranges, intensities = np.empty((2, config.rays, kept), np.float32)
        errors = RangeErrors(config.dark_range_m, config.noise_m, config.noise_share, config.resolution_m)
        returns = Returns(MODES[config.returns], config.separation_m, config.dropout_share)
        read_returns(echoes, errors, returns, make_frame_key(self._scene_key, number, (_LIDAR,)), ranges, intensities)
        limits = config.range_min_m, config.range_max_m
        return Sweep(self._rays, limit_ranges(ranges, *limits), intensities, limit_ranges(echoes.first[:, 0], *limits))

    def _trace(self, start_s: float, times_s: Floats) -> Echoes:
        """Return what comes back along the rays, (rays, rays of a beam) each."""
        steps_s = steps_over(times_s)
        at = mounted_kinematics(kinematics(self.motion, start_s + steps_s), self._config.mount_m, self._turn)
        shape = self._spread.shape[:2]
        origins, directions = np.empty((2, shape[0] * shape[1], 3), np.float32)
        _aim(at.position_m, at.quaternion, times_s, self._spread, origins, directions)
        echoes = Echoes(*np.empty((len(Echoes._fields), len(origins)), np.float32))
        trace_echoes(self._scene, self._surfaces, origins, directions, self._packet, self._lanes, echoes)
        return Echoes(*(values.reshape(shape) for values in echoes))


@entry
def _aim(
    places: Floats,
    turns: Floats,
    times_s: Floats,
    rays: Floats,
    origins: NDArray[np.float32],
    directions: NDArray[np.float32],
) -> None:
    """Fill origins and directions, (n k, 3) in the world, of rays (n, k, 3) in a frame that is at places (m, 3) and turns (m, 4).

    These are ``STEP_S`` apart, from the step before the first of the ascending times (n,) on; between them the frame moves evenly.
    """
    first = np.floor(times_s[0] / STEP_S)
    x, y, z, w = 0.0, 0.0, 0.0, 1.0
    for i in range(rays.shape[0]):
        along = times_s[i] / STEP_S - first
        cell = min(int(along), places.shape[0] - 2)
        share = along - cell
        side = 0.0
        for axis in range(4):
            side += turns[cell, axis] * turns[cell + 1, axis]
        near, far = 1.0 - share, share if side >= 0.0 else -share
        x = near * turns[cell, 0] + far * turns[cell + 1, 0]
        y = near * turns[cell, 1] + far * turns[cell + 1, 1]
        z = near * turns[cell, 2] + far * turns[cell + 1, 2]
        w = near * turns[cell, 3] + far * turns[cell + 1, 3]
        unit = 1.0 / np.sqrt(x * x + y * y + z * z + w * w)
        x, y, z, w = x * unit, y * unit, z * unit, w * unit
        for j in range(rays.shape[1]):
            row = i * rays.shape[1] + j
            a, b, c = rays[i, j, 0], rays[i, j, 1], rays[i, j, 2]
            p, q, r = 2.0 * (y * c - z * b), 2.0 * (z * a - x * c), 2.0 * (x * b - y * a)
            directions[row, 0] = a + w * p + y * r - z * q
            directions[row, 1] = b + w * q + z * p - x * r
            directions[row, 2] = c + w * r + x * q - y * p
            for axis in range(3):
                origins[row, axis] = places[cell, axis] + share * (places[cell + 1, axis] - places[cell, axis])
