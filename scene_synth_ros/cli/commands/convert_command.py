"""``scene_synth convert``: the frames of a bag, a shard folder or a dataset in the form that other programs read."""

import argparse
import re
import sys
from pathlib import Path

from tqdm import tqdm

from scene_synth_ros.cli.lines import counted
from scene_synth_ros.cli.options import (
    UsageError,
    add_catalog,
    add_number,
    add_readers,
    add_source,
    names_in,
    new_folder,
    refuse_missing_folder,
)
from scene_synth_ros.convert.formats import FORMATS, writer_of
from scene_synth_ros.convert.source import Choice, open_source
from scene_synth_ros.convert.writer import convert


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the command's options."""
    add_source(parser)
    forms = "; ".join(f"{name}: {form.summary}" for name, form in FORMATS.items())
    parser.add_argument("--to", required=True, choices=FORMATS, metavar="FORMAT", help=forms)
    parser.add_argument("--out", type=Path, required=True, metavar="DIR", help="new folder; it appears when all of it is written")
    parser.add_argument("--layers", default="", metavar="NAMES", help="take these layers, names with commas between, in place of the usual")
    parser.add_argument("--rooms", metavar="A:B", help="rooms from index A to before B; either may be left out")
    parser.add_argument("--split", metavar="NAME", help="frames of this split of the dataset (scene_synth split)")
    add_number(parser, "--every", 1, default=1, metavar="N", help="the first frame of each room and every N-th after it")
    parser.add_argument("--camera", metavar="NAME", help="frames of this camera only")
    add_catalog(parser, ", for formats with meshes")
    add_readers(parser, "decode and encode frames")


def run(arguments: argparse.Namespace) -> int:
    """Convert; return 0."""
    refuse_missing_folder("--catalog", arguments.catalog)
    if re.match(r"\w+:/", str(arguments.out)):
        raise UsageError(f"--out {arguments.out}: expected a folder on this machine, got a URL; convert into a folder and copy that")
    name, form = arguments.to, FORMATS[arguments.to]
    choice = Choice(
        layers=names_in(arguments.layers),
        rooms=read_range(arguments.rooms),
        every=arguments.every,
        camera=arguments.camera or "",
        split=arguments.split,
        catalog=arguments.catalog,
    )
    with new_folder(arguments.out) as folder:
        source = open_source(arguments.source, name, form, choice)
        with tqdm(total=source.frames, unit=" frames", disable=None, leave=False) as line:
            notes = convert(folder, source, writer_of(name), threads=arguments.threads, progress=lambda done: line.update())
        size = sum(file.stat().st_size for file in folder.rglob("*") if file.is_file())
    rooms = len({sequence.folder for sequence in source.sequences})
    for note in notes:
        sys.stderr.write(f"scene_synth convert: {note}\n")
    sys.stdout.write(f"{arguments.out}: {name}, {counted(rooms, 'room')}, {counted(source.frames, 'frame')}, {size / 1e6:.1f} MB\n")
    return 0


def read_range(text: str | None) -> tuple[int, int] | None:
    """Return the rooms that ``A:B`` names, None for all.

    Raises:
        UsageError: it has another form, or names none.
    """
    if text is None:
        return None
    found = re.fullmatch(r"(\d*):(\d*)", text)
    first, end = (int(found[1] or 0), int(found[2] or 2**62)) if found else (0, 0)
    if first >= end:
        raise UsageError(f"--rooms: expected A:B with A below B, as 0:100, got '{text[:40]}'")
    return first, end
