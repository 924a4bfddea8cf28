"""What is measured of readings: classes by name, classes of objects, layers that are missing."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest
from rclpy.serialization import serialize_message

from evaluation.tasks import TASKS
from scene_description import CameraPose
from scene_synth_ros.evaluate.errors import EstimateError, EvaluateError
from scene_synth_ros.evaluate.estimates_bag import _detections
from scene_synth_ros.evaluate.measuring import TruthFrame, measure_frame, measure_room, needed_layers
from scene_synth_ros.evaluate.readings import BoxList, Reading
from scene_synth_ros.evaluate.topics import TypedTopic
from scene_synth_ros.evaluate.truth_facts import read_class_names
from scene_synth_ros.messages.cdr import CdrWriter
from scene_synth_ros.messages.conversions import image_to_msg
from scene_synth_ros.messages.streams import DETECTIONS_2D_TYPE, IMAGE_TYPE

BOXES = np.array([[2.0, 3.0, 10.0, 8.0], [20.0, 5.0, 6.0, 6.0]])


def truth(**messages: bytes) -> TruthFrame:
    topics = {name: TypedTopic(f"/{name}", DETECTIONS_2D_TYPE if name == "detections" else IMAGE_TYPE) for name in messages}
    return TruthFrame(topics, {f"/{name}": data for name, data in messages.items()}, "here", {"bed": 4, "chair": 5})


def ids(pixels: np.ndarray) -> bytes:
    return bytes(serialize_message(image_to_msg(np.ascontiguousarray(pixels, np.uint16), "16UC1", 1, "eye")))


def found(*classes: str) -> Reading:
    return Reading(BoxList(classes, np.array([0.9, 0.8]), BOXES, ("", "")), "eye")


def test_detections_may_name_their_classes() -> None:
    frame = truth(detections=_detections("detections", BoxList(("4", "5"), np.ones(2), BOXES, ("1", "2")), 1, "eye"))
    score = {
        classes: TASKS["detections"].score([measure_frame("detections", frame, {"detections": found(*classes)})])
        for classes in (("4", "5"), ("bed", "chair"), ("chair", "bed"))
    }
    assert [score[classes]["ap50"] for classes in score] == [1.0, 1.0, 0.0]
    with pytest.raises(
        EstimateError, match="expected the class of a detection as an id such as '5', or as a name of the labels, got 'sofa'"
    ):
        measure_frame("detections", frame, {"detections": found("bed", "sofa")})


@pytest.mark.parametrize("digits", ["9" * 5000, "9" * 19, "\u00b2", "\u0664"])
def test_digits_that_are_no_number_of_a_class_name_none(digits: str) -> None:
    frame = truth(detections=_detections("detections", BoxList(("4", "5"), np.ones(2), BOXES, ("1", "2")), 1, "eye"))
    with pytest.raises(EstimateError, match="expected the class of a detection"):
        measure_frame("detections", frame, {"detections": found("bed", digits)})
    labels = CdrWriter()
    labels.text(json.dumps({"labels": {digits: {"name": "bed"}, "4": {"name": "bed"}}}))
    assert read_class_names(labels.message()) == {4: "bed"}


def test_objects_have_the_classes_that_are_estimated_beside_them() -> None:
    pixels = np.zeros((8, 8), np.uint16)
    pixels[:4, :4], pixels[4:, 4:] = 1, 2
    classes = np.choose(pixels, [0, 4, 5])
    frame = truth(instance=ids(pixels), semantic=ids(classes))
    alone = measure_frame("instance", frame, {"instance": Reading(pixels, "eye")})
    wrong = {"instance": Reading(pixels, "eye"), "semantic": Reading(np.where(classes == 4, 7, classes), "eye")}
    assert TASKS["instance"].score([alone])["pq"] == 1.0
    assert TASKS["instance"].score([measure_frame("instance", frame, wrong)])["pq"] < 1.0


def test_a_tracker_that_is_lost_covers_less() -> None:
    truth = [CameraPose(stamp_ns=stamp, position_m=(0.1 * stamp, 0.0, 0.0), orientation=(0.0, 0.0, 0.0, 1.0)) for stamp in range(4)]
    lost = [*truth[:3], replace(truth[3], position_m=(float("nan"), 0.0, 0.0))]
    found = measure_room("poses", truth, lost)
    assert found is not None
    score = TASKS["poses"].score([found])
    assert (score["coverage"], round(score["rpe_translation"], 12)) == (0.75, 0.0)
    assert measure_room("poses", truth, [replace(truth[0], orientation=(0.0, 0.0, 0.0, 0.0))]) is None


def test_a_frame_without_its_truth_is_told() -> None:
    with pytest.raises(EvaluateError, match="here: expected truth of depth, got none"):
        truth().of_task("depth")
    with pytest.raises(EvaluateError, match=r"here: truth on /semantic: a sensor_msgs/msg/Image cannot be read \(3 bytes\)"):
        truth(semantic=b"abc").layer("semantic")


def test_aligned_depth_needs_the_layer_depth() -> None:
    assert needed_layers(["depth_aligned", "depth", "poses"]) == ("depth", "poses")
