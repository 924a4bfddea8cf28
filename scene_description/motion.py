"""How a body moves through a room, as smooth functions of time: what a camera, an IMU and wheels of one body have in common.

The body's frame is x forward, y left, z up (REP 103).  Time is in seconds since the first pose of the camera path.  Every curve is a
uniform B-spline of order 6, degree 5 (C. de Boor, "A Practical Guide to Splines", 1978), so that velocity, acceleration and two derivatives
more are continuous; :mod:`scene_description.kinematics` evaluates them.
"""

from dataclasses import dataclass
from typing import Annotated, Literal

from scene_description.strict import Limits

DEGREE = 5
"""Of all curves: segment i has the control points i to i + DEGREE."""
MAX_CONTROLS = 200_000

MotionKind = Literal["handheld", "flight", "base", "turntable", "still", "spin", "file"]
_Metres = Annotated[float, Limits(ge=-1000.0, le=1000.0, unit="m")]
_Radians = Annotated[float, Limits(ge=-1e6, le=1e6, unit="rad")]
_Part = Annotated[float, Limits(ge=-1.0001, le=1.0001)]
_Amplitude = Annotated[float, Limits(ge=-0.1, le=0.1)]
_Phase = Annotated[float, Limits(ge=-10.0, le=10.0, unit="rad")]
Vector = tuple[_Metres, _Metres, _Metres]
Turn = tuple[_Part, _Part, _Part, _Part]


@dataclass(frozen=True, slots=True, kw_only=True)
class Harmonic:
    """One line of a tremor's spectrum: a vibration of the body along world axes (m), and one about its own axes (half the angle's tangent).

    Each of the three numbers is ``amplitude sin(2 pi frequency_hz t + phase)``.
    """

    frequency_hz: Annotated[float, Limits(ge=0.0, le=100.0, unit="Hz")]
    shift_m: tuple[_Amplitude, _Amplitude, _Amplitude]
    shift_phase_rad: tuple[_Phase, _Phase, _Phase]
    turn: tuple[_Amplitude, _Amplitude, _Amplitude]
    turn_phase_rad: tuple[_Phase, _Phase, _Phase]


@dataclass(frozen=True, slots=True, kw_only=True)
class Drive:
    """The way of a base with two driven wheels: it goes where it looks.

    Control points of the distance gone, forward, and of the heading; the place is the integral of what they say, from ``start_m``, where
    the base is at the knot ``first_knot`` of the motion: the curves of a drive that is known in part begin there.  None: at the first.
    """

    start_m: tuple[_Metres, _Metres]
    distances_m: Annotated[tuple[_Metres, ...], Limits(min_length=DEGREE + 1, max_length=MAX_CONTROLS)]
    headings_rad: Annotated[tuple[_Radians, ...], Limits(min_length=DEGREE + 1, max_length=MAX_CONTROLS)]
    first_knot: Annotated[int, Limits(ge=0, le=2**40)] | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Motion:
    """The pose of a body at every time of a room.

    Attributes:
        kind: what moves; for people.
        spacing_s: time between knots of all curves.
        positions_m: control points of the body's place in the world, as many as ``turns``; none of a base.
        turns: control points of the body's orientation, quaternions (x, y, z, w) whose curve is made a unit one; none of a base.
        drive: of a base, which stays upright on the floor.
        tremor: what vibrates on top of the curves.
        tremor_from_s: when the tremor begins; it grows during ``tremor_ramp_s``.
        camera_m: place of the camera path's frame in the body.
        camera_turn: takes that optical frame (x right, y down, z forward) to the body; a unit quaternion.
    """

    kind: MotionKind
    spacing_s: Annotated[float, Limits(ge=0.001, le=10.0, unit="s")]
    positions_m: Annotated[tuple[Vector, ...], Limits(max_length=MAX_CONTROLS)] = ()
    turns: Annotated[tuple[Turn, ...], Limits(max_length=MAX_CONTROLS)] = ()
    drive: Drive | None = None
    tremor: Annotated[tuple[Harmonic, ...], Limits(max_length=32)] = ()
    tremor_from_s: Annotated[float, Limits(ge=0.0, le=1e6, unit="s")] = 0.0
    tremor_ramp_s: Annotated[float, Limits(ge=0.1, le=100.0, unit="s")] = 1.0
    camera_m: Vector = (0.0, 0.0, 0.0)
    camera_turn: Turn = (-0.5, 0.5, -0.5, 0.5)

    @property
    def controls(self) -> int:
        """How many control points every curve has."""
        return len(self.positions_m if self.drive is None else self.drive.distances_m)

    @property
    def duration_s(self) -> float:
        """How long the curves last; before and after that the body rests where they begin and end."""
        return (self.controls - DEGREE) * self.spacing_s
