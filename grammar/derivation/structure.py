"""The structure of a derivation: branches of Or nodes and multiplicities of Set nodes, drawn from the root down."""

import math
from collections.abc import Callable, Mapping, Sequence
from typing import Literal, NamedTuple

import numpy as np

from grammar.derivation.constraints import CountBound
from grammar.derivation.densities import draw_index
from grammar.geometry.arrays import Floats, Ints
from grammar.spec.request import RequestError
from grammar.spec.rules import Branch, Grammar, Node

Kind = Literal["and", "or", "set", "terminal"]

_MOST_STATES = 2000
"""Entries of one table."""


class Vertex(NamedTuple):
    """One vertex of the derivation: symbol, kind, index of its parent (-1: the scene), the choice made and its log-probability."""

    symbol: str
    kind: Kind
    parent: int
    choice: str
    log_probability: float


class Chooser:
    """Makes the choices of a derivation in depth-first order by the grammar's probabilities alone.

    It is told when a branch or a copy begins and ends, for choosers whose probabilities depend on what was drawn and on what follows.
    """

    def __init__(self, rng: np.random.Generator) -> None:
        self._rng = rng

    def terminal(self, symbol: str) -> None:
        """Note that a regular terminal was reached."""

    def branch(self, node: Node) -> int:
        """Return the branch of an Or node."""
        return draw_index(self._rng, [branch.probability or 0.0 for branch in node.branches])

    def copies(self, branch: Branch) -> int:
        """Return the number of copies of a Set node's branch."""
        return draw_index(self._rng, branch.multiplicity or ())

    def begin(self, node: Node, place: int) -> None:
        """Note that a branch of an And or Set node begins."""

    def begin_copy(self, symbol: str, following: int) -> None:
        """Note that a copy of a Set node's branch begins; ``following`` more copies come after it."""

    def end(self) -> None:
        """Note that the branch or copy that began last has ended."""


def draw_structure(grammar: Grammar, rng: np.random.Generator) -> list[Vertex]:
    """Return the vertices of one structure in depth-first order; its terminals are the objects of the room."""
    vertices: list[Vertex] = []
    expand(grammar, Chooser(rng), grammar.root, -1, vertices)
    return vertices


def expand(grammar: Grammar, chooser: Chooser, symbol: str, parent: int, out: list[Vertex]) -> None:
    """Append the vertex of ``symbol`` and all below it to ``out``, with the grammar's log-probabilities of the choices made."""
    node = grammar.nodes.get(symbol)
    index = len(out)
    if node is None:
        chooser.terminal(symbol)
        out.append(Vertex(symbol, "terminal", parent, grammar.objects[symbol].category, 0.0))
        return
    if node.kind == "or":
        branch = node.branches[chooser.branch(node)]
        out.append(Vertex(symbol, "or", parent, branch.symbol, math.log(branch.probability or 1.0)))
        expand(grammar, chooser, branch.symbol, index, out)
        return
    out.append(Vertex(symbol, node.kind, parent, "", 0.0))
    for place, branch in enumerate(node.branches):
        chooser.begin(node, place)
        if branch.multiplicity is None:
            expand(grammar, chooser, branch.symbol, index, out)
        else:
            _expand_copies(grammar, chooser, branch, index, out)
        chooser.end()


def _expand_copies(grammar: Grammar, chooser: Chooser, branch: Branch, parent: int, out: list[Vertex]) -> None:
    """Draw the multiplicity of a Set node's branch and expand each copy."""
    assert branch.multiplicity is not None
    copies = chooser.copies(branch)
    index = len(out)
    out.append(Vertex(branch.symbol, "set", parent, str(copies), math.log(branch.multiplicity[copies])))
    for copy in range(copies):
        chooser.begin_copy(branch.symbol, copies - 1 - copy)
        expand(grammar, chooser, branch.symbol, index, out)
        chooser.end()


