"""``scene_synth run``: the node suite as separate processes, and what is said of the bag afterwards."""

import argparse
import sys
import time
from collections.abc import Callable, Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any

from scene_synth_ros.cli.lines import say
from scene_synth_ros.cli.parameters.run_parameters import add_run_options, run_parameters, run_words
from scene_synth_ros.cli.parameters.run_profile import (
    NAMESPACE,
    NodeParameters,
    ProfileError,
    check_namespace,
    write_node_file,
)
from scene_synth_ros.cli.processes.supervisor import (
    NODES,
    ONE_PROCESS,
    ONE_PROCESS_MODULE,
    PROGRESS_MODULE,
    Interrupts,
    NodeProcess,
    Outcome,
    companion,
    run_nodes,
)
from scene_synth_ros.synthesize.run_config import RunConfig
from scene_synth_ros.workers.temporary_folder import temporary_folder


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the command's options."""
    rooms = "number of rooms (grammar_node.rooms); the run ends with the last one"
    add_run_options(parser, rooms, profile="main, or live without --record", least_rooms=0)
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
        help="of the nodes (default: info; warn beside the line of progress, which a terminal gets where the number of rooms is known)",
    )
    parser.add_argument("--no-progress", action="store_true", help="no line of progress on a terminal")


def run(arguments: argparse.Namespace) -> int:
    """Run the suite; return the exit status."""
    parameters = run_parameters(run_words(arguments, arguments.record))
    made = _check_outputs(arguments)
    began = time.monotonic()
    progress = _progress(arguments, parameters["grammar_node"])
    arguments.log_level = arguments.log_level or ("warn" if progress else "info")
    with temporary_folder() as folder, Interrupts() as interrupts, companion(progress):
        nodes = _processes(arguments, parameters, folder)
        outcome = run_nodes(nodes, arguments.namespace, interrupts, arguments.log_level)
    seconds = time.monotonic() - began
    if outcome.code:
        unmade = bool(arguments.record) and not arguments.record.exists()
        say(f"run: {outcome.reason}" + (f"; nothing was recorded, {arguments.record} is not there" if unmade else ""))
        for new_folder in made if unmade else ():
            with suppress(OSError):  # somebody else has put something there
                new_folder.rmdir()
    if not arguments.record:
        return outcome.code
    catalog = parameters["renderer_node"].get("catalog_dir", "")
    return _conclude(arguments, outcome, seconds, Path(catalog) if catalog else None)


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
    uses = {"contact_sheet": "that it is drawn from", "show": "that is shown", "truth": "that it is read from"}
    for name, use in uses.items():
        option, given = f"--{name.replace('_', '-')}", getattr(arguments, name)
        if given and not arguments.record:
            raise ProfileError(f"{option}: expected together with --record, which makes the bag {use}")
        if isinstance(given, Path) and not given.parent.is_dir():
            raise ProfileError(f"{option} {given}: the folder does not exist")
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


def _conclude(arguments: argparse.Namespace, outcome: Outcome, seconds: float, catalog_dir: Path | None) -> int:
    """Check the bag after a run of so many seconds, print the summary, draw and show what is asked for; return the exit status."""
    from scene_synth_ros.bags.bag_inspect import inspect_bag  # after the nodes have ended: it takes as long to load as a node
    from scene_synth_ros.bags.bag_reader import BagReadError
    from scene_synth_ros.cli.commands.inspect_command import render_report

    if not arguments.record.exists():
        return outcome.code or 1
    try:
        report = inspect_bag(arguments.record)
    except BagReadError as error:
        say(f"run: {error}")
        return outcome.code or 1
    say(f"{render_report(report)}run took {seconds:.1f} s; bag: {arguments.record}")
    for name, make in _MADE.items():
        if getattr(arguments, name) and not outcome.code:
            say(make(arguments, catalog_dir))
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
