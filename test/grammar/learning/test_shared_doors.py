"""Doors that rooms of a house share, in plans made by hand."""

import json
from pathlib import Path
from typing import Any

import pytest

from grammar.learning import read_category_map, read_layouts
from grammar.learning.layout_fields import shared_doors
from scene_description.share import config_path

NAMES = read_category_map(config_path("learning/category_map.yaml"))
OWN = ["door", -0.1, 0.1, 0.0, 0.1, 0.9, 2.0]
TO_NORTH = ["door", 2.0, 0.95, 0.0, 2.8, 1.15, 2.0]


def room(name: str, low: tuple[float, float], high: tuple[float, float], *doors: list[Any]) -> dict[str, Any]:
    outline = [[low[0], low[1]], [high[0], low[1]], [high[0], high[1]], [low[0], high[1]]]
    return {"id": f"h1-{name}", "room_type": name, "polygon": outline, "height": 2.5, "objects": [], "doors": list(doors)}


HALL = room("hallway", (0.0, 0.0), (5.0, 1.0), OWN)
NORTH = room("bedroom", (0.0, 1.1), (4.0, 4.0), TO_NORTH, ["door", 3.95, 2.0, 0.0, 4.15, 2.8, 2.0])


def test_a_door_leads_into_both_rooms_at_its_sides() -> None:
    # The bedroom's first door is in the hall's long wall, its second leads elsewhere; the hall's own door is at its end.
    assert shared_doors(HALL, [NORTH]) == [TO_NORTH]
    assert shared_doors(NORTH, [HALL]) == []


def test_a_door_that_both_rooms_list_is_one() -> None:
    assert shared_doors(HALL | {"doors": [OWN, ["door", 2.05, 0.95, 0.0, 2.85, 1.05, 2.0]]}, [NORTH]) == []


@pytest.mark.parametrize(
    "other",
    [
        room("bedroom", (0.0, 0.0), (4.0, 4.0), TO_NORTH),  # at an origin of its own
        NORTH | {"polygon": "none"},
        NORTH | {"doors": [["door", "x"], ["window", *TO_NORTH[1:]], ["door", 2.0, float("nan"), 0.0, 2.8, 1.15, 2.0]]},
        NORTH | {"doors": None},
    ],
    ids=["no_frame_in_common", "no_outline", "no_doors", "none"],
)
def test_what_does_not_fit_is_passed_over(other: dict[str, Any]) -> None:
    assert shared_doors(HALL, [other]) == []
    assert shared_doors(other, [HALL]) == []


def test_halls_of_a_file_have_the_doors_of_the_rooms_around_them(tmp_path: Path) -> None:
    path = tmp_path / "rooms.jsonl"
    path.write_text("\n".join(map(json.dumps, (HALL, NORTH, NORTH | {"id": "h2-bedroom"}))))
    (hall,) = read_layouts(path, NAMES, "hallway").rooms
    # walls count from the south counter-clockwise; along the north wall one begins at its east end: 5 - 2.8
    assert [(door.wall, door.offset_m) for door in hall.openings["door"]] == [(3, pytest.approx(0.1)), (2, pytest.approx(2.2))]
