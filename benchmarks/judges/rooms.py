"""What judges begin and end with: the words of their command lines, bags of rooms, tables."""

import argparse
import subprocess
import sys
from collections.abc import Iterable, Sequence
from pathlib import Path

from benchmarks.seeds import add_seed
from benchmarks.table import DOCS, Row, markdown_table, render_table, write_section

PICTURES_OFF = tuple(f"streams.{layer}:=false" for layer in ("normals", "semantic", "instance"))


def words_of(judge: str, frames: int) -> argparse.ArgumentParser:
    """Return the command line of a judge with the words that all have; ``frames``: of a room, where it is not told."""
    parser = argparse.ArgumentParser(prog=f"python -m benchmarks.judges.{judge}")
    parser.add_argument("--rooms", type=int, default=10)
    parser.add_argument("--frames", type=int, default=frames)
    add_seed(parser)
    parser.add_argument("-p", action="append", default=[], metavar="NODE.NAME:=VALUE", help="further parameters of the rooms")
    parser.add_argument("--write", action="store_true", help="put the table into the page")
    return parser


def program(*words: str) -> None:
    """Run a command of ``scene_synth``; it must succeed."""
    subprocess.run([sys.executable, "-m", "scene_synth_ros", *words], check=True, stdout=subprocess.DEVNULL)


def make_bags(arguments: argparse.Namespace, overlay: str, values: Iterable[str], folder: Path) -> None:
    """Make bags of rooms in a folder that is not there yet; ``values`` are ``NODE.NAME:=VALUE``, and the user's come after them."""
    words = [f"--{name}={getattr(arguments, name)}" for name in ("rooms", "frames", "seed")]
    parameters = [word for value in (*values, *arguments.p) for word in ("-p", value)]
    program("generate", *words, f"--overlay={overlay}", f"--out={folder}", *parameters)


def tell(arguments: argparse.Namespace, rows: Sequence[Row], subject: str, page: str, section: str) -> None:
    """Print figures, and with ``--write`` put them into a section of a page of the documentation."""
    title = f"{subject}, seed {arguments.seed}, {arguments.frames} frames a room"
    print(render_table(title, rows))
    if arguments.write:
        write_section(DOCS / page, section, f"{title}.\n\n{markdown_table(rows)}")
