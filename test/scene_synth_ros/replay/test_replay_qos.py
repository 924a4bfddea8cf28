"""QoS of replayed topics."""

from dataclasses import replace

import pytest
from rclpy.qos import QoSDurabilityPolicy, QoSHistoryPolicy, QoSReliabilityPolicy

from scene_synth_ros.bags.qos_metadata import OfferedQos, offered_qos
from scene_synth_ros.replay.playable_topics import replay_qos

RELIABLE, BEST_EFFORT = QoSReliabilityPolicy.RELIABLE, QoSReliabilityPolicy.BEST_EFFORT
VOLATILE, LATCHED = QoSDurabilityPolicy.VOLATILE, QoSDurabilityPolicy.TRANSIENT_LOCAL
UNKNOWN = OfferedQos(history="unknown", depth=0)


@pytest.mark.parametrize(
    ("recorded", "expected"),
    [
        ([], (RELIABLE, VOLATILE, 10)),
        ([OfferedQos(depth=5)], (RELIABLE, VOLATILE, 5)),
        ([OfferedQos(depth=1, durability="transient_local")], (RELIABLE, LATCHED, 1)),
        ([OfferedQos(depth=3, reliability="best_effort")], (BEST_EFFORT, VOLATILE, 3)),
        ([OfferedQos(depth=3), OfferedQos(depth=7, reliability="best_effort", durability="transient_local")], (BEST_EFFORT, VOLATILE, 7)),
        ([UNKNOWN], (RELIABLE, VOLATILE, 10)),
        ([OfferedQos(depth=2**40)], (RELIABLE, VOLATILE, 10_000)),
    ],
)
def test_policies(recorded, expected):
    profile = replay_qos(recorded)
    assert (profile.reliability, profile.durability, profile.depth) == expected
    assert profile.history == QoSHistoryPolicy.KEEP_LAST


def test_what_is_offered_is_stored_as_it_was_but_for_liveliness():
    for qos in (OfferedQos(depth=5), OfferedQos(depth=1, durability="transient_local", deadline_ns=10**9, lifespan_ns=5)):
        assert offered_qos(replay_qos([qos])) == replace(qos, liveliness="manual_by_topic")
    assert replay_qos([OfferedQos(history="keep_all")]).history == QoSHistoryPolicy.KEEP_ALL
