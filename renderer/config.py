"""Settings of the camera and the renderer; ranges and units stand beside each field and reach ROS parameters from here."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated

from scene_description.strict import Limits

_SIZE_FIXED = "image size decides buffers, camera info and bags"


@dataclass(frozen=True, slots=True, kw_only=True)
class CameraConfig:
    """An ideal pinhole camera with square pixels; the principal point is the image centre, pixel centres lie at half integers."""

    width: Annotated[int, Limits(ge=1, le=8192, unit="px", description="Image width", fixed=_SIZE_FIXED)] = 640
    height: Annotated[int, Limits(ge=1, le=8192, unit="px", description="Image height", fixed=_SIZE_FIXED)] = 480
    horizontal_fov_rad: Annotated[
        float, Limits(ge=0.05, le=3.0, unit="rad", description="Horizontal field of view", fixed="camera info of a bag is one lens")
    ] = 1.2217304763960306

    @property
    def focal_length_px(self) -> float:
        """Focal length in pixels, equal in x and y."""
        return 0.5 * self.width / math.tan(0.5 * self.horizontal_fov_rad)


@dataclass(frozen=True, slots=True, kw_only=True)
class RenderConfig:
    """How colour is computed."""

    samples_per_pixel: Annotated[int, Limits(ge=1, le=65536, description="Colour samples per pixel")] = 16
    max_depth: Annotated[int, Limits(ge=1, le=64, description="Most segments of a light path; 1 shows lights only, 2 direct light")] = 6
    clamp: Annotated[
        float, Limits(ge=0.0, le=1e9, unit="cd/m2", description="Most luminance that one indirect light sample may bring; 0 is no limit")
    ] = 0.0
    exposure_ev100: Annotated[float, Limits(ge=-6.0, le=21.0, unit="EV", description="Exposure value at ISO 100, if not metered")] = 6.0
    auto_exposure: Annotated[bool, Limits(description="Meter the exposure of each room")] = False
    exposure_compensation_ev: Annotated[
        float, Limits(ge=-10.0, le=10.0, unit="EV", description="Brightens a metered exposure; positive is brighter")
    ] = 0.0
    threads: Annotated[int, Limits(ge=0, le=1024, description="Threads of the kernels; 0 takes all", fixed="kernels are set up once")] = 0
    portable: Annotated[
        bool, Limits(description="Pin Embree to AVX2, so that different processors agree", fixed="the ray tracing device is made once")
    ] = False
