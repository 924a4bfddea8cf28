"""Settings of a body's own senses; ranges and units stand beside each field and reach ROS parameters from here."""

import math
from dataclasses import dataclass
from typing import Annotated, Literal

from scene_description.strict import Limits

_FIXED = "a bag is of one body"
Offset = Annotated[float, Limits(ge=-100.0, le=100.0)]
Turn = Annotated[float, Limits(ge=-7.0, le=7.0)]
Rate = Annotated[float, Limits(ge=0.1, le=10_000.0, unit="Hz")]
Small = Annotated[float, Limits(ge=0.0, le=1.0)]
Large = Annotated[float, Limits(ge=0.0, le=100.0)]


@dataclass(frozen=True, slots=True, kw_only=True)
class BodyConfig:
    """The body that carries the camera: whether there is one, and how often it is told where it is."""

    enabled: Annotated[
        bool, Limits(description="Let the camera's frames hang from base_link, on a body that moves as scene.motion says", fixed=_FIXED)
    ] = False
    publish: Annotated[
        bool, Limits(description="Publish odom/ideal, robot_description and the body's sensors; one renderer of a run does", fixed=_FIXED)
    ] = True
    rate_hz: Annotated[
        float, Limits(ge=0.1, le=10_000.0, unit="Hz", description="Rate of odom/ideal, which also comes with every frame", fixed=_FIXED)
    ] = 100.0
    clock_rate_hz: Annotated[
        float,
        Limits(
            ge=0.0, le=10_000.0, unit="Hz", description="Rate of /clock, which also ticks with frames; 0: the fastest stream", fixed=_FIXED
        ),
    ] = 0.0


@dataclass(frozen=True, slots=True, kw_only=True)
class ImuConfig:
    """An inertial measurement unit: its place in the body, and what it gets wrong.

    Noise densities and walks are those that an Allan deviation shows (IEEE Std 952-1997): N at 1 s, and K sqrt(t / 3).  The names of the
    fields end with the numerator of their units; densities are per square root of hertz.
    """

    enabled: Annotated[bool, Limits(description="Publish imu/data and imu/ideal", fixed=_FIXED)] = False
    rate_hz: Annotated[float, Limits(ge=0.1, le=10_000.0, unit="Hz", description="Samples a second", fixed=_FIXED)] = 200.0
    mount_m: Annotated[
        tuple[Offset, Offset, Offset], Limits(unit="m", description="Place in base_link: ahead, left, above; the lever arm", fixed=_FIXED)
    ] = (0.0, 0.0, 0.0)
    mount_rotation_rad: Annotated[
        tuple[Turn, Turn, Turn], Limits(unit="rad", description="Roll, pitch and yaw in base_link, as of URDF", fixed=_FIXED)
    ] = (0.0, 0.0, 0.0)
    samples: Annotated[
        Literal["instant", "mean"],
        Limits(description="Values at the stamp, or their mean over the interval that ends there, as sensors that integrate give"),
    ] = "instant"
    gyro_noise_rad_s: Annotated[float, Limits(ge=0.0, le=1.0, unit="rad/s/sqrt(Hz)", description="White noise of the gyroscope")] = 1.7e-4
    gyro_walk_rad_s2: Annotated[float, Limits(ge=0.0, le=1.0, unit="rad/s2/sqrt(Hz)", description="Walk of the gyroscope's bias")] = 2e-5
    gyro_bias_rad_s: Annotated[
        float, Limits(ge=0.0, le=1.0, unit="rad/s", description="Bias of the gyroscope at the start: standard deviation, each axis")
    ] = 0.005
    accel_noise_m_s2: Annotated[float, Limits(ge=0.0, le=10.0, unit="m/s2/sqrt(Hz)", description="White noise of the accelerometer")] = 2e-3
    accel_walk_m_s3: Annotated[float, Limits(ge=0.0, le=10.0, unit="m/s3/sqrt(Hz)", description="Walk of the accelerometer's bias")] = 3e-4
    accel_bias_m_s2: Annotated[
        float, Limits(ge=0.0, le=10.0, unit="m/s2", description="Bias of the accelerometer at the start: standard deviation, each axis")
    ] = 0.05
    scale_error: Annotated[float, Limits(ge=0.0, le=0.5, description="Error of each axis's scale: standard deviation")] = 0.002
    misalignment_rad: Annotated[
        float, Limits(ge=0.0, le=0.5, unit="rad", description="Error of each axis's direction towards each other: standard deviation")
    ] = 0.002
    gyro_range_rad_s: Annotated[float, Limits(ge=0.1, le=1000.0, unit="rad/s", description="Greatest reading of the gyroscope")] = 34.9
    accel_range_m_s2: Annotated[float, Limits(ge=1.0, le=10_000.0, unit="m/s2", description="Greatest reading of accelerations")] = 156.9
    gyro_step_rad_s: Annotated[float, Limits(ge=0.0, le=1.0, unit="rad/s", description="Step of the gyroscope's readings; 0: none")] = 0.0
    accel_step_m_s2: Annotated[float, Limits(ge=0.0, le=10.0, unit="m/s2", description="Step of accelerations; 0: none")] = 0.0
    clock_offset_s: Annotated[
        float, Limits(ge=-1.0, le=1.0, unit="s", description="How much later than the true time the stamps of imu/data are", fixed=_FIXED)
    ] = 0.0
    inflation: Annotated[
        float, Limits(ge=1.0, le=1000.0, description="By how much estimators are told more noise and walk than there is, in sensor.yaml")
    ] = 10.0


