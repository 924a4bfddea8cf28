"""Which room may go out next."""

from dataclasses import replace

import pytest

from scene_description import FieldError
from scene_synth_ros.suite.status import MAX_TEXT_LENGTH, NodeStatus, done_in_run, status_from_json, status_to_json
from scene_synth_ros.synthesize.room_schedule import finished_by_all, missing_peers, peer_failures, waiting_for

RUN = "g.1"


def peer(name: str, role: str, state: str = "ready", done: int = -1) -> NodeStatus:
    return NodeStatus(node=name, role=role, state=state, done_scene=done, run=RUN)


def peers(*statuses: NodeStatus) -> dict[str, NodeStatus]:
    return {status.node: status for status in statuses}


EXPECTED = {"renderer": 1, "recorder": 1}


@pytest.mark.parametrize(
    ("known", "last_sent", "words"),
    [
        (peers(), -1, "1 of 1 renderers to be ready"),
        (peers(peer("/r", "renderer", "starting")), -1, "1 of 1 renderers to be ready"),
        (peers(peer("/r", "renderer")), -1, "1 of 1 recorders to be ready"),
        (peers(peer("/r", "renderer"), peer("/b", "recorder")), -1, ""),
        (peers(peer("/r", "renderer"), peer("/b", "recorder")), 0, "/r to finish room 0"),
        (peers(peer("/r", "renderer", done=0), peer("/b", "recorder")), 0, "/b to finish room 0"),
        (peers(peer("/r", "renderer", done=0), peer("/b", "recorder", done=0)), 0, ""),
        (peers(peer("/r", "renderer", done=3), peer("/s", "renderer", done=2), peer("/b", "recorder", done=3)), 3, "/s to finish room 3"),
    ],
)
def test_a_room_waits_for_every_peer(known: dict[str, NodeStatus], last_sent: int, words: str) -> None:
    assert waiting_for(known, EXPECTED, last_sent, RUN) == words


def test_a_refused_room_is_done_too() -> None:
    assert done_in_run(NodeStatus(node="/r", role="renderer", state="ready"), "") == -1
    assert done_in_run(NodeStatus(node="/r", role="renderer", state="ready", done_scene=3, refused_scene=4), "") == 4


def test_what_is_said_of_another_run_counts_for_nothing() -> None:
    known = peers(peer("/r", "renderer", done=5), peer("/b", "recorder", done=5))
    assert waiting_for(known, EXPECTED, -1, "g.2") == "/r to hear of the run"
    assert (finished_by_all(known, RUN), finished_by_all(known, "g.2")) == (5, -1)
    refused = NodeStatus(node="/r", role="renderer", state="ready", refused_scene=0, reason="no such model", run=RUN)
    assert peer_failures(peers(refused), 0, RUN) and not peer_failures(peers(refused), 0, "g.2")


def test_failures_and_refusals_are_told() -> None:
    failed = NodeStatus(node="/b", role="recorder", state="failed", reason="disk full")
    refused = NodeStatus(node="/r", role="renderer", state="ready", refused_scene=4, reason="no such model")
    assert peer_failures(peers(refused, failed), 4, "") == ["/b failed: disk full", "/r refused room 4: no such model"]
    assert peer_failures(peers(refused), 5, "") == []
    assert peer_failures(peers(peer("/r", "renderer")), -1, RUN) == []


def test_a_refused_room_is_not_waited_for() -> None:
    refused = NodeStatus(node="/r", role="renderer", state="ready", done_scene=3, refused_scene=4)
    assert waiting_for(peers(refused), {"renderer": 1, "recorder": 0}, 4, "") == ""


def test_status_round_trip() -> None:
    status = NodeStatus(node="/synth/r", role="renderer", state="ready", done_scene=7, counts={"/a": 3, "/b": -1})
    assert status_from_json(status_to_json(status)) == status


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("{", "status: expected JSON"),
        ("[" * 60_000, "status: expected JSON"),
        ("7", "status: expected a mapping"),
        ('{"node": "/r", "role": "king", "state": "ready"}', "status.role: expected one of 'grammar', 'renderer', 'recorder', got 'king'"),
        ('{"node": "/r", "role": "renderer", "state": "ready", "counts": {"/a": "x"}}', "status.counts./a: expected an integer"),
        (" " * (MAX_TEXT_LENGTH + 1), "status: expected at most"),
    ],
)
def test_a_status_that_does_not_fit_is_refused(text: str, message: str) -> None:
    with pytest.raises(FieldError, match=message):
        status_from_json(text)


def test_all_have_finished_what_the_last_has() -> None:
    refusing = replace(peer("/a", "renderer", done=1), refused_scene=3)
    assert finished_by_all({}, RUN) == -1
    assert finished_by_all(peers(peer("/a", "renderer", done=4), peer("/b", "recorder", done=2)), RUN) == 2
    assert finished_by_all(peers(refusing, peer("/b", "recorder", done=5)), RUN) == 3


def test_a_peer_is_missed_only_after_it_was_seen_and_stays_away() -> None:
    known, absences = peers(peer("/a", "renderer"), peer("/b", "recorder")), {}
    for present in ({"/a"}, {"/a"}, set(), {"/a"}, set(), set()):
        assert missing_peers(known, present, absences, 3) == []
    assert missing_peers(known, set(), absences, 3) == ["/a"]
    assert missing_peers({"/b": known["/b"]}, set(), absences, 3) == []
