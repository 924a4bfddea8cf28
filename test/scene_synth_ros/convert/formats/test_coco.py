"""COCO's files, read by pycocotools; panoptic images by their definition, id = R + 256 G + 65536 B."""

import contextlib
import json

import cv2
import numpy as np
import pytest
from convert_bag import convert_bag, export
from pycocotools.coco import COCO

from scene_description.labels import instance_labels
from scene_synth_ros.convert.writer import ConvertError


def test_masks_boxes_and_classes_are_those_of_the_pixels(tmp_path):
    bag = convert_bag()
    assert export(bag, "coco", tmp_path / "out") == ()
    with contextlib.redirect_stdout(None):
        coco = COCO(str(tmp_path / "out/annotations/instances.json"))
    truths = bag.frames["camera"]
    assert coco.getImgIds() == list(range(1, 7)) and coco.loadCats([4])[0]["name"] == "bed"
    for number, truth in enumerate(truths, 1):
        (image,) = coco.loadImgs([number])
        assert image["stamp_ns"] == truth.pose.stamp_ns and (image["width"], image["height"]) == (80, 60)
        np.testing.assert_array_equal(cv2.imread(str(tmp_path / "out/images" / image["file_name"]))[..., ::-1], truth.layers["color"])
        told, instance = coco.loadAnns(coco.getAnnIds(imgIds=[number])), truth.layers["instance"]
        assert [item["instance_id"] for item in told] == [key for key in np.unique(instance) if key]
        classes = {key: row["class"] for key, row in instance_labels(bag.scenes[0]).items()}
        for item in told:
            pixels = instance == item["instance_id"]
            np.testing.assert_array_equal(coco.annToMask(item), pixels)
            rows, columns = np.nonzero(pixels)
            assert item["bbox"] == [columns.min(), rows.min(), np.ptp(columns) + 1, np.ptp(rows) + 1]
            assert item["area"] == pixels.sum() and item["category_id"] == classes[item["instance_id"]]


def test_panoptic_segments_cover_every_pixel_with_a_class_once(tmp_path):
    bag = convert_bag()
    export(bag, "coco", tmp_path / "out")
    document = json.loads((tmp_path / "out/annotations/panoptic.json").read_text())
    things = {row["id"]: row["isthing"] for row in document["categories"]}
    names = {row["id"]: row["name"] for row in document["categories"]}
    assert [things[key] for key, name in names.items() if name in ("wall", "floor", "ceiling")] == [0, 0, 0] and things[4] == 1
    for truth, row in zip(bag.frames["camera"], document["annotations"], strict=True):
        colors = cv2.imread(str(tmp_path / "out/panoptic" / row["file_name"]))[..., ::-1].astype(np.int64)
        ids = colors @ (1, 256, 65536)
        instance, semantic = truth.layers["instance"], truth.layers["semantic"]
        assert {item["id"] for item in row["segments_info"]} == set(np.unique(ids)) - {0}
        for item in row["segments_info"]:
            pixels = ids == item["id"]
            assert item["area"] == pixels.sum() and set(np.unique(semantic[pixels])) == {item["category_id"]}
            assert (set(np.unique(instance[pixels])) == {item["id"]}) == bool(things[item["category_id"]])
        assert ((ids == 0) == ((instance == 0) & (semantic == 0))).all()


def test_without_classes_there_are_instances_alone(tmp_path):
    export(convert_bag(rooms=1, frames=1, layers=("instance",)), "coco", tmp_path / "out")
    assert {path.name for path in (tmp_path / "out").rglob("*.json")} == {"instances.json"}
    names = {row["id"]: row["name"] for row in json.loads((tmp_path / "out/annotations/instances.json").read_text())["categories"]}
    assert names[4] == "bed" and len(names) < 10


def test_a_layer_that_is_missing_is_told_with_its_parameter(tmp_path):
    with pytest.raises(
        ConvertError, match=r"bag: coco needs instance, which is not recorded; record it: -p renderer_node.streams.instance:=true$"
    ):
        export(convert_bag(rooms=1, frames=1, layers=("depth",)), "coco", tmp_path / "out")
