"""The devices: one row each.  Figures are marked P (published), D (maker's data sheet or white paper), A (our assumption).

kinect_v1 (structured light, 640 x 480, 57 degrees wide).  Noise P: axial sigma = 0.0012 + 0.0019 (z - 0.4)^2 + 0.0001 / sqrt(z) * (theta
/ (pi/2 - theta))^2 metres and lateral sigma = 0.8 + 0.035 theta / (pi/2 - theta) pixels, C. Nguyen, S. Izadi, D. Lovell, "Modeling Kinect
sensor noise for improved 3D reconstruction and tracking", 3DIMPVT 2012.  Inverse depth in steps of 1 / 351.3 m P: disparities of 1/8
pixel with focal length times baseline of 35130 / 8 pixel cm, A. Handa et al., "A benchmark for RGB-D visual odometry, 3D reconstruction
and SLAM", ICRA 2014, after J. Barron and J. Malik, CVPR 2013; which gives the 7 cm between depth planes at 5 m of K. Khoshelham and S.
Oude Elberink, "Accuracy and resolution of Kinect depth data for indoor mapping applications", Sensors 12, 2012, from whom range 0.5 to 5
m and baseline 7.5 cm are too.  Window of 9 x 9 pixels P (Handa's simulator); the share of it that must agree, darkest surface and
steepest angle A.  That errors are alike within two thirds of the window, and the window whose majority decides: A, such that noise about
local planes, holes and their sizes are those of real frames (docs/sensors.md).

kinect_v2 (time of flight, 512 x 424).  Noise P: axial sigma = 1.5 - 0.5 z + 0.3 z^2 + 0.1 z^1.5 (theta / (pi/2 - theta))^2 millimetres,
P. Fankhauser et al., "Kinect v2 for mobile robot navigation: evaluation and modeling", ICAR 2015; the same polynomial, completed to a
square.  That it is told for reflectance 0.5: A.  Modulation P: 16, 80 and 120 MHz (F. Jaeremo Lawin, P.-E. Forssen, H. Ovren, ECCV 2016,
and libfreenect2); that 80 MHz stands for the three: A.  Range 0.5 to 4.5 m D.  Baseline, darkest surface, coherence A.

azure_kinect (time of flight, narrow field, unbinned, 640 x 576).  Range 0.5 to 3.86 m D, for reflectances of 15 % and more, and random
error of 17 mm or less D (Azure Kinect DK hardware specifications; both confirmed by M. Toelgyessy et al., "Evaluation of the Azure Kinect
and its comparison to Kinect v1 and Kinect v2", Sensors 21, 2021).  So sigma is 17 mm at 3.86 m and reflectance 0.15, an upper bound; that
it grows with z^2 from 0.5 mm, and its angle term (Fankhauser's): A.  Modulation of 200 MHz A (its imager reaches 320 MHz: C. Bamji et
al., ISSCC 2018).  Pixels that mix returns are invalidated D (its documentation); by which measure: A.

realsense_d435 (active stereo, 848 x 480).  Baseline 50 mm, field of projection 86 x 57 degrees D (Intel D400 data sheet); some 5000 dots
D (A. Grunnet-Jepsen et al., "Projectors for D400 series depth cameras"); 126 disparities D (so the nearest depth is focal length x
baseline / 126); steps of 1/32 pixel D (A. Grunnet-Jepsen et al., "Subpixel linearity improvement"); matched by census transforms P (L.
Keselman et al., "Intel RealSense stereoscopic depth cameras", CVPR workshops 2017; the D400's own matcher is finer, semi-global, and not
public).  Range to 10 m D.  Projector in the middle of the two cameras, light and noise of the images, thresholds, majority: A; the noise
is such that the error of disparity comes near the 0.08 pixels of Intel's "Tuning depth cameras for best performance".

stereo: no device but two grey cameras 12 cm apart without projector; all A.
"""

from dataclasses import dataclass, make_dataclass
from typing import Annotated, Any, Literal, NamedTuple, get_type_hints

from scene_description.strict import Limits

OWN = -1.0
"""Value of a setting that is left to the device."""

Principle = Literal["ideal", "structured_light", "time_of_flight", "stereo"]