@dataclass(frozen=True, slots=True, kw_only=True)
class WheelsConfig:
    """Two driven wheels on one axle through the middle of the base, and what odometry makes of their encoders.

    The way of a wheel errs by a normal number whose variance grows with its length (K. S. Chong and L. Kleeman, "Accurate odometry and
    error modelling for a mobile robot", ICRA 1997); radii and track differ from their nominal values by numbers drawn for each room.
    """

    enabled: Annotated[bool, Limits(description="Publish joint_states and odom, of a base", fixed=_FIXED)] = False
    rate_hz: Annotated[float, Limits(ge=0.1, le=10_000.0, unit="Hz", description="Readings a second", fixed=_FIXED)] = 50.0
    radius_m: Annotated[float, Limits(ge=0.005, le=1.0, unit="m", description="Nominal radius of the wheels", fixed=_FIXED)] = 0.033
    track_m: Annotated[float, Limits(ge=0.01, le=3.0, unit="m", description="Nominal distance of the wheels", fixed=_FIXED)] = 0.16
    ticks: Annotated[int, Limits(ge=0, le=10_000_000, description="Steps of an encoder in a turn of the wheel; 0: none")] = 4096
    slip_m: Annotated[
        float, Limits(ge=0.0, le=1.0, unit="m/sqrt(m)", description="Error of a wheel's way: standard deviation after a metre")
    ] = 0.001
    radius_error: Annotated[float, Limits(ge=0.0, le=0.2, description="Error of each radius: standard deviation, relative")] = 0.0005
    track_error: Annotated[float, Limits(ge=0.0, le=0.2, description="Error of the track: standard deviation, relative")] = 0.002


NO_BODY, NO_IMU, NO_WHEELS = BodyConfig(), ImuConfig(), WheelsConfig()
GRAVITY_M_S2 = 9.80665
"""Standard acceleration of free fall; an accelerometer at rest reads it upwards (REP 145)."""


def stamps_up_to(rate_hz: float, start_ns: int, end_ns: int, first: int = 0) -> list[int]:
    """Return the times of samples from the start on, at most ``end_ns``, without those before the sample ``first``."""
    count = math.floor((end_ns - start_ns) * rate_hz / 1e9 + 1e-6) + 1
    stamps = [start_ns + round(k * 1e9 / rate_hz) for k in range(first, count)]
    return stamps if not stamps or stamps[-1] <= end_ns else stamps[:-1]
