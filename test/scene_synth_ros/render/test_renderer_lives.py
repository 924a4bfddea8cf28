"""Configured, cleaned up and configured again, in this process: one rendering thread, and the one before has ended."""

import threading
import time
from collections.abc import Iterator

import pytest
from rclpy.lifecycle import TransitionCallbackReturn
from rclpy.parameter import Parameter
from sample_scene import sample_scene
from scene_synth_ros_suite import Peer, claim_domain, dds_context
from std_msgs.msg import String

from scene_description import scene_to_json
from scene_synth_ros.render import rendering, room
from scene_synth_ros.render.renderer_node import RendererNode
from scene_synth_ros.suite.qos import latched_qos


class SlowCompiler:
    """Stands in for ``warm_up``: compiles until it is let go, and knows how many do so at once."""

    def __init__(self) -> None:
        self.go, self.begun, self.ended = threading.Event(), 0, 0

    def __call__(self, *_: object, **__: object) -> None:
        self.begun += 1
        assert self.go.wait(30)
        self.ended += 1


@pytest.fixture
def compiler(monkeypatch: pytest.MonkeyPatch) -> SlowCompiler:
    compiler = SlowCompiler()
    monkeypatch.setattr(rendering, "warm_up", compiler)
    return compiler


@pytest.fixture
def node(compiler: SlowCompiler) -> Iterator[RendererNode]:
    with dds_context(claim_domain()) as context:
        node = RendererNode(context=context, namespace="/synth", parameter_overrides=[Parameter("autostart", value=False)])
        yield node
        compiler.go.set()
        node.close()


def rendering_threads() -> list[threading.Thread]:
    return [thread for thread in threading.enumerate() if thread.name.startswith("render")]


def wait_for(condition: object, seconds: float = 10.0) -> None:
    deadline = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < deadline
        time.sleep(0.01)


def test_a_life_that_begins_while_kernels_compile_waits_for_the_one_before(node: RendererNode, compiler: SlowCompiler) -> None:
    assert node.trigger_configure() == TransitionCallbackReturn.SUCCESS
    wait_for(lambda: compiler.begun == 1)
    assert node.trigger_cleanup() == TransitionCallbackReturn.SUCCESS
    assert compiler.ended == 0, "a cleanup does not wait for the compiler"
    assert node.trigger_configure() == TransitionCallbackReturn.SUCCESS
    time.sleep(0.3)
    assert compiler.begun == 1, "the second life must not compile beside the first"
    compiler.go.set()
    wait_for(lambda: compiler.ended == 2 and len(rendering_threads()) == 1)


def test_a_life_that_was_cleaned_up_before_it_began_never_begins(node: RendererNode, compiler: SlowCompiler) -> None:
    for _ in range(3):
        assert node.trigger_configure() == TransitionCallbackReturn.SUCCESS
        wait_for(lambda: compiler.begun == 1)
        assert node.trigger_cleanup() == TransitionCallbackReturn.SUCCESS
    compiler.go.set()
    wait_for(lambda: compiler.ended >= 1)
    time.sleep(0.3)
    assert (compiler.begun, compiler.ended) == (1, 1)


def test_a_room_that_is_still_prepared_after_a_cleanup_disturbs_nobody(
    node: RendererNode, compiler: SlowCompiler, monkeypatch: pytest.MonkeyPatch
) -> None:
    entered, go, right = threading.Event(), threading.Event(), room.flatten

    def slow_flatten(*words: object) -> object:
        entered.set()
        assert go.wait(30)
        return right(*words)

    monkeypatch.setattr(room, "flatten", slow_flatten)
    compiler.go.set()
    peer = Peer(node.context)
    peer.spin_too(node)
    scenes = peer.node.create_publisher(String, "scene", latched_qos())
    scenes.publish(String(data=scene_to_json(sample_scene())))
    assert node.trigger_configure() == TransitionCallbackReturn.SUCCESS
    assert node.trigger_activate() == TransitionCallbackReturn.SUCCESS
    peer.spin_until(entered.is_set, 120, "the room at work")
    (thread,) = rendering_threads()
    assert node.trigger_deactivate() == TransitionCallbackReturn.SUCCESS
    assert node.trigger_cleanup() == TransitionCallbackReturn.SUCCESS
    go.set()
    thread.join(20)
    assert not thread.is_alive() and (node.faults.count, node.exit_code) == (0, None)
