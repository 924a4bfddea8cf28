"""``scene_synth prove``: checks that what a bag says is true, by code that shares none with what made it."""

import argparse
import sys

from scene_synth_ros.cli.lines import printable, say_progress
from scene_synth_ros.cli.options import add_bag, add_catalog, refuse_missing_folder
from scene_synth_ros.prove.prove import lines_of, proof_to_json, prove_bag


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the command's options."""
    add_bag(parser)
    add_catalog(parser, ", if the run had one")
    parser.add_argument("--json", action="store_true", help="print every measure with its limit as JSON")


def run(arguments: argparse.Namespace) -> int:
    """Prove; return 0 if all that can be checked is true, 1 if not."""
    refuse_missing_folder("--catalog", arguments.catalog)
    proof = prove_bag(arguments.bag, arguments.catalog, say_progress)
    say_progress("")
    if arguments.json:
        sys.stdout.write(proof_to_json(proof) + "\n")
        return 0 if proof.good else 1
    end = "all that was checked is true" if proof.good else f"{len(proof.faults) + len(proof.notes)} faults"
    sys.stdout.write(printable([*lines_of(proof), f"{arguments.bag}: {end}"]))
    return 0 if proof.good else 1
