"""What a person finds odd in a furnished room: faults of use, one row each.

No fault makes objects overlap or float; :mod:`grammar.checks.validity` looks after that.  The functions read where things stand and the
roles of their categories (``config/categories.yaml``), so they judge sampled rooms and real ones alike.
"""

from collections import Counter
from collections.abc import Callable, Sequence
from typing import NamedTuple

from grammar.checks import use_of_doors as doors
from grammar.checks import use_of_fixtures as fixtures
from grammar.checks import use_of_furniture as furniture
from grammar.checks import use_of_seats as seats
from grammar.checks.furnished import Furnished, blocked, covered, each, far, furnished, near, off_wall
from grammar.derivation.parse_tree import Item
from grammar.layout.assemble import around_target
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


def _fault(find: Callable[[Furnished], list[int]], says: str, of_layout: bool = True) -> Fault:
    """Return the fault that has the name of its function."""
    return Fault(find.__name__, says, find, of_layout)


FAULTS = (
    _fault(doors.switch_behind_door, "a light switch is on the hinge side of a door that opens into the room"),
    Fault(
        "shown_behind_door", "a picture, mirror, clock or board is behind an open door", each(doors.behind_door, "shown", on_floor=False)
    ),
    _fault(doors.shown_hidden, "a picture, mirror, clock or board is hidden to a quarter by what stands before it"),
    Fault("hung_over_bed", "a mirror or hooks for coats hang over a bed", each(near(0.05, "bed"), "mirror", "hooks", on_floor=False)),
    _fault(doors.thing_in_doorway, "a table for meals, plant, vase, bin, lamp or ball stands in the way of a door"),
    _fault(doors.rug_in_swing, "a rug or mat lies where a door swings"),
    _fault(doors.door_in_corner, "a door opens into the corner of a sofa"),
    _fault(doors.before_window, "a thing covers 15 % of a window"),
    Fault(
        "hangs_at_window",
        "a picture, mirror, clock or shelf hangs above or below a window",
        each(doors.at_window, "shown", "wall_shelf", on_floor=False),
    ),
    _fault(doors.curtain_off_window, "a curtain does not hang before the middle of a window"),
    Fault(
        "hooks_over_heater", "hooks for coats hang over a radiator", each(near(-0.03, "heater", on_floor=False), "hooks", on_floor=False)
    ),
    _fault(seats.screen_unseen, "no seat faces a television that faces it"),
    _fault(seats.chair_at_no_table, "a chair or stool faces no table or desk"),
    _fault(seats.second_screen, "a room has two televisions"),
    Fault("screen_hidden", "things cover 15 % of a television", each(covered(0.6, 0.15), "screen", on_floor=False)),
    _fault(seats.chair_behind_chair, "another chair stands between a chair and its table"),
    _fault(seats.coffee_table_astray, "no sofa or armchair stands at a coffee table"),
    _fault(seats.coffee_table_aside, "a low table in the room stands before no sofa or armchair"),
    _fault(seats.seat_faces_wall, "a sofa or armchair faces a wall or something high close by"),
    _fault(seats.seat_alone, "a sofa or armchair of a living room looks at no coffee table, television or other such seat"),
    _fault(seats.seat_cramped, "a sofa or armchair has no room for feet before it"),
    Fault("screen_before_window", "a television stands before a window", each(seats.before_window, "screen", on_floor=False)),
    _fault(seats.screen_aside, "a television is more than 40 degrees aside of the largest sofa or bed"),
    _fault(seats.place_shared, "chairs of one table are too close to each other"),
    _fault(seats.chair_at_corner, "a chair is drawn up to a corner of its table"),
    _fault(seats.chair_wedged, f"what stands behind a chair is nearer than {seats.SEATED_M:g} m to its table"),
    _fault(seats.filler_at_table, "a plant, bin or lamp stands where people sit at a table"),
    Fault(
        "table_at_sofa", "a table for meals stands at a sofa, an armchair or a low table", each(near(0.15, "lounge", "low_table"), "dining")
    ),
    _fault(furniture.bedside_blocked, "something stands before a nightstand"),
    Fault("wardrobe_shut", "the doors of a wardrobe do not open", each(blocked("front", 0.02, 0.45, 0.2), "wardrobe")),
    Fault("askew", "furniture at a wall is turned from it by 1.2 to 15 degrees", each(furniture.askew, "bed", "store")),
    _fault(furniture.rug_askew, "a rug is turned from the walls by more than 1.5 degrees"),
    Fault("store_on_rug_edge", "a store stands on a rug with a part of its foot only", each(furniture.on_rug_edge(0.08), "store")),
    Fault("stands_on_mat", "something stands on a mat for feet or exercise", each(furniture.stood_on, "mat")),
    Fault("pot_on_rug_edge", "a plant or vase stands on a rug with a part of its foot only", each(furniture.on_rug_edge(0.02), "pot")),
    Fault("stands_astray", "a plant, vase, bin or lamp stands free, 0.4 m off walls and furniture", each(furniture.astray, "filler")),
    Fault("pot_under_table", "a plant or vase stands below a table", each(near(-0.05, "table"), "pot")),
    _fault(furniture.fillers_huddled, "three or more plants, vases, bins, lamps or balls stand in one heap"),
    Fault(
        "thing_before_front",
        "a plant, vase, bin, lamp, ball or machine stands before the front of a store",
        each(furniture.before_front, "filler", "machine"),
    ),
    Fault("machine_hemmed", "nobody gets on a machine: its front or both its sides are blocked", each(furniture.hemmed, "machine")),
    _fault(furniture.mat_hemmed, "furniture is close to a mat for exercise, or another mat lies askew beside it"),
    Fault(
        "car_shut_in",
        "the doors of a car open at neither side, or things touch it or stand in its way out",
        each(furniture.shut_in, "vehicle"),
    ),
    _fault(furniture.front_shut, "an appliance or cabinet cannot be opened: a tenth of its front is blocked"),
    Fault(
        "front_blocked", "the front of a store or appliance is blocked to more than half", each(blocked("front", 0.05, 0.35, 0.5), "store")
    ),
    _fault(furniture.shelf_off_wall, "a shelf has no wall behind its back"),
    Fault("wardrobe_off_wall", "a wardrobe has no wall behind its back", each(off_wall("wardrobe"), "wardrobe")),
    Fault("bed_off_wall", "the head of a bed is not at a wall", each(off_wall("bed"), "bed")),
    Fault("back_off_wall", "a toilet, washbasin, sideboard or the like has no wall behind its back", each(off_wall("backed"), "backed")),
    Fault("bedside_astray", "a nightstand is further than 0.3 m from the bed", each(far(0.3, "bed"), "bedside")),
    _fault(furniture.basin_off_mirror, "no mirror hangs over a washbasin, though the room has one"),
    _fault(furniture.no_bathing, "a bathroom has neither bath nor shower", of_layout=False),
    _fault(fixtures.paper_out_of_reach, "toilet paper hangs further than 0.9 m from the toilet"),
    Fault(
        "towel_out_of_reach",
        "a towel hangs further than 1.6 m from bath, shower and basin",
        each(far(1.6, "bathing", "basin"), "towel", on_floor=False),
    ),
    _fault(fixtures.mat_astray, "a bath mat lies before no bath, shower or basin"),
    Fault(
        "toilet_cramped",
        "there is too little room for knees before a toilet, or something stands at its side",
        each(fixtures.cramped, "toilet"),
    ),
    Fault(
        "fixture_blocked",
        "the front of a bath, shower or basin is blocked to more than half",
        each(blocked("front", 0.05, 0.35, 0.5), "bathing", "basin"),
    ),
    Fault("bathing_off_corner", "a bath or shower stands in no corner", each(fixtures.off_corner, "bathing")),
    _fault(fixtures.cabinet_overhead, "a deep cabinet hangs over a toilet, bath, shower or basin"),
    _fault(fixtures.gap_in_run, "a gap of 3 to 35 cm parts two kitchen units at a wall"),
    _fault(fixtures.run_in_pieces, "kitchen units at one wall stand apart with no door between them, or one stands alone"),
    Fault("fridge_off_wall", "a refrigerator has no wall behind its back", each(off_wall("fridge"), "fridge")),
    _fault(fixtures.hood_off_hob, "a hood is not over a hob"),
    _fault(fixtures.kitchen_lacks, "a kitchen has no sink or no hob", of_layout=False),
    _fault(fixtures.no_vehicle_door, "a garage has no door for a vehicle", of_layout=False),
)
"""All faults, in the order of the tables that print them."""


