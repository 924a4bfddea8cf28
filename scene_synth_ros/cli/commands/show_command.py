"""``scene_synth show``: a bag as one HTML page, for a browser and nothing else."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from scene_synth_ros.cli.options import check_bounds, check_page, told_lines
from scene_synth_ros.cli.page.page_file import PageReport, write_page
from scene_synth_ros.pages.document import open_page

ROOMS, FRAMES, MAX_SIZE = 8, 8, 640
LIMITS = {"rooms": (1, 1000), "frames": (1, 1000), "max_size": (16, 4096)}
"""Option -> smallest and largest value."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the command's options."""
    parser.add_argument("bag", type=Path, help="folder of the bag, or its .mcap file")
    parser.add_argument("--out", type=Path, metavar="FILE", help="the page (default: BAG.html beside the bag)")
    parser.add_argument("--rooms", type=int, default=ROOMS, metavar="N", help="most rooms to show, evenly spread (default: %(default)s)")
    parser.add_argument(
        "--frames", type=int, default=FRAMES, metavar="N", help="most frames of each room, evenly spread (default: %(default)s)"
    )
    parser.add_argument(
        "--max-size",
        type=int,
        default=MAX_SIZE,
        metavar="PX",
        help="longer side of the images, larger ones are reduced (default: %(default)s)",
    )
    parser.add_argument("--open", action="store_true", help="open the page in the browser")


def run(arguments: argparse.Namespace) -> int:
    """Write the page, say what it shows and what is missing; return 0 if there is a page."""
    check_bounds(arguments, LIMITS)
    bag = arguments.bag.resolve()
    out = arguments.out or bag.with_name(f"{bag.name}.html")
    check_page(out)
    report = show_bag(arguments.bag, out, arguments.rooms, arguments.frames, arguments.max_size)
    sys.stdout.write(describe(report, out))
    if arguments.open:
        sys.stdout.write(open_page(out))
    return 0


def show_bag(bag: Path, out: Path, rooms: int = ROOMS, frames: int = FRAMES, max_size: int = MAX_SIZE) -> PageReport:
    """Write the page of a bag, with progress on a terminal; see :func:`write_page`."""
    report = write_page(bag, out, rooms=rooms, frames=frames, max_size=max_size, progress=_progress)
    if sys.stderr.isatty():
        sys.stderr.write("\r\033[K")
    return report


def describe(report: PageReport, path: Path) -> str:
    """Return what is said of a page that was written."""
    rooms, frames = (
        f"{'' if shown == found else f'{shown} of '}{found} {noun}{'' if found == 1 else 's'}"
        for shown, found, noun in ((report.rooms, report.rooms_found, "room"), (report.frames, report.frames_found, "frame"))
    )
    return told_lines(f"page: {path} ({rooms}, {frames}, {report.size / 1e6:.1f} MB)", report.notes)


def _progress(what: str, messages: int) -> None:
    if sys.stderr.isatty():
        sys.stderr.write(f"\r{messages} messages {what}\033[K")
