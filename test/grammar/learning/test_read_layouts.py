"""Layout files: conventions, and everything that does not fit is counted with its line."""

import json
import math
from dataclasses import replace
from pathlib import Path

import pytest
from python_calls import counted_calls

from grammar.learning import read_category_map, read_layouts
from grammar.learning.observed import ObservedObject, ObservedRoom, fitting_wall, nearest_wall
from grammar.learning.read_layouts import house_of
from grammar.learning.write_layouts import layout_line
from grammar.spec.rules import GrammarError
from scene_description.polygons import signed_area_m2
from scene_description.share import config_path

NAMES = read_category_map(config_path("learning/category_map.yaml"))
SQUARE = [[0, 0], [4, 0], [4, 3], [0, 3]]
BED = {"cat": "bed", "raw": "Bed", "pos": [1.0, 1.1, 0.5], "size": [1.4, 2.0, 1.0], "yaw": math.pi}


def line(**changes: object) -> str:
    room = {"id": "house1-0-Bedroom", "room_type": "bedroom", "polygon": SQUARE, "height": 2.5, "objects": [BED]}
    return json.dumps(room | changes)


def write(path: Path, *lines: str) -> Path:
    file = path / "rooms.jsonl"
    file.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return file


def test_front_minus_y_becomes_front_plus_x(tmp_path: Path) -> None:
    # At yaw pi the bed's front faces +y, so its back is at y = 1.1 - 1.0, 0.1 m from the wall y = 0, whose inward direction is +y.
    (room,) = read_layouts(write(tmp_path, line()), NAMES, "bedroom").rooms
    (bed,) = room.objects
    assert bed.size_m == (2.0, 1.4, 1.0)
    assert bed.position_m == (1.0, 1.1, 0.0)
    assert bed.yaw_rad == pytest.approx(0.5 * math.pi)
    wall = fitting_wall(room.polygon_m, bed)
    assert wall is not None
    assert wall.gap_m == pytest.approx(0.1)
    assert wall.turn_rad == pytest.approx(0.0)
    assert wall.wall == 0
    side = nearest_wall(
        room.polygon_m, ObservedObject(category="bed", size_m=(2.0, 1.4, 1.0), position_m=(0.75, 1.5, 0.0), yaw_rad=math.pi / 2)
    )
    assert side is not None
    assert (side.wall, side.gap_m, side.turn_rad) == pytest.approx((3, 0.05, math.pi / 2))


def test_low_tables_are_side_tables_and_the_long_side_of_tables_is_their_width(tmp_path: Path) -> None:
    tables = [{"cat": "dining_table", "pos": [2.0, 1.5, 0.4], "size": [0.9, 1.5, height], "yaw": 0.0} for height in (0.75, 0.45)]
    (room,) = read_layouts(write(tmp_path, line(objects=tables)), NAMES, "bedroom").rooms
    assert [(item.category, item.size_m[1]) for item in room.objects] == [("dining_table", 1.5), ("side_table", 0.9)]


def test_clockwise_outlines_and_needless_vertices(tmp_path: Path) -> None:
    outline = [[0, 0], [0, 3], [0, 3], [4, 3], [6, 3], [4, 3], [4, 1.5], [4, 0]]
    (room,) = read_layouts(write(tmp_path, line(polygon=outline)), NAMES, "bedroom").rooms
    assert len(room.polygon_m) == 4
    assert signed_area_m2(room.polygon_m) == pytest.approx(12.0)


