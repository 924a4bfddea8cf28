"""Branching probabilities such that the valid rooms have the counts of the data.

A structure that finds no valid layout is rejected, and structures with bulky furniture are rejected more often, so valid rooms hold fewer
objects than the branching probabilities say.  The likelihood of the data under the grammar truncated to valid rooms is greatest where each
branch is as frequent among valid rooms as in the data: the gradient in a log-probability is the difference of both.  Whether a structure
passes does not depend on the probabilities, so rooms that were sampled under some tell the frequencies under all others by importance
weights, the ratios of the structures' probabilities (Monte Carlo maximum likelihood: Geyer and Thompson, J. Royal Statistical Society B
1992).  Under these weights iterative scaling moves the probabilities by the ratio of wanted to actual frequencies until both agree; then
rooms are sampled with the new probabilities, and again.  The wanted frequency of a branch is first what counting gave, then shifted until
each category is as frequent as in the data.  The size of the room and the numbers of doors and windows are choices like all others.
"""

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from collections.abc import Set as AbstractSet
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from grammar.geometry.arrays import Floats, Ints
from grammar.learning.choices import LEAST, Choices, SampledCounts, branching_of, counted, with_branching
from grammar.spec.request import RequestError
from grammar.spec.rules import Grammar

RoomSampler = Callable[[Grammar, int, Sequence[int]], list[SampledCounts]]
"""Grammar, stream of random numbers, indices of rooms -> what was in each of them."""

_STEPS = 300
_CONSTANT_STEPS = 30
_RATE = 0.3
_FARTHEST = 0.8
"""How far a log-probability may move in one round: further away the importance weights say little."""

_MOST_UNEVEN = 2.0
"""How many times fewer the effective number of rooms, by their importance weights (Kish, Survey Sampling 1965), may become.

With fewer, noise is learned."""

_DOUBTED, _MOST_DOUBT = 8.0, 4.0
"""A branch that so many rooms are expected to take moves by half of what these say it should, and a rarer one by a fifth at least.

Else the numbers of few rooms, which scatter, would be learned."""

_GIVEN_UP, _LEAST_EXPECTED = math.log(20.0), 4.0
"""Sizes of rooms and numbers of openings that never pass where so many were expected are drawn hardly at all."""

_MOST_MOVED = math.log(3.5)
"""How far the log-probability of a branch may move from what counting gave: what hardly ever passes is not to crowd out the rest."""


_ANY_SHARE, _LEAST_SHARE = 10.0, 0.05
"""Bounds of the shares of floor and walls that furniture may take."""

_NOT_FULLEST = 0.95
"""Share of the rooms that pass, by how full they are, that stay: of structures fuller than these hardly any passes."""


@dataclass(frozen=True, slots=True, kw_only=True)
class TruncationOptions:
    """``iterations`` of ``rooms`` each.

    Sizes of rooms and numbers of openings that seldom pass are drawn at most ``raised`` times as often as they were seen.
    """

    iterations: int = 0
    rooms: int = 100
    raised: float = 1.5


@dataclass(frozen=True, slots=True, kw_only=True)
class TruncationRow:
    """One iteration: divergence of sampled categories from the data's in nats, mean objects of covered categories, rooms that failed.

    ``count_kl``: divergence of the mean numbers of these categories in a room, nats, and ``scatter``: the standard deviation of that over
    draws of as many rooms.
    """

    iteration: int
    category_kl: float
    objects: float
    failed: int
    count_kl: float
    scatter: float


def category_kl(p: Mapping[str, float], q: Mapping[str, float]) -> float:
    """Return ``sum p (log(p + 1e-6) - log(q + 1e-6))`` (ATISS, Paschalidou et al., NeurIPS 2021)."""
    return sum(value * (math.log(value + 1e-6) - math.log(q.get(name, 0.0) + 1e-6)) for name, value in p.items())


def count_kl(p: Mapping[str, float], q: Mapping[str, float], rooms: int) -> float:
    """Return ``sum p log(p / q) - p + q``, the divergence of Poisson numbers with the means ``q`` of so many rooms from those with ``p``.

    Half an object of each in all rooms together is added to both, so that one that no room happens to have does not decide.
    """
    half = 0.5 / rooms
    return sum(value * math.log((value + half) / (q.get(name, 0.0) + half)) - value + q.get(name, 0.0) for name, value in p.items())


