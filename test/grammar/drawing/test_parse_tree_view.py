"""The drawing of a parse tree: every node is there once, nothing covers another, SVG that parses."""

from __future__ import annotations

from dataclasses import replace
from itertools import combinations, pairwise
from xml.etree import ElementTree

from sample_scene import sample_scene

from grammar.drawing.parse_tree_view import ROW, parse_tree_view, place_tree
from grammar.drawing.shapes import TEXT_WIDTH, to_svg
from scene_description import ParseGraph, ParseNode, SceneDescription

NODES = (
    ParseNode(symbol="scene", kind="or", choice="bedroom"),
    ParseNode(symbol="room", kind="terminal", parent=0),
    ParseNode(symbol="width_m", kind="attribute", parent=1, choice="3.000 m", log_probability=-0.5),
    ParseNode(symbol="bedroom", kind="and", parent=0),
    ParseNode(symbol="sleeping", kind="or", parent=3, choice="double_sleeping", log_probability=-0.9),
    ParseNode(symbol="bed", kind="terminal", parent=4, choice="bed", object=3),
    ParseNode(symbol="size", kind="attribute", parent=5, choice="2.0 x 1.6 x 1.0 m", log_probability=4.5),
    ParseNode(symbol="bedside", kind="set", parent=3),
    ParseNode(symbol="nightstand", kind="set", parent=7, choice="1", log_probability=-1.2),
    ParseNode(symbol="nightstand", kind="terminal", parent=8, choice="nightstand", object=4),
    ParseNode(symbol="core", kind="address", parent=9, choice="3"),
    ParseNode(symbol="rug", kind="set", parent=7, choice="0", log_probability=-0.4),
)


def scene_of(nodes: tuple[ParseNode, ...] = NODES) -> SceneDescription:
    graph = ParseGraph(nodes=nodes, log_probability=1.5, energies={"overlap": 0.25}, weights={"overlap": 2.0}, energy=0.5)
    return replace(sample_scene(), parse_graph=graph)


def test_nodes_choices_and_probabilities_are_written() -> None:
    texts = [shape.text for shape in parse_tree_view(scene_of()).shapes if shape.kind == "text"]
    for text in (
        "scene = bedroom",
        "room",
        "width 3.000 m",
        "sleeping = double sleeping",
        "ln p −0.90",
        "3 bed",
        "bedside",
        "4 nightstand",
    ):
        assert texts.count(text) == 1, text
    assert {"core → 3 bed", "rug × 0, ln p −0.40", "ln p 4.50", "0.25 × 2 = 0.5"} <= set(texts)


def test_each_kind_of_node_has_its_sign() -> None:
    shapes = parse_tree_view(scene_of()).shapes
    below = [shape for shape in shapes if min(y for _, y in shape.points) > 80.0]  # the legend is above
    circles = [shape for shape in below if shape.kind == "dot" and shape.size in (9.0, 6.0)]
    assert sorted((circle.size, circle.dash is not None) for circle in circles) == [
        (6.0, False),  # the inner circle of the Set
        (9.0, False),  # And
        (9.0, False),  # Set
        (9.0, True),  # the Set's branch that was taken
        (9.0, True),  # Or
        (9.0, True),  # Or, the root
    ]
    assert sum(shape.kind == "area" and len(shape.points) == 4 and bool(shape.stroke) for shape in below) == 3 + 2  # boxes, diamonds


def test_children_stand_right_of_their_parents_and_leaves_in_rows() -> None:
    names, logs = [node.symbol for node in NODES], [""] * len(NODES)
    tree = place_tree(NODES, names, logs, 10.0, 20.0)
    assert set(tree.places) == {0, 1, 3, 4, 5, 7, 8, 9, 11}
    assert [fact for fact, _, _ in tree.places[9].facts] == [10]
    for key, place in tree.places.items():
        if place.parent is not None:
            assert place.x > tree.places[place.parent].x, key
    leaves = sorted(tree.places[key].y for key in (1, 5, 9))
    assert leaves[0] == 20.0 + 0.5 * ROW and all(b - a >= ROW for a, b in pairwise(leaves))
    assert tree.places[7].y == 0.5 * (tree.places[8].y + tree.places[11].y)
    assert tree.places[5].x == tree.places[9].x == tree.terminals_x


def test_an_address_is_joined_to_the_terminal_that_it_points_to() -> None:
    shapes = parse_tree_view(scene_of()).shapes
    tree = place_tree(NODES, [""] * len(NODES), [""] * len(NODES), 24.0, 84.0)
    dotted = [shape for shape in shapes if shape.kind == "line" and shape.dash]
    assert [shape.points[0][1] for shape in dotted] == [tree.places[9].y]
    lane = dotted[0].points[1][0]
    assert any(
        shape.kind == "line" and [y for x, y in shape.points if x == lane] == [tree.places[5].y, tree.places[9].y] for shape in shapes
    )


def test_texts_of_thirty_objects_cover_no_other() -> None:
    nodes = list(NODES[:4])
    for k in range(30):
        nodes.append(ParseNode(symbol=f"unit_{k % 7}", kind="set", parent=3, choice="1", log_probability=-0.5))
        nodes.append(ParseNode(symbol=f"thing_{k}", kind="terminal", parent=len(nodes) - 1, choice="potted_plant", object=100 + k))
        nodes.append(ParseNode(symbol="size", kind="attribute", parent=len(nodes) - 1, choice="0.2 x 0.2 x 0.7 m", log_probability=5.5))
        nodes.append(ParseNode(symbol="core", kind="address", parent=len(nodes) - 2, choice="100", log_probability=-2.0))
    drawing = parse_tree_view(scene_of(tuple(nodes)))
    boxes = []
    for shape in drawing.shapes:
        if shape.kind == "text":
            (x, y), width = shape.points[0], 0.9 * TEXT_WIDTH * shape.size * len(shape.text)
            low = {"start": x, "middle": x - 0.5 * width, "end": x - width}[shape.anchor]
            boxes.append((low, y - 0.4 * shape.size, low + width, y + 0.4 * shape.size, shape.text))
            assert low >= 0.0 and low + width <= drawing.width and y <= drawing.height, shape.text
    for a, b in combinations(boxes, 2):
        assert a[2] <= b[0] or b[2] <= a[0] or a[3] <= b[1] or b[3] <= a[1], (a[4], b[4])


def test_the_svg_parses_and_is_the_same_again() -> None:
    text = to_svg(parse_tree_view(scene_of()))
    root = ElementTree.fromstring(text)
    assert root.tag.endswith("svg") and text == to_svg(parse_tree_view(scene_of()))
    assert "href" not in text and text.count("http") == 1  # the name of SVG itself
