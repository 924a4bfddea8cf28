"""Messages as arrays: every form that truth and estimates may have, and what is refused in one line."""

from __future__ import annotations

import numpy as np
import pytest
from geometry_msgs.msg import PoseStamped
from nav_msgs.msg import Odometry, Path
from rclpy.serialization import serialize_message
from sensor_msgs.msg import Image, PointCloud2, PointField

from scene_description import CameraPose
from scene_synth_ros.evaluate.errors import EstimateError
from scene_synth_ros.evaluate.estimates_bag import _detections, _image, _points
from scene_synth_ros.evaluate.readings import BoxList, Cloud, Reading, read_message
from scene_synth_ros.evaluate.task_streams import check_pair, read_for_task
from scene_synth_ros.messages.conversions import header, image_to_msg, pose_to_msg
from scene_synth_ros.messages.poses import StampedTransform, encode_tf_message
from scene_synth_ros.messages.streams import CLOUD_TYPE as CLOUD
from scene_synth_ros.messages.streams import DETECTIONS_2D_TYPE, IMAGE_TYPE, TF_TYPE
from scene_synth_ros.messages.streams import ODOMETRY_TYPE as ODOMETRY
from scene_synth_ros.messages.streams import PATH_TYPE as PATH

STAMP = 1_500_000_001


def image(encoding: str, pixels: np.ndarray, *, step: int | None = None, big: bool = False) -> bytes:
    """Return a serialised image, with padding where ``step`` is longer than a row."""
    height, width = pixels.shape[:2]
    rows = np.ascontiguousarray(pixels).reshape(height, -1).view(np.uint8).reshape(height, -1)
    padded = np.zeros((height, step or rows.shape[1]), np.uint8)
    padded[:, : rows.shape[1]] = rows
    message = Image(header=header(STAMP, "eye"), height=height, width=width, encoding=encoding, step=padded.shape[1], is_bigendian=int(big))
    message.data.frombytes(padded.tobytes())
    return bytes(serialize_message(message))


def read(task: str, type_name: str, data: bytes, topic: str = "/x") -> Reading:
    return read_for_task(task, type_name, data, topic)


def test_depth_in_millimetres_is_metres_and_zero_is_unknown() -> None:
    depth = read("depth", IMAGE_TYPE, image("16UC1", np.array([[0, 1500]], np.uint16)))
    assert depth.frame_id == "eye"
    np.testing.assert_array_equal(depth.value, np.array([[np.nan, 1.5]], np.float32))


def test_padding_byte_order_and_double_precision_change_nothing() -> None:
    metres = np.array([[1.0, 2.0], [3.0, 4.5]])
    for data in (
        image("32FC1", metres.astype("<f4"), step=20),
        image("32FC1", metres.astype(">f4"), big=True),
        image("64FC1", metres),
    ):
        found = read("depth", IMAGE_TYPE, data).value
        assert found.dtype == np.float32
        np.testing.assert_array_equal(found, metres)


@pytest.mark.parametrize(
    ("task", "encoding", "pixels", "said"),
    [
        ("depth", "mono8", np.zeros((2, 2), np.uint8), "expected an image 32FC1 (metres) or 16UC1 (millimetres), got 1 x uint8 a pixel"),
        ("normals", "32FC1", np.zeros((2, 2), np.float32), "expected an image 32FC3, got 1 x float32 a pixel"),
        ("semantic", "rgb8", np.zeros((2, 2, 3), np.uint8), "expected an image of ids, mono8, 16UC1 or 32SC1, got 3 x uint8 a pixel"),
        ("depth", "yuv422", np.zeros((2, 2), np.uint8), "got 'yuv422'"),
    ],
)
def test_a_wrong_encoding_is_one_line(task: str, encoding: str, pixels: np.ndarray, said: str) -> None:
    with pytest.raises(EstimateError) as refused:
        read(task, IMAGE_TYPE, image(encoding, pixels))
    assert said in str(refused.value) and "\n" not in str(refused.value)


