"""The 40 semantic classes of NYU Depth v2 (Gupta et al., CVPR 2013) with names and display colours.

Class ids are stable across runs and versions: 0 is void, 1 to 40 are the standard's classes in its order.
"""

import csv
from collections.abc import Mapping
from importlib import resources
from typing import NamedTuple, TypedDict

import numpy as np
from numpy.typing import NDArray

from scene_description.types import Material, Opening, SceneDescription, SceneObject

LabelTable = dict[int, dict[str, object]]
"""Id -> its name, class, display colour: what ids of an image mean, for people and programs."""


class _NamedId(TypedDict):
    name: str
    color: list[int]


_Classed = TypedDict("_Classed", {"class": int}, total=False)


class LabelRow(_NamedId, _Classed, total=False):
    """What an id of an image means.

    ``color``: for people, 8-bit RGB.  ``class`` and ``class_name`` are of the standard.  Parts and lights tell their ``object`` (0: the
    room), lights their ``kind`` and ``part``, materials their ``family``, whether they are ``textured``, and the values of their BSDF.
    """

    object: int
    class_name: str
    kind: str
    part: str
    family: str
    textured: bool


class _Stamp(TypedDict):
    sec: int
    nanosec: int


class _StampedLabels(TypedDict):
    stamp: _Stamp
    labels: Mapping[str, LabelRow]


class LabelDocument(_StampedLabels, total=False):
    """The labels of a layer from ``stamp`` on: id in decimal -> what it means; ``standard``: of the classes, ``nyu40`` is not told."""

    standard: str


MATERIAL_VALUES = (
    "base_color",
    "roughness",
    "metallic",
    "transmission",
    "diffuse_transmission",
    "ior",
    "clearcoat",
    "clearcoat_roughness",
    "sheen",
    "glow_cd_m2",
    "wear",
)
"""Fields of a material that its label tells."""


class Label(NamedTuple):
    """One semantic class: id in 0..40, the standard's name, display colour (8 bit RGB)."""

    id: int
    name: str
    color: tuple[int, int, int]


def _read_table() -> tuple[Label, ...]:
    text = resources.files("scene_description").joinpath("nyu40.csv").read_text(encoding="utf-8")
    return tuple(
        Label(int(row["id"]), row["name"], (int(row["r"]), int(row["g"]), int(row["b"]))) for row in csv.DictReader(text.splitlines())
    )


NYU40: tuple[Label, ...] = _read_table()
"""Class id -> label; index and id agree."""

LABEL_ID: dict[str, int] = {label.name: label.id for label in NYU40}
"""Class name -> class id."""


def label_palette() -> NDArray[np.uint8]:
    """Return the (41, 3) uint8 RGB colours of the class ids, for people."""
    return np.array([label.color for label in NYU40], np.uint8)


def instance_palette(count: int) -> NDArray[np.uint8]:
    """Return (count, 3) uint8 RGB colours for instance ids; 0 is black, neighbouring ids differ strongly.

    Hues advance by the golden angle; saturation and value alternate, so that the colours of the first few hundred ids stay apart.
    """
    ids = np.arange(count)
    hue = (ids * 0.6180339887498949) % 1.0
    saturation = np.array([0.65, 0.9, 0.45])[ids % 3]
    value = np.array([0.95, 0.75])[(ids // 3) % 2]
    sector = hue[:, None] * 6.0 + np.array([5.0, 3.0, 1.0])
    k = sector % 6.0
    rgb = value[:, None] * (1.0 - saturation[:, None] * np.clip(np.minimum(k, 4.0 - k), 0.0, 1.0))
    colors: NDArray[np.uint8] = np.round(rgb * 255.0).astype(np.uint8)
    colors[:1] = 0
    return colors


def semantic_labels() -> LabelTable:
    """Return class id -> name and display colour of the NYU40 classes."""
    return {label.id: {"name": label.name, "class": label.id, "color": list(label.color)} for label in NYU40}


def instance_labels(scene: SceneDescription) -> LabelTable:
    """Return object id -> category, class and display colour of a scene; id 0 is the room's shell."""
    things: list[Opening | SceneObject] = [*scene.room.openings, *scene.objects]
    palette = instance_palette(max((thing.id for thing in things), default=0) + 1)
    table: LabelTable = {0: {"name": "room", "class": 0, "color": [0, 0, 0]}}
    for thing in things:
        color = [int(value) for value in palette[thing.id]]
        table[thing.id] = {"name": thing.category, "class": thing.label, "class_name": NYU40[thing.label].name, "color": color}
    return table


def occlusion_labels() -> LabelTable:
    """Return what the values of occlusion layers mean, with display colours."""
    states = (("visible", (255, 255, 255)), ("hidden", (200, 40, 40)), ("outside", (60, 90, 200)), ("unknown", (0, 0, 0)))
    return {number: {"name": name, "class": number, "color": list(color)} for number, (name, color) in enumerate(states)}


def part_ids(scene: SceneDescription) -> dict[str, int]:
    """Return the id, from 1 on, of each part by ``<object id>/<part name>``; the room's surfaces come first, as object 0.

    Ids follow the order of the description and need 16 bits: parts beyond the 65,535th have none.
    """
    things: list[Opening | SceneObject] = [*scene.room.openings, *scene.objects]
    owners = [(0, scene.room.surfaces), *((thing.id, thing.parts) for thing in things)]
    names = (f"{owner}/{part.name}" for owner, parts in owners for part in parts)
    return {name: number for number, name in zip(range(1, 1 << 16), names, strict=False)}


def part_labels(scene: SceneDescription) -> LabelTable:
    """Return part id -> name, object, class and display colour; id 0 is what belongs to no named part."""
    ids, objects = part_ids(scene), instance_labels(scene)
    palette = instance_palette(len(ids) + 1)
    table: LabelTable = {0: {"name": "none", "object": 0, "class": 0, "color": [0, 0, 0]}}
    for key, number in ids.items():
        owner = int(key.partition("/")[0])
        color = [int(value) for value in palette[number]]
        table[number] = {"name": f"{objects[owner]['name']}/{key.partition('/')[2]}", "object": owner, "color": color}
        table[number]["class"] = objects[owner]["class"]
    return table


def material_labels(scene: SceneDescription) -> LabelTable:
    """Return material id, from 1 on in the description's order, -> name, family, BSDF values and display colour; 0 is none.

    Values are those of the material itself: a texture changes colour, roughness and metalness from point to point.
    """
    palette = instance_palette(len(scene.materials) + 1)
    table: LabelTable = {0: {"name": "none", "color": [0, 0, 0]}}
    for number, material in enumerate(scene.materials, 1):
        values = {name: getattr(material, name) for name in MATERIAL_VALUES}
        color = [int(value) for value in palette[number]]
        table[number] = {"name": material.id, "family": material.family, "color": color, "textured": _is_textured(material), **values}
    return table


def _is_textured(material: Material) -> bool:
    return material.texture is not None or material.images is not None
