"""Strict reading of nested mappings (JSON, YAML, parameters) into frozen dataclasses.

The dataclass is the only definition: its annotations give types, ``Limits`` give ranges, units and descriptions.  Unknown and missing
keys, wrong types, values that are not finite and values out of range are refused with the path of the field.

    >>> @dataclass(frozen=True)
    ... class Lens:
    ...     fov_rad: Annotated[float, Limits(ge=0.1, le=3.0, unit="rad")] = 1.0
    >>> from_mapping(Lens, {"fov_rad": 9.0})
    Traceback (most recent call last):
    scene_description.strict.FieldError: fov_rad: expected a number in [0.1, 3.0] rad, got 9.0
"""

import contextlib
import dataclasses
import json
import math
import re
import types
import typing
from collections.abc import Callable, Mapping, Sized
from dataclasses import dataclass
from functools import cache
from typing import Annotated, Any, Literal, TypeVar, Union, get_args, get_origin

from scene_description.errors import SceneSynthError

T = TypeVar("T")


class FieldError(SceneSynthError):
    """A field that does not fit; the text is one line: path, expected, got."""

    def __init__(self, path: str, expected: str, got: str) -> None:
        self.path, self.expected, self.got = path, expected, got
        super().__init__(f"{path or 'document'}: expected {expected}, got {got}")


@dataclass(frozen=True)
class Limits:
    """What a value must satisfy beyond its type, and what people should know of it.

    ``ge``/``le`` bound numbers; ``min_length``/``max_length`` bound strings, sequences and mappings; ``pattern`` must match a whole
    string.  ``fixed`` says why the value cannot change in a running node; empty means that it can.
    """

    ge: float | None = None
    le: float | None = None
    min_length: int | None = None
    max_length: int | None = None
    pattern: str | None = None
    unit: str = ""
    description: str = ""
    fixed: str = ""


NO_LIMITS = Limits()
_DIGITS = re.compile("[0-9]{1,18}")

_Read = Callable[[Any, Limits, object, str], Any]
_READERS: dict[int, tuple[Any, tuple[_Read, Any, Limits]]] = {}
"""Reads a value: bare type of the annotation, its limits, the value, its path."""


def shorten(value: object) -> str:
    """Return ``repr(value)`` cut to what fits in an error line; containers that are long or nest deeply only by type and length."""
    text = ""
    if not isinstance(value, (list, tuple, dict)) or len(value) <= 8:
        with contextlib.suppress(RecursionError, ValueError):
            text = repr(value)
    text = text or f"{type(value).__name__}{f' of {len(value)}' if isinstance(value, Sized) else ''}"
    return text if len(text) <= 60 else text[:57] + "..."


def whole_number(text: str) -> int | None:
    """Return the number below 10^18 that decimal digits stand for, None of any other text; ``int`` refuses 5,000 digits, and ``²``.

    >>> whole_number("17"), whole_number("-1"), whole_number("9" * 5000)
    (17, None, None)
    """
    return int(text) if _DIGITS.fullmatch(text) else None


def split_annotation(annotation: Any) -> tuple[Any, Limits]:
    """Return the bare type of an annotation and the ``Limits`` given with it."""
    if get_origin(annotation) is Annotated:
        bare, *extras = get_args(annotation)
        return bare, next((extra for extra in extras if isinstance(extra, Limits)), NO_LIMITS)
    return annotation, NO_LIMITS


@cache
def field_types(cls: type) -> dict[str, Any]:
    """Return field name -> annotation (with its extras) of a dataclass."""
    hints = typing.get_type_hints(cls, include_extras=True)
    return {field.name: hints[field.name] for field in dataclasses.fields(cls)}


def from_json(cls: type[T], text: str | bytes, path: str, longest: int) -> T:
    """Read the JSON of a mapping into the dataclass ``cls``, as :func:`from_mapping` does.

    Raises:
        FieldError: the text is longer than ``longest``, is no JSON, or does not fit.
    """
    if len(text) > longest:
        raise FieldError(path, f"at most {longest} characters", f"{len(text)}")
    try:
        data = json.loads(text)
    except (ValueError, RecursionError):
        raise FieldError(path, "JSON", shorten(text)) from None
    return from_mapping(cls, data, path)


