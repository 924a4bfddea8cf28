"""Options that several commands have, and numbers with their ranges: each is declared in one place, here or by a dataclass's field."""

import argparse
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Literal, get_args, get_origin

from scene_description import SceneSynthError
from scene_description.strict import field_types, split_annotation
from scene_description.whole import WholeFolder

MAX_WORKERS = 1024
MAX_READERS = 64
"""Most threads that read, decode and write frames."""


class UsageError(SceneSynthError):
    """An option or a file name that cannot be used; one line with the option, expected and got."""


def add_number(parser: argparse._ActionsContainer, option: str, low: float, high: float | None = None, **words: Any) -> None:
    """Declare an option that is a number within a range; a whole number if ``low`` is one.

    The parser raises UsageError for others.  ``words`` are those of ``add_argument``.
    """
    kind = type(low)

    def read(text: str) -> float:
        value = kind(text)
        if not (low <= value and (high is None or value <= high)):
            span = f"at least {low}" if high is None else f"{_short(low)} to {_short(high)}"
            raise UsageError(f"{option}: expected {span}, got {_short(value)}")
        return value

    read.__name__ = kind.__name__  # argparse names it where the text is no number
    parser.add_argument(option, type=read, **words)


def add_field(parser: argparse.ArgumentParser, option: str, cls: type, field: str, **words: Any) -> None:
    """Declare an option for a field of a dataclass, by the field's own type, choices and range, and by its description without ``help``."""
    annotation, limits = split_annotation(field_types(cls)[field])
    words.setdefault("help", limits.description[:1].lower() + limits.description[1:])
    if get_origin(annotation) is Literal:
        parser.add_argument(option, choices=get_args(annotation), **words)
    else:
        assert limits.ge is not None and limits.le is not None
        add_number(parser, option, annotation(limits.ge), annotation(limits.le), **words)


def add_workers(parser: argparse.ArgumentParser, **words: Any) -> None:
    """Declare ``--workers``."""
    words.setdefault("help", "processes; they change nothing but the time (default: %(default)s)")
    add_number(parser, "--workers", 1, MAX_WORKERS, metavar="N", **words)


def add_readers(parser: argparse.ArgumentParser, work: str) -> None:
    """Declare ``--threads`` of a command that reads frames; ``work`` says what they do."""
    add_number(parser, "--threads", 1, MAX_READERS, default=2, metavar="N", help=f"that {work} (default: %(default)s)")


def add_bag(parser: argparse.ArgumentParser, kind: Callable[[str], Any] = Path) -> None:
    """Declare the bag that a command reads."""
    parser.add_argument("bag", type=kind, help="folder of the bag, or its .mcap file")


def add_bag_or_dataset(parser: argparse.ArgumentParser) -> None:
    """Declare the bag that a command reads, or the dataset, all of whose shards it reads, and ``--workers`` for these."""
    parser.add_argument("bag", type=Path, help="folder of the bag, its .mcap file, or folder of a dataset: all its shards")
    add_workers(parser, default=1, help="processes that share the shards of a dataset (default: %(default)s)")


def add_source(parser: argparse.ArgumentParser) -> None:
    """Declare the bag or dataset that a command reads."""
    parser.add_argument("source", metavar="BAG|SHARDS", help="a bag, its folder or .mcap file; a dataset, its folder or URL")


def add_catalog(parser: argparse.ArgumentParser, purpose: str = "") -> None:
    """Declare ``--catalog``, to be checked by :func:`refuse_missing_folder`; ``purpose`` ends its help."""
    parser.add_argument("--catalog", type=Path, metavar="DIR", help=f"folder of the user's models{purpose}")


def add_page_options(parser: argparse.ArgumentParser, what: str, size: int, largest: int) -> None:
    """Declare what commands that write a page have in common: the size of ``what`` it shows, and whether to open it."""
    add_number(
        parser,
        "--max-size",
        16,
        largest,
        default=size,
        metavar="PX",
        help=f"longer side of the {what}, larger ones are reduced (default: %(default)s)",
    )
    parser.add_argument("--open", action="store_true", help="open the page in the browser")


def refuse_missing_folder(option: str, folder: Path | None) -> None:
    """Refuse a folder that is given and is none.

    Raises:
        UsageError: it is no folder.
    """
    if folder is not None and not folder.is_dir():
        raise UsageError(f"{option} {folder}: expected a folder, got {'a file' if folder.exists() else 'none'}; check the path")


def refuse_no_file(option: str, path: Path | None) -> None:
    """Refuse a path that cannot be a file's: its folder does not exist, or it is a folder itself.

    Raises:
        UsageError: names the option.
    """
    if path is not None and (path.is_dir() or not path.absolute().parent.is_dir()):
        raise UsageError(f"{option} {path}: expected a file in a folder that exists")


def names_in(text: str) -> tuple[str, ...]:
    """Return the names of a list with commas between them."""
    return tuple(word.strip() for word in text.split(",") if word.strip())


def _short(number: float) -> str:
    return f"{number:g}" if isinstance(number, float) else str(number)


@contextmanager
def new_folder(out: Path) -> Iterator[Path]:
    """Yield a folder under another name, which gets its own, that of ``--out``, when all has been written, and goes if not.

    Raises:
        UsageError: the folder exists, or the one that it is to be in does not.
    """
    if out.exists():
        raise UsageError(f"--out {out}: exists already; choose another folder or remove it")
    if not out.absolute().parent.is_dir():
        raise UsageError(f"--out {out}: expected a folder in a folder that exists")
    with WholeFolder(out) as folder:
        folder.mkdir()
        yield folder
