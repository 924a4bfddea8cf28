"""Whatever a file or a request says, only named errors of one line come out."""

from __future__ import annotations

import copy
from typing import Any

from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from small_grammar import CATEGORIES, mapping

from grammar import GrammarError, RequestError, SceneRequest, read_room_type
from grammar.derivation.outlines import check_outline
from grammar.derivation.plan import make_plan
from grammar.spec.check import check_grammar
from grammar.spec.rules import Grammar
from scene_description import FieldError, from_mapping
from scene_description.polygons import signed_area_m2

TEXT = """
nodes:
  closet: {kind: and, branches: [{symbol: rest}, {symbol: shelf}]}
  rest: {kind: or, branches: [{symbol: bed, probability: 0.25}, {symbol: bins, probability: 0.75}]}
  bins: {kind: set, branches: [{symbol: bin, multiplicity: [0.1, 0.9]}]}
objects:
  bed: {category: bed, sizes: [{mean_m: [2, 1, 1], sd_m: [0.1, 0.1, 0.1]}], low_m: [1.8, 0.8, 0.9], high_m: [2.2, 1.2, 1.1]}
  bin: {category: waste_bin, sizes: [{mean_m: [0.3, 0.3, 0.4], sd_m: [0.1, 0.1, 0.1]}], low_m: [0.2, 0.2, 0.3], high_m: [0.4, 0.4, 0.5]}
  shelf: {category: bookshelf, sizes: [{mean_m: [0.3, 1, 2], sd_m: [0.1, 0.1, 0.1]}], low_m: [0.2, 0.8, 1.5], high_m: [0.4, 1.2, 2.2]}
"""
BASE = mapping(TEXT)
VALUES = st.one_of(
    st.none(), st.booleans(), st.integers(-5, 5), st.floats(-10, 10), st.just(float("nan")), st.just(float("inf")), st.text(max_size=5),
    st.sampled_from(["bed", "bin", "shelf", "rest", "bins", "closet", "door", "corner", "none"]),
    st.lists(st.floats(-1, 2), max_size=4), st.dictionaries(st.sampled_from(["bed", "bin", "symbol"]), st.floats(-1, 2), max_size=2),
)  # fmt: skip
BEDROOM = read_room_type("bedroom", CATEGORIES)


def paths(value: Any, above: tuple[Any, ...] = ()) -> list[tuple[Any, ...]]:
    keys = list(value) if isinstance(value, dict) else range(len(value)) if isinstance(value, list) else ()
    return [path for key in keys for path in ((*above, key), *paths(value[key], (*above, key)))]


@settings(max_examples=150, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(st.sampled_from(paths(BASE)), VALUES, st.booleans())
def test_a_grammar_with_a_wrong_value_anywhere_is_read_or_refused_by_name(path: tuple[Any, ...], value: Any, remove: bool) -> None:
    data = copy.deepcopy(BASE)
    place = data
    for key in path[:-1]:
        place = place[key]
    if remove:
        del place[path[-1]]
    else:
        place[path[-1]] = value
    try:
        check_grammar(from_mapping(Grammar, data), CATEGORIES)
    except (FieldError, GrammarError) as error:
        assert "\n" not in str(error) and "expected" in str(error)


WORDS = st.lists(
    st.sampled_from(["bed", "desk", "laptop", ":", "1", "-2", "0.5", "x", "..", "*", "size=", "on=", "=", "/", "nan", " "]), max_size=9
)
TEXTS = st.lists(st.one_of(WORDS.map("".join), st.text(max_size=12)), max_size=3).map(tuple)


@settings(max_examples=200, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(st.sampled_from(["counts", "sizes", "fixed", "weights", "odds", "validity", "must_have", "must_not"]), TEXTS)
def test_a_request_of_any_text_is_taken_or_refused_by_name(field: str, texts: tuple[str, ...]) -> None:
    request = SceneRequest(**{field: texts})  # type: ignore[arg-type]
    try:
        make_plan(BEDROOM, CATEGORIES, request)
    except RequestError as error:
        assert len(str(error).splitlines()) == 1
        assert "expected" in str(error)


@settings(max_examples=300, deadline=None)
@given(st.lists(st.one_of(st.integers(-3, 3).map(float), st.floats(-70, 70), st.just(float("nan"))), max_size=16))
def test_an_outline_of_any_numbers_is_taken_or_refused_by_name(numbers: list[float]) -> None:
    try:
        points = check_outline(numbers)
    except RequestError as error:
        assert str(error).startswith("room_polygon_m: expected ") and "\n" not in str(error)
    else:
        assert signed_area_m2(points) >= 1.0 and sorted(points) == sorted(zip(numbers[::2], numbers[1::2], strict=True))
