"""A contact sheet shows the same room whether its images were kept raw or compressed."""

import json
from pathlib import Path

import numpy as np
import pytest
from PIL import Image as Picture
from rclpy.serialization import serialize_message
from std_msgs.msg import String

from renderer import LAYERS
from scene_synth_ros.bags.bag_writer import BagWriter
from scene_synth_ros.cli.pictures.contact_sheet import GAP, TILE_WIDTH, write_contact_sheet
from scene_synth_ros.messages.conversions import image_to_msg, layer_encoding
from scene_synth_ros.messages.image_codec import compress, compressed_topic
from scene_synth_ros.messages.image_reader import CodecError
from scene_synth_ros.messages.streams import COMPRESSED_TYPE, IMAGE_TYPE

STAMP_NS = 5
SCENE = {"index": 0, "category": "bedroom", "objects": [], "seed": 1, "camera_path": [{"stamp_ns": STAMP_NS}]}
RNG = np.random.default_rng(0)
IMAGES = {
    "color": ("rgb8", RNG.integers(0, 256, (96, 128, 3), np.uint8)),
    "depth": ("32FC1", RNG.uniform(0.5, 5.0, (96, 128)).astype(np.float32)),
    "semantic": ("mono8", RNG.integers(0, 40, (96, 128), np.uint8)),
    "instance": ("16UC1", RNG.integers(0, 300, (96, 128), np.uint16)),
}


def write_bag(folder: Path, form: str, images: dict[str, tuple[str, np.ndarray]] = IMAGES) -> Path:
    with BagWriter(folder) as writer:
        writer.add_topic("/s/scene", "std_msgs/msg/String")
        writer.write("/s/scene", bytes(serialize_message(String(data=json.dumps(SCENE)))), STAMP_NS, STAMP_NS)
        for layer, (encoding, pixels) in images.items():
            topic = f"/s/camera/{layer}/image_raw"
            data = bytes(serialize_message(image_to_msg(pixels, encoding, STAMP_NS, "eye")))
            if form != "none":
                topic, data = compressed_topic(topic), compress(data, topic, form, 90)
            writer.add_topic(topic, IMAGE_TYPE if form == "none" else COMPRESSED_TYPE)
            writer.write(topic, data, STAMP_NS, STAMP_NS)
    return folder


def test_compressed_layers_look_like_raw_ones(tmp_path: Path) -> None:
    sheets = []
    for form in ("none", "png"):
        assert write_contact_sheet(write_bag(tmp_path / form, form), tmp_path / f"{form}.png") == 1
        sheets.append(np.asarray(Picture.open(tmp_path / f"{form}.png")).astype(np.int64))
    assert sheets[0].shape == sheets[1].shape
    assert sheets[0].std() > 40, "the sheet shows the noise that the layers are made of"
    difference = np.abs(sheets[0] - sheets[1])
    assert difference.max() <= 2, "depth is kept with a step that colours hardly show; the others are kept whole"


def test_every_layer_of_the_table_has_a_column(tmp_path: Path) -> None:
    images = {name: (layer_encoding(row), np.ones(row.shape(96, 128), row.dtype)) for name, row in LAYERS.items()}
    write_contact_sheet(write_bag(tmp_path / "bag", "none", images), tmp_path / "sheet.png")
    assert Picture.open(tmp_path / "sheet.png").width == GAP + len(LAYERS) * (TILE_WIDTH + GAP)


def test_depth_in_millimetres_looks_like_depth_in_metres(tmp_path: Path) -> None:
    metres = np.linspace(0.5, 5.0, 96 * 128, dtype=np.float32).reshape(96, 128).round(3)
    sheets = []
    for encoding, pixels in (("32FC1", metres), ("16UC1", np.rint(metres * 1000.0).astype(np.uint16))):
        write_contact_sheet(write_bag(tmp_path / encoding, "none", {"depth": (encoding, pixels)}), tmp_path / "sheet.png")
        sheets.append(np.asarray(Picture.open(tmp_path / "sheet.png")).astype(np.int64))
    assert np.abs(sheets[0] - sheets[1]).max() <= 1 and sheets[0].std() > 40


def test_what_is_no_picture_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("scene_synth_ros.messages.image_codec.encode_image", lambda *_, **__: b"no picture at all")
    with pytest.raises(CodecError, match="expected PNG or JPEG"):
        write_contact_sheet(write_bag(tmp_path / "bag", "png"), tmp_path / "sheet.png")
    assert not (tmp_path / "sheet.png").exists()
