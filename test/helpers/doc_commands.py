"""Finds the command lines of a Markdown page: lines of its code blocks, and code within its text."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).resolve().parents[2]
PAGES = (ROOT / "README.md", ROOT / "CONTRIBUTING.md", *sorted((ROOT / "docs").glob("*.md")))

_PROGRAMS = (
    r"scene_synth|\.venv/bin/\w+|python3?|pip3?|pipx|apt|apt-get|sudo|make|ros2|colcon|rosdep|docker|podman|rviz2|chromium|pytest|ruff|mypy"
    r"|cd|git|export|source|\.|rm|cp|mv|mkdir|curl|wget|npm|npx|node|evo_\w+|mcap|gh|bash|sh"
)
_COMMAND = re.compile(rf"(?:\w+=\S+ )*(?:{_PROGRAMS}) ")
_FENCE = re.compile(r"^( *)```([^\n]*)\n(.*?)^\1```", re.MULTILINE | re.DOTALL)
_INDENTED = re.compile(r"(?:\A|(?<=\n\n))(?:    +\S[^\n]*\n)+", re.MULTILINE)
_INLINE = re.compile(r"(?<!`)`((?:[^`\n]|\n(?!\s*\n))+)`(?!`)")
_SHELLS = ("sh", "bash", "shell", "console")


class DocCommand(NamedTuple):
    """A command line as a page prints it, with blanks made one and comments left out."""

    page: Path
    line: int
    text: str

    def __str__(self) -> str:
        """Return where it stands and what it is."""
        return f"{self.page.relative_to(ROOT)}:{self.line}: {self.text}"


def doc_commands() -> list[DocCommand]:
    """Return every command line of all pages."""
    return [DocCommand(page, line, text) for page in PAGES for line, text in commands_in(page.read_text(encoding="utf-8"))]


def commands_in(text: str) -> Iterator[tuple[int, str]]:
    """Yield the line number, from 1, and the text of each command of a page.

    A block with one line that begins with the name of a program has commands only, as has one that is marked as a shell's.
    """
    for match in _FENCE.finditer(text):
        yield from _of_block(match[3], _line_at(text, match.start(3)), match[2].strip())
    for match in _INDENTED.finditer(_FENCE.sub(_blank, text)):
        yield from _of_block(match[0], _line_at(text, match.start()), "")
    yield from ((line, code) for line, code in code_in_text(text) if _COMMAND.match(code))


def code_in_text(text: str) -> Iterator[tuple[int, str]]:
    """Yield the line number, from 1, and each piece of code that stands within the text of a page, outside of blocks."""
    text = _INDENTED.sub(_blank, _FENCE.sub(_blank, text))
    for match in _INLINE.finditer(text):
        yield _line_at(text, match.start()), " ".join(match[1].replace(r"\|", "|").split())


def _of_block(block: str, first: int, language: str) -> Iterator[tuple[int, str]]:
    joined = block.replace("\\\n", " \0")  # a line that goes on counts as the line that it begins with
    lines, number = [], first
    for line in joined.split("\n"):
        code = " ".join(re.sub(r"(^|\s)#(\s.*)?$", "", line.replace("\0", "")).split()).removeprefix("$ ")
        if code:
            lines.append((number, code))
        number += 1 + line.count("\0")
    if language in _SHELLS or (not language and any(_COMMAND.match(code + " ") for _, code in lines)):
        yield from lines


def _line_at(text: str, place: int) -> int:
    return text.count("\n", 0, place) + 1


def _blank(match: re.Match[str]) -> str:
    return re.sub(r"[^\n]", " ", match[0])
