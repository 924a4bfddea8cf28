"""One machine of a recorded run that several machines share: each renders every n-th room, the first also samples and records.

ros2 launch scene_synth_ros machine.launch.py machines:=2 index:=0 rooms:=100 bag_path:=my_bag     # on the first
ros2 launch scene_synth_ros machine.launch.py machines:=2 index:=1                                  # on the second
"""

from pathlib import Path

from scene_synth_ros.cli.options import UsageError
from scene_synth_ros.cli.parameters.run_profile import load_profile, with_inheritance, with_namespace
from scene_synth_ros.cli.processes.launching import BAG, NAMESPACE, SuiteEnd, described, suite_node


def nodes(arguments):
    """Return the nodes of this machine."""
    machines, index, namespace = arguments.number("machines"), arguments.number("index"), arguments.text("namespace")
    if not 0 <= index < machines:
        raise UsageError(f"index: expected from 0 to machines - 1 = {machines - 1}, got {index}")
    renderer = f"renderer_node_{index}"
    profile = with_namespace(load_profile(Path(arguments.text("params_file"))), namespace)
    profile.setdefault(renderer, {}).update(share_count=machines, share_index=index, expected_recorders=1)
    rooms = {"rooms": arguments.number("rooms"), "rooms_ahead": min(machines, 16)}
    profile["grammar_node"].update(**rooms, expected_renderers=machines, expected_recorders=1)
    names = {renderer: "renderer_node"}
    if not index:
        profile["recorder_node"]["bag"] = arguments.new_folder("bag_path")
        names |= {name: name for name in ("recorder_node", "grammar_node")}
    parameters, end = with_inheritance(profile), SuiteEnd(names, by_themselves=True)
    return [
        suite_node(name, end, namespace=namespace, executable=program, parameters=[{"exit_when_done": True, **parameters[name]}])
        for name, program in names.items()
    ]


ARGUMENTS = (
    NAMESPACE
    | BAG
    | {
        "machines": (None, "How many machines render"),
        "index": (None, "Which of them this is, from 0"),
        "rooms": ("100", "Rooms of the run"),
        "params_file": ("main", "Run profile, a file or a shipped one by name; the same on all machines"),
    }
)


def generate_launch_description():
    return described(nodes, ARGUMENTS)
