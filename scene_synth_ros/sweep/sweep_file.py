"""The file that says what a sweep is: base rooms, how they are rendered, what is changed and by which design."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Any, Literal, NamedTuple

from grammar import SceneRequest
from grammar.counterfactual import FACTORS
from scene_description import FieldError, Limits, SceneSynthError
from scene_description.strict import field_types, from_mapping, shorten
from scene_description.yaml_text import read_yaml
from scene_synth_ros.render.renderer_config import RENDERER_GROUPS
from scene_synth_ros.suite.parameters import annotations_of, suggestion

DesignName = Literal["grid", "one_at_a_time", "latin_hypercube"]
MAX_VARIANTS = 10_000
_MAX_VALUES = 1000


class SweepError(SceneSynthError):
    """A sweep that cannot be made; one line with the file, the key, expected and got."""


Texts = tuple[Annotated[str, Limits(min_length=1, max_length=1000)], ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class BaseSpec:
    """Rooms that are sampled, of every type with every seed, and scene descriptions that are there."""

    room_types: Annotated[Texts, Limits(max_length=100)] = ()
    seeds: Annotated[tuple[Annotated[int, Limits(ge=0, le=2**63 - 1)], ...], Limits(min_length=1, max_length=1000)] = (1,)
    count: Annotated[int, Limits(ge=1, le=1000, description="Rooms of each type and seed: those of indices 0, 1, ...")] = 1
    scenes: Annotated[Texts, Limits(max_length=1000)] = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class RunSpec:
    """How rooms are rendered and recorded, as ``scene_synth run`` takes it."""

    params: Annotated[str, Limits(min_length=1, max_length=1000)] = "main"
    overlays: Annotated[Texts, Limits(max_length=100)] = ()
    frames: Annotated[int, Limits(ge=1, le=100_000)] | None = None
    rate_hz: Annotated[float, Limits(ge=0.1, le=1000.0, unit="Hz")] | None = None
    exposure: Literal["held", "metered"] = "held"


@dataclass(frozen=True, slots=True, kw_only=True)
class FactorSpec:
    """What is known of a factor beside its values: a row of ``FACTORS`` or a parameter of the renderer, and its name in plots."""

    factor: Annotated[str, Limits(max_length=100)] = ""
    parameter: Annotated[str, Limits(max_length=200)] = ""
    seed: Annotated[int, Limits(ge=0, le=2**31 - 1)] = 0
    steps: Annotated[int, Limits(ge=2, le=_MAX_VALUES, description="Values of a range that is no Latin hypercube's")] = 5
    scale: Literal["linear", "log"] = "linear"
    label: Annotated[str, Limits(max_length=200)] = ""
    unit: Annotated[str, Limits(max_length=40)] = ""


class Span(NamedTuple):
    """A range of values, its ends included."""

    low: float
    high: float


@dataclass(frozen=True, slots=True, kw_only=True)
class SweepFactor:
    """A factor of a sweep: its name, what it is, of what, and the values that it takes: a list or a range."""

    name: str
    spec: FactorSpec
    target: Mapping[str, object] = field(default_factory=dict)
    values: tuple[object, ...] = ()
    span: Span | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class SweepSpec:
    """A sweep file.

    Attributes:
        title: for people.
        design: how values are combined; ``samples`` and ``seed`` are the Latin hypercube's.
        base: the rooms.
        grammar: parameters of the rooms that are sampled, those of ``scene.`` of the grammar node.
        run: how they are rendered.
        parameters: of the nodes, NODE.NAME -> value, or NAME of every renderer.
        factors: in the order in which changes are made.
        data: the file as it is.
    """

    title: str = ""
    design: DesignName = "grid"
    samples: Annotated[int, Limits(ge=1, le=MAX_VARIANTS)] = 8
    seed: Annotated[int, Limits(ge=0, le=2**31 - 1)] = 1
    base: BaseSpec = field(default_factory=BaseSpec)
    run: RunSpec = field(default_factory=RunSpec)
    grammar: Mapping[str, Any] = field(default_factory=dict)
    parameters: Mapping[str, Any] = field(default_factory=dict)
    factors: tuple[SweepFactor, ...] = ()
    data: Mapping[str, Any] = field(default_factory=dict)


def read_sweep(path: Path) -> SweepSpec:
    """Read a sweep file.

    Raises:
        SweepError: it cannot be read or does not fit.
        OSError: there is none.
    """
    data = read_yaml(path, SweepError)
    try:
        return _spec(data)
    except FieldError as error:
        raise SweepError(f"{path}: {error}") from None


def _spec(data: object) -> SweepSpec:
    sweep = _mapping(data, "")
    base, run = _mapping(sweep.get("base", {}), "base"), _mapping(sweep.get("run", {}), "run")
    factors = _mapping(sweep.get("factors", {}), "factors")
    if not factors:
        raise FieldError("factors", "at least one factor", "none")
    if not base.get("room_types") and not base.get("scenes"):
        raise FieldError("base", "room_types, scenes or both", "neither")
    plain = {name: value for name, value in sweep.items() if name not in ("base", "run", "factors")}
    for name in plain:
        if name not in ("title", "design", "samples", "seed"):
            raise _unknown(name, ("title", "design", "samples", "seed", "base", "run", "factors"), "")
    spec: SweepSpec = from_mapping(SweepSpec, plain)
    grammar = _mapping(base.get("grammar", {}), "base.grammar")
    for name in grammar:
        if name not in field_types(SceneRequest):
            raise FieldError(f"base.grammar.{name}", "a parameter of rooms", f"an unknown key{suggestion(name, field_types(SceneRequest))}")
    return SweepSpec(
        title=spec.title,
        design=spec.design,
        samples=spec.samples,
        seed=spec.seed,
        base=_section(BaseSpec, base, "base", also=("grammar",)),
        run=_section(RunSpec, run, "run", also=("parameters",)),
        grammar=grammar,
        parameters=_mapping(run.get("parameters", {}), "run.parameters"),
        factors=tuple(_factor(str(name), body) for name, body in factors.items()),
        data=sweep,
    )


def _factor(name: str, body: object) -> SweepFactor:
    where = f"factors.{name}"
    data = _mapping(body, where)
    spec: FactorSpec = _section(FactorSpec, data, where, also=("target", "values", "range"))
    if not spec.factor and not spec.parameter:  # the name says it
        spec = FactorSpec(
            **{**{key: getattr(spec, key) for key in field_types(FactorSpec)}, "parameter" if "." in name else "factor": name}
        )
    if spec.factor and spec.parameter:
        raise FieldError(where, "a factor or a parameter", "both")
    if spec.factor and spec.factor not in FACTORS:
        raise _unknown_name(where, "factor", spec.factor, FACTORS)
    if spec.parameter and parameter_name(spec.parameter)[1] not in annotations_of(RENDERER_GROUPS):
        raise _unknown_name(where, "parameter", spec.parameter, annotations_of(RENDERER_GROUPS))
    if spec.parameter and data.get("target"):
        raise FieldError(f"{where}.target", "nothing beside a parameter", shorten(data["target"]))
    if ("values" in data) == ("range" in data):
        raise FieldError(where, "values or a range", "both" if "values" in data else "neither")
    target = _mapping(data.get("target", {}), f"{where}.target")
    if "range" in data:
        return SweepFactor(name=name, spec=spec, target=target, span=_span(data["range"], spec.scale, f"{where}.range"))
    values = data["values"]
    if not isinstance(values, list) or not 1 <= len(values) <= _MAX_VALUES:
        raise FieldError(f"{where}.values", f"a list of 1 to {_MAX_VALUES} values", shorten(values))
    return SweepFactor(name=name, spec=spec, target=target, values=tuple(values))


def parameter_name(text: str) -> tuple[str, str]:
    """Return the renderer that a parameter is of, empty for all, and its name: ``renderer_node_right.camera.width``."""
    node, _, name = text.partition(".")
    return (node, name) if node.startswith("renderer_node") else ("", text)


def _span(value: object, scale: str, where: str) -> Span:
    numbers = value if isinstance(value, list) else []
    if len(numbers) != 2 or any(isinstance(item, bool) or not isinstance(item, (int, float)) for item in numbers):
        raise FieldError(where, "two numbers, [least, greatest]", shorten(value))
    low, high = map(float, numbers)
    if not low < high:
        raise FieldError(where, "the lesser number first", shorten(value))
    if scale == "log" and low <= 0.0:
        raise FieldError(where, "numbers above 0 with scale log", shorten(value))
    return Span(low, high)


def _section(cls: type, data: Mapping[str, Any], where: str, also: tuple[str, ...]) -> Any:
    """Read a section's plain keys; those in ``also`` are read elsewhere."""
    known = (*field_types(cls), *also)
    for name in data:
        if name not in known:
            raise _unknown(name, known, where)
    return from_mapping(cls, {name: value for name, value in data.items() if name not in also}, where)


def _mapping(value: object, where: str) -> dict[str, Any]:
    if not isinstance(value, Mapping):
        raise FieldError(where, "a mapping", "nothing" if value is None else shorten(value))
    for key in value:
        if not isinstance(key, str):
            raise FieldError(where, "keys that are texts", shorten(key))
    return dict(value)


def _unknown(name: str, known: tuple[str, ...], where: str) -> FieldError:
    path = f"{where}.{name}" if where else name
    return FieldError(path, f"one of {', '.join(known)}", f"an unknown key{_hint(name, known)}")


def _unknown_name(where: str, kind: str, name: str, known: Mapping[str, object]) -> FieldError:
    what = "a factor of scenes" if kind == "factor" else "a parameter of the renderer"
    return FieldError(where, what, f"'{name}'{suggestion(name, known)}")


def _hint(name: str, known: tuple[str, ...]) -> str:
    hint = suggestion(name, known)
    return hint if "did you mean" in hint else ""
