"""Managed nodes: transitions do what they say, and one that is not allowed harms nobody."""

import json
from collections.abc import Iterator
from pathlib import Path

import pytest
from lifecycle_msgs.msg import Transition
from lifecycle_msgs.srv import ChangeState, GetState
from rclpy.context import Context
from rclpy.duration import Duration
from rclpy.serialization import deserialize_message
from scene_synth_ros_suite import Peer, node_process
from std_msgs.msg import String

from scene_description import SceneDescription, scene_from_json
from scene_synth_ros.bags.bag_inspect import inspect_bag
from scene_synth_ros.bags.bag_reader import BagReader
from scene_synth_ros.suite.qos import latched_qos


class Manager(Peer):
    """Calls services of a node and hears its rooms."""

    def __init__(self, context: Context) -> None:
        super().__init__(context)
        self.scenes: list[SceneDescription] = []
        self.node.create_subscription(String, "scene", lambda message: self.scenes.append(scene_from_json(message.data)), latched_qos(10))

    def change(self, node: str, transition: int) -> bool:
        return self.call(ChangeState, f"{node}/change_state", ChangeState.Request(transition=Transition(id=transition))).success

    def state(self, node: str) -> str:
        return self.call(GetState, f"{node}/get_state", GetState.Request()).current_state.label


@pytest.fixture(scope="module")
def manager() -> Iterator[Manager]:
    settings = {"seed": 4, "frames_per_room": 2, "rate_hz": 8.0, "lock_step": False, "autostart": False}
    with node_process("grammar_node", settings) as context:
        yield Manager(context)


def test_a_grammar_node_goes_through_its_states(manager: Manager) -> None:
    assert manager.state("grammar_node") == "unconfigured"
    assert not manager.change("grammar_node", Transition.TRANSITION_ACTIVATE), "it is not configured"
    assert manager.change("grammar_node", Transition.TRANSITION_CONFIGURE)
    manager.spin_for(1.0)
    assert not manager.scenes, "no room goes out before it is active"
    assert manager.change("grammar_node", Transition.TRANSITION_ACTIVATE)
    manager.spin_until(lambda: manager.scenes, 120, "the first room")
    assert manager.change("grammar_node", Transition.TRANSITION_DEACTIVATE)
    manager.spin_for(0.5)
    seen = len(manager.scenes)
    manager.spin_for(1.0)
    assert len(manager.scenes) == seen and manager.state("grammar_node") == "inactive"
    assert manager.change("grammar_node", Transition.TRANSITION_CLEANUP)
    assert manager.state("grammar_node") == "unconfigured"
    manager.scenes.clear()
    assert manager.change("grammar_node", Transition.TRANSITION_CONFIGURE) and manager.change(
        "grammar_node", Transition.TRANSITION_ACTIVATE
    )
    manager.spin_until(lambda: manager.scenes, 120, "the first room again")
    assert manager.scenes[0].index == 0


def test_services_pause_step_and_reset_the_run(manager: Manager) -> None:
    for state, transition in (("unconfigured", Transition.TRANSITION_CONFIGURE), ("inactive", Transition.TRANSITION_ACTIVATE)):
        if manager.state("grammar_node") == state:  # this test may come first, or alone
            assert manager.change("grammar_node", transition)
    manager.spin_until(lambda: len(manager.scenes) >= 2, 120, "two rooms")
    assert manager.trigger("grammar_node/pause")[0]
    manager.spin_for(0.5)
    paused = manager.scenes[-1]
    manager.spin_for(1.0)
    assert manager.scenes[-1] == paused
    assert manager.trigger("grammar_node/next_room")[0]
    manager.spin_until(lambda: manager.scenes[-1].index == paused.index + 1, 120, "one room more")
    manager.spin_for(1.0)
    assert manager.scenes[-1].index == paused.index + 1, "only one"
    last_ns = manager.scenes[-1].camera_path[-1].stamp_ns
    assert manager.trigger("grammar_node/resume")[0]
    manager.spin_until(lambda: manager.scenes[-1].index > paused.index + 1, 120, "the run goes on")
    assert manager.scenes[-1].camera_path[0].stamp_ns > last_ns + 5 * 10**8, "simulated time went on while it was paused"
    first = manager.scenes[0]
    before = len(manager.scenes)
    assert manager.trigger("grammar_node/reset")[0]
    manager.spin_until(lambda: any(scene.index == 0 for scene in manager.scenes[before:]), 120, "room 0 again")
    again = next(scene for scene in manager.scenes[before:] if scene.index == 0)
    assert (again.objects, again.seed) == (first.objects, first.seed)
    assert again.camera_path[0].stamp_ns > last_ns


def test_recorder_services_start_stop_split_and_snapshot(tmp_path: Path) -> None:
    settings = {"bag": str(tmp_path / "bag"), "snapshot_s": 100.0, "extra_topics": "['/other/*']"}
    with node_process("recorder_node", settings) as context:
        manager = Manager(context)
        speaker = manager.node.create_publisher(String, "/other/words", latched_qos(1))
        own = manager.node.create_publisher(String, "scene_words", latched_qos(1))

        def say(number: int) -> None:
            speaker.publish(String(data=f"word {number}"))
            own.publish(String(data=json.dumps({"stamp_ns": number * 10**9})))
            for publisher in (speaker, own):  # the recorder has it then, and takes messages before it answers calls
                assert publisher.wait_for_all_acked(Duration(seconds=20))

        manager.spin_until(lambda: speaker.get_subscription_count() and own.get_subscription_count(), 120, "the recorder")
        for number in (1, 2):
            say(number)
        assert manager.trigger("recorder_node/split")[0]
        say(3)
        taken, told = manager.trigger("recorder_node/snapshot")
        assert taken and told.startswith(f"{tmp_path}/bag_snapshot_0: "), told
        stopped, told = manager.trigger("recorder_node/stop")
        assert stopped and told.startswith(f"{tmp_path}/bag: ")
        assert not (tmp_path / "bag" / "bag_0.mcap.active").exists()
        say(4)
        assert manager.trigger("recorder_node/start") == (True, f"{tmp_path}/bag_2")
        assert manager.trigger("recorder_node/start")[0] is False
        say(5)
        assert manager.trigger("recorder_node/stop")[0]
        assert manager.trigger("recorder_node/stop") == (True, "no bag was open")
    assert {"/other/words", "/synth/scene_words"} <= {topic.name for topic in inspect_bag(tmp_path / "bag").topics}
    assert sorted(path.name for path in (tmp_path / "bag").iterdir()) == ["bag_0.mcap", "bag_1.mcap", "metadata.yaml"]
    words = {name: texts(tmp_path / name, "/other/words") for name in ("bag", "bag_2", "bag_snapshot_0")}
    assert words["bag_snapshot_0"] == ["word 1", "word 2", "word 3"]
    assert [text for text in dict.fromkeys(words["bag"])] == ["word 1", "word 2", "word 3"]
    assert words["bag_2"][-1] == "word 5" and "word 4" not in words["bag_2"]


def texts(bag: Path, topic: str) -> list[str]:
    with BagReader(bag) as reader:
        return [deserialize_message(message.data, String).data for message in reader.messages([topic], file_order=True)]
