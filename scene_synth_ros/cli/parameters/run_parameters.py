"""The parameters of a run's nodes, from a profile, overlays and single values; those of a run that records are kept with its bag."""

import argparse
import sys
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any

from scene_description.share import config_path
from scene_description.strict import field_types, split_annotation
from scene_synth_ros.bags.run_info import MADE_BY, parameters_note
from scene_synth_ros.cli.options import add_field, add_number
from scene_synth_ros.cli.parameters.camera_size import resized_camera
from scene_synth_ros.cli.parameters.run_profile import (
    NAMESPACE,
    NodeParameters,
    ProfileError,
    apply_overrides,
    load_profile,
    with_inheritance,
    with_namespace,
)
from scene_synth_ros.synthesize.run_config import RunConfig

MAX_RENDERERS, MAX_ROOMS_AHEAD = 64, 16


@dataclass(frozen=True, slots=True, kw_only=True)
class RunWords:
    """What a user says of a run: the options of ``scene_synth run`` that are about parameters, by their names there."""

    params: Path | None = None
    overlay: tuple[Path, ...] = ()
    overrides: tuple[str, ...] = ()
    scale_camera: bool = False
    rooms: int | None = None
    frames: int | None = None
    seed: int | None = None
    grammar: Path | None = None
    renderers: int = 1
    record: Path | None = None
    namespace: str = NAMESPACE


def add_run_options(parser: argparse.ArgumentParser, rooms: str, *, profile: str = "main", least_rooms: int = 1, **words: Any) -> None:
    """Declare the options of commands that make rooms by run profiles: what :func:`run_words` reads.

    ``rooms`` is the help of ``--rooms``, and ``words`` are for its declaration, too; ``profile`` is the default of ``--params``.
    """
    rooms_high = split_annotation(field_types(RunConfig)["rooms"])[1].le
    add_number(parser, "--rooms", least_rooms, int(rooms_high or 0), metavar="N", help=rooms, **words)
    add_field(parser, "--frames", RunConfig, "frames_per_room", metavar="N", help="frames of each room (grammar_node.frames_per_room)")
    add_field(parser, "--seed", RunConfig, "seed", metavar="S", help="seed of the rooms (grammar_node.seed)")
    parser.add_argument(
        "--params",
        type=Path,
        metavar="FILE",
        help=f"run profile: a ROS parameter file, or a shipped one by its name, ground_truth, say (default: {profile})",
    )
    add_overlay(parser)
    parser.add_argument(
        "-p", dest="overrides", action="append", default=[], metavar="NODE.NAME:=VALUE", help="one parameter; may be repeated"
    )
    scale = "where -p changes a camera's image size, scale its lens and its other side, too, in place of cutting the image"
    parser.add_argument("--scale-camera", action="store_true", help=scale)
    parser.add_argument(
        "--grammar", type=Path, metavar="FILE", help="grammar file of the rooms (grammar_node.grammar_file, scene.room_type)"
    )


def run_words(arguments: argparse.Namespace, record: Path | None) -> RunWords:
    """Return what the options of a command say of a run; what it has no option for stays at its default."""
    given = {field.name: getattr(arguments, field.name) for field in fields(RunWords) if hasattr(arguments, field.name)}
    return RunWords(**given | {"record": record})


def add_overlay(parser: argparse.ArgumentParser) -> None:
    """Declare ``--overlay``."""
    parser.add_argument(
        "--overlay",
        type=Path,
        action="append",
        default=[],
        metavar="FILE",
        help="parameters laid over the profile: a file, or a shipped one by its name, kinect_v1, say; may be repeated, later ones win",
    )


def run_parameters(words: RunWords) -> NodeParameters:
    """Return the parameters of every node of a run.

    Raises:
        ProfileError: a file, an option or an override does not fit.
        GrammarError: the grammar file does not fit.
    """
    profile = words.params or config_path("runs/main.yaml" if words.record else "runs/live.yaml")
    parameters = load_profile(profile)
    for overlay in words.overlay:
        for node, values in load_profile(overlay).items():
            parameters.setdefault(node, {}).update(values)
    parameters = with_namespace(parameters, words.namespace)
    grammar = parameters["grammar_node"]
    given = {"rooms": "rooms", "frames": "frames_per_room", "seed": "seed", "grammar": "grammar_file"}
    overridden = {override.partition(":=")[0] for override in words.overrides}
    for option, name in given.items():
        if getattr(words, option) is not None:
            if f"grammar_node.{name}" in overridden:
                raise ProfileError(f"-p grammar_node.{name}: expected this or --{option}, which sets it, got both")
            grammar[name] = getattr(words, option)
    if words.grammar is not None:
        from grammar import read_categories, read_grammar

        own = read_grammar(words.grammar, read_categories(config_path("categories.yaml")))
        grammar |= {"grammar_file": str(words.grammar.resolve()), "scene.room_type": own.room_type}
    if not 1 <= words.renderers <= MAX_RENDERERS:
        raise ProfileError(f"--renderers {words.renderers}: expected 1 to {MAX_RENDERERS}")
    if words.renderers > 1:
        _share_rooms(parameters, words.renderers)
    _forget_other_peers(words, parameters)
    parameters = with_inheritance(_overridden(parameters, words))
    grammar = parameters["grammar_node"]
    renderers = [values for name, values in parameters.items() if name.startswith("renderer_node")]
    grammar.setdefault("expected_renderers", len(renderers))
    if grammar.get("clock") == "wall":
        for values in renderers:
            values.setdefault("streams.publish_clock", False)
    finite = bool(parameters["grammar_node"].get("rooms", 0))
    for values in parameters.values():
        values.setdefault("exit_when_done", finite)
    if words.record:
        parameters["grammar_node"].setdefault("expected_recorders", 1)
        for values in renderers:
            values.setdefault("expected_recorders", 1)
        parameters["recorder_node"]["bag"] = str(words.record)
        notes = parameters["recorder_node"].setdefault("custom_data", [MADE_BY])
        if isinstance(notes, list):
            parameters["recorder_node"]["custom_data"] = [
                parameters_note(parameters) if str(note).startswith(MADE_BY) else note for note in notes
            ]
    return parameters


def _overridden(parameters: NodeParameters, words: RunWords) -> NodeParameters:
    """Return the parameters with single values; tell where one of them cuts images."""
    changed = apply_overrides(parameters, words.overrides)
    for node in [name for name in changed if name.startswith("renderer_node")]:
        given = [target.removeprefix(f"{node}.") for target, _, _ in (override.partition(":=") for override in words.overrides)]
        changed[node], told = resized_camera(node, parameters.get(node, {}), changed[node], given, scale=words.scale_camera)
        sys.stderr.write(f"note: {told}\n" if told else "")
    return changed


def _share_rooms(parameters: NodeParameters, count: int) -> None:
    """Add renderers that share the rooms of the run by index."""
    for number in range(2, count + 1):
        parameters[f"renderer_node_{number}"] = {"share_index": number - 1}
    parameters["renderer_node"] |= {"share_count": count, "share_index": 0}
    parameters["grammar_node"].setdefault("rooms_ahead", min(count, MAX_ROOMS_AHEAD))


def _forget_other_peers(words: RunWords, parameters: NodeParameters) -> None:
    """Drop the defaults that the dump of a node carries, where an option of this run decides otherwise."""
    decided = (
        ("expected_recorders", 0, bool(words.record)),
        ("expected_renderers", 1, words.renderers > 1),
        ("exit_when_done", False, bool(words.rooms)),
    )
    for values in parameters.values():
        for name, default, otherwise in decided:
            if otherwise and values.get(name) == default:
                del values[name]
