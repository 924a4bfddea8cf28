"""``scene_synth verify``: renders a bag, or the shards of a dataset, again and compares."""

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path

from scene_description import error_line
from scene_synth_ros.bags.bag_reader import BagReadError
from scene_synth_ros.cli.lines import counted, first_of, printable, say_progress
from scene_synth_ros.cli.options import add_bag_or_dataset, add_catalog, refuse_missing_folder
from scene_synth_ros.dataset.places import shard_bags
from scene_synth_ros.messages.stamps import NANOSECONDS
from scene_synth_ros.verify.bag_verify import VerifyError, VerifyReport, verify_bag
from scene_synth_ros.workers.pool import Do, in_order, terminable


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the command's options."""
    add_bag_or_dataset(parser)
    add_catalog(parser, ", if the run had one")


def run(arguments: argparse.Namespace) -> int:
    """Verify; return 0 if everything is the same, 1 if not."""
    refuse_missing_folder("--catalog", arguments.catalog)
    notes: list[str] = []
    shards = shard_bags(arguments.bag, notes.append)
    if shards:
        return _verify_shards(shards, notes, arguments)
    report = verify_bag(arguments.bag, arguments.catalog, lambda done, total: say_progress(f"frame {done}/{total}"))
    say_progress("")
    sys.stdout.write(printable(_lines(arguments.bag, report)))
    return 0 if report.good else 1


def _verify_shards(shards: Sequence[Path], notes: Sequence[str], arguments: argparse.Namespace) -> int:
    """Print a line of each shard as it is compared, and how many are good."""
    sys.stdout.write(printable(f"note: {note}" for note in notes))
    bad = 0
    with terminable():
        for shard, found in zip(shards, in_order(prepare_verifications, arguments.catalog, shards, arguments.workers), strict=True):
            bad += isinstance(found, str) or not found.good
            sys.stdout.write(printable([f"fault: {found}"] if isinstance(found, str) else _lines(shard, found)))
            sys.stdout.flush()
    sys.stdout.write(printable([f"{arguments.bag}: {len(shards) - bad} of {counted(len(shards), 'shard')} are the same"]))
    return 1 if bad else 0


def prepare_verifications(catalog: Path | None) -> Do:
    """Return what verifies a bag, in a worker process too: its report, or a line on one that cannot be compared."""

    def verify(path: Path, _tell: object) -> VerifyReport | str:
        try:
            return verify_bag(path, catalog)
        except (BagReadError, VerifyError, OSError) as error:
            return error_line(error)

    return verify


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
