"""The parse tree of a room as a drawing, with the rules chosen, their log-probabilities, and the terms of the layout's energy.

The kinds of nodes are those of Jiang et al., IJCV 2018, section 2: And nodes are drawn as circles, Or nodes as dashed circles, Set nodes as
double circles, terminals as boxes, addresses as triangles, attributes as diamonds.  A branch of a Set chooses its number of copies: it is
an Or node with that number in it.  The tree grows from left to right, so that thirty objects stay legible: columns by
depth, one row for each leaf, terminals in one column.  Attributes and addresses take no place of their own: they are *facts* that stand in
lines to the right of their terminal.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from grammar.drawing.shapes import TEXT_WIDTH, Drawing, Point, Shape, area, dot, line, words
from scene_description import ParseGraph, ParseNode, SceneDescription

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
    """Return the places of nodes, parents before children, with what is written at each and its log-probability (empty for none).

    ``left``, ``top``: where the tree begins, pixels.
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


INK, GREY, PALE = "#222222", "#6a6a6a", "#9a9a9a"
LINK = "#9aa0a6"
AND, OR, SET, TERMINAL, ADDRESS, ATTRIBUTE = "#dbe9f6", "#fdf1d6", "#e3f2dd", "#ffffff", "#c0392b", "#7d6608"
LANE_COLORS = ("#c0392b", "#1f6fb4", "#2a8f45", "#8e44ad", "#d2791a", "#0f8b8d", "#b5338a", "#6b6f1d")
LANE = 11.0
BORDER, TITLE = 24.0, 84.0
_DASH = (3.5, 2.5)


def parse_tree_view(scene: SceneDescription) -> Drawing:
    """Return the drawing of a scene's parse graph."""
    graph = scene.parse_graph
    categories = {thing.id: thing.category for thing in scene.objects}
    categories |= {opening.id: opening.category for opening in scene.room.openings}
    names = [_name(node, categories) for node in graph.nodes]
    logs = [_log(node) for node in graph.nodes]
    tree = place_tree(graph.nodes, names, logs, BORDER, TITLE)
    shapes: list[Shape] = []
    right = _draw_addresses(shapes, graph.nodes, tree, names, logs)
    for key in tree.places:
        _draw_links(shapes, graph.nodes, tree, key)
    for key in tree.places:
        _draw_node(shapes, graph.nodes, tree, key, names, logs)
    width = max(right + BORDER, 1000.0)
    bottom = _draw_energies(shapes, graph, tree.bottom + 40.0, width)
    return Drawing(width=width, height=bottom + BORDER, shapes=(*_header(scene), *shapes))


def _spaced(text: str) -> str:
    return text.replace("_", " ")


def _name(node: ParseNode, categories: Mapping[int, str]) -> str:
    """Return what is written at a node: its symbol and what was chosen."""
    symbol, choice = _spaced(node.symbol), _spaced(node.choice)
    if node.kind == "terminal":
        own = "" if choice in ("", symbol) else f" ({symbol})"
        return f"{choice or symbol}{own}" if node.object is None else f"{node.object} {choice or symbol}{own}"
    if node.kind == "address":
        target = categories.get(int(choice), "") if choice.isdecimal() else ""
        return f"{symbol} → {choice} {_spaced(target)}".rstrip()
    if node.kind == "attribute":
        return f"{symbol.removesuffix(' m')} {choice}"
    if node.kind == "or" and choice:
        return f"{symbol} = {choice}"
    return symbol


def _log(node: ParseNode) -> str:
    """Return a node's log-probability as it is written; And nodes, and what is certain, have none."""
    return "" if node.log_probability == 0.0 else f"ln p {node.log_probability:.2f}".replace("-", "−")


def _draw_links(shapes: list[Shape], nodes: Sequence[ParseNode], tree: TreeLayout, key: int) -> None:
    """Draw the lines from a node to the nodes that hang on it."""
    place = tree.places[key]
    if not place.children:
        return
    ends = [tree.places[child] for child in place.children]
    if nodes[key].kind == "terminal":  # what is within the room: from its box downwards
        x = place.x + 10.0
        shapes.append(line([(x, place.y + 10.0), (x, ends[-1].y)], LINK, 1.2))
        shapes.extend(line([(x, end.y), (end.x, end.y)], LINK, 1.2) for end in ends)
        return
    x = tree.columns[place.depth + 1] - RADIUS - 0.5 * COLUMN_GAP + 4.0
    ys = [place.y, *(end.y for end in ends)]
    shapes.append(line([(place.x + RADIUS, place.y), (x, place.y)], LINK, 1.2))
    if max(ys) > min(ys):
        shapes.append(line([(x, min(ys)), (x, max(ys))], LINK, 1.2))
    for child, end in zip(place.children, ends, strict=True):
        pale = is_empty(nodes[child])
        stop = end.x - (5.0 if pale else 0.0 if nodes[child].kind == "terminal" else RADIUS)
        shapes.append(line([(x, end.y), (stop, end.y)], "#d5d8dc" if pale else LINK, 1.2))


