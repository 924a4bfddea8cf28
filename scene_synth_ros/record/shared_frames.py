"""Which topics of several renderers stand for each other, because a frame comes from one of them only."""

from __future__ import annotations

from collections.abc import Collection, Mapping


def stand_ins(topics: Mapping[str, Collection[str]]) -> dict[str, str]:
    """Return topic -> the topic that stands for it, for those that renderers publish under their own names.

    Renderers that publish the same topics otherwise share the rooms of one camera: a frame has what one of them says of it.  Renderers of
    several cameras, or of several layers of one camera, publish every frame together, and each topic stands for itself.

    Args:
        topics: fully qualified name of a renderer -> the topics of its frames.
    """
    sharing: dict[frozenset[str], list[str]] = {}
    for node in sorted(topics):
        sharing.setdefault(frozenset(topic for topic in topics[node] if not topic.startswith(f"{node}/")), []).append(node)
    return {
        topic: f"{nodes[0]}/{topic.removeprefix(f'{node}/')}"
        for nodes in sharing.values()
        for node in nodes
        for topic in sorted(topics[node])
        if topic.startswith(f"{node}/")
    }
