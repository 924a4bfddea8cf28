"""The variants of a sweep: base rooms, the values of every factor, and what makes each again."""

import json
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path

from grammar import GrammarError, RequestError
from grammar.counterfactual import FACTORS, Change, ChangeError, current_value
from grammar.synthesize import SceneSynthesizer
from scene_description import FieldError, SceneDescription, SceneSynthError, error_line, read_scene
from scene_description.strict import read_value, split_annotation
from scene_synth_ros.offline.rules import sample_room
from scene_synth_ros.offline.settings import OfflineSettings
from scene_synth_ros.render.renderer_config import RENDERER_GROUPS
from scene_synth_ros.suite.parameters import ParameterError, annotations_of, parameter_values
from scene_synth_ros.sweep.designs import design_points
from scene_synth_ros.sweep.sweep_file import MAX_VARIANTS, SweepError, SweepFactor, SweepSpec, parameter_name
from scene_synth_ros.sweep.sweep_json import FactorRow
from scene_synth_ros.sweep.variant import BaseRoom, SweepPlan, Variant

SettingsOf = Callable[[BaseRoom, Mapping[str, object]], OfflineSettings]
"""Returns the parameters of a room's run with some of them changed, NODE.NAME -> value."""


def plan_sweep(spec: SweepSpec, where: str, bases: Sequence[BaseRoom], settings_of: SettingsOf, rules: SceneSynthesizer) -> SweepPlan:
    """Return the variants of all base rooms, numbered one room after the other.

    A value that is the base room's own changes nothing: what two points of the design make alike is made once.

    Raises:
        SweepError: a factor fits no base room, a value fits no parameter, or there are too many variants.
    """
    points = design_points(spec)
    if len(points) * len(bases) > MAX_VARIANTS:
        raise SweepError(f"{where}: factors: expected at most {MAX_VARIANTS} variants, got {len(points) * len(bases)}; take fewer values")
    read = {factor.name: _reader(factor, where) for factor in spec.factors}
    points = [{name: read[name](value) for name, value in point.items()} for point in points]
    own = _base_values(spec, where, bases, rules)
    variants: list[Variant] = []
    for base, values in zip(bases, own, strict=True):
        seen = set()
        for point in points:
            changed = tuple(f.name for f in spec.factors if point.get(f.name) is not None and point[f.name] != values[f.name])
            key = json.dumps([[name, point[name]] for name in changed])
            if key not in seen:
                seen.add(key)
                variants.append(
                    _variant(spec, where, base, values | {name: point[name] for name in changed}, changed, settings_of, len(variants))
                )
    rows = tuple(_row(factor, [values[factor.name] for values in own], points) for factor in spec.factors)
    return SweepPlan(spec, rows, tuple(variants))


def daylight_note(spec: SweepSpec, where: str, rules: SceneSynthesizer) -> str:
    """Return what is to be told before rooms are sampled: that some may come out without the sun that a factor needs; empty if none does.

    Raises:
        SweepError: no room that is sampled has a sun.
    """
    needs = next((factor for factor in spec.factors if factor.spec.factor and FACTORS[factor.spec.factor].by_day), None)
    if needs is None or not spec.base.room_types:
        return ""
    skies = rules.lighting.daylight
    named, by_day = str(spec.grammar.get("daylight", "")), [name for name, sky in skies.items() if sky.cloud_cover is not None]
    advice = f"base.grammar.daylight: {' or '.join(by_day)} has one"
    if spec.grammar.get("environment_map") or (named in skies and named not in by_day):
        got = f"daylight {named}" if named else "an environment map"
        raise SweepError(f"{where}: factors.{needs.name}: expected rooms with a sun, got {got}; {advice}")
    return "" if named else f"factors.{needs.name} needs a sun; the variants of rooms that are drawn without are refused; {advice}"


def _reader(factor: SweepFactor, where: str) -> Callable[[object], object]:
    """Return what reads a value of a factor: a parameter's has a type, whole numbers are rounded from ranges."""
    if not factor.spec.parameter:
        return lambda value: value
    annotation = annotations_of(RENDERER_GROUPS)[parameter_name(factor.spec.parameter)[1]]
    whole = split_annotation(annotation)[0] is int and factor.span is not None

    def read(value: object) -> object:
        try:
            taken = read_value(annotation, round(value) if whole and isinstance(value, float) else value, f"factors.{factor.name}")
        except FieldError as error:
            raise SweepError(f"{where}: {error}") from None
        return list(taken) if isinstance(taken, tuple) else taken

    return read


