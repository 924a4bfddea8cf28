"""A live synthetic camera: grammar and renderer, optionally a recorder, RViz, a bridge to Foxglove.

ros2 launch scene_synth_ros synth.launch.py rviz:=true
ros2 launch scene_synth_ros synth.launch.py foxglove:=true overlay_file:=kinect_v1
ros2 launch scene_synth_ros synth.launch.py params_file:=main record:=true bag_path:=my_bag

Recording ends with the last room of the run (``rooms`` of the profile; ``live`` has no end but Ctrl-C): the bag is whole then, and launch
returns.
"""

from launch.actions import DeclareLaunchArgument, OpaqueFunction
from launch.substitutions import PathJoinSubstitution
from launch_ros.actions import Node
from launch_ros.substitutions import FindPackageShare

from launch import LaunchDescription
from scene_synth_ros.cli.parameters.run_profile import namespace_defaults
from scene_synth_ros.cli.processes.launching import Arguments, ending_with

SHARE = PathJoinSubstitution([FindPackageShare("scene_synth_ros"), "config"])


def nodes(context):
    """Return the nodes, once every argument is known to fit."""
    arguments = Arguments(context)
    record, rviz, foxglove = arguments.flag("record"), arguments.wants("rviz", "rviz2"), arguments.wants("foxglove", "foxglove_bridge")
    files, log_level = arguments.profiles("params_file", "overlay_file"), arguments.log_level("log_level")
    clock = arguments.clock("clock", files)
    frames = namespace_defaults(arguments.text("namespace"))
    view_time = {"use_sim_time": clock == "simulated"}

    def suite_node(name, own):
        ends = {"exit_when_done": True} if record else {}
        return Node(
            package="scene_synth_ros",
            executable=name,
            name=name,
            namespace=arguments.text("namespace"),
            parameters=[*([frames[name]] if frames else []), *files, {**own, **ends}],
            arguments=["--ros-args", "--log-level", log_level],
            output="screen",
            on_exit=ending_with(name, when_done=name == "recorder_node"),
        )

    recorders = {"expected_recorders": int(record)}
    own_clock = {"streams.publish_clock": False} if clock == "wall" else {}
    suite = [suite_node("grammar_node", {**recorders, "clock": clock}), suite_node("renderer_node", {**recorders, **own_clock})]
    if record:
        suite.append(suite_node("recorder_node", {"bag": arguments.text("bag_path")}))
    if rviz:
        view = ["-d", PathJoinSubstitution([SHARE, "views", "synth.rviz"])]
        suite.append(Node(package="rviz2", executable="rviz2", arguments=view, parameters=[view_time]))
    if foxglove:
        suite.append(Node(package="foxglove_bridge", executable="foxglove_bridge", parameters=[view_time]))
    return suite


ARGUMENTS = {
    "namespace": ("/synth", "Namespace of nodes and topics"),
    "params_file": ("live", "Run profile: a ROS parameter file, or the name of a shipped one"),
    "overlay_file": ("", "Parameters over those: a file, or a shipped preset, camera or rig by its name"),
    "clock": ("", "simulated (nodes that listen set use_sim_time) or wall (they do not); empty: as the profile says"),
    "log_level": ("info", "debug, info, warn, error or fatal"),
    "record": ("false", "Record a bag; the launch ends with the run's last room"),
    "bag_path": ("synth_bag", "Folder of the bag; must not exist"),
    "rviz": ("false", "Start RViz with the view of this package"),
    "foxglove": ("false", "Start foxglove_bridge (ws://localhost:8765)"),
}


def generate_launch_description():
    return LaunchDescription(
        [
            *(DeclareLaunchArgument(name, default_value=value, description=text) for name, (value, text) in ARGUMENTS.items()),
            OpaqueFunction(function=nodes),
        ]
    )
