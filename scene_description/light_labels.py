"""Ids of the lights of a scene, and what they are: what shines in its pictures."""

from collections.abc import Iterator
from typing import NamedTuple

from scene_description.labels import LABEL_ID, NYU40, LabelTable, instance_labels, instance_palette
from scene_description.types import SceneDescription

SKY_ID = 1
"""Of what a ray sees that leaves the scene."""


class SceneLight(NamedTuple):
    """Something that shines: its kind (``window``, ``lamp``, ``luminaire`` or ``glow``), and whose part it is."""

    kind: str
    object: int
    part: str


def scene_lights(scene: SceneDescription) -> Iterator[SceneLight]:
    """Yield window panes, lamps that are on, luminaires that are on and parts of a material that glows, in the description's order."""
    lamps = {(light.object, light.part) for light in scene.lights if light.on and light.flux_lm > 0.0}
    glowing = {material.id for material in scene.materials if material.glow_cd_m2 > 0.0}
    for opening in scene.room.openings:
        if opening.category == "window":
            yield SceneLight("window", opening.id, "pane")
    for thing in scene.objects:
        for part in thing.parts:
            if (thing.id, part.name) in lamps:
                yield SceneLight("lamp", thing.id, part.name)
            elif part.material in glowing:
                yield SceneLight("glow", thing.id, part.name)
    for index, luminaire in enumerate(scene.luminaires):
        if luminaire.on and luminaire.flux_lm > 0.0:
            yield SceneLight("luminaire", 0, f"luminaire_{index}")


def light_ids(scene: SceneDescription) -> dict[str, int]:
    """Return the id of each light by ``<object id>/<part name>``, after that of the sky; lights beyond the 65,534th have none."""
    return {f"{light.object}/{light.part}": number for number, light in zip(range(SKY_ID + 1, 1 << 16), scene_lights(scene), strict=False)}


def light_labels(scene: SceneDescription) -> LabelTable:
    """Return light id -> name, kind, object, part, class and display colour; 0 is no light, ``SKY_ID`` the sky outside the scene."""
    objects, lights = instance_labels(scene), list(scene_lights(scene))
    palette = instance_palette(SKY_ID + 1 + len(lights))
    table: LabelTable = {
        0: {"name": "none", "kind": "none", "object": 0, "part": "", "class": 0, "color": [0, 0, 0]},
        SKY_ID: {"name": "sky", "kind": "sky", "object": 0, "part": "", "class": 0, "color": [int(value) for value in palette[SKY_ID]]},
    }
    for number, light in zip(range(SKY_ID + 1, 1 << 16), lights, strict=False):
        owner = objects[light.object] if light.object else {"name": "room", "class": LABEL_ID["lamp"]}
        name, color = f"{owner['name']}/{light.part}", [int(value) for value in palette[number]]
        table[number] = {
            "name": name,
            "kind": light.kind,
            "object": light.object,
            "part": light.part,
            "class": owner["class"],
            "color": color,
        }
        table[number]["class_name"] = NYU40[int(str(owner["class"]))].name
    return table
