"""The rooms that a sweep begins with: sampled, or read from scene descriptions."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from pathlib import Path

from grammar import GrammarError, RequestError
from grammar.synthesize import SceneSynthesizer
from scene_description import FieldError, SceneDescription, error_line, scene_from_json
from scene_synth_ros.offline.rules import sample_room
from scene_synth_ros.offline.settings import OfflineSettings
from scene_synth_ros.sweep.sweep_file import SweepError, SweepSpec
from scene_synth_ros.sweep.variant import BaseRoom

RoomSettings = Callable[[Mapping[str, object]], OfflineSettings]
"""Returns the parameters of a run, some of them given, NODE.NAME -> value."""


def base_rooms(spec: SweepSpec, where: str, settings_of: RoomSettings, rules: SceneSynthesizer) -> Iterator[BaseRoom]:
    """Yield the base rooms: those of every type and seed, then the descriptions.

    Args:
        spec: the sweep.
        where: the sweep's file; descriptions are looked for beside it, then in the working directory.
        settings_of: returns the parameters of a room's run.
        rules: that rooms are sampled by.

    Raises:
        SweepError: a room cannot be sampled or read.
    """
    for room_type in spec.base.room_types:
        for seed in spec.base.seeds:
            for index in range(spec.base.count):
                yield _sampled(where, room_parameters(room_type, seed, index), settings_of, rules)
    for file in spec.base.scenes:
        scene = _read(where, file, spec.run.frames)
        if scene.category not in rules.grammars:
            known = ", ".join(sorted(rules.grammars))
            raise SweepError(f"{where}: base.scenes: {file}: expected a room type of {known}, got '{scene.category}'")
        frames = {"grammar_node.frames_per_room": len(scene.camera_path)}
        yield BaseRoom(scene, settings_of(room_parameters(scene.category, scene.seed, scene.index) | frames), file)


def room_parameters(room_type: str, seed: int, index: int) -> dict[str, object]:
    """Return the parameters of a run that is this one room."""
    named = {"scene.room_type": room_type, "seed": seed, "rooms": 1, "first_index": index}
    return {f"grammar_node.{name}": value for name, value in named.items()}


def _sampled(where: str, parameters: Mapping[str, object], settings_of: RoomSettings, rules: SceneSynthesizer) -> BaseRoom:
    settings = settings_of(parameters)
    try:
        return BaseRoom(sample_room(rules, settings, settings.run.first_index), settings)
    except (GrammarError, RequestError) as error:
        raise SweepError(f"{where}: base: {error_line(error)}") from None


def _read(where: str, file: str, frames: int | None) -> SceneDescription:
    """Return a description, with the first ``frames`` poses of its path."""
    beside = Path(where).parent / file
    path = beside if beside.exists() else Path(file)
    try:
        scene = scene_from_json(path.read_text(encoding="utf-8"))
    except UnicodeDecodeError:
        raise SweepError(f"{where}: base.scenes: {file}: expected JSON, got bytes that are no text") from None
    except (FieldError, OSError) as error:
        raise SweepError(f"{where}: base.scenes: {error_line(error) if isinstance(error, OSError) else f'{file}: {error}'}") from None
    if frames is not None and frames > len(scene.camera_path):
        raise SweepError(f"{where}: run.frames: expected at most the {len(scene.camera_path)} poses of {file}, got {frames}")
    return replace(scene, camera_path=scene.camera_path[:frames])
