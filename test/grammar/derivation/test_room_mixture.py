"""Sizes of rooms from a mixture whose components hold furniture by the share of the floor that it covers."""

import contextlib
import itertools
from collections import Counter
from dataclasses import replace

import numpy as np
import pytest

from grammar.derivation.derive import Kept, derive, derive_from
from grammar.derivation.parse_tree import RejectedError
from grammar.derivation.plan import make_plan
from grammar.derivation.shell import ROOM_SIZE, draw_covered_m2, draw_extent, draw_room, draw_room_size, may_be_bare
from grammar.spec.categories import read_categories
from grammar.spec.grammar_file import read_room_type
from grammar.spec.request import GrammarSet, RequestError, SceneRequest
from grammar.spec.room_rules import ARMED, SHAPES, RoomSize
from scene_description.polygons import signed_area_m2
from scene_description.share import config_path

CATEGORIES = read_categories(config_path("categories.yaml"))

SIZES = (
    RoomSize(probability=0.75, mean_m=(3.0, 2.0), sd_m=(1e-6, 1e-6), floor_share=0.5, share_sd=0.05),
    RoomSize(probability=0.25, mean_m=(4.0, 3.0), sd_m=(1e-6, 1e-6), floor_share=0.25, share_sd=0.05),
)

HALL = RoomSize(probability=0.25, mean_m=(5.0, 3.0), sd_m=(1e-6, 1e-6), arm_m=1.0, arm_sd_m=1e-6)


def drawn(covered_m2: float, count: int) -> list[tuple[float, list[float], int]]:
    rng, found = np.random.default_rng(1), []
    for _ in range(count):
        size = draw_room_size(SIZES, rng)
        least, most = draw_covered_m2(size, rng)
        if not least <= covered_m2 <= most:
            continue
        (attribute,) = size.attributes
        assert (attribute.name, size.arm_m) == (ROOM_SIZE, None)
        found.append((size.area_m2, size.sides_m, int(attribute.value.split(",")[0])))
    return found


def test_components_keep_their_odds_where_the_furniture_fits_both() -> None:
    # 3 m2 are half of 6 m2 and a quarter of 12 m2, so nothing is rejected; four standard errors of 2000 draws.
    found = drawn(3.0, 2000)
    assert len(found) == 2000
    assert np.mean([number == 0 for _, _, number in found]) == pytest.approx(0.75, abs=4.0 * 0.0097)
    assert {round(area, 3) for area, _, _ in found} == {6.0, 12.0}
    assert np.mean([sides[0] > sides[1] for _, sides, _ in found]) == pytest.approx(0.5, abs=4.0 * 0.0112)


def test_furniture_of_another_share_is_rejected() -> None:
    # 3.6 m2 are 0.6 of the small room, two deviations too much: exp(-2) of a share of 0.75; and 0.3 of the large one: exp(-1/2) of 0.25.
    found = drawn(3.6, 4000)
    assert np.mean([number == 0 for _, _, number in found]) == pytest.approx(
        0.75 * np.exp(-2.0) / (0.75 * np.exp(-2.0) + 0.25 * np.exp(-0.5)), abs=0.06
    )
    assert len(found) / 4000 == pytest.approx(0.75 * np.exp(-2.0) + 0.25 * np.exp(-0.5), abs=0.03)


def test_a_size_is_kept_until_furniture_fits_it() -> None:
    # The small room, three in four, needs half of its floor covered, which few sets of furniture of these halls do: it keeps its odds.
    grammar = read_room_type("hallway", CATEGORIES, "learned")
    rectangles = replace(grammar.room.shapes, **{name: float(name == "rectangle") for name in SHAPES})
    sizes = (replace(SIZES[0], floor_share=0.12), replace(SIZES[1], floor_share=0.03, share_sd=0.03))
    room = replace(grammar.room, sizes=sizes, shapes=rectangles, area_low_m2=1.0, area_high_m2=50.0)
    grammar = replace(grammar, room=room)
    rng, small = np.random.default_rng(1), []
    for _ in range(60):
        tree = derive(grammar, CATEGORIES, SceneRequest(room_type="hallway"), rng)
        small.append(signed_area_m2(tree.room.polygon_m) < 9.0)
    assert np.mean(small) == pytest.approx(0.75, abs=0.17)


def test_furniture_that_is_too_crowded_does_not_cost_a_room_its_size() -> None:
    """A small kitchen was given up after four, as four in five are that cover it as real ones are covered, so few came out."""
    grammar = read_room_type("kitchen", CATEGORIES, "learned")
    room = replace(grammar.room, sizes=(replace(SIZES[0], floor_share=0.5, share_sd=10.0), *SIZES[1:]), used_share_max=0.05)
    plan = make_plan(
        replace(grammar, room=room, budget=replace(grammar.budget, derivations=250)), CATEGORIES, SceneRequest(room_type="kitchen")
    )
    kept, rng = Kept(), np.random.default_rng(1)
    first = kept.size(plan, rng)
    with pytest.raises(RequestError, match=r"furniture with the space to use it on at most 0\.05 of the floor"):
        derive_from(plan, CATEGORIES, rng, kept)
    assert kept.size(plan, rng) is first


