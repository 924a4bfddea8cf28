"""Strict reading: what fits comes through unchanged, what does not is named with path, expectation and value."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, Any, Literal

import pytest

from scene_description import FieldError, Limits, from_mapping, to_mapping
from scene_description.strict import describe_range, read_value, shorten


@dataclass(frozen=True, kw_only=True)
class Lens:
    fov_rad: Annotated[float, Limits(ge=0.1, le=3.0, unit="rad")]
    name: Annotated[str, Limits(min_length=1, max_length=5, pattern="[a-z]+")] = "plain"


@dataclass(frozen=True, kw_only=True)
class Rig:
    lenses: Annotated[tuple[Lens, ...], Limits(min_length=1, max_length=3)]
    size: tuple[int, float]
    mode: Literal["left", "right"] = "left"
    gain: Annotated[int, Limits(ge=0, le=9)] | None = None
    weights: Annotated[Mapping[str, float], Limits(max_length=2)]
    on: bool = True


GOOD: dict[str, Any] = {"lenses": [{"fov_rad": 1, "name": "wide"}], "size": [3, 2.5], "gain": 4, "weights": {"a": 0.5}, "mode": "right"}


def changed(**changes: Any) -> dict[str, Any]:
    return {**GOOD, **changes}


def test_reads_nested_types_and_defaults() -> None:
    rig = from_mapping(Rig, GOOD)
    assert rig == Rig(lenses=(Lens(fov_rad=1.0, name="wide"),), size=(3, 2.5), gain=4, weights={"a": 0.5}, mode="right", on=True)
    assert isinstance(rig.lenses[0].fov_rad, float)
    assert from_mapping(Rig, to_mapping(rig)) == rig


def test_leaves_out_none_when_writing() -> None:
    assert to_mapping(from_mapping(Rig, changed(gain=None))) == {
        "lenses": [{"fov_rad": 1.0, "name": "wide"}], "size": [3, 2.5], "mode": "right", "weights": {"a": 0.5}, "on": True
    }  # fmt: skip


@pytest.mark.parametrize(
    ("data", "path", "expected", "got"),
    [
        ([], "", "a mapping (Rig)", "[]"),
        (changed(zoom=1), "zoom", "one of gain, lenses, mode, on, size, weights", "an unknown key"),
        ({k: v for k, v in GOOD.items() if k != "size"}, "size", "a value", "nothing (the key is missing)"),
        (changed(lenses=[]), "lenses", "at least 1 items", "0"),
        (changed(lenses=[{"fov_rad": 1}] * 4), "lenses", "at most 3 items", "4"),
        (changed(lenses="wide"), "lenses", "a list", "'wide'"),
        (changed(lenses=[7]), "lenses[0]", "a mapping (Lens)", "7"),
        (changed(lenses=[{"fov_rad": 9.0}]), "lenses[0].fov_rad", "a number in [0.1, 3.0] rad", "9.0"),
        (changed(lenses=[{"fov_rad": float("nan")}]), "lenses[0].fov_rad", "a number in [0.1, 3.0] rad", "nan"),
        (changed(lenses=[{"fov_rad": True}]), "lenses[0].fov_rad", "a number in [0.1, 3.0] rad", "True"),
        (changed(lenses=[{"fov_rad": "1"}]), "lenses[0].fov_rad", "a number in [0.1, 3.0] rad", "'1'"),
        (changed(lenses=[{"fov_rad": 10**400}]), "lenses[0].fov_rad", "a number in [0.1, 3.0] rad", "an integer beyond float range"),
        (changed(lenses=[{"fov_rad": 1, "name": ""}]), "lenses[0].name", "at least 1 characters", "0"),
        (changed(lenses=[{"fov_rad": 1, "name": "a b"}]), "lenses[0].name", "a string that matches [a-z]+", "'a b'"),
        (changed(lenses=[{"fov_rad": 1, "name": "wide\n"}]), "lenses[0].name", "a string that matches [a-z]+", "'wide\\n'"),
        (changed(size=[1, 2, 3]), "size", "2 items", "3"),
        (changed(size=[1.0, 2]), "size[0]", "an integer", "1.0"),
        (changed(size=[2**64, 2]), "size[0]", "an integer", "18446744073709551616"),
        (changed(size=[1, float("inf")]), "size[1]", "a number", "inf"),
        (changed(mode="up"), "mode", "one of 'left', 'right'", "'up'"),
        (changed(mode=["left"]), "mode", "one of 'left', 'right'", "['left']"),
        (changed(gain=10), "gain", "an integer in [0, 9]", "10"),
        (changed(on=1), "on", "true or false", "1"),
        (changed(weights=[1]), "weights", "a mapping", "[1]"),
        (changed(weights={"a": "x"}), "weights.a", "a number", "'x'"),
        (changed(weights={1: 2.0}), "weights", "keys that are strings", "1"),
        (changed(weights={"a": 1, "b": 2, "c": 3}), "weights", "at most 2 keys", "3"),
    ],
)
def test_refuses_with_path_expected_and_got(data: object, path: str, expected: str, got: str) -> None:
    with pytest.raises(FieldError) as refused:
        from_mapping(Rig, data)
    assert (refused.value.path, refused.value.expected, refused.value.got) == (path, expected, got)
    assert str(refused.value) == f"{path or 'document'}: expected {expected}, got {got}"


def test_path_begins_where_the_caller_says() -> None:
    with pytest.raises(FieldError, match=r"^camera\.fov_rad: expected a value, got nothing"):
        from_mapping(Lens, {}, "camera")


@pytest.mark.parametrize("key", ["two\nlines", "bell\x07", "half\ud800", "x" * 10_000])
def test_messages_stay_one_short_printable_line(key: str) -> None:
    with pytest.raises(FieldError) as refused:
        from_mapping(Lens, {key: 1})
    assert str(refused.value).isprintable()
    assert len(refused.value.path) <= 80


def test_values_in_messages_are_cut() -> None:
    nested: list[Any] = []
    for _ in range(100_000):
        nested = [nested]
    assert shorten(nested) == "list of 1"
    assert shorten([0] * 9) == "list of 9"
    assert shorten({"a": 1}) == "{'a': 1}"
    assert len(shorten("x" * 1000)) == 60
    while nested:
        nested = nested[0]


@pytest.mark.parametrize(
    ("limits", "text"),
    [
        (Limits(ge=0, le=3, unit="m"), "a number in [0, 3] m"),
        (Limits(ge=0), "a number in [0, inf]"),
        (Limits(le=3), "a number in [-inf, 3]"),
        (Limits(unit="s"), "a number s"),
    ],
)
def test_describes_ranges(limits: Limits, text: str) -> None:
    assert describe_range(limits, "a number") == text


@pytest.mark.parametrize(
    ("annotation", "wanted"), [(Literal["near", "far"], "one of 'near', 'far'"), (Literal["far", "near"], "one of 'far', 'near'")]
)
def test_literals_in_another_order_are_told_in_their_own(annotation: Any, wanted: str) -> None:
    """``Literal`` compares without order."""
    with pytest.raises(FieldError, match=f"expected {wanted}, got 'out'"):
        read_value(annotation, "out", "field")
