"""Offered QoS profiles as bags store them: names since metadata version 9, the integers of ``rmw/types.h`` before."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Protocol

from scene_description import SceneSynthError
from scene_description.strict import shorten
from scene_description.yaml_text import dump_yaml, load_yaml

NAMED_QOS_VERSION = 9
INFINITE_NS = 2**63 - 1

_SECOND_NS = 1_000_000_000
_POLICIES = {
    "history": ("system_default", "keep_last", "keep_all", "unknown"),
    "reliability": ("system_default", "reliable", "best_effort", "unknown", "best_available"),
    "durability": ("system_default", "transient_local", "volatile", "unknown", "best_available"),
    "liveliness": ("system_default", "automatic", "manual_by_node", "manual_by_topic", "unknown", "best_available"),
}
"""Policy -> its values; the place of each is its number."""


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
    policies = {name: _policy(name, int(getattr(profile, name))) for name in _POLICIES}
    if policies["liveliness"] == "system_default":
        policies["liveliness"] = "automatic"
    return OfferedQos(
        **policies,
        depth=profile.depth,
        deadline_ns=profile.deadline.nanoseconds or INFINITE_NS,
        lifespan_ns=profile.lifespan.nanoseconds or INFINITE_NS,
        liveliness_lease_ns=profile.liveliness_lease_duration.nanoseconds or INFINITE_NS,
        avoid_ros_namespace_conventions=profile.avoid_ros_namespace_conventions,
    )


def qos_items(profiles: Iterable[OfferedQos], version: int) -> list[dict[str, Any]]:
    """Return the profiles as the plain mappings of a metadata version."""

    def value(name: str, policy: str) -> str | int:
        return policy if version >= NAMED_QOS_VERSION else _POLICIES[name].index(policy)

    return [
        {
            "history": value("history", qos.history),
            "depth": qos.depth,
            "reliability": value("reliability", qos.reliability),
            "durability": value("durability", qos.durability),
            "deadline": _duration_item(qos.deadline_ns),
            "lifespan": _duration_item(qos.lifespan_ns),
            "liveliness": value("liveliness", qos.liveliness),
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
        stored = load_yaml(stored, "offered_qos_profiles", QosMetadataError)
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
            **{name: _policy(name, item[name]) for name in _POLICIES},
            depth=_integer(item["depth"], "depth"),
            deadline_ns=_read_duration(item["deadline"]),
            lifespan_ns=_read_duration(item["lifespan"]),
            liveliness_lease_ns=_read_duration(item["liveliness_lease_duration"]),
            avoid_ros_namespace_conventions=bool(item["avoid_ros_namespace_conventions"]),
        )
    except KeyError as error:
        raise QosMetadataError(f"offered_qos_profiles: key {error} is missing") from None


def _policy(name: str, value: object) -> str:
    values = _POLICIES[name]
    if isinstance(value, str) and value in values:
        return value
    if isinstance(value, int) and not isinstance(value, bool) and 0 <= value < len(values):
        return values[value]
    raise QosMetadataError(f"offered_qos_profiles: {name}: expected one of {', '.join(values)} or its number, got {shorten(value)}")


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
