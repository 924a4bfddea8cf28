"""``scene_synth demo``: a small run, and what it recorded as a page that opens in the browser.

It is ``scene_synth run`` with ``--record``, ``--contact-sheet`` and ``--show`` in one new folder, for who has just installed the program.
"""

import argparse
import sys
import time
from contextlib import suppress
from pathlib import Path

from scene_synth_ros.cli.commands import run_command
from scene_synth_ros.cli.options import UsageError
from scene_synth_ros.pages.document import open_page

PROFILE = "demo"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the command's options."""
    parser.add_argument("--rooms", type=int, default=4, help="number of rooms (default: %(default)s)")
    parser.add_argument("--frames", type=int, default=8, help="frames of each room (default: %(default)s)")
    parser.add_argument("--seed", type=int, default=1, help="seed of the rooms (default: %(default)s)")
    parser.add_argument("--out", type=Path, metavar="FOLDER", help="new folder of bag, contact sheet and page (default: runs/demo-TIME)")
    parser.add_argument("--no-open", action="store_true", help="leave the browser alone")


def run(arguments: argparse.Namespace) -> int:
    """Record, draw, write the page, open it; return the exit status of the run."""
    folder = arguments.out or Path("runs") / time.strftime("demo-%Y%m%d-%H%M%S")
    if folder.exists():
        raise UsageError(f"--out {folder}: exists already; choose another folder or remove it")
    folder.mkdir(parents=True)
    page = folder / "page.html"
    parser = argparse.ArgumentParser()
    run_command.add_arguments(parser)
    chosen = [word for name in ("rooms", "frames", "seed") for word in (f"--{name}", str(getattr(arguments, name)))]
    outputs = ["--record", str(folder / "bag"), "--contact-sheet", str(folder / "contact_sheet.png"), "--show", str(page)]
    try:
        code = run_command.run(parser.parse_args(["--params", PROFILE, *chosen, *outputs]))
    finally:
        with suppress(OSError):  # it holds something
            folder.rmdir()
    if page.exists() and not arguments.no_open:
        sys.stdout.write(open_page(page))
    return code
