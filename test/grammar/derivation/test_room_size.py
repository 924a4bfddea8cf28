"""Sizes of rooms that no derivation has are refused before any is drawn, and no others."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from python_calls import counted_calls

from grammar import RequestError, SceneRequest
from grammar.derivation.derive import derive
from grammar.derivation.plan import _bounds, _least_by_number, _least_covered, check_room_size, make_plan
from grammar.spec.categories import read_categories
from grammar.spec.grammar_file import read_room_type, room_types
from grammar.spec.room_rules import RoomShapes
from grammar.synthesize import SceneSynthesizer
from scene_description.share import config_path

CATEGORIES = read_categories(config_path("categories.yaml"))
ROOMS = 8


@cache
def synthesizer() -> SceneSynthesizer:
    return SceneSynthesizer.from_config()


def check(room_type: str, **fields: object) -> None:
    request = SceneRequest(room_type=room_type, **fields)
    check_room_size(make_plan(read_room_type(room_type, CATEGORIES), CATEGORIES, request), CATEGORIES)


@pytest.mark.parametrize(
    ("fields", "line"),
    [
        ({"room_width_m": 0.1}, r"room_width_m: expected 1\.61 to 11\.68 m for a bedroom with a depth of 2\.7 to 5\.6 m, got 0\.1; 0 lets"),
        ({"room_depth_m": 29.0}, r"room_depth_m: expected 1\.61 to 11\.68 m for a bedroom with a width of 2\.7 to 5\.6 m, got 29"),
        (
            {"room_width_m": 0.5, "room_depth_m": 4.0},
            r"room_width_m: expected at least 0\.\d+ m for a bedroom with a depth of 4 m, got 0\.5",
        ),
        ({"room_width_m": 1.7, "room_shape": "l_shape"}, r"room_width_m: expected 1\.78 to "),
        ({"room_width_m": 1.7, "room_depth_m": 9.0, "room_shape": "u_shape"}, r"room_width_m: expected at least 1\.78 m"),
        (
            {"room_width_m": 4.2, "room_depth_m": 1.7, "room_shape": "u_shape"},
            r"room_depth_m: expected a side that a bedroom of this shape",
        ),
        (
            {"room_polygon_m": (0.0, 0.0, 1.5, 0.0, 1.5, 1.5, 0.0, 1.5)},
            r"room_polygon_m: expected at least 3\.95 m2 of floor .*, got 2\.25 m2",
        ),
        (
            {"room_width_m": 2.0, "room_depth_m": 2.0, "must_have": ("bed", "desk", "wardrobe", "armchair", "bookshelf")},
            r"room_width_m: expected at least 3\.74 m for a bedroom with a depth of 2 m, got 2",
        ),
    ],
)
def test_a_size_that_cannot_be_is_refused_at_once_with_its_bounds(fields: dict[str, object], line: str) -> None:
    with counted_calls() as calls, pytest.raises(RequestError, match=line) as caught:
        check("bedroom", **fields)
    assert calls() < 200_000
    assert "\n" not in str(caught.value)


def test_a_size_at_the_bound_that_is_told_is_taken() -> None:
    check("bedroom", room_width_m=1.61)
    check("bedroom", room_width_m=11.68)
    check("bedroom")


def test_a_synthesizer_refuses_before_it_samples() -> None:
    with pytest.raises(RequestError, match=r"room_width_m: expected 0\.\d+ to \d+\.\d+ m for a bedroom"):
        synthesizer().check(SceneRequest(room_width_m=0.1))


@pytest.mark.parametrize("room_type", room_types())
def test_no_room_that_the_grammar_draws_is_refused(room_type: str) -> None:
    rng = np.random.default_rng(7)
    for name in ("by_hand", "learned") if room_type in synthesizer().learned else ("by_hand",):
        grammar = synthesizer().grammar_of(SceneRequest(room_type=room_type, grammar_set=name))
        plan = make_plan(grammar, CATEGORIES, SceneRequest(room_type=room_type))
        by_number = _least_by_number(
            plan.grammar, lambda symbol, rules=plan.grammar.objects: rules[symbol].low_m[0] * rules[symbol].low_m[1]
        )
        for _ in range(ROOMS):
            tree = derive(grammar, CATEGORIES, plan.request, rng)
            points = np.array(tree.room.polygon_m)
            width, depth = (float(side) for side in np.ptp(points, axis=0))
            outline = tuple(float(number) for number in points.ravel())
            have = tuple({item.rule.category for item in tree.items})
            for fields in (
                {"room_width_m": width},
                {"room_depth_m": depth},
                {"room_width_m": width, "room_depth_m": depth},
                {"room_width_m": width, "room_depth_m": depth, "must_have": have, "min_objects": len(tree.items)},
                {"room_polygon_m": outline, "must_have": have},
            ):
                request = SceneRequest(room_type=room_type, **fields)
                check_room_size(make_plan(grammar, CATEGORIES, request), CATEGORIES)
            assert by_number[len(tree.items)] <= sum(item.size_m[0] * item.size_m[1] for item in tree.items) + 1e-9


def test_the_least_that_furniture_covers_grows_with_what_must_be_there() -> None:
    grammar = read_room_type("bedroom", CATEGORIES)
    areas = []
    for fields in ({}, {"must_have": ("bed",)}, {"must_have": ("bed", "wardrobe")}, {"must_have": ("bed", "wardrobe", "desk")}):
        areas.append(_least_covered(make_plan(grammar, CATEGORIES, SceneRequest(**fields)), CATEGORIES))
    assert areas == sorted(areas) and areas[0] > 0.5 and areas[-1] > areas[0]
    small = min(rule.low_m[0] * rule.low_m[1] for rule in grammar.objects.values() if rule.category == "wardrobe")
    assert areas[2] == pytest.approx(areas[1] + small)


@pytest.mark.parametrize(
    ("name", "other", "low"),
    [("rectangle", 4.0, 2.5), ("l_shape", 4.0, 2.5 / (1 - 0.25**2)), ("u_shape", 3.9, 4.0), ("u_shape", 5.0, 2.5 / (1 - 0.25**2) * 0.8)],
)
def test_bounds_of_a_side_by_shape(name: str, other: float, low: float) -> None:
    shapes = replace(RoomShapes(rectangle=0.0, narrowest_m=1.5), **{name: 1.0})
    assert _bounds(shapes, (other, other), (10.0, 20.0))[0] == pytest.approx(low)
