"""``scene_synth verify``: renders a bag again and compares."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from scene_synth_ros.bags.bag_verify import VerifyReport, verify_bag
from scene_synth_ros.cli.lines import first_of, printable, say_progress
from scene_synth_ros.cli.options import add_bag, add_catalog, refuse_missing_folder
from scene_synth_ros.messages.stamps import NANOSECONDS


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the command's options."""
    add_bag(parser)
    add_catalog(parser, ", if the run had one")


def run(arguments: argparse.Namespace) -> int:
    """Verify; return 0 if everything is the same, 1 if not."""
    refuse_missing_folder("--catalog", arguments.catalog)
    report = verify_bag(arguments.bag, arguments.catalog, lambda done, total: say_progress(f"frame {done}/{total}"))
    say_progress("")
    sys.stdout.write(printable(_lines(arguments.bag, report)))
    return 0 if report.good else 1


def _lines(bag: Path, report: VerifyReport) -> list[str]:
    lines = first_of("damaged", report.damaged)
    if report.first is not None:
        topic, stamp, room, frame, detail = report.first
        seconds = f"{stamp // NANOSECONDS}.{stamp % NANOSECONDS:09d}"
        lines.append(f"different: {topic} at {seconds} s, room {room}, frame {frame}: {detail}")
    same = report.compared - report.different
    lines.append(
        f"{bag}: {same} of {report.compared} messages of {report.frames} frames are the same when rendered again; "
        f"{report.manifests} manifests read"
    )
    return lines
