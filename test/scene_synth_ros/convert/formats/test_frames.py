"""Plain folders are read by OpenCV, numpy, OpenEXR and json."""

import json

import cv2
import numpy as np
import OpenEXR
from convert_bag import BROWN, convert_bag, export
from exported_camera import pixel_error
from room_bag import write_room_bag

from scene_description import scene_from_json


def test_every_layer_is_exact_and_points_fall_on_their_pixels(tmp_path):
    bag = convert_bag(camera=BROWN)
    assert export(bag, "frames", tmp_path / "out") == ()
    assert sorted(path.name for path in (tmp_path / "out").iterdir()) == ["room_0000", "room_0001"]
    for room in (0, 1):
        folder = tmp_path / f"out/room_{room:04d}"
        document = json.loads((folder / "frames.json").read_text())
        assert document["schema"] == "scene_synth_frames/1"
        assert scene_from_json((folder / "scene.json").read_text()) == bag.scenes[room]
        assert json.loads((folder / "labels.json").read_text())["semantic"]["4"]["name"] == "bed"
        truths = [truth for truth in bag.frames["camera"] if truth.room == room]
        for record, truth in zip(document["frames"], truths, strict=True):
            files = {layer: folder / name for layer, name in record["files"].items()}
            np.testing.assert_array_equal(cv2.imread(str(files["color"]))[..., ::-1], truth.layers["color"])
            np.testing.assert_array_equal(np.load(files["depth"])["depth"], truth.layers["depth"])
            for layer in ("semantic", "instance"):
                pixels = cv2.imread(str(files[layer]), cv2.IMREAD_UNCHANGED)
                np.testing.assert_array_equal(pixels, truth.layers[layer])
                assert pixels.dtype == truth.layers[layer].dtype
            assert pixel_error(truth, record["K"], record["distortion_model"], record["D"], record["world_from_optical"]) < 0.01


def test_openexr_has_the_numbers_too(tmp_path):
    bag = write_room_bag(tmp_path / "bag", rooms=1, frames=1, size=(12, 16), layers=("depth", "normals"))
    export(bag, "frames_exr", tmp_path / "out")
    (pixels,) = bag.images.values()
    depth = OpenEXR.File(str(tmp_path / "out/room_0000/depth/000000.exr"), separate_channels=True).channels()
    np.testing.assert_array_equal(depth["depth.Z"].pixels, pixels["depth"])
    normals = OpenEXR.File(str(tmp_path / "out/room_0000/normals/000000.exr"), separate_channels=True).channels()
    for place, axis in enumerate("XYZ"):
        np.testing.assert_array_equal(normals[f"normals.{axis}"].pixels, pixels["normals"][..., place])
