"""Top views: well-formed SVG with every item where it stands."""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import combinations
from xml.etree import ElementTree

import pytest
from sample_scene import sample_objects, sample_room, sample_scene

from grammar.drawing.shapes import to_svg
from grammar.drawing.top_view import fill_color, top_view
from grammar.drawing.top_view_plan import PIXELS_PER_METRE, label_objects
from scene_description import NYU40, SceneDescription

SVG = "{http://www.w3.org/2000/svg}"


def drawing(scene: SceneDescription) -> ElementTree.Element:
    return ElementTree.fromstring(to_svg(top_view(scene)))


def corners(element: ElementTree.Element) -> list[tuple[float, float]]:
    return [(float(x), float(y)) for x, y in (pair.split(",") for pair in element.attrib["points"].split())]


def polygons(scene: SceneDescription, color: str) -> list[list[tuple[float, float]]]:
    return [corners(item) for item in drawing(scene).iter(f"{SVG}polygon") if item.attrib["fill"] == color]


def color_of(label: int) -> str:
    return "#" + "".join(f"{c:02x}" for c in NYU40[label].color)


def test_furniture_stands_in_the_room_to_scale_with_north_up() -> None:
    (floor,) = polygons(sample_scene(), "#f4f0e8")
    (bed,) = polygons(sample_scene(), color_of(sample_objects()[0].label))
    left, bottom = floor[0]
    expected = [(2.15, 2.6), (0.05, 2.6), (0.05, 1.0), (2.15, 1.0)]
    in_metres = [((x - left) / PIXELS_PER_METRE, (bottom - y) / PIXELS_PER_METRE) for x, y in bed]
    for point, wanted in zip(in_metres, expected, strict=True):
        assert point == pytest.approx(wanted, abs=2e-4)
    assert floor[2][1] < floor[0][1], "y grows upwards"


def test_a_turned_object_is_turned_counter_clockwise() -> None:
    scene = sample_scene()
    bed = replace(scene.objects[0], yaw_rad=math.pi / 2)
    (drawn,) = polygons(replace(scene, objects=(bed,), lights=()), color_of(bed.label))
    (floor,) = polygons(scene, "#f4f0e8")
    front_left = ((drawn[0][0] - floor[0][0]) / PIXELS_PER_METRE, (floor[0][1] - drawn[0][1]) / PIXELS_PER_METRE)
    assert front_left == pytest.approx((1.1 - 0.8, 1.8 + 1.05), abs=2e-4)


def test_walls_surround_the_floor_by_their_thickness() -> None:
    (walls,), (floor,) = (polygons(sample_scene(), color) for color in ("#6b6b6b", "#f4f0e8"))
    t = sample_room().wall_thickness_m * PIXELS_PER_METRE
    signs = [(-1, 1), (1, 1), (1, -1), (-1, -1)]
    for outer, inner, (sx, sy) in zip(walls, floor, signs, strict=True):
        assert outer == pytest.approx((inner[0] + sx * t, inner[1] + sy * t), abs=0.02)


@pytest.mark.parametrize(
    ("hinge", "swing", "hinge_at", "leaf_end"),
    [
        ("end", "in", (3.7, 0.0), (3.7, 0.9)),
        ("start", "in", (2.8, 0.0), (2.8, 0.9)),
        ("start", "out", (2.8, -0.15), (2.8, -1.05)),
    ],
)
def test_a_door_swings_about_its_hinge(hinge: str, swing: str, hinge_at: tuple[float, float], leaf_end: tuple[float, float]) -> None:
    scene = sample_scene()
    door = replace(scene.room.openings[0], hinge=hinge, swing=swing)
    scene = replace(scene, room=replace(scene.room, openings=(door,)))
    (floor,) = polygons(scene, "#f4f0e8")
    leaf = next(item for item in drawing(scene).iter(f"{SVG}polyline") if item.attrib["stroke-width"] == "3")
    in_metres = [((x - floor[0][0]) / PIXELS_PER_METRE, (floor[0][1] - y) / PIXELS_PER_METRE) for x, y in corners(leaf)]
    assert in_metres[0] == pytest.approx(hinge_at, abs=2e-4)
    assert in_metres[1] == pytest.approx(leaf_end, abs=2e-4)


