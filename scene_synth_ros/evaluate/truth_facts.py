"""What changes the meaning of a metric, told from messages and parameters of the truth: facts of a ``TruthRecord`` by name."""

import math
from collections.abc import Mapping
from itertools import chain
from pathlib import Path
from typing import Any

from rclpy.serialization import deserialize_message
from sensor_msgs.msg import CameraInfo

from scene_description.strict import whole_number
from scene_synth_ros.bags.run_info import NodeValues
from scene_synth_ros.messages.cdr import json_object
from scene_synth_ros.messages.stamps import CdrBytes

_MAX_TEXT, _MOST_COEFFICIENTS = 400, 14


def camera_facts(message: CdrBytes) -> dict[str, Any]:
    """Return what a CameraInfo tells; nothing of one that cannot be read or whose numbers are not finite."""
    try:
        info = deserialize_message(bytes(message), CameraInfo)
    except (RuntimeError, ValueError):
        return {}
    numbers = [round(float(info.k[place]), 2) for place in (0, 4, 2, 5)], [round(float(value), 6) for value in info.d[:_MOST_COEFFICIENTS]]
    if not all(map(math.isfinite, chain(*numbers))):
        return {}
    size = {"image_width": info.width, "image_height": info.height}
    return {**size, "camera_model": _text(info.distortion_model), "intrinsics": tuple(numbers[0]), "distortion": tuple(numbers[1])}


def label_facts(message: CdrBytes) -> dict[str, Any]:
    """Return what serialised JSON labels tell."""
    return {"label_standard": _text(json_object(message).get("standard", "nyu40"))}


def read_class_names(data: CdrBytes) -> dict[int, str]:
    """Return class id -> name of serialised JSON labels; empty if they are none."""
    labels = json_object(data).get("labels")
    rows = labels.items() if isinstance(labels, Mapping) else ()
    named = ((whole_number(key), str(row["name"])) for key, row in rows if isinstance(row, Mapping) and "name" in row)
    return {number: name for number, name in named if number is not None}


def run_facts(nodes: NodeValues) -> dict[str, Any]:
    """Return what the parameters of a run's nodes tell of its rooms."""
    grammar = next((values for name, values in sorted(nodes.items()) if name.rpartition("/")[2] == "grammar_node"), {})
    found: dict[str, Any] = {}
    if "scene.room_type" in grammar:
        found["room_types"] = _text(grammar["scene.room_type"])
    if "grammar_file" in grammar:  # folders differ between machines
        found["grammar"] = _text(Path(str(grammar["grammar_file"])).name) or "that of the program"
    if type(grammar.get("seed")) is int and grammar["seed"] >= 0:
        found["seed"] = grammar["seed"]
    return found


def _text(value: object) -> str:
    """Return a text of unknown origin as a file can hold it."""
    return "".join(letter if letter.isprintable() else "?" for letter in str(value)[:_MAX_TEXT])
