"""``scene_synth inspect``: what a bag, or a dataset of bags, holds and what is wrong with it."""

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path

from scene_description import error_line
from scene_synth_ros.bags.bag_inspect import InspectReport, inspect_bag
from scene_synth_ros.bags.bag_reader import BagReadError
from scene_synth_ros.cli.lines import aligned, counted, first_of, printable, say_progress
from scene_synth_ros.cli.options import add_bag_or_dataset
from scene_synth_ros.dataset.places import shard_bags
from scene_synth_ros.messages.stamps import NANOSECONDS
from scene_synth_ros.workers.pool import Do, in_order, terminable


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the command's options."""
    add_bag_or_dataset(parser)


def run(arguments: argparse.Namespace) -> int:
    """Print the report; return 1 if the bag, or a shard, has a fault, or lacks what its run promised."""
    notes: list[str] = []
    shards = shard_bags(arguments.bag, notes.append)
    if shards:
        return _inspect_shards(arguments.bag, shards, notes, arguments.workers)
    report = inspect_bag(arguments.bag)
    sys.stdout.write(render_report(report))
    return 1 if report.faults or report.lacking else 0


def render_report(report: InspectReport) -> str:
    """Return the report as text for a terminal."""
    duration_s = (report.end_ns - report.start_ns) / NANOSECONDS if report.start_ns is not None and report.end_ns is not None else 0.0
    told = f"{counted(report.files, 'file')}, {report.size / 1e6:.1f} MB, {report.message_count} messages, {report.rooms} rooms"
    rows = [("topic", "type", "messages", "Hz", "gaps", "MB")]
    for topic in sorted(report.topics, key=lambda topic: topic.name):
        rate = f"{topic.rate_hz:.3g}" if topic.period_ns else "-"
        rows.append((topic.name, topic.type_name, str(topic.count), rate, str(topic.gaps), f"{topic.size / 1e6:.2f}"))
    faults = [f"fault: {fault}" for fault in report.faults] or ["no faults" + ", but not all that was promised" * bool(report.lacking)]
    return printable(
        [
            f"{report.path}: {told}, {duration_s:.3f} s",
            *(f"  {key}: {value}" for key, value in sorted(report.custom_data.items())),
            *(f"  {row}" for row in aligned(rows, left=2)),
            *(f"note: {note}" for note in report.notes),
            *(f"lacking: {line}" for line in report.lacking),
            *faults,
        ]
    )


def _inspect_shards(dataset: Path, shards: Sequence[Path], notes: Sequence[str], workers: int) -> int:
    """Print what is wrong with each shard, and what there is of each topic in all."""
    lines, faulty, messages, size, rooms = [f"note: {note}" for note in notes], 0, 0, 0, 0
    topics: dict[tuple[str, str], list[int]] = {}
    with terminable():
        for number, found in enumerate(in_order(prepare_inspections, None, shards, workers), 1):
            say_progress(f"shard {number} of {len(shards)}")
            if isinstance(found, str):
                lines.append(f"fault: {found}")
                faulty += 1
                continue
            faulty += bool(found.faults or found.lacking)
            lines += first_of(f"fault: {found.path}", found.faults) + first_of(f"lacking: {found.path}", found.lacking)
            messages, size, rooms = messages + found.message_count, size + found.size, rooms + found.rooms
            for topic in found.topics:
                row = topics.setdefault((topic.name, topic.type_name), [0, 0])
                row[:] = row[0] + topic.count, row[1] + topic.size
    say_progress("")
    told = f"{counted(len(shards), 'shard')}, {size / 1e6:.1f} MB, {counted(messages, 'message')}, {counted(rooms, 'room')}"
    rows = [f"  {name}  {kind}  {count} messages  {size / 1e6:.2f} MB" for (name, kind), (count, size) in sorted(topics.items())]
    end = f"{faulty} of {counted(len(shards), 'shard')} with faults" if faulty else "no faults"
    sys.stdout.write(printable([f"{dataset}: {told}", *rows, *lines, end]))
    return 1 if faulty else 0


def prepare_inspections(_setup: None) -> Do:
    """Return what inspects a bag, in a worker process too: its report, or a line on one that cannot be read."""

    def inspect(path: Path, _tell: object) -> InspectReport | str:
        try:
            return inspect_bag(path)
        except (BagReadError, OSError) as error:
            return error_line(error)

    return inspect
