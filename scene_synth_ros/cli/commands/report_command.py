"""``scene_synth report``: one or more evaluations as one HTML page, for a browser and nothing else."""

import argparse
import sys
from pathlib import Path

from scene_synth_ros.cli.lines import counted, page_lines, say_progress
from scene_synth_ros.cli.options import add_number, add_page_options, refuse_missing_folder, refuse_no_file
from scene_synth_ros.pages.document import open_page
from scene_synth_ros.report.report_file import ReportSummary, write_report


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the command's options."""
    parser.add_argument(
        "evaluations", type=Path, nargs="+", metavar="EVALUATION.json", help="what scene_synth evaluate wrote; several are compared"
    )
    parser.add_argument("--out", type=Path, default=Path("report.html"), metavar="FILE", help="the page (default: %(default)s)")
    parser.add_argument(
        "--bag-root", type=Path, metavar="DIR", help="folder that the bags' paths begin at (default: that of each EVALUATION.json)"
    )
    parser.add_argument(
        "--estimates",
        type=Path,
        metavar="DIR",
        help="bag of the estimates, or the folder with one for each variant (default: what each evaluation's command names)",
    )
    worst = "worst frames to show of each task of each evaluation (default: %(default)s)"
    add_number(parser, "--worst", 0, 100, default=6, metavar="N", help=worst)
    add_page_options(parser, "pictures", 320, 2048)


def run(arguments: argparse.Namespace) -> int:
    """Write the page, say what it shows and what is missing; return 0 if there is a page."""
    refuse_missing_folder("--bag-root", arguments.bag_root)
    refuse_missing_folder("--estimates", arguments.estimates)
    out: Path = arguments.out
    refuse_no_file("--out", out)
    summary = write_report(
        arguments.evaluations,
        out,
        bag_root=arguments.bag_root,
        estimates=arguments.estimates,
        worst=arguments.worst,
        max_size=arguments.max_size,
        progress=lambda what: say_progress(what[:70]),
    )
    say_progress("")
    sys.stdout.write(describe(summary, out))
    if arguments.open:
        sys.stdout.write(open_page(out))
    return 0


def describe(summary: ReportSummary, path: Path) -> str:
    """Return what is said of a report that was written."""
    counts = (
        (summary.evaluations, "evaluation"),
        (summary.tasks, "task"),
        (summary.factors, "factor"),
        (summary.pictured, "pictured frame"),
    )
    told = ", ".join(counted(count, noun) for count, noun in counts)
    return page_lines(f"report: {path} ({told}, {summary.size / 1e6:.1f} MB)", summary.notes)
