"""Light metering: the exposure value at which the views of a room come out well."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from renderer.config import CameraConfig, RenderConfig
from renderer.flat_scene import FlatScene
from renderer.renderer import Renderer
from scene_description import CameraPose

METER_CONSTANT = 12.5
"""K of ISO 2720 for reflected light, cd/m2 at EV 0 and ISO 100 times 100."""

_WIDTH, _SAMPLES, _VIEWS, _STEPS_PER_EV = 64, 16, 3, 8
_DARKEST = 1e-3
_LUMINANCE = (0.2126, 0.7152, 0.0722)


def meter_ev100(flat: FlatScene, camera: CameraConfig, config: RenderConfig, scene_key: int, poses: Sequence[CameraPose]) -> float:
    """Return EV100 = log2(100 L / K) of the log-average luminance L of small renderings along a path, in steps of 1/8 EV.

    The steps keep it the same on processors whose last bits differ; everything else makes it depend on the scene only.

    Args:
        flat: the scene.
        camera: whose view is metered.
        config: depth and threads are taken from it.
        scene_key: of the scene.
        poses: the path; a few of its views are metered.
    """
    small = CameraConfig(width=_WIDTH, height=max(1, _WIDTH * camera.height // camera.width), horizontal_fov_rad=camera.horizontal_fov_rad)
    quick = RenderConfig(samples_per_pixel=_SAMPLES, max_depth=config.max_depth, threads=config.threads, portable=config.portable)
    chosen = sorted({round(i) for i in np.linspace(0, len(poses) - 1, _VIEWS)})
    logs = []
    with Renderer(flat, small, quick, scene_key) as renderer:
        for index in chosen:
            radiance = renderer.render(poses[index], index, ("color",)).radiance
            assert radiance is not None
            logs.append(np.log2(np.maximum(radiance.astype(np.float64) @ _LUMINANCE, _DARKEST)).mean())
    ev100 = float(np.mean(logs)) + math.log2(100.0 / METER_CONSTANT)
    return round(ev100 * _STEPS_PER_EV) / _STEPS_PER_EV
