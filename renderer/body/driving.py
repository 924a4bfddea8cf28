"""A base that follows velocities as well as its limits and its surroundings let it: its curves grow by one control point after another.

Differences of a B-spline's control points bound the derivatives of the curve (C. de Boor, "A Practical Guide to Splines", 1978), so control
points whose first, second and third differences keep to limits of speed, acceleration and jerk give a curve that does.  The base stops for
obstacles as in the dynamic window approach (D. Fox, W. Burgard and S. Thrun, IEEE Robotics and Automation Magazine 4(1), 1997): a control
point is taken only if the base could still brake, within its limits, before its footprint comes too near to anything.
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from renderer.body.obstacles import Obstacles
from scene_description.kinematics import driven_way, knot_places
from scene_description.motion import DEGREE, Drive, Motion

SPACING_S = 0.02
"""Time between control points.  A curve is known three of them later than its last: so long a command takes to be felt."""
_SHARES = (1.0, 0.5, 0.25, 0.125, 0.0)
"""Shares of the speed asked for that are tried in turn where something is in the way, each with the whole turn."""
_SLACK_M = 0.002
"""What the control points' polygon is off the curve by at most, and rounding."""
_LONGEST_STOP = 5_000
_STILL = 1e-9


class DriveLimits(NamedTuple):
    """What a base can do along its heading and about its axis, and its footprint's radius."""

    max_speed_m_s: float
    acceleration_m_s2: float
    jerk_m_s3: float
    max_turn_rad_s: float
    turn_acceleration_rad_s2: float
    turn_jerk_rad_s3: float
    radius_m: float


class _Axis(NamedTuple):
    """Distance gone or heading at the last control point, with its first and second difference by time."""

    value: float
    rate: float = 0.0
    change: float = 0.0


class _State(NamedTuple):
    """Both axes, and where the base is by the polygon of control points."""

    way: _Axis
    turn: _Axis
    x_m: float
    y_m: float