def frequencies(counts: Mapping[str, float], names: Iterable[str]) -> dict[str, float]:
    """Return the shares of the named categories among themselves."""
    chosen = {name: float(counts.get(name, 0.0)) for name in sorted(names)}
    total = sum(chosen.values())
    return {name: value / max(total, 1e-12) for name, value in chosen.items()}


def correct_truncation(
    grammar: Grammar, wanted: Mapping[str, float], covered: AbstractSet[str], options: TruncationOptions, sampler: RoomSampler
) -> tuple[Grammar, tuple[TruncationRow, ...]]:
    """Return the grammar whose valid rooms have the branch frequencies of ``grammar`` and the category counts ``wanted``.

    Rooms of the first iteration may be as crowded as they come; all but the fullest twentieth of these count, and later ones are no more
    crowded.  After each of the ``iterations`` its probabilities are judged by rooms sampled with them; :func:`kept_round` says which are
    taken, the first ones, which are not corrected, among them.

    Args:
        grammar: learned, with the branching probabilities that counting gave.
        wanted: category -> mean number in a room of the data, of the covered categories.
        covered: symbols that the data records; only branches that surely lead to one of them move, and the numbers of openings
            that are named as their attributes are, "window_count".
        options: of the approximation.
        sampler: of rooms.
    """
    choices = Choices.of(
        grammar, {key: branching for key, branching in branching_of(grammar).items() if counted(grammar, key, covered)}, sorted(wanted)
    )
    logs, rows, pool = choices.target, [], _Pool([], [], [])
    if options.iterations:
        grammar = replace(grammar, room=replace(grammar.room, used_share_max=_ANY_SHARE, wall_share_max=_ANY_SHARE))
    tried: list[Floats] = []
    for iteration in range(options.iterations + 1 if options.iterations else 0):
        tried.append(logs)
        rooms = sampler(with_branching(grammar, choices.branching(logs)), iteration, range(options.rooms))
        passed = [room for room in rooms if not room.failed]
        if not passed:
            raise RequestError(f"{grammar.room_type}: expected some valid rooms of {len(rooms)}, got none; widen the room or its budget")
        failed = len(rooms) - len(passed)
        if not iteration:
            used, wall = np.quantile([(room.used_share, room.wall_share) for room in passed], _NOT_FULLEST, axis=0).clip(_LEAST_SHARE)
            grammar = replace(grammar, room=replace(grammar.room, used_share_max=float(used), wall_share_max=float(wall)))
            passed = [room for room in passed if room.used_share <= used and room.wall_share <= wall] or passed
        seen = {name: sum(room.categories.get(name, 0) for room in passed) / len(passed) for name in wanted}
        rows.append(
            TruncationRow(
                iteration=iteration,
                category_kl=category_kl(frequencies(wanted, wanted), frequencies(seen, wanted)),
                objects=sum(seen.values()),
                failed=failed,
                count_kl=count_kl(wanted, seen, len(passed)),
                # 2 n times the divergence follows a chi-square distribution where the means agree
                scatter=math.sqrt(0.5 * max(len(wanted), 1)) / len(passed),
            )
        )
        pool.logs.append(logs)
        pool.taken.append(choices.taken(passed))
        pool.counts.append(np.array([[room.categories.get(name, 0) for name in choices.names] for room in passed], np.float64))
        logs = _scaled(choices, pool, np.array([wanted[name] for name in choices.names]), logs, options.raised)
    return with_branching(grammar, choices.branching(tried[kept_round(rows)] if tried else logs)), tuple(rows)


def kept_round(rows: Sequence[TruncationRow]) -> int:
    """Return the index of the round whose probabilities are kept: the last of those with about the least divergence of numbers.

    Rounds that differ by less than they scatter are alike in that, and later ones are nearer in the sizes of rooms and in openings too.
    """
    least = min((row.count_kl for row in rows), default=0.0)
    return max((k for k, row in enumerate(rows) if row.count_kl <= least + row.scatter), default=0)


