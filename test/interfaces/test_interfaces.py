"""The message packages built for the tests are those of a real ROS 2 system: type hashes, bytes, and the way through DDS."""

import sys
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
import rclpy
from geometry_msgs.msg import TransformStamped
from interfaces import build
from rclpy.context import Context
from rclpy.serialization import deserialize_message, serialize_message
from rosbags.typesys import Stores, get_types_from_msg, get_typestore
from scene_synth_ros_suite import Child, Peer, environment, stop
from tf2_msgs.msg import TF2Error, TFMessage
from vision_msgs.msg import (
    BoundingBox2D,
    Detection2D,
    Detection2DArray,
    LabelInfo,
    ObjectHypothesis,
    ObjectHypothesisWithPose,
    VisionClass,
)

from scene_synth_ros.messages.message_definitions import message_class, message_definition
from scene_synth_ros.suite.qos import latched_qos

HASHES = {
    "tf2_msgs/msg/TF2Error": "RIHS01_db2485e7d6a0ec75bf087e058ee45df682acc3a621ca7780503d10aac141809a",
    "tf2_msgs/msg/TFMessage": "RIHS01_e369d0f05a23ae52508854b66f6aa0437f3449d652e8cbf22d5abe85d020f087",
    "vision_msgs/msg/BoundingBox2D": "RIHS01_008eacbb0cf8f26e83795547bed013eec3675485ef386ec056d80eaaf1c1ce2f",
    "vision_msgs/msg/Classification": "RIHS01_f74db28d0eaef3afb78f48bf2161cd709a1383a0309d3454383b25be11345143",
    "vision_msgs/msg/Detection2D": "RIHS01_0d12b69df5c593b3455b7346fac8205437a7d4bcb09b9e0e0b2dde787ded38ea",
    "vision_msgs/msg/Detection2DArray": "RIHS01_214274120007f4a683866481336b70310268cfa107aebe9d594a6acf75bda968",
    "vision_msgs/msg/Detection3DArray": "RIHS01_793f5eab9595ac1c0da07873cc859db42eae51f0ee76056db8562515d830e018",
    "vision_msgs/msg/LabelInfo": "RIHS01_3d37df4015cdf660cc851c51897f2acd957e1ca6205ba0a99aebffb9406b0783",
    "vision_msgs/msg/ObjectHypothesis": "RIHS01_51da43cec11c01957a64d1e05a24acd18aae7745ec30b74348ad5f6d634f7f90",
    "vision_msgs/msg/ObjectHypothesisWithPose": "RIHS01_41c12344c0396c48b81df12467c192d99b2a0eb1463c5c37194e4223251c80bc",
    "vision_msgs/msg/Point2D": "RIHS01_eab0e83f44ab4de92ceaf76dd7d0e7638f2bdd1d16ffbe16c7a136c48e407247",
    "vision_msgs/msg/Pose2D": "RIHS01_b0b5d1d7b4c20dd4fcde3ed1d4b289a919290572007d67a97043814db25d3648",
    "vision_msgs/msg/VisionClass": "RIHS01_1e4a11f0fed50b5623cb8ff26ca0e37952a48a9c074d16f804b44e9164c2037a",
    "vision_msgs/msg/VisionInfo": "RIHS01_95d3116a17484ad91c9a2686e1d54890bbfc3ff6c6a2de137738c4950d45d284",
}
"""Of builds of the packages themselves, as published; a hash covers the types that a type is made of (REP 2011)."""

ALL = sorted(f"{path.parents[1].name}/msg/{path.stem}" for path in build.SOURCES.glob("*/msg/*.msg"))

PUBLISHER = """
import rclpy
from geometry_msgs.msg import TransformStamped
from rclpy.node import Node
from scene_synth_ros.suite.qos import latched_qos
from tf2_msgs.msg import TFMessage
from vision_msgs.msg import LabelInfo, VisionClass

rclpy.init()
node = Node("publisher")
transforms = [TransformStamped(child_frame_id=name) for name in ("a", "b")]
node.create_publisher(TFMessage, "/tf_static", latched_qos()).publish(TFMessage(transforms=transforms))
node.create_publisher(LabelInfo, "/labels", latched_qos()).publish(LabelInfo(class_map=[VisionClass(class_id=4, class_name="bed")]))
rclpy.spin(node)
"""


