"""Which topics of a bag are taken for truth, estimates and an algorithm's images."""

from __future__ import annotations

import pytest

from scene_synth_ros.evaluate.errors import EvaluateError
from scene_synth_ros.evaluate.topics import TypedTopic, camera_of, estimate_topic, image_topics, parse_mapping, truth_topics
from scene_synth_ros.messages.streams import CLOUD_TYPE as CLOUD
from scene_synth_ros.messages.streams import COMPRESSED_TYPE, IMAGE_TYPE, TF_TYPE
from scene_synth_ros.messages.streams import ODOMETRY_TYPE as ODOMETRY
from scene_synth_ros.messages.streams import POSE_TYPE as POSE

LEFT = {
    "/synth/left/color/image_raw": IMAGE_TYPE,
    "/synth/left/depth/image_raw/compressedDepth": COMPRESSED_TYPE,
    "/synth/left/depth_sensed/image_raw": IMAGE_TYPE,
    "/synth/left/pose": POSE,
}
RIG = {**LEFT, "/synth/right/color/image_raw": IMAGE_TYPE, "/synth/right/pose": POSE, "/tf": TF_TYPE, "/synth/laser/pose": POSE}
DEPTH = TypedTopic("/synth/left/depth/image_raw/compressedDepth", COMPRESSED_TYPE)


def chosen(types: dict[str, str], task: str = "depth", topic: str = "", *, same_bag: bool = False) -> str:
    return estimate_topic(types, task, topic, DEPTH, "/synth/left", "bag", same_bag=same_bag).name


def test_the_truth_is_that_of_one_camera_compressed_or_not() -> None:
    found = truth_topics(RIG, ["depth", "poses"], "", "bag")
    assert found == {"depth": DEPTH, "poses": TypedTopic("/synth/left/pose", POSE)}
    assert camera_of(found) == "/synth/left"
    assert truth_topics(RIG, ["poses"], "right", "bag")["poses"].name == "/synth/right/pose"
    with pytest.raises(EvaluateError, match="expected truth of depth of camera 'right' on /synth/right/depth/image_raw"):
        truth_topics(RIG, ["depth", "poses"], "right", "bag")


def test_estimates_have_their_default_name_then_that_of_the_truth_then_the_only_one_that_fits() -> None:
    own = {"/synth/left/depth/image_raw": IMAGE_TYPE, "/mine": IMAGE_TYPE}
    assert chosen({**own, "/estimates/depth/image_raw": IMAGE_TYPE}) == "/estimates/depth/image_raw"
    assert chosen({DEPTH.name: COMPRESSED_TYPE, "/mine": IMAGE_TYPE}) == DEPTH.name
    assert chosen({"/mine": IMAGE_TYPE, "/points": CLOUD}) == "/mine"
    assert chosen({"/odometry": ODOMETRY, "/mine": IMAGE_TYPE}, "poses") == "/odometry"
    assert chosen(RIG, same_bag=True) == "/synth/left/depth_sensed/image_raw"
    assert chosen(RIG, "poses", "/tf@left_link", same_bag=True) == "/tf@left_link"
    with pytest.raises(EvaluateError, match="got topics /a, /b that could be; name it: --topic depth:=/TOPIC"):
        chosen({"/a": IMAGE_TYPE, "/b": IMAGE_TYPE})
    with pytest.raises(EvaluateError, match=r"topic /odometry: expected sensor_msgs/msg/Image or .* as estimates of depth, got nav_msgs"):
        chosen({"/odometry": ODOMETRY}, topic="/odometry")


def test_an_algorithm_may_see_another_camera() -> None:
    found = image_topics(RIG, "/synth/left", ["color", "right/color"], "bag")
    assert [topic.name for topic in found.values()] == ["/synth/left/color/image_raw", "/synth/right/color/image_raw"]
    with pytest.raises(EvaluateError, match="expected images 'right/depth' for the algorithm on /synth/right/depth/image_raw"):
        image_topics(RIG, "/synth/left", ["right/depth"], "bag")


def test_all_tasks_of_depth_share_a_topic_unless_they_have_their_own() -> None:
    assert parse_mapping(["depth:=/a", "depth_affine:=/b"]) == {"depth": "/a", "depth_affine": "/b", "depth_aligned": "/a"}
    with pytest.raises(EvaluateError, match="--topic colour:=/a: expected a task of depth"):
        parse_mapping(["colour:=/a"])
