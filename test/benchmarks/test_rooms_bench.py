"""What the bench of rooms measures, on rooms of known size; never how fast anything is."""

import json

import pytest
from small_grammar import CATEGORIES

from benchmarks.room_measures import measure_room, only, real_rooms
from benchmarks.rooms_bench import beside, judge
from grammar.learning import read_category_map
from scene_description.share import config_path

# A niche of 0.1 m for the door in the wall x = 4, a cabinet of 1 x 0.5 m at the wall y = 3 and a lamp on it.
LINE = {
    "room_type": "livingroom",
    "height": 2.5,
    "polygon": [[0, 0], [4, 0], [4, 1], [4.1, 1], [4.1, 2], [4, 2], [4, 3], [0, 3]],
    "doors": [["door", 4.05, 1.0, 0.0, 4.2, 2.0, 2.0]],
    "windows": [["window", 1.0, -0.1, 0.9, 2.0, 0.0, 2.1]],
    "objects": [
        {"cat": "cabinet", "raw": "?", "pos": [1.5, 2.75, 0.5], "size": [1.0, 0.5, 1.0], "yaw": 0.0},
        {"cat": "table_lamp", "raw": "?", "pos": [1.5, 2.75, 1.2], "size": [0.2, 0.2, 0.4], "yaw": 0.0, "on": 1},
    ],
}


def test_a_room_of_a_layout_file_is_measured_with_all_that_it_holds(tmp_path) -> None:
    path = tmp_path / "rooms.jsonl"
    path.write_text(json.dumps(LINE) + "\n")
    (room,) = real_rooms(path, read_category_map(config_path("learning/category_map.yaml")), CATEGORIES)
    found = measure_room(room)
    assert (found.room_type, found.walls, found.doors, found.windows, found.objects, found.on_floor) == ("living_room", 4, 1, 1, 2, 1)
    assert found.area_m2 == pytest.approx(12.1)
    assert found.proportion == pytest.approx(3.0 / 4.1)
    assert found.covered == pytest.approx(0.5 / 12.1)
    assert found.bare_wall_m == pytest.approx(3.0)
    assert found.by_category == {"sideboard": 1, "table_lamp": 1}
    area = next(row for row in beside([found], [found]) if row["measure"] == "area_m2")
    assert (area["ours"], area["ratio"]) == (pytest.approx(12.1), 1.0)


def test_what_real_rooms_do_not_record_covers_no_wall_beside_them(tmp_path) -> None:
    path = tmp_path / "rooms.jsonl"
    path.write_text(json.dumps(LINE) + "\n")
    (room,) = real_rooms(path, read_category_map(config_path("learning/category_map.yaml")), CATEGORIES)
    found = measure_room(only(room, {"table_lamp"}))
    assert (found.by_category, found.on_floor, found.covered) == ({"table_lamp": 1}, 0, 0.0)
    (judged,) = judge("hallway", 3, [1], recorded={"shoe_rack"})
    assert judged.measures is not None and judged.recorded is not None
    assert judged.recorded.bare_wall_m >= judged.measures.bare_wall_m
    assert set(judged.recorded.by_category) <= {"shoe_rack"}