def from_mapping(cls: type[T], data: object, path: str = "") -> T:
    """Read a mapping into the dataclass ``cls``.

    Args:
        cls: a dataclass whose fields are numbers, strings, booleans, literals, tuples, mappings, dataclasses, one of these or None, or one
            of several scalars.
        data: what a JSON or YAML reader returned.
        path: where ``data`` stands in its document, for messages.

    Raises:
        FieldError: with the path of the first field that does not fit.
    """
    if not isinstance(data, Mapping):
        raise FieldError(path, f"a mapping ({cls.__name__})", shorten(data))
    hints = field_types(typing.cast(Any, cls))
    for key in data:
        if key not in hints:
            raise FieldError(_join(path, str(key)), f"one of {', '.join(sorted(hints))}", "an unknown key")
    values = {}
    for field in dataclasses.fields(cls):  # type: ignore[arg-type]
        if field.name in data:
            values[field.name] = read_value(hints[field.name], data[field.name], _join(path, field.name))
        elif field.default is dataclasses.MISSING and field.default_factory is dataclasses.MISSING:
            raise FieldError(_join(path, field.name), "a value", "nothing (the key is missing)")
    return cls(**values)


def read_value(annotation: Any, value: object, path: str) -> Any:
    """Read one value as its annotation asks; see :func:`from_mapping`."""
    read, bare, limits = _reader(annotation)
    return read(bare, limits, value, path)


def _reader(annotation: Any) -> tuple[_Read, Any, Limits]:
    """Return the function that reads values of an annotation, with the annotation's bare type and limits.

    Kept by the annotation's identity: equal ones need not say the same, as ``Literal`` compares without order.
    """
    if id(annotation) not in _READERS:
        _READERS[id(annotation)] = annotation, _make_reader(annotation)
    return _READERS[id(annotation)][1]


def _make_reader(annotation: Any) -> tuple[_Read, Any, Limits]:
    bare, limits = split_annotation(annotation)
    origin = get_origin(bare)
    if origin in (Union, types.UnionType):
        return _read_union, bare, limits
    if origin is Literal:
        return _read_literal, bare, limits
    if origin is tuple:
        return _read_tuple, bare, limits
    if origin is not None and issubclass(origin, Mapping):
        return _read_mapping, bare, limits
    if dataclasses.is_dataclass(bare):
        return _read_dataclass, bare, limits
    return _SCALARS[bare], bare, limits


def to_mapping(value: Any) -> Any:
    """Return dataclasses as dicts and tuples as lists, recursively; fields that are None are left out."""
    if isinstance(value, (str, int, float)):
        return value
    if dataclasses.is_dataclass(value):
        pairs = ((name, getattr(value, name)) for name in field_names(value.__class__))
        return {name: to_mapping(item) for name, item in pairs if item is not None}
    if isinstance(value, (tuple, list)):
        return [to_mapping(item) for item in value]
    if isinstance(value, Mapping):
        return {key: to_mapping(item) for key, item in value.items()}
    return value


@cache
def field_names(cls: type) -> tuple[str, ...]:
    """Return the names of a dataclass's fields, in order."""
    return tuple(field.name for field in dataclasses.fields(cls))


def _join(path: str, key: str) -> str:
    key = key if key.isprintable() else repr(key)
    key = key if len(key) <= 60 else key[:57] + "..."
    return f"{path}.{key}" if path else key


def _read_union(bare: Any, limits: Limits, value: object, path: str) -> Any:
    """Read what may be None, or one of several scalars, which stays as it is."""
    kinds = [arg for arg in get_args(bare) if arg is not type(None)]
    may_be_null = len(kinds) < len(get_args(bare))
    if value is None and may_be_null:
        return None
    if len(kinds) > 1:
        if not isinstance(value, (*kinds, *((int,) if float in kinds else ()))):
            nouns = ", ".join(_NOUNS[kind] for kind in kinds)
            raise FieldError(path, f"{nouns}{' or null' if may_be_null else ''}", shorten(value))
        return value
    (inner,) = kinds
    read, inner_bare, inner_limits = _reader(inner)
    return read(inner_bare, inner_limits if limits is NO_LIMITS else limits, value, path)


