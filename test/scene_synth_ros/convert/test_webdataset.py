"""The tar files are read by webdataset itself."""

import hashlib
import io
import json

import numpy as np
import pytest
import webdataset
from convert_bag import BROWN, FISHEYE, PINHOLE, RATIONAL, convert_bag, export
from exported_camera import pixel_error
from PIL import Image

from scene_description import scene_to_json
from scene_synth_ros.convert import webdataset as written


def samples(folder):
    """Return the samples, decoded as docs/convert.md says."""
    urls = [str(path) for path in sorted(folder.glob("shard-*.tar"))]
    picture = webdataset.handle_extension("png", lambda data: np.asarray(Image.open(io.BytesIO(data))))
    return list(webdataset.WebDataset(urls, shardshuffle=False).decode(picture))


@pytest.mark.parametrize("camera", [PINHOLE, BROWN, RATIONAL, FISHEYE])
def test_every_layer_is_exact_and_points_fall_on_their_pixels(tmp_path, camera):
    bag = convert_bag(rooms=1, camera=camera)
    assert export(bag, "webdataset", tmp_path / "out") == ()
    found = samples(tmp_path / "out")
    assert [sample["__key__"] for sample in found] == [f"room_0000_{number:06d}" for number in range(3)]
    for sample, truth in zip(found, bag.frames["camera"], strict=True):
        for layer, name in (("color", "color.png"), ("depth", "depth.npy"), ("semantic", "semantic.png"), ("instance", "instance.png")):
            np.testing.assert_array_equal(sample[name], truth.layers[layer])
            assert sample[name].dtype == truth.layers[layer].dtype
        record = sample["frame.json"]
        assert (record["stamp_ns"], record["room_type"]) == (truth.pose.stamp_ns, "bedroom")
        assert pixel_error(truth, record["K"], record["distortion_model"], record["D"], record["world_from_optical"]) < 0.01
        assert sample["labels.json"]["semantic"]["4"]["name"] == "bed"
    assert (tmp_path / "out/rooms/room_0000.json").read_text() == scene_to_json(bag.scenes[0])


def test_shards_are_of_a_size_whole_and_the_same_again(tmp_path, monkeypatch):
    bag = convert_bag()
    size = 3 * 80 * 60 * 8
    monkeypatch.setattr(written, "SHARD_BYTES", size)
    for name in ("one", "again"):
        export(bag, "webdataset", tmp_path / name)
    files = sorted(path.relative_to(tmp_path / "one") for path in (tmp_path / "one").rglob("*.*"))
    assert all((tmp_path / "one" / file).read_bytes() == (tmp_path / "again" / file).read_bytes() for file in files)
    index = json.loads((tmp_path / "one/shards.json").read_text())
    assert len(index["shards"]) > 1 and sum(shard["samples"] for shard in index["shards"]) == index["samples"] == 6
    for shard in index["shards"]:
        data = (tmp_path / "one" / shard["name"]).read_bytes()
        assert (len(data), hashlib.sha256(data).hexdigest()) == (shard["bytes"], shard["sha256"])
        assert len(data) <= size + 10240
    assert len(samples(tmp_path / "one")) == 6


def test_frames_of_several_cameras_have_keys_of_their_own(tmp_path):
    export(convert_bag(left=PINHOLE, right=BROWN), "webdataset", tmp_path / "out", rooms=(1, 2), layers=("color",))
    found = samples(tmp_path / "out")
    assert [sample["__key__"] for sample in found] == [f"room_0001_{side}_{n:06d}" for side in ("left", "right") for n in range(3)]
    assert {key for key in found[0] if not key.startswith("_")} == {"color.png", "frame.json"}
