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
from room_bag import START_NS, write

from renderer import LAYERS, CameraConfig
from renderer.files.image_io import encode_image
from scene_description import CameraPose, scene_to_json
from scene_synth_ros.bags.bag_writer import BagWriter
from scene_synth_ros.convert.formats import FORMATS, writer_of
from scene_synth_ros.convert.formats import webdataset as written
from scene_synth_ros.convert.source import Choice, open_source
from scene_synth_ros.convert.writer import convert
from scene_synth_ros.messages.conversions import camera_info_to_msg, image_to_msg, layer_encoding, pose_to_msg
from scene_synth_ros.messages.image_codec import compress_image, compressed_topic


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


def test_recorded_files_are_copied_and_rooms_need_no_description(tmp_path):
    color = np.random.default_rng(1).integers(0, 256, (8, 12, 3), np.uint8)
    classes = np.full((8, 12), 4, np.uint8)
    config, camera = CameraConfig(width=12, height=8), "/synth/camera"
    with BagWriter(tmp_path / "bag") as writer:
        for layer, pixels, form in (("color", color, "jpeg"), ("semantic", classes, "png")):
            topic = compressed_topic(f"{camera}/{layer}/image_raw")
            raw = image_to_msg(pixels, layer_encoding(LAYERS[layer]), START_NS, "eye")
            write(writer, topic, compress_image(raw, pixels, topic, form, 90), START_NS)
        write(writer, f"{camera}/color/camera_info", camera_info_to_msg(config, START_NS, "eye"), START_NS)
        pose = CameraPose(stamp_ns=START_NS, position_m=(1.0, 2.0, 3.0), orientation=(0.0, 0.0, 0.0, 1.0))
        write(writer, f"{camera}/pose", pose_to_msg(pose, "map"), START_NS)
    (tmp_path / "out").mkdir()
    convert(tmp_path / "out", open_source(str(tmp_path / "bag"), "webdataset", FORMATS["webdataset"], Choice()), writer_of("webdataset"))
    (sample,) = webdataset.WebDataset(str(tmp_path / "out/shard-000000.tar"), shardshuffle=False)
    assert sample["color.jpg"] == encode_image(color, "jpeg", quality=90)
    assert sample["semantic.png"] == encode_image(classes, "png")
    assert json.loads(sample["frame.json"])["position_m"] == [1.0, 2.0, 3.0] and json.loads(sample["labels.json"]) == {}
    assert not list((tmp_path / "out/rooms").iterdir())