def find_faults(found: Furnished, *, of_layout: bool = False) -> dict[str, list[int]]:
    """Return the faults that a room has, or only those of its layout: name -> ids of the objects at fault, 0 for the room itself."""
    all_found = ((fault.name, fault.find(found)) for fault in FAULTS if fault.of_layout or not of_layout)
    return {name: ids for name, ids in all_found if ids}


SEAT_M = 0.5
"""Least distance between the middles of chairs that stand side by side."""
LONE_CHAIR_M = 1.2
"""A table for meals that is as wide has more than one chair."""

_NEEDS: tuple[tuple[Role, Role], ...] = (
    ("screen", "seat"),
    ("pulled_up", "table"),
    ("desk", "pulled_up"),
    ("hood", "hob"),
    ("toilet", "bathing"),
)
"""Roles of which the first has no place, however it stands, in a room that has nothing with the second."""


def always_odd(categories: Categories, names: Sequence[str], company: bool = False) -> bool:
    """Return whether every layout of objects of these categories has a fault, in rooms whose seats look at something with ``company``."""
    roles = Counter(role for name in names for role in categories[name].roles)
    if company and roles["lounge"] == 1 and not (roles["screen"] or roles["low_table"]):
        return True
    return any(one in roles and other not in roles for one, other in _NEEDS)


