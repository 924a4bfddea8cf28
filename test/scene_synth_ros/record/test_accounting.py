"""Nothing is lost unnoticed."""

from unittest import mock

from scene_synth_ros.record.room_progress import Accounting, RoomProgress
from scene_synth_ros.suite.status import NodeStatus

RECORDED = {"/image": 0, "/depth": 0, "/left_out": -1}


def status(done: int, image: int, depth: int = 0, node: str = "/r", start: str = "first life") -> NodeStatus:
    counts = {"/image": image, "/depth": depth, "/left_out": 99}
    return NodeStatus(node=node, role="renderer", state="ready", done_scene=done, counts=counts, start=start)


def started() -> Accounting:
    accounting = Accounting()
    counts = {"/image": 0, "/depth": 0, "/left_out": 0}
    accounting.take_status(NodeStatus(node="/r", role="renderer", state="starting", counts=counts, start="first life"))
    return accounting


def test_what_was_published_and_has_not_arrived_is_missing() -> None:
    accounting = started()
    accounting.received.update({"/image": 8, "/depth": 6})
    accounting.take_status(status(0, 8, 8))
    assert accounting.done_scene("") == 0
    assert accounting.missing(RECORDED) == {"/depth": 2}
    accounting.received.update({"/depth": 2})
    assert accounting.missing(RECORDED) == {}


def test_given_up_messages_count_once_as_lost() -> None:
    accounting = started()
    accounting.received.update({"/image": 7})
    accounting.take_status(status(0, 8))
    accounting.give_up(accounting.missing(RECORDED))
    assert accounting.missing(RECORDED) == {}
    assert accounting.lost == {"/image": 1}
    accounting.take_status(status(1, 16))
    assert accounting.missing(RECORDED) == {"/image": 8}


def test_a_renderer_met_while_it_publishes_is_counted_from_its_next_room() -> None:
    accounting = Accounting()
    accounting.take_status(status(3, 40))
    accounting.received.update({"/image": 5})
    assert accounting.missing(RECORDED) == {}
    accounting.take_status(status(4, 48))
    assert accounting.missing(RECORDED) == {}
    accounting.take_status(status(5, 56))
    assert accounting.missing(RECORDED) == {"/image": 8}


def test_a_room_is_done_when_every_renderer_has_done_it() -> None:
    accounting = started()
    accounting.take_status(status(2, 0, node="/a"))
    accounting.take_status(status(1, 0, node="/r"))
    assert (accounting.done_scene(""), accounting.done_scene("another run")) == (1, -1)
    assert Accounting().done_scene("") == -1


def test_a_renderer_that_starts_again_is_counted_from_then_on() -> None:
    accounting = started()
    accounting.received.update({"/image": 5})
    accounting.take_status(status(-1, 7, start="first life"))
    assert accounting.missing(RECORDED) == {"/image": 2}
    accounting.take_status(status(-1, 0, start="second life"))
    assert accounting.missing(RECORDED) == {}
    accounting.received.update({"/image": 8})
    accounting.take_status(status(0, 8, start="second life"))
    assert accounting.missing(RECORDED) == {}
    accounting.take_status(status(1, 16, start="second life"))
    assert accounting.missing(RECORDED) == {"/image": 8}


def test_what_still_comes_is_not_lost_however_long_it_takes() -> None:
    """A burst that a busy machine takes in piece by piece; what is missing when nothing comes any more is lost."""
    accounting, warned = Accounting(), []
    recording = mock.MagicMock()
    recording.intake.held = ""
    progress = RoomProgress(recording, accounting, {"/imu": 1}, warned.append)
    progress.take_status(NodeStatus(node="/renderer", role="renderer", state="ready", start="a"))
    progress.take_status(NodeStatus(node="/renderer", role="renderer", state="ready", start="a", counts={"/imu": 100}, done_scene=0))
    for second in range(60):
        progress.step(float(second), 10.0)
        accounting.received["/imu"] += second % 6 == 0  # ten of them, one in six seconds
    assert not accounting.lost
    for second in range(60, 75):
        progress.step(float(second), 10.0)
    assert accounting.lost == {"/imu": 90}
    assert warned == ["90 messages lost after room -1: {'/imu': 90}"]
