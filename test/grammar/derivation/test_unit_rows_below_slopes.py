"""Runs below sloped ceilings: low units where these are low, tall ones where they are high, and nothing through them."""

import math

import numpy as np
import pytest
from small_grammar import CATEGORIES, closet, item, small_grammar

from grammar import sample_room
from grammar.derivation.derive import derive
from grammar.layout.assemble import assemble
from grammar.spec.grammar_file import read_room_type
from grammar.spec.request import RequestError, SceneRequest
from scene_description.ceilings import ceiling_height_m


def headroom_m(room, size_m, x, y, z, yaw):
    """Return how much higher the ceiling is than the top of a box at its lowest place, which is over a corner."""
    c, s, (depth, width, height) = math.cos(yaw), math.sin(yaw), size_m
    corners = [(x + u * depth * c - v * width * s, y + u * depth * s + v * width * c) for u in (-0.5, 0.5) for v in (-0.5, 0.5)]
    return min(ceiling_height_m(room, *corner) for corner in corners) - z - height


def run_grammar(units, run="{}", more=""):
    """Return a grammar of one run of units of given sizes, by symbol."""
    text = closet(*units).replace("kind: and,", f"kind: and, run: {run},")
    return small_grammar(text + "".join(item(name, "dresser", size, ", in_run: {}") for name, size in units.items()) + more)


def below(ceiling="two_slopes", eaves=1.0, pitch=40.0):
    return SceneRequest(room_type="closet", room_ceiling=ceiling, room_eaves_m=eaves, room_pitch_deg=pitch, room_height_m=2.5)


@pytest.mark.parametrize("ceiling", ["one_slope", "two_slopes"])
def test_a_run_of_low_and_tall_units_stands_where_each_fits(ceiling):
    """The tall unit is 2 m high, the eaves are 1 m: it stands 1.2 m from them at least, the low ones anywhere."""
    grammar, at_eaves = run_grammar({"low": (0.6, 1.2, 0.8), "lower": (0.6, 0.9, 0.7), "tall": (0.6, 0.6, 2.0)}), 0
    for seed in range(6):
        tree = derive(grammar, CATEGORIES, below(ceiling), np.random.default_rng(seed))
        _, state = assemble(grammar, CATEGORIES, tree)
        for thing in tree.items:
            x, y, yaw = state.pose[thing.id - 1]
            assert headroom_m(tree.room, thing.size_m, x, y, 0.0, yaw) >= -1e-9
            at_eaves += thing.symbol != "tall" and headroom_m(tree.room, thing.size_m, x, y, 0.0, yaw) < 1.0
    assert at_eaves > 0


def test_units_leave_headroom_for_what_stands_on_them():
    """Shelves of 1.6 m carry boxes of 0.5 m: together they need 2.1 m."""
    box = item("box", "cardboard_box", (0.3, 0.3, 0.5), ", mount: object, supporters: {shelf: 1}, placements: [{depth_fraction: 0}]")
    text = closet("row", "box").replace("objects:", "  row: {kind: and, run: {}, branches: [{symbol: shelf}]}\nobjects:")
    grammar = small_grammar(text + item("shelf", "storage_shelf", (0.4, 1.0, 1.6), ", in_run: {}") + box)
    for seed in range(6):
        tree = derive(grammar, CATEGORIES, below(), np.random.default_rng(seed))
        _, state = assemble(grammar, CATEGORIES, tree)
        shelf = next(thing for thing in tree.items if thing.symbol == "shelf")
        x, y, yaw = state.pose[shelf.id - 1]
        assert headroom_m(tree.room, shelf.size_m, x, y, 0.0, yaw) >= 0.5 - 1e-9


def test_a_run_that_no_ceiling_leaves_room_for_is_refused_with_what_to_do():
    grammar = run_grammar({name: (0.6, 1.0, 2.2) for name in ("a", "b", "c", "d", "e", "f", "g", "h")})
    line = "^room_ceiling: expected 'two_slopes' with space for the furniture of room type 'closet' below, got none for 300 sets of it; "
    line += "300 failed at: .*; ask for a higher room_eaves_m, a larger room, fewer objects or another room_ceiling$"
    with pytest.raises(RequestError, match=line):
        derive(grammar, CATEGORIES, below(), np.random.default_rng(0))


@pytest.mark.parametrize(("room_type", "grammar_set"), [("kitchen", "learned"), ("guest_room", "by_hand"), ("storage", "by_hand")])
def test_nothing_in_a_room_of_runs_reaches_through_its_slopes(room_type, grammar_set):
    """Kitchen units with hoods and cabinets, a wall of wardrobes, and shelves with boxes."""
    request = SceneRequest(room_type=room_type, grammar_set=grammar_set, room_ceiling="two_slopes")
    found = sample_room(read_room_type(room_type, CATEGORIES, grammar_set), CATEGORIES, request, np.random.default_rng(3))
    assert len(found.room.slopes) == 2 and found.validity.valid
    for thing in found.objects:
        assert headroom_m(found.room, thing.size_m, *thing.position_m, thing.yaw_rad) >= -0.002, thing.category
