"""A camera's walk through a room: collision-free, smooth, upright, and looking at what there is to see.

The walk joins points with good views along shortest paths over the floor, is smoothed like an elastic band that may not touch anything, and
is sampled once a frame.  The direction of view comes from dynamic programming over coarse panoramas (:mod:`grammar.camera.view_ring`); yaw
and pitch are interpolated rather than quaternions, so that the horizon stays level.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.interpolate import PchipInterpolator

from grammar.camera.view_ring import RING_COLUMNS, ViewWeights, best_turns, cast_ring, column_azimuth_rad, view_values
from grammar.camera.walk import Ground, Walk, choose_ground, find_routes, position_at, sample_walk
from grammar.geometry.arrays import Boxes
from grammar.spec.grammar_file import read_yaml
from grammar.spec.rules import GrammarError
from scene_description import CameraPose, FieldError, Limits, from_mapping
from scene_description.poses import look_at

Metres = Annotated[float, Limits(ge=0.0, le=100.0, unit="m")]
Weight = Annotated[float, Limits(ge=0.0, le=100.0)]
Pitch = Annotated[float, Limits(ge=-1.2, le=1.2, unit="rad")]
Height = Annotated[float, Limits(ge=0.1, le=3.0, unit="m")]
Trials = Annotated[int, Limits(ge=1, le=1000)]

_KEY_SPACING_M = 0.3
_TRIAL_STATIONS = 8
_YAW_SHARE = 0.75
_PITCH_TO_THINGS = 0.7


@dataclass(frozen=True, slots=True, kw_only=True)
class Mount:
    """Who carries the camera: its probability, the range of the lens's height above the floor and of its pitch, positive upwards."""

    probability: Annotated[float, Limits(ge=0.0, le=1.0)]
    height_m: tuple[Height, Height]
    pitch_rad: tuple[Pitch, Pitch]


@dataclass(frozen=True, slots=True, kw_only=True)
class CameraPathConfig:
    """How the camera moves and looks; ``config/camera.yaml`` explains each number."""

    mounts: Annotated[Mapping[str, Mount], Limits(min_length=1, max_length=16)]
    body_radius_m: Annotated[float, Limits(ge=0.05, le=2.0, unit="m")]
    clearance_m: Annotated[float, Limits(ge=0.02, le=1.0, unit="m")]
    resolution_m: Annotated[float, Limits(ge=0.01, le=0.5, unit="m")]
    path_length_m: Metres
    speed_m_s: Annotated[float, Limits(ge=0.0, le=10.0, unit="m/s")]
    max_step_m: Annotated[float, Limits(ge=0.001, le=2.0, unit="m")]
    max_turn_rad: Annotated[float, Limits(ge=0.01, le=1.5, unit="rad")]
    sway_m: Annotated[float, Limits(ge=0.0, le=0.2, unit="m")]
    smoothing_m: Annotated[float, Limits(ge=0.0, le=1.0, unit="m")]
    field_of_view_rad: Annotated[float, Limits(ge=0.1, le=3.0, unit="rad")]
    elevations_rad: Annotated[tuple[Pitch, ...], Limits(min_length=1, max_length=32)]
    near_m: Metres
    far_m: Annotated[float, Limits(ge=0.1, le=100.0, unit="m")]
    depth_weight: Weight
    things_weight: Weight
    near_weight: Weight
    travel_weight: Weight
    sweep_weight: Weight
    sweep_rad_per_m: Annotated[float, Limits(ge=0.0, le=10.0, unit="rad/m")]
    viewpoints: Annotated[int, Limits(ge=2, le=100)]
    viewpoint_trials: Trials
    path_trials: Trials

    @property
    def view_weights(self) -> ViewWeights:
        """How views are judged."""
        return ViewWeights(self.near_m, self.far_m, self.depth_weight, self.things_weight, self.near_weight)


def read_camera_path_config(path: Path) -> CameraPathConfig:
    """Read and check the settings of camera paths, for example ``config_path("camera.yaml")``.

    Raises:
        GrammarError: the file does not parse or a field does not fit; one line with file and field.
    """
    try:
        config = from_mapping(CameraPathConfig, read_yaml(path))
        total = math.fsum(mount.probability for mount in config.mounts.values())
        if abs(total - 1.0) > 1e-6:
            raise FieldError("mounts", "probabilities that sum to 1", f"{total:.6g}")
        for name, mount in config.mounts.items():
            for field in ("height_m", "pitch_rad"):
                low, high = getattr(mount, field)
                if low > high:
                    raise FieldError(f"mounts.{name}.{field}", "low <= high", f"[{low}, {high}]")
    except FieldError as error:
        raise GrammarError(f"{path}: {error}") from None
    return config


