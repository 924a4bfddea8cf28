"""Faults of use, each made by moving one thing of a room that has none."""

import math
from dataclasses import replace
from pathlib import Path

import pytest
from small_grammar import CATEGORIES

from grammar.checks.faults import FAULTS, always_odd, faults_table, find_faults
from grammar.checks.furnished import furnished
from grammar.checks.use_of_seats import BEHIND_MOST_M, behind_chairs_m, places
from scene_description import ModelReference, Opening, Room, SceneObject, Support

NORTH, SOUTH, WEST = 0.5 * math.pi, -0.5 * math.pi, math.pi

Things = dict[str, SceneObject]


def opening(kind: str, wall: int, offset_m: float, width_m: float, sill_m: float = 0.0, hinge: str = "start") -> Opening:
    return Opening(
        id=900 + wall, category=kind, label=0, wall=wall, offset_m=offset_m, sill_m=sill_m, width_m=width_m, height_m=2.0 - sill_m,
        hinge=hinge, model=ModelReference(generator=kind), parts=(),
    )  # fmt: skip


# 4 m along x, 6 m along y; the door's hinge is 0.1 m from the corner (0, 0), its latch at x = 1; the window is in the wall y = 6.
ROOM = Room(
    polygon_m=((0.0, 0.0), (4.0, 0.0), (4.0, 6.0), (0.0, 6.0)),
    height_m=2.5,
    wall_thickness_m=0.1,
    openings=(opening("door", 0, 0.1, 0.9), opening("window", 2, 1.0, 1.0, sill_m=0.9)),
    surfaces=(),
)


def thing(number: int, category: str, x: float, y: float, yaw: float, size: tuple[float, float, float], z: float = 0.0) -> SceneObject:
    support = Support(kind="wall", wall=0) if z > 0.0 else Support(kind="floor")
    return SceneObject(
        id=number, category=category, label=0, size_m=size, position_m=(x, y, z), yaw_rad=yaw, support=support,
        model=ModelReference(generator=category), parts=(),
    )  # fmt: skip


GOOD: Things = {
    "switch": thing(1, "light_switch", 1.15, 0.01, NORTH, (0.01, 0.08, 0.08), 1.1),
    "bed": thing(2, "bed", 3.0, 3.0, WEST, (2.0, 1.4, 0.9)),
    "nightstand": thing(3, "nightstand", 3.8, 2.0, WEST, (0.4, 0.4, 0.5)),
    "wardrobe": thing(4, "wardrobe", 3.0, 0.3, NORTH, (0.6, 1.2, 2.0)),
    "bookshelf": thing(5, "bookshelf", 0.15, 5.0, 0.0, (0.3, 0.8, 1.8)),
    "picture": thing(6, "picture", 0.01, 2.0, 0.0, (0.02, 0.6, 0.5), 1.4),
    "rug": thing(7, "rug", 2.0, 4.5, 0.0, (1.0, 1.0, 0.01)),
    "television": thing(8, "television", 0.1, 3.0, 0.0, (0.1, 0.9, 0.6)),
    "desk": thing(9, "desk", 1.5, 5.7, SOUTH, (0.6, 1.2, 0.75)),
    "chair": thing(10, "desk_chair", 1.5, 5.2, NORTH, (0.5, 0.5, 0.9)),
}


def moved(name: str, x: float, y: float, yaw: float | None = None) -> Things:
    item = GOOD[name]
    turned = item.yaw_rad if yaw is None else yaw
    return {name: replace(item, position_m=(x, y, item.position_m[2]), yaw_rad=turned)}


def faults(things: Things, room_type: str = "bedroom", room: Room = ROOM) -> dict[str, list[int]]:
    return find_faults(furnished(room_type, room, list(things.values()), CATEGORIES))


def test_a_good_room_has_no_fault_and_names_are_unique() -> None:
    assert faults(GOOD) == {}
    assert len({fault.name for fault in FAULTS}) == len(FAULTS)


