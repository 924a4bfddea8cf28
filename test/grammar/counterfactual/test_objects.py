"""Changes of objects and of the room: known answers, what goes along, and the validity gate."""

from __future__ import annotations

import math

import numpy as np
import pytest
from counterfactual_rooms import room, rules

from grammar.counterfactual import Change, ChangeError, InvalidChangeError, apply_change
from scene_description import SceneDescription, SceneObject


def change(scene: SceneDescription, factor: str, value: object, seed: int = 0, **target: object) -> SceneDescription:
    return apply_change(scene, Change(factor, target, value, seed), rules())


def one(scene: SceneDescription, category: str, place: int = 0) -> SceneObject:
    return [item for item in scene.objects if item.category == category][place]


def place(scene: SceneDescription, identifier: int) -> np.ndarray:
    return np.array(next(item.position_m for item in scene.objects if item.id == identifier))


def ids(scene: SceneDescription) -> set[int]:
    return {item.id for item in scene.objects}


def on_top(scene: SceneDescription, identifier: int) -> set[int]:
    return {item.id for item in scene.objects if item.support.id == identifier}


@pytest.fixture(scope="module")
def bedroom() -> SceneDescription:
    return room("bedroom")


def test_an_object_goes_with_what_it_carries_and_with_its_lamp(bedroom: SceneDescription) -> None:
    lamps = {light.object for light in bedroom.lights}
    stands = [item for item in bedroom.objects if item.category == "nightstand" and on_top(bedroom, item.id) & lamps]
    stand = max(stands, key=lambda item: len(on_top(bedroom, item.id)))
    things = on_top(bedroom, stand.id)
    after = change(bedroom, "object_removed", True, object=stand.id)
    assert ids(bedroom) - ids(after) == {stand.id} | things
    assert {light.object for light in bedroom.lights} - {light.object for light in after.lights} == things & lamps
    (record,) = after.counterfactuals or ()
    assert record.removed == tuple(sorted({stand.id} | things)) and "table_lamp_" in record.note
    kept = {item.id: item for item in bedroom.objects}
    assert all(kept[item.id] == item for item in after.objects)
    assert after.validity.valid and after.parse_graph == bedroom.parse_graph


def test_members_of_a_group_stay_without_their_core(bedroom: SceneDescription) -> None:
    bed = one(bedroom, "bed")
    members = [item.id for item in bedroom.objects if item.group == bed.id]
    after = change(bedroom, "object_removed", True, object=bed.id)
    assert members and all(item.group is None for item in after.objects if item.id in members)
    assert (after.counterfactuals or ())[0].objects == tuple(members)


def test_more_are_removed_after_those_that_fewer_take(bedroom: SceneDescription) -> None:
    gone = [ids(bedroom) - ids(change(bedroom, "object_removed", k, category="book_stack")) for k in (0, 1, 2)]
    assert [len(found) for found in gone] == [0, 1, 2] and gone[1] < gone[2]
    stacks = sum(item.category == "book_stack" for item in bedroom.objects)
    with pytest.raises(ChangeError, match=f"expected at most {stacks}, the objects that are targeted, got {stacks + 1}"):
        change(bedroom, "object_removed", stacks + 1, category="book_stack")


def test_clutter_is_small_things_and_leaves_lamps(bedroom: SceneDescription) -> None:
    lamps = {light.object for light in bedroom.lights}
    things = {item.id for item in bedroom.objects if item.support.kind == "object"} - lamps
    assert ids(bedroom) - ids(change(bedroom, "clutter", 0)) == things
    some, more = (change(bedroom, "clutter", factor) for factor in (1.34, 2.0))
    added = round(1.34 * len(things)) - len(things)
    assert len(ids(some) - ids(bedroom)) == added > 0 and len(ids(more) - ids(bedroom)) == len(things)
    assert more.objects[: len(some.objects)] == some.objects
    for item in more.objects[len(bedroom.objects) :]:
        assert item.support.kind == "object" and item.parts and item.category not in ("table_lamp", "desk_lamp")
    assert more.validity.valid and more.lights == bedroom.lights