def test_every_object_has_its_name_or_a_number_that_the_legend_explains() -> None:
    scene = sample_scene()
    texts = [item.text for item in drawing(scene).iter(f"{SVG}text")]
    assert "bedroom 0, seed 7: 4 objects, valid" in texts and "1 m" in texts and "bed: nightstand" in texts
    for item in scene.objects:
        name = item.category.replace("_", " ")
        assert texts.count(name) == 1 or (str(item.id) in texts and f"{item.id} {name}" in texts)


def test_labels_cover_no_other_label_where_there_is_room() -> None:
    items = [replace(sample_objects()[0], id=k, position_m=(2.5 * k, 0.0, 0.0), size_m=(2.0, 2.0, 0.5), yaw_rad=0.3 * k) for k in range(4)]
    items += [
        replace(item, id=10 + k, category="mug", size_m=(0.1, 0.1, 0.1), position_m=(2.5 * k, 0.0, 0.5)) for k, item in enumerate(items)
    ]
    outline = {
        item.id: [(120 * (item.position_m[0] + u * item.size_m[0]), 120 * (item.position_m[1] + v * item.size_m[1]))
                   for u, v in ((0.5, 0.5), (-0.5, 0.5), (-0.5, -0.5), (0.5, -0.5))]
        for item in items
    }  # fmt: skip
    labels = label_objects(items, outline)
    assert [label.object_id for label in labels] == [item.id for item in items]
    assert [label.text for label in labels] == ["bed"] * 4 + ["10", "11", "12", "13"]
    boxes = [
        (x - 0.28 * label.size * len(label.text), y - 0.5 * label.size, x + 0.28 * label.size * len(label.text), y + 0.5 * label.size)
        for label in labels
        for x, y in (label.point,)
    ]
    for a, b in combinations(boxes, 2):
        assert min(a[2], b[2]) <= max(a[0], b[0]) or min(a[3], b[3]) <= max(a[1], b[1])


def test_what_stands_on_something_is_paler_and_painted_after_it() -> None:
    scene = sample_scene()
    fills = [item.attrib["fill"] for item in drawing(scene).iter(f"{SVG}polygon")]
    stand, lamp = (next(item for item in scene.objects if item.category == name) for name in ("nightstand", "table_lamp"))
    assert fill_color(stand) == color_of(stand.label)
    pale = [int(fill_color(lamp)[k : k + 2], 16) for k in (1, 3, 5)]
    assert pale == [pytest.approx(0.5 * (c + 255), abs=0.5) for c in NYU40[lamp.label].color]
    assert fills.index(fill_color(lamp)) > fills.index(color_of(stand.label))


def test_the_sheet_holds_a_door_that_opens_outwards() -> None:
    scene = sample_scene()
    door = replace(scene.room.openings[0], swing="out")
    sheet = top_view(replace(scene, room=replace(scene.room, openings=(door,))))
    for shape in sheet.shapes:
        assert all(0.0 <= x <= sheet.width and 0.0 <= y <= sheet.height for x, y in shape.points)


def test_an_invalid_room_says_so() -> None:
    scene = sample_scene()
    broken = replace(scene, validity=replace(scene.validity, valid=False))
    assert "4 objects, NOT VALID" in to_svg(top_view(broken))


def test_text_is_escaped() -> None:
    scene = sample_scene()
    hostile = '<script>"&amp;'
    scene = replace(scene, category=hostile, objects=(replace(scene.objects[0], category=hostile),), lights=())
    texts = [item.text for item in drawing(scene).iter(f"{SVG}text")]
    assert hostile in texts and any(text.startswith(f"{hostile} 0, seed") for text in texts if text)


def test_camera_path_starts_at_the_full_dot() -> None:
    scene = sample_scene()
    circles = [item for item in drawing(scene).iter(f"{SVG}circle") if item.attrib["r"] == "5"]  # a smaller one is in the legend
    (floor,) = polygons(scene, "#f4f0e8")
    start = circles[-1].attrib
    assert start["fill"] != "#ffffff"
    assert float(start["cx"]) == pytest.approx(floor[0][0] + 3.5 * PIXELS_PER_METRE, abs=0.02)
    assert float(start["cy"]) == pytest.approx(floor[0][1] - 0.6 * PIXELS_PER_METRE, abs=0.02)


def test_the_same_scene_gives_the_same_text() -> None:
    assert to_svg(top_view(sample_scene())) == to_svg(top_view(sample_scene()))