def test_a_cut_message_is_one_line() -> None:
    whole = image("32FC1", np.zeros((4, 4), np.float32))
    for type_name, data in ((IMAGE_TYPE, whole[:40]), (TF_TYPE, b"\x00\x01\x00\x00\x05\x00\x00\x00"), (DETECTIONS_2D_TYPE, b"")):
        with pytest.raises(EstimateError, match=f"a {type_name} cannot be read \\({len(data)} bytes\\)"):
            read_message(type_name, data, "/x")


def test_sizes_and_frames_that_do_not_fit_the_truth_are_refused() -> None:
    truth, half = Reading(np.zeros((4, 6, 3)), "eye"), Reading(np.zeros((2, 3, 3)), "eye")
    with pytest.raises(EstimateError, match="expected an image of 6x4 pixels as the truth is, got 3x2"):
        check_pair("normals", truth, half)
    with pytest.raises(EstimateError, match="expected normals in frame 'eye' as the truth is, got 'map'"):
        check_pair("normals", truth, Reading(truth.value, "map"))
    check_pair("depth", truth, Reading(truth.value, "map"))  # a distance is the same in all frames of the camera


def test_poses_of_every_message() -> None:
    expected = CameraPose(stamp_ns=STAMP, position_m=(1.0, 2.0, 3.0), orientation=(0.0, 0.0, 0.6, 0.8))
    pose = pose_to_msg(expected, "map")
    odometry, path = Odometry(header=pose.header), Path(header=pose.header, poses=[pose, PoseStamped()])
    odometry.pose.pose = pose.pose
    assert read("poses", "geometry_msgs/msg/PoseStamped", bytes(serialize_message(pose))).value == (expected,)
    assert read("poses", ODOMETRY, bytes(serialize_message(odometry))).value == (expected,)
    assert read("poses", PATH, bytes(serialize_message(path))).value[0] == expected
    other = StampedTransform(5, "map", "wheel", (0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 1.0))
    transforms = encode_tf_message([other, StampedTransform(STAMP, "map", "eye", expected.position_m, expected.orientation)])
    assert read("poses", TF_TYPE, transforms, "/tf@eye").value == (expected,)
    assert len(read("poses", TF_TYPE, transforms, "/tf").value) == 2


def test_written_estimates_read_back() -> None:
    depth = np.array([[1.25, np.inf], [np.nan, 3.0]], np.float32)
    np.testing.assert_array_equal(read("depth", IMAGE_TYPE, _image("depth", depth, STAMP, "eye")).value, depth)
    points = np.array([[1.0, 2.0, 3.0], [np.nan, 0.0, 0.0], [4.0, 5.0, 6.0]])
    np.testing.assert_array_equal(read("points", CLOUD, _points("points", Cloud(points), STAMP, "eye")).value.points, points[[0, 2]])
    boxes = BoxList(("5", "7"), np.array([0.9, 0.25]), np.array([[1.0, 2.0, 10.0, 4.0], [0.0, 0.0, 3.0, 3.0]]), ("1", ""))
    found = read("detections", DETECTIONS_2D_TYPE, _detections("detections", boxes, STAMP, "eye"))
    assert (found.frame_id, found.value.class_ids, found.value.ids) == ("eye", boxes.class_ids, boxes.ids)
    np.testing.assert_array_equal(found.value.scores, boxes.scores)
    np.testing.assert_array_equal(found.value.boxes, boxes.boxes)


def test_a_field_of_points_beyond_them_is_refused() -> None:
    """Offsets near 2^31 wrap round in numpy: the process would read beyond the message, and crash."""
    fields = [PointField(name=axis, offset=offset, datatype=7, count=1) for axis, offset in (("x", 0), ("y", 2**31 - 1), ("z", 8))]
    cloud = PointCloud2(height=1, width=1, fields=fields, point_step=12, row_step=12, data=bytes(12))
    with pytest.raises(EstimateError, match=r"^expected fields within points of 12 bytes, got y at 2147483647$"):
        read_message(CLOUD, bytes(serialize_message(cloud)), "/x")


def test_ids_of_an_image_message() -> None:
    pixels = np.array([[1, 40000]], np.uint16)
    data = bytes(serialize_message(image_to_msg(pixels, "16UC1", STAMP, "eye")))
    np.testing.assert_array_equal(read("instance", IMAGE_TYPE, data).value, pixels)