def test_added_objects_stand_where_the_room_stays_valid_and_have_ids_of_their_own(bedroom: SceneDescription) -> None:
    after = change(bedroom, "object_added", 1, category="potted_plant")
    plant = after.objects[-1]
    assert plant.category == "potted_plant" and plant.id == max(ids(bedroom)) + 1 and after.objects[:-1] == bedroom.objects
    assert after.validity.valid and plant.position_m[2] == 0.0 and plant.parts
    assert place(change(bedroom, "object_added", 1, seed=1, category="potted_plant"), plant.id).tolist() != list(plant.position_m)
    again = change(change(after, "object_removed", True, object=plant.id), "object_added", 1, category="potted_plant")
    assert again.objects[-1].id == plant.id + 1
    lamp = change(bedroom, "object_added", 1, category="floor_lamp")
    assert [light.object for light in lamp.lights[len(bedroom.lights) :]] == [lamp.objects[-1].id]
    with pytest.raises(InvalidChangeError, match="got room for"):
        change(bedroom, "object_added", 9, category="bed")
    with pytest.raises(ChangeError, match="a category to add"):
        change(bedroom, "object_added", 1, category="dragon")


def test_an_object_is_put_exactly_on_what_carries_it_where_it_was_asked_for(bedroom: SceneDescription) -> None:
    stand = one(bedroom, "nightstand")
    bare = bedroom
    for thing in on_top(bedroom, stand.id):
        bare = change(bare, "object_removed", True, object=thing)
    x, y, _ = stand.position_m
    mug = change(bare, "object_placed", {"at_m": [x, y, stand.size_m[2] - 0.02], "yaw_rad": 7.0, "seed": 5}, category="mug").objects[-1]
    assert mug.support.id == stand.id and mug.position_m[:2] == (x, y) and mug.model.seed == 5
    assert mug.yaw_rad == pytest.approx(7.0 - 2.0 * math.pi)
    assert mug.position_m[2] == pytest.approx(stand.size_m[2], abs=1e-3)
    wall = next(item for item in bedroom.objects if item.support.kind == "wall")
    free = change(bedroom, "object_removed", True, object=wall.id)
    near = [wall.position_m[0] + 0.01 * math.cos(wall.yaw_rad), wall.position_m[1] + 0.01 * math.sin(wall.yaw_rad), 1.5]
    clock = change(free, "object_placed", {"at_m": near, "yaw_rad": wall.yaw_rad + 0.05}, category="wall_clock").objects[-1]
    assert clock.support == wall.support and math.remainder(clock.yaw_rad - wall.yaw_rad, 2.0 * math.pi) == pytest.approx(0.0, abs=1e-9)


@pytest.mark.parametrize(
    ("category", "at_m", "extra", "said"),
    [
        ("potted_plant", (0.0, 0.0, 5.0), {}, "expected a place on the floor"),
        ("wall_clock", (1e3, 0.0, 1.5), {}, "a wall, with its back to it"),
        ("potted_plant", (0.0, 0.0, 0.0), {"style": "dragon"}, "value.style: expected one of"),
        ("potted_plant", (900.0, 0.0, 0.0), {}, "out_of_bounds"),
        ("dragon", (0.0, 0.0, 0.0), {}, "a category to add"),
        ("potted_plant", "here", {}, "value.at_m"),
    ],
)
def test_a_place_where_nothing_carries_the_object_is_refused(
    bedroom: SceneDescription, category: str, at_m: object, extra: dict[str, object], said: str
) -> None:
    with pytest.raises(ChangeError, match=said):
        change(bedroom, "object_placed", {"at_m": list(at_m) if isinstance(at_m, tuple) else at_m, **extra}, category=category)


def test_what_moves_takes_along_what_it_carries(bedroom: SceneDescription) -> None:
    stand = one(bedroom, "nightstand", 1)
    after = change(bedroom, "object_moved", [0.01, 0.0, 0.0], object=stand.id)
    together = {stand.id} | on_top(bedroom, stand.id)
    for item in bedroom.objects:
        shift = place(after, item.id) - np.array(item.position_m)
        assert shift == pytest.approx((0.01, 0.0, 0.0) if item.id in together else (0.0, 0.0, 0.0))
    plant = one(bedroom, "potted_plant")
    turned = next(item for item in change(bedroom, "object_moved", [0, 0, 0.5], object=plant.id).objects if item.id == plant.id)
    assert turned.position_m == plant.position_m
    assert math.remainder(turned.yaw_rad - plant.yaw_rad - 0.5, math.tau) == pytest.approx(0.0, abs=1e-9)


