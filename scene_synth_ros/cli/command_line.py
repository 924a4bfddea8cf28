"""The command ``scene_synth``: one row of a table a subcommand."""

import argparse
import importlib
import signal
import sys
from collections.abc import Sequence
from typing import NamedTuple


class Command(NamedTuple):
    """A subcommand: its help line, and the module that has ``add_arguments(parser)`` and ``run(arguments) -> exit status``."""

    help: str
    module: str


COMMANDS = {
    "demo": Command("record a few rooms and open what was recorded in a browser", "demo_command"),
    "run": Command("run the node suite: grammar, renderer and, with --record, recorder", "run_command"),
    "generate": Command("make a dataset of rooms in shards, with all processors, without DDS", "generate_command"),
    "inspect": Command("print what a bag, or a dataset, holds and every fault of it", "inspect_command"),
    "verify": Command("render the frames of a bag, or of a dataset, again and compare every message", "verify_command"),
    "prove": Command("check that a bag is true, by code that shares none with what made it", "prove_command"),
    "repair": Command("make a whole bag of what is left of a cut or damaged one", "repair_command"),
    "evaluate": Command("judge estimates by the truth of a bag, a dataset or a sweep", "evaluate_command"),
    "show": Command("write a bag as one page for a browser", "show_command"),
    "report": Command("write evaluations as one page for a browser: factors, curves, worst frames", "report_command"),
    "replay": Command("publish a bag again", "replay_command"),
    "sample": Command("sample rooms and write their scene descriptions and top views", "sample_command"),
    "sweep": Command("make variants of rooms that differ in what a file says, a bag for each", "sweep_command"),
    "estimate": Command("measure a few rooms and say what time, processors and space a dataset will take", "estimate_command"),
    "split": Command("choose the rooms and frames of a dataset that are for training, validation and testing", "split_command"),
    "learn": Command("learn a grammar's numbers from furnished rooms", "learn_command"),
    "gallery": Command("draw contact sheets of the models and of a room of each type", "gallery_command"),
    "catalog": Command("check the models of a user's catalogue", "catalog_command"),
    "export": Command("write a scene description as a GLB file, without ROS", "export_command"),
    "truth": Command("write what is true of a room, or of the rooms of a bag: lights, map, mesh, parse graph", "truth_command"),
    "convert": Command("write the frames of a bag or a dataset in the form that other programs read", "convert_command"),
    "render": Command("render a scene description to image files, without ROS", "render_command"),
    "layers": Command("print the table of layers", "layers_command"),
}


def main(argv: Sequence[str] | None = None) -> None:
    """Run a subcommand; bad input ends in one line on stderr and status 2, a fault of the program in its traceback and FAULT_STATUS."""
    handler = signal.getsignal(signal.SIGINT)
    if handler is signal.default_int_handler:  # while modules load, Ctrl-C just ends the program
        signal.signal(signal.SIGINT, signal.SIG_DFL)
    from scene_description import SceneSynthError, error_line  # numpy with it, which takes its time
    from scene_synth_ros.suite.faults import FAULT_STATUS, fault_report
    from scene_synth_ros.suite.heap import collect_rarely

    collect_rarely()
    arguments = sys.argv[1:] if argv is None else list(argv)
    parser = argparse.ArgumentParser(prog="scene_synth", description="Synthetic indoor camera streams for ROS 2.")
    subparsers = parser.add_subparsers(dest="command", required=True, metavar="COMMAND")
    chosen = next((word for word in arguments if not word.startswith("-")), None)
    module = None
    for name, command in COMMANDS.items():
        subparser = subparsers.add_parser(name, help=command.help, description=command.help[0].upper() + command.help[1:] + ".")
        if name == chosen:  # the modules of other commands stay unloaded
            module = importlib.import_module(f"scene_synth_ros.cli.commands.{command.module}")
            module.add_arguments(subparser)
    parsed = argparse.Namespace()
    try:
        try:
            parser.parse_args(arguments, parsed)
        finally:
            signal.signal(signal.SIGINT, handler)
        assert module is not None
        code = module.run(parsed)
    except (SceneSynthError, OSError) as error:
        sys.stderr.write(f"scene_synth {chosen}: {error_line(error)}\n")
        code = 2
    except KeyboardInterrupt:
        code = 130
    except Exception as error:
        seed = getattr(parsed, "seed", None)
        doing = f"scene_synth {chosen} ran" + (f" with seed {seed}" if seed is not None else "")
        sys.stderr.write(f"{fault_report(error, doing, ['scene_synth', *arguments])}\n")
        code = FAULT_STATUS
    sys.exit(code)
