"""Publishes a bag again.

ros2 launch scene_synth_ros replay.launch.py bag:=my_bag rate:=0.5 loop:=true rviz:=true
"""

from launch.substitutions import LaunchConfiguration
from launch_ros.parameter_descriptions import ParameterValue

from scene_synth_ros.cli.processes.launching import RVIZ, SuiteEnd, described, rviz_node, suite_node

TYPES = {"bag": str, "rate": float, "loop": bool, "start_offset_s": float, "clock_hz": float}


def nodes(arguments):
    """Return the nodes."""
    parameters = {name: ParameterValue(LaunchConfiguration(name), value_type=kind) for name, kind in TYPES.items()}
    end = SuiteEnd(["replay_node"], by_themselves=True, with_last=False)
    suite = [suite_node("replay_node", end, namespace="", parameters=[parameters])]
    if arguments.wants("rviz", "rviz2"):
        suite.append(rviz_node(simulated=True))
    return suite


ARGUMENTS = {
    "bag": (None, "Folder of the bag, or its .mcap file"),
    "rate": ("1.0", "Speed, 2.0 is twice as fast"),
    "loop": ("false", "Begin again at the end"),
    "start_offset_s": ("0.0", "Skip the beginning, seconds"),
    "clock_hz": ("0.0", "Publish /clock so often; 0 plays what was recorded"),
} | RVIZ


def generate_launch_description():
    return described(nodes, ARGUMENTS)
