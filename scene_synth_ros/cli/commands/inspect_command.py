"""``scene_synth inspect``: what a bag holds and what is wrong with it."""

from __future__ import annotations

import argparse
import sys

from scene_synth_ros.bags.bag_inspect import inspect_bag, render_report
from scene_synth_ros.cli.options import add_bag


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the command's options."""
    add_bag(parser)


def run(arguments: argparse.Namespace) -> int:
    """Print the report; return 1 if the bag has a fault, or lacks what its run promised."""
    report = inspect_bag(arguments.bag)
    sys.stdout.write(render_report(report) + "\n")
    return 1 if report.faults or report.lacking else 0
