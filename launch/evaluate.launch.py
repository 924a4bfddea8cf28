"""Judges an algorithm that runs beside a live camera or a replayed bag: its topics against the truth at equal stamps.

ros2 launch scene_synth_ros evaluate.launch.py tasks:=depth,normals estimates:=depth:=/my/depth,normals:=/my/normals out:=evaluation.json
"""

from scene_synth_ros.cli.processes.launching import NAMESPACE, SuiteEnd, described, suite_node


def nodes(arguments):
    """Return the node."""
    lists = {name: [word for word in arguments.text(name).split(",") if word] for name in ("tasks", "estimates", "truth")}
    parameters = {
        **{name: words for name, words in lists.items() if words},
        "camera": arguments.text("camera"),
        "breakdown": arguments.flag("breakdown"),
        "out": arguments.text("out"),
    }
    end = SuiteEnd(["evaluator_node"], by_themselves=True)
    return [suite_node("evaluator_node", end, namespace=arguments.text("namespace"), parameters=[parameters])]


ARGUMENTS = NAMESPACE | {
    "tasks": ("depth", "What is judged, with commas between"),
    "estimates": ("", "Topics of estimates as TASK:=/TOPIC, with commas between; empty: /estimates/depth/image_raw and so on"),
    "truth": ("", "Topics of truth as TASK:=/TOPIC, with commas between; empty: those of the camera"),
    "camera": ("camera", "Camera whose truth counts"),
    "breakdown": ("false", "Take classes and depth of the truth too, for scores by class and by distance"),
    "out": ("evaluation.json", "File of the results; empty writes none"),
}


def generate_launch_description():
    return described(nodes, ARGUMENTS)