@pytest.mark.parametrize(
    ("change", "expected"),
    [
        (moved("switch", 0.05, 0.01), {"switch_behind_door": [1]}),
        (moved("picture", 0.01, 0.5), {"shown_behind_door": [6]}),
        (moved("picture", 0.01, 5.0), {"shown_hidden": [6]}),
        (moved("rug", 1.0, 1.0), {"rug_in_swing": [7]}),
        (moved("television", 0.1, 3.0, WEST), {"screen_unseen": [8], "screen_aside": [8]}),
        (moved("chair", 1.5, 5.2, SOUTH), {"chair_at_no_table": [10]}),
        (moved("bookshelf", 0.35, 5.0), {"shelf_off_wall": [5]}),
        (moved("bookshelf", 0.4, 5.0, SOUTH), {"shelf_off_wall": [5]}),
        (moved("wardrobe", 3.0, 0.5), {"wardrobe_off_wall": [4]}),
        (moved("bed", 2.8, 3.0), {"bed_off_wall": [2]}),
        (moved("nightstand", 3.8, 1.7), {"bedside_astray": [3]}),
        (moved("wardrobe", 2.2, 5.7, SOUTH), {"before_window": [4], "chair_at_no_table": [10]}),
    ],
)  # fmt: skip
def test_a_thing_moved_is_that_fault(change: Things, expected: dict[str, list[int]]) -> None:
    things = GOOD | change
    if "chair_at_no_table" in expected and "before_window" in expected:
        del things["desk"]
    assert faults(things) == expected


def test_a_curtain_hangs_at_its_window_and_a_sideboard_at_a_wall() -> None:
    curtain = replace(thing(12, "curtain", 2.5, 5.95, SOUTH, (0.1, 1.4, 2.0), 0.1), support=Support(kind="wall", wall=2))
    assert faults({"curtain": curtain}) == {}
    assert faults({"curtain": replace(curtain, position_m=(1.4, 5.95, 0.1))}) == {"curtain_off_window": [12]}
    assert faults({"curtain": replace(curtain, support=Support(kind="wall", wall=1))}) == {"curtain_off_window": [12]}
    assert faults({"sideboard": thing(13, "sideboard", 0.5, 4.0, 0.0, (0.4, 1.2, 0.8))}) == {"back_off_wall": [13]}


def test_a_mirror_hangs_over_the_basin() -> None:
    basin, mirror = thing(14, "washbasin", 0.25, 4.0, 0.0, (0.5, 0.6, 0.9)), thing(15, "wall_mirror", 0.01, 4.1, 0.0, (0.02, 0.6, 0.8), 1.2)
    assert faults({"basin": basin, "mirror": mirror}) == {}
    assert faults({"basin": basin}) == {}
    assert faults({"basin": basin, "mirror": replace(mirror, position_m=(0.01, 4.4, 1.2))}) == {"basin_off_mirror": [14]}
    assert faults({"basin": replace(basin, yaw_rad=NORTH, position_m=(0.3, 0.25, 0.0)), "mirror": mirror}) == {"basin_off_mirror": [14]}


def test_a_mat_lies_before_the_bath_and_paper_hangs_by_the_toilet() -> None:
    toilet = thing(16, "toilet", 0.35, 4.0, 0.0, (0.7, 0.4, 0.8))
    mat, paper = (
        thing(17, "bath_mat", 1.0, 4.0, 0.0, (0.5, 0.8, 0.02)),
        thing(18, "toilet_paper_holder", 0.05, 4.4, 0.0, (0.1, 0.15, 0.1), 0.7),
    )
    assert faults({"toilet": toilet, "mat": mat, "paper": paper}) == {}
    # the mat reaches 0.45 m beneath the toilet, half of its width: 0.9 x 0.5 of it
    assert faults({"toilet": toilet, "mat": replace(mat, position_m=(0.5, 4.0, 0.0))}) == {"stands_on_mat": [17]}
    assert faults({"toilet": toilet, "paper": replace(paper, position_m=(0.05, 5.0, 0.7))}) == {"paper_out_of_reach": [18]}


def test_the_manual_lists_them() -> None:
    manual = (Path(__file__).resolve().parents[3] / "docs" / "grammar.md").read_text(encoding="utf-8")
    assert faults_table() in manual, "docs/grammar.md: expected the table of faults_table(); put it there"


def test_a_switch_beside_a_door_that_opens_outwards_is_never_behind_it() -> None:
    door, window = ROOM.openings
    outwards = replace(ROOM, openings=(replace(door, swing="out"), window))
    assert faults(GOOD | moved("switch", 0.05, 0.01), room=outwards) == {}


def test_what_stands_before_a_store_blocks_its_front() -> None:
    things = GOOD | {"pouf": thing(11, "pouf", 3.0, 0.85, 0.0, (1.0, 0.4, 0.4))}
    assert faults(things) == {"front_blocked": [4], "wardrobe_shut": [4]}
    assert faults(things | {"pouf": thing(11, "pouf", 3.5, 0.85, 0.0, (0.5, 0.4, 0.4))}) == {"wardrobe_shut": [4]}


