"""Units of a run as it sees them: how they stand in it, how much of the wall they take, and how far they reach into the room."""

from __future__ import annotations

from grammar.derivation.drafts import Draft
from grammar.spec.run_rules import RunUnit

_PLAIN = RunUnit()


def unit_rule(draft: Draft) -> RunUnit:
    """Return how a unit stands in its run."""
    return draft.rule.in_run or _PLAIN


def along_m(draft: Draft) -> float:
    """Return how much of the wall a unit takes, metres."""
    return draft.size_m[0 if unit_rule(draft).end_on else 1]


def least_along_m(draft: Draft) -> float:
    """Return the least that a unit takes of the wall, metres."""
    return draft.rule.low_m[1] if unit_rule(draft).stretches else along_m(draft)


def across_m(draft: Draft) -> float:
    """Return how far a unit reaches into the room from its back, metres."""
    return draft.size_m[1 if unit_rule(draft).end_on else 0]


def reach_m(draft: Draft) -> float:
    """Return how far a unit reaches into the room from the line of its run, metres."""
    return draft.behind_m + across_m(draft)
