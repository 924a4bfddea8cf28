"""A live synthetic camera: grammar and renderer, optionally a recorder and RViz.

ros2 launch scene_synth_ros synth.launch.py rviz:=true
ros2 launch scene_synth_ros synth.launch.py params_file:=my_run.yaml record:=true bag_path:=my_bag
"""

from launch.actions import DeclareLaunchArgument, SetEnvironmentVariable
from launch.conditions import IfCondition
from launch.substitutions import LaunchConfiguration, PathJoinSubstitution, PythonExpression
from launch_ros.actions import Node
from launch_ros.substitutions import FindPackageShare

from launch import LaunchDescription


def generate_launch_description():
    share = PathJoinSubstitution([FindPackageShare("scene_synth_ros"), "config"])
    namespace, params, log_level = (LaunchConfiguration(name) for name in ("namespace", "params_file", "log_level"))
    record = LaunchConfiguration("record")
    recorders = PythonExpression(["1 if '", record, "'.lower() == 'true' else 0"])

    def suite_node(name, extra, condition=None):
        return Node(
            package="scene_synth_ros",
            executable=name,
            name=name,
            namespace=namespace,
            parameters=[params, extra],
            arguments=["--ros-args", "--log-level", log_level],
            output="screen",
            condition=condition,
        )

    return LaunchDescription(
        [
            DeclareLaunchArgument("namespace", default_value="/synth", description="Namespace of nodes and topics"),
            DeclareLaunchArgument(
                "params_file",
                default_value=PathJoinSubstitution([share, "runs", "live.yaml"]),
                description="Run profile, a ROS parameter file",
            ),
            DeclareLaunchArgument("log_level", default_value="info", description="debug, info, warn or error"),
            DeclareLaunchArgument("record", default_value="false", description="Record a bag"),
            DeclareLaunchArgument("bag_path", default_value="synth_bag", description="Folder of the bag; must not exist"),
            DeclareLaunchArgument("rviz", default_value="false", description="Start RViz with the view of this package"),
            SetEnvironmentVariable("FASTRTPS_DEFAULT_PROFILES_FILE", PathJoinSubstitution([share, "fastdds_large_images.xml"])),
            suite_node("grammar_node", {"expected_recorders": recorders}),
            suite_node("renderer_node", {"expected_recorders": recorders}),
            suite_node("recorder_node", {"bag": LaunchConfiguration("bag_path")}, IfCondition(record)),
            Node(
                package="rviz2",
                executable="rviz2",
                arguments=["-d", PathJoinSubstitution([share, "views", "synth.rviz"])],
                condition=IfCondition(LaunchConfiguration("rviz")),
            ),
        ]
    )
