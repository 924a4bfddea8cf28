"""The energy of a layout: the weighted sum of the losses of its cliques, whole or the part that a move changes.

``E = sum of weight * loss`` over the terms of :data:`grammar.spec.energy_terms.ENERGY_TERMS`, the Gibbs prior's exponent (Jiang et al.,
IJCV 2018, section 2.2):

Kernels add the losses; the rows of :data:`grammar.layout.losses.LOSSES` say which, and the kernels that call all of a scope are made from
them.  Circulation and reach are read off the floor (:mod:`grammar.layout.circulation`), by the chain, where they have a weight.

A relation with modes of probability p_k, spreads s_k and d dimensions is the mixture of the densities ``p_k s_k^-d exp(-beta w l / s_k)``,
each place given to the mode that is densest there.  The odds are part of the prior, so their cost is divided by the inverse temperature
beta, which does not temper them: modes that the room leaves free alike, and that lie further apart than they are wide, are taken by their
probabilities.

An energy vector holds the unweighted losses.  The part of it that changes when some objects move is the sum over the cliques that contain
one of them; cliques among objects that move rigidly together keep their losses and are left out.
"""

from collections.abc import Mapping
from dataclasses import MISSING, fields
from typing import Any

import numpy as np

import grammar.layout.circulation
import grammar.layout.unit_rows  # noqa: F401  kernels of these are rows of LOSSES
from grammar.geometry.arrays import Floats
from grammar.geometry.kernels import entry, inlined, kernel
from grammar.layout import columns as col
from grammar.layout.losses import LOSSES
from grammar.layout.problem import Problem, State
from grammar.spec.energy_terms import ENERGY_TERMS, TERMS, Weights

_OBJECT_CALLS = {
    "object": "{add}(problem, state, i, out)",
    "partner": """partner = {partner}(problem, state, i)
    if partner >= 0 and state.hold[partner, col.ACTIVE] and moved[partner] != moved[i]:
        {add}(problem, state, i, out)""",
}
"""What object ``i`` costs on its own or with walls, and with partners that do not move along with it."""

_OTHER_CALLS = {
    "partner": """if {partner}(problem, state, j) == i:
        {add}(problem, state, j, out)"""
}
"""What object ``j`` costs with its partner ``i``."""

_PAIR_CALLS = {"pair": "{add}(problem, state, i, j, squared, out)"}


def _calling(head: str, calls: Mapping[str, str]) -> Any:
    """Return a function that calls the kernels of all rows whose scope is in ``calls``, in their order; numba sees plain calls."""
    rows = [row for row in LOSSES if row.scope in calls]
    kernels = {each.__name__: each for row in rows for each in (row.kernel, row.partner) if each is not None}
    lines = [calls[row.scope].format(add=row.kernel.__name__, partner=getattr(row.partner, "__name__", "")) for row in rows]
    names: dict[str, Any] = {"__name__": __name__, "col": col, **kernels}
    exec(compile("\n    ".join([f"def {head}:", *lines]), __file__, "exec"), names)
    return names[head[: head.index("(")]]


_add_object = kernel(_calling("_add_object(problem, state, i, moved, out)", _OBJECT_CALLS))
_add_other = inlined(_calling("_add_other(problem, state, i, j, out)", _OTHER_CALLS))
_add_pair = inlined(_calling("_add_pair(problem, state, i, j, squared, out)", _PAIR_CALLS))


@kernel
def weighted(problem, energy):  # type: ignore[no-untyped-def]
    """Return the weighted sum of an energy vector."""
    total = 0.0
    for term in range(len(energy)):
        total += problem.weight[term] * energy[term]
    return total


@entry
def local_energy(problem, state, members, count, moved, limit, out):  # type: ignore[no-untyped-def]
    """Write to ``out`` the losses of the cliques that change when the first ``count`` ``members`` move; return their weighted sum.

    ``moved[i]`` is 0 for what stays and equal for objects that move rigidly together.  All losses grow from zero, so once the sum exceeds
    ``limit`` the rest is left out.
    """
    where, link, item = state.where, problem.link, problem.object
    for term in range(len(out)):
        out[term] = 0.0
    total = 0.0
    for m in range(count):
        # Add what the member costs with walls, its support and its core.
        i = members[m]
        if link[i, col.MOUNT] != col.FIXED:
            _add_object(problem, state, i, moved, out)
        total = weighted(problem, out)
        if total > limit:
            return total
        # Add its cliques with every other object; those with members of lower index were added with these.
        for j in range(len(link)):
            if not state.hold[j, col.ACTIVE] or moved[j] == moved[i] or (moved[j] > 0 and j < i):
                continue
            if moved[j] == 0:
                _add_other(problem, state, i, j, out)
            # Circles about the origins tell which objects cannot meet.
            dx, dy = where[i, col.X] - where[j, col.X], where[i, col.Y] - where[j, col.Y]
            squared = dx * dx + dy * dy
            if squared > (item[i, col.OUTER_RADIUS] + item[j, col.OUTER_RADIUS]) ** 2:
                continue
            _add_pair(problem, state, i, j, squared, out)
            total = weighted(problem, out)
            if total > limit:
                return total
    return weighted(problem, out)


def full_energy(problem: Problem, state: State) -> Floats:
    """Return the (t,) unweighted losses of the whole layout, active objects only; without circulation and reach."""
    members = np.flatnonzero(state.active)
    moved, out = np.zeros(len(problem.link), np.int64), np.zeros(len(problem.weight))
    moved[members] = members + 1
    local_energy(problem, state, members, len(members), moved, np.inf, out)
    return out


def terms_table() -> str:
    """Return two Markdown tables: all terms with the kernels that add to them, and these kernels with what they read."""
    defaults = {field.name: "" if field.default is MISSING else f"{field.default:g}" for field in fields(Weights)}
    lines = ["| term | kind | unit | default weight | loss | formula | kernels | weight learned from |", f"|{'---|' * 8}"]
    for name, term in ENERGY_TERMS.items():
        kernels = ", ".join(f"`{row.kernel.__name__}`" for row in LOSSES if name in row.terms)
        learned = f"{term.learned_from} cliques" if term.learned_from else f"not learned: {term.not_learned}"
        formula = term.formula.replace("|", "\\|")
        lines.append(f"| `{name}` | {term.kind} | {term.unit} | {defaults[name]} | {term.measures} | {formula} | {kernels} | {learned} |")
    lines += ["", "| kernel | scope | columns that it reads itself |", f"|{'---|' * 3}"]
    for row in sorted(LOSSES, key=lambda row: min(map(TERMS.index, row.terms))):
        lines.append(f"| `{row.kernel.__name__}` | {row.scope} | {', '.join(f'`{name}`' for name in row.columns)} |")
    return "\n".join(lines) + "\n"
