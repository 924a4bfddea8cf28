"""Places for the nodes of a parse tree that is drawn from left to right: columns by depth, one row for each leaf, terminals in one column.

Attributes and addresses take no place of their own: they are *facts* that stand in lines to the right of their terminal.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

from grammar.drawing.shapes import TEXT_WIDTH
from scene_description import ParseNode

ROW, PALE_ROW, LINE = 30.0, 16.0, 17.0
"""Height of a terminal's first line, of a branch that was not taken, of a terminal's further lines of facts; pixels."""
FONT, SMALL, RADIUS = 12.0, 10.0, 9.0
INDENT, COLUMN_GAP, FACT_GAP, FACTS_WIDTH = 26.0, 26.0, 16.0, 540.0
FACT_MARK = 13.0
"""Width of the sign before a fact."""


@dataclass(slots=True, kw_only=True)
class Place:
    """Where a node stands: its middle (a terminal's left end) in pixels, its depth among the drawn nodes, and the nodes that hang on it.

    ``facts``: attributes and addresses, with the x and y at which each begins.
    """

    node: int
    depth: int
    parent: int | None
    x: float = 0.0
    y: float = 0.0
    children: list[int] = field(default_factory=list)
    facts: list[tuple[int, float, float]] = field(default_factory=list)


@dataclass(frozen=True, slots=True, kw_only=True)
class TreeLayout:
    """Places by node, ``columns`` by depth, where terminals and their facts begin, and where all ends; pixels."""

    places: dict[int, Place]
    columns: tuple[float, ...]
    terminals_x: float
    facts_x: float
    right: float
    bottom: float


def text_width(text: str, size: float) -> float:
    """Return about how wide a text is, in pixels."""
    return TEXT_WIDTH * size * len(text)


def is_empty(node: ParseNode) -> bool:
    """Return whether a node is a Set's branch of which there is no copy."""
    return node.kind == "set" and node.choice == "0"


def place_tree(nodes: Sequence[ParseNode], names: Sequence[str], logs: Sequence[str], left: float, top: float) -> TreeLayout:
    """Return the layout.

    Args:
        nodes: of the parse graph, parents before children.
        names: what is written at each node.
        logs: its log-probability, as it is written; empty for none.
        left: pixels, where the tree begins.
        top: the same.
    """
    places = _hang(nodes)
    columns = _columns(nodes, names, places, left)
    terminals = [key for key in places if nodes[key].kind == "terminal"]
    terminals_x = columns[-1]
    levels = {key: _terminals_above(nodes, places, key) for key in terminals}
    boxes = (terminals_x + INDENT * levels[key] + box_width(names[key]) for key in terminals)
    facts_x = max(boxes, default=terminals_x) + FACT_GAP
    right, y = facts_x, top
    for key, place in places.items():  # parents before children: rows from top to bottom
        node = nodes[key]
        if node.kind == "terminal":
            place.x, place.y = terminals_x + INDENT * levels[key], y + 0.5 * ROW
            end = _place_facts(place, nodes, names, logs, facts_x)
            right, y = max(right, end[0]), y + ROW + end[1] * LINE
            continue
        place.x = columns[place.depth]
        if not place.children:
            height = PALE_ROW if is_empty(node) else ROW
            place.y, y = y + 0.5 * height, y + height
    for place in reversed(places.values()):
        if place.children and nodes[place.node].kind != "terminal":
            place.y = 0.5 * (places[place.children[0]].y + places[place.children[-1]].y)
    return TreeLayout(places=places, columns=tuple(columns), terminals_x=terminals_x, facts_x=facts_x, right=right, bottom=y)


def box_width(name: str) -> float:
    """Return how wide a terminal's box is, in pixels."""
    return text_width(name, FONT) + 20.0


def fact_width(name: str, log: str) -> float:
    """Return how wide a fact is, in pixels, with its sign and the gap after it."""
    return FACT_MARK + text_width(name, SMALL + 1.0) + text_width(f" {log}", SMALL) + FACT_GAP


def _hang(nodes: Sequence[ParseNode]) -> dict[int, Place]:
    """Return a place for every node that has one, in depth-first order, facts with their owners."""
    places: dict[int, Place] = {}
    for key, node in enumerate(nodes):
        above = node.parent if node.parent in places else None
        if node.kind in ("attribute", "address") and above is not None:
            places[above].facts.append((key, 0.0, 0.0))
            continue
        places[key] = Place(node=key, depth=0 if above is None else places[above].depth + 1, parent=above)
        if above is not None:
            places[above].children.append(key)
    return places


def _columns(nodes: Sequence[ParseNode], names: Sequence[str], places: dict[int, Place], left: float) -> list[float]:
    """Return x of the nodes by depth, and x of the terminals as the last."""
    widest: dict[int, float] = {}
    for key, place in places.items():
        if nodes[key].kind != "terminal":
            pale = is_empty(nodes[key])
            width = text_width(names[key], SMALL if pale else FONT)
            # what was not taken has nothing to its right but its own probability
            widest[place.depth] = max(widest.get(place.depth, 0.0), 0.0 if pale else width)
    columns = [left + RADIUS]
    for depth in range(max(widest, default=-1) + 1):
        columns.append(columns[-1] + 2.0 * RADIUS + widest.get(depth, 0.0) + COLUMN_GAP)
    return columns


def _terminals_above(nodes: Sequence[ParseNode], places: dict[int, Place], key: int) -> int:
    above, count = places[key].parent, 0
    while above is not None:
        count += nodes[above].kind == "terminal"
        above = places[above].parent
    return count


def _place_facts(place: Place, nodes: Sequence[ParseNode], names: Sequence[str], logs: Sequence[str], left: float) -> tuple[float, int]:
    """Give the facts of a terminal their places; return where the longest line ends, and how many lines there are after the first."""
    x, line, right = left, 0, left
    for i, (key, _, _) in enumerate(place.facts):
        width = fact_width(names[key], logs[key])
        if x > left and x + width - left > FACTS_WIDTH:
            x, line = left, line + 1
        place.facts[i] = (key, x, place.y + line * LINE)
        x += width
        right = max(right, x)
    return right, line
