"""Which design a set of evaluated frames has, and what its factors' columns are."""

import pytest
from evaluation_files import combinations

from evaluation.evaluation_file import FactorValue, FrameKey, FrameRow
from scene_synth_ros.report.design import Design, find_design
from scene_synth_ros.report.sweep_file import Sweep, SweepFactor

VALUES = {"light": [3.0, 0.5, 1.0], "finish": ["paint", "brick"], "lamp": [True, False]}
BASE = {"light": 1.0, "finish": "paint", "lamp": True}


def rows(combos: list[dict[str, FactorValue]]) -> list[FrameRow]:
    keys = [FrameKey(bag="bag", room=0, room_type="office", seed=1, frame=0, stamp_ns=0, factors=factors) for factors in combos]
    return [FrameRow(key=key, task="depth", metrics={}) for key in keys]


def columns(design: Design) -> dict[str, tuple[tuple[str, ...], int | None]]:
    return {factor.name: (factor.columns, factor.base) for factor in design.factors}


def test_one_at_a_time_is_told_from_a_grid_and_its_base_is_found() -> None:
    design = find_design(rows(combinations(VALUES, BASE)), [])
    assert design.name == "one_at_a_time"
    assert columns(design) == {"light": (("0.5", "1", "3"), 1), "finish": (("paint", "brick"), 0), "lamp": (("on", "off"), 0)}
    assert find_design(rows(combinations(VALUES)), []).name == "grid"
    assert find_design(rows(combinations(VALUES)[:-3]), []).name == "mixed"
    assert {factor.base for factor in find_design(rows(combinations(VALUES)), []).factors} == {None}


def test_a_sweep_names_factors_and_says_what_cannot_be_seen() -> None:
    told = SweepFactor(label="finish of the walls", unit="", values=("brick", "paint"), base="paint")
    lit = SweepFactor(label="light", unit="lx", values=(0.5, 1.0, 3.0), base=1.0)
    design = find_design(rows(combinations(VALUES)), [Sweep(design="grid", factors={"finish": told, "light": lit})])
    factors = {factor.name: factor for factor in design.factors}
    assert (factors["finish"].label, factors["finish"].columns, factors["finish"].base) == ("finish of the walls", ("brick", "paint"), 1)
    assert (factors["light"].unit, factors["light"].base, factors["light"].base_value) == ("lx", 1, 1.0)


def test_a_factor_that_base_rooms_differ_in_has_a_column_for_its_base() -> None:
    """Rooms have own heights, of which the sweep says nothing; what is changed is 1 m and 2 m."""
    told = SweepFactor(label="height", unit="m", values=(2.0, 1.0), base=None)
    sweep = Sweep(design="one_at_a_time", factors={"height": told}, changed={"0": frozenset(), "1": frozenset({"height"})})
    combos = [sweep.factors_of("0", {"height": own}) for own in (1.31, 1.47)] + [sweep.factors_of("1", {"height": h}) for h in (2, 1)]
    (factor,) = find_design(rows(combos), [sweep]).factors
    assert (factor.columns, factor.places, factor.base) == (("as it is", "1", "2"), (None, 1.0, 2.0), 0)
    assert factor.column_of == {"as it is": 0, 1.0: 1, 2.0: 2} and not factor.binned and factor.base_value is None
    assert Sweep(factors={"height": SweepFactor(label="", unit="", values=(), base=3.0)}, changed={"0": frozenset()}).factors_of(
        "0", {"height": 1.31, "light": 2.0}
    ) == {"height": 3.0, "light": 2.0}


def test_many_values_are_put_into_bins_of_about_equal_count() -> None:
    combos = [{"light": k / 10.0, "speed": float((7 * k) % 20), "fixed": 1.0} for k in range(20)]
    design = find_design(rows(combos), [])
    assert design.name == "latin_hypercube" and [factor.name for factor in design.factors] == ["light", "speed"]
    light = design.factors[0]
    assert light.binned and len(light.columns) == 6 and light.columns[0] == "0 to 0.3"
    assert light.places[0] == pytest.approx(0.15) and light.column_of[0.4] == 1
    assert [list(light.column_of.values()).count(k) for k in range(6)] == [4, 4, 3, 3, 3, 3]


def test_frames_without_factors_have_none() -> None:
    assert find_design(rows([{}, {}]), []).factors == ()
    assert find_design([], []).factors == ()
