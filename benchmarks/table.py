"""Rows of the speed tables, and the parts of pages that a bench writes."""

import re
from collections.abc import Iterable
from pathlib import Path
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
    """Return the rows as a table in Markdown; rows whose names begin with a blank belong to one before."""
    lines = ["| | measured | asked |", "| --- | --- | --- |"]
    for row in rows:
        name = f"- {row.name.strip()}" if row.name.startswith(" ") else row.name
        value = f"{row.value:.0f}" if abs(row.value) >= 1000.0 else f"{row.value:.3g}"
        asked = f"{row.measure}, missed" if row.met is False else row.measure
        lines.append(f"| {name} | {value} {row.unit}".rstrip() + f" | {asked}".rstrip() + " |")
    return "\n".join(lines)


def side_by_side(rows: Iterable[Row]) -> str:
    """Return rows named ``thing: figure`` or ``thing: figure; whose`` as a table in Markdown.

    There is a column for each thing and a line for each figure; what is told of several stands in one cell, divided by slashes.
    """
    cells: dict[str, dict[str, list[str]]] = {}
    for row in rows:
        thing, name = row.name.split(": ", 1)
        cells.setdefault(f"{name.split('; ')[0]}, {row.unit}", {}).setdefault(thing, []).append(f"{row.value:.2g}")
    things = list(dict.fromkeys(thing for found in cells.values() for thing in found))
    lines = [f"| | {' | '.join(thing.replace('_', ' ') for thing in things)} |", f"|---|{'---|' * len(things)}"]
    lines += [f"| {figure} | {' | '.join(' / '.join(found.get(thing, ['-'])) for thing in things)} |" for figure, found in cells.items()]
    return "\n".join(lines)


DOCS = Path(__file__).resolve().parent.parent / "docs"


def write_section(page: Path, name: str, text: str) -> None:
    """Put ``text`` in the place of what a page has between the marks of ``name``.

    Raises:
        ValueError: the page does not have both marks once.
    """
    begin, end = f"<!-- {name} -->\n", f"<!-- end of {name} -->"
    before = page.read_text(encoding="utf-8")
    after, count = re.subn(
        f"({re.escape(begin)}).*?({re.escape(end)})", lambda match: f"{match[1]}\n{text}\n\n{match[2]}", before, flags=re.S
    )
    if count != 1:
        raise ValueError(
            f"{page.name}: expected the marks '{begin.strip()}' and '{end}' once, got {count}; add them where the part shall stand"
        )
    page.write_text(after, encoding="utf-8")
