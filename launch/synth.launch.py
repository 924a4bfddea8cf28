"""A live synthetic camera: grammar and renderer, optionally a recorder, RViz, a bridge to Foxglove.

ros2 launch scene_synth_ros synth.launch.py rviz:=true
ros2 launch scene_synth_ros synth.launch.py foxglove:=true overlay_file:=kinect_v1
ros2 launch scene_synth_ros synth.launch.py params_file:=main record:=true bag_path:=my_bag

Recording ends with the last room of the run (``rooms`` of the profile; ``live`` has no end but Ctrl-C): the bag is whole then, and launch
returns.
"""

import uuid

from launch_ros.actions import Node

from scene_synth_ros.cli.parameters.run_profile import namespace_defaults
from scene_synth_ros.cli.processes.launching import BAG, NAMESPACE, RVIZ, SuiteEnd, described, rviz_node, suite_node
from scene_synth_ros.suite.environment import RUN


def nodes(arguments):
    """Return the nodes."""
    record, rviz, foxglove = arguments.flag("record"), arguments.wants("rviz", "rviz2"), arguments.wants("foxglove", "foxglove_bridge")
    files, log_level = arguments.profiles("params_file", "overlay_file"), arguments.log_level("log_level")
    namespace, clock = arguments.text("namespace"), arguments.clock("clock", files)
    frames = namespace_defaults(namespace)
    recorders = {"expected_recorders": int(record)}
    own = {
        "grammar_node": {**recorders, "clock": clock},
        "renderer_node": {**recorders, **({"streams.publish_clock": False} if clock == "wall" else {})},
    }
    if record:
        own["recorder_node"] = {"bag": arguments.new_folder("bag_path")}
    end, token = SuiteEnd(own, by_themselves=record), uuid.uuid4().hex
    suite = [
        suite_node(
            name,
            end,
            namespace=namespace,
            parameters=[*([frames[name]] if frames else []), *files, values | ({"exit_when_done": True} if record else {})],
            arguments=["--ros-args", "--log-level", log_level],
            additional_env={RUN: token},
        )
        for name, values in own.items()
    ]
    if rviz:
        suite.append(rviz_node(simulated=clock == "simulated"))
    if foxglove:
        suite.append(Node(package="foxglove_bridge", executable="foxglove_bridge", parameters=[{"use_sim_time": clock == "simulated"}]))
    return suite


ARGUMENTS = (
    NAMESPACE
    | BAG
    | RVIZ
    | {
        "params_file": ("live", "Run profile: a ROS parameter file, or the name of a shipped one"),
        "overlay_file": ("", "Parameters over those: a file, or a shipped preset, camera or rig by its name"),
        "clock": ("", "simulated (nodes that listen set use_sim_time) or wall (they do not); empty: as the profile says"),
        "log_level": ("info", "debug, info, warn, error or fatal"),
        "record": ("false", "Record a bag; the launch ends with the run's last room"),
        "foxglove": ("false", "Start foxglove_bridge (ws://localhost:8765)"),
    }
)


def generate_launch_description():
    return described(nodes, ARGUMENTS)
