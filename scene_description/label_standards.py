"""Semantic classes of other standards, and which of them stands for each NYU40 class and for each category of objects.

``label_standards.csv`` lists the classes of every standard, ``nyu40_mapping.csv`` the class of each standard that stands for an NYU40
class, ``category_mapping.csv`` where a standard tells finer than NYU40: that row then decides.  ``void``, id 0, stands for what a standard
has no class for.  Sources: ``docs/labels.md``.
"""

import csv
from functools import cache
from importlib import resources
from typing import Literal, NamedTuple, get_args

import numpy as np
from numpy.typing import NDArray

from scene_description.labels import LABEL_ID, NYU40, Label, LabelTable, instance_labels, part_labels, semantic_labels
from scene_description.light_labels import light_labels
from scene_description.types import Opening, SceneDescription, SceneObject

StandardName = Literal["nyu40", "nyu13", "scannet20", "ade20k", "coco"]
STANDARDS: tuple[StandardName, ...] = get_args(StandardName)

_IDS = 256
"""Ids of every standard fit into eight bits."""


class LabelStandard(NamedTuple):
    """A list of semantic classes, and how ours map to it.

    classes: id -> class, id 0 first; of_label: NYU40 class -> id; of_category: category of objects -> id, before ``of_label``.
    """

    name: StandardName
    classes: dict[int, Label]
    of_label: tuple[int, ...]
    of_category: dict[str, int]

    def class_of(self, category: str, label: int) -> int:
        """Return the class id of an object of a category whose NYU40 class is ``label``."""
        return self.of_category.get(category, self.of_label[label])

    def palette(self) -> NDArray[np.uint8]:
        """Return the (256, 3) uint8 RGB colours of the ids, black where the standard has no class."""
        colors = np.zeros((_IDS, 3), np.uint8)
        for key, label in self.classes.items():
            colors[key] = label.color
        return colors

    def semantic_labels(self) -> LabelTable:
        """Return class id -> name, display colour, and what maps to it: NYU40 class ids and categories of objects; NYU40 without these."""
        if self.name == "nyu40":
            return semantic_labels()
        table: LabelTable = {}
        for key, label in self.classes.items():
            nyu40 = [i for i, mapped in enumerate(self.of_label) if mapped == key]
            categories = sorted(category for category, mapped in self.of_category.items() if mapped == key)
            table[key] = {"name": label.name, "class": key, "color": list(label.color), "nyu40": nyu40, "categories": categories}
        return table

    def instance_labels(self, scene: SceneDescription) -> LabelTable:
        """Return what :func:`scene_description.labels.instance_labels` does, with classes of this standard."""
        table = instance_labels(scene)
        if self.name != "nyu40":
            for owner, key in self._classes_of(scene).items():
                table[owner] |= {"class": key, "class_name": self.classes[key].name}
        return table

    def part_labels(self, scene: SceneDescription) -> LabelTable:
        """Return what :func:`scene_description.labels.part_labels` does, with classes of this standard."""
        table, classes = part_labels(scene), self._classes_of(scene)
        for row in table.values():
            row["class"] = classes.get(int(str(row["object"])), 0)
        return table

    def light_labels(self, scene: SceneDescription) -> LabelTable:
        """Return what :func:`scene_description.light_labels.light_labels` does, with classes of this standard."""
        table, classes = light_labels(scene), self._classes_of(scene)
        for row in table.values():
            if row.get("class_name"):
                key = classes.get(int(str(row["object"])), self.of_label[int(str(row["class"]))])
                row |= {"class": key, "class_name": self.classes[key].name}
        return table

    def _classes_of(self, scene: SceneDescription) -> dict[int, int]:
        """Return object id -> class id; the room's shell is no object."""
        things: list[Opening | SceneObject] = [*scene.room.openings, *scene.objects]
        return {thing.id: self.class_of(thing.category, thing.label) for thing in things}


@cache
def label_standard(name: StandardName) -> LabelStandard:
    """Return a standard by its name, a key of ``STANDARDS``."""
    if name == "nyu40":
        return LabelStandard(name, dict(enumerate(NYU40)), tuple(range(len(NYU40))), {})
    rows = [row for row in _read("label_standards.csv") if row["standard"] == name]
    classes = {int(row["id"]): Label(int(row["id"]), row["name"], (int(row["r"]), int(row["g"]), int(row["b"]))) for row in rows}
    ids = {label.name: key for key, label in classes.items()}
    of_label = {LABEL_ID[row["name"]]: ids[row[name]] for row in _read("nyu40_mapping.csv")}
    finer = {row["category"]: ids[row[name]] for row in _read("category_mapping.csv") if row.get(name)}
    return LabelStandard(name, classes, tuple(of_label[i] for i in range(len(NYU40))), finer)


def _read(name: str) -> list[dict[str, str]]:
    text = resources.files("scene_description").joinpath(name).read_text(encoding="utf-8")
    return list(csv.DictReader(text.splitlines()))
