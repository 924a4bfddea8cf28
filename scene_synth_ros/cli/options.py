"""What the commands that write a page have in common: bounds of their options, and the lines that tell what was written."""

from __future__ import annotations

import argparse
from collections.abc import Mapping, Sequence
from pathlib import Path

from scene_synth_ros.cli.usage import UsageError

_MAX_NOTES = 10
_LONGEST = 1000


def check_bounds(arguments: argparse.Namespace, limits: Mapping[str, tuple[int, int]]) -> None:
    """Refuse numbers beyond ``limits``: option -> smallest and largest value.

    Raises:
        UsageError: names the option.
    """
    for name, (low, high) in limits.items():
        value = getattr(arguments, name)
        if not low <= value <= high:
            raise UsageError(f"--{name.replace('_', '-')} {value}: expected {low} to {high}")


def check_page(out: Path) -> None:
    """Refuse a page that cannot be a file.

    Raises:
        UsageError: its folder does not exist, or it is a folder itself.
    """
    if not out.parent.is_dir() or out.is_dir():
        raise UsageError(f"--out {out}: expected a file in a folder that exists")


def told_lines(written: str, notes: Sequence[str]) -> str:
    """Return the line of what was written and the first notes, printable and of bounded length, as text."""
    lines = [written, *(f"note: {note}" for note in notes[:_MAX_NOTES])]
    if len(notes) > _MAX_NOTES:
        lines.append(f"note: {len(notes) - _MAX_NOTES} more on the page")
    return "".join("".join(c if c.isprintable() else "?" for c in line)[:_LONGEST] + "\n" for line in lines)
