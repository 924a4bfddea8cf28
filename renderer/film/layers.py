"""What a layer is: one row of one table.

Frames, messages, topics, parameters, files, pictures, contact sheets, options of commands and ``docs/layers.md`` are made from the rows.
A new layer is its computation, a row here, a test, and the page made again: ``scene_synth layers --markdown > docs/layers.md``.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass
from typing import Any, Literal

from numpy.typing import NDArray

from renderer.core.errors import RenderError
from renderer.film.false_color import AS_IT_IS, CLASSES, DIRECTION, DISTANCE, EXPOSED, NOISE, OBJECTS, REFLECTANCE, Picture
from scene_description import SceneDescription
from scene_description.labels import LabelTable, instance_labels, semantic_labels


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
    no_hit: float | None = None
    """Value of pixels whose ray hits nothing; None: they are as others."""
    group: Literal["geometric", "sampled", "color", "sensed"]
    """geometric: from the hit record of the rays through the pixel centres; sampled: mean of samples; color: such a mean, of light;
    sensed: what the modelled depth sensor reads."""
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
    """Of ``scene_synth render``, asks for it; empty: it is always written."""

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


ROWS = (
    Layer(
        name="color",
        summary="colour",
        meaning="sRGB display colour",
        dtype="uint8",
        channels=3,
        group="color",
        picture=AS_IT_IS,
        compression="color",
        published=True,
    ),
    Layer(
        name="depth",
        summary="depth along the optical axis; a panorama publishes range instead",
        meaning="distance along the optical z axis",
        dtype="float32",
        unit="m",
        no_hit=math.inf,
        group="geometric",
        picture=DISTANCE,
        exr=("depth.Z",),
        compression="depth",
        published=True,
    ),
    Layer(
        name="depth_sensed",
        summary="depth as the sensor of depth_sensor.model reads it",
        meaning="distance along the optical z axis as the modelled sensor reads it; -inf too near, NaN invalid",
        dtype="float32",
        unit="m",
        no_hit=math.inf,
        group="sensed",
        picture=DISTANCE,
        exr=("depth_sensed.Z",),
        compression="depth",
        option="sensed",
    ),
    Layer(
        name="range",
        summary="range, the distance along each ray",
        meaning="distance along the ray",
        dtype="float32",
        unit="m",
        no_hit=math.inf,
        group="geometric",
        picture=DISTANCE,
        exr=("range.Z",),
    ),
    Layer(
        name="color_noisy",
        summary="colour before denoising",
        meaning="sRGB display colour before denoising",
        dtype="uint8",
        channels=3,
        group="color",
        picture=AS_IT_IS,
        option="noisy",
    ),
    Layer(
        name="albedo",
        summary="the base colour of what is seen",
        meaning="linear base colour of what is seen first, 1 for glass and lit lamps",
        dtype="float32",
        channels=3,
        no_hit=0.0,
        group="sampled",
        picture=REFLECTANCE,
        exr=("albedo.R", "albedo.G", "albedo.B"),
        option="albedo",
    ),
    Layer(
        name="radiance",
        summary="linear colour in cd/m2",
        meaning="linear colour, RGB luminance, neither exposed nor balanced",
        dtype="float32",
        channels=3,
        unit="cd/m2",
        group="color",
        picture=EXPOSED,
        exr=("R", "G", "B"),
        option="radiance",
    ),
    Layer(
        name="variance",
        summary="the variance of the colour before denoising",
        meaning="variance of the linear colour before denoising; NaN after one sample",
        dtype="float32",
        channels=3,
        unit="(cd/m2)^2",
        group="color",
        picture=NOISE,
        exr=("variance.R", "variance.G", "variance.B"),
        option="variance",
    ),
    Layer(
        name="samples",
        summary="how many samples colour is made of",
        meaning="samples per pixel that colour is the mean of",
        dtype="uint16",
        group="color",
        picture=AS_IT_IS,
        exr=("samples.count",),
        option="variance",
    ),
    Layer(
        name="normals",
        summary="surface normals",
        meaning="geometric unit normal, optical frame, towards the camera",
        dtype="float32",
        channels=3,
        no_hit=0.0,
        group="geometric",
        picture=DIRECTION,
        exr=("normals.X", "normals.Y", "normals.Z"),
        published=True,
    ),
    Layer(
        name="semantic",
        summary="NYU40 class ids",
        meaning="NYU40 class id, 0 for void",
        dtype="uint8",
        no_hit=0.0,
        group="geometric",
        picture=CLASSES,
        exr=("semantic.id",),
        labels=lambda _: semantic_labels(),
        compression="ids",
        published=True,
    ),
    Layer(
        name="instance",
        summary="object ids",
        meaning="object id, 0 for the room's shell",
        dtype="uint16",
        no_hit=0.0,
        group="geometric",
        picture=OBJECTS,
        exr=("instance.id",),
        labels=instance_labels,
        compression="ids",
        published=True,
    ),
)
"""In the order of the parameters, and so of the keys in ``<renderer>/settings``."""

LAYERS: dict[str, Layer] = {row.name: row for row in sorted(ROWS, key=lambda row: row.option != "")}
"""By name, in the order of frames and files: first what is always written, then what options ask for.

Where the lens sees nothing, distances are NaN and all else is 0.
"""

GEOMETRIC_LAYERS = tuple(name for name, row in LAYERS.items() if row.group == "geometric")
COLOR_LAYERS = tuple(name for name, row in LAYERS.items() if row.group == "color")
"""Layers for which light is traced."""

SENSED_LAYERS = tuple(name for name, row in LAYERS.items() if row.group == "sensed")

SAMPLED_LAYERS = tuple(name for name, row in LAYERS.items() if row.group in ("sampled", "color"))
"""Layers that are means of samples: they carry noise, and the blur of whatever the lens or the shutter blurs."""


def check_names(names: Collection[str]) -> None:
    """Refuse names that no row has.

    Raises:
        RenderError: there is one; the line lists the known ones.
    """
    unknown = sorted(set(names) - set(LAYERS))
    if unknown:
        raise RenderError(f"layers: expected some of {', '.join(LAYERS)}, got {', '.join(unknown)}")


def check_layers(images: Mapping[str, NDArray[Any]]) -> None:
    """Refuse images, by layer, that do not fit the table or each other.

    Raises:
        RenderError: an unknown layer, another dtype or shape than its row says, or images of several sizes.
    """
    check_names(images)
    for name, image in images.items():
        LAYERS[name].check(image)
    sizes = sorted({image.shape[:2] for image in images.values()})
    if len(sizes) > 1:
        raise RenderError(f"layers: expected one size, got {' and '.join(map(str, sizes))}")
