"""Settings of the camera and the renderer; ranges and units stand beside each field and reach ROS parameters from here."""

import math
from dataclasses import dataclass
from itertools import pairwise
from typing import Annotated, Literal

from renderer.camera.lenses import LENSES
from scene_description.strict import FieldError, Limits

_SIZE_FIXED = "image size decides buffers, camera info and bags"
_LENS_FIXED = "camera info of a bag is one lens"
_WIDEST_PLANAR_RAD = 3.0

Focal = Annotated[float, Limits(ge=0.0, le=1e6, unit="px", description="Focal length; 0: from the field of view", fixed=_LENS_FIXED)]
Centre = Annotated[
    float,
    Limits(ge=-1e5, le=1e5, unit="px", description="Principal point, pixel centres at integers; -1: the image centre", fixed=_LENS_FIXED),
]

LensModel = Literal["pinhole", "brown_conrady", "rational", "kannala_brandt", "equirectangular"]
Offset = Annotated[float, Limits(ge=-100.0, le=100.0)]
Turn = Annotated[float, Limits(ge=-7.0, le=7.0)]


@dataclass(frozen=True, slots=True, kw_only=True)
class CameraConfig:
    """A camera: image size, lens model, intrinsics and distortion as in ROS's CameraInfo.

    ``distortion`` are the coefficients of the model in the order of CameraInfo's D, missing ones are zero.  A field of view gives the
    focal length of the model without distortion; an equirectangular panorama always covers the whole sphere.

    Raises:
        FieldError: the model cannot have that field of view or so many coefficients.
    """

    model: Annotated[LensModel, Limits(description="Lens model", fixed=_LENS_FIXED)] = "pinhole"
    width: Annotated[int, Limits(ge=1, le=8192, unit="px", description="Image width", fixed=_SIZE_FIXED)] = 640
    height: Annotated[int, Limits(ge=1, le=8192, unit="px", description="Image height", fixed=_SIZE_FIXED)] = 480
    horizontal_fov_rad: Annotated[
        float, Limits(ge=0.05, le=2.0 * math.pi, unit="rad", description="Horizontal field of view", fixed=_LENS_FIXED)
    ] = 1.2217304763960306
    focal_x_px: Focal = 0.0
    focal_y_px: Focal = 0.0
    principal_x_px: Centre = -1.0
    principal_y_px: Centre = -1.0
    distortion: Annotated[
        tuple[Annotated[float, Limits(ge=-1e4, le=1e4)], ...],
        Limits(max_length=8, description="Distortion coefficients in the order of CameraInfo's D", fixed=_LENS_FIXED),
    ] = ()
    mount_m: Annotated[
        tuple[Offset, Offset, Offset],
        Limits(unit="m", description="Place of this camera in its rig: right of, below and ahead of the path's pose", fixed=_LENS_FIXED),
    ] = (0.0, 0.0, 0.0)
    mount_rotation_rad: Annotated[
        tuple[Turn, Turn, Turn],
        Limits(unit="rad", description="Turn of this camera in its rig, about x, y, then z of the path's frame", fixed=_LENS_FIXED),
    ] = (0.0, 0.0, 0.0)
    f_stop: Annotated[
        float, Limits(ge=0.0, le=64.0, description="Focal length over the aperture's diameter, for depth of field; 0: all in focus")
    ] = 0.0
    focus_distance_m: Annotated[
        float, Limits(ge=0.0, le=1e4, unit="m", description="Depth that is in focus; 0: that of what lies in the middle of the image")
    ] = 0.0
    sensor_width_mm: Annotated[
        float, Limits(ge=0.5, le=100.0, unit="mm", description="Width of the sensor, which gives the focal length and so the aperture")
    ] = 6.4
    shutter_s: Annotated[
        float, Limits(ge=0.0, le=2.0, unit="s", description="Time that the shutter is open, for motion blur along the path; 0: an instant")
    ] = 0.0
    row_time_s: Annotated[
        float, Limits(ge=0.0, le=0.01, unit="s", description="Time from row to row of a rolling shutter; 0: a global shutter")
    ] = 0.0

    def __post_init__(self) -> None:
        """Check what single ranges cannot say."""
        lens = LENSES.get(self.model)
        if lens is None:
            raise FieldError("model", f"one of {', '.join(LENSES)}", f"'{self.model}'")
        if len(self.distortion) > lens.coefficients:
            raise FieldError("distortion", f"at most {lens.coefficients} coefficients for model '{self.model}'", f"{len(self.distortion)}")
        if lens.planar and self.horizontal_fov_rad > _WIDEST_PLANAR_RAD:
            raise FieldError("horizontal_fov_rad", f"at most {_WIDEST_PLANAR_RAD} for model '{self.model}'", f"{self.horizontal_fov_rad:g}")

    @property
    def focal_length_px(self) -> float:
        """Focal length along x in pixels."""
        return self.focal_x_px or self._focal_from_view

    @property
    def lens_radius_m(self) -> float:
        """Radius of the aperture in metres, 0 for a pinhole."""
        focal_m = self.focal_length_px * self.sensor_width_mm * 1e-3 / self.width
        return 0.5 * focal_m / self.f_stop if self.f_stop else 0.0

    @property
    def _focal_from_view(self) -> float:
        if self.model == "equirectangular":
            return self.width / (2.0 * math.pi)
        half = 0.5 * self.horizontal_fov_rad
        return 0.5 * self.width / (math.tan(half) if LENSES[self.model].planar else half)

    @property
    def is_plain(self) -> bool:
        """Whether this is the ideal pinhole: square pixels, principal point in the centre, no distortion."""
        focal = self.focal_length_px
        centred = self.principal_x_px == -1.0 and self.principal_y_px == -1.0
        return self.model == "pinhole" and centred and (self.focal_y_px or focal) == focal