def _read_literal(bare: Any, limits: Limits, value: object, path: str) -> Any:
    if value not in get_args(bare):
        raise FieldError(path, "one of " + ", ".join(map(repr, get_args(bare))), shorten(value))
    return value


def _read_dataclass(bare: Any, limits: Limits, value: object, path: str) -> Any:
    return from_mapping(bare, value, path)


def _read_tuple(bare: Any, limits: Limits, value: object, path: str) -> tuple[Any, ...]:
    args = get_args(bare)
    if not isinstance(value, (list, tuple)):
        raise FieldError(path, "a list", shorten(value))
    if len(args) == 2 and args[1] is Ellipsis:
        _check_length(limits, len(value), "items", path)
        return tuple(read_value(args[0], item, f"{path}[{i}]") for i, item in enumerate(value))
    if len(value) != len(args):
        raise FieldError(path, f"{len(args)} items", f"{len(value)}")
    return tuple(read_value(arg, item, f"{path}[{i}]") for i, (arg, item) in enumerate(zip(args, value, strict=True)))


def _read_mapping(bare: Any, limits: Limits, value: object, path: str) -> dict[str, Any]:
    item_type = get_args(bare)[1]
    if not isinstance(value, Mapping):
        raise FieldError(path, "a mapping", shorten(value))
    _check_length(limits, len(value), "keys", path)
    for key in value:
        if not isinstance(key, str):
            raise FieldError(path, "keys that are strings", shorten(key))
    return {key: read_value(item_type, item, _join(path, key)) for key, item in value.items()}


def _check_length(limits: Limits, length: int, noun: str, path: str) -> None:
    if limits.max_length is not None and length > limits.max_length:
        raise FieldError(path, f"at most {limits.max_length} {noun}", f"{length}")
    if limits.min_length is not None and length < limits.min_length:
        raise FieldError(path, f"at least {limits.min_length} {noun}", f"{length}")


def describe_range(limits: Limits, noun: str) -> str:
    """Return, for example, ``a number in [0, 3] m``."""
    unit = f" {limits.unit}" if limits.unit else ""
    if limits.ge is None and limits.le is None:
        return noun + unit
    low = "-inf" if limits.ge is None else f"{limits.ge}"
    high = "inf" if limits.le is None else f"{limits.le}"
    return f"{noun} in [{low}, {high}]{unit}"


def _read_float(bare: Any, limits: Limits, value: object, path: str) -> float:
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        raise FieldError(path, describe_range(limits, "a number"), shorten(value))
    try:
        number = float(value)
    except OverflowError:
        raise FieldError(path, describe_range(limits, "a number"), "an integer beyond float range") from None
    if not math.isfinite(number) or not _in_range(limits, number):
        raise FieldError(path, describe_range(limits, "a number"), shorten(value))
    return number


def _read_int(bare: Any, limits: Limits, value: object, path: str) -> int:
    if isinstance(value, bool) or not isinstance(value, int):
        raise FieldError(path, describe_range(limits, "an integer"), shorten(value))
    if not -(2**63) <= value < 2**64 or not _in_range(limits, value):
        raise FieldError(path, describe_range(limits, "an integer"), shorten(value))
    return value


def _in_range(limits: Limits, value: float) -> bool:
    return (limits.ge is None or value >= limits.ge) and (limits.le is None or value <= limits.le)


def _read_bool(bare: Any, limits: Limits, value: object, path: str) -> bool:
    if not isinstance(value, bool):
        raise FieldError(path, "true or false", shorten(value))
    return value


def _read_str(bare: Any, limits: Limits, value: object, path: str) -> str:
    if not isinstance(value, str):
        raise FieldError(path, "a string", shorten(value))
    _check_length(limits, len(value), "characters", path)
    if limits.pattern is not None and re.fullmatch(limits.pattern, value) is None:
        raise FieldError(path, f"a string that matches {limits.pattern}", shorten(value))
    return value


def _read_any(bare: Any, limits: Limits, value: object, path: str) -> Any:
    return value


_SCALARS = {float: _read_float, int: _read_int, bool: _read_bool, str: _read_str, Any: _read_any}
_NOUNS = {float: "a number", int: "an integer", bool: "true, false", str: "a string"}
