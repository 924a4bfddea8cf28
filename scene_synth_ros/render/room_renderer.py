"""The renderer of the room at work, made when it is first needed."""

from __future__ import annotations

from collections.abc import Callable, Collection
from typing import Any

from renderer import Renderer
from renderer.annotations import Annotator
from renderer.film.frame import Frame
from scene_description import CameraPose
from scene_synth_ros.messages.detections import ANNOTATIONS


class RoomRenderer:
    """Renders a room whose geometry is made when it is prepared, or when the first layer is asked for.

    A live camera that nobody looks at thus costs next to nothing.

    Threading: the rendering thread.

    Args:
        make: returns the room's renderer, which its caller closes.
        make_annotator: returns its annotator, which its caller closes.
    """

    def __init__(self, make: Callable[[], Renderer], make_annotator: Callable[[], Annotator]) -> None:
        self._make, self._make_annotator = make, make_annotator
        self._renderer: Renderer | None = None
        self._annotator: Annotator | None = None

    def prepare(self) -> Renderer:
        """Return the renderer, made now if it was not yet.

        Raises:
            SceneSynthError: the room cannot be made.
        """
        if self._renderer is None:
            self._renderer = self._make()
        return self._renderer

    def render(self, pose: CameraPose, frame_index: int, layers: Collection[str], **how: Any) -> Frame:
        """Do as ``Renderer.render``, with annotations if ``ANNOTATIONS`` is among the layers; without any, return a frame without any.

        Raises:
            SceneSynthError: the room cannot be made, or the frame cannot be rendered.
            RenderCancelled: as ``Renderer.render``.
        """
        if not layers:
            return Frame({}, None)
        renderer = self.prepare()
        if ANNOTATIONS in layers:
            self._annotator = self._annotator or self._make_annotator()
            layers, how = tuple(layer for layer in layers if layer != ANNOTATIONS), how | {"annotator": self._annotator}
        return renderer.render(pose, frame_index, layers, **how)
