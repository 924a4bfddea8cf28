"""The run as a state machine: which room goes out when, with times of the test's own."""

from dataclasses import replace

import pytest

from scene_description import SceneSynthError
from scene_synth_ros.suite.status import NodeStatus
from scene_synth_ros.synthesize.room_schedule import RoomSchedule, Step
from scene_synth_ros.synthesize.run_config import RunConfig

FREE = RunConfig(lock_step=False, rooms=3, frames_per_room=5, rate_hz=10.0)
STEP = RunConfig(rooms=2, frames_per_room=5, rate_hz=10.0, expected_recorders=1)


def report(run: RoomSchedule, role: str, done: int, state: str = "ready") -> bool:
    return run.take_status(NodeStatus(node=f"/{role}", role=role, state=state, done_scene=done, run=run.name))


def finish(run: RoomSchedule, done: int) -> None:
    for role in ("renderer", "recorder"):
        report(run, role, done)


def send(run: RoomSchedule, now_s: float) -> int:
    """Send the next room; return the stamp of its first frame in ns."""
    assert run.step(now_s, active=True) is Step.SEND
    order = run.order(now_s)
    assert order is not None and order.index == run.next_index
    run.sent(order.times.frames, now_s)
    return order.times.start_ns + round(order.times.first_index * 1e9 / order.times.rate_hz)


def test_lock_step_waits_for_each_peer_and_finishes_once() -> None:
    run = RoomSchedule(STEP, 0.0)
    assert (run.step(0.0, True), run.waiting) == (Step.WAIT, "1 of 1 renderers to be ready")
    finish(run, -1)
    assert send(run, 0.1) == 10**9
    assert (run.step(0.2, True), run.waiting) == (Step.WAIT, "/renderer to finish room 0")
    assert not report(run, "renderer", 0), "the recorder has not finished"
    assert (run.step(0.3, True), run.waiting) == (Step.WAIT, "/recorder to finish room 0")
    assert report(run, "recorder", 0) and run.finished_by_all == 0
    assert send(run, 0.4) == 1_500_000_000
    assert run.is_complete and run.order(0.5) is None
    assert run.step(0.5, True) is Step.WAIT
    finish(run, 1)
    assert [run.step(0.6, True) for _ in range(3)] == [Step.FINISH, Step.WAIT, Step.WAIT]


def test_by_the_wall_clock_a_room_has_time_to_be_prepared_and_waits_for_nobody() -> None:
    run = RoomSchedule(replace(FREE, clock="wall"), 0.0)
    send(run, 1.0)
    assert run.step(1.0 + 0.3 + 0.5 - 0.01, True) is Step.WAIT
    assert run.step(1.0 + 0.3 + 0.5, True) is Step.SEND
    with pytest.raises(SceneSynthError, match="parameter clock: 'wall' goes with lock_step false, got true; set lock_step:=false"):
        replace(STEP, clock="wall").check()
    replace(FREE, clock="wall").check()


def test_rooms_ahead_may_be_unfinished_but_the_end_waits_for_all() -> None:
    run = RoomSchedule(replace(STEP, rooms=3, rooms_ahead=2), 0.0)
    finish(run, -1)
    send(run, 0.0)
    send(run, 0.0)
    assert run.step(0.0, True) is Step.WAIT
    finish(run, 0)
    send(run, 0.0)
    finish(run, 1)
    assert run.step(0.0, True) is Step.WAIT
    finish(run, 2)
    assert run.step(0.0, True) is Step.FINISH


def test_an_inactive_node_sends_nothing() -> None:
    run = RoomSchedule(FREE, 0.0)
    assert [run.step(0.0, active) for active in (False, True)] == [Step.WAIT, Step.SEND]


def test_free_running_rooms_follow_the_wall_clock() -> None:
    run = RoomSchedule(FREE, 100.0)
    assert send(run, 100.0) == 10**9
    assert run.step(100.49, True) is Step.WAIT
    assert send(run, 100.5) == 1_500_000_000
    send(run, 101.0)
    assert [run.step(now_s, True) for now_s in (101.4, 101.5)] == [Step.WAIT, Step.FINISH]


