"""A record of one chain: every energy term over the proposals and the acceptance of every move, as a table (CSV) and a drawing (SVG)."""

from __future__ import annotations

from html import escape
from typing import NamedTuple

import numpy as np

from grammar.assemble import assemble
from grammar.categories import Categories
from grammar.circulation import empty_floor
from grammar.derive import derive
from grammar.layout import FIXED, Floats, Ints
from grammar.mcmc import NO_FLOOR
from grammar.moves import move_settings
from grammar.request import SceneRequest
from grammar.rules import MOVES, TERMS, Grammar
from grammar.schedule import run_stages
from grammar.validity import door_start_m

_WIDTH, _HEIGHT, _LEFT, _TOP = 900, 420, 60, 30


class ChainRecord(NamedTuple):
    """One chain over one structure, over the stage in which all objects move.

    proposals: (r,) how many had been made; energies: (r, t) unweighted losses then; weights: (t,); counts: (6, 2) proposals and acceptances
    by move, all stages; converged: whether the energies' histogram stood still; feasible: whether the chain met a layout to keep.
    """

    proposals: Ints
    energies: Floats
    weights: Floats
    counts: Ints
    converged: bool
    feasible: bool


def record_chain(grammar: Grammar, categories: Categories, request: SceneRequest, rng: np.random.Generator) -> ChainRecord:
    """Draw one structure, run its chain once and return its record.

    Raises:
        RequestError: no structure meets the request.
    """
    tree = derive(grammar, categories, request, rng)
    problem, start = assemble(grammar, categories, tree)
    walks = grammar.weights.circulation > 0.0 or grammar.weights.reach > 0.0
    limits = grammar.validity
    floor = empty_floor(tree.room.polygon_m, door_start_m(tree.room, limits.robot_radius_m), limits) if walks else NO_FLOOR
    beta = request.beta if request.beta > 0.0 else grammar.schedule.beta
    result = run_stages(rng, problem, start, move_settings(grammar.moves), grammar.schedule, beta, floor)
    each = int(np.count_nonzero(problem.mount != FIXED))
    return ChainRecord(
        proposals=each * np.arange(1, len(result.history) + 1, dtype=np.int64),
        energies=result.history,
        weights=problem.weight.copy(),
        counts=result.counts,
        converged=result.converged,
        feasible=result.layout is not None,
    )


def acceptance(record: ChainRecord) -> dict[str, float]:
    """Return the share of accepted proposals by move; NaN for moves that were never tried."""
    tried, taken = record.counts[:, 0], record.counts[:, 1]
    return {name: float(taken[k] / tried[k]) if tried[k] else float("nan") for k, name in enumerate(MOVES)}


def to_csv(record: ChainRecord) -> str:
    """Return the record as CSV: a line for each sweep with the proposals made, the weighted total and the weighted terms."""
    weighted = record.energies * record.weights
    lines = [",".join(("proposals", "total", *TERMS))]
    for proposals, row in zip(record.proposals.tolist(), weighted, strict=True):
        lines.append(",".join((str(proposals), *(f"{value:.6g}" for value in (row.sum(), *row)))))
    return "\n".join(lines) + "\n"


def to_svg(record: ChainRecord) -> str:
    """Return a drawing of the weighted terms over the proposals (logarithmic above 1) with the acceptance of the moves beside it."""
    weighted = np.column_stack([(record.energies * record.weights).sum(1), record.energies * record.weights])
    height = np.log1p(np.maximum(weighted, 0.0))
    top = max(float(height.max(initial=0.0)), 1e-9)
    x = _LEFT + _WIDTH * (np.arange(len(height)) + 0.5) / max(len(height), 1)
    parts = [
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{_WIDTH + 330}" height="{_HEIGHT + 80}" font-family="sans-serif" font-size="12">',
        f'<rect x="{_LEFT}" y="{_TOP}" width="{_WIDTH}" height="{_HEIGHT}" fill="none" stroke="#888"/>',
    ]
    for k, name in enumerate(("total", *TERMS)):
        colour = "#000" if k == 0 else f"hsl({360 * (k - 1) // len(TERMS)},70%,45%)"
        points = " ".join(f"{a:.1f},{b:.1f}" for a, b in zip(x, _TOP + _HEIGHT * (1.0 - height[:, k] / top), strict=True))
        mean = float(weighted[:, k].mean()) if len(weighted) else 0.0
        parts.append(f'<polyline points="{points}" fill="none" stroke="{colour}" stroke-width="{1.6 if k == 0 else 0.8}"/>')
        parts.append(f'<text x="{_LEFT + _WIDTH + 12}" y="{_TOP + 12 + 15 * k}" fill="{colour}">{escape(name)} (mean {mean:.3g})</text>')
    for value in (0.0, 1.0, 10.0, 100.0, 1000.0, 10_000.0):
        if np.log1p(value) <= top:
            parts.append(f'<text x="8" y="{_TOP + _HEIGHT * (1.0 - np.log1p(value) / top) + 4:.1f}">{value:g}</text>')
    first = _TOP + 12 + 15 * (len(TERMS) + 2)
    for k, (name, share) in enumerate(acceptance(record).items()):
        text = f"{escape(name)}: {share:.3f} of {record.counts[k, 0]} accepted"
        parts.append(f'<text x="{_LEFT + _WIDTH + 12}" y="{first + 15 * k}">{text}</text>')
    last = int(record.proposals[-1]) if len(record.proposals) else 0
    ended = "converged" if record.converged else "budget spent"
    parts.append(f'<text x="{_LEFT}" y="{_TOP + _HEIGHT + 20}">weighted energy terms over {last} proposals; {ended}</text>')
    return "\n".join((*parts, "</svg>")) + "\n"
