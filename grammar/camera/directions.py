"""Directions of view along a walk: yaw by dynamic programming over rings of views, pitch by what stands in view, both of limited rate.

Angles between keys follow monotone cubics (PCHIP), written out here because importing scipy.interpolate takes as long as the rest of scipy.
"""

import math
from typing import NamedTuple

import numpy as np

import kernel_cache.elementary as el
from grammar.camera.path_config import CameraPathConfig, Mount
from grammar.camera.view_ring import RING_COLUMNS, Ring, Views, best_columns, column_azimuth_rad
from grammar.camera.walk import Walk, position_at
from grammar.geometry.arrays import Floats, Ints

_KEY_SPACING_M = 0.3
_YAW_SHARE = 0.75
"""Share of the greatest turn between frames that yaw may take; pitch takes the rest."""

_PITCH_TO_OBJECTS = 0.65
"""Weight of the elevation of objects in view against the middle of the mount's range of pitch."""

_TURN_COST = 0.002
_PITCH_OFFSET_SD_RAD = 0.03


class Gaze(NamedTuple):
    """Where a camera looks along a walk: keys (k,) of progress in metres, their rings, columns of these, and what views are worth."""

    keys_m: Floats
    rings: list[Ring]
    columns: Ints
    worth: float


def choose_gaze(views: Views, walk: Walk, length_m: float) -> Gaze:
    """Return the directions with the best views that a camera of limited turns can have.

    Worth is their mean and the least of them, and the more of the first the larger ``first_weight`` is.
    """
    # judge the views from key stations along the walk
    config = views.config
    keys_m = np.linspace(0.0, length_m, max(math.ceil(length_m / _KEY_SPACING_M), 1) + 1)
    rings = [views.ring(station) for station in position_at(walk, keys_m)]
    values = np.array([views.values(ring) for ring in rings])
    # choose the columns with the best total value, minus the cost of turns
    scores = _scores(config, keys_m, values, moves=len(walk.points_m) > 1)
    key_turn_rad = _YAW_SHARE * config.max_turn_rad * (keys_m[1] - keys_m[0]) / config.max_step_m
    columns = best_columns(scores, max(int(key_turn_rad / (2.0 * math.pi / RING_COLUMNS)), 1), _TURN_COST)
    chosen = values[np.arange(len(keys_m)), columns]
    first = 0.5 * (config.first_weight - 1.0) * chosen[0]
    return Gaze(keys_m, rings, columns, float(chosen.mean() + chosen.min() + first))


def sample_directions(rng: np.random.Generator, views: Views, mount: Mount, gaze: Gaze, along_m: Floats) -> tuple[Floats, Floats]:
    """Return yaw (unwrapped) and pitch in radians, (n,) each, at progress ``along_m`` (n,) of a walk."""
    config, keys_m = views.config, gaze.keys_m
    key_yaw = np.unwrap(column_azimuth_rad()[gaze.columns])
    offset = rng.normal(0.0, _PITCH_OFFSET_SD_RAD)
    key_pitch = [_pitch_of_view(views, mount, ring, column) + offset for ring, column in zip(gaze.rings, gaze.columns, strict=True)]
    # interpolate between the keys and limit the turn from frame to frame
    step_m = along_m[1] - along_m[0] if len(along_m) > 1 else 0.0
    turn = config.max_turn_rad * step_m / config.max_step_m
    yaw = _limit_rate(_interpolate(keys_m, key_yaw, along_m), _YAW_SHARE * turn)
    pitch = np.clip(_interpolate(keys_m, np.array(key_pitch), along_m), *mount.pitch_rad)
    return yaw, _limit_rate(pitch, (1.0 - _YAW_SHARE) * turn)


def _scores(config: CameraPathConfig, keys_m: Floats, values: Floats, *, moves: bool) -> Floats:
    """Return (k, RING_COLUMNS) what each direction is worth at each key: its view, and its nearness to a steady sweep of the room.

    The sweep is the one, of all beginnings and both senses, whose views are best, the first view counting ``first_weight`` times.  A camera
    that cannot move only sweeps.
    """
    azimuth, keys = column_azimuth_rad(), np.arange(len(keys_m))
    step = 2.0 * math.pi / RING_COLUMNS
    counts = np.where(keys == 0, config.first_weight, 1.0)
    sweeps = [begin + sense * config.sweep_rad_per_m * keys_m for sense in (-1.0, 1.0) for begin in azimuth]
    worth = [float((counts * values[keys, np.rint(sweep / step).astype(np.int64) % RING_COLUMNS]).sum()) for sweep in sweeps]
    sweep_to = sweeps[int(np.argmax(worth))]
    scores = moves * values + config.sweep_weight * el.cos(azimuth[None, :] - sweep_to[:, None])
    scores[0] += (config.first_weight - 1.0) * moves * values[0]
    return np.asarray(scores)


