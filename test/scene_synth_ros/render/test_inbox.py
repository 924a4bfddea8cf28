"""What reaches the rendering thread, and when it must leave the room at work."""

import threading
from dataclasses import replace

import pytest

from scene_synth_ros.render.inbox import MAX_ROOMS_WAITING, Inbox
from scene_synth_ros.suite.status import NodeStatus

TOPIC = "/r/settings"


def make(share_count: int = 1) -> Inbox:
    return Inbox("/r", TOPIC, share_count)


def lock_step(inbox: Inbox, on: bool) -> None:
    inbox.take_status(NodeStatus(node="/g", role="grammar", state="ready", lock_step=on), 0)


def recorder(taken: int) -> NodeStatus:
    return NodeStatus(node="/b", role="recorder", state="ready", counts={TOPIC: taken})


def status_of(role: str, name: str = "", *, done: int = -1, count: int = 0, state: str = "ready", refused: int = -1) -> NodeStatus:
    return NodeStatus(node=f"/{name or role}", role=role, state=state, done_scene=done, refused_scene=refused, counts={TOPIC: count})


def test_only_the_newest_room_is_rendered_unless_rooms_wait() -> None:
    inbox = make()
    for text in "abc":
        inbox.put_room(text)
    assert inbox.next_room() == "c"
    lock_step(inbox, True)
    for text in "def":
        inbox.put_room(text)
    assert [inbox.next_room() for _ in range(3)] == ["d", "e", "f"]


def test_the_oldest_rooms_give_way_when_too_many_wait() -> None:
    inbox = make(share_count=2)
    for number in range(MAX_ROOMS_WAITING + 2):
        inbox.put_room(str(number))
    assert inbox.next_room() == "2"


@pytest.mark.parametrize(
    ("on_path", "waits", "shown", "leave"),
    [
        (True, True, True, False),
        (False, True, True, True),
        (True, False, True, True),
        (True, False, False, False),
        (False, False, False, True),
    ],
)
def test_a_room_is_left_for_the_next_unless_its_path_or_its_first_frame_must_be_finished(
    on_path: bool, waits: bool, shown: bool, leave: bool
) -> None:
    inbox = make()
    lock_step(inbox, waits)
    assert not inbox.must_leave(on_path, shown)
    inbox.put_room("next")
    assert inbox.must_leave(on_path, shown) is leave
    inbox.stop()
    assert inbox.must_leave(on_path, shown)


def test_a_stop_ends_every_wait() -> None:
    inbox = make()
    inbox.take_status(recorder(0), 0)
    ended: list[object] = []
    waits = [lambda: ended.append(inbox.next_room()), lambda: ended.append(inbox.wait_for_recorders(9, 8, 60.0))]
    threads = [threading.Thread(target=wait, daemon=True) for wait in waits]
    for thread in threads:
        thread.start()
    inbox.stop()
    for thread in threads:
        thread.join(10)
    assert set(ended) == {None, True}
    assert inbox.must_leave(on_path=True)


def test_frames_wait_for_a_recorder_that_is_behind() -> None:
    inbox = make()
    inbox.take_status(recorder(0), 0)
    assert not inbox.wait_for_recorders(8, 8, 0.01)
    inbox.take_status(recorder(1), 8)
    assert inbox.wait_for_recorders(8, 8, 0.01)


def test_waiting_ends_with_what_was_put_in_or_does_not_begin() -> None:
    inbox = make()
    inbox.wait(60.0, unless=lambda: True)
    threading.Timer(0.05, inbox.wake).start()
    inbox.wait(60.0, unless=lambda: False)


def test_shared_rooms_come_in_turn() -> None:
    inbox = Inbox("/renderer_node", TOPIC, 2)
    assert not inbox.is_turn(0, True), "the other one is not known yet"
    inbox.take_status(status_of("renderer", "renderer_node_2", done=-1), 0)
    assert inbox.is_turn(0, True) and not inbox.is_turn(1, False)
    inbox.take_status(status_of("renderer", "renderer_node_2", done=1), 0)
    inbox.take_status(status_of("recorder", done=0), 0)
    assert inbox.is_turn(1, False) and not inbox.is_turn(2, False), "the recorder has not finished room 1"
    inbox.take_status(status_of("recorder", done=1), 0)
    assert inbox.is_turn(2, False)
    assert Inbox("/renderer_node", TOPIC, 1).is_turn(9, False)


