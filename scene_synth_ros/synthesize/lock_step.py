"""Which room may go out next: the grammar node's side of the lock-step, without ROS.

In lock-step the first room goes out when the expected renderers and recorders are ready, the next when all of them have finished or refused
the one before.  Free-running, rooms go out when their time has come.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass

from scene_synth_ros.suite.status import NodeStatus, done_in_run


@dataclass(frozen=True, slots=True, kw_only=True)
class Expectation:
    """How many peers a run waits for."""

    renderers: int
    recorders: int


def waiting_for(peers: Mapping[str, NodeStatus], expected: Expectation, last_sent: int, run: str) -> str:
    """Return what the next room must wait for, in words; empty if it may go out.

    Args:
        peers: newest status by node name.
        expected: how many renderers and recorders the run has.
        last_sent: index of the room that must be finished by all, -1 for none.
        run: name of the run, of which every peer must have heard.
    """
    for role, count in (("renderer", expected.renderers), ("recorder", expected.recorders)):
        present = [peer for peer in peers.values() if peer.role == role and peer.state == "ready"]
        if len(present) < count:
            return f"{count - len(present)} of {count} {role}s to be ready"
        unaware = sorted(peer.node for peer in present if peer.run != run)
        if unaware:
            return f"{', '.join(unaware)} to hear of the run"
        late = sorted(peer.node for peer in present if done_in_run(peer, run) < last_sent)
        if late:
            return f"{', '.join(late)} to finish room {last_sent}"
    return ""


def finished_by_all(peers: Mapping[str, NodeStatus], run: str) -> int:
    """Return the index of the last room of a run that every renderer and recorder has finished or refused, -1 if there is none."""
    return min((done_in_run(peer, run) for peer in peers.values()), default=-1)


def missing_peers(peers: Mapping[str, NodeStatus], present: Collection[str], absences: dict[str, int], patience: int) -> list[str]:
    """Return the peers that were once among the publishers of ``status`` but not for the last ``patience`` looks.

    Args:
        peers: newest status by node name.
        present: fully qualified names of the nodes that publish ``status`` now.
        absences: looks in a row that each peer was missing; brought up to date.
        patience: discovery may be slower than the first status, and nodes start again.
    """
    for name in [name for name in absences if name not in peers]:
        del absences[name]
    for name in peers:
        if name in present or name in absences:
            absences[name] = 0 if name in present else absences[name] + 1
    return sorted(name for name, count in absences.items() if count >= patience)


def peer_failures(peers: Mapping[str, NodeStatus], last_sent: int, run: str) -> list[str]:
    """Return what has gone wrong at the peers, one line each: those that have failed, and those that refused the run's room sent last."""
    lines = []
    for name in sorted(peers):
        if peers[name].state == "failed":
            lines.append(f"{name} failed: {peers[name].reason}")
        elif 0 <= last_sent == peers[name].refused_scene and peers[name].run == run:
            lines.append(f"{name} refused room {last_sent}: {peers[name].reason}")
    return lines
