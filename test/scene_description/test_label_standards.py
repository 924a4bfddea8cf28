"""Label standards: every NYU40 class and every category has a class of each standard, with the standard's own ids."""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np
import pytest
from sample_scene import sample_scene

from grammar.spec.categories import read_categories
from scene_description.label_standards import STANDARDS, StandardName, label_standard
from scene_description.labels import LABEL_ID, NYU40, instance_labels, semantic_labels
from scene_description.share import config_path

OTHERS = [name for name in STANDARDS if name != "nyu40"]
IDS = {
    "nyu13": set(range(14)),
    "scannet20": {0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 14, 16, 24, 28, 33, 34, 36, 39},
    "ade20k": set(range(151)),
    "coco": {0, *range(1, 201)} - {12, 26, 29, 30, 45, 66, 68, 69, 71, 83, 91},
}
"""Ids of the standards; those of COCO are 80 things and 53 kinds of stuff, with gaps."""
THINGS = 80


def test_nyu40_is_our_own_table() -> None:
    nyu40 = label_standard("nyu40")
    assert nyu40.semantic_labels() == semantic_labels() and nyu40.instance_labels(sample_scene()) == instance_labels(sample_scene())
    assert [nyu40.class_of("anything", label.id) for label in NYU40] == list(range(41))


@pytest.mark.parametrize("name", OTHERS)
def test_every_class_and_category_has_an_id_of_the_standard(name: StandardName) -> None:
    standard = label_standard(name)
    assert set(standard.classes) <= IDS[name] and len(standard.of_label) == 41 and standard.of_label[0] == 0
    assert {*standard.of_label, *standard.of_category.values()} <= set(standard.classes)
    assert [label.id for label in standard.classes.values()] == list(standard.classes)
    assert len({label.name for label in standard.classes.values()}) == len(standard.classes)
    assert set(standard.of_category) <= set(read_categories(config_path("categories.yaml")))


def test_the_standards_have_as_many_classes_as_they_are_known_for() -> None:
    assert [len(label_standard(name).classes) - 1 for name in OTHERS] == [13, 20, 150, 133]
    assert sum(0 < key <= 90 for key in label_standard("coco").classes) == THINGS
    assert set(label_standard("scannet20").classes) == IDS["scannet20"]


def test_known_classes_of_the_standards() -> None:
    known = {
        "nyu13": {"bed": 1, "chair": 4, "floor": 5, "sofa": 9, "table": 10, "tv": 11, "wall": 12, "window": 13},
        "scannet20": {"wall": 1, "floor": 2, "desk": 14, "toilet": 33, "otherfurniture": 39},
        "ade20k": {"wall": 1, "floor": 4, "ceiling": 6, "bed": 8, "chair": 20, "lamp": 37, "radiator": 147, "clock": 149, "flag": 150},
        "coco": {"person": 1, "chair": 62, "couch": 63, "bed": 65, "tv": 72, "toothbrush": 90, "wall-other-merged": 199},
    }
    for name in OTHERS:
        ids = {label.name: key for key, label in label_standard(name).classes.items()}
        assert {key: ids[key] for key in known[name]} == known[name]


def test_scannet20_keeps_the_ids_of_nyu40() -> None:
    standard = label_standard("scannet20")
    assert all(mapped in (0, label) for label, mapped in enumerate(standard.of_label))
    assert standard.classes[39].name == "otherfurniture" and standard.class_of("rug", LABEL_ID["floor mat"]) == 0


def test_a_category_tells_more_than_its_class() -> None:
    coco, ade20k = label_standard("coco"), label_standard("ade20k")
    prop, lamp = LABEL_ID["otherprop"], LABEL_ID["lamp"]
    assert coco.classes[coco.class_of("laptop", prop)].name == "laptop" and coco.class_of("knife_block", prop) == 0
    assert coco.class_of("dining_table", LABEL_ID["table"]) == 67 and coco.class_of("side_table", LABEL_ID["table"]) == 189
    assert [ade20k.class_of(name, lamp) for name in ("ceiling_lamp", "desk_lamp")] == [83, 37]


def test_labels_tell_what_maps_to_each_class() -> None:
    row = label_standard("coco").semantic_labels()[72]
    assert row == {"name": "tv", "class": 72, "color": [183, 130, 88], "nyu40": [25], "categories": ["monitor"]}
    table = label_standard("ade20k").instance_labels(sample_scene())
    assert (table[3]["class"], table[3]["class_name"]) == (8, "bed")
    assert table[3]["color"] == instance_labels(sample_scene())[3]["color"]


def test_palettes_have_a_colour_for_every_class_and_black_for_the_rest() -> None:
    for name in STANDARDS:
        standard = label_standard(name)
        palette = standard.palette()
        assert palette.shape == (256, 3) and palette.dtype == np.uint8
        assert all(tuple(palette[key]) == label.color for key, label in standard.classes.items())
        assert not palette[sorted(set(range(256)) - set(standard.classes))].any()


def test_the_rows_of_the_mappings_are_the_classes_of_nyu40_in_order() -> None:
    rows = list(csv.DictReader((Path(__file__).parents[2] / "scene_description/nyu40_mapping.csv").open()))
    assert [(int(row["nyu40"]), row["name"]) for row in rows] == [(label.id, label.name) for label in NYU40]
