"""Which room may go out next: the grammar node's side of the lock-step, without ROS.

In lock-step the first room goes out when the expected renderers and recorders are ready, the next when all of them have finished or refused
the one before.  Free-running, rooms go out when their time has come.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from scene_synth_ros.status import NodeStatus


@dataclass(frozen=True, slots=True, kw_only=True)
class Expectation:
    """How many peers a run waits for."""

    renderers: int
    recorders: int


def waiting_for(peers: Mapping[str, NodeStatus], expected: Expectation, last_sent: int) -> str:
    """Return what the next room must wait for, in words; empty if it may go out.

    Args:
        peers: newest status by node name.
        expected: how many renderers and recorders the run has.
        last_sent: index of the room that went out last, -1 for none.
    """
    for role, count in (("renderer", expected.renderers), ("recorder", expected.recorders)):
        present = [peer for peer in peers.values() if peer.role == role and peer.state == "ready"]
        if len(present) < count:
            return f"{count - len(present)} of {count} {role}s to be ready"
        late = sorted(peer.node for peer in present if max(peer.done_scene, peer.refused_scene) < last_sent)
        if late:
            return f"{', '.join(late)} to finish room {last_sent}"
    return ""


def complaints(peers: Mapping[str, NodeStatus], last_sent: int) -> list[str]:
    """Return what has gone wrong at the peers, one line each: those that have failed, and those that refused the room sent last."""
    lines = []
    for name in sorted(peers):
        if peers[name].state == "failed":
            lines.append(f"{name} failed: {peers[name].reason}")
        elif 0 <= last_sent == peers[name].refused_scene:
            lines.append(f"{name} refused room {last_sent}: {peers[name].reason}")
    return lines