def _figure(description: str, unit: str = "", most: float = 1e3) -> Limits:
    return Limits(ge=OWN, le=most, unit=unit, description=f"{description}; -1: the device's own")


class Device(NamedTuple):
    """The figures of a device, for kernels; 0 where a principle has no use for one.

    Each is a setting of :class:`DepthSensorConfig` too.
    """

    min_range_m: Annotated[float, _figure("Nearest depth, -inf below it", "m")] = 0.0
    max_range_m: Annotated[float, _figure("Farthest depth, +inf beyond it", "m")] = 0.0
    baseline_m: Annotated[float, _figure("From the camera to the projector, or to the second camera, on its right", "m", 10.0)] = 0.0
    noise_floor_m: Annotated[float, _figure("Least standard deviation of depth", "m")] = 0.0
    noise_growth_per_m: Annotated[float, _figure("Growth of the deviation with the squared distance from the quietest depth", "1/m")] = 0.0
    noise_quietest_m: Annotated[float, _figure("Depth at which the deviation is least", "m")] = 0.0
    grazing_noise: Annotated[float, _figure("Factor of the deviation's part that grows with the angle of incidence")] = 0.0
    grazing_exponent: Annotated[float, _figure("Power of depth in that part", "", 4.0)] = 0.0
    noise_reflectance: Annotated[
        float, _figure("Reflectance for which the deviation is told; it grows as the root of darkness; 0: for all", "", 1.0)
    ] = 0.0
    lateral_noise_px: Annotated[float, _figure("Standard deviation of where edges are seen", "px", 20.0)] = 0.0
    lateral_grazing_px: Annotated[float, _figure("Part of it that grows with the angle of incidence", "px", 20.0)] = 0.0
    signal_min: Annotated[
        float, _figure("Least signal that is read, of stereo least light that is white; 1: white that faces the device 1 m away")
    ] = 0.0
    signal_max: Annotated[float, _figure("Signal that saturates, as of a lamp in a mirror or of gloss seen head-on", "", 1e6)] = 0.0
    max_angle_rad: Annotated[float, _figure("Greatest angle of incidence that is read", "rad", 1.6)] = 0.0
    inverse_depth_step_per_m: Annotated[float, _figure("Step of inverse depth, as disparities are counted; 0: none", "1/m", 1.0)] = 0.0
    window_px: Annotated[float, _figure("Edge of the window that the pattern is correlated over", "px", 31.0)] = 0.0
    window_agreement: Annotated[float, _figure("Share of that window that must agree in disparity", "", 1.0)] = 0.0
    speck_px: Annotated[
        float, _figure("Edge of the window whose majority decides whether a pixel is read; 0: each for itself", "px", 31.0)
    ] = 0.0
    modulation_mhz: Annotated[float, _figure("Modulation of the light, for mixed returns", "MHz", 1e4)] = 0.0
    multipath: Annotated[float, _figure("Share of the light that comes by way of one other surface; 1: as it is", "", 10.0)] = 0.0
    min_coherence: Annotated[float, _figure("Least agreement in phase of a pixel's returns", "", 1.0)] = 0.0
    disparities: Annotated[float, _figure("How many disparities are searched", "px", 256.0)] = 0.0
    disparity_step_px: Annotated[float, _figure("Step of the interpolated disparity", "px", 1.0)] = 0.0
    dots: Annotated[float, _figure("Dots that the projector casts; 0: no projector", "", 1e6)] = 0.0
    ambient: Annotated[float, _figure("Light of the room over the projector's at 1 m", "", 1e6)] = 0.0
    full_well_e: Annotated[float, _figure("Electrons of a white pixel, for shot noise of the matched images", "e-", 1e6)] = 0.0
    read_noise_e: Annotated[float, _figure("Noise of reading the matched images", "e-", 1e4)] = 0.0
    min_contrast: Annotated[float, _figure("Least contrast within the matched window over the noise", "", 1e3)] = 0.0
    min_uniqueness: Annotated[float, _figure("By which share the second best match must be worse", "", 10.0)] = 0.0
    max_mismatch_px: Annotated[float, _figure("Most that matches from left and from right may differ", "px", 256.0)] = 0.0


