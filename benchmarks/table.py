"""Rows of the speed tables."""

from __future__ import annotations

from collections.abc import Iterable
from typing import NamedTuple


class Row(NamedTuple):
    """One figure: what was measured, its value with unit, and the measure that it is held to (words; empty if it is a guide)."""

    name: str
    value: float
    unit: str
    measure: str = ""
    met: bool | None = None


def at_most(name: str, value: float, unit: str, limit: float) -> Row:
    """Return a row that must not exceed a limit."""
    return Row(name, value, unit, f"<= {limit:g}", value <= limit)


def at_least(name: str, value: float, unit: str, limit: float) -> Row:
    """Return a row that must reach a limit."""
    return Row(name, value, unit, f">= {limit:g}", value >= limit)


def render_table(title: str, rows: Iterable[Row]) -> str:
    """Return the rows as aligned text."""
    lines = [title]
    for row in rows:
        verdict = "" if row.met is None else ("  met" if row.met else "  MISSED")
        lines.append(f"  {row.name:<62}{row.value:>12.4g} {row.unit:<10}{row.measure:<10}{verdict}")
    return "\n".join(lines)


def markdown_table(rows: Iterable[Row]) -> str:
    """Return the rows as a table in Markdown."""
    lines = ["| | measured | asked |", "| --- | --- | --- |"]
    for row in rows:
        missed = ", missed" if row.met is False else ""
        lines.append(f"| {row.name.strip()} | {row.value:.3g} {row.unit} | {row.measure}{missed} |")
    return "\n".join(lines)
