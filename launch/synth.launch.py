"""A live synthetic camera: grammar and renderer, optionally a recorder, RViz, a bridge to Foxglove.

ros2 launch scene_synth_ros synth.launch.py rviz:=true
ros2 launch scene_synth_ros synth.launch.py foxglove:=true overlay_file:=my_camera.yaml
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
            parameters=[params, LaunchConfiguration("overlay_file"), extra],
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
            DeclareLaunchArgument(
                "overlay_file",
                default_value=LaunchConfiguration("params_file"),
                description="Another parameter file on top of it, for example one of config/presets or config/cameras",
            ),
            DeclareLaunchArgument("log_level", default_value="info", description="debug, info, warn or error"),
            DeclareLaunchArgument("record", default_value="false", description="Record a bag"),
            DeclareLaunchArgument("bag_path", default_value="synth_bag", description="Folder of the bag; must not exist"),
            DeclareLaunchArgument("rviz", default_value="false", description="Start RViz with the view of this package"),
            DeclareLaunchArgument("foxglove", default_value="false", description="Start foxglove_bridge (ws://localhost:8765)"),
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
            Node(package="foxglove_bridge", executable="foxglove_bridge", condition=IfCondition(LaunchConfiguration("foxglove"))),
        ]
    )