KINECT_V1 = Device(
    min_range_m=0.5,
    max_range_m=5.0,
    baseline_m=0.075,
    noise_floor_m=0.0012,
    noise_growth_per_m=0.0019,
    noise_quietest_m=0.4,
    grazing_noise=1e-4,
    grazing_exponent=-0.5,
    lateral_noise_px=0.8,
    lateral_grazing_px=0.035,
    signal_min=0.003,
    signal_max=40.0,
    max_angle_rad=1.4,
    inverse_depth_step_per_m=1.0 / 351.3,
    window_px=9.0,
    window_agreement=0.5,
    speck_px=5.0,
)
KINECT_V2 = Device(
    min_range_m=0.5,
    max_range_m=4.5,
    baseline_m=0.05,
    noise_floor_m=0.0015 - 0.25 / 1.2e3,
    noise_growth_per_m=0.0003,
    noise_quietest_m=0.5 / 0.6,
    grazing_noise=1e-4,
    grazing_exponent=1.5,
    noise_reflectance=0.5,
    lateral_noise_px=0.3,
    signal_min=0.0015,
    signal_max=40.0,
    max_angle_rad=1.45,
    modulation_mhz=80.0,
    multipath=1.0,
    min_coherence=0.6,
)
AZURE_KINECT = Device(
    min_range_m=0.5,
    max_range_m=3.86,
    baseline_m=0.02,
    noise_floor_m=0.0005,
    noise_growth_per_m=0.0165 / 3.86**2,
    grazing_noise=1e-4,
    grazing_exponent=1.5,
    noise_reflectance=0.15,
    lateral_noise_px=0.3,
    signal_min=0.003,
    signal_max=40.0,
    max_angle_rad=1.45,
    modulation_mhz=200.0,
    multipath=1.0,
    min_coherence=0.95,
)
REALSENSE_D435 = Device(
    max_range_m=10.0,
    baseline_m=0.05,
    disparities=126.0,
    disparity_step_px=1.0 / 32.0,
    dots=5000.0,
    signal_min=0.5,
    window_px=13.0,
    speck_px=5.0,
    ambient=0.1,
    full_well_e=3000.0,
    read_noise_e=10.0,
    min_contrast=7.0,
    min_uniqueness=0.15,
    max_mismatch_px=1.0,
)
STEREO = Device(
    max_range_m=20.0,
    baseline_m=0.12,
    disparities=128.0,
    disparity_step_px=1.0 / 16.0,
    window_px=11.0,
    ambient=1.0,
    signal_min=0.05,
    full_well_e=10000.0,
    read_noise_e=5.0,
    min_contrast=7.0,
    min_uniqueness=0.15,
    max_mismatch_px=1.0,
)

DEVICES: dict[str, tuple[Principle, Device]] = {
    "ideal": ("ideal", Device()),
    "kinect_v1": ("structured_light", KINECT_V1),
    "kinect_v2": ("time_of_flight", KINECT_V2),
    "azure_kinect": ("time_of_flight", AZURE_KINECT),
    "realsense_d435": ("stereo", REALSENSE_D435),
    "stereo": ("stereo", STEREO),
}
"""Model -> how it measures, and its figures."""


_MODEL = Annotated[Literal[tuple(DEVICES)], Limits(description="Depth camera to imitate")]  # type: ignore[valid-type]
_FIGURES = [(name, hint, OWN) for name, hint in get_type_hints(Device, include_extras=True).items()]
_Settings: Any = make_dataclass("_Settings", [("model", _MODEL, "ideal"), *_FIGURES], frozen=True, kw_only=True)


@dataclass(frozen=True, kw_only=True)
class DepthSensorConfig(_Settings):  # type: ignore[misc]
    """The device that ``depth_sensed`` imitates; ``ideal`` reads the true depth.

    Each field but ``model`` has the name and the meaning of one of :class:`Device` and replaces it, unless it is -1.
    """


def device_of(config: DepthSensorConfig) -> tuple[Principle, Device]:
    """Return how the configured device measures, and its figures with those of the configuration in their place."""
    principle, device = DEVICES[config.model]
    own = {name: value for name in Device._fields if (value := getattr(config, name)) != OWN}
    return principle, device._replace(**own)