class BaseDriver:
    """The drive of a base, as far as it is known.

    Args:
        motion: of the room, on wheels; the base stands where it begins.
        obstacles: what it stops for.

    Attributes:
        distances_m, headings_rad: all control points so far.
    """

    def __init__(self, motion: Motion, limits: DriveLimits, obstacles: Obstacles) -> None:
        assert motion.drive is not None
        heading = float(driven_way(motion.drive, motion.spacing_s, np.zeros(1))[0][0, 1])
        self._motion, self._limits, self._obstacles = motion, limits, obstacles
        self.distances_m = [0.0] * (DEGREE + 1)
        self.headings_rad = [heading] * (DEGREE + 1)
        x, y = motion.drive.start_m
        self._places = [(x, y)]
        self._state = _State(_Axis(0.0), _Axis(heading), x, y)

    @property
    def known_s(self) -> float:
        """Until when the motion is known."""
        return (len(self.distances_m) - DEGREE) * SPACING_S

    def drive(self, until_s: float, speed_m_s: float, turn_rad_s: float) -> None:
        """Follow a velocity until the motion is known for so long."""
        speed, turn = _limited(speed_m_s, self._limits.max_speed_m_s), _limited(turn_rad_s, self._limits.max_turn_rad_s)
        steps = max(math.ceil((until_s - self.known_s) / SPACING_S - 1e-9), 0)
        close = self._obstacles.near((self._state.x_m, self._state.y_m), self._reach_m(steps)) if steps else self._obstacles
        for _ in range(steps):
            state = self._next(close, speed, turn)
            self.distances_m.append(state.way.value)
            self.headings_rad.append(state.turn.value)
            self._state = state

    def motion_since(self, since_s: float) -> Motion:
        """Return the motion from the knot before a time on, as far as it is known; the same there as the whole."""
        first = min(max(math.floor(since_s / SPACING_S), 0), len(self._places) - 1)
        drive = Drive(
            start_m=self._places[first],
            distances_m=tuple(self.distances_m[first:]),
            headings_rad=tuple(self.headings_rad[first:]),
            first_knot=first,
        )
        found = knot_places(drive).tolist()
        self._places += [(x, y) for x, y in found[len(self._places) - first :]]
        return _on_wheels(self._motion, drive)

    def _next(self, close: Obstacles, speed: float, turn: float) -> _State:
        """Return the next control point: towards the greatest share of a speed after which the base can still stop in time."""
        for share in _SHARES:
            state = self._step(self._state, share * speed, turn)
            if self._is_clear(close, state):
                return state
        return self._step(self._state, 0.0, 0.0)

    def _is_clear(self, close: Obstacles, state: _State) -> bool:
        """Return whether the base, if it goes on to a state and stops then, keeps its footprint clear, or comes no nearer than it is.

        Distances change by at most a metre a metre, so what two places keep bounds what the way between them does.
        """
        places = np.array([(at.x_m, at.y_m) for at in (self._state, state, *self._stop(state))])
        clear = close.clearance_m(places)
        ways = np.sqrt((np.diff(places, axis=0) ** 2).sum(axis=1))
        keep_m = self._limits.radius_m + _SLACK_M
        return bool((0.5 * (clear[1:] + clear[:-1] - ways)).min() >= keep_m) or bool(keep_m > clear[0] <= clear.min())

    def _stop(self, state: _State) -> Iterator[_State]:
        """Yield how the base would come to rest."""
        for _ in range(_LONGEST_STOP):
            if max(abs(state.way.rate), abs(state.turn.rate)) < _STILL:
                return
            state = self._step(state, 0.0, 0.0)
            yield state

    def _step(self, state: _State, speed: float, turn: float) -> _State:
        limits = self._limits
        way = _towards(state.way, speed, limits.acceleration_m_s2, limits.jerk_m_s3)
        heading = _towards(state.turn, turn, limits.turn_acceleration_rad_s2, limits.turn_jerk_rad_s3)
        middle = 0.5 * (state.turn.value + heading.value)
        gone = way.value - state.way.value
        return _State(way, heading, state.x_m + gone * math.cos(middle), state.y_m + gone * math.sin(middle))

    def _reach_m(self, steps: int) -> float:
        """Return how far the base and its footprint may reach in some steps and a stop after them."""
        limits = self._limits
        stop_s = limits.max_speed_m_s / limits.acceleration_m_s2 + 2.0 * limits.acceleration_m_s2 / limits.jerk_m_s3
        return limits.radius_m + limits.max_speed_m_s * (steps * SPACING_S + stop_s) + 0.1


def whole_motion(motion: Motion, distances_m: Sequence[float], headings_rad: Sequence[float]) -> Motion:
    """Return the motion of a room whose base was driven along control points from its beginning on."""
    assert motion.drive is not None
    return _on_wheels(motion, Drive(start_m=motion.drive.start_m, distances_m=tuple(distances_m), headings_rad=tuple(headings_rad)))


def _on_wheels(motion: Motion, drive: Drive) -> Motion:
    return replace(motion, spacing_s=SPACING_S, drive=drive)


def _towards(axis: _Axis, rate: float, most_change: float, most_jerk: float) -> _Axis:
    """Return an axis a step later, on its way to a rate, which it reaches as fast as its limits let it, and does not pass.

    With changes that fall by j h a step, a last change a after m - 1 such steps adds h (m a + j h m (m - 1) / 2) to the rate.
    """
    h, fall = SPACING_S, most_jerk * SPACING_S
    missing = rate - axis.rate
    count = max(math.ceil(0.5 * (math.sqrt(1.0 + 8.0 * abs(missing) / (fall * h)) - 1.0) - 1e-9), 1)
    wanted = math.copysign(abs(missing) / (h * count) + 0.5 * fall * (count - 1), missing)
    change = min(max(wanted, axis.change - fall, -most_change), axis.change + fall, most_change)
    reached = rate if change == wanted and count == 1 else axis.rate + h * change
    return _Axis(axis.value + h * reached, reached, change)


def _limited(value: float, most: float) -> float:
    """Return a value within a limit of either sign; what is no number is 0."""
    return max(-most, min(most, value)) if math.isfinite(value) else 0.0