SITTING: Things = {
    "sofa": thing(50, "sofa", 3.5, 3.0, WEST, (0.9, 2.0, 0.8)),
    "low": thing(51, "coffee_table", 2.4, 3.0, WEST, (0.6, 1.0, 0.4)),
    "armchair": thing(52, "armchair", 1.3, 3.4, 0.0, (0.8, 0.8, 0.8)),
    "screen": thing(53, "television", 0.2, 2.6, 0.0, (0.1, 1.0, 0.6), 0.5),
}


@pytest.mark.parametrize(
    ("change", "expected"),
    [
        ({}, {}),
        ({"second": thing(54, "television", 0.2, 4.0, 0.0, (0.1, 0.8, 0.5), 0.5)}, {"second_screen": [54]}),
        ({"plant": thing(54, "potted_plant", 0.45, 2.6, 0.0, (0.3, 0.3, 1.0))}, {"screen_hidden": [53]}),
        ({"low": thing(51, "coffee_table", 1.0, 5.5, 0.0, (0.5, 0.5, 0.4))}, {"coffee_table_astray": [51]}),
        ({"aside": thing(54, "coffee_table", 0.4, 5.6, 0.0, (0.5, 0.5, 0.4))}, {}),
        ({"aside": thing(54, "coffee_table", 1.0, 5.2, 0.0, (0.5, 0.5, 0.4))}, {"coffee_table_astray": [54], "coffee_table_aside": [54]}),
        ({"aside": thing(54, "coffee_table", 2.6, 4.4, WEST, (0.5, 0.5, 0.4))}, {"coffee_table_aside": [54]}),
        ({"armchair": thing(52, "armchair", 0.7, 4.5, WEST, (0.8, 0.8, 0.8))}, {"seat_faces_wall": [52], "seat_alone": [52]}),
        ({"shelf": thing(54, "bookshelf", 2.0, 3.6, WEST, (0.3, 1.2, 1.8))}, 
         {"seat_faces_wall": [52], "seat_cramped": [52], "shelf_off_wall": [54]}),
        ({"armchair": thing(52, "armchair", 1.3, 4.0, NORTH, (0.8, 0.8, 0.8))}, {"seat_alone": [52]}),
    ],
)  # fmt: skip
def test_sofas_armchairs_coffee_tables_and_screens_belong_together(change: Things, expected: dict[str, list[int]]) -> None:
    assert faults(SITTING | change, "living_room") == expected


def test_a_chair_stands_behind_another_one_but_not_opposite() -> None:
    table = thing(60, "dining_table", 2.0, 3.0, NORTH, (0.8, 1.4, 0.75))
    near, far = thing(61, "dining_chair", 2.0, 2.5, NORTH, (0.5, 0.45, 0.9)), thing(62, "dining_chair", 2.0, 1.95, NORTH, (0.5, 0.45, 0.9))
    opposite = thing(63, "dining_chair", 2.0, 3.5, SOUTH, (0.5, 0.45, 0.9))
    assert faults({"table": table, "near": near, "opposite": opposite}) == {}
    assert faults({"table": table, "near": near, "far": far}) == {"chair_behind_chair": [62], "place_shared": [61, 62]}


def test_mats_are_free_and_plants_stand_at_walls_and_on_no_edge_of_a_rug() -> None:
    mat = thing(70, "exercise_mat", 2.0, 3.0, 0.0, (1.8, 0.6, 0.01))
    bench = thing(71, "weight_bench", 2.0, 3.0, NORTH, (1.2, 0.5, 0.5))
    assert faults({"mat": mat, "bench": bench}) == {"stands_on_mat": [70], "mat_hemmed": [70]}
    assert faults({"mat": mat, "bench": replace(bench, position_m=(2.0, 4.0, 0.0))}) == {}
    plant, rug = thing(72, "potted_plant", 3.7, 4.0, 0.0, (0.4, 0.4, 1.0)), thing(73, "rug", 2.8, 4.0, 0.0, (1.6, 1.6, 0.01))
    assert faults({"plant": plant}) == {}
    assert faults({"plant": plant, "rug": rug}) == {"pot_on_rug_edge": [72]}
    assert faults({"plant": replace(plant, position_m=(2.8, 4.0, 0.0))}) == {"stands_astray": [72]}
    assert faults({"plant": replace(plant, position_m=(2.8, 4.0, 0.0)), "bench": replace(bench, position_m=(2.4, 4.0, 0.0))}) == {}
    table = thing(74, "dining_table", 3.4, 4.0, 0.0, (0.9, 1.5, 0.75))
    assert faults({"plant": replace(plant, size_m=(0.3, 0.3, 0.6)), "table": table}) == {"pot_under_table": [72]}
    assert faults({"bin": thing(75, "waste_bin", 3.4, 4.0, 0.0, (0.3, 0.3, 0.3)), "table": table}) == {}


