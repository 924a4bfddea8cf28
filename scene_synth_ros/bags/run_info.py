"""What a bag says of the run that made it: versions, seed, and the parameters of every node as a file that repeats the run."""

from __future__ import annotations

import json
import platform
from collections.abc import Mapping
from functools import lru_cache
from importlib import metadata
from pathlib import Path
from typing import Any

import yaml

RECORD_NAME = "scene_synth"
JPEG_QUALITY = "jpeg_quality"
PARAMETERS_NAME = "parameters.yaml"
PACKAGES = ("numpy", "numba", "llvmlite", "scipy", "embreex", "trimesh", "mcap", "pillow")

MADE_BY = "scene_synth.parameters="
"""Begins the note of a bag, in its ``custom_data``, that tells the parameters of the run as they were given."""
_MACHINE = ("python", "system", "processor")

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
    return yaml.safe_dump(document, sort_keys=False, allow_unicode=True).encode()
