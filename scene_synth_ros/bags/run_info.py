"""What a bag says of the run that made it: versions, seed, and the parameters of every node as a file that repeats the run."""

import json
import platform
from collections.abc import Mapping
from functools import lru_cache
from importlib import metadata
from pathlib import Path
from typing import Any, NamedTuple

from scene_description.yaml_text import YamlError, dump_yaml, load_yaml

RECORD_NAME = "scene_synth"
JPEG_QUALITY = "jpeg_quality"
PARAMETERS_NAME = "parameters.yaml"
PACKAGES = ("numpy", "numba", "llvmlite", "scipy", "embreex", "trimesh", "mcap", "pillow")

MADE_BY = "scene_synth.parameters="
"""Begins the note of a bag, in its ``custom_data``, that tells the parameters of the run as they were given."""
_MACHINE = ("python", "system", "processor")

_MAX_YAML = 200_000
"""Bytes of a parameter file that are read."""

NodeValues = Mapping[str, Mapping[str, Any]]
"""Fully qualified node name -> parameter name with dots -> value."""


@lru_cache(maxsize=1)
def versions() -> dict[str, str]:
    """Return the versions of this package and of what decides the bytes, and the processor."""
    found = {"python": platform.python_version(), "system": platform.platform(), "processor": _processor()}
    for package in ("scene_synth_ros", *PACKAGES):
        try:
            found[package] = metadata.version(package)
        except metadata.PackageNotFoundError:
            found[package] = "unknown"
    return found


def _processor() -> str:
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
    except OSError:
        lines = []
    return next((line.partition(":")[2].strip() for line in lines if line.startswith("model name")), platform.machine())


def run_record(nodes: NodeValues, *, machine: bool = True) -> dict[str, str]:
    """Return the metadata record of a run: versions, and seed and room type of its grammar node.

    Without ``machine`` Python, system and processor are left out, so that the record is of no machine.
    """
    record = {f"version.{name}": version for name, version in versions().items() if machine or name not in _MACHINE}
    for name, values in sorted(nodes.items()):
        if "seed" in values:
            record |= {"seed": str(values["seed"]), "room_type": str(values.get("scene.room_type", "")), "grammar_node": name}
    return record


def parameters_note(parameters: NodeValues) -> str:
    """Return the note of the parameters that made a bag, those of its recorder excepted; node name -> parameter -> value as given."""
    return f"{MADE_BY}{json.dumps({node: values for node, values in parameters.items() if node != 'recorder_node'}, sort_keys=True)}"


def parameters_file(nodes: NodeValues) -> bytes:
    """Return the parameters as a ROS parameter file; ``scene_synth run --params`` takes it.

    Empty lists, which every list is by default, are left out: in such a file they have no type.
    """
    said = {name: {key: value for key, value in sorted(values.items()) if value != []} for name, values in sorted(nodes.items())}
    document = {name: {"ros__parameters": values} for name, values in said.items()}
    return dump_yaml(document).encode()


def read_parameters(text: bytes) -> dict[str, Mapping[Any, Any]]:
    """Return node -> parameter -> value of a ROS parameter file of whatever origin; nothing where it is none, or a very large one."""
    try:
        document = load_yaml(text, PARAMETERS_NAME) if len(text) <= _MAX_YAML else None
    except YamlError:
        document = None
    nodes = document.items() if isinstance(document, Mapping) else ()
    found = {str(node): content.get("ros__parameters") for node, content in nodes if isinstance(content, Mapping)}
    return {node: values for node, values in found.items() if isinstance(values, Mapping)}


class Promise(NamedTuple):
    """What the parameters of a run say that its bag will hold: so many rooms from an index on, so many frames of each, of some cameras.

    ``rooms`` is 0 of a run without end; ``namespace`` is that of the run's nodes and topics.
    """

    namespace: str
    rooms: int
    first_index: int
    frames_per_room: int
    cameras: frozenset[str]


def read_promise(parameters: bytes) -> Promise | None:
    """Return what a parameter file says of the bag that it lies in; None of one without a grammar node."""
    nodes = read_parameters(parameters)
    grammar = next((name for name in sorted(nodes) if name.rpartition("/")[2] == "grammar_node"), None)
    if grammar is None:
        return None
    numbers = [nodes[grammar].get(name) for name in ("rooms", "first_index", "frames_per_room")]
    rooms, first_index, frames = (value if isinstance(value, int) and value >= 0 else 0 for value in numbers)
    namespace = grammar.rpartition("/")[0]
    renderers = [values for name, values in nodes.items() if name.startswith(f"{namespace}/renderer_node")]
    cameras = frozenset(f"{namespace}/{values.get('streams.camera')}" for values in renderers)
    return Promise(namespace, rooms, first_index, frames, cameras)
