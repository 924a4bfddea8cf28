"""Motions of what is carried or flies: along the walk of a camera, or on the spot, with sway, tremor and the tilt of a drone."""

import math
from typing import NamedTuple

import numpy as np

from grammar.camera.camera_path import best_walk, sample_mount
from grammar.camera.directions import sample_directions
from grammar.camera.motion_config import MotionConfig
from grammar.camera.motion_plan import REACH, MotionPlan, as_points, control_times, ease, eased_time, euler_quaternion
from grammar.camera.walk import Ground, choose_ground, position_at, slack_at
from grammar.geometry.arrays import Floats
from scene_description.kinematics import camera_kinematics, rotate, sines
from scene_description.motion import Harmonic, Motion

SPACING_S = 0.1
_REACH_S = REACH * SPACING_S
GRAVITY_M_S2 = 9.80665
_EASE_S = 1.5
"""Time in which what is carried comes up to its speed and its sway."""
_HAND_HZ, _DRONE_HZ = (0.25, 1.6), (0.25, 0.8)
_SWAY_LINES = 6
_TREMOR_SPREAD = (0.92, 0.97, 1.0, 1.04, 1.09)
_STATION_M = 0.02
_KEPT_SHARE = 0.5
"""Share of the distances to keep that sway leaves."""
_SHRINKS = 5


class Carrier(NamedTuple):
    """What is special about a carrier.

    walks: it goes along a walk; sway_hz: band in which it sways, as the settings say; trembles: as the settings say, too; tilts: as a
    drone does to accelerate; spins: it turns all the time.
    """

    walks: bool = False
    sway_hz: tuple[float, float] | None = None
    trembles: bool = False
    tilts: bool = False
    spins: bool = False


CARRIERS = {
    "handheld": Carrier(walks=True, sway_hz=_HAND_HZ, trembles=True),
    "flight": Carrier(walks=True, sway_hz=_DRONE_HZ, trembles=True, tilts=True),
    "still": Carrier(),
    "spin": Carrier(spins=True),
}
"""Kind of motion -> its carrier."""


class _Way(NamedTuple):
    """Where a body goes before it sways, at the times of its control points: place (c, 3), yaw and pitch (c,), and how near things are."""

    place_m: Floats
    yaw_rad: Floats
    pitch_rad: Floats
    ground: Ground


def carried_motion(rng: np.random.Generator, plan: MotionPlan) -> Motion:
    """Sample the motion of a carrier; it rests for ``rest_s`` first.

    Where sway would take the body too near to things, it is made smaller.
    """
    config, carrier = plan.config, CARRIERS[plan.config.kind]
    times = control_times(plan.duration_s, SPACING_S)
    way = _way(rng, plan, carrier, times)
    swaying = np.zeros((2, len(times), 3))
    if carrier.sway_hz is not None:
        swaying = _sways(rng, times, carrier.sway_hz) * ease(times, config.rest_s + _REACH_S, _EASE_S)[None, :, None]
    tremor = _tremor(rng, config) if carrier.trembles else ()
    for shrink in range(_SHRINKS + 1):
        size = 0.5**shrink if shrink < _SHRINKS else 0.0
        motion = _motion(config, carrier, way, size * swaying, tremor)
        if _keeps_clear(motion, way.ground):
            break
    return motion


def _way(rng: np.random.Generator, plan: MotionPlan, carrier: Carrier, times: Floats) -> _Way:
    """Return the way along a walk, or of standing at the best place."""
    config, path, space = plan.config, plan.path, plan.space
    mount, lens_m = sample_mount(rng, path, space.height_m)
    views = space.views(path, lens_m)
    ground = choose_ground(views.polygon, space.solids, lens_m, path.sway_m, path.body_radius_m, path.clearance_m, path.resolution_m)
    gone = config.speed_m_s * eased_time(times, config.rest_s + _REACH_S, _EASE_S)
    length_m = max(float(gone[-1]), _STATION_M)
    walk, gaze = best_walk(rng, views, ground, length_m)
    stations = np.arange(0.0, length_m + _STATION_M, _STATION_M)
    yaw, pitch = sample_directions(rng, views, mount, gaze, stations)
    gone = gone if carrier.walks else np.zeros_like(gone)
    place = np.column_stack([position_at(walk, gone), np.full(len(times), lens_m)])
    turned = config.turn_rad_s * eased_time(times, config.rest_s + _REACH_S, _EASE_S) if carrier.spins else 0.0
    return _Way(place, np.interp(gone, stations, yaw) + turned, np.interp(gone, stations, pitch), ground)