BATHROOM: Things = {
    "toilet": thing(80, "toilet", 0.35, 3.0, 0.0, (0.7, 0.4, 0.8)),
    "shower": thing(81, "shower_cabin", 0.45, 5.5, 0.0, (0.9, 0.9, 2.0)),
    "basin": thing(82, "washbasin", 3.75, 4.0, WEST, (0.5, 0.6, 0.9)),
    "mat": thing(83, "bath_mat", 1.2, 5.4, 0.0, (0.5, 0.8, 0.02)),
    "towel": thing(84, "towel_rail", 3.95, 5.0, WEST, (0.1, 0.6, 0.5), 1.0),
}


@pytest.mark.parametrize(
    ("change", "expected"),
    [
        ({}, {}),
        # half of the mat's width beyond the shower, and 0.6 of the shower's width from its middle
        ({"mat": thing(83, "bath_mat", 1.2, 4.9, 0.0, (0.5, 0.8, 0.02))}, {"mat_astray": [83]}),
        ({"mat": thing(83, "bath_mat", 2.2, 5.0, 0.0, (0.5, 0.8, 0.02))}, {"mat_astray": [83]}),
        ({"shower": thing(81, "shower_cabin", 0.45, 5.2, 0.0, (0.9, 0.9, 2.0))}, {"bathing_off_corner": [81]}),
        ({"towel": thing(84, "towel_rail", 3.95, 2.0, WEST, (0.1, 0.6, 0.5), 1.0)}, {}),
        ({"towel": thing(84, "towel_rail", 3.95, 1.6, WEST, (0.1, 0.6, 0.5), 1.0)}, {"towel_out_of_reach": [84]}),
        # half of the 0.35 m for knees is taken
        ({"basket": thing(85, "laundry_basket", 1.1, 3.0, 0.0, (0.4, 0.4, 0.6))}, {"toilet_cramped": [80]}),
        ({"basket": thing(85, "laundry_basket", 0.35, 3.43, 0.0, (0.6, 0.4, 0.6))}, {"toilet_cramped": [80]}),
        ({"basket": thing(85, "laundry_basket", 0.35, 3.6, 0.0, (0.6, 0.4, 0.6))}, {}),
        ({"basket": thing(85, "laundry_basket", 3.2, 4.0, 0.0, (0.4, 0.6, 0.6))}, {"fixture_blocked": [82]}),
        ({"cabinet": thing(85, "bathroom_cabinet", 0.3, 3.0, 0.0, (0.6, 0.4, 0.6), 1.4)}, {"cabinet_overhead": [85]}),
        ({"cabinet": thing(85, "bathroom_cabinet", 0.1, 3.0, 0.0, (0.2, 0.4, 0.6), 1.4)}, {}),
    ],
)  # fmt: skip
def test_fixtures_of_a_bathroom_can_be_used(change: Things, expected: dict[str, list[int]]) -> None:
    assert faults(BATHROOM | change, "bathroom") == expected


EXERCISE: Things = {
    "treadmill": thing(90, "treadmill", 3.0, 4.5, SOUTH, (1.8, 0.8, 1.4)),
    "mat": thing(91, "exercise_mat", 1.4, 4.5, NORTH, (1.8, 0.6, 0.01)),
    "rack": thing(92, "dumbbell_rack", 0.3, 2.0, 0.0, (0.5, 1.2, 0.8)),
}


