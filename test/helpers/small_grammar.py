"""Small grammars for tests of the grammar package: the shipped settings with rooms, nodes and objects of one's own."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import yaml

from grammar.derivation.derive import derive
from grammar.layout.assemble import assemble
from grammar.layout.entrants import enter
from grammar.layout.problem import MoveSettings, Problem, State, move_settings
from grammar.spec.categories import Categories, read_categories
from grammar.spec.check import check_grammar
from grammar.spec.energy_terms import TERMS
from grammar.spec.request import SceneRequest
from grammar.spec.rules import MOVES, Grammar
from scene_description import from_mapping
from scene_description.share import config_path

CATEGORIES: Categories = read_categories(config_path("categories.yaml"))


def mapping(text: str) -> dict[str, Any]:
    """Return the shipped base file's mapping with a 4 x 4 m room and the sections of ``text`` on top."""
    data = yaml.safe_load(config_path("grammars/base.yaml").read_text(encoding="utf-8"))
    del data["categories"]
    side = {"mean": 4.0, "sd": 0.1, "low": 4.0, "high": 4.0}
    data |= {"room_type": "closet", "root": "closet"}
    data["room"] |= {"width_m": side, "depth_m": side, "area_low_m2": 9.0, "area_high_m2": 20.0}
    return data | yaml.safe_load(text)


def small_grammar(text: str, weights: Mapping[str, float] | None = None, moves: Mapping[str, float] | None = None) -> Grammar:
    """Return a grammar; with ``weights`` all other weights are zero, with ``moves`` all other moves have no share."""
    data = mapping(text)
    if weights is not None:
        data["weights"] = dict.fromkeys(TERMS, 0.0) | dict(weights)
    if moves is not None:
        data["moves"] |= dict.fromkeys(MOVES, 0.0) | dict(moves)
    grammar = from_mapping(Grammar, data)
    check_grammar(grammar, CATEGORIES)
    return grammar


def entered(grammar: Grammar, rng: np.random.Generator, beta: float | None = None) -> tuple[Problem, State, MoveSettings]:
    """Return a problem of one derivation with all of its objects in the room."""
    problem, state = assemble(grammar, CATEGORIES, derive(grammar, CATEGORIES, SceneRequest(room_type="closet"), rng), beta)
    settings = move_settings(grammar.moves)
    for i in np.flatnonzero(state.active == 0):
        assert enter(rng, problem, state, settings, i, 5)
    return problem, state, settings


def closet(*symbols: str) -> str:
    """Return YAML for a room that has exactly these objects, up to the key ``objects``; append lines of :func:`item`."""
    return f"nodes:\n  closet: {{kind: and, branches: [{', '.join(f'{{symbol: {s}}}' for s in symbols)}]}}\nobjects:\n"


def item(symbol: str, category: str, size_m: tuple[float, float, float], more: str = "") -> str:
    """Return the YAML line of an object of (to a nanometre) one size; ``more`` begins with a comma."""
    low, high = list(size_m), [side + 1e-9 for side in size_m]
    return f"  {symbol}: {{category: {category}, sizes: [{{mean_m: {low}, sd_m: [1, 1, 1]}}], low_m: {low}, high_m: {high}{more}}}\n"
