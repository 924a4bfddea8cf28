"""``scene_synth replay``: the replay node with plain options."""

import argparse
import re

from scene_synth_ros.cli.options import UsageError, add_bag
from scene_synth_ros.replay import replay_node

REMAP = re.compile(r"[A-Za-z0-9_/~{}]+:=[A-Za-z0-9_/~{}]+")


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the command's options."""
    add_bag(parser, str)
    parser.add_argument("--rate", type=float, default=1.0, help="speed, 2 is twice as fast (default: %(default)s)")
    parser.add_argument("--loop", action="store_true", help="begin again at the end")
    parser.add_argument("--start-offset", type=float, default=0.0, metavar="SECONDS", help="skip the beginning (default: %(default)s)")
    parser.add_argument("--topics", nargs="+", default=[], help="publish only these topics")
    parser.add_argument("--remap", nargs="+", default=[], metavar="FROM:=TO", help="publish topics under other names")
    parser.add_argument("--clock", type=float, default=0.0, metavar="HZ", help="publish /clock at this rate instead of the recorded one")
    parser.add_argument("--paused", action="store_true", help="wait for the service ~/resume or ~/step before the first message")


def run(arguments: argparse.Namespace) -> int:
    """Run the replay node; it ends the process."""
    options = {
        "bag": f"'{arguments.bag}'",
        "rate": arguments.rate,
        "loop": str(arguments.loop).lower(),
        "start_offset_s": arguments.start_offset,
        "clock_hz": arguments.clock,
        "start_paused": str(arguments.paused).lower(),
    }
    for remap in arguments.remap:
        if not REMAP.fullmatch(remap):
            raise UsageError(f"--remap {remap}: expected FROM:=TO, for example /synth/camera/color/image_raw:=/camera/image_raw")
    if arguments.topics:
        options["topics"] = "[" + ", ".join(f"'{topic}'" for topic in arguments.topics) + "]"
    ros_arguments = [word for name, value in options.items() for word in ("-p", f"{name}:={value}")]
    ros_arguments += [word for remap in arguments.remap for word in ("-r", remap)]
    replay_node.main(["--ros-args", *ros_arguments])
    return 0
