"""Publishes a bag again.

ros2 launch scene_synth_ros replay.launch.py bag:=my_bag rate:=0.5 loop:=true rviz:=true
"""

from launch.actions import DeclareLaunchArgument
from launch.conditions import IfCondition
from launch.substitutions import LaunchConfiguration, PathJoinSubstitution
from launch_ros.actions import Node
from launch_ros.parameter_descriptions import ParameterValue
from launch_ros.substitutions import FindPackageShare

from launch import LaunchDescription


def generate_launch_description():
    share = PathJoinSubstitution([FindPackageShare("scene_synth_ros"), "config"])
    types = {"bag": str, "rate": float, "loop": bool, "start_offset_s": float}
    parameters = {name: ParameterValue(LaunchConfiguration(name), value_type=kind) for name, kind in types.items()}
    return LaunchDescription(
        [
            DeclareLaunchArgument("bag", description="Folder of the bag, or its .mcap file"),
            DeclareLaunchArgument("rate", default_value="1.0", description="Speed, 2.0 is twice as fast"),
            DeclareLaunchArgument("loop", default_value="false", description="Begin again at the end"),
            DeclareLaunchArgument("start_offset_s", default_value="0.0", description="Skip the beginning, seconds"),
            DeclareLaunchArgument("rviz", default_value="false", description="Start RViz with the view of this package"),
            Node(package="scene_synth_ros", executable="replay_node", parameters=[parameters], output="screen"),
            Node(
                package="rviz2",
                executable="rviz2",
                arguments=["-d", PathJoinSubstitution([share, "views", "synth.rviz"])],
                condition=IfCondition(LaunchConfiguration("rviz")),
            ),
        ]
    )
