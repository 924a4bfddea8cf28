"""What paths need of a scene beside its triangles, made when it is first asked for: basic ground truth needs none of it."""

from functools import cached_property

from renderer.core.embree import SceneHandle
from renderer.path.lights import Lights, build_lights
from renderer.path.sun_patches import find_sun_patches
from renderer.path.surface_tables import Surfaces, build_surfaces
from renderer.scene.flat_scene import FlatScene


class LightTables:
    """The surfaces and lights of a scene; renderers of the same scene and trees share them.

    ``tree``: the scene's triangles, valid as long as this is asked.
    """

    def __init__(self, flat: FlatScene, tree: SceneHandle) -> None:
        self._flat, self._tree = flat, tree

    @cached_property
    def surfaces(self) -> Surfaces:
        """What each part is made of, and the sky."""
        return build_surfaces(self._flat)

    @cached_property
    def lights(self) -> Lights:
        """What shines, and where the sun falls into the room."""
        lights = build_lights(self._flat)
        return lights._replace(patches=find_sun_patches(self._flat, lights.infinite, self._tree))
