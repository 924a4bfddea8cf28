"""A camera's walk through a room: collision-free, smooth, upright, and looking at what there is to see.

The walk joins points with good views along shortest paths over the floor, is smoothed like an elastic band that may not touch anything, and
is sampled once a frame.  The direction of view comes from dynamic programming over coarse panoramas (:mod:`grammar.camera.directions`);
yaw and pitch are interpolated rather than quaternions, so that the horizon stays level.
"""

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

import kernel_cache.elementary as el
from grammar.camera.directions import Gaze, choose_gaze, sample_directions
from grammar.camera.path_config import CameraPathConfig, Mount
from grammar.camera.sights import Sights
from grammar.camera.still import best_shot, places_in_reach
from grammar.camera.view_ring import Views
from grammar.camera.walk import Ground, Walk, choose_ground, find_routes, position_at, sample_walk
from grammar.geometry.arrays import Boxes, Floats
from grammar.geometry.boxes import HALF_DEPTH, HALF_WIDTH, NO_BOXES, Z_HIGH, Z_LOW
from scene_description import CameraPose
from scene_description.polygons import signed_area_m2
from scene_description.poses import look_at

_TRIAL_STATIONS = 8
_REACH_SHARE = 0.5
"""Of the free floor's longer side, how far few frames walk: beyond that they would end before a wall."""
_ON_FLOOR_M, _LOW_M = 0.3, 1.6
"""Heights below which things begin that stand on the floor, and end that one looks down on: beds, sofas, tables, cars, but no cupboards."""
NO_SIGHTS = Sights()


@dataclass(frozen=True, slots=True, kw_only=True)
class CameraTimes:
    """When the camera takes its frames: frame k of the room is at ``start_ns + round((first_index + k) * 1e9 / rate_hz)``."""

    frames: int
    start_ns: int
    rate_hz: float
    first_index: int = 0


class CameraSpace(NamedTuple):
    """Where the camera goes: (n, 2) outline of the floor, counter-clockwise, world, metres; the ceiling's height; (b, 8) solids.

    roof: (r, 8) boxes that fill what a sloped ceiling cuts off, which the camera keeps clear of but does not look for.
    sights: what it looks for beside the solids, and which of all that is bright.
    """

    polygon_m: ArrayLike
    height_m: float
    boxes: Boxes
    roof: Boxes = NO_BOXES
    sights: Sights = NO_SIGHTS

    @property
    def solids(self) -> Boxes:
        """Solids and boxes of the roof, which nothing passes through."""
        return np.ascontiguousarray(np.concatenate([self.boxes, self.roof]), np.float64)

    def views(self, config: CameraPathConfig, lens_m: float) -> Views:
        """Return what views are judged in, for a lens at a height; doors stand for things that are missing."""
        sights = self.sights
        slabs = np.concatenate([sights.windows, sights.doors])
        seen = np.ascontiguousarray(np.concatenate([self.boxes, slabs, self.roof]), np.float64)
        things = len(self.boxes) + len(slabs)
        bright = np.zeros(len(self.boxes) + len(sights.windows), np.bool_)
        bright[: len(sights.bright)] = sights.bright
        tall = (seen[:things, Z_LOW] < lens_m) & (seen[:things, Z_HIGH] > lens_m)
        tall[len(self.boxes) : len(bright)] = False  # windows
        polygon = np.ascontiguousarray(self.polygon_m, np.float64)
        return Views(config, polygon, self.height_m, seen, lens_m, things, bright, main=self._main, tall=tall)

    @property
    def _main(self) -> int:
        """Which of the solids on the floor is the largest of those that one looks down on, -1 where there is none."""
        boxes = self.boxes
        volume = boxes[:, HALF_DEPTH] * boxes[:, HALF_WIDTH] * (boxes[:, Z_HIGH] - boxes[:, Z_LOW])
        volume = volume * ((boxes[:, Z_LOW] < _ON_FLOOR_M) & (boxes[:, Z_HIGH] < _LOW_M))
        return int(np.argmax(volume)) if volume.any() else -1


