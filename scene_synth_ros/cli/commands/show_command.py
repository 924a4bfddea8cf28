"""``scene_synth show``: a bag, or a dataset, as one HTML page, for a browser and nothing else."""

import argparse
import sys
from pathlib import Path

from scene_synth_ros.cli.lines import counted, page_lines, say_progress
from scene_synth_ros.cli.options import add_number, add_page_options, refuse_no_file
from scene_synth_ros.cli.page.page_file import PageReport, write_page
from scene_synth_ros.pages.document import open_page

ROOMS, FRAMES, MAX_SIZE = 8, 8, 640


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the command's options."""
    parser.add_argument("bag", type=Path, help="folder of the bag, its .mcap file, or folder of a dataset: shards of it, evenly spread")
    parser.add_argument("--out", type=Path, metavar="FILE", help="the page (default: BAG.html beside the bag)")
    spread = "evenly spread (default: %(default)s)"
    add_number(parser, "--rooms", 1, 1000, default=ROOMS, metavar="N", help=f"most rooms to show, {spread}")
    add_number(parser, "--frames", 1, 1000, default=FRAMES, metavar="N", help=f"most frames of each room, {spread}")
    add_page_options(parser, "images", MAX_SIZE, 4096)


def run(arguments: argparse.Namespace) -> int:
    """Write the page, say what it shows and what is missing; return 0 if there is a page."""
    bag = arguments.bag.resolve()
    out = arguments.out or bag.with_name(f"{bag.name}.html")
    refuse_no_file("--out", out)
    report = show_bag(arguments.bag, out, arguments.rooms, arguments.frames, arguments.max_size)
    sys.stdout.write(describe(report, out))
    if arguments.open:
        sys.stdout.write(open_page(out))
    return 0


def show_bag(bag: Path, out: Path, rooms: int = ROOMS, frames: int = FRAMES, max_size: int = MAX_SIZE) -> PageReport:
    """Write the page of a bag, with progress on a terminal; see :func:`write_page`."""
    report = write_page(
        bag,
        out,
        rooms=rooms,
        frames=frames,
        max_size=max_size,
        progress=lambda what, messages: say_progress(f"{messages} messages {what}"),
    )
    say_progress("")
    return report


def describe(report: PageReport, path: Path) -> str:
    """Return what is said of a page that was written."""
    rooms, frames = (
        f"{'' if shown == total else f'{shown} of '}{counted(total, noun)}"
        for shown, total, noun in ((report.rooms, report.rooms_found, "room"), (report.frames, report.frames_found, "frame"))
    )
    return page_lines(f"page: {path} ({rooms}, {frames}, {report.size / 1e6:.1f} MB)", report.notes)
