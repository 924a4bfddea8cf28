"""Publishes a bag again.

ros2 launch scene_synth_ros replay.launch.py bag:=my_bag rate:=0.5 loop:=true rviz:=true
"""

from launch.actions import DeclareLaunchArgument, OpaqueFunction
from launch.substitutions import LaunchConfiguration, PathJoinSubstitution
from launch_ros.actions import Node
from launch_ros.parameter_descriptions import ParameterValue
from launch_ros.substitutions import FindPackageShare

from launch import LaunchDescription
from scene_synth_ros.cli.processes.launching import Arguments, ending_with

SHARE = PathJoinSubstitution([FindPackageShare("scene_synth_ros"), "config"])
TYPES = {"bag": str, "rate": float, "loop": bool, "start_offset_s": float, "clock_hz": float}


def nodes(context):
    """Return the nodes, once every argument is known to fit."""
    parameters = {name: ParameterValue(LaunchConfiguration(name), value_type=kind) for name, kind in TYPES.items()}
    on_exit = ending_with("replay_node", when_done=False)
    suite = [Node(package="scene_synth_ros", executable="replay_node", parameters=[parameters], output="screen", on_exit=on_exit)]
    if Arguments(context).wants("rviz", "rviz2"):
        view = ["-d", PathJoinSubstitution([SHARE, "views", "synth.rviz"])]
        suite.append(Node(package="rviz2", executable="rviz2", arguments=view, parameters=[{"use_sim_time": True}]))
    return suite


def generate_launch_description():
    return LaunchDescription(
        [
            DeclareLaunchArgument("bag", description="Folder of the bag, or its .mcap file"),
            DeclareLaunchArgument("rate", default_value="1.0", description="Speed, 2.0 is twice as fast"),
            DeclareLaunchArgument("loop", default_value="false", description="Begin again at the end"),
            DeclareLaunchArgument("start_offset_s", default_value="0.0", description="Skip the beginning, seconds"),
            DeclareLaunchArgument("clock_hz", default_value="0.0", description="Publish /clock so often; 0 plays what was recorded"),
            DeclareLaunchArgument("rviz", default_value="false", description="Start RViz with the view of this package"),
            OpaqueFunction(function=nodes),
        ]
    )
