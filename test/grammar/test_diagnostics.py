"""The record of a chain, and the test of convergence."""

import csv
import io
import math
import xml.etree.ElementTree as ET
from dataclasses import replace

import numpy as np
import pytest
from small_grammar import CATEGORIES

from grammar import SceneRequest, read_room_type
from grammar.diagnostics import acceptance, chain_plot, record_chain, to_csv
from grammar.drawing.shapes import to_svg
from grammar.layout.schedule import has_converged
from grammar.spec.energy_terms import TERMS
from grammar.spec.rules import MOVES, Convergence


@pytest.fixture(scope="module")
def grammar():
    return read_room_type("bedroom", CATEGORIES)


def test_histograms_of_one_distribution_agree_and_those_of_a_drift_do_not():
    rng, test = np.random.default_rng(0), Convergence(window=400, lag=400, epsilon=0.15, bins=10)
    still = rng.normal(size=800)
    assert has_converged(still, test)
    assert not has_converged(still[:799], test)
    assert not has_converged(still + np.linspace(0, 4, 800), test)
    assert not has_converged(still, Convergence(window=0))
    # 100 of 400 samples in another bin: the total variation distance is 0.25
    steps = np.concatenate([np.zeros(400), np.zeros(300), np.ones(100)])
    assert not has_converged(steps, replace(test, epsilon=0.25))
    assert has_converged(steps, replace(test, epsilon=0.251))


def test_convergence_ends_the_chain_before_its_budget_but_never_after(grammar):
    def chain(**fields):
        schedule = replace(grammar.schedule, together=600, convergence=Convergence(**fields))
        return record_chain(replace(grammar, schedule=schedule), CATEGORIES, SceneRequest(max_objects=12), np.random.default_rng(2))

    easy, never = chain(window=50, lag=50, epsilon=1.0), chain(window=50, lag=50, epsilon=0.0)
    assert easy.converged and len(easy.energies) < 600
    assert not never.converged and len(never.energies) == 600


def test_the_record_can_be_read_by_others(grammar):
    grammar = replace(grammar, schedule=replace(grammar.schedule, convergence=Convergence()))
    record = record_chain(grammar, CATEGORIES, SceneRequest(max_objects=14), np.random.default_rng(3))
    rows = list(csv.DictReader(io.StringIO(to_csv(record))))
    assert len(rows) == len(record.energies) == grammar.schedule.together
    for row, losses in zip(rows, record.energies, strict=True):
        assert float(row["total"]) == pytest.approx(float(losses @ record.weights), rel=1e-4, abs=1e-6)
        assert sum(float(row[name]) for name in TERMS) == pytest.approx(float(row["total"]), rel=1e-3, abs=1e-4)
    assert int(rows[-1]["proposals"]) == len(rows) * int(rows[0]["proposals"])
    shares = acceptance(record)
    assert list(shares) == list(MOVES)
    assert all(math.isnan(share) or 0.0 <= share <= 1.0 for share in shares.values()) and shares["translate"] > 0.1
    for name in MOVES:
        tried, taken = (sum(int(row[f"{name}_{what}"]) for row in rows) for what in ("tried", "taken"))
        assert taken <= tried <= int(rows[-1]["proposals"])
    each = int(rows[0]["proposals"])
    assert all(sum(int(row[f"{name}_tried"]) for name in MOVES) == each for row in rows)
    tree = ET.fromstring(to_svg(chain_plot(record, "bedroom")))
    lines = tree.findall("{http://www.w3.org/2000/svg}polyline")
    curves = [line for line in lines if len(line.get("points").split()) == len(rows)]
    assert len(curves) >= len(TERMS) + 1
    texts = [text.text for text in tree.findall("{http://www.w3.org/2000/svg}text")]
    assert any(text.startswith("bedroom: ") for text in texts) and any(text.startswith("relocate 0.") for text in texts)
