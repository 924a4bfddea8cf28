"""A record of one chain: every energy term over the proposals and the acceptance of every move, as a table (CSV) and a drawing."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from grammar.derivation.derive import derive
from grammar.drawing.shapes import Drawing, Shape, line, words
from grammar.geometry.arrays import Floats, Ints
from grammar.layout.assemble import assemble
from grammar.layout.columns import ACCEPTED, FIXED, TRIED
from grammar.layout.mcmc import Chain
from grammar.layout.problem import move_settings
from grammar.layout.schedule import begin, run_stages
from grammar.sampled_room import room_floor
from grammar.spec.categories import Categories
from grammar.spec.energy_terms import TERMS
from grammar.spec.request import SceneRequest
from grammar.spec.rules import MOVES, Grammar

_WIDTH, _LEFT, _TOP = 860.0, 60.0, 60.0
_COLORS = (
    "#e6194b", "#3cb44b", "#4363d8", "#f58231", "#911eb4", "#18a2b8", "#d0219f", "#8a9a00", "#b06f3c", "#008080", "#7a5cd6", "#9a6324",
    "#800000", "#2f7d4f", "#808000", "#000075", "#a9a9a9", "#c97b00",
)  # fmt: skip


class ChainRecord(NamedTuple):
    """One chain over one structure, over the stage in which all objects move.

    proposals: (r,) how many had been made; energies: (r, t) unweighted losses then; weights: (t,); tried, accepted: (r, m) proposals of
    each move in the sweep; counts: (m, 2) the same over all stages; converged: whether the energies' histogram stood still; feasible:
    whether the chain met a layout to keep.
    """

    proposals: Ints
    energies: Floats
    weights: Floats
    tried: Ints
    accepted: Ints
    counts: Ints
    converged: bool
    feasible: bool


def record_chain(grammar: Grammar, categories: Categories, request: SceneRequest, rng: np.random.Generator) -> ChainRecord:
    """Draw one structure, run its chain and return its record.

    A chain in which an object found no place to come in is begun again, as often as the budget has layouts.

    Raises:
        RequestError: no structure meets the request.
    """
    tree = derive(grammar, categories, request, rng)
    beta = request.beta if request.beta > 0.0 else grammar.schedule.beta
    problem, start = assemble(grammar, categories, tree, beta)
    chain = Chain(problem, move_settings(grammar.moves), room_floor(grammar, tree.room))
    for _ in range(grammar.budget.layouts):
        begun = begin(rng, [(problem, start)], chain.moves, grammar.schedule, beta)
        result = run_stages(rng, chain, begun, grammar.schedule, beta)
        if len(result.trace.energy):
            break
    each = int(np.count_nonzero(problem.mount != FIXED))
    made = np.diff(result.trace.counts, axis=0, prepend=0)
    return ChainRecord(
        proposals=each * np.arange(1, len(made) + 1, dtype=np.int64),
        energies=result.trace.energy,
        weights=problem.weight.copy(),
        tried=made[:, :, TRIED],
        accepted=made[:, :, ACCEPTED],
        counts=result.counts,
        converged=result.converged,
        feasible=result.layout is not None,
    )


def acceptance(record: ChainRecord) -> dict[str, float]:
    """Return the share of accepted proposals by move; NaN for moves that were never tried."""
    tried, accepted = record.counts[:, TRIED], record.counts[:, ACCEPTED]
    return {name: float(accepted[k] / tried[k]) if tried[k] else float("nan") for k, name in enumerate(MOVES)}


def to_csv(record: ChainRecord) -> str:
    """Return the record as CSV.

    A line for each sweep: the proposals made, the weighted total and the weighted terms, the proposals and acceptances of each move in it.
    """
    weighted = record.energies * record.weights
    moves = [f"{name}_{what}" for name in MOVES for what in ("tried", "taken")]
    lines = [",".join(("proposals", "total", *TERMS, *moves))]
    counts = np.stack([record.tried, record.accepted], 2).reshape(-1, 2 * len(MOVES))
    for proposals, row, made in zip(record.proposals.tolist(), weighted, counts.tolist(), strict=True):
        lines.append(",".join((str(proposals), *(f"{value:.6g}" for value in (row.sum(), *row)), *map(str, made))))
    return "\n".join(lines) + "\n"


def chain_plot(record: ChainRecord, title: str) -> Drawing:
    """Return a drawing of the weighted terms over the proposals (logarithmic above 1), and below it every move's acceptance over time."""
    weighted = np.column_stack([(record.energies * record.weights).sum(1), record.energies * record.weights])
    total = int(record.proposals[-1]) if len(record.proposals) else 0
    ended = "converged" if record.converged else "all proposals made"
    shapes = [words((_LEFT, 18.0), f"{title}: {total} proposals, {ended}", 15.0, anchor="start")]
    names, mean = ("total", *TERMS), weighted.mean(0) if len(weighted) else np.zeros(len(TERMS) + 1)
    ticks = [0.0, 1.0, 10.0, 100.0, 1e3, 1e4, 1e5]
    legend = [f"{name} (mean {value:.3g})" for name, value in zip(names, mean, strict=True)]
    shapes += _panel(record.proposals, np.log1p(np.maximum(weighted, 0.0)), [(np.log1p(v), f"{v:g}") for v in ticks], legend, _TOP, 380.0)
    shapes.append(words((_LEFT, _TOP - 10.0), "weighted energy terms", 12.0, fill="#666666", anchor="start"))
    share, tried = acceptance(record), record.counts[:, TRIED]
    legend = [f"{name} {share[name]:.3f} of {tried[k]}" for k, name in enumerate(MOVES)]
    lower = _TOP + 380.0 + 60.0
    shapes += _panel(record.proposals, _acceptance_curves(record), [(v, f"{v:g}") for v in (0.0, 0.5, 1.0)], legend, lower, 160.0)
    shapes.append(words((_LEFT, lower - 10.0), "accepted share of each move, over the sweeps around", 12.0, fill="#666666", anchor="start"))
    shapes.append(words((_LEFT + _WIDTH, lower + 160.0 + 18.0), f"{total} proposals", 12.0, anchor="end"))
    shapes.append(words((_LEFT, lower + 160.0 + 18.0), "0", 12.0))
    return Drawing(width=_LEFT + _WIDTH + 250.0, height=lower + 160.0 + 40.0, shapes=tuple(shapes))