def _pitch_of_view(views: Views, mount: Mount, ring: Ring, column: int) -> float:
    """Return the mean elevation of the objects in view, drawn towards the middle of the mount's range; that middle if there are none."""
    wide = views.columns_wide
    view = (column + np.arange(wide) - wide // 2) % RING_COLUMNS
    shown = (ring.hit[view] >= 0) & (ring.distance_m[view] >= views.config.near_m)
    middle = 0.5 * (mount.pitch_rad[0] + mount.pitch_rad[1])
    if not shown.any():
        return middle
    elevation = float(np.broadcast_to(np.array(views.config.elevations_rad), shown.shape)[shown].mean())
    return _PITCH_TO_OBJECTS * elevation + (1.0 - _PITCH_TO_OBJECTS) * middle


def _interpolate(keys: Floats, values: Floats, at: Floats) -> Floats:
    """Interpolate monotonically between keys; of one place, return its value."""
    if keys[-1] <= keys[0]:
        return np.full(len(at), values[0])
    return interpolate_monotonically(keys, values, at)


def _limit_rate(angles: Floats, most: float) -> Floats:
    """Return angles that follow the given ones by at most ``most`` a step."""
    limited = angles.copy()
    for k in range(1, len(angles)):
        limited[k] = limited[k - 1] + min(max(angles[k] - limited[k - 1], -most), most)
    return limited


def interpolate_monotonically(keys: Floats, values: Floats, at: Floats) -> Floats:
    """Return a smooth curve through points, keys (k,) and values (k,), two and more, that rises and falls only where they do.

    It is the cubic Hermite curve with the slopes of F. N. Fritsch and J. Butland, "A Method for Constructing Local Monotone Piecewise Cubic
    Interpolants", SIAM J. Sci. Stat. Comput. 5 (1984), the same bits as scipy's ``PchipInterpolator``; ``at`` (n,) lies within the keys.
    """
    steps = np.diff(keys)
    slopes = np.diff(values) / steps
    tangents = _tangents(steps, slopes)
    third = (tangents[:-1] + tangents[1:] - 2.0 * slopes) / steps
    coefficients = (values[:-1], tangents[:-1], (slopes - tangents[:-1]) / steps - third, third / steps)
    piece = np.clip(np.searchsorted(keys, at, side="right") - 1, 0, len(steps) - 1)
    along = at - keys[piece]
    result, power = np.zeros(len(at)), np.ones(len(at))
    for coefficient in coefficients:
        result = result + coefficient[piece] * power
        power = power * along
    return result


def _tangents(steps: Floats, slopes: Floats) -> Floats:
    """Return the curve's slope at each key: 0 where it turns, else the weighted harmonic mean of the slopes on both sides."""
    if len(slopes) == 1:
        return np.repeat(slopes, 2)
    tangents = np.zeros(len(slopes) + 1)
    goes_on = np.sign(slopes[1:]) * np.sign(slopes[:-1]) > 0.0
    before, after, left, right = (each[goes_on] for each in (steps[:-1], steps[1:], slopes[:-1], slopes[1:]))
    weight_left, weight_right = 2.0 * after + before, after + 2.0 * before
    tangents[1:-1][goes_on] = 1.0 / ((weight_left / left + weight_right / right) / (weight_left + weight_right))
    tangents[0] = _end_tangent(steps[0], steps[1], slopes[0], slopes[1])
    tangents[-1] = _end_tangent(steps[-1], steps[-2], slopes[-1], slopes[-2])
    return tangents


def _end_tangent(step: float, next_step: float, slope: float, next_slope: float) -> float:
    """Return the slope at an end: of the parabola through three points, as far as the curve stays monotone."""
    tangent = ((2.0 * step + next_step) * slope - step * next_slope) / (step + next_step)
    if np.sign(tangent) != np.sign(slope):
        return 0.0
    if np.sign(slope) != np.sign(next_slope) and abs(tangent) > 3.0 * abs(slope):
        return 3.0 * slope
    return tangent
