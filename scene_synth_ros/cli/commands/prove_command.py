"""``scene_synth prove``: checks that what a bag says is true, by code that shares none with what made it."""

import argparse
import sys
from pathlib import Path

from scene_synth_ros.cli.lines import printable, say_progress
from scene_synth_ros.cli.options import add_catalog, refuse_missing_folder
from scene_synth_ros.dataset.places import shard_bags
from scene_synth_ros.prove.prove import lines_of, proof_to_json, prove_bag


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the command's options."""
    parser.add_argument("bag", type=Path, help="folder of the bag, its .mcap file, or folder of a dataset: all its shards")
    add_catalog(parser, ", if the run had one")
    parser.add_argument("--json", action="store_true", help="print every measure with its limit as JSON, a line for each shard")


def run(arguments: argparse.Namespace) -> int:
    """Prove; return 0 if all that can be checked is true, 1 if not."""
    refuse_missing_folder("--catalog", arguments.catalog)
    notes: list[str] = []
    bags = shard_bags(arguments.bag, notes.append) or [arguments.bag]
    sys.stderr.write(printable(f"note: {note}" for note in notes))
    return max(_prove(bag, arguments) for bag in bags)


def _prove(bag: Path, arguments: argparse.Namespace) -> int:
    proof = prove_bag(bag, arguments.catalog, say_progress)
    say_progress("")
    end = "all that was checked is true" if proof.good else f"{len(proof.faults) + len(proof.notes)} faults"
    sys.stdout.write(proof_to_json(proof) + "\n" if arguments.json else printable([*lines_of(proof), f"{bag}: {end}"]))
    return 0 if proof.good else 1
