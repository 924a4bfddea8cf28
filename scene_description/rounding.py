"""Numbers of a description with as many digits as mean something."""

from collections.abc import Mapping
from dataclasses import is_dataclass
from typing import Any, TypeVar, cast

from scene_description.strict import field_names

Value = TypeVar("Value")

_DIGITS, _DECIMALS = 12, 14


def rounded(value: Value) -> Value:
    """Return a description whose numbers have 12 significant digits and 14 decimals at most, and none is -0.

    The last digits depend on the C library, on the version of numpy and scipy and on that of Python, whose ``sum`` is one of them; what is
    rendered of a description must not.  A rounded one stays as it is.
    """
    return cast(Value, _rounded(value))


def _rounded(value: Any) -> Any:
    if isinstance(value, float):
        return round(float(f"{value:.{_DIGITS}g}"), _DECIMALS) + 0.0
    if isinstance(value, (str, int)) or value is None:
        return value
    if isinstance(value, tuple):
        return tuple(map(_rounded, value))
    if isinstance(value, Mapping):
        return {key: _rounded(item) for key, item in value.items()}
    if is_dataclass(value) and not isinstance(value, type):
        return type(value)(**{name: _rounded(getattr(value, name)) for name in field_names(type(value))})
    return value