@pytest.mark.parametrize(
    ("change", "expected"),
    [
        ({}, {}),
        ({"bench": thing(93, "bench", 3.0, 3.3, 0.0, (0.6, 0.4, 0.4))}, {"machine_hemmed": [90]}),
        ({"bench": thing(93, "bench", 2.4, 4.5, 0.0, (0.3, 1.6, 0.4))}, {}),
        ({"bench": thing(93, "bench", 2.4, 4.5, 0.0, (0.3, 1.6, 0.4)), "ball": thing(94, "gym_ball", 3.7, 4.5, 0.0, (0.5, 1.4, 0.6))},
         {"machine_hemmed": [90]}),
        ({"mat": thing(91, "exercise_mat", 2.25, 4.5, NORTH, (1.8, 0.6, 0.01))}, {"mat_hemmed": [91]}),
        ({"other": thing(95, "exercise_mat", 0.6, 4.5, NORTH, (1.8, 0.6, 0.01))}, {}),
        ({"other": thing(95, "exercise_mat", 0.6, 4.5, NORTH + 0.15, (1.8, 0.6, 0.01))},
         {"mat_hemmed": [91, 95], "rug_askew": [95]}),
        ({"bike": thing(96, "exercise_bike", 1.0, 2.0, 0.0, (0.6, 0.5, 1.2))}, {"thing_before_front": [96]}),
        ({"plant": thing(97, "potted_plant", 0.7, 2.4, 0.0, (0.2, 0.2, 0.8))}, {"thing_before_front": [97]}),
        ({f"plant {k}": thing(97 + k, "potted_plant", 0.2, 3.0 + 0.5 * k, 0.0, (0.3, 0.3, 0.8)) for k in range(2)}, {}),
        ({f"plant {k}": thing(97 + k, "potted_plant", 0.2, 3.0 + 0.5 * k, 0.0, (0.3, 0.3, 0.8)) for k in range(3)},
         {"fillers_huddled": [97, 98, 99]}),
    ],
)  # fmt: skip
def test_machines_mats_and_racks_can_be_used(change: Things, expected: dict[str, list[int]]) -> None:
    assert faults(EXERCISE | change, "gym") == expected


@pytest.mark.parametrize(
    ("change", "expected"),
    [
        ({}, {}),
        ({"shelf": thing(101, "storage_shelf", 3.8, 3.5, WEST, (0.4, 2.0, 1.8))}, {}),
        ({"bike": thing(102, "bicycle", 0.85, 3.5, NORTH, (1.7, 0.5, 1.0))}, {"car_shut_in": [100]}),
        ({"box": thing(103, "cardboard_box", 2.0, 0.6, 0.0, (0.4, 0.4, 0.4))}, {"car_shut_in": [100]}),
        ({"box": thing(103, "cardboard_box", 0.7, 3.5, 0.0, (0.4, 3.4, 0.4)),
          "crate": thing(104, "plastic_crate", 3.3, 3.5, 0.0, (0.4, 3.4, 0.4))}, {"car_shut_in": [100]}),
    ],
)  # fmt: skip
def test_a_car_can_be_got_into_and_driven_out(change: Things, expected: dict[str, list[int]]) -> None:
    room = replace(ROOM, openings=(opening("garage_door", 0, 0.8, 2.4),))
    assert faults({"car": thing(100, "car", 2.0, 3.5, SOUTH, (4.2, 1.8, 1.5))} | change, "garage", room) == expected


def test_what_opens_has_the_whole_width_of_its_front_and_doors_have_their_way() -> None:
    fridge = thing(120, "refrigerator", 3.65, 3.0, WEST, (0.7, 0.7, 1.8))
    # 0.12 of its width are blocked, less than the half that shelves may lack; two centimetres less and its door opens
    shelf = thing(121, "bookshelf", 3.2, 3.5, SOUTH, (0.3, 0.9, 1.8))
    near, far = (replace(shelf, position_m=(3.2, 3.3 + 0.15 - over, 0.0)) for over in (0.1, 0.02))
    assert "front_shut" in faults({"fridge": fridge, "shelf": near}) and "front_shut" not in faults({"fridge": fridge, "shelf": far})
    plant = thing(122, "potted_plant", 0.5, 0.6, 0.0, (0.3, 0.3, 1.0))
    outwards = replace(ROOM, openings=(replace(ROOM.openings[0], swing="out"),))
    assert faults({"plant": plant}, room=outwards) == {"thing_in_doorway": [122]}
    assert faults({"plant": replace(plant, position_m=(1.3, 0.3, 0.0))}, room=outwards) == {}
    table = thing(126, "dining_table", 0.8, 1.0, NORTH, (1.2, 0.9, 0.75))
    assert faults({"table": table}, room=outwards) == {"thing_in_doorway": [126]}
    assert faults({"table": replace(table, position_m=(0.8, 1.3, 0.0))}, room=outwards) == {}