def scene_faults(scene: SceneDescription, categories: Categories) -> dict[str, list[int]]:
    """Return :func:`find_faults` of a scene description."""
    return find_faults(furnished(scene.category, scene.room, scene.objects, categories))


def faults_table() -> str:
    """Return all rows as a Markdown table."""
    lines = ["| fault | what it says | another layout may do without it |", "|---|---|---|"]
    lines += [f"| `{fault.name}` | {fault.says} | {'yes' if fault.of_layout else 'no'} |" for fault in FAULTS]
    return "\n".join(lines) + "\n"


def oddly_seated(categories: Categories, items: Sequence[Item]) -> bool:
    """Return whether every layout of these objects is odd for the chairs at its tables: too many or, for a large table, one alone."""
    return crowded(categories, items) or lone_chair(categories, items)


def lone_chair(categories: Categories, items: Sequence[Item]) -> bool:
    """Return whether a table for meals that is at least ``LONE_CHAIR_M`` wide has one chair only."""
    chairs = Counter(item.core for item in items if "pulled_up" in categories[item.rule.category].roles)
    tables = (item for item in items if "dining" in categories[item.rule.category].roles)
    return any(chairs[table.id] == 1 and max(table.size_m[:2]) >= LONE_CHAIR_M for table in tables)


def crowded(categories: Categories, items: Sequence[Item]) -> bool:
    """Return whether chairs of one table have to stand closer than ``SEAT_M`` side by side if each takes one of its preferred places."""
    by_id = {item.id: item for item in items}
    taken: dict[int, list[tuple[str, float, float]]] = {}
    for item in items:
        table = by_id.get(item.core or 0)
        if table is None or not item.rule.around or "pulled_up" not in categories[item.rule.category].roles:
            continue
        seats = taken.setdefault(table.id, [])
        free = (
            place
            for mode in item.rule.around
            for place in [(mode.side, *around_target(mode, item.size_m, table.size_m)[:2])]
            if all(place[0] != seat[0] or abs(place[1] - seat[1]) + abs(place[2] - seat[2]) >= SEAT_M for seat in seats)
        )
        place = next(free, None)
        if place is None:
            return True
        seats.append(place)
    return False