def _motion(config: MotionConfig, carrier: Carrier, way: _Way, swaying: Floats, tremor: tuple[Harmonic, ...]) -> Motion:
    """Return the motion of a way with its sway: (2, c, 3) of the place along world axes, and of yaw, pitch and roll."""
    place = way.place_m + config.sway_m * swaying[0]
    yaw, pitch, roll = (config.sway_rad * swaying[1]).T + np.stack([way.yaw_rad, way.pitch_rad, np.zeros(len(way.yaw_rad))])
    if carrier.tilts:
        pitch, roll = _tilt(place, yaw)
    turns = tuple(euler_quaternion(*angles) for angles in zip(yaw.tolist(), pitch.tolist(), roll.tolist(), strict=True))
    return Motion(
        kind=config.kind,  # type: ignore[arg-type]
        spacing_s=SPACING_S,
        positions_m=as_points(place - rotate(np.array(turns), np.array([config.camera_m]))),
        turns=turns,
        tremor=tremor,
        tremor_from_s=config.rest_s,
        tremor_ramp_s=_EASE_S,
        camera_m=config.camera_m,
    )


def _tilt(place_m: Floats, yaw_rad: Floats) -> tuple[Floats, Floats]:
    """Return pitch and roll with which a drone's thrust, along its z axis, gives the acceleration of its control points."""
    acceleration = np.zeros_like(place_m)
    acceleration[1:-1] = np.diff(place_m, n=2, axis=0) / SPACING_S**2
    sine, cosine = sines(yaw_rad)
    ahead = acceleration[:, 0] * cosine + acceleration[:, 1] * sine
    left = acceleration[:, 1] * cosine - acceleration[:, 0] * sine
    pitch, roll = (np.array([math.atan2(-value, GRAVITY_M_S2) for value in part.tolist()]) for part in (ahead, left))
    return pitch, roll


def _sways(rng: np.random.Generator, times: Floats, band_hz: tuple[float, float]) -> Floats:
    """Return (2, c, 3) sums of sines, as many an octave everywhere in a band, each number with standard deviation 1."""
    low, high = band_hz
    total = np.zeros((2, len(times), 3))
    edges = [low * math.pow(high / low, k / _SWAY_LINES) for k in range(_SWAY_LINES + 1)]
    share = math.sqrt(2.0 / _SWAY_LINES)
    for k in range(_SWAY_LINES):
        hertz, phase = rng.uniform(edges[k], edges[k + 1], (2, 1, 3)), rng.uniform(0.0, 2.0 * math.pi, (2, 1, 3))
        total += share * sines(2.0 * math.pi * hertz * times[None, :, None] + phase)[0]
    return total


def _tremor(rng: np.random.Generator, config: MotionConfig) -> tuple[Harmonic, ...]:
    """Return lines about ``tremor_hz`` that together have the standard deviations asked for."""
    share = math.sqrt(2.0 / len(_TREMOR_SPREAD))
    lines = []
    for spread in _TREMOR_SPREAD:
        phases = rng.uniform(0.0, 2.0 * math.pi, (2, 3))
        lines.append(
            Harmonic(
                frequency_hz=config.tremor_hz * spread,
                shift_m=(share * config.tremor_m,) * 3,
                shift_phase_rad=as_points(phases)[0],
                turn=(0.5 * share * config.tremor_rad,) * 3,
                turn_phase_rad=as_points(phases)[1],
            )
        )
    return tuple(lines)


def _keeps_clear(motion: Motion, ground: Ground) -> bool:
    """Return whether the camera keeps half of its distances all the way."""
    places = camera_kinematics(motion, np.arange(0.0, motion.duration_s, 0.2 * SPACING_S)).position_m
    keep, wall = _KEPT_SHARE * ground.keep_m, _KEPT_SHARE * ground.wall_keep_m
    return all(slack_at(ground.polygon, ground.boxes, keep, wall, x, y) >= 0.0 for x, y, _ in places.tolist())
