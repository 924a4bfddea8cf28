"""What a camera sees: rays through Embree from numba kernels, ground truth from one hit record, physically based colour.

Knows scenes only as :class:`~renderer.scene.flat_scene.FlatScene`: one world-space mesh and small tables.
"""

from typing import TYPE_CHECKING

from scene_description.on_demand import names_on_demand

if TYPE_CHECKING:
    from renderer.camera.config import CameraConfig, SensorConfig
    from renderer.core.errors import RenderCancelled, RenderError
    from renderer.film.frame import Frame
    from renderer.film.layers import GEOMETRIC_LAYERS, LAYERS
    from renderer.geometry.mesh import Mesh
    from renderer.path.config import RenderConfig
    from renderer.renderer import Renderer
    from renderer.scene.flat_scene import FlatScene, MaterialTable, PartTable, Sky, tabulate_materials
    from renderer.sensors.devices import DepthSensorConfig
    from renderer.warming import WARM_LAYERS, warm_up

__all__ = [
    "GEOMETRIC_LAYERS",
    "LAYERS",
    "WARM_LAYERS",
    "CameraConfig",
    "DepthSensorConfig",
    "FlatScene",
    "Frame",
    "MaterialTable",
    "Mesh",
    "PartTable",
    "RenderCancelled",
    "RenderConfig",
    "RenderError",
    "Renderer",
    "SensorConfig",
    "Sky",
    "tabulate_materials",
    "warm_up",
]

__getattr__ = names_on_demand(
    __name__,
    {
        "GEOMETRIC_LAYERS": "film.layers",
        "LAYERS": "film.layers",
        "WARM_LAYERS": "warming",
        "CameraConfig": "camera.config",
        "DepthSensorConfig": "sensors.devices",
        "FlatScene": "scene.flat_scene",
        "Frame": "film.frame",
        "MaterialTable": "scene.flat_scene",
        "Mesh": "geometry.mesh",
        "PartTable": "scene.flat_scene",
        "RenderCancelled": "core.errors",
        "RenderConfig": "path.config",
        "RenderError": "core.errors",
        "Renderer": "renderer",
        "SensorConfig": "camera.config",
        "Sky": "scene.flat_scene",
        "tabulate_materials": "scene.flat_scene",
        "warm_up": "warming",
    },
)
