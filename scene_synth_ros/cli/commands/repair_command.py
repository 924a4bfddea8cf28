"""``scene_synth repair``: a whole bag of what is left of a cut one."""

import argparse
import sys
from pathlib import Path

from scene_synth_ros.bags.bag_repair import RepairReport, refuse_taken_place, repair_bag, repaired_name, replace_bag
from scene_synth_ros.cli.lines import first_of, printable, say_progress
from scene_synth_ros.cli.options import UsageError
from scene_synth_ros.mcap.file import COMPRESSIONS


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the command's options."""
    parser.add_argument("bag", type=Path, help="folder of the bag, or its .mcap or .mcap.active file")
    parser.add_argument("--out", type=Path, metavar="DIR", help="folder of the repaired bag (default: BAG_repaired)")
    parser.add_argument("--in-place", action="store_true", help="put the repaired bag in the place of the old one, which is then gone")
    parser.add_argument("--compression", choices=COMPRESSIONS, default="zstd", help="of the repaired bag (default: %(default)s)")


def run(arguments: argparse.Namespace) -> int:
    """Repair; return 0 if a bag could be made."""
    if arguments.in_place and arguments.out:
        raise UsageError("--in-place and --out: expected one of them")
    if arguments.in_place:
        refuse_taken_place(arguments.bag)
    out = arguments.out or repaired_name(arguments.bag)
    compression = arguments.compression
    report = repair_bag(arguments.bag, out, compression=compression, progress=lambda messages: say_progress(f"{messages} messages"))
    say_progress("")
    if arguments.in_place:
        replace_bag(arguments.bag, out)
    sys.stdout.write(_describe(report, arguments.bag if arguments.in_place else out))
    return 0


def _describe(report: RepairReport, bag: Path) -> str:
    topics = sum(1 for count in report.saved.values() if count)
    shown = [*first_of("found", report.faults), *(f"cut away: {line}" for line in report.cut)]
    return printable([*shown, f"{bag}: whole, with the {report.message_count} messages on {topics} topics that could be read"])
