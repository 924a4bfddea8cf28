"""Settings of the lidar; ranges and units stand beside each field and reach ROS parameters from here."""

import math
from dataclasses import dataclass
from typing import Annotated, Literal

from renderer.lidar.config import (
    DarkRange,
    Divergence,
    Noise,
    NoiseShare,
    Offset,
    RangeMax,
    RangeMin,
    RangeStep,
    Turn,
    check_range,
)
from scene_description.strict import FieldError, Limits

_FIXED = "sweeps of a bag are of one lidar"
_VLP16_DEG = (-15, 1, -13, 3, -11, 5, -9, 7, -7, 9, -5, 11, -3, 13, -1, 15)
_MOST_RAYS = 300_000
Angle = Annotated[float, Limits(ge=-math.pi, le=math.pi)]
Spin = Annotated[float, Limits(ge=-10_000.0, le=10_000.0)]
Deflection = Annotated[float, Limits(ge=0.0, le=0.7)]


@dataclass(frozen=True, slots=True, kw_only=True)
class LidarConfig:
    """A lidar that measures in three dimensions: its place in the body, its rays and their times, its errors.

    The frame is x forward, y left, z up (REP 103).  A *spinning* lidar turns its beams about z, once in a sweep, from the back on; the
    beams of a column leave ``firing_s`` one after the other and differ in azimuth by ``azimuths_rad``.  A *rosette* is one beam through two
    prisms that turn, each of which deflects it by a small angle: the angles add as vectors (G. F. Marshall, "Risley prism scan patterns",
    Proc. SPIE 3787, 1999, its first order), and no sweep is like another.

    Raises:
        FieldError: the parts do not go together, or the rays are too many.
    """

    enabled: Annotated[bool, Limits(description="Publish lidar/points and lidar/points_ideal, of a body", fixed=_FIXED)] = False
    pattern: Annotated[
        Literal["spinning", "rosette"], Limits(description="Beams that turn about z, or one beam through two prisms ahead", fixed=_FIXED)
    ] = "spinning"
    mount_m: Annotated[
        tuple[Offset, Offset, Offset], Limits(unit="m", description="Place in base_link: ahead, left, above", fixed=_FIXED)
    ] = (0.0, 0.0, 0.3)
    mount_rotation_rad: Annotated[
        tuple[Turn, Turn, Turn], Limits(unit="rad", description="Roll, pitch and yaw in base_link, as of URDF", fixed=_FIXED)
    ] = (0.0, 0.0, 0.0)
    rate_hz: Annotated[float, Limits(ge=0.1, le=1000.0, unit="Hz", description="Sweeps a second", fixed=_FIXED)] = 10.0
    columns: Annotated[
        int, Limits(ge=2, le=_MOST_RAYS, description="Times in a sweep at which beams leave: of a rosette, its points", fixed=_FIXED)
    ] = 1808
    elevations_rad: Annotated[
        tuple[Angle, ...],
        Limits(min_length=1, max_length=128, unit="rad", description="Elevation of each beam, in the order of firing", fixed=_FIXED),
    ] = tuple(math.radians(angle) for angle in _VLP16_DEG)
    azimuths_rad: Annotated[
        tuple[Angle, ...],
        Limits(min_length=1, max_length=128, unit="rad", description="Azimuth of each beam beside its column's, or of all", fixed=_FIXED),
    ] = (0.0,)
    firing_s: Annotated[
        float, Limits(ge=0.0, le=0.1, unit="s", description="Time between the beams of a column; 0: they leave together", fixed=_FIXED)
    ] = 2.304e-6
    clockwise: Annotated[bool, Limits(description="Turn as the hands of a clock, seen from above", fixed=_FIXED)] = True
    prism_rates_hz: Annotated[
        tuple[Spin, Spin], Limits(unit="Hz", description="Turns of a rosette's prisms a second; negative: the other way", fixed=_FIXED)
    ] = (121.57, -77.73)
    prism_angles_rad: Annotated[
        tuple[Deflection, Deflection], Limits(unit="rad", description="By how much each prism deflects the beam", fixed=_FIXED)
    ] = (0.168, 0.168)
    returns: Annotated[
        Literal["strongest", "last", "dual"],
        Limits(description="Echo that is read; dual: the strongest and the last, or if that is one, the second strongest", fixed=_FIXED),
    ] = "strongest"
    separation_m: Annotated[
        float, Limits(ge=0.0, le=100.0, unit="m", description="Echoes nearer to each other than this are read as one")
    ] = 1.0
    dropout_share: Annotated[float, Limits(ge=0.0, le=1.0, description="Share of the rays that are lost at random")] = 0.0
    range_min_m: RangeMin = 0.4
    range_max_m: RangeMax = 100.0
    dark_range_m: DarkRange = 31.6
    noise_m: Noise = 0.015
    noise_share: NoiseShare = 0.0
    resolution_m: RangeStep = 0.002
    divergence_rad: Divergence = 0.0

    def __post_init__(self) -> None:
        """Check what single ranges cannot say."""
        check_range(self.range_min_m, self.range_max_m)
        if len(self.azimuths_rad) not in (1, len(self.elevations_rad)):
            raise FieldError("azimuths_rad", f"one, or as many as elevations_rad: {len(self.elevations_rad)}", f"{len(self.azimuths_rad)}")
        if self.rays > _MOST_RAYS:
            raise FieldError("columns", f"{_MOST_RAYS // self.lines} or less for {self.lines} beams", f"{self.columns}")
        if self.pattern == "spinning" and (self.lines - 1) * self.firing_s >= self.column_s:
            raise FieldError("firing_s", f"{self.lines} beams within a column's {self.column_s:g} s", f"{self.firing_s:g}")

    @property
    def lines(self) -> int:
        """How many beams there are."""
        return len(self.elevations_rad) if self.pattern == "spinning" else 1

    @property
    def rays(self) -> int:
        """How many rays a sweep has."""
        return self.columns * self.lines

    @property
    def column_s(self) -> float:
        """Time between columns."""
        return 1.0 / (self.rate_hz * self.columns)


NO_LIDAR = LidarConfig()
