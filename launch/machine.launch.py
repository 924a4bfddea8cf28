"""One machine of a recorded run that several machines share: each renders every n-th room, the first also samples and records.

ros2 launch scene_synth_ros machine.launch.py machines:=2 index:=0 rooms:=100 bag_path:=my_bag     # on the first
ros2 launch scene_synth_ros machine.launch.py machines:=2 index:=1                                  # on the second
"""

from pathlib import Path

from launch.actions import DeclareLaunchArgument, OpaqueFunction
from launch_ros.actions import Node

from launch import LaunchDescription
from scene_synth_ros.cli.options import UsageError
from scene_synth_ros.cli.parameters.run_profile import load_profile, with_inheritance, with_namespace
from scene_synth_ros.cli.processes.launching import Arguments, ending_with


def nodes(context):
    """Return the nodes of this machine."""
    arguments = Arguments(context)
    machines, index = arguments.number("machines"), arguments.number("index")
    if not 0 <= index < machines:
        raise UsageError(f"index: expected from 0 to machines - 1 = {machines - 1}, got {index}")
    renderer = f"renderer_node_{index}"
    profile = with_namespace(load_profile(Path(arguments.text("params_file"))), arguments.text("namespace"))
    profile.setdefault(renderer, {}).update(share_count=machines, share_index=index, expected_recorders=1)
    rooms = {"rooms": arguments.number("rooms"), "rooms_ahead": min(machines, 16)}
    profile["grammar_node"].update(**rooms, expected_renderers=machines, expected_recorders=1)
    profile["recorder_node"]["bag"] = arguments.text("bag_path")
    names = [renderer] if index else ["recorder_node", "grammar_node", renderer]
    return [
        Node(
            package="scene_synth_ros",
            executable="renderer_node" if name == renderer else name,
            name=name,
            namespace=arguments.text("namespace"),
            parameters=[{"exit_when_done": True, **with_inheritance(profile)[name]}],
            output="screen",
            on_exit=ending_with(name, when_done=False),
        )
        for name in names
    ]


def generate_launch_description():
    return LaunchDescription(
        [
            DeclareLaunchArgument("machines", description="How many machines render"),
            DeclareLaunchArgument("index", description="Which of them this is, from 0"),
            DeclareLaunchArgument("rooms", default_value="100", description="Rooms of the run"),
            DeclareLaunchArgument("bag_path", default_value="synth_bag", description="Folder of the bag; must not exist"),
            DeclareLaunchArgument("namespace", default_value="/synth", description="Namespace of nodes and topics"),
            DeclareLaunchArgument(
                "params_file",
                default_value="main",
                description="Run profile, a file or a shipped one by name; the same on all machines",
            ),
            OpaqueFunction(function=nodes),
        ]
    )
