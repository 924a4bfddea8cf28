"""The grammars of all room types: rooms are valid, groups hold together, every category has its place."""

from __future__ import annotations

import math
import re
from collections import Counter
from pathlib import Path

import numpy as np
import pytest
from small_grammar import CATEGORIES

from grammar import Grammar, SampledRoom, SceneRequest, read_grammar, read_room_type, room_types, sample_room
from grammar.checks.furnished import furnished
from grammar.checks.use_of_fixtures import gap_in_run, unit_rows_of
from grammar.derivation.derive import derive
from grammar.geometry.boxes import footprint_penetration
from grammar.geometry.solids import whole_box
from grammar.learning.branching import certain_objects
from grammar.learning.category_map import FURNITURE, THING
from grammar.small_things.rules import read_small_things
from scene_description import SceneObject
from scene_description.share import config_path

SEEDS = (0, 1)

# What makes rooms of these types.  Of each type, what its grammar always leads to is in every room.
ALWAYS = {
    "bathroom": {"washbasin", "toilet", "toilet_paper_holder"},
    "bedroom": {"bed"},
    "dining_room": {"dining_table", "dining_chair"},
    "garage": {"workbench", "storage_shelf"},
    "guest_room": {"bed", "nightstand"},
    "gym": {"treadmill", "dumbbell_rack", "exercise_mat"},
    "hallway": {"light_switch"},
    "kitchen": {"stove", "range_hood", "kitchen_counter", "sink_counter", "refrigerator"},
    "living_room": {"light_switch"},
    "office": {"desk", "desk_chair"},
    "storage": {"storage_shelf"},
    "study": {"desk", "desk_chair", "bookshelf"},
}
FACES = {
    ("dining_chair", "dining_table"),
    ("desk_chair", "desk"),
    ("tv_stand", "sofa"),
    ("armchair", "coffee_table"),
    ("bar_stool", "workbench"),
}
BEFORE_ITS_WALL_THING = {
    ("washbasin", "wall_mirror"),
    ("washbasin", "bathroom_cabinet"),
    ("console_table", "wall_mirror"),
    ("bench", "wall_hooks"),
}


@pytest.fixture(scope="module")
def grammars() -> dict[str, Grammar]:
    return {room_type: read_room_type(room_type, CATEGORIES) for room_type in room_types()}


@pytest.fixture(scope="module")
def rooms(grammars: dict[str, Grammar]) -> dict[str, list[SampledRoom]]:
    return {
        name: [sample_room(grammar, CATEGORIES, SceneRequest(room_type=name), np.random.default_rng(seed)) for seed in SEEDS]
        for name, grammar in grammars.items()
    }


def pairs(rooms: dict[str, list[SampledRoom]], wanted: set[tuple[str, str]]) -> list[tuple[SceneObject, SceneObject]]:
    """Return the objects with their core objects whose categories are among ``wanted``."""
    found = []
    for room in (room for sampled in rooms.values() for room in sampled):
        by_id = {item.id: item for item in room.objects}
        for item in room.objects:
            core = by_id.get(item.group or 0)
            if core is not None and (item.category, core.category) in wanted:
                found.append((item, core))
    return found


def in_frame_of(core: SceneObject, item: SceneObject) -> tuple[float, float]:
    c, s = math.cos(core.yaw_rad), math.sin(core.yaw_rad)
    dx, dy = item.position_m[0] - core.position_m[0], item.position_m[1] - core.position_m[1]
    return dx * c + dy * s, dy * c - dx * s


def levels(room: SampledRoom, item: SceneObject) -> int:
    """Return how many things stand on each other, from the floor or wall up to this one."""
    by_id = {other.id: other for other in room.objects}
    return 1 + (levels(room, by_id[item.support.id]) if item.support.kind == "object" else 0)


def reachable_symbols(grammar: Grammar) -> set[str]:
    found, to_visit = set(), [grammar.root]
    while to_visit:
        symbol = to_visit.pop()
        if symbol in grammar.nodes:
            to_visit.extend(branch.symbol for branch in grammar.nodes[symbol].branches)
        else:
            found.add(symbol)
    return found


def test_the_room_types_are_the_grammar_files() -> None:
    assert set(room_types()) >= set(ALWAYS)
    assert {f"{name}.yaml" for name in room_types()} | {"base.yaml"} == {path.name for path in config_path("grammars").iterdir()}


def test_every_category_has_its_place_in_some_room(grammars: dict[str, Grammar]) -> None:
    used = {grammar.objects[symbol].category for grammar in grammars.values() for symbol in reachable_symbols(grammar)}
    small = read_small_things(config_path("small_things.yaml"), CATEGORIES)
    used |= small.categories()
    assert used | {"door", "garage_door", "window", FURNITURE, THING} == set(CATEGORIES)
    assert len(CATEGORIES) >= 100


def test_no_grammar_holds_objects_that_nothing_leads_to(grammars: dict[str, Grammar]) -> None:
    for name, grammar in grammars.items():
        assert reachable_symbols(grammar) == set(grammar.objects), name


