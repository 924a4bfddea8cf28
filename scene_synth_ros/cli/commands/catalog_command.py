"""``scene_synth catalog check DIR``: what is wrong with the models of a user's catalogue, file by file."""

import argparse
import sys
from pathlib import Path

from grammar.catalog import FILE_NAME, read_catalog
from grammar.synthesize import SceneSynthesizer
from scene_synth_ros.synthesize.catalogs import check_catalog


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the command's options."""
    parser.add_argument("action", choices=["check"], help="check: list what is wrong with which file")
    parser.add_argument("folder", type=Path, metavar="DIR", help=f"folder with {FILE_NAME}")
    parser.add_argument("--strict", action="store_true", help="warnings count as errors")


def run(arguments: argparse.Namespace) -> int:
    """Check; status 1 if a model cannot be used."""
    listed = read_catalog(arguments.folder)
    findings = check_catalog(SceneSynthesizer.from_config(), arguments.folder)
    for file in dict.fromkeys(["catalog.yaml", *(entry.file for entry in listed.models)]):
        mine = [item for item in findings if item.file == file]
        if not mine and file != "catalog.yaml":
            sys.stdout.write(f"{file}: fine\n")
        for item in mine:
            sys.stdout.write(f"{file}: {'error' if item.error else 'warning'}: {item.text}\n")
    errors = sum(item.error for item in findings)
    sys.stdout.write(f"{len(listed.models)} models, {errors} errors, {len(findings) - errors} warnings\n")
    return int(errors > 0 or (arguments.strict and len(findings) > 0))
