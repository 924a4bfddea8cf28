"""The laser scanner of one room: its scans, each ray cast at its own time along the camera's path."""

import math
from collections.abc import Iterator, Sequence

import numpy as np

import kernel_cache.elementary as el
from renderer.camera.rig import CarriedPath
from renderer.core.embree import SceneHandle
from renderer.core.random_numbers import make_frame_key
from renderer.core.ray_packet import LANES, make_packet
from renderer.lidar.config import ScanConfig
from renderer.lidar.divergence import spread
from renderer.lidar.echoes import Echoes, laser_surfaces, trace_echoes
from renderer.lidar.mount import Floats, Placement, along_path, mounted_scanner
from renderer.lidar.reading import RangeErrors, limit_ranges, read_beams
from renderer.lidar.scan import Scan
from renderer.scene.flat_scene import FlatScene
from scene_description.poses import quaternion_from_rotation
from scene_description.products import dot
from scene_description.types import CameraPose

_SECOND_NS = 1_000_000_000
_POSE_STEP_NS = 10_000_000
_SCANNER = 0x5CA77E12
"""Tells the scanner's random numbers from those of cameras."""


def scan_stamp_ns(config: ScanConfig, start_ns: int, index: int) -> int:
    """Return when the first beam of a scan leaves, in a room that starts at ``start_ns``."""
    return start_ns + round(index * _SECOND_NS / config.rate_hz)


def scans_of_path(config: ScanConfig, path: Sequence[CameraPose]) -> range:
    """Return the numbers of the scans that lie within a path from first beam to last; the first one in any case."""
    span_s = (path[-1].stamp_ns - path[0].stamp_ns) / _SECOND_NS - config.sweep_s
    return range(max(math.floor(span_s * config.rate_hz + 1e-6) + 1, 1))


def scanner_poses(config: ScanConfig, path: Sequence[CameraPose], stamp_ns: int) -> tuple[CameraPose, ...]:
    """Return where the scanner is when the first and the last beam of a scan leave, and between them at the poses of the path.

    It moves evenly from each to the next; of a body that moves smoothly they are so near to each other that it nearly does.
    """
    last_ns = stamp_ns + round(config.sweep_s * _SECOND_NS)
    smooth = isinstance(path, CarriedPath)
    known = range(stamp_ns, last_ns, _POSE_STEP_NS) if smooth else [pose.stamp_ns for pose in path]
    stamps = [stamp_ns, *(known_ns for known_ns in known if stamp_ns < known_ns < last_ns), last_ns]
    placement = mounted_scanner(config, along_path(path, stamp_ns, (np.array(stamps) - stamp_ns) / _SECOND_NS))
    return tuple(
        CameraPose(stamp_ns=stamp, position_m=_triple(place), orientation=quaternion_from_rotation(turn))
        for stamp, place, turn in zip(stamps, *placement, strict=True)
    )


class Scanner:
    """Scans one room; byte for byte the same for the same scene, configuration and scan number.

    Threading: one scan at a time.

    ``scene``: stays open for as long as the scanner is used; ``scene_key``: seeds the noise.
    """

    def __init__(self, scene: SceneHandle, flat: FlatScene, config: ScanConfig, scene_key: int) -> None:
        self._scene, self._config, self._scene_key = scene, config, scene_key
        self._surfaces = laser_surfaces(flat)
        self._packet, self._lanes = make_packet(), np.zeros(2 * LANES, np.float32)
        self._directions = beam_directions(config)
        self._times_s = np.arange(config.beams, dtype=np.float64) * config.time_increment_s

    def scan(self, index: int, stamp_ns: int, path: Sequence[CameraPose]) -> Scan:
        """Return a scan that begins at ``stamp_ns``.

        ``index``: its number in the room, from which its noise is made; ``path``: of the camera's rig, in the order of time; beyond its
        ends it goes on as it began and ended.
        """
        config = self._config
        placed = mounted_scanner(config, along_path(path, stamp_ns, self._times_s))
        echoes = self._trace(placed)
        ranges, intensities = np.empty((2, config.beams), np.float32)
        key = make_frame_key(self._scene_key, index, (_SCANNER,))
        errors = RangeErrors(config.dark_range_m, config.noise_m, config.noise_share, config.resolution_m)
        read_beams(echoes.length, echoes.remission, errors, key, ranges, intensities)
        limits = config.range_min_m, config.range_max_m
        intensities[~np.isfinite(limit_ranges(ranges, *limits))] = 0.0
        poses = scanner_poses(config, path, stamp_ns)
        return Scan(index, stamp_ns, poses, limit_ranges(ranges, *limits), limit_ranges(echoes.first[:, 0], *limits), intensities)

    def along(self, path: Sequence[CameraPose]) -> Iterator[Scan]:
        """Yield the scans of a path."""
        for index in scans_of_path(self._config, path):
            yield self.scan(index, scan_stamp_ns(self._config, path[0].stamp_ns, index), path)

    def _trace(self, placed: Placement) -> Echoes:
        """Return what comes back along the rays, (beams, rays of a beam) each."""
        shape = self._directions.shape[:2]
        directions = dot(self._directions[:, :, None], placed.rotation[:, None]).astype(np.float32).reshape(-1, 3)
        origins = np.repeat(placed.position_m.astype(np.float32), shape[1], axis=0)
        echoes = Echoes(*np.empty((len(Echoes._fields), len(origins)), np.float32))
        trace_echoes(self._scene, self._surfaces, origins, directions, self._packet, self._lanes, echoes)
        return Echoes(*(values.reshape(shape) for values in echoes))


def beam_directions(config: ScanConfig) -> Floats:
    """Return the unit directions (beams, rays of a beam, 3) of all rays in the scanner's frame."""
    angles = config.angle_min_rad + np.arange(config.beams) * config.angle_increment_rad
    return spread(np.column_stack([el.cos(angles), el.sin(angles), np.zeros(config.beams)]), config.divergence_rad)


def _triple(place: Floats) -> tuple[float, float, float]:
    x, y, z = (float(value) for value in place)
    return x, y, z
