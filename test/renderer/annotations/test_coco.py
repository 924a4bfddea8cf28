"""Masks and COCO's file, read by pycocotools."""

import contextlib
import json

import numpy as np
import pytest
from box_room import pose
from box_scene import annotated, crate
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from pycocotools import mask as reference
from pycocotools.coco import COCO

from renderer import RenderError
from renderer.annotations.coco import CocoImage, coco_instances
from renderer.annotations.run_lengths import mask_of

VIEWS = [pose((-3.0, 0.0, 1.0), (0.0, 0.0, 1.0)), pose((-3.0, 1.0, 2.0), (0.0, 0.0, 0.5))]
CRATES = [crate(2, (0.0, 0.5, 0.0), (0.5, 0.5, 1.5), 0.3, label=4), crate(7, (1.5, 0.0, 0.0), (1.0, 2.0, 1.0), label=29)]


@settings(max_examples=150, deadline=None)
@given(arrays(np.uint16, st.tuples(st.integers(1, 40), st.integers(1, 12)), elements=st.integers(0, 2)), st.booleans())
def test_masks_are_those_of_pycocotools(instance, stretched):
    instance = np.repeat(np.repeat(instance, 70, axis=0), 5, axis=1) if stretched else instance
    columns = np.ascontiguousarray(instance.T)
    for key in set(np.unique(instance)) - {0}:
        there = np.flatnonzero((instance == key).any(axis=0))
        mask = mask_of(columns, int(key), int(there[0]), int(there[-1]))
        expected = reference.encode(np.asfortranarray(instance == key, np.uint8))
        assert {"size": list(mask.size), "counts": mask.counts.encode()} == expected


def test_the_file_loads_in_pycocotools_and_its_masks_are_the_pixels(tmp_path):
    frames = [annotated(CRATES, view, masks=True) for view in VIEWS]
    data = coco_instances([CocoImage(f"frame_{i}.png", frame.annotations) for i, frame in enumerate(frames)])
    path = tmp_path / "coco.json"
    path.write_text(json.dumps(data))
    with contextlib.redirect_stdout(None):
        coco = COCO(str(path))
    assert coco.getImgIds() == [1, 2] and [image["file_name"] for image in coco.loadImgs([1, 2])] == ["frame_0.png", "frame_1.png"]
    assert coco.loadCats([4])[0]["name"] == "bed" and len(coco.getCatIds()) == 41
    for number, frame in enumerate(frames, start=1):
        told = coco.loadAnns(coco.getAnnIds(imgIds=[number]))
        assert [item["instance_id"] for item in told] == [2, 7] and [item["category_id"] for item in told] == [4, 29]
        for item in told:
            pixels = frame.layers["instance"] == item["instance_id"]
            np.testing.assert_array_equal(coco.annToMask(item), pixels)
            assert item["area"] == pixels.sum() == reference.area(item["segmentation"]) and item["iscrowd"] == 0
            assert item["bbox"] == list(reference.toBbox(item["segmentation"]))


def test_a_file_needs_masks():
    with pytest.raises(RenderError, match=r"^COCO: expected masks, got none of object 2"):
        coco_instances([CocoImage("frame.png", annotated(CRATES, VIEWS[0]).annotations)])


def test_classes_are_those_of_the_standard_that_is_asked_for():
    frame = annotated(CRATES, VIEWS[0], masks=True, classes="coco")
    told = {item.id: (item.label, item.label_name) for item in frame.annotations.objects}
    assert told == {2: (65, "bed"), 7: (0, "void")}
    data = coco_instances([CocoImage("frame.png", frame.annotations)], "coco")
    names = {row["id"]: row["name"] for row in data["categories"]}
    assert [names[row["category_id"]] for row in data["annotations"]] == ["bed", "void"] and names[1] == "person"