def test_bad_lines_and_objects_are_counted_with_their_lines(tmp_path: Path) -> None:
    bad = [
        BED | {"size": [1.4, float("nan"), 1.0]},
        BED | {"size": [1.4, 200.0, 1.0]},
        BED | {"cat": "hovercraft"},
        BED | {"cat": "small"},
        BED | {"pos": [9.0, 1.0, 0.5]},
        BED | {"yaw": "north"},
        {"raw": "Bed"},
        7,
    ]
    lines = [
        line(),
        "{not json",
        "[]",
        line(polygon=[[0, 0], [1, 0]]),
        line(objects=[*bad, BED]),
        line(room_type="kitchen"),
        "",
        line(objects=[]),
        line(height=None),
    ]
    file = read_layouts(write(tmp_path, *lines), NAMES, "bedroom")
    assert [len(room.objects) for room in file.rooms] == [1, 1, 0]
    assert file.other_rooms == 1
    by_line: dict[int, list[str]] = {}
    for item in file.skipped:
        by_line.setdefault(item.line, []).append(item.reason)
    assert by_line == {
        2: ["room: not JSON"],
        3: ["room: not a JSON object"],
        4: ["room: no usable polygon"],
        5: [
            "object: absurd or missing size",
            "object: absurd or missing size",
            "object: unknown category 'hovercraft'",
            "object: category 'small' is not learned",
            "object: outside its room",
            "object: no yaw",
            "object: no category",
            "object: not a JSON object",
        ],
        9: ["room: no height"],
    }
    assert file.reasons()["object: absurd or missing size"] == 2


def test_on_follows_the_objects_that_are_kept(tmp_path: Path) -> None:
    lamp = BED | {"cat": "table_lamp", "size": [0.2, 0.2, 0.4], "pos": [1.0, 1.0, 0.7], "on": 3}
    stand = BED | {"cat": "nightstand", "size": [0.5, 0.4, 0.5], "pos": [1.0, 1.0, 0.25]}
    (room,) = read_layouts(write(tmp_path, line(objects=[BED | {"yaw": "x"}, lamp, stand])), NAMES, "bedroom").rooms
    assert [(item.category, item.on) for item in room.objects] == [("table_lamp", 1), ("nightstand", None)]


def beds(count: int) -> list[dict[str, object]]:
    return [BED | {"pos": [1.0 + 0.001 * k, 1.1, 0.5]} for k in range(count)]


@pytest.mark.parametrize(
    ("changes", "reason", "lost"),
    [
        ({"objects": beds(64)}, "room: 'flat' has 64 of bed, more than 63", 64),
        ({"objects": beds(3000)}, "room: 'flat' has 3000 objects, more than 1000", 3000),
        ({"objects": [{**bed, "cat": cat} for cat in ("bed", "desk", "bench", "wardrobe") for bed in beds(63)]},
         "room: 'flat' has 252 objects that can be used, more than 250", 252),
        ({"objects": beds(2), "doors": [["door", 0.3 * k, -0.05, 0.0, 0.3 * k + 0.9, 0.05, 2.0] for k in range(8)] * 2},
         "room: 16 doors, more than 15", 2),
        ({"objects": beds(2), "height": None}, "room: no height", 2),
        ({"objects": beds(2), "polygon": None}, "room: no usable polygon", 2),
    ],
)  # fmt: skip
def test_a_room_that_no_grammar_can_have_is_named_and_left_out(tmp_path: Path, changes: dict[str, object], reason: str, lost: int) -> None:
    with counted_calls() as calls:
        file = read_layouts(write(tmp_path, line(), line(id="flat", **changes)), NAMES, "bedroom")
    assert calls() < 200_000
    assert len(file.rooms) == 1
    assert [(item.line, item.reason, item.objects) for item in file.skipped if item.reason.startswith("room:")] == [(2, reason, lost)]


def test_the_share_of_objects_left_out_counts_those_of_rooms_left_out(tmp_path: Path) -> None:
    file = read_layouts(write(tmp_path, line(objects=[*beds(6), 7]), line(objects=beds(3), height=None)), NAMES, "bedroom")
    assert (sum(len(room.objects) for room in file.rooms), file.lost_objects()) == (6, {"not a JSON object": 1, "room: no height": 3})


def test_shelves_that_stand_on_the_floor_do_not_hang(tmp_path: Path) -> None:
    def shelf(bottom: float, **more: object) -> dict[str, object]:
        return {"cat": "shelf", "pos": [2.0, 0.2, bottom + 0.9], "size": [0.8, 0.3, 1.8], "yaw": 0.0, **more}

    table = {"cat": "desk", "pos": [2.0, 0.2, 0.1], "size": [1.0, 0.6, 0.2], "yaw": 0.0}
    objects = [BED, table, shelf(0.0), shelf(0.8), shelf(0.2, on=2)]
    (room,) = read_layouts(write(tmp_path, line(objects=objects)), NAMES, "bedroom").rooms
    assert [item.category for item in room.objects[2:]] == ["bookshelf", "wall_shelf", "wall_shelf"]
    (bath,) = read_layouts(write(tmp_path, line(objects=objects[2:3], room_type="bathroom")), NAMES, "bathroom").rooms
    assert [item.category for item in bath.objects] == ["storage_shelf"]