class _Room(NamedTuple):
    """What rays meet: (n, 2) outline, ceiling height, (b, 8) solids."""

    polygon: NDArray[np.float64]
    height_m: float
    boxes: Boxes


def sample_camera_path(
    rng: np.random.Generator,
    config: CameraPathConfig,
    polygon_m: ArrayLike,
    height_m: float,
    boxes: Boxes,
    frames: int,
    start_ns: int,
    rate_hz: float,
    first_index: int,
) -> tuple[CameraPose, ...]:
    """Sample the poses of a camera, one a frame.

    Where the room is too crowded for the distances of ``config`` they are lowered step by step; in the worst case the camera turns on the
    spot that has most room.

    Args:
        rng: the only source of randomness.
        config: limits of place, motion and view.
        polygon_m: (n, 2) floor outline, counter-clockwise, world, metres.
        height_m: height of the ceiling.
        boxes: (b, 8) solids, rows as :mod:`grammar.geometry.boxes` defines them.
        frames: number of poses, at least 1.
        start_ns: time of frame 0 of the run.
        rate_hz: frames a second of simulated time.
        first_index: number of the first frame within the run; frame k has the stamp ``start_ns + round(k * 1e9 / rate_hz)``.

    Returns:
        ``frames`` poses of the optical frame; neighbours differ by at most the larger of ``max_step_m`` along the floor and by
        ``max_turn_rad`` of rotation.
    """
    room = _Room(np.ascontiguousarray(polygon_m, np.float64), height_m, np.ascontiguousarray(boxes, np.float64))
    mount, lens_m = _sample_mount(rng, config, height_m)
    step_m = min(config.max_step_m, max(config.path_length_m / max(frames - 1, 1), config.speed_m_s / rate_hz))
    length_m = step_m * (frames - 1)
    ground = choose_ground(room.polygon, room.boxes, lens_m, config.sway_m, config.body_radius_m, config.clearance_m, config.resolution_m)
    walk = _best_walk(rng, config, room, ground, lens_m, length_m)
    along_m = step_m * np.arange(frames, dtype=np.float64)
    xy = position_at(walk, along_m)
    z = lens_m + config.sway_m * np.sin(rng.uniform(0.0, 2.0 * math.pi) + 2.0 * math.pi * along_m / rng.uniform(1.0, 2.0))
    yaw, pitch = _directions(rng, config, room, mount, walk, lens_m, along_m)
    poses = []
    for k in range(frames):
        position = (float(xy[k, 0]), float(xy[k, 1]), float(z[k]))
        stamp_ns = start_ns + round((first_index + k) * 1_000_000_000 / rate_hz)
        poses.append(CameraPose(stamp_ns=stamp_ns, position_m=position, orientation=_orientation(float(yaw[k]), float(pitch[k]))))
    return tuple(poses)


def _sample_mount(rng: np.random.Generator, config: CameraPathConfig, height_m: float) -> tuple[Mount, float]:
    mounts = list(config.mounts.values())
    weights = np.array([mount.probability for mount in mounts])
    mount = mounts[int(rng.choice(len(mounts), p=weights / weights.sum()))]
    lens_m = float(rng.uniform(*mount.height_m))
    return mount, min(lens_m, height_m - config.clearance_m - config.sway_m)


def _best_walk(rng: np.random.Generator, config: CameraPathConfig, room: _Room, ground: Ground, lens_m: float, length_m: float) -> Walk:
    """Return the walk with the best views out of a few; the longer a walk, the fewer are tried."""
    cells = rng.permutation(len(ground.cells_m))[: config.viewpoint_trials]
    quality = [_best_view(config, room, ground.cells_m[cell], lens_m) for cell in cells]
    routes = find_routes(ground, cells[np.argsort(np.negative(quality), kind="stable")][: config.viewpoints])
    trials = max(int(config.path_trials * min(1.0, 2.0 * config.path_length_m / max(length_m, 1e-9))), 1)
    walks = [sample_walk(rng, ground, routes, length_m, config.smoothing_m) for _ in range(trials)]
    return max(walks, key=lambda walk: _walk_value(config, room, walk, lens_m, length_m))


def _walk_value(config: CameraPathConfig, room: _Room, walk: Walk, lens_m: float, length_m: float) -> float:
    stations = position_at(walk, np.linspace(0.0, length_m, _TRIAL_STATIONS))
    travel = float(np.linalg.norm(stations - stations[0], axis=1).max()) / max(length_m, 1e-9)
    return config.travel_weight * travel + float(np.mean([_best_view(config, room, station, lens_m) for station in stations]))


def _best_view(config: CameraPathConfig, room: _Room, station_m: NDArray[np.float64], lens_m: float) -> float:
    return float(_views(config, room, *_ring(config, room, station_m, lens_m)).max())


