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
from renderer.film.false_color import (
    AS_IT_IS,
    CLASSES,
    DIRECTION,
    DISTANCE,
    EXPOSED,
    METRES,
    MOTION,
    NOISE,
    OBJECTS,
    REFLECTANCE,
    SHARE,
    STATES,
    UNIT_CUBE,
    Picture,
)
from scene_description import SceneDescription
from scene_description.labels import (
    LabelTable,
    instance_labels,
    material_labels,
    occlusion_labels,
    part_labels,
    semantic_labels,
)
from scene_description.light_labels import light_labels


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
        name="color_sensed",
        summary="what the modelled sensor reads of colour",
        meaning="what lens, sensor and processing of `sensor.*` make of the light of `color`; the same bytes where they are ideal",
        dtype="uint8",
        channels=3,
        group="color",
        picture=AS_IT_IS,
        compression="color",
        option="sensed",
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
        name="direct",
        summary="the direct part of the light in cd/m2",
        meaning="part of the linear colour before denoising that is scattered once at most: lights, and what they light",
        dtype="float32",
        channels=3,
        unit="cd/m2",
        group="color",
        picture=EXPOSED,
        exr=("direct.R", "direct.G", "direct.B"),
        option="light",
    ),
    Layer(
        name="indirect",
        summary="the indirect part of the light in cd/m2",
        meaning="part of the linear colour before denoising that is scattered more often; direct and indirect are all light",
        dtype="float32",
        channels=3,
        unit="cd/m2",
        group="color",
        picture=EXPOSED,
        exr=("indirect.R", "indirect.G", "indirect.B"),
        option="light",
    ),
    Layer(
        name="shadow",
        summary="shadow: the share of the direct light that something blocks",
        meaning="share of the light from lamps and window panes that something blocks on its way to what is seen first: "
        "0 fully lit, 1 in shadow; NaN: none would arrive anyway",
        dtype="float32",
        no_hit=math.nan,
        group="sampled",
        picture=SHARE,
        exr=("shadow.share",),
        option="light",
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
    Layer(
        name="position",
        summary="3D positions in the world",
        meaning="point that is hit, world frame",
        dtype="float32",
        channels=3,
        unit="m",
        no_hit=math.nan,
        group="hit",
        picture=METRES,
        exr=("position.X", "position.Y", "position.Z"),
        option="layers",
    ),
    Layer(
        name="position_camera",
        summary="3D positions before the camera",
        meaning="point that is hit, optical frame",
        dtype="float32",
        channels=3,
        unit="m",
        no_hit=math.nan,
        group="hit",
        picture=METRES,
        exr=("position_camera.X", "position_camera.Y", "position_camera.Z"),
        option="layers",
    ),
    Layer(
        name="normals_world",
        summary="surface normals in the world",
        meaning="geometric unit normal, world frame, towards the camera",
        dtype="float32",
        channels=3,
        no_hit=0.0,
        group="hit",
        picture=DIRECTION,
        exr=("normals_world.X", "normals_world.Y", "normals_world.Z"),
        option="layers",
    ),
    Layer(
        name="shading_normals",
        summary="shading normals",
        meaning="normal that light is scattered by, of smooth and textured surfaces, optical frame",
        dtype="float32",
        channels=3,
        no_hit=0.0,
        group="hit",
        picture=DIRECTION,
        exr=("shading_normals.X", "shading_normals.Y", "shading_normals.Z"),
        option="layers",
    ),
    Layer(
        name="shading_normals_world",
        summary="shading normals in the world",
        meaning="the same, world frame",
        dtype="float32",
        channels=3,
        no_hit=0.0,
        group="hit",
        picture=DIRECTION,
        exr=("shading_normals_world.X", "shading_normals_world.Y", "shading_normals_world.Z"),
        option="layers",
    ),
    Layer(
        name="incidence",
        summary="the angle at which surfaces are seen",
        meaning="angle between the ray and the geometric normal, 0 where a surface is seen head-on",
        dtype="float32",
        unit="rad",
        no_hit=math.nan,
        group="hit",
        picture=SHARE,
        exr=("incidence.Y",),
        option="layers",
    ),
    Layer(
        name="part",
        summary="ids of the objects' parts",
        meaning="part id, 0 for what belongs to no named part",
        dtype="uint16",
        no_hit=0.0,
        group="hit",
        picture=OBJECTS,
        exr=("part.id",),
        labels=part_labels,
        compression="ids",
        option="layers",
    ),
    Layer(
        name="material",
        summary="ids of materials",
        meaning="material id; its label tells name and BSDF values",
        dtype="uint16",
        no_hit=0.0,
        group="hit",
        picture=OBJECTS,
        exr=("material.id",),
        labels=material_labels,
        compression="ids",
        option="layers",
    ),
    Layer(
        name="base_color",
        summary="the base colour at the hit",
        meaning="linear base colour of the surface, texture included",
        dtype="float32",
        channels=3,
        no_hit=0.0,
        group="hit",
        picture=REFLECTANCE,
        exr=("base_color.R", "base_color.G", "base_color.B"),
        option="layers",
    ),
    Layer(
        name="roughness",
        summary="roughness",
        meaning="perceptual roughness, texture included",
        dtype="float32",
        no_hit=0.0,
        group="hit",
        picture=SHARE,
        exr=("roughness.Y",),
        option="layers",
    ),
    Layer(
        name="metallic",
        summary="metalness",
        meaning="metalness, texture included",
        dtype="float32",
        no_hit=0.0,
        group="hit",
        picture=SHARE,
        exr=("metallic.Y",),
        option="layers",
    ),
    Layer(
        name="emission",
        summary="the light that surfaces emit",
        meaning="luminance that the surface itself sends to the camera; of panes that of the sky behind, if nothing stands before it",
        dtype="float32",
        channels=3,
        unit="cd/m2",
        no_hit=0.0,
        group="hit",
        picture=EXPOSED,
        exr=("emission.R", "emission.G", "emission.B"),
        option="layers",
    ),
    Layer(
        name="light_seen",
        summary="which light is seen",
        meaning="id of the lamp, window pane or glowing part that is seen itself, 1 for the sky outside, 0 for what sends no light",
        dtype="uint16",
        no_hit=1.0,
        group="hit",
        picture=OBJECTS,
        exr=("light_seen.id",),
        labels=light_labels,
        compression="ids",
        option="layers",
    ),
    Layer(
        name="uv",
        summary="texture coordinates",
        meaning="texture coordinates along the surface",
        dtype="float32",
        channels=2,
        unit="m",
        no_hit=math.nan,
        group="hit",
        picture=METRES,
        exr=("uv.U", "uv.V"),
        option="layers",
    ),
    Layer(
        name="object_coordinates",
        summary="normalised object coordinates",
        meaning="place in the object's box: back to front, right to left, bottom to top, each 0 to 1; of the shell in the room's",
        dtype="float32",
        channels=3,
        no_hit=math.nan,
        group="hit",
        picture=UNIT_CUBE,
        exr=("object_coordinates.X", "object_coordinates.Y", "object_coordinates.Z"),
        option="layers",
    ),
    Layer(
        name="flow",
        summary="optical flow to the next frame",
        meaning="motion of what is seen to the next frame, right and down; NaN at the path's end, of what comes to lie behind the camera",
        dtype="float32",
        channels=2,
        unit="px",
        no_hit=math.nan,
        group="hit",
        picture=MOTION,
        exr=("flow.U", "flow.V"),
        option="layers",
    ),
    Layer(
        name="flow_backward",
        summary="optical flow to the frame before",
        meaning="the same to the frame before; NaN at the path's beginning",
        dtype="float32",
        channels=2,
        unit="px",
        no_hit=math.nan,
        group="hit",
        picture=MOTION,
        exr=("flow_backward.U", "flow_backward.V"),
        option="layers",
    ),
    Layer(
        name="occlusion",
        summary="what is hidden in the next frame",
        meaning="whether what is seen is seen in the next frame: 0 visible, 1 hidden, 2 outside the image, 3 unknown",
        dtype="uint8",
        no_hit=3.0,
        group="hit",
        picture=STATES,
        exr=("occlusion.id",),
        labels=lambda _: occlusion_labels(),
        compression="ids",
        option="layers",
    ),
    Layer(
        name="occlusion_backward",
        summary="what was hidden in the frame before",
        meaning="the same of the frame before",
        dtype="uint8",
        no_hit=3.0,
        group="hit",
        picture=STATES,
        exr=("occlusion_backward.id",),
        labels=lambda _: occlusion_labels(),
        compression="ids",
        option="layers",
    ),
    Layer(
        name="boundaries",
        summary="occlusion boundaries",
        meaning="255 at the last pixel of a surface before one that it hides, else 0",
        dtype="uint8",
        no_hit=0.0,
        group="hit",
        picture=AS_IT_IS,
        exr=("boundaries.Y",),
        option="layers",
    ),
    Layer(
        name="coverage",
        summary="how much of each pixel its object covers",
        meaning="share of 4 x 4 rays through the pixel that hit the object of its id; 1 where all neighbours have that id",
        dtype="float32",
        no_hit=None,
        group="hit",
        picture=SHARE,
        exr=("coverage.Y",),
        option="layers",
    ),
    Layer(
        name="glass",
        summary="where glass is",
        meaning="255 where what is hit lets most of the light through, else 0",
        dtype="uint8",
        no_hit=0.0,
        group="hit",
        picture=AS_IT_IS,
        exr=("glass.Y",),
        option="layers",
    ),
    Layer(
        name="mirror",
        summary="where mirrors are",
        meaning="255 where what is hit is smooth metal, else 0",
        dtype="uint8",
        no_hit=0.0,
        group="hit",
        picture=AS_IT_IS,
        exr=("mirror.Y",),
        option="layers",
    ),
    Layer(
        name="depth_opaque",
        summary="depth behind glass",
        meaning="depth of the first opaque surface on the straight line of sight",
        dtype="float32",
        unit="m",
        no_hit=math.inf,
        group="hit",
        picture=DISTANCE,
        exr=("depth_opaque.Z",),
        compression="depth",
        option="layers",
    ),
    Layer(
        name="normals_opaque",
        summary="normals behind glass",
        meaning="normal of the first opaque surface, as normals",
        dtype="float32",
        channels=3,
        no_hit=0.0,
        group="hit",
        picture=DIRECTION,
        exr=("normals_opaque.X", "normals_opaque.Y", "normals_opaque.Z"),
        option="layers",
    ),
    Layer(
        name="semantic_opaque",
        summary="class ids behind glass",
        meaning="class id of the first opaque surface",
        dtype="uint8",
        no_hit=0.0,
        group="hit",
        picture=CLASSES,
        exr=("semantic_opaque.id",),
        labels=lambda _: semantic_labels(),
        compression="ids",
        option="layers",
    ),
    Layer(
        name="instance_opaque",
        summary="object ids behind glass",
        meaning="object id of the first opaque surface",
        dtype="uint16",
        no_hit=0.0,
        group="hit",
        picture=OBJECTS,
        exr=("instance_opaque.id",),
        labels=instance_labels,
        compression="ids",
        option="layers",
    ),
)
"""In the order of the parameters, and so of the keys in ``<renderer>/settings``."""

LAYERS: dict[str, Layer] = {row.name: row for row in sorted(ROWS, key=lambda row: row.option != "")}
"""By name, in the order of frames and files: first what is always written, then what options ask for.

Where the lens sees nothing, distances are NaN and all else is 0.
"""

GEOMETRIC_LAYERS = tuple(name for name, row in LAYERS.items() if row.group == "geometric")
"""Layers that are filled while the rays through the pixel centres are traced."""

HIT_LAYERS = tuple(name for name, row in LAYERS.items() if row.group == "hit")
"""Layers that are computed from the hit record of these rays, each when it is asked for."""

COLOR_LAYERS = tuple(name for name, row in LAYERS.items() if row.group == "color")
"""Layers for which light is traced."""

SENSED_LAYERS = tuple(name for name, row in LAYERS.items() if row.group == "sensed")

PHOTOGRAPHS = tuple(name for name in COLOR_LAYERS if LAYERS[name].dtype == "uint8" and LAYERS[name].channels == 3)
"""Layers that show light at an exposure."""

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
