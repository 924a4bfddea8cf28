"""What the nodes of a run tell each other on the latched topic ``status``: who they are, and which rooms they have finished.

A status is cumulative, so the newest message of a node says everything; losing an older one loses nothing.  It travels as JSON in a
std_msgs/String and is read as strictly as a scene, because any peer can send one.
"""

import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Annotated, Literal

from scene_description.strict import Limits, from_json, to_mapping

MAX_TEXT_LENGTH, MAX_TOPICS = 2_000_000, 10_000
NodeState = Literal["starting", "ready", "failed", "finished"]


@dataclass(frozen=True, slots=True, kw_only=True)
class NodeStatus:
    """Where a node of the run stands.

    ``node`` is its fully qualified name.  ``state``: starting, ready (may be sent rooms), failed (``reason`` says why), finished (the
    grammar node has sent its last room and every peer has finished it).  ``done_scene`` is the index of the last room that the node has
    finished, -1 for none (of the grammar node: that all renderers and recorders have finished); ``refused_scene`` of the last one that a
    renderer could not render, with the ``reason``; ``begun_scene`` of the last one whose first frame a renderer has.  ``counts`` are the
    messages by topic, since its start, that a renderer has published or a recorder has taken of renderers' topics; -1 marks a topic that a
    recorder leaves out on purpose.  ``start`` names one life of a renderer: the identity (GID, hexadecimal) of its first publisher, a new
    one whenever it starts; ``connected`` are the starts whose every topic reaches a recorder, or is left out by it.  ``lock_step``: the
    grammar node waits for its peers, so no room may be left out.
    ``clock``: what the stamps of the grammar node's rooms follow.

    ``until_ns``: of a run whose frames are held, the stamp of the last frame that may go out; -1 lets all out.  ``shown_ns`` is the stamp
    of the last frame of a path that a renderer has published in this run, told when it holds frames back and when a room is finished.

    ``token`` is that of the command or launch that has started the node; empty where it was started by itself.

    ``run`` names the run that the indices of rooms belong to.  The grammar node gives a new name whenever a run begins, the others repeat
    the newest that they have heard; what a status with another name says of rooms counts for nothing.
    """

    node: Annotated[str, Limits(min_length=1, max_length=300)]
    role: Literal["grammar", "renderer", "recorder"]
    state: NodeState
    done_scene: Annotated[int, Limits(ge=-1, le=2**62)] = -1
    refused_scene: Annotated[int, Limits(ge=-1, le=2**62)] = -1
    begun_scene: Annotated[int, Limits(ge=-1, le=2**62)] = -1
    reason: Annotated[str, Limits(max_length=1000)] = ""
    counts: Annotated[Mapping[str, int], Limits(max_length=MAX_TOPICS)] = field(default_factory=dict)
    start: Annotated[str, Limits(max_length=64)] = ""
    connected: Annotated[tuple[Annotated[str, Limits(max_length=64)], ...], Limits(max_length=500)] = ()
    lock_step: bool = False
    clock: Literal["simulated", "wall"] = "simulated"
    until_ns: Annotated[int, Limits(ge=-1, le=2**62)] = -1
    shown_ns: Annotated[int, Limits(ge=-1, le=2**62)] = -1
    run: Annotated[str, Limits(max_length=64)] = ""
    token: Annotated[str, Limits(max_length=64)] = ""


def done_in_run(status: NodeStatus, run: str) -> int:
    """Return the index of the last room of a run that a node has finished or refused, -1 if there is none."""
    return max(status.done_scene, status.refused_scene) if status.run == run else -1


def begun_in_run(status: NodeStatus, run: str) -> int:
    """Return the index of the last room of a run that a renderer has begun, finished or refused, -1 if there is none."""
    return max(status.begun_scene, done_in_run(status, run)) if status.run == run else -1


def status_to_json(status: NodeStatus) -> str:
    """Return the JSON text of a status."""
    return json.dumps(to_mapping(status), separators=(",", ":"))


def status_from_json(text: str) -> NodeStatus:
    """Read a status.

    Raises:
        FieldError: the text is no JSON of a status; one line with the field's path.
    """
    return from_json(NodeStatus, text, "status", MAX_TEXT_LENGTH)
