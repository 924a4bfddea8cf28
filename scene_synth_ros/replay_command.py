"""``scene_synth replay``: the replay node with plain options."""

from __future__ import annotations

import argparse

from scene_synth_ros import replay_node


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the command's options."""
    parser.add_argument("bag", help="folder of the bag, or its .mcap file")
    parser.add_argument("--rate", type=float, default=1.0, help="speed, 2 is twice as fast (default: %(default)s)")
    parser.add_argument("--loop", action="store_true", help="begin again at the end")
    parser.add_argument("--start-offset", type=float, default=0.0, metavar="SECONDS", help="skip the beginning (default: %(default)s)")
    parser.add_argument("--topics", nargs="+", default=[], help="publish only these topics")


def run(arguments: argparse.Namespace) -> int:
    """Run the replay node; it ends the process."""
    options = {
        "bag": f"'{arguments.bag}'",
        "rate": arguments.rate,
        "loop": str(arguments.loop).lower(),
        "start_offset_s": arguments.start_offset,
    }
    if arguments.topics:
        options["topics"] = "[" + ", ".join(f"'{topic}'" for topic in arguments.topics) + "]"
    ros_arguments = [word for name, value in options.items() for word in ("-p", f"{name}:={value}")]
    replay_node.main(["--ros-args", *ros_arguments])
    return 0
