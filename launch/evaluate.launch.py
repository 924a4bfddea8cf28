"""Judges an algorithm that runs beside a live camera or a replayed bag: its topics against the truth at equal stamps.

ros2 launch scene_synth_ros evaluate.launch.py tasks:=depth,normals estimates:=depth:=/my/depth,normals:=/my/normals out:=evaluation.json
"""

from launch.actions import DeclareLaunchArgument, OpaqueFunction
from launch_ros.actions import Node

from launch import LaunchDescription
from scene_synth_ros.cli.processes.launching import Arguments, ending_with


def nodes(context):
    """Return the node, once every argument is known to fit."""
    arguments = Arguments(context)
    lists = {name: [word for word in arguments.text(name).split(",") if word] for name in ("tasks", "estimates", "truth")}
    parameters = {
        **{name: words for name, words in lists.items() if words},
        "camera": arguments.text("camera"),
        "breakdown": arguments.flag("breakdown"),
        "out": arguments.text("out"),
    }
    return [
        Node(
            package="scene_synth_ros",
            executable="evaluator_node",
            name="evaluator_node",
            namespace=arguments.text("namespace"),
            parameters=[parameters],
            output="screen",
            on_exit=ending_with("evaluator_node", when_done=True),
        )
    ]


ARGUMENTS = {
    "namespace": ("/synth", "Namespace of the node and of the truth's topics"),
    "tasks": ("depth", "What is judged, with commas between"),
    "estimates": ("", "Topics of estimates as TASK:=/TOPIC, with commas between; empty: /estimates/depth/image_raw and so on"),
    "truth": ("", "Topics of truth as TASK:=/TOPIC, with commas between; empty: those of the camera"),
    "camera": ("camera", "Camera whose truth counts"),
    "breakdown": ("false", "Take classes and depth of the truth too, for scores by class and by distance"),
    "out": ("evaluation.json", "File of the results; empty writes none"),
}


def generate_launch_description():
    return LaunchDescription(
        [
            *(DeclareLaunchArgument(name, default_value=value, description=text) for name, (value, text) in ARGUMENTS.items()),
            OpaqueFunction(function=nodes),
        ]
    )
