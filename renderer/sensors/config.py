"""Settings of the depth sensor: which device it is, and every figure of it that may be replaced."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Literal

from scene_description.strict import Limits

OWN = -1.0
"""Value of a setting that is left to the device."""


def _figure(description: str, unit: str = "", most: float = 1e3) -> Limits:
    return Limits(ge=OWN, le=most, unit=unit, description=f"{description}; -1: the device's own")


@dataclass(frozen=True, slots=True, kw_only=True)
class DepthSensorConfig:
    """The device that ``depth_sensed`` imitates; ``ideal`` reads the true depth.

    Each field but ``model`` has the name and the meaning of one of ``renderer.sensors.devices.Device`` and replaces it, unless it is -1.
    """

    model: Annotated[
        Literal["ideal", "kinect_v1", "kinect_v2", "azure_kinect", "realsense_d435", "stereo"],
        Limits(description="Depth camera to imitate"),
    ] = "ideal"
    min_range_m: Annotated[float, _figure("Nearest depth, -inf below it", "m")] = OWN
    max_range_m: Annotated[float, _figure("Farthest depth, +inf beyond it", "m")] = OWN
    baseline_m: Annotated[float, _figure("From the camera to the projector, or to the second camera, on its right", "m", 10.0)] = OWN
    noise_floor_m: Annotated[float, _figure("Least standard deviation of depth", "m")] = OWN
    noise_growth_per_m: Annotated[float, _figure("Growth of the deviation with the squared distance from the quietest depth", "1/m")] = OWN
    noise_quietest_m: Annotated[float, _figure("Depth at which the deviation is least", "m")] = OWN
    grazing_noise: Annotated[float, _figure("Factor of the deviation's part that grows with the angle of incidence")] = OWN
    grazing_exponent: Annotated[float, _figure("Power of depth in that part", "", 4.0)] = OWN
    noise_reflectance: Annotated[
        float, _figure("Reflectance for which the deviation is told; it grows as the root of darkness; 0: for all", "", 1.0)
    ] = OWN
    lateral_noise_px: Annotated[float, _figure("Standard deviation of where edges are seen", "px", 20.0)] = OWN
    lateral_grazing_px: Annotated[float, _figure("Part of it that grows with the angle of incidence", "px", 20.0)] = OWN
    signal_min: Annotated[
        float, _figure("Least signal that is read, of stereo least light that is white; 1: white that faces the device 1 m away")
    ] = OWN
    signal_max: Annotated[float, _figure("Signal that saturates, as of a lamp in a mirror or of gloss seen head-on", "", 1e6)] = OWN
    max_angle_rad: Annotated[float, _figure("Greatest angle of incidence that is read", "rad", 1.6)] = OWN
    inverse_depth_step_per_m: Annotated[float, _figure("Step of inverse depth, as disparities are counted; 0: none", "1/m", 1.0)] = OWN
    window_px: Annotated[float, _figure("Edge of the window that the pattern is correlated over", "px", 31.0)] = OWN
    window_agreement: Annotated[float, _figure("Share of that window that must agree in disparity", "", 1.0)] = OWN
    modulation_mhz: Annotated[float, _figure("Modulation of the light, for mixed returns", "MHz", 1e4)] = OWN
    multipath: Annotated[float, _figure("Share of the light that comes by way of one other surface; 1: as it is", "", 10.0)] = OWN
    min_coherence: Annotated[float, _figure("Least agreement in phase of a pixel's returns", "", 1.0)] = OWN
    disparities: Annotated[float, _figure("How many disparities are searched", "px", 256.0)] = OWN
    disparity_step_px: Annotated[float, _figure("Step of the interpolated disparity", "px", 1.0)] = OWN
    dots: Annotated[float, _figure("Dots that the projector casts; 0: no projector", "", 1e6)] = OWN
    ambient: Annotated[float, _figure("Light of the room over the projector's at 1 m", "", 1e6)] = OWN
    full_well_e: Annotated[float, _figure("Electrons of a white pixel, for shot noise of the matched images", "e-", 1e6)] = OWN
    read_noise_e: Annotated[float, _figure("Noise of reading the matched images", "e-", 1e4)] = OWN
    min_contrast: Annotated[float, _figure("Least contrast within the matched window over the noise", "", 1e3)] = OWN
    min_uniqueness: Annotated[float, _figure("By which share the second best match must be worse", "", 10.0)] = OWN
    max_mismatch_px: Annotated[float, _figure("Most that matches from left and from right may differ", "px", 256.0)] = OWN