def test_rooms_wait_for_each_other_in_lock_step_and_where_they_are_shared() -> None:
    alone = Inbox("/renderer_node", TOPIC, 1)
    assert Inbox("/renderer_node", TOPIC, 2).rooms_wait and not alone.rooms_wait
    for lock_step in (True, False):
        alone.take_status(replace(status_of("grammar"), lock_step=lock_step), 0)
        assert alone.rooms_wait == lock_step


def test_a_recorder_that_is_behind_holds_frames_back() -> None:
    inbox = Inbox("/renderer_node", TOPIC, 1)
    inbox.take_status(status_of("recorder", count=100), 0)
    assert inbox.wait_for_recorders(7, 8, 0.0) and not inbox.wait_for_recorders(8, 8, 0.0)
    inbox.take_status(status_of("recorder", count=103), 0)
    assert inbox.wait_for_recorders(10, 8, 0.0) and not inbox.wait_for_recorders(11, 8, 0.0)
    inbox.take_status(status_of("recorder", count=-1), 0)
    assert inbox.wait_for_recorders(1000, 8, 0.0), "it leaves these frames out"


@pytest.mark.parametrize(
    ("own", "token", "waits", "expected"),
    [
        ("", "", True, True),
        ("a", "a", True, True),
        ("", "a", True, False),
        ("b", "a", True, False),
        ("", "a", False, True),
        ("b", "", True, True),
    ],
)
def test_a_renderer_leaves_alone_the_rooms_of_a_run_that_does_not_expect_it(own: str, token: str, waits: bool, expected: bool) -> None:
    inbox = Inbox("/r", TOPIC, 1, own)
    inbox.put_room("of a run before")
    inbox.take_status(NodeStatus(node="/g", role="grammar", state="ready", lock_step=waits, token=token), 0)
    assert inbox.is_expected is expected and inbox.must_leave(on_path=True, shown=False) is not expected
    if not expected:
        inbox.put_room("of the run")
        inbox.take_status(NodeStatus(node="/g", role="grammar", state="ready"), 0)
        inbox.put_room("of another run")
        assert inbox.next_room() == "of another run"


@pytest.mark.parametrize(("waits", "recorded", "leave"), [(True, False, True), (True, True, False), (False, False, False)])
def test_a_room_is_left_when_its_run_begins_again_where_nobody_records(waits: bool, recorded: bool, leave: bool) -> None:
    inbox = make()
    grammar = NodeStatus(node="/g", role="grammar", state="ready", lock_step=waits, run="a.0", until_ns=7)
    if recorded:
        inbox.take_status(recorder(0), 0)
    inbox.take_status(grammar, 0)
    inbox.put_room("a")
    assert inbox.next_room() == "a" and inbox.until_ns == 7
    inbox.take_status(replace(grammar, run="a.1"), 0)
    assert inbox.must_leave(on_path=True) == leave
    inbox.put_room("b")
    assert inbox.next_room() == "b" and not inbox.must_leave(on_path=True)


def test_a_room_begins_when_the_other_cameras_of_the_run_have_their_first_frame() -> None:
    inbox = make()
    lock_step(inbox, True)
    inbox.take_status(status_of("renderer", "left"), 0)
    inbox.take_status(status_of("renderer", "compiling", state="starting"), 0)
    assert inbox.not_begun(0) == {"/left"}
    inbox.take_status(replace(status_of("renderer", "left"), begun_scene=0), 0)
    assert inbox.not_begun(0) == set() and inbox.not_begun(1) == {"/left"}
    inbox.take_status(status_of("renderer", "left", refused=1), 0)
    assert inbox.not_begun(1) == set()


def test_renderers_that_share_rooms_do_not_wait_for_each_other_to_begin() -> None:
    inbox = make(share_count=2)
    inbox.take_status(status_of("renderer", "other"), 0)
    assert inbox.not_begun(0) == set()