def _ring(
    config: CameraPathConfig, room: _Room, station_m: NDArray[np.float64], lens_m: float
) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    position = np.array([station_m[0], station_m[1], lens_m])
    distance_m, hit = cast_ring(room.polygon, room.height_m, room.boxes, position, np.array(config.elevations_rad))
    return distance_m, hit


def _views(config: CameraPathConfig, room: _Room, distance_m: NDArray[np.float64], hit: NDArray[np.int64]) -> NDArray[np.float64]:
    return np.asarray(view_values(distance_m, hit, len(room.boxes), _columns_wide(config), config.view_weights))


def _columns_wide(config: CameraPathConfig) -> int:
    return max(round(config.field_of_view_rad / (2.0 * math.pi) * RING_COLUMNS), 1)


def _directions(
    rng: np.random.Generator,
    config: CameraPathConfig,
    room: _Room,
    mount: Mount,
    walk: Walk,
    lens_m: float,
    along_m: NDArray[np.float64],
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return yaw (unwrapped) and pitch of each frame, radians."""
    keys_m = np.linspace(0.0, float(along_m[-1]), max(math.ceil(float(along_m[-1]) / _KEY_SPACING_M), 1) + 1)
    stations = position_at(walk, keys_m)
    rings = [_ring(config, room, station, lens_m) for station in stations]
    values = np.array([_views(config, room, d, hit) for d, hit in rings])
    azimuth = column_azimuth_rad()
    middle_m = 0.5 * min(float(along_m[-1]), config.path_length_m)
    best = azimuth[int(np.argmax(values[np.argmin(np.abs(keys_m - middle_m))]))]
    sweep_to = best + rng.choice([-1.0, 1.0]) * config.sweep_rad_per_m * (keys_m - middle_m)
    moves = len(walk.points_m) > 1  # where it cannot walk, the camera looks all round instead
    liking = moves * values + config.sweep_weight * np.cos(azimuth[None, :] - sweep_to[:, None])
    column_rad = 2.0 * math.pi / RING_COLUMNS
    key_turn_rad = _YAW_SHARE * config.max_turn_rad * (keys_m[1] - keys_m[0]) / config.max_step_m
    columns = best_turns(liking, max(int(key_turn_rad / column_rad), 1), 0.002)
    key_yaw = np.unwrap(azimuth[columns])
    lift = rng.normal(0.0, 0.03)
    key_pitch = [_pitch_of_view(config, mount, d, hit, column) + lift for (d, hit), column in zip(rings, columns, strict=True)]
    step_m = along_m[1] - along_m[0] if len(along_m) > 1 else 0.0
    turn = config.max_turn_rad * step_m / config.max_step_m
    yaw = _limit_rate(_interpolate(keys_m, key_yaw, along_m), _YAW_SHARE * turn)
    pitch = np.clip(_interpolate(keys_m, np.array(key_pitch), along_m), *mount.pitch_rad)
    return yaw, _limit_rate(pitch, (1.0 - _YAW_SHARE) * turn)


def _pitch_of_view(config: CameraPathConfig, mount: Mount, distance_m: NDArray[np.float64], hit: NDArray[np.int64], column: int) -> float:
    """Return the mean elevation of what stands in view, drawn towards the middle of the mount's range; that middle if nothing does."""
    wide = _columns_wide(config)
    view = (column + np.arange(wide) - wide // 2) % RING_COLUMNS
    shown = (hit[view] >= 0) & (distance_m[view] >= config.near_m)
    middle = 0.5 * (mount.pitch_rad[0] + mount.pitch_rad[1])
    if not shown.any():
        return middle
    elevation = float(np.broadcast_to(np.array(config.elevations_rad), shown.shape)[shown].mean())
    return _PITCH_TO_THINGS * elevation + (1.0 - _PITCH_TO_THINGS) * middle


def _interpolate(keys: NDArray[np.float64], values: NDArray[np.float64], at: NDArray[np.float64]) -> NDArray[np.float64]:
    if keys[-1] <= keys[0]:
        return np.full(len(at), values[0])
    return np.asarray(PchipInterpolator(keys, values)(at))


def _limit_rate(angles: NDArray[np.float64], most: float) -> NDArray[np.float64]:
    limited = angles.copy()
    for k in range(1, len(angles)):
        limited[k] = limited[k - 1] + min(max(angles[k] - limited[k - 1], -most), most)
    return limited


def _orientation(yaw_rad: float, pitch_rad: float) -> tuple[float, float, float, float]:
    level = math.cos(pitch_rad)
    return look_at((0.0, 0.0, 0.0), (level * math.cos(yaw_rad), level * math.sin(yaw_rad), math.sin(pitch_rad)))
