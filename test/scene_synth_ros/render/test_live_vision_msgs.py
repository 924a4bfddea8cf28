"""What ids mean and where objects are, live: messages of ``vision_msgs`` beside the JSON where it is installed."""

import json
from pathlib import Path

from rclpy.context import Context
from sample_scene import sample_scene
from scene_synth_ros_suite import Peer, node_process, without
from std_msgs.msg import String
from vision_msgs.msg import Detection2DArray, Detection3DArray, LabelInfo

from scene_description import scene_to_json
from scene_synth_ros.suite.qos import latched_qos

SETTINGS = {"camera.width": 32, "camera.height": 24, "render.samples_per_pixel": 1, "streams.camera": "eye", "streams.annotations": True}
DETECTIONS = {"detections_2d": Detection2DArray, "detections_3d": Detection3DArray}
FRAMES = len(sample_scene().camera_path)


class Reader(Peer):
    """Sends a room and hears what ids mean, by topic."""

    def __init__(self, context: Context) -> None:
        super().__init__(context)
        self.labels: dict[str, list[String]] = {"semantic": [], "instance": []}
        self.infos: dict[str, list[LabelInfo]] = {"semantic": [], "instance": []}
        self._scene = self.node.create_publisher(String, "scene", latched_qos())
        for layer in self.labels:
            self.node.create_subscription(String, f"eye/{layer}/labels", self.labels[layer].append, latched_qos(100))
            self.node.create_subscription(LabelInfo, f"eye/{layer}/label_info", self.infos[layer].append, latched_qos(100))

    def see_a_room(self) -> None:
        self.meet("renderer_node")
        self._scene.publish(String(data=scene_to_json(sample_scene())))
        self.spin_until(lambda: all(len(heard) == FRAMES for heard in self.labels.values()), 120, "the labels of the path")


def test_annotations_come_to_whoever_subscribes_to_one_of_their_topics() -> None:
    with node_process("renderer_node", SETTINGS) as context:
        reader = Reader(context)
        detections: dict[str, list[object]] = {name: [] for name in DETECTIONS}
        for name, kind in DETECTIONS.items():
            reader.node.create_subscription(kind, f"eye/{name}", detections[name].append, 10)
        reader.see_a_room()
        reader.spin_until(lambda: all(len(heard) == FRAMES for heard in detections.values()), 120, "the detections of the path")
        for flat, solid, path in zip(*detections.values(), sample_scene().camera_path, strict=True):
            assert flat.header == solid.header and flat.header.frame_id == "eye_optical_frame"
            assert flat.header.stamp.sec * 10**9 + flat.header.stamp.nanosec == path.stamp_ns
            assert [found.id for found in flat.detections] == [found.id for found in solid.detections] != []


def test_label_info_says_with_every_frame_what_the_labels_say() -> None:
    with node_process("renderer_node", SETTINGS) as context:
        reader = Reader(context)
        reader.see_a_room()
        reader.spin_until(lambda: all(len(heard) == FRAMES for heard in reader.infos.values()), 120, "as many LabelInfo")
        for layer, texts in reader.labels.items():
            for text, info in zip(texts, reader.infos[layer], strict=True):
                labels = json.loads(text.data)
                stamp = info.header.stamp
                assert ({"sec": stamp.sec, "nanosec": stamp.nanosec}, info.header.frame_id) == (labels["stamp"], "eye_optical_frame")
                names = {str(item.class_id): item.class_name for item in info.class_map}
                assert names == {key: value["name"] for key, value in labels["labels"].items()}
        late: list[LabelInfo] = []
        reader.node.create_subscription(LabelInfo, "eye/instance/label_info", late.append, latched_qos(100))
        reader.spin_until(lambda: late, 120, "the latched message")


def test_without_vision_msgs_there_is_json_only(tmp_path: Path) -> None:
    with node_process("renderer_node", SETTINGS, without("vision_msgs", tmp_path)) as context:
        reader = Reader(context)
        reader.see_a_room()
        assert reader.node.count_publishers("eye/semantic/label_info") == reader.node.count_publishers("eye/instance/label_info") == 0
        assert [reader.node.count_publishers(f"eye/{name}") for name in ("annotations", *DETECTIONS)] == [1, 0, 0]
        counts: list[dict[str, int]] = []
        reader.node.create_subscription(String, "status", lambda text: counts.append(json.loads(text.data)["counts"]), latched_qos())
        labels, annotations = (reader.node.resolve_topic_name(f"eye/{name}") for name in ("instance/labels", "annotations"))
        reader.spin_until(lambda: counts and counts[-1][labels] == FRAMES, 120, "the status after the path")
        assert counts[-1][annotations] == 0  # nobody subscribes