def test_neither_mirror_nor_hooks_hang_over_a_bed_and_who_runs_has_the_screen_over_the_console() -> None:
    mirror = thing(123, "wall_mirror", 3.99, 3.0, WEST, (0.02, 0.6, 0.8), 1.3)
    hooks = thing(125, "wall_hooks", 3.96, 3.0, WEST, (0.08, 0.6, 0.15), 1.7)
    assert faults({"bed": GOOD["bed"], "mirror": mirror, "hooks": hooks}) == {"hung_over_bed": [123, 125]}
    assert faults({"bed": GOOD["bed"], "mirror": replace(mirror, position_m=(3.99, 4.2, 1.3))}) == {}
    screen = thing(124, "television", 3.5, 5.9, SOUTH, (0.1, 0.9, 0.6), 1.5)
    assert faults(EXERCISE | {"screen": screen}, "gym") == {}
    behind = replace(screen, position_m=(3.0, 2.0, 1.5), yaw_rad=NORTH)
    assert faults(EXERCISE | {"screen": behind}, "gym") == {"screen_unseen": [124]}


def test_hooks_for_coats_hang_over_no_radiator() -> None:
    hooks, radiator = (
        thing(110, "wall_hooks", 0.05, 3.0, 0.0, (0.1, 0.7, 0.2), 1.6),
        thing(111, "radiator", 0.06, 3.8, 0.0, (0.11, 1.0, 0.6), 0.1),
    )
    assert faults({"hooks": hooks, "radiator": radiator}) == {"hooks_over_heater": [110]}
    assert faults({"hooks": hooks, "radiator": replace(radiator, position_m=(0.06, 4.0, 0.1))}) == {}


def run(*units: tuple[str, float]) -> Things:
    """Return base units with their backs to the wall y = 0, by category and the x of their right ends, 0.6 m wide."""
    return {f"{name} {x}": thing(20 + k, name, x + 0.3, 0.3, NORTH, (0.6, 0.6, 0.9)) for k, (name, x) in enumerate(units)}


def test_runs_of_units_are_whole_or_parted_by_doors() -> None:
    whole = run(("stove", 1.1), ("kitchen_counter", 1.7), ("sink_counter", 2.3), ("refrigerator", 2.9))
    assert faults(whole, "kitchen") == {}
    apart = run(("stove", 1.1), ("kitchen_counter", 1.7), ("sink_counter", 2.45), ("refrigerator", 3.05))
    assert faults(apart, "kitchen") == {"gap_in_run": [22], "run_in_pieces": [22]}
    filled = apart | {"bin": thing(40, "waste_bin", 2.375, 0.2, 0.0, (0.3, 0.14, 0.4))}
    assert faults(filled, "kitchen") == {"run_in_pieces": [22]}
    door = replace(ROOM, openings=(opening("door", 0, 1.75, 0.9),))
    parted = run(("stove", 0.5), ("kitchen_counter", 1.1), ("sink_counter", 2.75), ("kitchen_counter", 3.35))
    assert faults(parted, "kitchen", door) == {}


def test_hoods_fridges_and_rooms_that_lack_something() -> None:
    units = run(("stove", 1.1), ("sink_counter", 1.7))
    hood = thing(41, "range_hood", 1.7, 0.25, NORTH, (0.5, 0.6, 0.5), 1.6)
    fridge = thing(42, "refrigerator", 3.0, 0.6, NORTH, (0.6, 0.6, 1.8))
    assert faults(units | {"hood": hood, "fridge": fridge}, "kitchen") == {"hood_off_hob": [41], "fridge_off_wall": [42]}
    assert faults({}, "kitchen") == {"kitchen_lacks": [0]}
    assert faults({}, "bathroom") == {"no_bathing": [0]}
    assert faults({}, "garage") == {"no_vehicle_door": [0]}
    wide = replace(ROOM, openings=(opening("door", 0, 0.5, 2.5),))
    assert faults({}, "garage", wide) == {}


@pytest.mark.parametrize(
    ("names", "odd"),
    [
        (("television", "bed"), False),
        (("television", "rug"), True),
        (("desk_chair", "bed"), True),
        (("desk_chair", "desk"), False),
        (("desk", "bed"), True),
        (("toilet", "washbasin"), True),
        (("toilet", "bathtub"), False),
        ((), False),
    ],
)
def test_structures_without_what_their_objects_serve_are_always_odd(names: tuple[str, ...], odd: bool) -> None:
    assert always_odd(CATEGORIES, names) == odd


