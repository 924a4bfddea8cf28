"""QoS profiles in the two notations of rosbag2, against rosbags' reader of them."""

import pytest
import yaml
from rosbags.rosbag2.metadata import parse_qos

from scene_synth_ros.bags.qos_metadata import INFINITE_NS, OfferedQos, QosMetadataError, qos_items, qos_text, read_qos

PROFILES = (
    OfferedQos(depth=1, durability="transient_local"),
    OfferedQos(history="keep_all", depth=0, reliability="best_effort", deadline_ns=1_500_000_000, liveliness="manual_by_topic"),
)
RECORDED_BY_HUMBLE = """
- history: 3
  depth: 0
  reliability: 1
  durability: 2
  deadline:
    sec: 9223372036
    nsec: 854775807
  lifespan:
    sec: 2147483647
    nsec: 4294967295
  liveliness: 1
  liveliness_lease_duration:
    sec: 9223372036
    nsec: 4294967295
  avoid_ros_namespace_conventions: false
"""


@pytest.mark.parametrize("version", [5, 8, 9])
def test_rosbags_reads_what_is_written(version):
    parsed = parse_qos(qos_text(PROFILES, version))
    assert [(qos.history.name, qos.depth, qos.reliability.name, qos.durability.name, qos.liveliness.name) for qos in parsed] == [
        ("KEEP_LAST", 1, "RELIABLE", "TRANSIENT_LOCAL", "AUTOMATIC"),
        ("KEEP_ALL", 0, "BEST_EFFORT", "VOLATILE", "MANUAL_BY_TOPIC"),
    ]
    assert [(qos.deadline.sec, qos.deadline.nsec) for qos in parsed] == [(9223372036, 854775807), (1, 500000000)]


@pytest.mark.parametrize("version", [5, 9])
def test_round_trip(version):
    assert read_qos(qos_text(PROFILES, version)) == PROFILES
    assert read_qos(qos_items(PROFILES, version)) == PROFILES
    assert read_qos("") == read_qos(None) == read_qos("[]") == ()
    assert qos_text((), version) == ""


def test_numbers_and_infinities_of_older_recorders():
    (qos,) = read_qos(RECORDED_BY_HUMBLE)
    assert qos == OfferedQos(history="unknown", depth=0, lifespan_ns=2147483647 * 10**9 + 4294967295, liveliness_lease_ns=INFINITE_NS)


@pytest.mark.parametrize(
    ("change", "complaint"),
    [
        ({"history": "keep"}, "history: expected one of system_default, keep_last, keep_all, unknown or its number, got 'keep'"),
        ({"reliability": 9}, "reliability: expected one of"),
        ({"depth": -1}, "depth: expected a whole number, got -1"),
        ({"deadline": 5}, "expected a duration of sec and nsec"),
        ({"durability": None}, "durability: expected one of"),
    ],
)
def test_profiles_that_do_not_fit_are_refused(change, complaint):
    (item,) = qos_items(PROFILES[:1], 9)
    with pytest.raises(QosMetadataError, match="offered_qos_profiles: ") as error:
        read_qos(yaml.safe_dump([{**item, **change}]))
    assert complaint in str(error.value)


NO_PROFILES = ["a: b", "{", "5", "[1]", "- depth: 1", "!!int ''", "- &a [*a]", "[" * 3000, "!!python/object:os.system {}"]


@pytest.mark.parametrize("text", NO_PROFILES)
def test_other_texts_are_refused_in_one_line(text):
    with pytest.raises(QosMetadataError) as error:
        read_qos(text)
    assert "\n" not in str(error.value)
