"""Equal messages are equal bytes, whatever the serialiser leaves between their fields."""

import numpy as np
import pytest
from rclpy.serialization import deserialize_message, serialize_message
from sample_scene import sample_scene
from sensor_msgs.msg import Image, PointCloud2
from std_msgs.msg import String
from visualization_msgs.msg import MarkerArray

from renderer import CameraConfig
from scene_synth_ros.messages import canonical_cdr as module
from scene_synth_ros.messages.canonical_cdr import camera_info_cdr, canonical_cdr, image_cdr
from scene_synth_ros.messages.conversions import camera_info_to_msg, image_to_msg, scene_to_markers

STAMP_NS = 7_000_000_003


def test_gaps_are_zero_and_fields_stay(monkeypatch: pytest.MonkeyPatch) -> None:
    """``frame_id`` "ab" ends at byte 15 of the payload, so one is skipped before ``height``; ``is_bigendian`` is at 28, its step at 32."""
    message = PointCloud2(height=7, width=9, point_step=3)
    message.header.frame_id = "ab"
    message.data.frombytes(bytes(range(1, 8)))
    dirty = bytearray(serialize_message(message))
    for place in (4 + 15, 4 + 29, 4 + 31):
        dirty[place] = 0xEE
    monkeypatch.setattr(module, "serialize_message", lambda _: bytes(dirty))
    clean = canonical_cdr(message)
    assert 0xEE not in clean and len(clean) == len(dirty)
    assert deserialize_message(clean, PointCloud2) == message


@pytest.mark.parametrize("length", [0, 7])
def test_an_image_is_what_the_serialiser_makes_of_it_with_zero_gaps(length: int) -> None:
    """The same gaps as above; "rgb8" ends at byte 33 of the payload, ``is_bigendian`` at 34, ``step`` is at 36."""
    message = Image(height=7, width=9, encoding="rgb8", is_bigendian=1, step=27)
    message.header.frame_id, message.header.stamp.sec, message.header.stamp.nanosec = "ab", -3, 999_999_999
    message.data.frombytes(bytes(range(1, 1 + length)))
    expected = bytearray(serialize_message(message))
    for place in (4 + 15, 4 + 34, 4 + 35):
        expected[place] = 0
    assert canonical_cdr(message) == expected[: 4 + 44 + length]


def test_images_and_camera_infos_are_serialised_as_their_messages() -> None:
    """Twice for the camera info, of which only the stamp may differ."""
    normals = np.arange(18, dtype=np.float32).reshape(2, 3, 3)
    assert image_cdr(normals, "32FC3", STAMP_NS, "eye") == canonical_cdr(image_to_msg(normals, "32FC3", STAMP_NS, "eye"))
    camera = CameraConfig(width=64, model="brown_conrady", distortion=(0.1, -0.02))
    for stamp_ns in (STAMP_NS, 5):
        assert camera_info_cdr(camera, stamp_ns, "eye") == canonical_cdr(camera_info_to_msg(camera, stamp_ns, "eye"))
    with pytest.raises(ValueError, match="expected contiguous float32 x 1, got float32 x 3"):
        image_cdr(normals, "32FC1", STAMP_NS, "eye")


@pytest.mark.parametrize(
    "message",
    [
        String(data="é"),
        PointCloud2(),
        MarkerArray(),
        scene_to_markers(sample_scene(), 5, "map"),
        camera_info_to_msg(CameraConfig(), 5, "a"),
    ],
    ids=lambda message: type(message).__name__,
)
def test_every_kind_of_field_is_passed(message: object) -> None:
    """Empty lists of doubles are not aligned; lists of messages, of strings in them, and fixed arrays are gone through."""
    clean = canonical_cdr(message)
    dirty = bytes(serialize_message(message))
    assert len(clean) == len(dirty) and deserialize_message(clean, type(message)) == deserialize_message(dirty, type(message))