def test_furniture_that_finds_no_layout_has_other_doors_and_two_sets_one_size() -> None:
    grammar = read_room_type("bedroom", CATEGORIES, "learned")
    shapes = replace(grammar.room.shapes, **{name: float(name == "rectangle") for name in SHAPES})
    grammar = replace(grammar, room=replace(grammar.room, shapes=shapes))
    plan, kept, rng = make_plan(grammar, CATEGORIES, SceneRequest(room_type="bedroom")), Kept(), np.random.default_rng(3)
    trees = [tree for _ in range(9) for tree in (derive_from(plan, CATEGORIES, rng, kept), *kept.reopened(plan, CATEGORIES, rng))]
    sets = [(tree.room.polygon_m, tuple(item.size_m for item in tree.items if not item.rule.tied)) for tree in trees]
    areas = [round(signed_area_m2(polygon), 6) for polygon, _ in dict.fromkeys(sets)]
    # two at the most: sets that find no room count too
    runs = [len(list(group)) for _, group in itertools.groupby(areas)]
    assert max(runs) == 2 and len(runs) < len(areas)
    # the first draw and three more, of which those that leave too little space do not count
    assert max(Counter(sets).values()) == 4
    assert len({tree.room.openings for tree in trees}) == len(trees)


def test_other_doors_and_windows_are_as_many() -> None:
    grammar = read_room_type("bedroom", CATEGORIES, "learned")
    openings = {kind: replace(rule, multiplicity=(0.0, 0.5, 0.5)) for kind, rule in grammar.openings.items()}
    plan, rng = make_plan(replace(grammar, openings=openings), CATEGORIES, SceneRequest(room_type="bedroom")), np.random.default_rng(4)
    again = 0
    for _ in range(12):
        kept = Kept()
        first = Counter(one.category for one in derive_from(plan, CATEGORIES, rng, kept).room.openings)
        others = [Counter(one.category for one in tree.room.openings) for tree in kept.reopened(plan, CATEGORIES, rng)]
        assert all(other == first for other in others)
        again += len(others)
    assert again > 12


def test_halls_of_arms_have_the_area_of_their_arms():
    area, sides, (attribute,), arm, _ = draw_room_size((HALL,), np.random.default_rng(0))
    assert (area, sorted(sides), arm) == (pytest.approx(7.0, abs=1e-4), pytest.approx([3.0, 5.0], abs=1e-4), pytest.approx(1.0, abs=1e-4))
    assert attribute.value.endswith("arms 1.000 m")
    assert may_be_bare(HALL) and not may_be_bare(SIZES[0])


@pytest.mark.parametrize("shape", ARMED)
@pytest.mark.parametrize("sizes", [(SIZES[0], HALL), (replace(SIZES[0], floor_share=None), HALL)], ids=["furnished", "bare"])
def test_a_room_of_arms_only_takes_a_size_with_arms(shape: str, sizes: tuple[RoomSize, ...]) -> None:
    grammar = read_room_type("hallway", CATEGORIES, "learned")
    shapes = replace(grammar.room.shapes, **{name: float(name == shape) for name in SHAPES})
    grammar = replace(grammar, room=replace(grammar.room, sizes=sizes, shapes=shapes, area_low_m2=1.0, area_high_m2=50.0))
    rng, areas = np.random.default_rng(1), []
    for _ in range(40):
        with contextlib.suppress(RejectedError):
            extent = draw_extent(grammar.room, SceneRequest(room_type="hallway"), rng)
            room, _, _ = draw_room(grammar, SceneRequest(room_type="hallway"), (), 1.5, rng, extent)
            areas.append(signed_area_m2(room.polygon_m))
    area = 9.0 if shape == "u_shape" else 7.0  # the legs of the U stand on the short side
    assert len(areas) > 2 and areas == pytest.approx([area] * len(areas), abs=1e-3)


@pytest.mark.parametrize("shape", ARMED)
@pytest.mark.parametrize("grammar_set", ["by_hand", "learned"])
def test_hallways_have_the_arms_that_are_asked_for(shape: str, grammar_set: GrammarSet) -> None:
    grammar = read_room_type("hallway", CATEGORIES, grammar_set)
    request = SceneRequest(room_type="hallway", room_shape=shape)
    tree = derive(grammar, CATEGORIES, request, np.random.default_rng(5))
    assert len(tree.room.polygon_m) == {"l_shape": 6, "t_shape": 8, "u_shape": 8}[shape]


def test_halls_of_many_doors_are_not_given_up_for_halls_of_few() -> None:
    """With numbers of doors drawn anew for each place that did not fit, halls of eight doors came out a third as often as drawn."""
    plan = make_plan(read_room_type("hallway", CATEGORIES, "learned"), CATEGORIES, SceneRequest(room_type="hallway"))
    trees = (derive_from(plan, CATEGORIES, np.random.default_rng([77, seed])) for seed in range(60))
    assert np.mean([sum(opening.category == "door" for opening in tree.room.openings) for tree in trees]) > 4.4


def test_a_kept_size_keeps_the_numbers_of_its_openings() -> None:
    grammar = read_room_type("living_room", CATEGORIES, "learned")
    plan = make_plan(grammar, CATEGORIES, SceneRequest(room_type="living_room"))
    seen = []
    for seed in range(20):
        rng, kept = np.random.default_rng(seed), Kept()
        room = draw_room(grammar, plan.request, plan.outline, 5.0, rng, kept.size(plan, rng))[0]
        numbers = kept.numbers(grammar, room, rng)
        assert all(kept.numbers(grammar, room, rng) == numbers for _ in range(5))
        seen.append(numbers["door"])
    assert len(set(seen)) > 1