class ConditionalStructures:
    """The structures of a grammar given bounds on numbers of objects.

    Args:
        grammar: the grammar.
        bounds: the most important first; those that would make the tables too large are left out.
        greatest: the greatest number by bound that the grammar can give.
    """

    def __init__(self, grammar: Grammar, bounds: Sequence[CountBound], greatest: Sequence[int]) -> None:
        self._grammar = grammar
        self.bounds: list[CountBound] = []
        shape: list[int] = []
        # keep the bounds whose tables stay small; a count is clipped where more makes no difference
        for bound, most in zip(bounds, greatest, strict=True):
            size = (bound.least if bound.most >= most else bound.most + 1) + 1
            if size > 1 and np.prod([*shape, size]) <= _MOST_STATES:
                self.bounds.append(bound)
                shape.append(size)
        self._shape = tuple(shape)
        # mark the vectors of counts that meet all bounds
        self._accepted = np.ones(self._shape)
        for axis, bound in enumerate(self.bounds):
            numbers = np.arange(self._shape[axis])
            fits = (numbers >= bound.least) & (numbers <= bound.most)
            self._accepted = self._accepted * fits.reshape([-1 if k == axis else 1 for k in range(len(shape))])
        # caches: distributions by symbol, by copies, by branch; where a shift by some counts puts each entry
        self._tables: dict[str, Floats] = {}
        self._copies: dict[tuple[str, int], Floats] = {}
        self._branches: dict[tuple[str, tuple[float, ...]], Floats] = {}
        self._moved: dict[int, Ints] = {}
        self._nothing = np.zeros(self._shape)
        self._nothing[(0,) * len(shape)] = 1.0

    @property
    def probability(self) -> float:
        """Probability that a structure meets the bounds."""
        return float((self._table(self._grammar.root) * self._accepted).sum())

    def draw(self, rng: np.random.Generator) -> list[Vertex]:
        """Return the vertices of one structure that meets the bounds, with the log-probabilities of the grammar itself."""
        chooser = _ConditionalChooser(self, rng)
        vertices: list[Vertex] = []
        expand(self._grammar, chooser, self._grammar.root, -1, vertices)
        return vertices

    def accepted_after(self, drawn: tuple[int, ...], ahead: Floats) -> float:
        """Return the probability of meeting the bounds after the counts ``drawn``; ``ahead`` is the distribution of the counts to come."""
        axes = [np.minimum(np.arange(size) + n, size - 1) for n, size in zip(drawn, self._shape, strict=True)]
        return float((ahead * self._accepted[np.ix_(*axes)]).sum())

    def vector(self, symbol: str) -> tuple[int, ...]:
        """Return what an object adds to the counts."""
        return tuple(int(symbol in bound.symbols) for bound in self.bounds)

    def sum_of(self, first: Floats, second: Floats) -> Floats:
        """Return the distribution of the sum of two independent vectors of counts, clipped."""
        few, many = sorted((first, second), key=np.count_nonzero)
        total = np.zeros(self._accepted.size)
        for place in np.flatnonzero(few).tolist():
            if place not in self._moved:
                added = np.unravel_index(place, self._shape)
                axes = [np.minimum(np.arange(size) + n, size - 1) for n, size in zip(added, self._shape, strict=True)]
                self._moved[place] = np.ravel_multi_index(np.meshgrid(*axes, indexing="ij"), self._shape).ravel()
            total += np.bincount(self._moved[place], few.flat[place] * many.ravel(), len(total))
        return total.reshape(self._shape)

    def of_symbol(self, symbol: str) -> Floats:
        """Return the distribution of the counts below a symbol."""
        return self._table(symbol)

    def of_copies(self, symbol: str, copies: int) -> Floats:
        """Return the distribution of the counts of several copies."""
        if copies == 0:
            return self._nothing
        if (symbol, copies) not in self._copies:
            self._copies[symbol, copies] = self.sum_of(self.of_copies(symbol, copies - 1), self._table(symbol))
        return self._copies[symbol, copies]

    def of_branch(self, branch: Branch) -> Floats:
        """Return the distribution of the counts that a branch of an And or Set node adds."""
        if branch.multiplicity is None:
            return self._table(branch.symbol)
        if (branch.symbol, branch.multiplicity) not in self._branches:
            shares = [p * self.of_copies(branch.symbol, k) for k, p in enumerate(branch.multiplicity) if p > 0.0]
            self._branches[branch.symbol, branch.multiplicity] = np.asarray(sum(shares))
        return self._branches[branch.symbol, branch.multiplicity]

    def _table(self, symbol: str) -> Floats:
        if symbol not in self._tables:
            self._tables[symbol] = self._make(symbol)
        return self._tables[symbol]

    def _make(self, symbol: str) -> Floats:
        node = self._grammar.nodes.get(symbol)
        if node is None:
            table = np.zeros(self._shape)
            table[tuple(min(n, size - 1) for n, size in zip(self.vector(symbol), self._shape, strict=True))] = 1.0
            return table
        if node.kind == "or":
            return np.asarray(sum((b.probability or 0.0) * self._table(b.symbol) for b in node.branches if b.probability))
        total = self._nothing
        for branch in node.branches:
            total = self.sum_of(total, self.of_branch(branch))
        return total


