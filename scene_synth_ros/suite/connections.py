"""Which renderers a recorder is connected to: a renderer that starts again must wait anew, or its first messages are lost."""

import uuid
from collections.abc import Callable, Iterable, Mapping
from typing import Any, NamedTuple

from scene_synth_ros.suite.status import NodeStatus

NAME_NOT_YET_KNOWN = "_NODE_NAME_UNKNOWN_"
"""What rclpy calls the node of a publisher while only the publisher has been heard of."""
PARTICIPANT_DIGITS = 24
"""Hexadecimal digits of a GID that name its process: the GUID prefix of DDS, 12 bytes."""


class Endpoint(NamedTuple):
    """A publisher of a topic: the fully qualified name of its node, and its GID (hexadecimal)."""

    node: str
    gid: str

    @property
    def is_named(self) -> bool:
        """Whether the name of its node is known by now."""
        return not self.node.endswith(NAME_NOT_YET_KNOWN)


def publishers_of(node: Any, topic: str) -> list[Endpoint]:
    """Return the publishers of a topic, by its full name, that a node knows now."""
    return [
        Endpoint(f"{info.node_namespace.rstrip('/')}/{info.node_name}", bytes(info.endpoint_gid).hex())
        for info in node.get_publishers_info_by_topic(topic)
    ]


def identity_of(node: Any, publisher: Any) -> str:
    """Return the identity (GID, hexadecimal) of a node's publisher; no other publisher has had it before."""
    own = node.get_fully_qualified_name()
    gids = [endpoint.gid for endpoint in publishers_of(node, publisher.topic_name) if endpoint.node == own]
    if len(gids) == 1:
        return gids[0]
    probe = node.create_publisher(publisher.msg_type, f"~/probe_{uuid.uuid4().hex}", 1)  # a namesake has none
    (mine,) = publishers_of(node, probe.topic_name)
    node.destroy_publisher(probe)
    return next(gid for gid in gids if gid.startswith(mine.gid[:PARTICIPANT_DIGITS]))


class Connections:
    """Starts of renderers all of whose topics have reached the recorder; no clocks, no threads.

    A reader is matched a moment after its writer is known, so a start counts as connected when it is found whole at two looks in a row, and
    anew when it publishes other topics.
    """

    def __init__(self, publishers_of: Callable[[str], Iterable[Endpoint]]) -> None:
        self._publishers_of = publishers_of
        self._renderers: dict[str, NodeStatus] = {}
        self._whole_before: dict[str, frozenset[str]] = {}
        self._connected: dict[str, frozenset[str]] = {}

    def take_status(self, status: NodeStatus) -> None:
        """Take the newest status of a renderer."""
        self._renderers[status.node] = status

    def look(self, known: Mapping[str, int]) -> tuple[str, ...]:
        """Look once more; return the starts that are connected.

        Args:
            known: the topics that the recorder has considered; values below 0 mark those that it leaves out.
        """
        topics = {status.start: frozenset(status.counts) for status in self._renderers.values() if status.start}
        starts = {status.start: status for status in self._renderers.values() if status.start}
        whole = {
            start: topics[start]
            for start, status in starts.items()
            if self._connected.get(start) == topics[start] or self._is_whole(status, known)
        }
        self._connected = {start: of_start for start, of_start in whole.items() if self._whole_before.get(start) == of_start}
        self._whole_before = whole
        return tuple(sorted(self._connected))

    def _is_whole(self, status: NodeStatus, known: Mapping[str, int]) -> bool:
        process = status.start[:PARTICIPANT_DIGITS]
        return all(
            known.get(topic, 0) < 0
            or (topic in known and any(it.node == status.node and it.gid.startswith(process) for it in self._publishers_of(topic)))
            for topic in status.counts
        )
