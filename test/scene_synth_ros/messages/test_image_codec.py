"""Compressed images hold the pixels that they should, in the form that image_transport reads."""

import io
import struct

import numpy as np
import pytest
from PIL import Image as Picture
from rclpy.serialization import deserialize_message, serialize_message
from sensor_msgs.msg import CompressedImage

from scene_synth_ros.messages.conversions import image_to_msg
from scene_synth_ros.messages.image_codec import ImageCompression, compress, compressed_topic, image_form
from scene_synth_ros.messages.image_reader import CodecError, depth_from_codes, split_depth

SETTINGS = ImageCompression(color="jpeg", ids="png", depth="png")


def packed(pixels: np.ndarray, encoding: str, topic: str, form: str = "png") -> CompressedImage:
    message = image_to_msg(pixels, encoding, 7 * 10**9 + 3, "eye")
    return deserialize_message(compress(bytes(serialize_message(message)), topic, form, 90), CompressedImage)


@pytest.mark.parametrize(
    ("topic", "form"),
    [
        ("/s/camera/color/image_raw", "jpeg"),
        ("/s/camera/normals/image_color", "jpeg"),
        ("/s/camera/semantic/image_raw", "png"),
        ("/s/camera/depth/image_raw", "png"),
        ("/s/camera/normals/image_raw", "none"),
        ("/s/camera/color/camera_info", "none"),
    ],
)
def test_each_layer_has_its_form(topic: str, form: str) -> None:
    kind = "sensor_msgs/msg/CameraInfo" if topic.endswith("info") else "sensor_msgs/msg/Image"
    assert image_form(topic, kind, SETTINGS) == form
    assert image_form(topic, kind, ImageCompression()) == "none"


def test_png_is_lossless_and_keeps_the_header() -> None:
    ids = np.random.default_rng(1).integers(0, 65536, (12, 20)).astype(np.uint16)
    message = packed(ids, "16UC1", "/s/camera/instance/image_raw")
    assert message.format == "16UC1; png compressed 16UC1"
    assert (message.header.stamp.sec, message.header.stamp.nanosec, message.header.frame_id) == (7, 3, "eye")
    np.testing.assert_array_equal(np.asarray(Picture.open(io.BytesIO(message.data))), ids)


def test_depth_in_metres_comes_back_within_its_step() -> None:
    depth = np.array([[0.3, 1.0, 3.2, 9.9], [np.inf, np.nan, 0.0, 59.0]], np.float32)
    message = packed(depth, "32FC1", "/s/camera/depth/image_raw")
    assert compressed_topic("/s/camera/depth/image_raw") == "/s/camera/depth/image_raw/compressedDepth"
    assert message.format == "32FC1; compressedDepth png"
    form, a, b = struct.unpack_from("<iff", bytes(message.data))
    stored = np.asarray(Picture.open(io.BytesIO(bytes(message.data)[12:]))).astype(np.float64)
    again = np.where(stored > 0, a / (stored - b), np.nan)
    assert form == 0
    known = np.isfinite(depth) & (depth > 0)
    assert (np.abs(again - depth)[known] <= 0.51 * depth[known] ** 2 / a + 1e-6).all()
    assert np.isnan(again[~known]).all()


def test_depth_in_millimetres_is_lossless() -> None:
    depth = np.array([[0, 1, 65535]], np.uint16)
    message = packed(depth, "16UC1", "/s/camera/depth/image_raw")
    np.testing.assert_array_equal(np.asarray(Picture.open(io.BytesIO(bytes(message.data)[12:]))), depth)


def test_what_has_no_such_form_is_refused() -> None:
    with pytest.raises(CodecError, match="expected one of rgb8, mono8, 16UC1 for png, got '32FC3'"):
        packed(np.zeros((2, 2, 3), np.float32), "32FC3", "/s/camera/color/image_raw")


def test_depth_comes_back_within_its_step() -> None:
    depth = np.array([[0.5, 3.2, 10.0, 59.0], [np.inf, np.nan, 0.0, 1.0]], np.float32)
    a, b, png = split_depth(bytes(packed(depth, "32FC1", "/s/camera/depth/image_raw").data))
    back = depth_from_codes(np.asarray(Picture.open(io.BytesIO(png))), a, b)
    known = np.isfinite(depth) & (depth > 0.0)
    assert (np.abs(back[known] - depth[known]) <= depth[known] ** 2 / a).all()
    assert np.isposinf(back[~known]).all()


def test_a_compressed_depth_that_is_cut_off_is_refused() -> None:
    with pytest.raises(CodecError, match="expected more than 12 bytes, got 5"):
        split_depth(b"short")