def test_an_invalid_change_says_which_check_fails_and_where(bedroom: SceneDescription) -> None:
    bed = one(bedroom, "bed")
    backwards = [-math.cos(bed.yaw_rad), -math.sin(bed.yaw_rad), 0.0]  # through the wall behind its head
    with pytest.raises(InvalidChangeError) as caught:
        change(bedroom, "object_moved", backwards, object=bed.id)
    assert {"out_of_bounds"} <= {check.name for check in caught.value.checks}
    assert "out_of_bounds" in str(caught.value) and f"{bed.id} bed" in str(caught.value) and "\n" not in str(caught.value)
    x, y, z = bedroom.camera_path[0].position_m
    plant = one(bedroom, "potted_plant")
    raised = max(bedroom.objects, key=lambda item: item.size_m[2] if item.support.kind == "floor" else 0.0)
    with pytest.raises(InvalidChangeError, match="camera_clear"):
        dx, dy = x - raised.position_m[0], y - raised.position_m[1]
        change(bedroom, "object_moved", [dx, dy, 0.0], object=raised.id)
    assert z < raised.size_m[2] and plant.id != raised.id


def test_another_model_stands_in_the_same_place(bedroom: SceneDescription) -> None:
    chair = one(bedroom, "armchair")
    specimen = next(item for item in change(bedroom, "object_replaced", {"seed": 99}, object=chair.id).objects if item.id == chair.id)
    assert specimen.model.seed == 99 and specimen.model.style == chair.model.style
    assert (specimen.position_m, specimen.size_m, specimen.parts) == (chair.position_m, chair.size_m, chair.parts)
    styles = sorted(set(rules().appearance.categories["armchair"].styles) - {chair.model.style})
    styled = next(item for item in change(bedroom, "object_replaced", styles[0], object=chair.id).objects if item.id == chair.id)
    assert styled.model.style == styles[0] and styled.size_m == chair.size_m
    old = {part.name: part.material for part in chair.parts}
    assert all(part.material == old[part.name] for part in styled.parts if part.name in old)
    plant = one(bedroom, "potted_plant")
    after = change(bedroom, "object_replaced", "floor_lamp", object=plant.id)
    lamp = next(item for item in after.objects if item.id == plant.id)
    assert lamp.category == "floor_lamp" and after.validity.valid and after.lights[-1].object == plant.id
    with pytest.raises(ChangeError, match="expected a style of armchair"):
        change(bedroom, "object_replaced", "throne", object=chair.id)


def test_a_larger_room_keeps_gaps_to_walls_and_the_shape_of_groups(bedroom: SceneDescription) -> None:
    after = change(bedroom, "room_size", 1.25)
    old, new = (np.array(scene.room.polygon_m) for scene in (bedroom, after))
    assert new == pytest.approx(1.25 * old) and after.validity.valid and after.camera_path == bedroom.camera_path
    bed = one(bedroom, "bed")
    forward = np.array([math.cos(bed.yaw_rad), math.sin(bed.yaw_rad)])  # from the wall behind its head
    step = (place(after, bed.id) - np.array(bed.position_m))[:2]
    assert step @ forward == pytest.approx(0.25 * float((old @ forward).min()), abs=0.02)
    for item in bedroom.objects:
        if item.group == bed.id:
            step = place(after, item.id) - np.array(item.position_m)
            assert step == pytest.approx(place(after, bed.id) - np.array(bed.position_m))
    door, wider = bedroom.room.openings[0], after.room.openings[0]
    length = float(np.hypot(*(old[(door.wall + 1) % len(old)] - old[door.wall])))
    share = door.offset_m / (length - door.width_m)
    assert wider.offset_m == pytest.approx(share * (1.25 * length - door.width_m)) and wider.width_m == door.width_m


def test_smaller_rooms_are_made_valid_by_sliding_things() -> None:
    """Of eight at least six; where a thing would stand in a door's way, say, the change is refused."""
    made = 0
    for bedroom in (room("bedroom", seed) for seed in range(1, 9)):
        try:
            after = change(bedroom, "room_size", 0.95)
        except InvalidChangeError:
            continue
        assert after.validity.valid and all(item.size_m == other.size_m for item, other in zip(bedroom.objects, after.objects, strict=True))
        made += 1
    assert made >= 6