def _base_values(spec: SweepSpec, where: str, bases: Sequence[BaseRoom], rules: SceneSynthesizer) -> list[dict[str, object]]:
    """Return the factors' values of each base room.

    Raises:
        SweepError: a factor fits none of the rooms.
    """
    own: list[dict[str, object]] = [{} for _ in bases]
    for factor in spec.factors:
        misfits = []
        for base, values in zip(bases, own, strict=True):
            try:
                values[factor.name] = _base_value(factor, base, rules)
            except ChangeError as error:  # of one room: its variants will be refused
                values[factor.name] = None
                misfits.append(error_line(error))
        if len(misfits) == len(bases):
            raise SweepError(f"{where}: factors.{factor.name}: {misfits[0]}")
    return own


def _base_value(factor: SweepFactor, base: BaseRoom, rules: SceneSynthesizer) -> object:
    if factor.spec.factor:
        return current_value(base.scene, Change(factor.spec.factor, factor.target, None, factor.spec.seed), rules)
    node, name = parameter_name(factor.spec.parameter)
    renderers = base.settings.renderers
    values = [parameter_values(groups)[name] for renderer, groups in renderers.items() if node in ("", renderer)]
    return values[0] if values and all(value == values[0] for value in values) else None


def _variant(
    spec: SweepSpec,
    where: str,
    base: BaseRoom,
    values: Mapping[str, object],
    changed: tuple[str, ...],
    settings_of: SettingsOf,
    number: int,
) -> Variant:
    changes: list[Change] = []
    parameters: dict[str, object] = {}
    for factor in spec.factors:
        if factor.name in changed and factor.spec.factor:
            changes.append(Change(factor.spec.factor, factor.target, values[factor.name], factor.spec.seed))
        elif factor.name in changed:
            node, name = parameter_name(factor.spec.parameter)
            renderers = [node] if node else sorted(base.settings.renderers)
            parameters |= {f"{renderer}.{name}": values[factor.name] for renderer in renderers}
    try:
        settings = settings_of(base, parameters) if parameters else base.settings
    except ParameterError as error:
        raise SweepError(f"{where}: factors: {error}") from None
    return Variant(
        id=f"{number:04d}", base=base, factors=dict(values), changed=changed, changes=tuple(changes), settings=settings, file=where
    )


def _row(factor: SweepFactor, own: Sequence[object], points: Sequence[Mapping[str, object]]) -> FactorRow:
    """Return a factor for files; its values are those of the design, numbers in order."""
    values = list({json.dumps(value): value for point in points if (value := point.get(factor.name)) is not None}.values())
    if all(isinstance(value, (int, float)) and not isinstance(value, bool) for value in values):
        values.sort()  # type: ignore[type-var]
    base = own[0] if all(value == own[0] for value in own) else None
    if factor.spec.factor:
        row = FACTORS[factor.spec.factor]
        label, unit, attribute = row.label, row.unit, str(row.attribute)
    else:
        limits = split_annotation(annotations_of(RENDERER_GROUPS)[parameter_name(factor.spec.parameter)[1]])[1]
        label, unit, attribute = limits.description, limits.unit or None, "camera"
    return FactorRow(
        name=factor.name,
        label=factor.spec.label or label,
        unit=factor.spec.unit or unit,
        values=tuple(values),
        base=base,
        attribute=attribute,
    )


RoomSettings = Callable[[Mapping[str, object]], OfflineSettings]
"""Returns the parameters of a run, some of them given, NODE.NAME -> value."""


def base_rooms(spec: SweepSpec, where: str, settings_of: RoomSettings, rules: SceneSynthesizer) -> Iterator[BaseRoom]:
    """Yield the base rooms: those of every type and seed, then the descriptions.

    ``where``: the sweep's file; descriptions are looked for beside it, then in the working directory.

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
        scene = read_scene(path)
    except (SceneSynthError, OSError) as error:
        raise SweepError(f"{where}: base.scenes: {error_line(error)}") from None
    if frames is not None and frames > len(scene.camera_path):
        raise SweepError(f"{where}: run.frames: expected at most the {len(scene.camera_path)} poses of {file}, got {frames}")
    return replace(scene, camera_path=scene.camera_path[:frames])
