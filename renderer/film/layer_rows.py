"""The rows of the table of layers: what each is, and what it shares with others of its kind."""

import math
from typing import Any

from renderer.film.false_color import (
    ANGLE,
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
)
from renderer.film.layer import Layer
from scene_description.labels import instance_labels, material_labels, occlusion_labels, part_labels, semantic_labels
from scene_description.light_labels import light_labels

_PHOTOGRAPH: dict[str, Any] = {"dtype": "uint8", "channels": 3, "picture": AS_IT_IS}
_DISTANCES: dict[str, Any] = {"dtype": "float32", "unit": "m", "frame": "row", "no_hit": math.inf, "picture": DISTANCE, "exr": "Z"}
_LIGHT: dict[str, Any] = {"dtype": "float32", "channels": 3, "unit": "cd/m2", "picture": EXPOSED, "exr": "RGB"}
_ALBEDO: dict[str, Any] = {"dtype": "float32", "channels": 3, "no_hit": 0.0, "picture": REFLECTANCE, "exr": "RGB"}
_DIRECTIONS: dict[str, Any] = {"dtype": "float32", "channels": 3, "frame": "row", "no_hit": 0.0, "picture": DIRECTION, "exr": "XYZ"}
_POINTS: dict[str, Any] = {"dtype": "float32", "channels": 3, "unit": "m", "no_hit": math.nan, "picture": METRES, "exr": "XYZ"}
_SHARES: dict[str, Any] = {"dtype": "float32", "no_hit": 0.0, "picture": SHARE, "exr": "Y"}
_MOTION: dict[str, Any] = {
    "dtype": "float32",
    "channels": 2,
    "unit": "px",
    "frame": "rows of both",
    "no_hit": math.nan,
    "picture": MOTION,
    "exr": "UV",
}
_MASK: dict[str, Any] = {"dtype": "uint8", "no_hit": 0.0, "picture": AS_IT_IS, "exr": "Y"}
_IDS: dict[str, Any] = {"dtype": "uint16", "no_hit": 0.0, "picture": OBJECTS, "exr": ("id",), "compression": "ids"}
_CLASSES: dict[str, Any] = {
    "dtype": "uint8",
    "no_hit": 0.0,
    "picture": CLASSES,
    "exr": ("id",),
    "compression": "ids",
    "labels": lambda _: semantic_labels(),
}
_STATES: dict[str, Any] = {
    "dtype": "uint8",
    "frame": "rows of both",
    "no_hit": 3.0,
    "picture": STATES,
    "exr": ("id",),
    "compression": "ids",
    "labels": lambda _: occlusion_labels(),
}


def _row(name: str, summary: str, meaning: str, kind: dict[str, Any], **own: Any) -> Layer:
    """Return a layer of a kind, with what it has of its own; ``exr``: channels, of which the layer of light alone is not called by name."""
    fields = {**kind, **own}
    prefix = "" if name == "radiance" else f"{name}."
    channels = tuple(prefix + channel for channel in fields.pop("exr", ()))
    return Layer(name=name, summary=summary, meaning=meaning, exr=channels, **fields)


def _hit(name: str, summary: str, meaning: str, kind: dict[str, Any], **own: Any) -> Layer:
    """Return a layer that follows from the hit record: ``renderer.ground_truth.hit_layers`` has its function."""
    return _row(name, summary, meaning, kind, group="hit", option="layers", **own)


BASIC_ROWS = (
    _row("color", "colour", "sRGB display colour", _PHOTOGRAPH, group="color", compression="color", published=True),
    _row(
        "depth",
        "depth along the optical axis; a panorama publishes range instead",
        "distance along the optical z axis",
        _DISTANCES,
        group="geometric",
        compression="depth",
        published=True,
    ),
    _row(
        "depth_sensed",
        "depth as the sensor of depth_sensor.model reads it",
        "distance along the optical z axis as the modelled sensor reads it; -inf too near, NaN invalid",
        _DISTANCES,
        frame="stamp",
        group="sensed",
        compression="depth",
        option="sensed",
    ),
    _row("range", "range, the distance along each ray", "distance along the ray", _DISTANCES, group="geometric"),
    _row("color_noisy", "colour before denoising", "sRGB display colour before denoising", _PHOTOGRAPH, group="color", option="noisy"),
    _row(
        "color_sensed",
        "what the modelled sensor reads of colour",
        "what lens, sensor and processing of `sensor.*` make of the light of `color`; the same bytes where they are ideal",
        _PHOTOGRAPH,
        group="color",
        compression="color",
        option="sensed",
    ),
    _row(
        "albedo",
        "the base colour of what is seen",
        "linear base colour of what is seen first, 1 for glass and lit lamps",
        _ALBEDO,
        group="sampled",
        option="albedo",
    ),
    _row(
        "radiance",
        "linear colour in cd/m2",
        "linear colour, RGB luminance, neither exposed nor balanced",
        _LIGHT,
        group="color",
        option="radiance",
    ),
    _row(
        "variance",
        "the variance of the colour before denoising",
        "variance of the linear colour before denoising; NaN after one sample",
        {},
        group="color",
        dtype="float32",
        channels=3,
        unit="(cd/m2)^2",
        picture=NOISE,
        exr="RGB",
        option="variance",
    ),
    _row(
        "samples",
        "how many samples colour is made of",
        "samples per pixel that colour is the mean of",
        {},
        group="color",
        dtype="uint16",
        picture=AS_IT_IS,
        exr=("count",),
        option="variance",
    ),
    _row(
        "direct",
        "the direct part of the light in cd/m2",
        "part of the linear colour before denoising that is scattered once at most: lights, and what they light",
        _LIGHT,
        group="color",
        option="light",
    ),
    _row(
        "indirect",
        "the indirect part of the light in cd/m2",
        "part of the linear colour before denoising that is scattered more often; direct and indirect are all light",
        _LIGHT,
        group="color",
        option="light",
    ),
    _row(
        "shadow",
        "shadow: the share of the direct light that something blocks",
        "share of the light from lamps and window panes that something blocks on its way to what is seen first"
        ": 0 fully lit, 1 in shadow; NaN: none would arrive anyway",
        _SHARES,
        group="sampled",
        no_hit=math.nan,
        exr=("share",),
        option="light",
    ),
    _row(
        "normals",
        "surface normals",
        "geometric unit normal, optical frame, towards the camera",
        _DIRECTIONS,
        group="geometric",
        published=True,
    ),
    _row("semantic", "NYU40 class ids", "NYU40 class id, 0 for void", _CLASSES, group="geometric", published=True),
    _row("instance", "object ids", "object id, 0 for the room's shell", _IDS, group="geometric", labels=instance_labels, published=True),
)
"""The layers of light and of samples, those that are traced whenever geometry is, and what modelled sensors read."""

