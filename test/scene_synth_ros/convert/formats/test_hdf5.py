"""The file is read by h5py."""

import json

import h5py
import numpy as np
from convert_bag import BROWN, PINHOLE, convert_bag, export
from exported_camera import pixel_error

from scene_description import scene_from_json


def test_every_layer_is_exact_and_points_fall_on_their_pixels(tmp_path):
    bag = convert_bag(camera=BROWN)
    assert export(bag, "hdf5", tmp_path / "out") == ()
    with h5py.File(tmp_path / "out/rooms.h5") as file:
        assert (file.attrs["schema"], sorted(file)) == ("scene_synth_hdf5/1", ["room_0000", "room_0001"])
        for room, group in enumerate(file.values()):
            truths = [truth for truth in bag.frames["camera"] if truth.room == room]
            assert (group.attrs["room"], group.attrs["room_type"], group.attrs["camera"]) == (room, "bedroom", "/synth/camera")
            assert scene_from_json(group["scene"].asstr()[()]) == bag.scenes[room]
            assert json.loads(group["labels"].asstr()[()])["semantic"]["4"]["name"] == "bed"
            for layer in ("color", "depth", "semantic", "instance"):
                pixels = np.stack([truth.layers[layer] for truth in truths])
                np.testing.assert_array_equal(group[layer][()], pixels)
                assert (group[layer].dtype, group[layer].chunks) == (pixels.dtype, (1, *pixels.shape[1:]))
            assert group["stamp_ns"][()].tolist() == [truth.pose.stamp_ns for truth in truths]
            for number, truth in enumerate(truths):
                told = (group["K"][number], group.attrs["distortion_model"], group["D"][number], group["world_from_optical"][number])
                assert pixel_error(truth, *told) < 0.01


def test_equal_frames_make_equal_bytes(tmp_path):
    for name in ("one", "again"):
        export(convert_bag(left=PINHOLE, right=BROWN), "hdf5", tmp_path / name, every=2)
    assert (tmp_path / "one/rooms.h5").read_bytes() == (tmp_path / "again/rooms.h5").read_bytes()
    with h5py.File(tmp_path / "one/rooms.h5") as file:
        assert sorted(file) == ["room_0000_left", "room_0000_right", "room_0001_left", "room_0001_right"]
        assert file["room_0000_left/frame"][()].tolist() == [0, 2]
