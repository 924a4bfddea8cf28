"""The structure of a derivation: Or choices and Set multiplicities, drawn from the root down."""

from __future__ import annotations

import math
from typing import Literal, NamedTuple

import numpy as np

from grammar.constraints import number_range
from grammar.densities import draw_index
from grammar.rules import Grammar

Kind = Literal["and", "or", "set", "terminal"]


class Choice(NamedTuple):
    """One vertex of the derivation: symbol, kind, index of its parent (-1: the scene), the branch taken and its log-probability."""

    symbol: str
    kind: Kind
    parent: int
    choice: str
    log_probability: float


def draw_structure(grammar: Grammar, rng: np.random.Generator) -> list[Choice]:
    """Return the vertices of one structure in depth-first order; its terminals are the objects of the room."""
    vertices: list[Choice] = []
    _expand(grammar, rng, grammar.root, -1, vertices)
    return vertices


def count_range(grammar: Grammar) -> tuple[int, int]:
    """Return the least and the greatest number of objects that the grammar gives with positive probability."""
    return number_range(grammar, lambda _: 1)


def _expand(grammar: Grammar, rng: np.random.Generator, symbol: str, parent: int, out: list[Choice]) -> None:
    node = grammar.nodes.get(symbol)
    index = len(out)
    if node is None:
        out.append(Choice(symbol, "terminal", parent, grammar.objects[symbol].category, 0.0))
        return
    if node.kind == "or":
        branch = node.branches[draw_index(rng, [branch.probability or 0.0 for branch in node.branches])]
        out.append(Choice(symbol, "or", parent, branch.symbol, math.log(branch.probability or 1.0)))
        _expand(grammar, rng, branch.symbol, index, out)
        return
    out.append(Choice(symbol, node.kind, parent, "", 0.0))
    for branch in node.branches:
        if branch.multiplicity is None:
            _expand(grammar, rng, branch.symbol, index, out)
            continue
        copies = draw_index(rng, branch.multiplicity)
        out.append(Choice(branch.symbol, "set", index, str(copies), math.log(branch.multiplicity[copies])))
        place = len(out) - 1
        for _ in range(copies):
            _expand(grammar, rng, branch.symbol, place, out)