def test_a_free_run_ends_when_those_that_are_there_have_finished() -> None:
    run = RoomSchedule(replace(FREE, rooms=1), 0.0)
    send(run, 0.0)
    report(run, "renderer", -1)
    assert run.step(9.0, True) is Step.WAIT
    report(run, "renderer", 0)
    assert run.step(9.0, True) is Step.FINISH


def test_a_free_room_has_its_time_from_the_first_frame_on() -> None:
    run = RoomSchedule(FREE, 0.0)
    report(run, "renderer", -1)
    send(run, 0.0)
    assert [run.step(now_s, True) for now_s in (0.1, 3.0)] == [Step.WAIT, Step.WAIT]
    assert run.waiting == "/renderer to begin room 0"
    run.take_status(NodeStatus(node="/renderer", role="renderer", state="ready", begun_scene=0, run=run.name))
    assert [run.step(now_s, True) for now_s in (3.0, 3.49)] == [Step.WAIT, Step.WAIT]
    assert send(run, 3.5) == 1_500_000_000
    assert run.step(3.5 + 29.9, True) is Step.WAIT
    assert run.step(3.5 + 30.0 + 30.0, True) is Step.SEND, "it does not wait for ever"


@pytest.mark.parametrize(("lock_step", "frames_skipped"), [(False, 21), (True, 0)])
def test_simulated_time_goes_on_while_a_free_run_is_paused(lock_step: bool, frames_skipped: int) -> None:
    run = RoomSchedule(replace(FREE, lock_step=lock_step, expected_renderers=0), 0.0)
    send(run, 0.0)
    run.pause(0.2)
    run.pause(1.0)
    assert run.step(2.0, True) is Step.WAIT
    run.resume(2.5)  # 2 s after the room's end at 0.5 s
    assert send(run, 2.5) == 1_500_000_000 + frames_skipped * 10**8


def test_one_room_may_go_out_during_a_pause() -> None:
    run = RoomSchedule(FREE, 0.0)
    run.pause(0.0)
    assert run.step(0.0, True) is Step.WAIT
    assert run.ask_for_one() == ""
    send(run, 0.0)
    assert run.step(9.0, True) is Step.WAIT


def test_a_reset_waits_for_the_room_at_work_and_until_all_have_heard_of_it() -> None:
    run = RoomSchedule(STEP, 0.0)
    finish(run, -1)
    send(run, 0.0)
    assert run.ask_for_reset() == "/renderer to finish room 0"
    assert run.step(0.0, True) is Step.WAIT
    finish(run, 0)
    generation, name = run.generation, run.name
    assert run.step(0.0, True) is Step.BEGIN_AGAIN
    assert run.generation == generation + 1 and run.next_index == 0
    assert (run.step(0.0, True), run.waiting) == (Step.WAIT, "/renderer to hear of the run")
    finish(run, -1)
    assert send(run, 0.0) == 1_500_000_000, "simulated time goes on"
    run.take_status(NodeStatus(node="/renderer", role="renderer", state="ready", done_scene=0, run=name))
    assert run.step(0.0, True) is Step.WAIT, "this is still said of room 0 before"
    finish(run, 0)
    send(run, 0.0)


def test_a_peer_may_finish_all_rooms_that_are_out_at_once_after_a_reset() -> None:
    run = RoomSchedule(replace(STEP, rooms=3, rooms_ahead=2), 0.0)
    for begins_again in (False, True):
        if begins_again:
            run.ask_for_reset()
            assert run.step(0.0, True) is Step.BEGIN_AGAIN
        finish(run, -1)
        send(run, 0.0)
        send(run, 0.0)
        finish(run, 1)
    assert send(run, 0.0) == 3_000_000_000, "a peer that never said less than 1 has finished room 1 all the same"


def test_a_change_of_rate_goes_on_from_the_next_frame() -> None:
    run = RoomSchedule(FREE, 0.0)
    send(run, 0.0)
    run.change(replace(FREE, rate_hz=20.0))
    order = run.order(1.0)
    assert order is not None and order.generation == 1
    assert (order.times.start_ns, order.times.first_index, order.times.rate_hz) == (1_500_000_000, 0, 20.0)