def _draw_node(
    shapes: list[Shape], nodes: Sequence[ParseNode], tree: TreeLayout, key: int, names: Sequence[str], logs: Sequence[str]
) -> None:
    """Draw a node with its name, its log-probability, and its facts."""
    node, place = nodes[key], tree.places[key]
    if is_empty(node):
        shapes.append(_circle((place.x, place.y), 5.0, "#ffffff", PALE, dashed=True))
        text = ", ".join(filter(None, (f"{names[key]} × 0", logs[key])))
        shapes.append(words((place.x + 10.0, place.y), text, SMALL, fill=PALE, anchor="start"))
        return
    if node.kind == "terminal":
        shapes.append(_box((place.x, place.y - 10.0), box_width(names[key]), 20.0))
        shapes.append(words((place.x + 7.0, place.y), names[key], FONT, fill=INK, anchor="start"))
    else:
        shapes.extend(_sign(node.kind, (place.x, place.y), node.choice))
        x = place.x + RADIUS + 4.0
        shapes.append(words((x, place.y - 7.0), names[key], FONT, fill=INK, anchor="start", halo=True))
        if logs[key]:
            shapes.append(words((x, place.y + 8.0), logs[key], SMALL, fill=GREY, anchor="start", halo=True))
    for fact, x, y in place.facts:
        shapes.extend(_sign(nodes[fact].kind, (x + 4.0, y), ""))
        ink = ADDRESS if nodes[fact].kind == "address" else INK
        shapes.append(words((x + FACT_MARK, y), names[fact], SMALL + 1.0, fill=ink, anchor="start"))
        beside = x + FACT_MARK + text_width(f"{names[fact]} ", SMALL + 1.0)
        if logs[fact]:
            shapes.append(words((beside, y), logs[fact], SMALL, fill=GREY, anchor="start"))


def _sign(kind: str, middle: Point, choice: str) -> list[Shape]:
    """Return the sign of a kind of node; a Set's branch has its number of copies in it."""
    x, y = middle
    if kind == "attribute":
        return [area([(x - 4.5, y), (x, y - 4.5), (x + 4.5, y), (x, y + 4.5)], "#f4e7b8", stroke=ATTRIBUTE)]
    if kind == "address":
        return [area([(x - 3.5, y - 5.0), (x + 5.0, y), (x - 3.5, y + 5.0)], "#f6d5d1", stroke=ADDRESS)]
    if kind == "set" and choice:
        return [_circle(middle, RADIUS, OR, INK, dashed=True), words(middle, choice, SMALL, fill=INK)]
    if kind == "set":
        return [_circle(middle, RADIUS, SET, INK), _circle(middle, RADIUS - 3.0, SET, INK)]
    return [_circle(middle, RADIUS, AND if kind == "and" else OR, INK, dashed=kind == "or")]


def _circle(middle: Point, radius: float, fill: str, stroke: str, *, dashed: bool = False) -> Shape:
    return Shape(kind="dot", points=(middle,), size=radius, fill=fill, stroke=stroke, width=1.2, dash=_DASH if dashed else None)


def _box(corner: Point, width: float, height: float) -> Shape:
    x, y = corner
    return area([(x, y), (x + width, y), (x + width, y + height), (x, y + height)], TERMINAL, stroke=INK, width=1.2)


