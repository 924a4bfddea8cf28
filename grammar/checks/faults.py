"""What a person finds odd in a furnished room: faults of use, one row each.

No fault makes objects overlap or float; :mod:`grammar.checks.validity` looks after that.  The functions read where things stand and the
roles of their categories (``config/categories.yaml``), so they judge sampled rooms and real ones alike.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import NamedTuple

from grammar.checks import use_of_bathrooms as bathrooms
from grammar.checks import use_of_doors as doors
from grammar.checks import use_of_furniture as furniture
from grammar.checks import use_of_kitchens as kitchens
from grammar.checks import use_of_machines as machines
from grammar.checks import use_of_seats as seats
from grammar.checks import use_of_tables as tables
from grammar.checks.furnished import Furnished, furnished
from grammar.spec.categories import Categories, Role
from scene_description import SceneDescription


class Fault(NamedTuple):
    """A fault: its name, what it says, and the function that returns the ids of the objects at fault (0: the room itself).

    ``of_layout``: another layout of the same objects may do without it, so layouts with it are passed over.
    """

    name: str
    says: str
    find: Callable[[Furnished], list[int]]
    of_layout: bool = True


FAULTS = (
    Fault("switch_behind_door", "a light switch is on the hinge side of a door that opens into the room", doors.switch_behind_door),
    Fault("shown_behind_door", "a picture, mirror, clock or board is behind an open door", doors.shown_behind_door),
    Fault("shown_hidden", "a picture, mirror, clock or board is hidden to a quarter by what stands before it", doors.shown_hidden),
    Fault("rug_in_swing", "a rug or mat lies where a door swings", doors.rug_in_swing),
    Fault("door_in_corner", "a door opens into the corner of a sofa", doors.door_in_corner),
    Fault("before_window", "a thing covers 15 % of a window", doors.before_window),
    Fault("hangs_at_window", "a picture, mirror, clock or shelf hangs above or below a window", doors.hangs_at_window),
    Fault("curtain_off_window", "a curtain hangs where no window is", doors.curtain_off_window),
    Fault("hooks_over_heater", "hooks for coats hang over a radiator", doors.hooks_over_heater),
    Fault("screen_unseen", "no seat faces a television that faces it", seats.screen_unseen),
    Fault("chair_at_no_table", "a chair or stool faces no table or desk", seats.chair_at_no_table),
    Fault("second_screen", "a room has two televisions", seats.second_screen),
    Fault("screen_hidden", "things cover 15 % of a television", seats.screen_hidden),
    Fault("chair_behind_chair", "another chair stands between a chair and its table", seats.chair_behind_chair),
    Fault("coffee_table_astray", "no sofa or armchair stands at a coffee table", seats.coffee_table_astray),
    Fault("seat_faces_wall", "a sofa or armchair faces a wall or something high close by", seats.seat_faces_wall),
    Fault("seat_alone", "a sofa or armchair of a living room looks at no coffee table, television or other such seat", seats.seat_alone),
    Fault("seat_cramped", "a sofa or armchair has no room for feet before it", seats.seat_cramped),
    Fault("screen_before_window", "a television stands before a window", seats.screen_before_window),
    Fault("screen_aside", "a television is more than 40 degrees aside of the largest sofa or bed", seats.screen_aside),
    Fault("place_shared", "chairs of one table are too close to each other", tables.place_shared),
    Fault("chair_at_corner", "a chair is drawn up to a corner of its table", tables.chair_at_corner),
    Fault("chair_wedged", "what stands behind a chair is nearer than 0.5 m to its table", tables.chair_wedged),
    Fault("filler_at_table", "a plant, bin or lamp stands where people sit at a table", tables.filler_at_table),
    Fault("table_at_sofa", "a table for meals stands at a sofa, an armchair or a low table", tables.table_at_sofa),
    Fault("bedside_blocked", "something stands before a nightstand", furniture.bedside_blocked),
    Fault("wardrobe_shut", "the doors of a wardrobe do not open", furniture.wardrobe_shut),
    Fault("askew", "furniture at a wall is turned from it by 1.2 to 15 degrees", furniture.askew),
    Fault("rug_askew", "a rug is turned from the walls by more than 1.5 degrees", furniture.rug_askew),
    Fault("store_on_rug_edge", "a store stands on a rug with a part of its foot only", furniture.store_on_rug_edge),
    Fault("stands_on_mat", "something stands on a mat for feet or exercise", furniture.stands_on_mat),
    Fault("pot_on_rug_edge", "a plant or vase stands on a rug with a part of its foot only", furniture.pot_on_rug_edge),
    Fault("stands_astray", "a plant, vase, bin or lamp stands free, 0.4 m off walls and furniture", furniture.stands_astray),
    Fault("pot_under_table", "a plant or vase stands below a table", furniture.pot_under_table),
    Fault("fillers_huddled", "three or more plants, vases, bins, lamps or balls stand in one heap", machines.fillers_huddled),
    Fault(
        "thing_before_front", "a plant, vase, bin, lamp, ball or machine stands before the front of a store", machines.thing_before_front
    ),
    Fault("machine_hemmed", "nobody gets on a machine: its front or both its sides are blocked", machines.machine_hemmed),
    Fault("mat_hemmed", "furniture is close to a mat for exercise, or another mat lies askew beside it", machines.mat_hemmed),
    Fault("car_shut_in", "the doors of a car open at neither side, or things touch it or stand in its way out", machines.car_shut_in),
    Fault("front_blocked", "the front of a store or appliance is blocked to more than half", furniture.front_blocked),
    Fault("shelf_off_wall", "a shelf has no wall behind its back", furniture.shelf_off_wall),
    Fault("wardrobe_off_wall", "a wardrobe has no wall behind its back", furniture.wardrobe_off_wall),
    Fault("bed_off_wall", "the head of a bed is not at a wall", furniture.bed_off_wall),
    Fault("back_off_wall", "a toilet, washbasin, sideboard or the like has no wall behind its back", furniture.back_off_wall),
    Fault("bedside_astray", "a nightstand is further than 0.3 m from the bed", furniture.bedside_astray),
    Fault("basin_off_mirror", "no mirror hangs over a washbasin, though the room has one", furniture.basin_off_mirror),
    Fault("no_bathing", "a bathroom has neither bath nor shower", furniture.no_bathing, of_layout=False),
    Fault("paper_out_of_reach", "toilet paper hangs further than 0.9 m from the toilet", bathrooms.paper_out_of_reach),
    Fault("towel_out_of_reach", "a towel hangs further than 1.6 m from bath, shower and basin", bathrooms.towel_out_of_reach),
    Fault("mat_astray", "a bath mat lies before no bath, shower or basin", bathrooms.mat_astray),
    Fault(
        "toilet_cramped", "there is too little room for knees before a toilet, or something stands at its side", bathrooms.toilet_cramped
    ),
    Fault("fixture_blocked", "the front of a bath, shower or basin is blocked to more than half", bathrooms.fixture_blocked),
    Fault("bathing_off_corner", "a bath or shower stands in no corner", bathrooms.bathing_off_corner),
    Fault("cabinet_overhead", "a deep cabinet hangs over a toilet, bath, shower or basin", bathrooms.cabinet_overhead),
    Fault("gap_in_run", "a gap of 3 to 35 cm parts two kitchen units at a wall", kitchens.gap_in_run),
    Fault("run_in_pieces", "kitchen units at one wall stand apart with no door between them, or one stands alone", kitchens.run_in_pieces),
    Fault("fridge_off_wall", "a refrigerator has no wall behind its back", furniture.fridge_off_wall),
    Fault("hood_off_hob", "a hood is not over a hob", kitchens.hood_off_hob),
    Fault("kitchen_lacks", "a kitchen has no sink or no hob", kitchens.kitchen_lacks, of_layout=False),
    Fault("no_vehicle_door", "a garage has no door for a vehicle", kitchens.no_vehicle_door, of_layout=False),
)
"""All faults, in the order of the tables that print them."""


def find_faults(found: Furnished, *, of_layout: bool = False) -> dict[str, list[int]]:
    """Return the faults that a room has, or only those of its layout: name -> ids of the objects at fault, 0 for the room itself."""
    all_found = ((fault.name, fault.find(found)) for fault in FAULTS if fault.of_layout or not of_layout)
    return {name: ids for name, ids in all_found if ids}


_NEEDS: tuple[tuple[Role, Role], ...] = (
    ("screen", "seat"),
    ("pulled_up", "table"),
    ("desk", "pulled_up"),
    ("hood", "hob"),
    ("toilet", "bathing"),
)
"""Roles of which the first has no place, however it stands, in a room that has nothing with the second."""


def always_odd(categories: Categories, names: Iterable[str]) -> bool:
    """Return whether every layout of objects of these categories has a fault."""
    roles = {role for name in set(names) for role in categories[name].roles}
    return any(one in roles and other not in roles for one, other in _NEEDS)


def scene_faults(scene: SceneDescription, categories: Categories) -> dict[str, list[int]]:
    """Return :func:`find_faults` of a scene description."""
    return find_faults(furnished(scene.category, scene.room, scene.objects, categories))


def faults_table() -> str:
    """Return all rows as a Markdown table."""
    lines = ["| fault | what it says | another layout may do without it |", "|---|---|---|"]
    lines += [f"| `{fault.name}` | {fault.says} | {'yes' if fault.of_layout else 'no'} |" for fault in FAULTS]
    return "\n".join(lines) + "\n"
