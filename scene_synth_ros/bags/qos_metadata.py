"""Offered QoS profiles as bags store them: names since metadata version 9, the integers of ``rmw/types.h`` before."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Protocol

from scene_description import SceneSynthError
from scene_description.strict import shorten
from scene_synth_ros.bags.bag_yaml import BagYamlError, dump_yaml, load_yaml

NAMED_QOS_VERSION = 9
INFINITE_NS = 2**63 - 1

_SECOND_NS = 1_000_000_000
_HISTORY = ("system_default", "keep_last", "keep_all", "unknown")
_RELIABILITY = ("system_default", "reliable", "best_effort", "unknown", "best_available")
_DURABILITY = ("system_default", "transient_local", "volatile", "unknown", "best_available")
_LIVELINESS = ("system_default", "automatic", "manual_by_node", "manual_by_topic", "unknown", "best_available")


class QosMetadataError(SceneSynthError):
    """A stored QoS profile that cannot be read; one line."""


@dataclass(frozen=True, slots=True, kw_only=True)
class OfferedQos:
    """The QoS profile of a publisher; policies by the names of metadata version 9, durations in nanoseconds."""

    history: str = "keep_last"
    depth: int = 10
    reliability: str = "reliable"
    durability: str = "volatile"
    deadline_ns: int = INFINITE_NS
    lifespan_ns: int = INFINITE_NS
    liveliness: str = "automatic"
    liveliness_lease_ns: int = INFINITE_NS
    avoid_ros_namespace_conventions: bool = False


class _Duration(Protocol):
    @property
    def nanoseconds(self) -> int: ...


class RosQosProfile(Protocol):
    """What :func:`offered_qos` reads of an ``rclpy.qos.QoSProfile``."""

    history: Any
    depth: int
    reliability: Any
    durability: Any
    deadline: _Duration
    lifespan: _Duration
    liveliness: Any
    liveliness_lease_duration: _Duration
    avoid_ros_namespace_conventions: bool


def offered_qos(profile: RosQosProfile) -> OfferedQos:
    """Return the stored form of an ``rclpy.qos.QoSProfile``.

    What the profile leaves open is stored as DDS decides it: infinite durations, automatic liveliness.
    """
    liveliness = _name(_LIVELINESS, int(profile.liveliness), "liveliness")
    return OfferedQos(
        history=_name(_HISTORY, int(profile.history), "history"),
        depth=profile.depth,
        reliability=_name(_RELIABILITY, int(profile.reliability), "reliability"),
        durability=_name(_DURABILITY, int(profile.durability), "durability"),
        deadline_ns=profile.deadline.nanoseconds or INFINITE_NS,
        lifespan_ns=profile.lifespan.nanoseconds or INFINITE_NS,
        liveliness="automatic" if liveliness == "system_default" else liveliness,
        liveliness_lease_ns=profile.liveliness_lease_duration.nanoseconds or INFINITE_NS,
        avoid_ros_namespace_conventions=profile.avoid_ros_namespace_conventions,
    )


def qos_items(profiles: Iterable[OfferedQos], version: int) -> list[dict[str, Any]]:
    """Return the profiles as the plain mappings of a metadata version."""
    named = version >= NAMED_QOS_VERSION
    return [
        {
            "history": qos.history if named else _HISTORY.index(qos.history),
            "depth": qos.depth,
            "reliability": qos.reliability if named else _RELIABILITY.index(qos.reliability),
            "durability": qos.durability if named else _DURABILITY.index(qos.durability),
            "deadline": _duration_item(qos.deadline_ns),
            "lifespan": _duration_item(qos.lifespan_ns),
            "liveliness": qos.liveliness if named else _LIVELINESS.index(qos.liveliness),
            "liveliness_lease_duration": _duration_item(qos.liveliness_lease_ns),
            "avoid_ros_namespace_conventions": qos.avoid_ros_namespace_conventions,
        }
        for qos in profiles
    ]


def qos_text(profiles: Sequence[OfferedQos], version: int) -> str:
    """Return the YAML sequence that stands in channel metadata and, before version 9, in ``metadata.yaml``; empty for no profiles."""
    return dump_yaml(qos_items(profiles, version)).strip() if profiles else ""


def read_qos(stored: object) -> tuple[OfferedQos, ...]:
    """Read profiles of any metadata version, from a YAML text or from what a YAML reader returned.

    Raises:
        QosMetadataError: the text is no YAML sequence of profiles.
    """
    if isinstance(stored, str):
        try:
            stored = load_yaml(stored)
        except BagYamlError as error:
            raise QosMetadataError(f"offered_qos_profiles: {error}") from None
    if stored is None or stored == "":
        return ()
    if not isinstance(stored, list):
        raise QosMetadataError(f"offered_qos_profiles: expected a YAML sequence, got {type(stored).__name__}")
    return tuple(_read_profile(item) for item in stored)


def _read_profile(item: object) -> OfferedQos:
    if not isinstance(item, Mapping):
        raise QosMetadataError(f"offered_qos_profiles: expected a mapping, got {type(item).__name__}")
    try:
        return OfferedQos(
            history=_policy(_HISTORY, item["history"], "history"),
            depth=_integer(item["depth"], "depth"),
            reliability=_policy(_RELIABILITY, item["reliability"], "reliability"),
            durability=_policy(_DURABILITY, item["durability"], "durability"),
            deadline_ns=_read_duration(item["deadline"]),
            lifespan_ns=_read_duration(item["lifespan"]),
            liveliness=_policy(_LIVELINESS, item["liveliness"], "liveliness"),
            liveliness_lease_ns=_read_duration(item["liveliness_lease_duration"]),
            avoid_ros_namespace_conventions=bool(item["avoid_ros_namespace_conventions"]),
        )
    except KeyError as error:
        raise QosMetadataError(f"offered_qos_profiles: key {error} is missing") from None


def _policy(names: Sequence[str], value: object, what: str) -> str:
    if isinstance(value, str) and value in names:
        return value
    return _name(names, value, what)


def _name(names: Sequence[str], value: object, what: str) -> str:
    if isinstance(value, int) and not isinstance(value, bool) and 0 <= value < len(names):
        return names[value]
    raise QosMetadataError(f"offered_qos_profiles: {what}: expected one of {', '.join(names)} or its number, got {shorten(value)}")


def _integer(value: object, what: str) -> int:
    if isinstance(value, bool) or not isinstance(value, int) or not 0 <= value < 2**63:
        raise QosMetadataError(f"offered_qos_profiles: {what}: expected a whole number, got {shorten(value)}")
    return value


def _duration_item(duration_ns: int) -> dict[str, int]:
    sec, nsec = divmod(duration_ns, _SECOND_NS)
    return {"sec": sec, "nsec": nsec}


def _read_duration(item: object) -> int:
    """Return nanoseconds, at most ``INFINITE_NS``, which the larger infinities of older recorders become."""
    if not isinstance(item, Mapping) or "sec" not in item or "nsec" not in item:
        raise QosMetadataError("offered_qos_profiles: expected a duration of sec and nsec")
    return min(_integer(item["sec"], "sec") * _SECOND_NS + _integer(item["nsec"], "nsec"), INFINITE_NS)
