"""``scene_synth run``: the node suite as separate processes, and what is said of the bag afterwards."""

from __future__ import annotations

import argparse
import sys
import tempfile
import time
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import fields
from pathlib import Path
from typing import Any

from scene_synth_ros.cli.node_modules import NODES, ONE_PROCESS_MODULE, PROGRESS_MODULE
from scene_synth_ros.cli.parameters.run_parameters import RunWords, add_parameter_options, run_parameters
from scene_synth_ros.cli.parameters.run_profile import (
    NAMESPACE,
    NodeParameters,
    ProfileError,
    check_namespace,
    write_node_file,
)
from scene_synth_ros.cli.processes.supervisor import ONE_PROCESS, Interrupts, NodeProcess, companion, run_nodes
from scene_synth_ros.synthesize.run_config import RunConfig


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the command's options."""
    parser.add_argument(
        "--params",
        type=Path,
        help="run profile: a ROS parameter file, or a shipped one by its name (default: main, or live without --record)",
    )
    add_parameter_options(parser)
    parser.add_argument("--rooms", type=int, help="number of rooms (grammar_node.rooms); the run ends with the last one")
    parser.add_argument("--frames", type=int, help="frames of each room (grammar_node.frames_per_room)")
    parser.add_argument("--seed", type=int, help="seed of the run (grammar_node.seed)")
    parser.add_argument(
        "--grammar", type=Path, metavar="FILE", help="grammar file of the rooms (grammar_node.grammar_file, scene.room_type)"
    )
    parser.add_argument("--renderers", type=int, default=1, metavar="N", help="renderers that share the rooms by index (default: 1)")
    parser.add_argument("--respawn", type=int, default=0, metavar="N", help="start a renderer that a signal has killed again, N times")
    parser.add_argument("--one-process", action="store_true", help="all nodes in one process")
    parser.add_argument("--record", type=Path, metavar="DIR", help="record a bag into this new folder")
    parser.add_argument("--contact-sheet", type=Path, metavar="FILE", help="draw some frames of each room of the bag, as PNG or JPEG")
    parser.add_argument("--show", type=Path, metavar="FILE", help="write the bag as one page for a browser (scene_synth show)")
    parser.add_argument("--truth", action="store_true", help="write what is true of each room into DIR_truth (scene_synth truth)")
    parser.add_argument("--namespace", default=NAMESPACE, help="namespace of nodes and topics (default: %(default)s)")
    parser.add_argument(
        "--log-level",
        choices=["debug", "info", "warn", "error"],
        help="(default: info; warn beside the line of progress, which a terminal gets where the number of rooms is known)",
    )
    parser.add_argument("--no-progress", action="store_true", help="no line of progress on a terminal")


def run(arguments: argparse.Namespace) -> int:
    """Run the suite; return the exit status."""
    parameters = _parameters(arguments)
    made = _check_outputs(arguments)
    began = time.monotonic()
    progress = _progress(arguments, parameters["grammar_node"])
    arguments.log_level = arguments.log_level or ("warn" if progress else "info")
    with tempfile.TemporaryDirectory(prefix="scene_synth_") as folder, Interrupts() as interrupts, companion(progress):
        nodes = _processes(arguments, parameters, Path(folder))
        outcome = run_nodes(nodes, arguments.namespace, interrupts, arguments.log_level)
    seconds = time.monotonic() - began
    if outcome.code:
        unmade = bool(arguments.record) and not arguments.record.exists()
        _say(f"run: {outcome.reason}" + (f"; nothing was recorded, {arguments.record} is not there" if unmade else ""))
        for folder in made if unmade else ():
            with suppress(OSError):  # somebody else has put something there
                folder.rmdir()
    if not arguments.record:
        return outcome.code
    from scene_synth_ros.cli.run_results import conclude  # after the nodes have ended: its modules take as long to load as a node

    catalog = parameters["renderer_node"].get("catalog_dir", "")
    return conclude(arguments, outcome, seconds, Path(catalog) if catalog else None)


def _parameters(arguments: argparse.Namespace) -> NodeParameters:
    return run_parameters(RunWords(**{field.name: getattr(arguments, field.name) for field in fields(RunWords)}))


def _progress(arguments: argparse.Namespace, grammar: Mapping[str, Any]) -> list[str]:
    """Return the command that draws the line of progress; nothing where no terminal or no number of rooms would make sense of it."""
    rooms, frames = (grammar.get(name, getattr(RunConfig(), name)) for name in ("rooms", "frames_per_room"))
    if arguments.no_progress or not sys.stderr.isatty() or not (isinstance(rooms, int) and isinstance(frames, int) and rooms > 0):
        return []
    words = ["--rooms", str(rooms), "--frames", str(frames), "--namespace", arguments.namespace]
    return [sys.executable, "-m", PROGRESS_MODULE, *words]


def _processes(arguments: argparse.Namespace, parameters: NodeParameters, folder: Path) -> list[NodeProcess]:
    """Write the parameter files of the nodes and return the processes to run."""
    renderers = [name for name in parameters if name.startswith("renderer_node")]
    names = [*(["recorder_node"] if arguments.record else []), *renderers, "grammar_node"]
    for name in names:
        write_node_file(folder / f"{name}.yaml", parameters[name])
    if arguments.one_process:
        words = ("--namespace", arguments.namespace, "--log-level", arguments.log_level)
        files = (f"{name}={folder / name}.yaml" for name in names)
        return [NodeProcess(name=ONE_PROCESS, module=ONE_PROCESS_MODULE, parameters=folder, words=(*words, *files))]
    return [
        NodeProcess(
            name=name,
            parameters=folder / f"{name}.yaml",
            module=NODES["renderer_node" if name in renderers else name].module,
            respawns=arguments.respawn if name in renderers else 0,
        )
        for name in names
    ]


def _check_outputs(arguments: argparse.Namespace) -> list[Path]:
    """Refuse outputs that cannot be made; make the folders above the bag, and return them, the innermost first."""
    if arguments.record and arguments.record.exists():
        raise ProfileError(f"--record {arguments.record}: exists already; choose another folder or remove it")
    if arguments.contact_sheet and not arguments.record:
        raise ProfileError("--contact-sheet: expected together with --record, which makes the bag that it is drawn from")
    if arguments.contact_sheet and not arguments.contact_sheet.parent.is_dir():
        raise ProfileError(f"--contact-sheet {arguments.contact_sheet}: the folder does not exist")
    if arguments.show and not arguments.record:
        raise ProfileError("--show: expected together with --record, which makes the bag that is shown")
    if arguments.show and not arguments.show.parent.is_dir():
        raise ProfileError(f"--show {arguments.show}: the folder does not exist")
    if arguments.truth and not arguments.record:
        raise ProfileError("--truth: expected together with --record, which makes the bag that it is read from")
    if arguments.truth and truth_folder(arguments.record).exists():
        raise ProfileError(f"--truth: {truth_folder(arguments.record)} exists already; record into another folder or remove it")
    check_namespace(arguments.namespace)
    if not arguments.record:
        return []
    missing = [folder for folder in arguments.record.parents if not folder.exists()]
    try:
        arguments.record.parent.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise ProfileError(f"--record {arguments.record}: its folder cannot be made ({error.strerror})") from None
    return missing


def truth_folder(bag: Path) -> Path:
    """Return the folder beside a bag that ``--truth`` writes."""
    return bag.with_name(f"{bag.name}_truth")


def _say(text: str) -> None:
    sys.stdout.write(text + "\n")
    sys.stdout.flush()
