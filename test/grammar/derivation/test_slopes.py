"""Sloped ceilings as they are drawn: shares, heights, floors that grow, openings below them, and requests."""

import math
from dataclasses import replace

import numpy as np
import pytest
from small_grammar import CATEGORIES, closet, item, small_grammar

from grammar.derivation.derive import derive
from grammar.derivation.overrides import overridden
from grammar.derivation.parse_tree import RejectedError
from grammar.derivation.slopes import check_tall, draw_slopes, loaded_heights_m
from grammar.geometry.slopes import low_ceiling
from grammar.spec.request import RequestError, SceneRequest
from grammar.spec.room_rules import SlopeRule
from scene_description import Room
from scene_description.ceilings import ceiling_over_opening_m, check_slopes
from scene_description.polygons import signed_area_m2

L_ROOM = ((0.0, 0.0), (5.0, 0.0), (5.0, 2.5), (3.0, 2.5), (3.0, 4.5), (0.0, 4.5))


def bare(outline=((0.0, 0.0), (4.0, 0.0), (4.0, 4.5), (0.0, 4.5))):
    return Room(polygon_m=outline, height_m=2.9, wall_thickness_m=0.1, openings=(), surfaces=())


def drawn(rule, room, seed, grows=False):
    return draw_slopes(rule, room, [], np.random.default_rng(seed), grows=grows)


@pytest.mark.parametrize("outline", [bare().polygon_m, L_ROOM])
def test_slopes_are_drawn_by_their_rule(outline):
    rule, found = SlopeRule(probability=0.5, two_sides=0.3), []
    for seed in range(150):
        room, attributes = drawn(rule, bare(outline), seed)
        check_slopes(room)
        found.append(len(room.slopes))
        assert [attribute.name for attribute in attributes] == ["height_m", "slopes"]
        assert len({(slope.eaves_height_m, slope.pitch_rad) for slope in room.slopes}) == 1
        assert rule.height_m.low <= room.height_m <= rule.height_m.high
        assert rule.eaves_height_m.low <= room.slopes[0].eaves_height_m <= rule.eaves_height_m.high
        low = sum(4.0 * strip[4] * strip[5] for strip in low_ceiling(room, rule.high_m))
        assert low <= 0.5 * signed_area_m2(outline) or outline is L_ROOM
    assert found.count(1) > found.count(2) > 10


def test_raised_eaves_are_drawn_from_the_upper_part_of_their_range():
    rule = SlopeRule(probability=1.0)
    low, high = rule.eaves_height_m.low, rule.eaves_height_m.high
    for raised in (0.5, 1.0):
        rooms = [draw_slopes(rule, bare(), [], np.random.default_rng(seed), grows=False, raised=raised)[0] for seed in range(20)]
        eaves = [room.slopes[0].eaves_height_m for room in rooms]
        assert low + raised * (high - low) <= min(eaves) + 1e-12 and max(eaves) <= high


def test_as_many_rooms_have_slopes_as_the_rule_says():
    grammar = small_grammar(closet("desk") + item("desk", "desk", (0.7, 1.4, 0.75), ", wall: [{distance_m: 0.02}]"))
    grammar = replace(grammar, room=replace(grammar.room, slopes=SlopeRule(probability=0.5)))
    trees = [derive(grammar, CATEGORIES, SceneRequest(room_type="closet"), np.random.default_rng(seed)) for seed in range(60)]
    told = [next(node for node in tree.nodes if node.symbol == "slopes") for tree in trees]
    assert sum(tree.room.slopes is None for tree in trees) == pytest.approx(30, abs=12)
    flat = [node for tree, node in zip(trees, told, strict=True) if tree.room.slopes is None]
    assert all(node.choice == "none" and node.log_probability == pytest.approx(math.log(0.5)) for node in flat)


def test_a_narrow_room_has_no_slopes():
    with pytest.raises(RejectedError, match=r"a sloped ceiling at least 2\.13 m high over 0\.95 of the floor"):
        drawn(SlopeRule(probability=1.0, high_share=0.95), bare(), 0)


def test_the_floor_grows_by_what_does_not_count_of_it():
    """From eaves of 0.8 m at 45 degrees: 0.2 m of floor below 1 m, and half of the next 1 m, are lost at each side."""
    rule = SlopeRule(
        probability=1.0, two_sides=1.0, eaves_height_m=fixed(0.8), pitch_rad=fixed(0.25 * math.pi), height_m=fixed(2.4), high_share=0.2
    )
    room, _ = drawn(rule, bare(), 1, grows=True)
    spans = np.ptp(np.array(room.polygon_m), axis=0)
    across = 0 if room.slopes[0].wall in (1, 3) else 1
    assert spans[across] == pytest.approx((4.0, 4.5)[across] + 2 * 0.7) and spans[1 - across] == pytest.approx((4.0, 4.5)[1 - across])


