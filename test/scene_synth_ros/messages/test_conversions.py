"""Core values to messages: bytes, encodings, conventions."""

import json
import math

import numpy as np
import pytest
from rclpy.serialization import deserialize_message, serialize_message
from sensor_msgs.msg import Image

from renderer.camera.config import CameraConfig
from scene_description import CameraPose
from scene_description.labels import semantic_labels
from scene_description.poses import look_at, rotation_from_quaternion
from scene_synth_ros.messages import conversions as c

STAMP_NS = 12_300_000_456
IMAGES = {
    "rgb8": np.arange(5 * 7 * 3, dtype=np.uint8).reshape(5, 7, 3),
    "mono8": np.arange(35, dtype=np.uint8).reshape(5, 7),
    "16UC1": np.arange(35, dtype=np.uint16).reshape(5, 7) * 1000,
    "32FC1": np.linspace(0.0, 9.0, 35, dtype=np.float32).reshape(5, 7),
    "32FC2": np.linspace(-1.0, 1.0, 70, dtype=np.float32).reshape(5, 7, 2),
    "32FC3": np.linspace(-1.0, 1.0, 105, dtype=np.float32).reshape(5, 7, 3),
}


@pytest.mark.parametrize("encoding", IMAGES)
def test_images_survive_the_wire(encoding: str) -> None:
    image = IMAGES[encoding]
    message = deserialize_message(serialize_message(c.image_to_msg(image, encoding, STAMP_NS, "eye")), Image)
    assert (message.width, message.height, message.encoding, message.step) == (7, 5, encoding, image.strides[0])
    assert (message.header.stamp.sec, message.header.stamp.nanosec, message.header.frame_id) == (12, 300_000_456, "eye")
    np.testing.assert_array_equal(c.msg_to_image(message), image)


@pytest.mark.parametrize("image", [np.zeros((5, 7), np.float64), np.zeros((5, 7, 3), np.float32), np.zeros((7, 5), np.float32).T])
def test_images_that_do_not_fit_their_encoding_are_refused(image: np.ndarray) -> None:
    with pytest.raises(ValueError, match="image for 32FC1: expected contiguous float32 x 1"):
        c.image_to_msg(image, "32FC1", STAMP_NS, "eye")


def test_depth_in_millimetres_marks_what_is_invalid_with_zero() -> None:
    depth = np.array([[1.2345, 0.0004, 65.535, 70.0, np.inf, np.nan]], np.float32)
    assert c.depth_to_millimetres(depth).tolist() == [[1234, 0, 65535, 0, 0, 0]]


def test_camera_info_of_an_ideal_pinhole() -> None:
    info = c.camera_info_to_msg(CameraConfig(focal_x_px=500.0, focal_y_px=501.0), STAMP_NS, "eye")
    assert (info.width, info.height) == (640, 480)
    assert info.k.tolist() == [500.0, 0.0, 319.5, 0.0, 501.0, 239.5, 0.0, 0.0, 1.0]
    assert info.p.tolist() == [500.0, 0.0, 319.5, 0.0, 0.0, 501.0, 239.5, 0.0, 0.0, 0.0, 1.0, 0.0]
    assert (info.distortion_model, list(info.d), info.r.tolist()) == ("plumb_bob", [0.0] * 5, [1, 0, 0, 0, 1, 0, 0, 0, 1])


@pytest.mark.parametrize(
    ("model", "name", "length"),
    [("brown_conrady", "plumb_bob", 5), ("rational", "rational_polynomial", 8), ("kannala_brandt", "equidistant", 4)],
)
def test_camera_info_of_lenses_holds_their_coefficients(model: str, name: str, length: int) -> None:
    info = c.camera_info_to_msg(CameraConfig(model=model, distortion=(0.1, -0.02), principal_x_px=310.25), STAMP_NS, "eye")
    assert (info.distortion_model, list(info.d)) == (name, [0.1, -0.02] + [0.0] * (length - 2))
    assert (info.k[2], info.p[2]) == (310.25, 310.25)


def test_camera_info_of_a_panorama_claims_no_matrix() -> None:
    info = c.camera_info_to_msg(CameraConfig(model="equirectangular", width=512, height=256), STAMP_NS, "eye")
    assert (info.distortion_model, not any(info.k), not any(info.p), len(info.d)) == ("equirectangular", True, True, 0)


def test_link_looks_along_its_x_axis_where_the_optical_frame_looks_along_z() -> None:
    pose = CameraPose(stamp_ns=STAMP_NS, position_m=(1.0, 2.0, 1.5), orientation=look_at((1.0, 2.0, 1.5), (4.0, 6.0, 1.0)))
    optical = rotation_from_quaternion(pose.orientation)
    q = c.world_from_link_to_msg(pose, "map", "camera_link").transform.rotation
    link = rotation_from_quaternion((q.x, q.y, q.z, q.w))
    np.testing.assert_allclose(link[:, 0], optical[:, 2], atol=1e-12)
    np.testing.assert_allclose(link[:, 1], -optical[:, 0], atol=1e-12)
    np.testing.assert_allclose(link[:, 2], -optical[:, 1], atol=1e-12)


def test_labels_carry_the_stamp_and_the_standard() -> None:
    data = json.loads(c.labels_to_msg(semantic_labels(), STAMP_NS).data)
    assert data["stamp"] == {"sec": 12, "nanosec": 300_000_456}
    assert data["labels"]["4"] == {"name": "bed", "class": 4, "color": [255, 187, 120]}
    assert len(data["labels"]) == 41


def test_occupancy_grid_keeps_rows_and_values() -> None:
    cells = np.array([[0, 100, -1], [-1, 0, 100]], np.int8)
    grid = c.occupancy_to_msg(cells, 0.05, (-1.0, 2.0), STAMP_NS, "map")
    assert (grid.info.width, grid.info.height, list(grid.data)) == (3, 2, [0, 100, -1, -1, 0, 100])
    assert math.isclose(grid.info.resolution, 0.05, rel_tol=1e-6)
    assert (grid.info.origin.position.x, grid.info.origin.position.y) == (-1.0, 2.0)