class _Pool(NamedTuple):
    """Of each round the log-probabilities (c,), how often its rooms made each choice (n, c), and the rooms' counts by category (n, k)."""

    logs: list[Floats]
    taken: list[Floats]
    counts: list[Floats]


def _scaled(choices: Choices, pool: _Pool, mean: Floats, start: Floats, raised: float) -> Floats:
    """Return the log-probabilities under which all rooms sampled so far, weighted by importance, have the wanted frequencies."""
    taken, category_counts, owner = np.concatenate(pool.taken), np.concatenate(pool.counts), choices.owner
    mixture = _log_mixture(pool, taken)
    sized, bounding = choices.sized, choices.bounding
    hopeless = bounding & (taken.sum(0) == 0.0) & (len(taken) * np.exp(choices.target) > _LEAST_EXPECTED)
    wanted = _log_normalized(np.where(hopeless, choices.target - _GIVEN_UP, choices.target), owner)
    logs = start = _log_normalized(np.where(hopeless, choices.target - _GIVEN_UP, start), owner)
    begun = 0.0
    for _ in range(_STEPS):
        # weigh the rooms
        weight = taken @ logs - mixture
        weight = np.exp(weight - weight.max())
        weight /= weight.sum()
        uneven = float(np.square(weight).sum())
        begun = begun or uneven
        if uneven > _MOST_UNEVEN * begun:
            break
        # shift the wanted frequencies towards the categories that are too rare
        wanted = _log_normalized(wanted + _RATE * choices.pull @ np.log((mean + 0.02) / (weight @ category_counts + 0.02)), owner)
        # move the probabilities towards the wanted frequencies, but not far from where the rooms were sampled
        counts = weight @ taken * len(taken)
        total = np.bincount(owner, counts)[owner]
        actual = np.log(np.maximum((counts + np.exp(wanted)) / (total + 1.0), LEAST))
        pulled = np.where(sized, 0.0, _DOUBTED / (total * np.exp(wanted) + _DOUBTED / _MOST_DOUBT)) * (logs - choices.target)
        moved = logs + _RATE * (total / (total + 20.0) * (wanted - actual) - pulled)
        moved = start + np.clip(moved - start, -_FARTHEST, _FARTHEST)
        low = np.where(bounding, -np.inf, choices.target - _MOST_MOVED)
        high = choices.target + np.where(bounding, math.log(raised), _MOST_MOVED)
        logs = _log_normalized(np.clip(moved, low, high), owner)
    return logs


def _log_mixture(pool: _Pool, taken: Floats) -> Floats:
    """Return for each room the logarithm of the density of all rounds together.

    The rounds' normalising constants, the shares of their structures that pass, are unknown; they follow from each other (Shirts and
    Chodera, J. Chemical Physics 2008).
    """
    each = np.array([taken @ logs + math.log(len(part)) for logs, part in zip(pool.logs, pool.taken, strict=True)])
    constants = np.zeros(len(each))
    for _ in range(_CONSTANT_STEPS):
        mixture = np.logaddexp.reduce(each - constants[:, None], axis=0)
        sizes = np.array([math.log(len(part)) for part in pool.taken])
        constants = np.logaddexp.reduce(each - sizes[:, None] - mixture, axis=1)
        constants -= constants[0]
    return np.asarray(np.logaddexp.reduce(each - constants[:, None], axis=0))


def _log_normalized(logs: Floats, owner: Ints) -> Floats:
    """Return log-probabilities normalised within each key; ``owner`` is the key of each entry."""
    return np.asarray(logs - np.log(np.bincount(owner, np.exp(logs)))[owner])


def truncation_csv(rows: Sequence[TruncationRow]) -> str:
    """Return the curve as CSV."""
    lines = ["iteration,category_kl,objects,failed,count_kl"]
    lines.extend(f"{row.iteration},{row.category_kl:.6g},{row.objects:.6g},{row.failed},{row.count_kl:.6g}" for row in rows)
    return "\n".join(lines) + "\n"
