"""Values of changes: read, checked, refused in one line."""

from collections.abc import Collection
from typing import Annotated

from grammar.counterfactual.change import Change, ChangeError
from scene_description import FieldError, Limits
from scene_description.strict import read_value, shorten


def read_as(change: Change, annotation: object) -> object:
    """Return a change's value as an annotation of :mod:`scene_description.strict` asks.

    Raises:
        ChangeError: it does not fit.
    """
    try:
        return read_value(annotation, change.value, "value")
    except FieldError as error:
        raise ChangeError(f"{change}: {error}") from None


def number(change: Change, low: float, high: float, unit: str = "") -> float:
    """Return a change's value as a number within bounds.

    Raises:
        ChangeError: it is none.
    """
    value = read_as(change, Annotated[float, Limits(ge=low, le=high, unit=unit)])
    assert isinstance(value, float)
    return value


def whole(change: Change, low: int, high: int) -> int:
    """Return a change's value as a whole number within bounds; false counts as 0.

    Raises:
        ChangeError: it is none.
    """
    if isinstance(change.value, bool) or not isinstance(change.value, int) or not low <= change.value <= high:
        raise ChangeError(f"{change}: value: expected a whole number in [{low}, {high}], got {shorten(change.value)}")
    return change.value


def truth(change: Change) -> bool:
    """Return a change's value as true or false.

    Raises:
        ChangeError: it is neither.
    """
    value = read_as(change, bool)
    return value is True


def one_of(change: Change, known: Collection[str], what: str) -> str:
    """Return a change's value as one of the names that are known.

    Raises:
        ChangeError: it is not among them; the line names them.
    """
    if not isinstance(change.value, str) or change.value not in known:
        raise ChangeError(f"{change}: value: expected {what} ({', '.join(sorted(known))}), got {shorten(change.value)}")
    return change.value
