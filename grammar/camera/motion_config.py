"""Settings of motions: what carries the camera, and how it moves."""

from dataclasses import dataclass
from typing import Annotated, Literal

from scene_description import FieldError, Limits

MotionName = Literal["walk", "handheld", "flight", "base", "turntable", "still", "spin", "file"]
_Offset = Annotated[float, Limits(ge=-10.0, le=10.0)]


@dataclass(frozen=True, slots=True, kw_only=True)
class MotionConfig:
    """How the body that carries the camera moves; a ``walk`` says only where the camera is at each frame.

    A hand sways slowly, most of it below 1.6 Hz (D. A. Winter, "Human balance and posture control during standing and walking", Gait and
    Posture 3, 1995), and trembles at 8 to 12 Hz (R. J. Elble and J. E. Randall, "Mechanistic components of normal hand tremor",
    Electroencephalography and Clinical Neurophysiology 44, 1978); the sizes are typical ones, of no one person.

    Raises:
        FieldError: a file is missing or goes with another kind.
    """

    kind: Annotated[
        MotionName,
        Limits(description="What moves: walk (frames only), handheld, flight, base (two driven wheels), turntable, still, spin, file"),
    ] = "walk"
    file: Annotated[str, Limits(max_length=1000, description="TUM trajectory of the camera, of kind file; world coordinates, metres")] = ""
    rest_s: Annotated[float, Limits(ge=0.0, le=600.0, unit="s", description="Rest at the beginning")] = 2.0
    speed_m_s: Annotated[float, Limits(ge=0.01, le=5.0, unit="m/s", description="Greatest speed")] = 0.4
    acceleration_m_s2: Annotated[float, Limits(ge=0.01, le=20.0, unit="m/s2", description="Greatest acceleration of a base")] = 0.8
    jerk_m_s3: Annotated[float, Limits(ge=0.01, le=200.0, unit="m/s3", description="Greatest jerk of a base")] = 4.0
    turn_rad_s: Annotated[float, Limits(ge=0.01, le=20.0, unit="rad/s", description="Greatest turn of a base, turntable and spin")] = 1.5
    turn_acceleration_rad_s2: Annotated[
        float, Limits(ge=0.01, le=100.0, unit="rad/s2", description="Greatest change of the turn of a base and turntable")
    ] = 3.0
    body_radius_m: Annotated[float, Limits(ge=0.05, le=1.0, unit="m", description="Radius of a base's footprint")] = 0.18
    loop: Annotated[bool, Limits(description="Let a base come back to where it began at the end")] = False
    explore: Annotated[bool, Limits(description="Let a base pass over all floor that it can reach, lane by lane")] = False
    sway_m: Annotated[float, Limits(ge=0.0, le=0.2, unit="m", description="Sway of a hand or drone: standard deviation, each axis")] = 0.02
    sway_rad: Annotated[float, Limits(ge=0.0, le=0.5, unit="rad", description="The same of its angles")] = 0.04
    tremor_hz: Annotated[float, Limits(ge=2.0, le=40.0, unit="Hz", description="Middle of a hand's tremor or a drone's vibration")] = 8.0
    tremor_m: Annotated[float, Limits(ge=0.0, le=0.01, unit="m", description="Tremor or vibration: standard deviation, each axis")] = 0.0001
    tremor_rad: Annotated[float, Limits(ge=0.0, le=0.05, unit="rad", description="The same of its angles")] = 0.001
    camera_m: Annotated[
        tuple[_Offset, _Offset, _Offset],
        Limits(unit="m", description="Place of the camera in the body: ahead, left, above; height 0 of a base: drawn as of a walk"),
    ] = (0.0, 0.0, 0.0)
    camera_pitch_rad: Annotated[float, Limits(ge=-1.5, le=1.5, unit="rad", description="How far a base's camera looks up")] = 0.0

    def __post_init__(self) -> None:
        """Check what single ranges cannot say."""
        if (self.kind == "file") != bool(self.file):
            raise FieldError("file", "a file, of kind file only", self.file or "none")


WALK = MotionConfig()