@pytest.mark.parametrize("room_type", room_types())
def test_rooms_are_valid_and_have_what_makes_them(
    rooms: dict[str, list[SampledRoom]], grammars: dict[str, Grammar], room_type: str
) -> None:
    for room in rooms[room_type]:
        assert room.validity.valid and all(check.passed for check in room.validity.checks)
        counts = Counter(item.category for item in room.objects)
        certain = {grammars[room_type].objects[symbol].category for symbol in certain_objects(grammars[room_type], room_type)}
        assert certain and certain | ALWAYS.get(room_type, set()) <= set(counts)
        assert counts["ceiling_lamp"] == 1


def degrees_off(item: SceneObject, core: SceneObject) -> float:
    """Return the angle between where a thing looks and the nearest point of its core's long axis."""
    (x, y), half_d, half_w = in_frame_of(core, item), 0.5 * core.size_m[0], 0.5 * core.size_m[1]
    reach_x, reach_y = max(half_d - half_w, 0.0), max(half_w - half_d, 0.0)
    to_axis = math.atan2(np.clip(y, -reach_y, reach_y) - y, np.clip(x, -reach_x, reach_x) - x)
    turn = item.yaw_rad - core.yaw_rad - to_axis
    return math.degrees(abs(math.atan2(math.sin(turn), math.cos(turn))))


def test_seats_and_screens_face_what_they_belong_to(rooms: dict[str, list[SampledRoom]]) -> None:
    found = pairs(rooms, FACES)
    assert len(found) >= 12
    for item, core in found:
        assert degrees_off(item, core) < 45.0, (item.category, core.category)


def test_what_has_its_place_before_a_thing_on_the_wall_stands_there(
    rooms: dict[str, list[SampledRoom]], grammars: dict[str, Grammar]
) -> None:
    asked = [SceneRequest(room_type="hallway", must_have=units) for units in (("console_table", "wall_mirror"), ("bench", "wall_hooks"))]
    hallways = [sample_room(grammars["hallway"], CATEGORIES, request, np.random.default_rng(0)) for request in asked]
    found = pairs({"bathroom": rooms["bathroom"], "hallway": hallways}, BEFORE_ITS_WALL_THING)
    assert len(found) >= 4 and {core.category for _, core in found} >= {"wall_mirror", "wall_hooks"}
    aside = [abs(in_frame_of(core, item)[1]) for item, core in found]
    assert np.median(aside) < 0.06
    for item, core in found:
        assert math.cos(item.yaw_rad - core.yaw_rad) > 0.95, (item.category, core.category)
        assert item.position_m[2] + item.size_m[2] < core.position_m[2] + core.size_m[2]


def test_what_hangs_over_a_unit_is_as_wide_as_it_and_above_it(rooms: dict[str, list[SampledRoom]]) -> None:
    found = pairs(rooms, {("range_hood", "stove"), ("wall_cabinet", "kitchen_counter"), ("wall_cabinet", "dishwasher")})
    assert len(found) >= 3
    for item, core in found:
        assert item.size_m[1] == pytest.approx(core.size_m[1], abs=1e-9)
        assert abs(in_frame_of(core, item)[1]) < 0.1 and math.cos(item.yaw_rad - core.yaw_rad) > 0.99
        assert item.position_m[2] > core.position_m[2] + core.size_m[2] + 0.3


def test_curtains_cover_their_window(grammars: dict[str, Grammar]) -> None:
    request = SceneRequest(room_type="study", must_have=("curtain",))
    for seed in range(2):
        room = sample_room(grammars["study"], CATEGORIES, request, np.random.default_rng(seed))
        curtain = next(item for item in room.objects if item.category == "curtain")
        window = next(opening for opening in room.room.openings if opening.id == curtain.group)
        assert curtain.support.wall == window.wall and curtain.size_m[1] > window.width_m + 0.5
        assert 0.0 < curtain.position_m[2] < 0.05 < window.sill_m  # from just above the floor
        assert curtain.position_m[2] + curtain.size_m[2] > window.sill_m + window.height_m
        start, end = (np.array(room.room.polygon_m[(window.wall + k) % len(room.room.polygon_m)]) for k in (0, 1))
        along = (np.array(curtain.position_m[:2]) - start) @ (end - start) / np.linalg.norm(end - start)
        assert abs(along - window.offset_m - 0.5 * window.width_m) < 0.5 * (curtain.size_m[1] - window.width_m)


