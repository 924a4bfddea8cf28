"""``scene_synth run``: the node suite as separate processes, and what is said of the bag afterwards."""

from __future__ import annotations

import argparse
import json
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

from grammar import read_categories, read_grammar
from scene_description.share import config_path
from scene_synth_ros.bag_inspect import InspectReport, inspect_bag, render_report
from scene_synth_ros.bag_reader import BagReadError
from scene_synth_ros.contact_sheet import write_contact_sheet
from scene_synth_ros.run_profile import NodeParameters, ProfileError, apply_overrides, load_profile, write_node_file
from scene_synth_ros.supervisor import Interrupts, NodeProcess, Outcome, run_nodes


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the command's options."""
    parser.add_argument(
        "--params", type=Path, help="run profile, a ROS parameter file (default: config/runs/main.yaml, or live.yaml without --record)"
    )
    parser.add_argument(
        "--overlay",
        type=Path,
        action="append",
        default=[],
        metavar="FILE",
        help="parameter file laid over the profile, for example config/cameras/kinect_v1.yaml; may be repeated, later ones win",
    )
    parser.add_argument(
        "-p", dest="overrides", action="append", default=[], metavar="NODE.NAME:=VALUE", help="one parameter; may be repeated"
    )
    parser.add_argument("--rooms", type=int, help="number of rooms (grammar_node.rooms)")
    parser.add_argument("--frames", type=int, help="frames of each room (grammar_node.frames_per_room)")
    parser.add_argument("--seed", type=int, help="seed of the run (grammar_node.seed)")
    parser.add_argument(
        "--grammar", type=Path, metavar="FILE", help="grammar file of the rooms (grammar_node.grammar_file, scene.room_type)"
    )
    parser.add_argument("--record", type=Path, metavar="DIR", help="record a bag into this new folder")
    parser.add_argument("--contact-sheet", type=Path, metavar="FILE", help="draw some frames of each room of the bag, as PNG or JPEG")
    parser.add_argument("--namespace", default="/synth", help="namespace of nodes and topics (default: %(default)s)")
    parser.add_argument("--log-level", default="info", choices=["debug", "info", "warn", "error"], help="(default: %(default)s)")


def run(arguments: argparse.Namespace) -> int:
    """Run the suite; return the exit status."""
    parameters = _parameters(arguments)
    _check_outputs(arguments)
    began = time.monotonic()
    with tempfile.TemporaryDirectory(prefix="scene_synth_") as folder, Interrupts() as interrupts:
        nodes = [NodeProcess(name=name, parameters=Path(folder) / f"{name}.yaml") for name in _node_names(arguments)]
        for node in nodes:
            write_node_file(node.parameters, parameters[node.name])
        outcome = run_nodes(nodes, arguments.namespace, interrupts, arguments.log_level)
    seconds = time.monotonic() - began
    if outcome.code:
        _say(f"run: {outcome.reason}")
    return _conclude(arguments, outcome, seconds) if arguments.record else outcome.code


def _node_names(arguments: argparse.Namespace) -> list[str]:
    return (["recorder_node"] if arguments.record else []) + ["renderer_node", "grammar_node"]


def _parameters(arguments: argparse.Namespace) -> NodeParameters:
    profile = arguments.params or config_path("runs/main.yaml" if arguments.record else "runs/live.yaml")
    parameters = load_profile(profile)
    for overlay in arguments.overlay:
        for node, values in load_profile(overlay).items():
            parameters[node].update(values)
    grammar = parameters["grammar_node"]
    for option, name in (("rooms", "rooms"), ("frames", "frames_per_room"), ("seed", "seed")):
        if getattr(arguments, option) is not None:
            grammar[name] = getattr(arguments, option)
    if arguments.grammar is not None:
        own = read_grammar(arguments.grammar, read_categories(config_path("categories.yaml")))
        grammar |= {"grammar_file": str(arguments.grammar.resolve()), "scene.room_type": own.room_type}
    parameters = apply_overrides(parameters, arguments.overrides)
    finite = bool(parameters["grammar_node"].get("rooms", 0))
    for node in parameters.values():
        node.setdefault("exit_when_done", finite)
    if arguments.record:
        parameters["grammar_node"].setdefault("expected_recorders", 1)
        parameters["renderer_node"].setdefault("expected_recorders", 1)
        parameters["recorder_node"]["bag"] = str(arguments.record)
        parameters["recorder_node"].setdefault("custom_data", _notes(parameters))
    return parameters


def _notes(parameters: NodeParameters) -> list[str]:
    """Return what is kept with the bag: the parameters that made it."""
    made_by: dict[str, Any] = {node: values for node, values in parameters.items() if node != "recorder_node"}
    return [f"scene_synth.parameters={json.dumps(made_by, sort_keys=True)}"]


def _check_outputs(arguments: argparse.Namespace) -> None:
    if arguments.record and arguments.record.exists():
        raise ProfileError(f"--record {arguments.record}: exists already; choose another folder or remove it")
    if arguments.contact_sheet and not arguments.record:
        raise ProfileError("--contact-sheet: expected together with --record, which makes the bag that it is drawn from")
    if arguments.contact_sheet and not arguments.contact_sheet.parent.is_dir():
        raise ProfileError(f"--contact-sheet {arguments.contact_sheet}: the folder does not exist")
    if not arguments.namespace.startswith("/"):
        raise ProfileError(f"--namespace {arguments.namespace}: expected a name that begins with /")
    if arguments.record:
        try:
            arguments.record.parent.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise ProfileError(f"--record {arguments.record}: its folder cannot be made ({error.strerror})") from None


def _conclude(arguments: argparse.Namespace, outcome: Outcome, seconds: float) -> int:
    """Check the bag, print the summary, draw the contact sheet; return the exit status."""
    if not arguments.record.exists():
        return outcome.code or 1
    try:
        report = inspect_bag(arguments.record)
    except BagReadError as error:
        _say(f"run: {error}")
        return outcome.code or 1
    _say(_summary(report, arguments, seconds))
    if arguments.contact_sheet and not outcome.code:
        rooms = write_contact_sheet(arguments.record, arguments.contact_sheet)
        _say(f"contact sheet: {arguments.contact_sheet} ({rooms} rooms)")
    return outcome.code or (1 if report.faults else 0)


def _summary(report: InspectReport, arguments: argparse.Namespace, seconds: float) -> str:
    return f"{render_report(report)}\nrun took {seconds:.1f} s; bag: {arguments.record}"


def _say(text: str) -> None:
    sys.stdout.write(text + "\n")
    sys.stdout.flush()
