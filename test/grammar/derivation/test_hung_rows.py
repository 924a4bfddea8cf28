"""Rows of wall cabinets: edge to edge above low units, past what hangs above one of them, cut where the wall ends."""

import itertools
import math
from dataclasses import replace

import numpy as np
import pytest
from small_grammar import CATEGORIES, closet, item, small_grammar

from grammar.derivation.derive import derive
from grammar.geometry.walls import ALONG_X, ALONG_Y, START_X, START_Y, wall_rows
from grammar.layout.assemble import assemble
from grammar.spec.request import SceneRequest

LINE = ", mount: wall, centre_height_m: {mean: 1.7, sd: 0.01, low: 1.69, high: 1.71}, in_line: true, cores: {low: 1}, "
LINE += "around: [{side: centre, align: -1}]"
HOOD = LINE.replace("low: 1}", "hob: 1}") + ", tied: [{axis: width, to: hob, of: width}]"


def kitchen(widths, hood=""):
    """Return a grammar of a run of two low units, a hob and a tall unit, with cabinets of given widths and a hood above the hob."""
    names = [f"c{k}" for k in range(len(widths))]
    text = closet("row", *names, "hood").replace("objects:", "  row: {kind: and, run: {most_bare_m: 9}, branches: [%s]}\nobjects:")
    text = text % ", ".join(f"{{symbol: {name}}}" for name in ("low", "lower", "hob", "tall"))
    sizes = {"low": (0.6, 0.8, 0.9), "lower": (0.6, 0.7, 0.9), "hob": (0.6, 0.6, 0.9), "tall": (0.6, 0.6, 2.0)}
    text += "".join(item(name, "dresser", size) for name, size in sizes.items())
    for name, width in zip(names, widths, strict=True):
        text += f"  {name}: {{category: wall_cabinet, sizes: [{{mean_m: [0.35, {width}, 0.6], sd_m: [0.001, 0.001, 0.001]}}], "
        text += "low_m: [0.3, 0.3, 0.5], "
        text += f"high_m: [0.4, 1.5, 0.7]{LINE}}}\n"
    return small_grammar(text + item("hood", "range_hood", (0.4, 0.5, 0.6), HOOD + hood))


def hung(grammar, seed):
    """Return the symbols' items and, of what hangs in the row, the wall and the stretch of it that each takes."""
    tree = derive(grammar, CATEGORIES, SceneRequest(room_type="closet"), np.random.default_rng(seed))
    rows, spans = wall_rows(tree.room.polygon_m), []
    for found in tree.items:
        if found.symbol.startswith("c") and found.pinned is not None:
            row = rows[found.pinned.wall]
            along = (found.pinned.x_m - row[START_X]) * row[ALONG_X] + (found.pinned.y_m - row[START_Y]) * row[ALONG_Y]
            spans.append((found.pinned.wall, along - 0.5 * found.size_m[1], along + 0.5 * found.size_m[1]))
    return {found.symbol: found for found in tree.items}, sorted(spans)


@pytest.mark.parametrize("seed", range(4))
def test_cabinets_hang_edge_to_edge_at_one_height_and_the_run_stays(seed):
    grammar = kitchen((0.5, 0.45), ", below_row_m: 0.06")
    found, spans = hung(grammar, seed)
    assert len(spans) == 2
    assert len({round(found[name].bottom_m, 9) for name in ("c0", "c1")}) == 1
    for (wall, _, high), (other, low, _) in itertools.pairwise(spans):
        assert wall == other and (
            high == pytest.approx(low, abs=1e-5) or low - high > 0.3
        )  # beside each other, or on both sides of the tall unit
    tree = derive(grammar, CATEGORIES, SceneRequest(room_type="closet"), np.random.default_rng(seed))
    assert [(len(run.slots), run.slots[0].slide) for run in tree.unit_rows] == [(1, 0.0)]


def test_a_hood_is_built_in_below_a_row_that_goes_past_it_and_else_stops_the_row():
    passed = 0
    for seed in range(12):
        found, _ = hung(kitchen((1.3,), ", below_row_m: 0.06"), seed)
        hood = found["hood"]
        if hood.size_m[2] == pytest.approx(0.06):
            passed += 1
            assert hood.bottom_m + 0.06 == pytest.approx(found["c0"].bottom_m) and hood.size_m[0] <= found["c0"].size_m[0]
    assert passed
    for seed in range(4):  # what no row goes past keeps its size and its place
        grammar = kitchen((1.3,))
        found, _ = hung(grammar, seed)
        assert found["hood"].size_m[2] == pytest.approx(0.6)
        tree = derive(grammar, CATEGORIES, SceneRequest(room_type="closet"), np.random.default_rng(seed))
        _, state = assemble(grammar, CATEGORIES, tree)
        x, y = state.pose[found["c0"].id - 1, :2] - state.pose[found["hob"].id - 1, :2]
        yaw = state.pose[found["hob"].id - 1, 2]
        aside = abs(y * math.cos(yaw) - x * math.sin(yaw))
        beside = 0.5 * (found["c0"].size_m[1] + 0.6)
        assert aside > beside - 1e-6 or abs(x * math.cos(yaw) + y * math.sin(yaw)) > 0.5


def test_what_is_too_wide_for_the_wall_is_cut_to_it():
    _, spans = hung(kitchen((1.5, 1.5), ", below_row_m: 0.06"), 1)
    assert min(high - low for _, low, high in spans) < 1.45
    assert sum(high - low for _, low, high in spans) <= 0.8 + 0.7 + 0.6 + 1e-6


@pytest.mark.parametrize("beside", [True, False])
def test_a_row_begins_beside_a_tall_unit_as_likely_as_its_rule_says(beside):
    grammar = kitchen((0.35,), ", below_row_m: 0.06")
    rule = replace(grammar.objects["c0"], beside_tall=float(beside))
    grammar, met = replace(grammar, objects={**grammar.objects, "c0": rule}), []
    for seed in range(6):
        tree = derive(grammar, CATEGORIES, SceneRequest(room_type="closet"), np.random.default_rng(seed))
        found, ((wall, low, high),) = hung(grammar, seed)
        _, state = assemble(grammar, CATEGORIES, tree)
        row, (x, y) = wall_rows(tree.room.polygon_m)[wall], state.pose[found["tall"].id - 1, :2]
        along = (x - row[START_X]) * row[ALONG_X] + (y - row[START_Y]) * row[ALONG_Y]
        met.append(min(abs(along - 0.3 - high), abs(low - along - 0.3)) < 0.01)
    assert met == [beside] * 6
