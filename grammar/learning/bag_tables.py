"""Tables over bags of objects: for each bag its probability and the counts that it implies, and the table of two independent parts."""

from __future__ import annotations

from operator import add, le, sub

import numpy as np

from grammar.geometry.arrays import Floats, Ints
from grammar.geometry.kernels import entry

Bag = tuple[int, ...]
Table = dict[Bag, tuple[float, Floats]]

_NEGLIGIBLE = 1e-12
"""Share of a part's likeliest bag below which a bag is left out."""

_FEW_PAIRS = 8
"""Pairs of bags that are combined one by one; of more the arrays are worth making."""


def product(first: Table, second: Table, bag: Bag) -> Table:
    """Return the table of two independent parts, without bags that hold more than the room does or that are next to impossible.

    Args:
        first: one part.
        second: the other part.
        bag: the room's.
    """
    if len(second) == 1:
        ((b, (q, w)),) = second.items()
        if not any(b):
            return {a: (p * q, p * w + q * v) for a, (p, v) in first.items()}
    table = _paired(first, second, bag) if len(first) * len(second) <= _FEW_PAIRS else _summed(first, second, bag)
    least = _NEGLIGIBLE * max((p for p, _ in table.values()), default=0.0)
    return {key: value for key, value in table.items() if value[0] >= least}


def _paired(first: Table, second: Table, bag: Bag) -> Table:
    table: Table = {}
    for a, (p, v) in first.items():
        free = tuple(map(sub, bag, a))
        for b, (q, w) in second.items():
            if all(map(le, b, free)):
                key = tuple(map(add, a, b))
                old = table.get(key)
                both = p * q
                counts = p * w + q * v
                table[key] = (both, counts) if old is None else (old[0] + both, old[1] + counts)
    return table


def _summed(first: Table, second: Table, bag: Bag) -> Table:
    """Return what :func:`_paired` does, to the bit, by a kernel over all pairs."""
    both = np.array(list(first))[:, None, :] + np.array(list(second))[None, :, :]
    i, j = np.nonzero((both <= np.array(bag)).all(2))
    places: dict[Bag, int] = {}
    k = np.array([places.setdefault(tuple(key), len(places)) for key in both[i, j].tolist()], np.int64)
    p, q = (np.array([value for value, _ in part.values()]) for part in (first, second))
    v, w = (np.array([counts for _, counts in part.values()]) for part in (first, second))
    chances, counts = np.zeros(len(places)), np.zeros((len(places), v.shape[1]))
    _add_pairs(p, v, q, w, i, j, k, chances, counts)
    return {key: (float(chances[place]), counts[place]) for key, place in places.items()}


@entry
def _add_pairs(p: Floats, v: Floats, q: Floats, w: Floats, i: Ints, j: Ints, k: Ints, chances: Floats, counts: Floats) -> None:
    """Add the probability of each pair of bags, and its counts, to those of the bag that they make: ``chances``, ``counts``."""
    for pair in range(len(k)):
        a, b, to = i[pair], j[pair], k[pair]
        chances[to] += p[a] * q[b]
        for c in range(v.shape[1]):
            counts[to, c] += p[a] * w[b, c] + q[b] * v[a, c]
