"""Kernels compiled, or loaded from numba's cache, before the first image is asked for."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import replace

import numpy as np

from renderer.camera.config import CameraConfig
from renderer.film.layers import GEOMETRIC_LAYERS, SAMPLED_LAYERS
from renderer.film.tone import Exposure
from renderer.film.white_balance import white_of_kelvin
from renderer.geometry.mesh import Mesh
from renderer.path.config import IntegratorName, RenderConfig
from renderer.renderer import IDEAL_DEPTH, Renderer
from renderer.scene.flat_scene import FlatScene, PartTable, Sky, tabulate_materials
from renderer.sensors.devices import DepthSensorConfig
from renderer.standpoint import seen_around
from scene_description import Material
from scene_description.poses import look_at
from scene_description.types import CameraPose

WARM_LAYERS = (*GEOMETRIC_LAYERS, *SAMPLED_LAYERS)
"""Layers whose kernels are ready after :func:`warm_up`; each of the others has its own, compiled when it is first asked for."""


def warm_up(
    layers: Collection[str] = WARM_LAYERS,
    depth_sensor: DepthSensorConfig = IDEAL_DEPTH,
    integrator: IntegratorName = "path",
    *,
    guiding: bool = False,
    final_gathering: bool = False,
) -> None:
    """Compile the kernels of some layers, or load them from numba's cache, by rendering one pixel of a lone pane in the sun.

    Those that look for where a camera stands are among them and, with layers of light, those that look for the patches where the sun falls.

    ``depth_sensor``: the one that ``depth_sensed`` is to be ready for; the others: as of ``RenderConfig``.

    Raises:
        RenderError: Embree is missing.
    """
    corners = np.array([[1, -1, -1], [1, 0, 1], [1, 1, -1]], np.float32)
    mesh = Mesh(corners, np.tile(np.array([[-1, 0, 0]], np.float32), (3, 1)), np.array([[0, 1, 2]], np.uint32), corners[:, 1:].copy())
    parts = PartTable(
        np.zeros(1, np.uint16), np.zeros(1, np.uint8), np.zeros(1, np.int32), np.zeros((1, 3), np.float32), np.ones(1, np.bool_)
    )
    dark = np.zeros(3, np.float32)
    sky = Sky(dark, dark, dark, sun=np.array([1, 0, 0, 1e-5, 1, 1, 1], np.float32))
    flat = FlatScene(
        mesh, np.zeros(1, np.int32), parts, ("0/pane",), tabulate_materials([Material(id="m", family="m", base_color=(0.5, 0.5, 0.5))]), sky
    )
    pose = CameraPose(stamp_ns=0, position_m=(0.0, 0.0, 0.0), orientation=look_at((0.0, 0.0, 0.0), (1.0, 0.0, 0.0)))
    camera = CameraConfig(width=1, height=1)
    config = RenderConfig(
        integrator=integrator, guiding=guiding, final_gathering=final_gathering, samples_per_pixel=1, threads=1, grain=1.0
    )
    with Renderer(flat, camera, config, 0, depth_sensor=depth_sensor) as renderer:
        seen_around(renderer.tree, flat, pose.position_m)
        renderer.render(pose, 0, layers, path=(pose, replace(pose, stamp_ns=1)), exposure=Exposure(0.0, white_of_kelvin(4000.0)))
