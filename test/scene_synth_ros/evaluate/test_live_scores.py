"""What is said of estimates while an algorithm runs: those at stamps that no truth has, and those that say nothing."""

from __future__ import annotations

import numpy as np
from geometry_msgs.msg import PoseStamped
from nav_msgs.msg import Path
from rclpy.serialization import serialize_message

from scene_synth_ros.evaluate.live_scores import LiveScores
from scene_synth_ros.evaluate.stamp_buffer import Gathered
from scene_synth_ros.evaluate.topics import TypedTopic
from scene_synth_ros.messages.conversions import image_to_msg
from scene_synth_ros.messages.streams import IMAGE_TYPE, PATH_TYPE, POSE_TYPE


def depth(stamp_ns: int) -> bytes:
    return bytes(serialize_message(image_to_msg(np.ones((8, 8), np.float32), "32FC1", stamp_ns, "eye")))


def test_estimates_at_stamps_that_no_truth_has_are_told() -> None:
    scores = LiveScores(["depth"], {"depth": TypedTopic("/truth", IMAGE_TYPE)}, 10)
    scores.add_estimates("depth", TypedTopic("/mine", IMAGE_TYPE))
    scores.measure(Gathered(1, {"/truth": depth(1), "/mine": depth(1)}))
    for stamp in (7, 8):
        scores.measure(Gathered(stamp, {"/mine": depth(stamp)}))
    assert scores.counts() == {"depth": {"measured": 1, "missing": 0, "foreign": 2}}
    assert scores.notes() == [
        "depth: /mine: expected estimates at the stamps of the truth, got one at a stamp that no truth has; copy the stamp of the image"
        " (first stamp 7 ns, 2 times)"
    ]


def test_a_path_without_poses_is_no_estimate() -> None:
    scores = LiveScores(["poses"], {"poses": TypedTopic("/truth", POSE_TYPE)}, 10)
    scores.add_estimates("poses", TypedTopic("/mine", PATH_TYPE))
    scores.measure(Gathered(0, {"/truth": bytes(serialize_message(PoseStamped())), "/mine": bytes(serialize_message(Path()))}))
    assert scores.counts() == {"poses": {"measured": 0, "missing": 1, "foreign": 0}}
