"""Writes the pages of commands, parameters and topics from the code that defines them.  ``make docs`` runs it."""

import argparse
import importlib
import sys
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any, get_args, get_origin

from scene_description.strict import split_annotation
from scene_synth_ros.cli.command_line import COMMANDS
from scene_synth_ros.cli.lines import markdown_table
from scene_synth_ros.evaluate.evaluator_config import EvaluatorConfig
from scene_synth_ros.messages.streams import ROLES, Role
from scene_synth_ros.record.recorder_config import RECORDER_GROUPS
from scene_synth_ros.render.renderer_config import RENDERER_GROUPS
from scene_synth_ros.replay.replay_config import ReplayConfig
from scene_synth_ros.suite.parameters import annotations_of, parameter_values
from scene_synth_ros.synthesize.run_config import GRAMMAR_GROUPS

DOCS = Path(__file__).resolve().parent
MADE = "Made from the code by `make docs`; edit the code, not this page."

COMMAND_PAGES = {
    "demo": "show", "run": "streams", "generate": "generate", "inspect": "streams", "verify": "streams", "repair": "streams",
    "evaluate": "evaluation", "show": "show", "report": "report", "replay": "streams", "sample": "grammar", "sweep": "sweeps",
    "estimate": "scale", "split": "splits", "learn": "learning", "gallery": "gallery", "catalog": "catalog", "export": "export",
    "truth": "truth", "prove": "prove", "convert": "convert", "render": "layers", "layers": "layers",
}  # fmt: skip
"""Command -> the page that explains it."""

NODES: dict[str, dict[str, type]] = {
    "grammar_node": GRAMMAR_GROUPS,
    "renderer_node": RENDERER_GROUPS,
    "recorder_node": RECORDER_GROUPS,
    "evaluator_node": {"": EvaluatorConfig},
    "replay_node": {"": ReplayConfig},
}
"""Node -> prefix of its parameters -> dataclass that defines them."""

TOPIC_CONTENT = {
    "image_raw": "the layer's image; [layers.md](layers.md) says what its pixels hold",
    "image_raw/compressed": "colour as JPEG, ids as PNG, for image_transport; made only while somebody subscribes",
    "image_raw/compressedDepth": "depth as PNG, for image_transport; made only while somebody subscribes",
    "image_color": "a picture of the layer for people",
    "image_color/compressed": "the same as PNG or JPEG; made only while somebody subscribes",
    "camera_info": "the lens; pixel centres are at integers ([cameras.md](cameras.md))",
    "labels": "JSON: id -> name, class, colour; repeated with every frame",
    "label_info": "id -> name, as the labels; live where vision_msgs is installed, always in bags",
    "pose": "true pose of the optical frame, or of the scanner, in the world's frame",
    "annotations": "JSON: boxes, visible share, truncation, key points, relations ([annotations.md](annotations.md))",
    "detections_2d": "2D boxes of the annotations; live where vision_msgs is installed, always in bags",
    "detections_3d": "3D boxes of the annotations; live where vision_msgs is installed, always in bags",
    "points": "the view as an organised cloud, with ids ([scan.md](scan.md))",
    "points_sensed": "the same cloud as the depth sensor reads it ([scan.md](scan.md))",
    "scene": "JSON: the room (`scene_synth/1`)",
    "markers": "boxes, names and outline of the room, for RViz",
    "map": "the free floor",
    "settings": "JSON: what the frame was rendered with; below the renderer's name, repeated with every frame",
    "scan": "a planar laser scan as the scanner reads it ([scan.md](scan.md))",
    "scan_ideal": "the same scan without noise and losses ([scan.md](scan.md))",
    "imu/data": "rate and specific force as the device reads them ([body.md](body.md))",
    "imu/ideal": "the same as they truly are, and the orientation in the map ([body.md](body.md))",
    "odom": "odometry of the wheels, with a covariance that covers its error ([body.md](body.md))",
    "odom/ideal": "true pose and velocity of the body, at its own rate and with every frame ([body.md](body.md))",
    "joint_states": "angles of the wheels, in steps of their encoders ([body.md](body.md))",
    "lidar/points": "a sweep of the lidar as it reads it, with the time of each point ([lidar.md](lidar.md))",
    "lidar/points_ideal": "the same sweep without noise and losses ([lidar.md](lidar.md))",
    "robot_description": "URDF of the body, its sensors and wheels; once a room ([body.md](body.md))",
    "clock": "simulated time; absolute name `/clock`; of a body it ticks with the fastest stream",
    "tf": "world -> `<camera>_link` -> `<camera>_optical_frame`; absolute name `/tf`, live where tf2_msgs is installed, always in bags",
    "tf_static": "transforms that stay; absolute name `/tf_static`, live where tf2_msgs is installed, always in bags",
}
"""Name of a role -> what its messages say."""

