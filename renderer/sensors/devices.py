"""The devices: one row each.  Figures are marked P (published), D (maker's data sheet or white paper), A (our assumption).

kinect_v1 (structured light, 640 x 480, 57 degrees wide).  Noise P: axial sigma = 0.0012 + 0.0019 (z - 0.4)^2 + 0.0001 / sqrt(z) * (theta
/ (pi/2 - theta))^2 metres and lateral sigma = 0.8 + 0.035 theta / (pi/2 - theta) pixels, C. Nguyen, S. Izadi, D. Lovell, "Modeling Kinect
sensor noise for improved 3D reconstruction and tracking", 3DIMPVT 2012.  Inverse depth in steps of 1 / 351.3 m P: disparities of 1/8
pixel with focal length times baseline of 35130 / 8 pixel cm, A. Handa et al., "A benchmark for RGB-D visual odometry, 3D reconstruction
and SLAM", ICRA 2014, after J. Barron and J. Malik, CVPR 2013; which gives the 7 cm between depth planes at 5 m of K. Khoshelham and S.
Oude Elberink, "Accuracy and resolution of Kinect depth data for indoor mapping applications", Sensors 12, 2012, from whom range 0.5 to 5
m and baseline 7.5 cm are too.  Window of 9 x 9 pixels P (Handa's simulator); the share of it that must agree, darkest surface and
steepest angle A.

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
public).  Range to 10 m D.  Projector in the middle of the two cameras, light and noise of the images, thresholds: A; the noise is such
that the error of disparity comes near the 0.08 pixels of Intel's "Tuning depth cameras for best performance".

stereo: no device but two grey cameras 12 cm apart without projector; all A.
"""

from __future__ import annotations

from typing import Literal, NamedTuple

from renderer.sensors.config import OWN, DepthSensorConfig

Principle = Literal["ideal", "structured_light", "time_of_flight", "stereo"]


class Device(NamedTuple):
    """The figures of a device, for kernels; fields as in :class:`DepthSensorConfig`, 0 where a principle has no use for one."""

    min_range_m: float = 0.0
    max_range_m: float = 0.0
    baseline_m: float = 0.0
    noise_floor_m: float = 0.0
    noise_growth_per_m: float = 0.0
    noise_quietest_m: float = 0.0
    grazing_noise: float = 0.0
    grazing_exponent: float = 0.0
    noise_reflectance: float = 0.0
    lateral_noise_px: float = 0.0
    lateral_grazing_px: float = 0.0
    signal_min: float = 0.0
    signal_max: float = 0.0
    max_angle_rad: float = 0.0
    inverse_depth_step_per_m: float = 0.0
    window_px: float = 0.0
    window_agreement: float = 0.0
    modulation_mhz: float = 0.0
    multipath: float = 0.0
    min_coherence: float = 0.0
    disparities: float = 0.0
    disparity_step_px: float = 0.0
    dots: float = 0.0
    ambient: float = 0.0
    full_well_e: float = 0.0
    read_noise_e: float = 0.0
    min_contrast: float = 0.0
    min_uniqueness: float = 0.0
    max_mismatch_px: float = 0.0


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


def device_of(config: DepthSensorConfig) -> tuple[Principle, Device]:
    """Return how the configured device measures, and its figures with those of the configuration in their place."""
    principle, device = DEVICES[config.model]
    own = {name: value for name in Device._fields if (value := getattr(config, name)) != OWN}
    return principle, device._replace(**own)
