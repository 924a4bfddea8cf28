"""``scene_synth verify``: renders a bag again and compares."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from scene_synth_ros.bags.bag_verify import VerifyReport, verify_bag
from scene_synth_ros.cli.usage import refuse_missing_folder
from scene_synth_ros.messages.stamps import NANOSECONDS

_MAX_LINES = 10


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the command's options."""
    parser.add_argument("bag", type=Path, help="folder of the bag, or its .mcap file")
    parser.add_argument("--catalog", type=Path, metavar="DIR", help="folder of the user's models, if the run had one")


def run(arguments: argparse.Namespace) -> int:
    """Verify; return 0 if everything is the same, 1 if not."""
    refuse_missing_folder("--catalog", arguments.catalog)
    report = verify_bag(arguments.bag, arguments.catalog, _progress)
    sys.stderr.write("\n" if sys.stderr.isatty() else "")
    sys.stdout.write("".join(f"{line}\n" for line in _lines(arguments.bag, report)))
    return 0 if report.good else 1


def _progress(done: int, total: int) -> None:
    if sys.stderr.isatty():
        sys.stderr.write(f"\rframe {done}/{total}")


def _lines(bag: Path, report: VerifyReport) -> list[str]:
    lines = [f"damaged: {line}" for line in report.damaged[:_MAX_LINES]]
    if len(report.damaged) > _MAX_LINES:
        lines.append(f"damaged: {len(report.damaged) - _MAX_LINES} more")
    if report.first is not None:
        topic, stamp, room, frame, detail = report.first
        seconds = f"{stamp // NANOSECONDS}.{stamp % NANOSECONDS:09d}"
        lines.append(f"different: {topic} at {seconds} s, room {room}, frame {frame}: {detail}")
    same = report.compared - report.different
    lines.append(
        f"{bag}: {same} of {report.compared} messages of {report.frames} frames are the same when rendered again; "
        f"{report.manifests} manifests read"
    )
    return ["".join(c if c.isprintable() else "?" for c in line)[:1000] for line in lines]
