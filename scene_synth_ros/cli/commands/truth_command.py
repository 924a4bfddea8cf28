"""``scene_synth truth``: what is true of a room, or of each room of a bag, as files for other programs."""

import argparse
import sys
from collections.abc import Mapping
from pathlib import Path

from grammar.spec.categories import read_categories
from grammar.spec.grammar_file import read_grammar, read_room_type, room_types
from grammar.synthesize import FloorMap, floor_map
from scene_description import SceneDescription, read_scene
from scene_description.share import config_path
from scene_synth_ros.cli.files.bag_rooms import read_rooms, room_names
from scene_synth_ros.cli.files.truth_files import truth_files
from scene_synth_ros.cli.lines import counted, say_progress
from scene_synth_ros.cli.options import UsageError, add_catalog, new_folder, refuse_missing_folder


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the command's options."""
    parser.add_argument("source", type=Path, metavar="SCENE.json|BAG", help="scene description, or a bag: its folder, or an .mcap file")
    parser.add_argument("--out", type=Path, required=True, metavar="DIR", help="new folder; of a bag it gets a folder for each room")
    add_catalog(parser)
    parser.add_argument("--grammar", type=Path, metavar="FILE", help="grammar of the room, for the map, where its type is none of ours")


def run(arguments: argparse.Namespace) -> int:
    """Write the files; return 0."""
    refuse_missing_folder("--catalog", arguments.catalog)
    source: Path = arguments.source
    write = write_scene_truth if source.suffix.lower() == ".json" else write_bag_truth
    sys.stdout.write(f"{write(source, arguments.out, arguments.catalog, arguments.grammar)}\n")
    return 0


def write_scene_truth(scene_file: Path, out: Path, catalog_dir: Path | None = None, grammar_file: Path | None = None) -> str:
    """Write the files of a scene description into a new folder, whole or not at all; return the line that says what was written.

    Raises:
        UsageError: the folder exists, or the room's type is none of ours.
        SceneSynthError: the scene cannot be used.
        OSError: a file cannot be read or written.
    """
    with new_folder(out) as folder:
        scene = read_scene(scene_file)
        files = truth_files(scene, catalog_dir, scene_floor(scene, grammar_file), {})
        size = _write(folder, files)
    return f"{out}: {len(files)} files, {size / 1e6:.1f} MB"


def write_bag_truth(bag: Path, out: Path, catalog_dir: Path | None = None, grammar_file: Path | None = None) -> str:
    """Do so for each room of a bag, in a folder of its own.

    Raises:
        BagReadError: the bag cannot be read at all.
        UsageError: the folder exists, the bag has no room, or a room has no map in it and a type that is none of ours.
        SceneSynthError: a room cannot be used.
        OSError: a file cannot be written.
    """
    count = size = 0
    with new_folder(out) as folder:
        rooms = read_rooms(bag)
        for number, (name, scene, room) in enumerate(room_names(rooms), 1):
            floor = room.floor or scene_floor(scene, grammar_file)
            files = truth_files(scene, catalog_dir, floor, room.trajectories())
            (folder / name).mkdir()
            size += _write(folder / name, files)
            count += len(files)
            say_progress(f"truth of room {number} of {len(rooms)}")
    say_progress("")
    return f"{out}: {counted(len(rooms), 'room')}, {count} files, {size / 1e6:.1f} MB"


def scene_floor(scene: SceneDescription, grammar_file: Path | None) -> FloorMap:
    """Return the free floor of a room by the thresholds of its type's grammar.

    Raises:
        UsageError: no grammar file is given, and the type is none of ours.
        GrammarError: the grammar cannot be used.
    """
    categories = read_categories(config_path("categories.yaml"))
    if grammar_file is None and scene.category not in room_types():
        raise UsageError(f"{scene.id}: expected a room type of ours for the map, got '{scene.category}'; name its grammar: --grammar FILE")
    grammar = read_room_type(scene.category, categories) if grammar_file is None else read_grammar(grammar_file, categories)
    return floor_map(scene, categories, grammar.validity)


def _write(folder: Path, files: Mapping[str, bytes]) -> int:
    """Write files; return how many bytes they have."""
    for name, data in files.items():
        (folder / name).write_bytes(data)
    return sum(map(len, files.values()))