HIT_ROWS = (
    _hit("position", "3D positions in the world", "point that is hit, world frame", _POINTS, frame="world"),
    _hit("position_camera", "3D positions before the camera", "point that is hit, optical frame of the stamp", _POINTS, frame="stamp"),
    _hit(
        "normals_world",
        "surface normals in the world",
        "geometric unit normal, world frame, towards the camera",
        _DIRECTIONS,
        frame="world",
    ),
    _hit(
        "shading_normals",
        "shading normals",
        "normal that light is scattered by, of smooth and textured surfaces, optical frame",
        _DIRECTIONS,
    ),
    _hit("shading_normals_world", "shading normals in the world", "the same, world frame", _DIRECTIONS, frame="world"),
    _hit(
        "incidence",
        "the angle at which surfaces are seen",
        "angle between the ray and the geometric normal, 0 where a surface is seen head-on",
        {},
        dtype="float32",
        unit="rad",
        frame="row",
        no_hit=math.nan,
        picture=ANGLE,
        exr="Y",
    ),
    _hit("part", "ids of the objects' parts", "part id, 0 for what belongs to no named part", _IDS, labels=part_labels),
    _hit("material", "ids of materials", "material id; its label tells name and BSDF values", _IDS, labels=material_labels),
    _hit("base_color", "the base colour at the hit", "linear base colour of the surface, texture included", _ALBEDO),
    _hit("roughness", "roughness", "perceptual roughness, texture included", _SHARES),
    _hit("metallic", "metalness", "metalness, texture included", _SHARES),
    _hit(
        "emission",
        "the light that surfaces emit",
        "luminance that the surface itself sends to the camera; of panes that of the sky behind, if nothing stands before it",
        _LIGHT,
        no_hit=0.0,
    ),
    _hit(
        "light_seen",
        "which light is seen",
        "id of the lamp, window pane or glowing part that is seen itself, 1 for the sky outside, 0 for what sends no light",
        _IDS,
        no_hit=1.0,
        labels=light_labels,
    ),
    _hit("uv", "texture coordinates", "texture coordinates along the surface", _POINTS, channels=2, exr="UV"),
    _hit(
        "object_coordinates",
        "normalised object coordinates",
        "place in the object's box: back to front, right to left, bottom to top, each 0 to 1; of the shell in the room's",
        {},
        dtype="float32",
        channels=3,
        frame="object",
        no_hit=math.nan,
        picture=UNIT_CUBE,
        exr="XYZ",
    ),
    _hit(
        "flow",
        "optical flow to the next frame",
        "motion of what is seen to the next frame, right and down; NaN at the path's end, of what comes to lie behind the camera",
        _MOTION,
    ),
    _hit("flow_backward", "optical flow to the frame before", "the same to the frame before; NaN at the path's beginning", _MOTION),
    _hit(
        "occlusion",
        "what is hidden in the next frame",
        "whether what is seen is seen in the next frame: 0 visible, 1 hidden, 2 outside the image, 3 unknown",
        _STATES,
    ),
    _hit("occlusion_backward", "what was hidden in the frame before", "the same of the frame before", _STATES),
    _hit("boundaries", "occlusion boundaries", "255 at the last pixel of a surface before one that it hides, else 0", _MASK),
    _hit(
        "coverage",
        "how much of each pixel its object covers",
        "share of 4 x 4 rays through the pixel that hit the object of its id; 1 where all neighbours have that id",
        _SHARES,
        no_hit=None,
    ),
    _hit("glass", "where glass is", "255 where what is hit lets most of the light through, else 0", _MASK),
    _hit("mirror", "where mirrors are", "255 where what is hit is smooth metal, else 0", _MASK),
    _hit(
        "depth_opaque",
        "depth behind glass",
        "depth of the first opaque surface on the straight line of sight",
        _DISTANCES,
        compression="depth",
    ),
    _hit("normals_opaque", "normals behind glass", "normal of the first opaque surface, as normals", _DIRECTIONS),
    _hit("semantic_opaque", "class ids behind glass", "class id of the first opaque surface", _CLASSES),
    _hit("instance_opaque", "object ids behind glass", "object id of the first opaque surface", _IDS, labels=instance_labels),
)
"""The layers that follow from the hit record."""