def detections() -> Detection2DArray:
    """Two detections, of which one has two hypotheses, with a value of its own in every field that is compared."""
    results = [
        ObjectHypothesisWithPose(hypothesis=ObjectHypothesis(class_id=name, score=score)) for name, score in (("bed", 0.75), ("sofa", 0.25))
    ]
    results[1].pose.covariance = np.arange(36.0)
    box = BoundingBox2D(size_x=3.0, size_y=4.0)
    box.center.position.x, box.center.position.y, box.center.theta = 1.0, 2.0, 0.5
    return Detection2DArray(detections=[Detection2D(id="7", results=results, bbox=box), Detection2D(id="é")])


@pytest.mark.parametrize("type_name", HASHES)
def test_the_type_hash_is_that_of_the_real_package(type_name: str) -> None:
    assert message_definition(type_name).type_hash == HASHES[type_name]


@pytest.mark.parametrize("type_name", ALL)
def test_every_type_survives_serialisation(type_name: str) -> None:
    message = message_class(type_name)()
    assert deserialize_message(serialize_message(message), type(message)) == message


def test_the_bytes_are_those_of_an_independent_decoder() -> None:
    store, name = get_typestore(Stores.ROS2_JAZZY), "vision_msgs/msg/Detection2DArray"
    store.register(get_types_from_msg(message_definition(name).text, name))
    sent = detections()
    first, second = store.deserialize_cdr(serialize_message(sent), name).detections
    assert (first.id, second.id, second.results) == ("7", "é", [])
    assert [(result.hypothesis.class_id, result.hypothesis.score) for result in first.results] == [("bed", 0.75), ("sofa", 0.25)]
    np.testing.assert_array_equal(first.results[1].pose.covariance, np.arange(36.0))
    centre = first.bbox.center
    assert (centre.position.x, centre.position.y, centre.theta, first.bbox.size_x, first.bbox.size_y) == (1.0, 2.0, 0.5, 3.0, 4.0)


def test_constants_are_those_of_tf2() -> None:
    names = ("NO_ERRORS", "LOOKUP", "CONNECTIVITY", "EXTRAPOLATION", "INVALID_ARGUMENT", "TIMEOUT", "TRANSFORM")
    assert [getattr(TF2Error, name if name == "NO_ERRORS" else f"{name}_ERROR") for name in names] == list(range(7))


def test_latched_messages_reach_another_process_with_their_type_hashes() -> None:
    surroundings, context = environment(), Context()
    child = Child([sys.executable, "-c", PUBLISHER], env=surroundings)
    rclpy.init(context=context, domain_id=int(surroundings["ROS_DOMAIN_ID"]))
    try:
        peer, transforms, labels = Peer(context), [], []
        peer.spin_until(lambda: peer.node.count_publishers("/tf_static") and peer.node.count_publishers("/labels"), 120, "the publishers")
        peer.node.create_subscription(TFMessage, "/tf_static", transforms.append, latched_qos())
        peer.node.create_subscription(LabelInfo, "/labels", labels.append, latched_qos())
        peer.spin_until(lambda: transforms and labels, 120, "both messages")
        assert transforms == [TFMessage(transforms=[TransformStamped(child_frame_id=name) for name in ("a", "b")])]
        assert labels == [LabelInfo(class_map=[VisionClass(class_id=4, class_name="bed")])]
        for topic, type_name in (("/tf_static", "tf2_msgs/msg/TFMessage"), ("/labels", "vision_msgs/msg/LabelInfo")):
            (info,) = peer.node.get_publishers_info_by_topic(topic)
            assert (info.topic_type, str(info.topic_type_hash)) == (type_name, HASHES[type_name])
    finally:
        stop(child)
        rclpy.try_shutdown(context=context)
        sys.stderr.write("\n".join(child.said()))


def test_what_is_up_to_date_is_not_built_again(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(build, "build_package", lambda *_: pytest.fail("built again; was it out of date? run make interfaces"))
    build.main()


def test_missing_compilers_and_headers_are_named_with_their_packages(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    advice = "which needs a C compiler and a C++ compiler and Python's headers: apt install gcc g++ python3-dev"
    monkeypatch.setattr(build, "STAMP", tmp_path / "none")
    monkeypatch.setattr(build, "_is_installed_elsewhere", lambda _: False)
    monkeypatch.setenv("PATH", str(tmp_path))
    monkeypatch.setattr(build, "sysconfig", SimpleNamespace(get_path=lambda _: str(tmp_path)))
    monkeypatch.delenv("NEEDED_TOOLS", raising=False)
    build.main()
    assert (
        capsys.readouterr().out
        == f"tf2_msgs and vision_msgs and simulation_interfaces are not built, {advice}; tests that need these packages are skipped\n"
    )
    monkeypatch.setenv("NEEDED_TOOLS", "required")
    with pytest.raises(SystemExit, match="are not built") as error:
        build.main()
    assert str(error.value).endswith(advice)