class _ConditionalChooser(Chooser):
    """Makes the choices of one derivation given that the bounds are met."""

    def __init__(self, tables: ConditionalStructures, rng: np.random.Generator) -> None:
        super().__init__(rng)
        self._tables = tables
        self._drawn = (0,) * len(tables.bounds)
        self._ahead: list[Floats] = [tables.of_copies("", 0)]

    def terminal(self, symbol: str) -> None:
        """Count an object."""
        self._drawn = tuple(a + b for a, b in zip(self._drawn, self._tables.vector(symbol), strict=True))

    def branch(self, node: Node) -> int:
        """Draw a branch by its probability and that of meeting the bounds with it."""
        return self._choose([b.probability or 0.0 for b in node.branches], [b.symbol for b in node.branches])

    def _choose(self, odds: Sequence[float], symbols: Sequence[str]) -> int:
        ahead = self._ahead[-1]
        return self._weighted(odds, {k: self._tables.sum_of(self._tables.of_symbol(s), ahead) for k, s in enumerate(symbols) if odds[k]})

    def _weighted(self, odds: Sequence[float], tables: Mapping[int, Floats]) -> int:
        weights = [odds[k] * self._tables.accepted_after(self._drawn, tables[k]) if k in tables else 0.0 for k in range(len(odds))]
        total = sum(weights)
        return draw_index(self._rng, [weight / total for weight in weights])

    def copies(self, branch: Branch) -> int:
        """Draw a number of copies by its probability and that of meeting the bounds with it."""
        odds = branch.multiplicity or ()
        tables = {k: self._tables.sum_of(self._tables.of_copies(branch.symbol, k), self._ahead[-1]) for k, p in enumerate(odds) if p > 0.0}
        return self._weighted(odds, tables)

    def begin(self, node: Node, place: int) -> None:
        """Push the distribution of what comes after a branch."""
        ahead = self._ahead[-1]
        for branch in node.branches[place + 1 :]:
            ahead = self._tables.sum_of(ahead, self._tables.of_branch(branch))
        self._ahead.append(ahead)

    def begin_copy(self, symbol: str, following: int) -> None:
        """Push the distribution of what comes after a copy."""
        self._ahead.append(self._tables.sum_of(self._ahead[-1], self._tables.of_copies(symbol, following)))

    def end(self) -> None:
        """Pop the last distribution."""
        self._ahead.pop()


def conditional_structures(
    grammar: Grammar, bounds: Sequence[CountBound], greatest: Callable[[CountBound], int], rare: float
) -> ConditionalStructures | None:
    """Return tables for structures that meet bounds, or None where rejection meets them with a probability of at least ``rare``.

    Raises:
        RequestError: no structure meets all bounds; the line names those that exclude each other.
    """
    if not bounds:
        return None
    tables = ConditionalStructures(grammar, bounds, [greatest(bound) for bound in bounds])
    if tables.probability > 0.0:
        return tables if tables.probability < rare else None
    # name the bounds without which the others can be met
    at_fault = []
    for left_out in tables.bounds:
        rest = [bound for bound in tables.bounds if bound is not left_out]
        if not rest or ConditionalStructures(grammar, rest, [greatest(bound) for bound in rest]).probability > 0.0:
            at_fault.append(left_out.name)
    names = "; ".join(at_fault or [bound.name for bound in tables.bounds])
    raise RequestError(f"request: expected constraints that some {grammar.room_type} meets, got none with {names}; relax one of them")
