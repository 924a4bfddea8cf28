"""What ``scene_synth run`` says of the bag that it has recorded."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable
from pathlib import Path

from scene_synth_ros.bags.bag_inspect import InspectReport, inspect_bag, render_report
from scene_synth_ros.bags.bag_reader import BagReadError
from scene_synth_ros.cli.commands.run_command import truth_folder
from scene_synth_ros.cli.processes.supervisor import Outcome


def conclude(arguments: argparse.Namespace, outcome: Outcome, seconds: float, catalog_dir: Path | None) -> int:
    """Check the bag, print the summary, draw and show what is asked for; return the exit status.

    Args:
        arguments: of ``scene_synth run``.
        outcome: how the nodes ended.
        seconds: how long they ran.
        catalog_dir: folder of the user's models, where the run had one.
    """
    if not arguments.record.exists():
        return outcome.code or 1
    try:
        report = inspect_bag(arguments.record)
    except BagReadError as error:
        _say(f"run: {error}")
        return outcome.code or 1
    _say(_summary(report, arguments, seconds))
    for name, make in _MADE.items():
        if getattr(arguments, name) and not outcome.code:
            _say(make(arguments, catalog_dir))
    return outcome.code or (1 if report.faults else 0)


def _contact_sheet(arguments: argparse.Namespace, _catalog_dir: Path | None) -> str:
    from scene_synth_ros.cli.pictures.contact_sheet import write_contact_sheet

    rooms = write_contact_sheet(arguments.record, arguments.contact_sheet)
    return f"contact sheet: {arguments.contact_sheet} ({rooms} rooms)"


def _page(arguments: argparse.Namespace, _catalog_dir: Path | None) -> str:
    from scene_synth_ros.cli.commands.show_command import describe, show_bag

    return describe(show_bag(arguments.record, arguments.show), arguments.show).rstrip()


def _truth(arguments: argparse.Namespace, catalog_dir: Path | None) -> str:
    from scene_synth_ros.cli.commands.truth_command import write_bag_truth

    return f"truth: {write_bag_truth(arguments.record, truth_folder(arguments.record), catalog_dir)}"


_MADE: dict[str, Callable[[argparse.Namespace, Path | None], str]] = {"contact_sheet": _contact_sheet, "show": _page, "truth": _truth}
"""Option -> what makes the file that it asks for, and says so; each loads its modules itself: they take longer than a short run's check."""


def _summary(report: InspectReport, arguments: argparse.Namespace, seconds: float) -> str:
    return f"{render_report(report)}\nrun took {seconds:.1f} s; bag: {arguments.record}"


def _say(text: str) -> None:
    sys.stdout.write(text + "\n")
    sys.stdout.flush()