def test_every_chair_has_a_place_of_its_own_and_its_plate_before_it(grammars: dict[str, Grammar]) -> None:
    request = SceneRequest(room_type="dining_room", must_have=("plate",))
    for seed in range(3):
        tree = derive(grammars["dining_room"], CATEGORIES, request, np.random.default_rng(seed))
        chairs = [item for item in tree.items if item.rule.category == "dining_chair"]
        plates = [item for item in tree.items if item.rule.category == "plate"]
        assert len(chairs) == len(plates) >= 4
        assert len({(item.rule.around, item.symbol) for item in chairs}) == len(chairs)
        assert len({(item.rule.placements, item.symbol) for item in plates}) == len(plates)
        for chair, plate in zip(chairs, plates, strict=True):
            (place,), (lies,) = chair.rule.around, plate.rule.placements
            assert {"front": (lies.depth_fraction or 0) > 0.5, "back": (lies.depth_fraction or 0) < -0.5,
                    "left": (lies.width_fraction or 0) > 0.5, "right": (lies.width_fraction or 0) < -0.5}[place.side]  # fmt: skip
            if place.side in ("front", "back"):
                assert place.align * (lies.width_fraction or 0) > 0


def test_addresses_stay_within_their_unit_and_corners_are_taken_once(grammars: dict[str, Grammar]) -> None:
    lamps, in_corners = 0, 0
    for seed in range(60):
        tree = derive(grammars["bedroom"], CATEGORIES, SceneRequest(), np.random.default_rng(seed))
        last = tree.items[-1].id
        taken = [item.core for item in tree.items if item.core is not None and item.core > last]
        assert len(set(taken)) == len(taken) == len(tree.corners)
        in_corners += len(taken)
        by_lamp = [item.supporters for item in tree.items if item.symbol == "table_lamp"]
        assert all(len(supporters) == 1 for supporters in by_lamp) and len(set(by_lamp)) == len(by_lamp)
        lamps += len(by_lamp) == 2
    assert lamps >= 5 and in_corners >= 10


def test_bookshelves_of_a_study_and_shelves_of_a_storage_room_stand_side_by_side(rooms: dict[str, list[SampledRoom]]) -> None:
    gaps = []
    for room_type, category in (("study", "bookshelf"), ("storage", "storage_shelf")):
        for room in rooms[room_type]:
            shelves = [whole_box(item) for item in room.objects if item.category == category]
            gaps += [min(-footprint_penetration(a, b) for b in shelves if b is not a) for a in shelves if len(shelves) > 1]
    assert gaps and np.median(gaps) == pytest.approx(0.0, abs=1e-6)


def test_units_of_a_kitchen_stand_in_one_run_or_two_without_gaps_and_an_island(rooms: dict[str, list[SampledRoom]]) -> None:
    for room in rooms["kitchen"]:
        seen = furnished("kitchen", room.room, room.objects, CATEGORIES)
        runs = unit_rows_of(seen)
        kinds = [{item.category for item in run} for run in runs]
        at_walls = [kind for kind in kinds if kind != {"island_counter"}]
        assert all("peninsula_corner" in kind for kind in at_walls if "island_counter" in kind)
        assert 1 <= len(at_walls) <= 2 and len(runs) <= len(at_walls) + 1 and gap_in_run(seen) == []
        units = [item for item in room.objects if "unit" in CATEGORIES[item.category].roles]
        assert len(units) >= 4 and {item.id for item in units} <= {item.id for run in runs for item in run}


def test_tables_are_laid_before_the_chairs(grammars: dict[str, Grammar]) -> None:
    laid = 0
    for seed in range(3):
        room = sample_room(
            grammars["dining_room"], CATEGORIES, SceneRequest(room_type="dining_room", min_objects=24), np.random.default_rng(seed)
        )
        chairs = [item for item in room.objects if item.category == "dining_chair"]
        for plate in (item for item in room.objects if item.category == "plate"):
            nearest = min(chairs, key=lambda chair: math.dist(chair.position_m[:2], plate.position_m[:2]))
            x, y = in_frame_of(nearest, plate)
            assert 0.0 < x < 0.6 and abs(y) < 0.25
            laid += 1
    assert laid >= 4


def test_things_stand_on_things_to_three_levels(grammars: dict[str, Grammar]) -> None:
    request = SceneRequest(room_type="storage", min_objects=14)
    stacks = [sample_room(grammars["storage"], CATEGORIES, request, np.random.default_rng(seed)) for seed in range(4)]
    assert max(levels(room, item) for room in stacks for item in room.objects) >= 3


def test_the_tutorial_adds_a_room_type(tmp_path: Path) -> None:
    text = (Path(__file__).parents[2] / "docs" / "grammar.md").read_text(encoding="utf-8")
    block = next(block for block in re.findall(r"```yaml\n(.*?)```", text, re.DOTALL) if "room_type: waiting_room" in block)
    assert len(block.splitlines()) <= 25
    (tmp_path / "waiting_room.yaml").write_text(block, encoding="utf-8")
    grammar = read_grammar(tmp_path / "waiting_room.yaml", CATEGORIES)
    for seed in range(5):
        room = sample_room(grammar, CATEGORIES, SceneRequest(room_type="waiting_room"), np.random.default_rng(seed))
        by_id = {item.id: item for item in room.objects}
        seats = [item for item in room.objects if item.category == "armchair"]
        assert room.validity.valid
        assert 2 <= len(seats) <= 3
        for seat in seats:
            assert degrees_off(seat, by_id[seat.group or 0]) < 45.0