SENSES = dict.fromkeys(("imu/data", "imu/ideal"), "imu") | dict.fromkeys(("odom", "joint_states"), "wheels")
SENSES |= dict.fromkeys(("lidar/points", "lidar/points_ideal"), "lidar")
SENSES |= dict.fromkeys(("odom/ideal", "robot_description"), "body")
"""Name of a role between frames -> what must be enabled, where that is not the scanner."""

OTHER_TOPICS = (
    ("`scene/next`", "std_msgs/msg/String", "the room after the present one, so that a renderer in real time makes it ahead; latched"),
    ("`status`", "std_msgs/msg/String", "JSON: where each node of the suite stands; lock-step works over it; latched"),
    ("`evaluation`", "std_msgs/msg/String", "JSON: running scores of an algorithm, of `evaluator_node`; latched"),
    (
        "`/diagnostics`",
        "diagnostic_msgs/msg/DiagnosticArray",
        "rates, losses, seeds, faults; `config/diagnostics/analyzers.yaml` sorts them",
    ),
)


def commands_page() -> str:
    """Return ``docs/commands.md``, from ``COMMANDS`` and the parsers of the commands."""
    index = markdown_table(("command", "does"), ((f"[{name}](#{name})", command.help) for name, command in COMMANDS.items()))
    parts = [
        "# Commands",
        MADE,
        "`scene_synth` is in `.venv/bin` after `make setup`; in a colcon workspace `ros2 run scene_synth_ros scene_synth` is the "
        "same ([install.md](install.md)). Shipped profiles, presets, cameras, rigs, scanners, lidars, IMUs and sweeps go by their names, "
        "wherever the package is installed: `--params main --overlay kinect_v1`. Exit status: 0, 1 where something was found to be wrong, "
        "2 for input that cannot be used, which is told in one line.",
        index,
        *(part for name in COMMANDS for part in _command(name)),
    ]
    return "\n\n".join(parts) + "\n"


def _command(name: str) -> Iterator[str]:
    parser = argparse.ArgumentParser(add_help=False)
    importlib.import_module(f"scene_synth_ros.cli.commands.{COMMANDS[name].module}").add_arguments(parser)
    yield f"## {name}"
    help_line = COMMANDS[name].help
    yield f"{help_line[0].upper()}{help_line[1:]}: [{COMMAND_PAGES[name]}.md]({COMMAND_PAGES[name]}.md)."
    yield markdown_table(("option", "what"), map(_option, parser._actions))
    if parser.epilog:
        yield f"```text\n{parser.epilog}\n```"


def _option(action: argparse.Action) -> tuple[str, str]:
    """Return the words of an option and its help, which says the default."""
    value = action.metavar or (f"{{{','.join(map(str, action.choices))}}}" if action.choices else action.dest.upper())
    words = " ".join(action.option_strings[:1]) if action.nargs == 0 else f"{' '.join(action.option_strings[:1])} {value}".strip()
    required = " (required)" if action.required and action.option_strings else ""
    return f"`{words}`{required}", (action.help or "") % vars(action)


