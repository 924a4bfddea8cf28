"""Lines that commands print: results on stdout, progress on a terminal's stderr."""

import sys
from collections.abc import Iterable, Sequence

_MAX_NOTES = 10
_LONGEST = 1000


def say(text: str) -> None:
    """Print a line at once, so that what reads the output sees it while the command goes on."""
    sys.stdout.write(text + "\n")
    sys.stdout.flush()


def say_progress(text: str) -> None:
    """Draw the line of progress again, on a terminal only; an empty one takes it away."""
    if sys.stderr.isatty():
        sys.stderr.write(f"\r{text}\033[K")


def counted(number: int, what: str) -> str:
    """Return a number and what it counts: ``1 room``, ``2 rooms``."""
    return f"{number} {what}{'' if number == 1 else 's'}"


def printable(lines: Iterable[str]) -> str:
    """Return lines as text, each of bounded length; what cannot be printed, as in names of a foreign bag, becomes a question mark."""
    return "".join("".join(c if c.isprintable() else "?" for c in line)[:_LONGEST] + "\n" for line in lines)


def first_of(prefix: str, texts: Sequence[str], rest: str = "more") -> list[str]:
    """Return a line for each of the first texts, and one that counts the rest of them."""
    lines = [f"{prefix}: {text}" for text in texts[:_MAX_NOTES]]
    return lines if len(texts) <= _MAX_NOTES else [*lines, f"{prefix}: {len(texts) - _MAX_NOTES} {rest}"]


def aligned(rows: Sequence[Sequence[str]], left: int = 1) -> list[str]:
    """Return rows with columns of one width: the first ``left`` columns on the left, the others on the right."""
    columns = []
    for number, column in enumerate(zip(*rows, strict=True)):
        width = max(map(len, column))
        columns.append([cell.ljust(width) if number < left else cell.rjust(width) for cell in column])
    return ["  ".join(row).rstrip() for row in zip(*columns, strict=True)]


def page_lines(written: str, notes: Sequence[str]) -> str:
    """Return the line of a page that was written, and its first notes, as text."""
    return printable([written, *first_of("note", notes, "more on the page")])


def markdown_table(head: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """Return a table of a Markdown page."""
    lines = [head, ["---"] * len(head), *([cell.replace("|", "\\|") for cell in row] for row in rows)]
    return "\n".join(f"| {' | '.join(line)} |" for line in lines)