def fixed(value):
    return replace(SlopeRule().height_m, mean=value, low=value, high=value)


def test_requests_ask_for_one_thing_at_a_time():
    grammar = small_grammar(closet("desk") + item("desk", "desk", (0.7, 1.4, 0.75), ", wall: [{distance_m: 0.02}]"))
    for ceiling, count in (("flat", 0), ("one_slope", 1), ("two_slopes", 2)):
        request = SceneRequest(room_type="closet", room_ceiling=ceiling, room_eaves_m=0.9, room_pitch_deg=40.0, room_height_m=2.5)
        for seed in range(3):
            room = derive(grammar, CATEGORIES, request, np.random.default_rng(seed)).room
            assert len(room.slopes or ()) == count and room.height_m == 2.5
            assert all(slope.eaves_height_m == 0.9 and slope.pitch_rad == pytest.approx(math.radians(40.0)) for slope in room.slopes or ())
            for opening in room.openings:
                assert opening.sill_m + opening.height_m < ceiling_over_opening_m(room, opening)
    assert overridden(overridden(grammar, request), request) == overridden(grammar, request)
    with pytest.raises(RequestError, match=r"^room_eaves_m: expected 0\.5 to 1\.9 m for this height of the room, got 1\.95$"):
        overridden(grammar, SceneRequest(room_type="closet", room_eaves_m=1.95, room_height_m=2.0))


def test_what_is_tall_needs_walls_below_the_ceiling():
    grammar = small_grammar(closet("store") + item("store", "wardrobe", (0.6, 1.2, 2.1), ", wall: [{distance_m: 0.02}]"))
    rule, room = grammar.objects["store"], bare()
    things = [("store", rule, (0.6, 1.2, 2.1))] * 4
    check_tall(grammar, room, things * 9)
    sloped, _ = drawn(SlopeRule(probability=1.0, two_sides=1.0, eaves_height_m=fixed(0.8), pitch_rad=fixed(0.6), high_share=0.0), room, 0)
    check_tall(grammar, sloped, [("store", rule, (0.6, 1.2, 0.9))] * 40)
    with pytest.raises(RejectedError, match=r"walls below the sloped ceiling for what is 2\.10 m high"):
        check_tall(grammar, sloped, things)


def test_things_reach_as_high_as_what_may_stand_on_their_lowest_surface():
    """A box of 0.2 m on a box of 0.3 m on a shelf with its only surface on top; nothing stands on the wardrobe."""
    grammar = small_grammar(
        closet("shelf", "box", "small", "store")
        + item("shelf", "storage_shelf", (0.4, 1.0, 1.6), ", wall: [{distance_m: 0.02}]")
        + item("box", "cardboard_box", (0.3, 0.3, 0.3), ", mount: object, supporters: {shelf: 1}, placements: [{depth_fraction: 0}]")
        + item("small", "cardboard_box", (0.2, 0.2, 0.2), ", mount: object, supporters: {box: 1}, placements: [{depth_fraction: 0}]")
        + item("store", "wardrobe", (0.6, 1.2, 2.1), ", wall: [{distance_m: 0.02}]")
    )
    things = [(symbol, rule, rule.sizes[0].mean_m) for symbol, rule in grammar.objects.items()]
    assert loaded_heights_m(CATEGORIES, things) == pytest.approx([2.1, 0.5, 0.2, 2.1])


def test_windows_are_drawn_smaller_where_slopes_leave_no_wall_high_enough():
    """A window of 2 x 1.6 m ends at 2.35 m at least, where gables 5.7 m wide are no wider than 1.8 m."""
    grammar = small_grammar(closet("desk") + item("desk", "desk", (0.7, 1.4, 0.75), ", wall: [{distance_m: 0.02}]"))
    large = replace(grammar.openings["window"], width_m=fixed(2.0), height_m=fixed(1.6))
    grammar = replace(grammar, openings={**grammar.openings, "window": large})
    request = SceneRequest(room_type="closet", room_ceiling="two_slopes", room_eaves_m=0.8, room_pitch_deg=40.0, counts=("window:1:1",))
    for seed in range(5):
        room = derive(grammar, CATEGORIES, request, np.random.default_rng(seed)).room
        (window,) = (opening for opening in room.openings if opening.category == "window")
        assert window.sill_m + window.height_m + large.casing_m <= ceiling_over_opening_m(room, window) + 1e-9
        assert (window.width_m, window.height_m) in [pytest.approx((2.0 * scale, 1.6 * scale)) for scale in (0.8, 0.65, 0.5)]