def parameters_page() -> str:
    """Return ``docs/parameters.md``, from the dataclasses of the nodes' parameters."""
    parts = [
        "# Parameters",
        MADE,
        "A run is a ROS parameter file (`config/runs`); `-p renderer_node.render.samples_per_pixel:=64` changes one value, `--overlay` "
        "lays a file over the profile. A name that does not exist is refused. A parameter that can change while the node runs takes effect "
        "with the next room or frame; where it cannot, the last column says why.",
        *(part for node, groups in NODES.items() for part in (f"## {node}", _parameters(groups))),
    ]
    return "\n\n".join(parts) + "\n"


def _parameters(groups: Mapping[str, type]) -> str:
    defaults = parameter_values({prefix: cls() for prefix, cls in groups.items()})
    rows = []
    for name, annotation in annotations_of(groups).items():
        bare, limits = split_annotation(annotation)
        fixed = limits.fixed and f"fixed: {limits.fixed}"
        rows.append((f"`{name}`", _value(defaults[name]), _range(bare, limits), limits.unit, limits.description, fixed))
    return markdown_table(("parameter", "default", "range", "unit", "what", "change"), rows)


def _value(value: object) -> str:
    return f"`{value}`" if value not in ("", [], None) else "empty"


def _range(bare: Any, limits: Any) -> str:
    if get_args(bare) and get_origin(bare) is not tuple and all(isinstance(choice, str) for choice in get_args(bare)):
        return ", ".join(f"`{choice}`" for choice in get_args(bare))
    if bare is bool:
        return "true, false"
    if limits.ge is not None and limits.le is not None:
        return f"{limits.ge:.12g} to {limits.le:.12g}"
    return "list" if get_origin(bare) is tuple else "text" if bare is str else ""


def topics_page() -> str:
    """Return ``docs/topics.md``, from the vocabulary of streams."""
    rows = [(_topic(role), f"`{role.type_name}`", _frame(role), _published(role), TOPIC_CONTENT[role.name]) for role in ROLES.values()]
    others = [(topic, f"`{kind}`", content) for topic, kind, content in OTHER_TOPICS]
    parts = [
        "# Topics",
        MADE,
        "Names are relative to the namespace (`/synth` by default); `<camera>` is the parameter `streams.camera`, `<layer>` a row "
        "of [layers.md](layers.md). All messages of a frame carry the same simulated stamp. Publishers are reliable, so best-effort "
        "subscribers connect too; the usual `qos_overrides` parameters change depth and reliability. Services, QoS, several renderers and "
        "what is in a bag: [streams.md](streams.md).",
        markdown_table(("topic", "type", "frame", "published", "content"), rows),
        "Beside them, for the nodes themselves and for people:",
        markdown_table(("topic", "type", "content"), others),
    ]
    return "\n\n".join(parts) + "\n"


def _topic(role: Role) -> str:
    below = {"layer": "<camera>/<layer>/", "camera": "<camera>/", "run": ""}[role.of]
    return f"`{below}{role.name}`"


def _frame(role: Role) -> str:
    own = {"optical": "<camera>_optical_frame", "world": "map", "imu": "imu_link", "lidar": "lidar_link", "": "none"}
    return own[""] if not role.frame else f"`{own.get(role.frame, role.frame)}`"


def _published(role: Role) -> str:
    """Return when a topic is there: by its switch, from what it is made, whether it is latched or has a rate of its own."""
    says = [f"with `streams.{role.switch}`"] if role.switch else []
    says += ["with `streams.<layer>`"] if role.of == "layer" else []
    says += [f"with `{SENSES.get(role.name, 'scan')}.enabled`, at its own rate"] if role.own_stamps else []
    says += ["latched"] if role.latched else []
    return ", ".join(says) or "always"


PAGES: dict[str, Callable[[], str]] = {"commands.md": commands_page, "parameters.md": parameters_page, "topics.md": topics_page}


def main() -> None:
    """Write every page."""
    for name, page in PAGES.items():
        (DOCS / name).write_text(page(), encoding="utf-8")
        sys.stdout.write(f"docs/{name} written\n")


if __name__ == "__main__":
    main()
