"""One view with its hit record, and what several layers need of it."""

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from renderer.camera.cameras import PosedCamera, pose_camera
from renderer.camera.config import CameraConfig
from renderer.camera.shutter import in_motion
from renderer.core.embree import SceneHandle
from renderer.core.image_memory import ImageMemory
from renderer.core.workers import Workers
from renderer.path.ground_truth import GeometricImages, Hits, TracedView
from renderer.path.lights import Lights
from renderer.path.records import LitScene, Scratch
from renderer.path.surface_tables import Surfaces
from renderer.scene.flat_scene import FlatScene
from scene_description.types import CameraPose

Result = TypeVar("Result")


@dataclass(frozen=True, slots=True)
class TracedScene:
    """A scene as rays and look-ups take it, the threads that work on it, each with its scratch memory, and memory for images.

    label: (p,) uint8, semantic id of each part, as the basic layers hold it.
    """

    flat: FlatScene
    label: NDArray[np.uint8]
    surfaces: Surfaces
    lights: Lights
    tree: SceneHandle
    workers: Workers
    scratch: Sequence[Scratch]
    memory: ImageMemory

    @property
    def lit(self) -> LitScene:
        """What kernels take that trace light."""
        return LitScene(self.tree, self.surfaces, self.lights)

    def in_rows(self, kernel: Callable[..., None], *arguments: Any) -> None:
        """Call ``kernel(*arguments, first, step)`` in every thread: it does rows ``first``, ``first + step``, ... of pixels."""
        step = self.workers.count
        self.workers.run(lambda _, first: kernel(*arguments, first, step), range(step))

    def in_tiles(self, kernel: Callable[..., None], *arguments: Any) -> None:
        """Call ``kernel(rays, lanes, *arguments, first, step)`` in every thread: the same with rows of tiles, a packet and lanes."""
        step = self.workers.count
        work = [(memory.rays, memory.lanes) for memory in self.scratch]
        self.workers.run(lambda worker, first: kernel(*work[worker], *arguments, first, step), range(step))


@dataclass(frozen=True)
class HitView:
    """A view, its hit record, and the layers that are to follow from it.

    Attributes:
        scene: what was seen.
        config: the camera's lens.
        camera: the same at the frame's pose.
        images: the basic layers.
        hits: the hit record.
        pose: of the optical frame.
        path: the camera's poses; those before and after ``pose`` are the neighbouring frames.
        names: the layers that are asked for.
    """

    scene: TracedScene
    config: CameraConfig
    camera: PosedCamera
    images: GeometricImages
    hits: Hits
    pose: CameraPose
    path: Sequence[CameraPose]
    names: Collection[str]
    _shared: "dict[Callable[[HitView], Any], Any]" = field(default_factory=dict, repr=False)

    def shared(self, compute: "Callable[[HitView], Result]") -> Result:
        """Return what a function makes of this view, computed once for all layers that need it."""
        if compute not in self._shared:
            self._shared[compute] = compute(self)
        result: Result = self._shared[compute]
        return result

    @property
    def traced(self) -> TracedView:
        """What kernels take that shade its hits."""
        return TracedView(self.camera, self.images.range, self.hits, self.scene.flat.mesh.vertices, self.scene.flat.mesh.faces)

    @cached_property
    def neighbours(self) -> tuple[CameraPose | None, CameraPose | None]:
        """Poses of the frames before and after this one on the path; None at its ends, and for a pose that is none of the path's."""
        try:
            index = self.path.index(self.pose)
        except ValueError:
            return None, None
        return (self.path[index - 1] if index else None), (self.path[index + 1] if index + 1 < len(self.path) else None)

    @cached_property
    def neighbour_views(self) -> tuple[PosedCamera | None, PosedCamera | None]:
        """The camera as it takes the frames before and after this one, with its motion."""
        before, after = (
            None if pose is None else in_motion(pose_camera(self.config, pose), self.config, pose, self.path) for pose in self.neighbours
        )
        return before, after


HitLayers = Mapping[str, Callable[[HitView], NDArray[Any]]]
"""Name of a layer -> what computes it."""


def shared_fields(compute: Callable[[HitView], tuple[Any, ...]], names: Sequence[str], suffix: str = "") -> HitLayers:
    """Return the layers, called by the fields and a suffix, of a record that a function makes of a view, once for all of them."""

    def field_of(name: str) -> Callable[[HitView], NDArray[Any]]:
        return lambda view: getattr(view.shared(compute), name)

    return {name + suffix: field_of(name) for name in names}