@dataclass(frozen=True, slots=True, kw_only=True)
class SensorConfig:
    """What lens, sensor and processing do to light before it is shown; the defaults are ideal.

    Raises:
        FieldError: the response is a table that has no points, or points that fall.
    """

    vignetting: Annotated[
        float, Limits(ge=0.0, le=2.0, description="Fall of light to the corners: 0 none, 1 the cosine's fourth power of a simple lens")
    ] = 0.0
    corner_loss: Annotated[float, Limits(ge=0.0, le=1.0, description="Further share of light that the corners lose")] = 0.0
    glare: Annotated[
        float, Limits(ge=0.0, le=0.5, description="Share of the light that the lens scatters over the whole image: its veiling glare")
    ] = 0.0
    blur_px: Annotated[
        float, Limits(ge=0.0, le=20.0, unit="px", description="Standard deviation of the blur of lens, filters and demosaicing; 0: none")
    ] = 0.0
    full_well_e: Annotated[
        float, Limits(ge=0.0, le=1e6, unit="e-", description="Electrons of a saturated pixel, for shot noise; 0: no noise, no steps")
    ] = 0.0
    read_noise_e: Annotated[float, Limits(ge=0.0, le=1e4, unit="e-", description="Standard deviation of the noise of reading")] = 0.0
    bits: Annotated[int, Limits(ge=0, le=16, description="Bits of the converter; 0: no steps")] = 0
    black_level: Annotated[float, Limits(ge=0.0, le=0.5, description="Share of the converter's range below zero light")] = 0.0
    headroom_ev: Annotated[
        float, Limits(ge=0.0, le=8.0, unit="EV", description="Stops above the white of the plain curve at which the sensor saturates")
    ] = 2.0
    iso: Annotated[
        float,
        Limits(
            ge=0.0, le=409600.0, description="Speed; with camera.f_stop and camera.shutter_s it fixes the exposure; 0: render.* says it"
        ),
    ] = 0.0
    red_shift_px: Annotated[
        float, Limits(ge=-50.0, le=50.0, unit="px", description="How far the red image of a corner lies outside the green one")
    ] = 0.0
    blue_shift_px: Annotated[
        float, Limits(ge=-50.0, le=50.0, unit="px", description="How far the blue image of a corner lies outside the green one")
    ] = 0.0
    bayer: Annotated[
        Literal["none", "rggb", "bggr", "grbg", "gbrg"],
        Limits(description="Colour filters of the upper left four pixels, row by row; none: every pixel sees all colours"),
    ] = "none"
    demosaic: Annotated[
        Literal["bilinear", "malvar"], Limits(description="How missing colours are interpolated: plainly, or by Malvar, He and Cutler")
    ] = "malvar"
    response: Annotated[
        Literal["display", "srgb", "rec709", "gamma", "table"],
        Limits(description="Response curve: render.tone_curve (display), a standard's, a power, or a measured one"),
    ] = "display"
    response_gamma: Annotated[float, Limits(ge=0.2, le=5.0, description="Brightness is light to the power of 1 over this")] = 2.2
    response_points: Annotated[
        tuple[Annotated[float, Limits(ge=0.0, le=1.0)], ...],
        Limits(max_length=1024, description="Measured response: brightness at even steps of light from 0 to white"),
    ] = ()
    color_saturation: Annotated[
        float, Limits(ge=0.0, le=4.0, description="By how much the processor multiplies the distance of colours from grey; 1: not at all")
    ] = 1.0
    sharpening: Annotated[
        float, Limits(ge=0.0, le=5.0, description="How much is added of what a pixel's luma has more than its surroundings; 0: none")
    ] = 0.0
    jpeg_quality: Annotated[int, Limits(ge=0, le=100, description="Quality of the JPEG that a picture has been through; 0: none")] = 0

    def __post_init__(self) -> None:
        """Check what single ranges cannot say."""
        if self.response == "table" and len(self.response_points) < 2:
            raise FieldError("response_points", "at least 2 numbers for response 'table'", f"{len(self.response_points)}")
        if any(after < before for before, after in pairwise(self.response_points)):
            raise FieldError("response_points", "numbers of which none is below the one before", "some that fall")