def test_a_name_of_ours_that_the_table_takes_for_another_is_told(tmp_path: Path) -> None:
    names = replace(NAMES, catalogue=frozenset({"bed", "tv_stand", "dresser"}))
    stands = [{"cat": "tv_stand", "pos": [2.0, 0.3, 0.3], "size": [1.2, 0.4, 0.6], "yaw": 0.0}] * 2
    file = read_layouts(write(tmp_path, line(objects=[BED, *stands])), names, "bedroom")
    assert [item.category for item in file.rooms[0].objects] == ["bed", "dresser", "dresser"]
    assert file.reasons() == {"name: 'tv_stand' is taken for dresser": 2}
    assert file.lost_objects() == {}


def test_missing_file_is_refused(tmp_path: Path) -> None:
    with pytest.raises(GrammarError, match=r"none.jsonl: no such file or directory; check the path"):
        read_layouts(tmp_path / "none.jsonl", NAMES, "bedroom")


def test_own_format_round_trip(tmp_path: Path) -> None:
    room = ObservedRoom(
        id="r",
        house="h",
        room_type="bedroom",
        polygon_m=((0.0, 0.0), (4.0, 0.0), (4.0, 3.0), (0.0, 3.0)),
        height_m=2.5,
        objects=(
            ObservedObject(category="desk", size_m=(0.7, 1.4, 0.75), position_m=(0.4, 1.0, 0.0), yaw_rad=0.125),
            ObservedObject(category="laptop", size_m=(0.25, 0.35, 0.2), position_m=(0.4, 1.0, 0.75), yaw_rad=-1.0, on=0),
        ),
    )
    assert read_layouts(write(tmp_path, layout_line(room)), NAMES, "bedroom").rooms == (room,)


def test_houses() -> None:
    assert [house_of(name) for name in ("ravh01-0-Bedroom1", "procthor1k-train-0004", "flat")] == [
        "ravh01",
        "procthor1k-train-0004",
        "flat",
    ]


def test_general_names_mean_what_they_stand_beside(tmp_path: Path) -> None:
    def at(name: str, x: float, y: float, size: float = 0.5) -> dict[str, object]:
        return {"cat": name, "pos": [x, y, 0.4], "size": [size, size, 0.8], "yaw": 0.0}

    objects = [BED, at("side_table", 1.95, 0.4), at("side_table", 3.7, 2.7), at("dining_table", 3.2, 1.0, 1.0), at("chair", 3.2, 1.8)]
    found = read_layouts(write(tmp_path, line(objects=objects), line(objects=[BED, at("chair", 3.2, 1.8)])), NAMES, "bedroom").rooms
    assert [item.category for item in found[0].objects] == ["bed", "nightstand", "side_table", "dining_table", "dining_chair"]
    # a name that says what it means keeps it
    assert found[1].objects[1].category == "desk_chair"
    named = [BED, at("nightstand", 3.7, 2.7), at("dining_table", 3.2, 1.0, 1.0), at("office_chair", 3.2, 1.8)]
    (room,) = read_layouts(write(tmp_path, line(objects=named)), NAMES, "bedroom").rooms
    assert [item.category for item in room.objects] == ["bed", "nightstand", "dining_table", "desk_chair"]


def test_names_of_several_lines_and_of_no_characters_are_told_in_one_that_every_file_holds(tmp_path: Path) -> None:
    objects = [BED, {**BED, "cat": "zzz\nroot: x\ud800"}]
    file = read_layouts(write(tmp_path, line(objects=objects)), replace(NAMES, catalogue=frozenset({"bed"})), "bedroom")
    assert [item.reason for item in file.skipped] == ["name: 'zzz?root: x?' is taken for other_furniture, a plain box"]