def _draw_addresses(shapes: list[Shape], nodes: Sequence[ParseNode], tree: TreeLayout, names: Sequence[str], logs: Sequence[str]) -> float:
    """Draw a line from each address to the terminal that it points to, in lanes right of all text; return where the lanes end."""
    rows = {nodes[key].object: place for key, place in tree.places.items() if nodes[key].kind == "terminal"}
    pointing: dict[int, list[tuple[float, float]]] = {}
    line_ends: dict[float, float] = {}
    for place in tree.places.values():
        for fact, x, y in place.facts:
            line_ends[y] = max(line_ends.get(y, 0.0), x + fact_width(names[fact], logs[fact]))
    for place in tree.places.values():
        for fact, _, y in place.facts:
            choice = nodes[fact].choice
            if nodes[fact].kind == "address" and choice.isdecimal() and int(choice) in rows:
                pointing.setdefault(int(choice), []).append((line_ends[y] - 8.0, y))
    sources = {y for ends in pointing.values() for _, y in ends}
    taken: list[list[tuple[float, float]]] = []
    for number, target in enumerate(sorted(pointing, key=lambda key: rows[key].y)):
        row = rows[target].y
        y = row - 5.0 if row in sources else row  # beside the line that begins in this row
        ys = [y, *(start_y for _, start_y in pointing[target])]
        span = (min(ys) - 4.0, max(ys) + 4.0)
        lane = next((k for k, spans in enumerate(taken) if all(span[1] < low or span[0] > high for low, high in spans)), len(taken))
        if lane == len(taken):
            taken.append([])
        taken[lane].append(span)
        x, color = tree.right + LANE * (lane + 1), LANE_COLORS[number % len(LANE_COLORS)]
        end = line_ends.get(row, tree.facts_x) - 6.0
        shapes.append(line([(x, min(ys)), (x, max(ys))], color, 1.3))
        shapes.append(line([(end + 6.0, y), (x, y)], color, 1.3))
        shapes.append(area([(end, y), (end + 7.0, y - 4.0), (end + 7.0, y + 4.0)], color))
        for start, start_y in pointing[target]:
            shapes.append(line([(start, start_y), (x, start_y)], color, 1.0, (2.0, 3.0)))
            shapes.append(dot((x, start_y), 2.4, color))
    return tree.right + LANE * (len(taken) + 1)


def _header(scene: SceneDescription) -> list[Shape]:
    graph = scene.parse_graph
    title = f"Parse tree of {scene.id}: {_spaced(scene.category)}, {len(scene.objects)} objects"
    sums = f"ln p of all choices {graph.log_probability:.2f} (densities of sizes and places among them), layout energy {graph.energy:.2f}"
    shapes = [
        words((BORDER, 22.0), title, 16.0, fill=INK, anchor="start"),
        words((BORDER, 42.0), sums.replace("-", "−"), FONT, fill=GREY, anchor="start"),
    ]
    x = BORDER + RADIUS
    for kind, choice, text in (
        ("and", "", "And: all branches"),
        ("or", "", "Or: one branch"),
        ("set", "", "Set"),
        ("set", "2", "Set's branch: number of copies"),
        ("address", "", "address: points to a terminal"),
        ("attribute", "", "attribute"),
    ):
        shapes.extend(_sign(kind, (x, 64.0), choice))
        shapes.append(words((x + 14.0, 64.0), text, SMALL + 1.0, fill=INK, anchor="start"))
        x += 14.0 + text_width(text, SMALL + 1.0) + 30.0
    shapes.append(_box((x - RADIUS, 55.0), 18.0, 18.0))
    shapes.append(words((x + 14.0, 64.0), "terminal", SMALL + 1.0, fill=INK, anchor="start"))
    return shapes


def _draw_energies(shapes: list[Shape], graph: ParseGraph, top: float, width: float) -> float:
    """Draw the terms of the layout's energy in columns below the tree; return where they end."""
    shapes.append(line([(BORDER, top - 18.0), (width - BORDER, top - 18.0)], "#d5d8dc", 1.0))
    head = "Layout energy: loss of each relation × its weight"
    shapes.append(words((BORDER, top), head, FONT, fill=INK, anchor="start"))
    terms = [(name, loss, graph.weights.get(name, 0.0)) for name, loss in graph.energies.items()]
    columns = max(1, int((width - 2.0 * BORDER) // 320.0))
    rows = -(-len(terms) // columns)
    for i, (name, loss, weight) in enumerate(terms):
        x, y = BORDER + 320.0 * (i // rows), top + 20.0 + 16.0 * (i % rows)
        shapes.append(words((x, y), _spaced(name), SMALL + 1.0, fill=INK, anchor="start"))
        value = f"{loss:.4g} × {weight:.4g} = {loss * weight:.3g}"
        shapes.append(words((x + 290.0, y), value, SMALL + 1.0, fill=GREY, anchor="end"))
    return top + 20.0 + 16.0 * max(rows, 1)
