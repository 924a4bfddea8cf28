"""Kernels compiled, or loaded from numba's cache, before the first image is asked for.

Half of what cached colour compiles is the kernel that shades frames, and nothing of it hangs on the kernels that compute nodes: where it is
not on disk yet, ``python -m renderer.warming`` compiles it in a process of its own.
"""

import subprocess
import sys
from collections.abc import Callable, Collection
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from kernel_cache.compiling import is_kept
from renderer.cached_frames.shading import shade_hits
from renderer.camera.config import CameraConfig
from renderer.core.random_numbers import make_frame_key
from renderer.film.layers import GEOMETRIC_LAYERS, PICTURES, SAMPLED_LAYERS
from renderer.film.tone import Exposure
from renderer.film.white_balance import white_of_kelvin
from renderer.geometry.mesh import Mesh
from renderer.irradiance_cache.bright_nodes import choose_bright
from renderer.irradiance_cache.cache import IrradianceCache
from renderer.irradiance_cache.cache_geometry import CacheConfig
from renderer.irradiance_cache.gathering import CoarseLight
from renderer.irradiance_cache.lamp_images import NO_IMAGES
from renderer.irradiance_cache.nodes import ROW, make_node_light
from renderer.irradiance_cache.panes import NO_PANES
from renderer.lidar.config import NO_SCAN, ScanConfig
from renderer.lidar.lidar import Lidar
from renderer.lidar.scanner import Scanner
from renderer.lidar.sweep_config import NO_LIDAR, LidarConfig
from renderer.path.config import IntegratorName, RenderConfig
from renderer.path.light_nodes import NOTHING_KNOWN
from renderer.renderer import IDEAL_DEPTH, Renderer
from renderer.scene.flat_scene import FlatScene, PartTable, Sky, tabulate_materials
from renderer.sensors.devices import DepthSensorConfig
from renderer.standpoint import seen_around
from scene_description import Material
from scene_description.motion_of_poses import motion_of_poses
from scene_description.poses import look_at
from scene_description.types import CameraPose

WARM_LAYERS = (*GEOMETRIC_LAYERS, *SAMPLED_LAYERS)
"""Layers whose kernels are ready after :func:`warm_up`; each of the others has its own, compiled when it is first asked for."""

_CAMERA = CameraConfig(width=1, height=1)


def _lone_pane() -> FlatScene:
    """Return a pane in the sun, a metre along x."""
    corners = np.array([[1, -1, -1], [1, 0, 1], [1, 1, -1]], np.float32)
    mesh = Mesh(corners, np.tile(np.array([[-1, 0, 0]], np.float32), (3, 1)), np.array([[0, 1, 2]], np.uint32), corners[:, 1:].copy())
    parts = PartTable(
        np.zeros(1, np.uint16), np.zeros(1, np.uint8), np.zeros(1, np.int32), np.zeros((1, 3), np.float32), np.ones(1, np.bool_)
    )
    dark = np.zeros(3, np.float32)
    sky = Sky(dark, dark, dark, sun=np.array([1, 0, 0, 1e-5, 1, 1, 1], np.float32))
    return FlatScene(
        mesh, np.zeros(1, np.int32), parts, ("0/pane",), tabulate_materials([Material(id="m", family="m", base_color=(0.5, 0.5, 0.5))]), sky
    )


def _seen_along(x: float) -> CameraPose:
    return CameraPose(stamp_ns=0, position_m=(0.0, 0.0, 0.0), orientation=look_at((0.0, 0.0, 0.0), (x, 0.0, 0.0)))


def warm_up(
    layers: Collection[str] = WARM_LAYERS,
    depth_sensor: DepthSensorConfig = IDEAL_DEPTH,
    integrator: IntegratorName = "path",
    *,
    guiding: bool = False,
    final_gathering: bool = False,
    scan: ScanConfig = NO_SCAN,
    lidar: LidarConfig = NO_LIDAR,
) -> None:
    """Compile the kernels of some layers, or load them from numba's cache, by rendering one pixel of a lone pane in the sun.

    Those that look for where a camera stands are among them and, with layers of light, those that look for the patches where the sun falls.

    ``depth_sensor``: the one that ``depth_sensed`` is to be ready for; ``scan``, ``lidar``: those that scan and sweep, where they are
    enabled; the others: as of ``RenderConfig``.

    Raises:
        RenderError: Embree is missing.
    """
    flat, pose = _lone_pane(), _seen_along(1.0)
    config = RenderConfig(
        integrator=integrator, guiding=guiding, final_gathering=final_gathering, samples_per_pixel=1, threads=1, grain=1.0
    )
    beside, path = None, (pose, replace(pose, stamp_ns=1))
    if integrator == "cached" and any(layer in PICTURES for layer in layers) and not is_kept(shade_hits):
        beside = subprocess.Popen([sys.executable, "-m", "renderer.warming"], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    try:
        with Renderer(flat, _CAMERA, config, 0, depth_sensor=depth_sensor) as renderer:
            seen_around(renderer.tree, flat, pose.position_m)
            if beside:
                renderer.prepare(pose)
                renderer.render(pose, 0, [layer for layer in layers if layer not in PICTURES], path=path)
                beside.wait()
            renderer.render(pose, 0, layers, path=path, exposure=Exposure(0.0, white_of_kelvin(4000.0)))
            if scan.enabled:
                Scanner(renderer.tree, flat, scan, 0).scan(0, 0, path)
            if lidar.enabled:
                Lidar(renderer.tree, flat, lidar, motion_of_poses(path), 0).sweep(0)
    finally:
        if beside:
            beside.kill()
            beside.wait()


class _NoNodes(IrradianceCache):
    """The cache of a room about whose light nothing is known, and nothing is asked."""

    def __init__(self) -> None:
        self.atlas, self.config, self._key = NOTHING_KNOWN.atlas, CacheConfig(), make_frame_key(0, 0, ())
        none = np.zeros((0, 3), np.float32)
        self.rows, self.even, self.around, self.leaving = np.zeros((0, ROW), np.float32), none, none, none
        self.light = make_node_light(0)
        bright = choose_bright(none, none, self.atlas, 1.0, 1, 0.0, np.zeros(0, np.int32), NO_PANES)
        self.source = CoarseLight(
            self.atlas, none, none[:, 0].copy(), np.zeros(0, np.bool_), bright, bright, NO_IMAGES, np.zeros((0, 6), np.float32)
        )

    def solve(self, cancelled: Callable[[], bool] | None = None) -> None:
        """Do nothing."""

    def fill(self, is_read: NDArray[np.bool_], cancelled: Callable[[], bool] | None = None) -> int:
        """Do nothing: no node is read."""
        return 0


class _Unlit(Renderer):
    """A renderer of such a room."""

    def _irradiance_cache(self) -> IrradianceCache:
        return _NoNodes()


def warm_up_frames() -> None:
    """Compile the kernels of cached frames, or load them, by a picture of nothing: without those of the cache's nodes."""
    with _Unlit(_lone_pane(), _CAMERA, RenderConfig(integrator="cached", threads=1), 0) as renderer:
        renderer.render(_seen_along(-1.0), 0, ("radiance",))


if __name__ == "__main__":
    warm_up_frames()