def _acceptance_curves(record: ChainRecord) -> Floats:
    """Return (r, m) the share of accepted proposals within a window about each sweep; NaN where a move was not tried."""
    half = max(len(record.tried) // 40, 5)
    summed = [np.concatenate([np.zeros((1, len(MOVES))), np.cumsum(counts, 0)]) for counts in (record.tried, record.accepted)]
    sweeps = np.arange(len(record.tried))
    low, high = np.maximum(sweeps - half, 0), np.minimum(sweeps + half + 1, len(record.tried))
    tried, accepted = (total[high] - total[low] for total in summed)
    share: Floats = np.divide(accepted, tried, out=np.full(tried.shape, np.nan), where=tried > 0)
    return share


def _panel(at: Ints, curves: Floats, ticks: Sequence[tuple[float, str]], legend: Sequence[str], top: float, height: float) -> list[Shape]:
    """Return curves (r, k) over ``at`` (r,), the first one in black if there is a total, with their legend to the right."""
    highest = max(float(np.nanmax(curves, initial=1e-9)), 1e-9)
    x = _LEFT + _WIDTH * at / max(float(at[-1]) if len(at) else 1.0, 1.0)
    frame = [(_LEFT, top), (_LEFT + _WIDTH, top), (_LEFT + _WIDTH, top + height), (_LEFT, top + height), (_LEFT, top)]
    shapes = [line(frame, "#888888")]
    for value, text in ticks:
        if value <= highest * 1.0001:
            y = top + height * (1.0 - value / highest)
            shapes += [line([(_LEFT, y), (_LEFT + _WIDTH, y)], "#e4e4e4", 0.8), words((_LEFT - 6.0, y), text, 11.0, anchor="end")]
    for k in reversed(range(curves.shape[1])):
        color = "#000000" if legend[k].startswith("total") else _COLORS[k % len(_COLORS)]
        kept = np.isfinite(curves[:, k])
        points = list(zip(x[kept].tolist(), (top + height * (1.0 - curves[kept, k] / highest)).tolist(), strict=True))
        if len(points) > 1:
            shapes.append(line(points, color, 1.8 if color == "#000000" else 1.1))
        y = top + 8.0 + 17.0 * k
        shapes += [line([(_LEFT + _WIDTH + 12.0, y), (_LEFT + _WIDTH + 26.0, y)], color, 2.4)]
        shapes.append(words((_LEFT + _WIDTH + 32.0, y), legend[k], 12.0, anchor="start"))
    return shapes
