"""What a camera sees: rays through Embree from numba kernels, ground truth from one hit record, physically based colour.

Knows scenes only as :class:`~renderer.flat_scene.FlatScene`: one world-space mesh and small tables.
"""

from renderer.config import CameraConfig, RenderConfig, SensorConfig
from renderer.errors import RenderCancelled, RenderError
from renderer.flat_scene import FlatScene, MaterialTable, Mesh, PartTable, Sky, tabulate_materials
from renderer.frame import GEOMETRIC_LAYERS, LAYERS, Frame
from renderer.renderer import Renderer, warm_up

__all__ = [
    "GEOMETRIC_LAYERS",
    "LAYERS",
    "CameraConfig",
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
