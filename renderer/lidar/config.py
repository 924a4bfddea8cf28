"""Settings of the laser scanner; ranges and units stand beside each field and reach ROS parameters from here."""

import math
from dataclasses import dataclass
from typing import Annotated

from scene_description.strict import FieldError, Limits

_FIXED = "scans of a bag are of one scanner"
_DEFAULT_BEAMS = 720
_TURN = 2.0 * math.pi

Offset = Annotated[float, Limits(ge=-100.0, le=100.0)]
Turn = Annotated[float, Limits(ge=-7.0, le=7.0)]
RangeMin = Annotated[float, Limits(ge=0.0, le=1000.0, unit="m", description="Nearest distance that is measured", fixed=_FIXED)]
RangeMax = Annotated[float, Limits(ge=0.01, le=10_000.0, unit="m", description="Farthest distance measured", fixed=_FIXED)]
DarkRange = Annotated[
    float,
    Limits(ge=0.0, le=10_000.0, unit="m", description="How far a matt surface that returns a tenth is seen head-on; 0: all is seen"),
]
Noise = Annotated[float, Limits(ge=0.0, le=10.0, unit="m", description="Standard deviation of the range, its constant part")]
NoiseShare = Annotated[float, Limits(ge=0.0, le=1.0, description="Standard deviation over the range, added in square")]
RangeStep = Annotated[float, Limits(ge=0.0, le=1.0, unit="m", description="Step of the range; 0: none")]
Divergence = Annotated[
    float, Limits(ge=0.0, le=0.2, unit="rad", description="Full opening angle of a beam; 0: a line, an eighth of the rays")
]


def check_range(range_min_m: float, range_max_m: float) -> None:
    """Check that something can be measured.

    Raises:
        FieldError: the limits of the range are turned round.
    """
    if range_min_m >= range_max_m:
        raise FieldError("range_max_m", f"more than range_min_m = {range_min_m:g}", f"{range_max_m:g}")


@dataclass(frozen=True, slots=True, kw_only=True)
class ScanConfig:
    """A planar scanner: its place on the robot, its beams, its errors.

    The scanner's frame is x forward, y left, z up (REP 103); beams turn about z from ``angle_min_rad`` to ``angle_max_rad``, both among
    them, evenly.  A mirror that turns ``rate_hz`` times a second sends beam i out ``i angle_increment / (2 pi rate_hz)`` after the first.

    Raises:
        FieldError: the angles or the ranges are empty or turned round, or the angles cover more than a turn.
    """

    enabled: Annotated[bool, Limits(description="Publish scan, scan_ideal and laser/pose", fixed=_FIXED)] = False
    level: Annotated[
        bool,
        Limits(
            description="Upright at height_m over the floor under the camera, as on wheels; else fixed to the camera's rig", fixed=_FIXED
        ),
    ] = True
    height_m: Annotated[float, Limits(ge=0.0, le=20.0, unit="m", description="Height over the floor, where level", fixed=_FIXED)] = 0.25
    mount_m: Annotated[
        tuple[Offset, Offset, Offset],
        Limits(unit="m", description="Place ahead of, left of and above the rig; where level, of the point below it", fixed=_FIXED),
    ] = (0.0, 0.0, 0.0)
    mount_rotation_rad: Annotated[
        tuple[Turn, Turn, Turn],
        Limits(unit="rad", description="Roll, pitch and yaw against the rig; where level, against its heading", fixed=_FIXED),
    ] = (0.0, 0.0, 0.0)
    rate_hz: Annotated[float, Limits(ge=0.1, le=1000.0, unit="Hz", description="Turns, and so scans, a second", fixed=_FIXED)] = 10.0
    beams: Annotated[int, Limits(ge=2, le=100_000, description="Beams of a scan", fixed=_FIXED)] = _DEFAULT_BEAMS
    angle_min_rad: Annotated[float, Limits(ge=-_TURN, le=_TURN, unit="rad", description="Angle of the first beam", fixed=_FIXED)] = -math.pi
    angle_max_rad: Annotated[float, Limits(ge=-_TURN, le=_TURN, unit="rad", description="Angle of the last beam", fixed=_FIXED)] = (
        math.pi - _TURN / _DEFAULT_BEAMS
    )
    range_min_m: RangeMin = 0.1
    range_max_m: RangeMax = 12.0
    dark_range_m: DarkRange = 8.0
    noise_m: Noise = 0.01
    noise_share: NoiseShare = 0.0
    resolution_m: RangeStep = 0.001
    divergence_rad: Divergence = 0.0

    def __post_init__(self) -> None:
        """Check what single ranges cannot say."""
        if not 0.0 < self.angle_max_rad - self.angle_min_rad <= _TURN + 1e-9:
            got = f"{self.angle_min_rad:g} to {self.angle_max_rad:g}"
            raise FieldError("angle_max_rad", "more than angle_min_rad, by a turn at most", got)
        check_range(self.range_min_m, self.range_max_m)

    @property
    def angle_increment_rad(self) -> float:
        """Angle between neighbouring beams."""
        return (self.angle_max_rad - self.angle_min_rad) / (self.beams - 1)

    @property
    def time_increment_s(self) -> float:
        """Time between neighbouring beams."""
        return self.angle_increment_rad / (_TURN * self.rate_hz)

    @property
    def sweep_s(self) -> float:
        """Time from the first beam to the last."""
        return self.time_increment_s * (self.beams - 1)


NO_SCAN = ScanConfig()