def test_a_room_lost_by_a_fault_leaves_its_index_and_its_time_empty() -> None:
    run = RoomSchedule(FREE, 0.0)
    send(run, 0.0)
    run.skip(0.5)
    assert run.order(0.6) is None, "a fault in every room must not fill the log"
    order = run.order(1.6)
    assert order is not None and order.index == 2
    assert send(run, 1.6) == 2 * 10**9


def test_peers_that_are_missing_for_three_looks_are_forgotten() -> None:
    run = RoomSchedule(STEP, 0.0)
    finish(run, -1)
    assert run.drop_missing({"/renderer", "/recorder"}) == []
    assert [run.drop_missing({"/recorder"}) for _ in range(3)] == [[], [], ["/renderer"]]
    assert [peer.node for peer in run.peers] == ["/recorder"]


def test_a_long_wait_is_told_once_for_everything_that_is_waited_for() -> None:
    run = RoomSchedule(replace(STEP, peer_timeout_s=30.0), 0.0)
    told = []
    for now_s in range(200):
        if now_s == 100:
            report(run, "renderer", -1)
        run.step(float(now_s), active=True)
        told.append(run.long_wait(float(now_s)))
    lines = {now_s: line for now_s, line in enumerate(told) if line}
    assert lines == {31: "waiting since 31 s for 1 of 1 renderers to be ready", 100: "waiting since 100 s for 1 of 1 recorders to be ready"}
    report(run, "recorder", -1)
    send(run, 200.0)
    assert run.long_wait(300.0) == "", "nothing has been looked at since"


HELD = replace(STEP, rooms=3, expected_recorders=0)


def shows(run: RoomSchedule, stamp_ns: int, done: int = -1) -> None:
    status = NodeStatus(node="/renderer", role="renderer", state="ready", done_scene=done, run=run.name, shown_ns=stamp_ns)
    run.take_status(status)


def test_a_held_run_lets_frames_out_one_by_one_across_rooms() -> None:
    run = RoomSchedule(HELD, 0.0)
    shows(run, -1)
    assert run.until_ns == -1
    start = send(run, 0.0)
    path = [start + k * 10**8 for k in range(5)]
    run.hold()
    assert run.until_ns == 0
    shows(run, path[1])
    assert run.until_ns == path[1], "who is behind may catch up"
    assert run.let_out(2, path) == run.until_ns == path[3]
    assert not run.has_shown(path[3])
    shows(run, path[3])
    assert run.has_shown(path[3]) and run.let_out(3, path) == path[4] + 2 * 10**8
    shows(run, path[4], done=0)
    assert send(run, 0.0) == path[4] + 10**8
    run.play(0.0)
    assert run.until_ns == -1


@pytest.mark.parametrize("time", [True, False])
def test_a_run_begins_anew_at_once_where_nobody_records_and_its_time_if_asked(time: bool) -> None:
    run = RoomSchedule(HELD, 0.0)
    shows(run, -1)
    send(run, 0.0)
    run.hold()
    run.begin_anew(time=time, stopped=True)
    assert run.until_ns == 0 and not run.is_reset
    assert run.step(0.0, True) is Step.BEGIN_AGAIN and run.is_reset
    shows(run, -1)
    assert run.step(0.0, True) is Step.WAIT and run.stopped
    run.play(0.0)
    assert send(run, 0.0) == (10**9 if time else 1_500_000_000)


def test_a_room_that_is_recorded_is_finished_before_the_run_begins_anew() -> None:
    run = RoomSchedule(STEP, 0.0)
    finish(run, -1)
    send(run, 0.0)
    run.hold()
    run.begin_anew(time=False, stopped=True)
    assert run.until_ns == -1, "its frames go on to the end"
    assert run.step(0.0, True) is Step.WAIT
    finish(run, 0)
    assert run.step(0.0, True) is Step.BEGIN_AGAIN
