"""Run profiles: one YAML file in ROS parameter-file form for all nodes of a run, and overrides from the command line."""

import re
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

from scene_description import SceneSynthError
from scene_description.share import config_path
from scene_description.yaml_text import dump_yaml, load_yaml, read_yaml

SHIPPED = ("runs", "presets", "cameras", "rigs", "scanners", "lidars", "imus")
"""Folders of the configuration that hold profiles and overlays."""
NODES = ("grammar_node", "renderer_node", "recorder_node")
ALL_NODES = "/**"
NAMESPACE = "/synth"
"""Where a suite is unless it is told otherwise."""
EXTRA_RENDERER = re.compile(r"renderer_node_[A-Za-z0-9_]{1,60}")
"""Names of further renderers; they inherit what is said of ``renderer_node``."""

NodeParameters = dict[str, dict[str, Any]]
"""Node name -> parameter name with dots -> value."""


class ProfileError(SceneSynthError):
    """A run profile or an override that does not fit; one line."""


def find_profile(path: Path) -> Path:
    """Return the file of a profile or overlay that a user means (:func:`find_shipped`).

    Raises:
        ProfileError: there is no such file; the line lists the shipped ones.
    """
    return find_shipped(path, SHIPPED, "a parameter file")


def find_shipped(path: Path, folders: Sequence[str], what: str) -> Path:
    """Return the file that a user means: the path itself, else a shipped file, wherever the package is installed.

    Shipped files go by their name (``stream``), with their folder (``presets/stream``), or as in the source tree
    (``config/presets/stream.yaml``).  ``folders`` are those of the configuration; ``what`` is expected, for the error.

    Raises:
        ProfileError: there is no such file; the line lists the shipped ones.
    """
    if path.exists() and not path.is_dir():
        return path
    shipped = {file.stem: file for folder in folders for file in sorted(config_path(folder).glob("*.yaml"))}
    parts = (*path.parts[:-1], path.stem) if path.name else ()
    parts = parts[1:] if parts[:1] == ("config",) else parts
    found = shipped.get(parts[-1]) if parts and path.suffix in ("", ".yaml") else None
    if found is None or parts[:-1] not in ((), (found.parent.name,)):
        got = "a folder" if path.is_dir() else "nothing there"
        raise ProfileError(f"{path}: expected {what}, or the name of a shipped one: {', '.join(shipped)}, got {got}")
    return found


def load_profile(path: Path) -> NodeParameters:
    """Read a run profile, a file or a shipped one by its name (:func:`find_profile`).

    Keys are node names, plain (``grammar_node``), with a namespace or wildcard (``/synth/grammar_node``, ``/**/grammar_node``), or ``/**``
    for all nodes; below each stands ``ros__parameters``.

    Raises:
        ProfileError: the file cannot be read, is no YAML, or has another form.
    """
    path = find_profile(path)
    data = read_yaml(path, ProfileError)
    parameters: NodeParameters = {node: {} for node in NODES}
    if not isinstance(data, Mapping):
        raise ProfileError(f"{path}: expected node names with ros__parameters below, got {type(data).__name__}")
    for key, body in data.items():
        name = str(key).rsplit("/", 1)[-1]
        if key != ALL_NODES and not is_node(name):
            raise ProfileError(f"{path}: unknown node '{key}'; known: {', '.join(NODES)}")
        if not isinstance(body, Mapping) or set(body) != {"ros__parameters"} or not isinstance(body["ros__parameters"], Mapping):
            raise ProfileError(f"{path}: {key}: expected one key ros__parameters that holds a mapping")
        for node in NODES if key == ALL_NODES else (name,):
            parameters.setdefault(node, {}).update(_flatten(body["ros__parameters"], f"{path}: {key}"))
    return parameters


def is_node(name: str) -> bool:
    """Return whether a node of this name can be part of a run."""
    return name in NODES or EXTRA_RENDERER.fullmatch(name) is not None


def with_inheritance(parameters: NodeParameters) -> NodeParameters:
    """Return the parameters with those of ``renderer_node`` under the ones that further renderers have of their own."""
    base = parameters["renderer_node"]
    return {name: {**base, **values} if EXTRA_RENDERER.fullmatch(name) else values for name, values in parameters.items()}


def check_namespace(namespace: str) -> None:
    """Refuse what is no absolute ROS namespace (https://design.ros2.org/articles/topic_and_service_names.html); a slash may end it.

    Raises:
        ProfileError: it is none.
    """
    if not re.fullmatch(r"/|(/[A-Za-z_][A-Za-z0-9_]*)+/?", namespace) or "__" in namespace:
        raise ProfileError(f"--namespace {namespace}: expected a name that begins with /, of letters, digits and _, as /lab/robot_1")


def with_namespace(parameters: NodeParameters, namespace: str) -> NodeParameters:
    """Return the parameters over those that keep the frames of a suite in a namespace of its own apart from others'."""
    defaults = namespace_defaults(namespace)
    return {name: {**defaults.get(name, {}), **values} for name, values in parameters.items()}


def namespace_defaults(namespace: str) -> NodeParameters:
    """Return what puts a namespace before the names of frames; nothing for the usual one: ``map``, ``camera_link`` and so on."""
    prefix = namespace.strip("/") + "/"
    if prefix in ("/", NAMESPACE.strip("/") + "/"):
        return {}
    world = {"world_frame": f"{prefix}map"}
    streams = {"streams.world_frame": f"{prefix}map", "streams.frame_prefix": prefix}
    return {"grammar_node": world, "renderer_node": streams, "recorder_node": {"frame_prefix": prefix}}


def apply_overrides(parameters: NodeParameters, overrides: Iterable[str]) -> NodeParameters:
    """Return the parameters with overrides of the form ``node.name:=value`` (value in YAML) applied.

    Raises:
        ProfileError: an override has another form or names no node of a run.
    """
    result = {node: dict(values) for node, values in parameters.items()}
    for override in overrides:
        target, assigned, text = override.partition(":=")
        node, dot, name = target.partition(".")
        if not assigned or not dot or not name:
            raise ProfileError(f"-p {override}: expected NODE.NAME:=VALUE, for example renderer_node.render.samples_per_pixel:=8")
        if not is_node(node):
            raise ProfileError(f"-p {override}: unknown node '{node}'; known: {', '.join(NODES)}")
        result.setdefault(node, {})[name] = load_yaml(text, f"-p {target}", ProfileError)
    return result


def write_node_file(path: Path, values: Mapping[str, Any]) -> None:
    """Write one node's parameters as a file that ``--params-file`` takes."""
    path.write_text(dump_yaml({ALL_NODES: {"ros__parameters": dict(values)}}), encoding="utf-8")


def _flatten(values: Mapping[Any, Any], where: str, prefix: str = "") -> dict[str, Any]:
    flat: dict[str, Any] = {}
    for key, value in values.items():
        name = f"{prefix}{key}"
        if isinstance(value, Mapping):
            flat.update(_flatten(value, where, f"{name}."))
        elif value is None:
            raise ProfileError(f"{where}: {name}: expected a value, got nothing")
        else:
            flat[name] = value
    return flat