@pytest.mark.parametrize(
    ("names", "odd"), [(("sofa", "rug"), True), (("sofa", "coffee_table"), False), (("sofa", "armchair"), False), (("bed",), False)]
)
def test_a_lone_sofa_is_odd_where_seats_need_company(names: tuple[str, ...], odd: bool) -> None:
    assert always_odd(CATEGORIES, names, company=True) == odd
    assert not always_odd(CATEGORIES, names)


TABLE = thing(1, "dining_table", 2.0, 3.0, NORTH, (0.8, 1.6, 0.75))
"""Its edges are x = 1.2 and 2.8, y = 2.6 and 3.4."""
CHAIR = (0.5, 0.45, 0.9)


def at_table(**chairs: tuple[float, float, float]) -> Things:
    """Return the table with chairs given by x, y and yaw, with the ids 2, 3, ..."""
    return {"table": TABLE} | {name: thing(2 + k, "dining_chair", x, y, yaw, CHAIR) for k, (name, (x, y, yaw)) in enumerate(chairs.items())}


def test_a_place_is_where_the_line_of_sight_meets_the_edge() -> None:
    found = furnished("dining_room", ROOM, list(at_table(south=(1.5, 2.5, NORTH), end=(2.9, 3.1, WEST)).values()), CATEGORIES)
    south, end = places(found)
    assert south.at_m == pytest.approx((1.5, 2.6)) and south.edge_at_m == pytest.approx((2.0, 2.6))
    assert (south.to_end_m, south.edge_m) == pytest.approx((0.3, 1.6))
    assert end.at_m == pytest.approx((2.8, 3.1)) and (end.to_end_m, end.edge_m) == pytest.approx((0.3, 0.8))


@pytest.mark.parametrize(
    ("chairs", "expected"),
    [
        ({"a": (1.7, 2.5, NORTH), "b": (2.3, 2.5, NORTH)}, {}),
        ({"a": (1.77, 2.5, NORTH), "b": (2.23, 2.5, NORTH)}, {"place_shared": [2, 3]}),  # 0.46 m apart
        ({"a": (2.0, 2.5, NORTH), "b": (2.0, 3.5, SOUTH)}, {}),
        ({"a": (2.6, 2.75, NORTH), "b": (2.65, 2.85, WEST)}, {"place_shared": [2, 3]}),  # round a corner
        ({"a": (1.3, 2.5, NORTH)}, {"chair_at_corner": [2]}),  # 0.1 m from the end of the edge
        ({"a": (2.0, 2.4, NORTH + 0.65)}, {"chair_at_corner": [2]}),  # aslant by 37 degrees
        ({"a": (3.1, 2.7, NORTH)}, {"chair_at_corner": [2]}),  # looks past the table
    ],
)  # fmt: skip
def test_chairs_have_places_of_their_own_at_an_edge(chairs: dict[str, tuple[float, float, float]], expected: dict[str, list[int]]) -> None:
    assert faults(at_table(**chairs)) == expected


def test_what_stands_behind_a_chair_leaves_room_to_sit_down() -> None:
    things = at_table(a=(2.0, 2.5, NORTH))
    assert faults(things | {"bed": thing(9, "pouf", 2.0, 1.75, 0.0, (0.6, 0.9, 0.5))}) == {}  # ends 0.4 m from the table
    assert faults(things | {"bed": thing(9, "pouf", 2.0, 1.9, 0.0, (0.6, 0.9, 0.5))}) == {"chair_wedged": [2]}  # 0.25 m
    moved = {"table": replace(TABLE, position_m=(2.0, 0.65, 0.0)), "a": thing(2, "dining_chair", 2.0, 0.25, NORTH, CHAIR)}
    assert faults(moved) == {"chair_wedged": [2]}  # the wall is 0.25 m from the table


def test_space_behind_chairs_is_measured_from_the_table() -> None:
    things = at_table(a=(2.0, 2.5, NORTH))
    assert behind_chairs_m(furnished("bedroom", ROOM, list(things.values()), CATEGORIES)) == [BEHIND_MOST_M]
    pouf = {"pouf": thing(9, "pouf", 2.0, 1.75, 0.0, (0.6, 0.9, 0.5))}  # ends 0.4 m from the table
    assert behind_chairs_m(furnished("bedroom", ROOM, list((things | pouf).values()), CATEGORIES)) == [
        pytest.approx(0.44, abs=0.03)
    ]  # where a tenth of the strip is taken