def sample_camera_path(
    rng: np.random.Generator, config: CameraPathConfig, space: CameraSpace, times: CameraTimes
) -> tuple[CameraPose, ...]:
    """Sample the poses of a camera's optical frame, one a frame.

    Where the room is too crowded for the distances of ``config`` they are lowered step by step; in the worst case the camera turns on the
    spot that has most room.  Neighbouring poses differ by at most the larger of ``max_step_m`` along the floor and by ``max_turn_rad`` of
    rotation.  A single frame is a photograph, with settings of its own (``still``).
    """
    if times.frames == 1:
        return (_photograph(rng, config, space, times),)
    # draw who carries the camera, and walk
    mount, lens_m = sample_mount(rng, config, space.height_m)
    views = space.views(config, lens_m)
    frames = times.frames
    keep_m = (config.body_radius_m, config.clearance_m)
    ground = choose_ground(views.polygon, space.solids, lens_m, config.sway_m, *keep_m, config.resolution_m)
    span_m = float(np.ptp(ground.cells_m, axis=0).max())
    reach_m = min(config.path_length_m, _REACH_SHARE * span_m)
    step_m = min(config.max_step_m, max(reach_m / max(frames - 1, 1), config.speed_m_s / times.rate_hz))
    length_m = step_m * (frames - 1)
    walk, gaze = best_walk(rng, views, ground, length_m)
    # sample position and direction at each frame
    along_m = step_m * np.arange(frames, dtype=np.float64)
    xy = position_at(walk, along_m)
    z = lens_m + config.sway_m * el.sin(rng.uniform(0.0, 2.0 * math.pi) + 2.0 * math.pi * along_m / rng.uniform(1.0, 2.0))
    yaw, pitch = sample_directions(rng, views, mount, gaze, along_m)
    return tuple(_pose(times, k, xy[k], float(z[k]), float(yaw[k]), float(pitch[k])) for k in range(frames))


def _photograph(rng: np.random.Generator, config: CameraPathConfig, space: CameraSpace, times: CameraTimes) -> CameraPose:
    """Return the pose of the best view of all within reach of a photographer."""
    config = config.for_still(signed_area_m2(np.asarray(space.polygon_m, np.float64).tolist()))
    _, lens_m = sample_mount(rng, config, space.height_m)
    views = space.views(config, lens_m)
    shot = best_shot(rng, views, places_in_reach(views.polygon, space.solids, lens_m, config))
    return _pose(times, 0, shot.place_m, lens_m, shot.yaw_rad, shot.pitch_rad)


def _pose(times: CameraTimes, index: int, place_m: Floats, lens_m: float, yaw_rad: float, pitch_rad: float) -> CameraPose:
    """Return the pose of a frame of the room from its place (2,), height and direction of view."""
    stamp_ns = times.start_ns + round((times.first_index + index) * 1_000_000_000 / times.rate_hz)
    position = (float(place_m[0]), float(place_m[1]), lens_m)
    return CameraPose(stamp_ns=stamp_ns, position_m=position, orientation=_orientation(yaw_rad, pitch_rad))


def sample_mount(rng: np.random.Generator, config: CameraPathConfig, height_m: float) -> tuple[Mount, float]:
    """Draw a mount and the height of its lens, which stays below the ceiling."""
    mounts = list(config.mounts.values())
    weights = np.array([mount.probability for mount in mounts])
    mount = mounts[int(rng.choice(len(mounts), p=weights / weights.sum()))]
    lens_m = float(rng.uniform(*mount.height_m))
    return mount, min(lens_m, height_m - config.clearance_m - config.sway_m)


def best_walk(rng: np.random.Generator, views: Views, ground: Ground, length_m: float) -> tuple[Walk, Gaze]:
    """Return the walk with the best views out of a few, and where to look along it; the longer the walk, the fewer are tried."""
    config = views.config
    cells = rng.permutation(len(ground.cells_m))[: config.viewpoint_trials]
    rings = [views.ring(ground.cells_m[cell]) for cell in cells]
    quality = [float(views.values(ring).max()) for ring in rings]
    best_cells = cells[np.argsort(np.negative(quality), kind="stable")]
    routes = find_routes(ground, best_cells[: config.viewpoints])
    trials = max(int(config.path_trials * min(1.0, 2.0 * config.path_length_m / max(length_m, 1e-9))), 1)
    walks = [sample_walk(rng, ground, routes, length_m, config.smoothing_m) for _ in range(trials)]
    gazes = [choose_gaze(views, walk, length_m) for walk in walks]
    values = [config.travel_weight * _travel(walk, length_m) + gaze.worth for walk, gaze in zip(walks, gazes, strict=True)]
    best = int(np.argmax(values))
    return walks[best], gazes[best]


def _travel(walk: Walk, length_m: float) -> float:
    """Return the share of its length by which a walk gets away from its start."""
    away = position_at(walk, np.linspace(0.0, length_m, _TRIAL_STATIONS)) - walk.points_m[0]
    return float(np.linalg.norm(away, axis=1).max()) / max(length_m, 1e-9)


def _orientation(yaw_rad: float, pitch_rad: float) -> tuple[float, float, float, float]:
    """Return the rotation of an upright optical frame that looks along a yaw and a pitch."""
    level = math.cos(pitch_rad)
    return look_at((0.0, 0.0, 0.0), (level * math.cos(yaw_rad), level * math.sin(yaw_rad), math.sin(pitch_rad)))
