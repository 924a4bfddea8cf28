"""What is known of a layer."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Literal

from numpy.typing import NDArray

from renderer.core.errors import RenderError
from renderer.film.false_color import Picture
from scene_description import SceneDescription
from scene_description.labels import LabelTable

FrameName = Literal["", "row", "stamp", "world", "object", "rows of both"]
"""What coordinates, distances and directions of a pixel are told in: the optical frame at the time of the pixel's row, that of the stamp,
the world, the object's box, or the pixels of its row and of the other frame's that the point falls on; empty: none of these."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Layer:
    """All that is known of a layer but how it is computed."""

    name: str
    """Of the layer, of its topics and files, and of the parameter ``streams.<name>`` that publishes it."""
    summary: str
    """A few words that follow "publish" or "write"."""
    meaning: str
    """What a pixel tells."""
    dtype: Literal["uint8", "uint16", "float32"]
    channels: int = 1
    unit: str = ""
    frame: FrameName = ""
    no_hit: float | None = None
    """Value of pixels whose ray hits nothing; None: they are as others."""
    group: Literal["geometric", "hit", "sampled", "color", "sensed"]
    """geometric: filled while the rays through the pixel centres are traced; hit: computed from their hit record; sampled: mean of samples;
    color: such a mean, of light; sensed: what the modelled depth sensor reads."""
    picture: Picture
    """For people."""
    exr: tuple[str, ...] = ()
    """Names of the channels in EXR files; empty: they do not hold the layer."""
    labels: Callable[[SceneDescription], LabelTable] | None = None
    """What the ids of a scene mean; None: pixels are no ids."""
    compression: Literal["", "color", "ids", "depth"] = ""
    """Which of a recorder's settings ``images.*`` compresses it; empty: none does."""
    published: bool = False
    """Unless its parameter says otherwise."""
    option: str = ""
    """Of ``scene_synth render``, asks for it; empty: it is always written; "layers": only ``--layers`` asks for it."""

    def shape(self, height: int, width: int) -> tuple[int, ...]:
        """Return the shape of an image: (height, width), or (height, width, channels) where there are several."""
        return (height, width) if self.channels == 1 else (height, width, self.channels)

    def check(self, image: NDArray[Any]) -> None:
        """Refuse an image that is none of this layer.

        Raises:
            RenderError: its dtype or its shape is another.
        """
        if image.dtype != self.dtype or image.ndim < 2 or image.shape != self.shape(*image.shape[:2]):
            shape = "(height, width)" if self.channels == 1 else f"(height, width, {self.channels})"
            raise RenderError(f"layer {self.name}: expected {self.dtype} {shape}, got {image.dtype} {image.shape}")