def test_plants_sofas_and_low_tables_keep_off_the_table() -> None:
    things = at_table(a=(1.7, 2.5, NORTH))
    plant = thing(9, "potted_plant", 2.4, 2.4, 0.0, (0.3, 0.3, 1.0))
    assert faults(things | {"plant": plant}) == {"filler_at_table": [9]}
    assert faults(things | {"plant": replace(plant, position_m=(2.4, 3.6, 0.0))}) == {}  # no chair at that edge
    sofa = thing(8, "sofa", 0.6, 3.4, 0.0, (0.9, 1.8, 0.8))
    assert faults(things | {"sofa": sofa}) == {"table_at_sofa": [1], "seat_faces_wall": [8]}
    assert faults(things | {"sofa": replace(sofa, position_m=(0.6, 4.9, 0.0))}) == {}


@pytest.mark.parametrize(
    ("change", "expected"),
    [
        ({"low": thing(51, "coffee_table", 2.73, 3.0, WEST, (0.6, 1.0, 0.4))}, {"seat_cramped": [50]}),  # 0.02 m before the sofa
        ({"bed": thing(54, "bed", 1.9, 5.0, WEST, (2.0, 0.9, 0.5)), "armchair": thing(52, "armchair", 1.9, 3.95, NORTH, (0.8, 0.8, 0.8))},
         {"seat_cramped": [52], "seat_alone": [52], "bed_off_wall": [54]}),
        ({"screen": thing(53, "television", 0.2, 0.8, 0.0, (0.1, 1.0, 0.6), 0.5)}, {}),  # 34 degrees aside
        ({"screen": thing(53, "television", 0.8, 0.2, NORTH, (0.1, 1.0, 0.6), 0.5)}, {"screen_aside": [53]}),
    ],
)  # fmt: skip
def test_seats_have_room_for_feet_and_look_at_the_screen(change: Things, expected: dict[str, list[int]]) -> None:
    assert faults(SITTING | change, "living_room") == expected


def test_screens_and_what_hangs_keep_off_windows() -> None:
    sofa = thing(50, "sofa", 1.5, 2.5, NORTH, (0.9, 2.0, 0.8))
    screen = thing(51, "television", 1.5, 5.8, SOUTH, (0.1, 1.0, 0.3), 0.4)  # below the window, x = 2 to 3
    picture = replace(thing(52, "picture", 2.5, 5.99, SOUTH, (0.02, 0.4, 0.3), 2.1), support=Support(kind="wall", wall=2))
    assert faults({"sofa": sofa, "screen": replace(screen, position_m=(1.4, 5.8, 0.4))}, "living_room") == {}
    moved = {"sofa": sofa, "screen": replace(screen, position_m=(2.4, 5.8, 0.4))}
    assert faults(moved, "living_room") == {"screen_before_window": [51]}
    assert faults({"picture": picture}) == {"hangs_at_window": [52]}
    assert faults({"picture": replace(picture, position_m=(1.5, 5.99, 2.1))}) == {}


def test_no_door_opens_into_the_corner_of_a_sofa() -> None:
    sofa = thing(50, "corner_sofa", 1.2, 1.2, NORTH, (1.8, 2.2, 0.8))
    assert faults({"sofa": sofa})["door_in_corner"] == [50]
    assert faults({"sofa": replace(sofa, position_m=(1.2, 2.2, 0.0))}) == {}


def test_wardrobes_open_nightstands_are_reached_and_nothing_stands_aslant() -> None:
    bench = thing(11, "pouf", 3.0, 1.0, 0.0, (0.2, 0.5, 0.4))  # from 0.15 to 0.65 m before the wardrobe
    assert faults(GOOD | {"bench": bench}) == {}
    assert faults(GOOD | {"bench": replace(bench, size_m=(0.5, 0.5, 0.4))}) == {"wardrobe_shut": [4]}
    assert faults(GOOD | {"pouf": thing(11, "pouf", 3.3, 1.95, 0.0, (0.4, 0.4, 0.4))}) == {"bedside_blocked": [3]}
    assert faults(GOOD | moved("bookshelf", 0.17, 5.0, 0.035)) == {"askew": [5]}  # 2 degrees
    assert faults(GOOD | moved("rug", 2.0, 4.5, 0.05)) == {"rug_askew": [7]}
    assert faults(GOOD | moved("rug", 0.6, 4.5)) == {"store_on_rug_edge": [5]}
