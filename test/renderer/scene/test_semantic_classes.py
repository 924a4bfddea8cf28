"""Class ids of other standards in the part table, and in the images that come of it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from sample_scene import sample_scene

from renderer import CameraConfig, RenderConfig, Renderer
from renderer.film.layers import LAYERS, layers_in
from renderer.scene.flatten import flatten
from renderer.scene.semantic_classes import with_classes
from scene_description.label_standards import STANDARDS, label_standard


def test_parts_have_the_class_of_their_object_and_the_shell_that_of_its_surface() -> None:
    scene = sample_scene()
    flat = flatten(scene)
    coco = with_classes(flat, scene, "coco")
    ids = dict(zip(flat.part_names, coco.parts.label.tolist(), strict=True))
    assert [ids[name] for name in ("0/floor", "0/wall", "0/skirting", "0/ceiling")] == [190, 199, 199, 186]
    assert {ids[name] for name in ids if name.startswith("3/")} == {65}  # the bed
    assert {ids[name] for name in ids if name.startswith("1/")} == {112}  # the door
    assert with_classes(flat, scene, "nyu40") is flat


def test_a_category_decides_before_the_class() -> None:
    scene = sample_scene()
    things = tuple(replace(thing, category="microwave") if thing.id == 4 else thing for thing in scene.objects)
    scene = replace(scene, objects=things)
    flat = with_classes(flatten(scene), scene, "ade20k")
    assert set(flat.parts.label[flat.parts.object_id == 4].tolist()) == {125}


def test_images_are_those_of_nyu40_with_other_numbers() -> None:
    scene = sample_scene()
    flat, camera, config = flatten(scene), CameraConfig(width=96, height=72), RenderConfig(threads=1)
    images = {}
    for name in STANDARDS:
        with Renderer(with_classes(flat, scene, name), camera, config, 0) as renderer:
            images[name] = renderer.render(scene.camera_path[0], 0, ("semantic", "instance")).layers
    categories = {thing.id: thing.category for thing in (*scene.room.openings, *scene.objects)}
    nyu40, instance = images["nyu40"]["semantic"], images["nyu40"]["instance"]
    pairs = {(int(a), int(b)) for a, b in zip(nyu40.ravel(), instance.ravel(), strict=True)}
    assert len(pairs) > 4
    for name in STANDARDS:
        standard, mapped = label_standard(name), images[name]["semantic"]
        assert np.array_equal(images[name]["instance"], instance) and mapped.dtype == np.uint8
        for label, owner in pairs:
            there = (nyu40 == label) & (instance == owner)
            assert set(mapped[there].tolist()) == {standard.class_of(categories.get(owner, ""), label)}


def test_rows_of_a_standard_have_its_names_and_colours() -> None:
    assert layers_in("nyu40") is LAYERS
    rows = layers_in("coco")
    assert list(rows) == list(LAYERS) and rows["depth"] is LAYERS["depth"]
    assert rows["semantic"].picture.of(np.array([[199, 12]], np.uint8)).tolist() == [[[102, 102, 156], [0, 0, 0]]]
    assert rows["semantic"].labels is not None and rows["semantic"].labels(sample_scene())[65]["name"] == "bed"
    assert rows["instance"].labels is not None and rows["instance"].labels(sample_scene())[3]["class_name"] == "bed"
    scene = sample_scene()
    assert rows["part"].labels is not None
    parts = rows["part"].labels(scene)
    assert {row["class"] for row in parts.values() if row["object"] == 3} == {65}
    assert {row["class"] for row in parts.values() if row["object"] == 1} == {112} and parts[0]["class"] == 0
    assert rows["light_seen"].labels is not None
    lights = rows["light_seen"].labels(scene)
    assert {(row["class"], row["class_name"]) for row in lights.values() if row["kind"] == "window"} == {(181, "window-other")}
    assert lights[0]["class"] == 0
