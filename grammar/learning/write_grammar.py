"""A learned grammar as YAML, with a comment at every part that says whether it was learned and from how much."""

import dataclasses
import json
import re
from collections.abc import Mapping, Sequence
from typing import Any

from grammar.spec.rules import Grammar

_BLOCKS = {"room": 1, "openings": 2, "nodes": 1, "objects": 2, "weights": 1, "moves": 1, "schedule": 1, "budget": 1, "validity": 1}
"""Sections and down to which level each of their keys gets a line of its own."""

_TAKEN_APART = {**dict.fromkeys(_BLOCKS, 1), "openings": 2, "nodes": 2, "objects": 2}
"""Sections and how many levels of them a file that extends another one repeats only where they differ."""

_COMMENTED = ("room", "nodes", "objects", "weights")
_BARE = re.compile(r"[a-z][a-z0-9_]*")
_WORDS = {"null", "true", "false", "yes", "no", "on", "off", "y", "n"}


def grammar_yaml(
    grammar: Grammar, header: Sequence[str], counts: Mapping[str, float], base: Grammar | None = None, extends: str = ""
) -> str:
    """Return a grammar file that reads back to ``grammar`` up to rounding.

    Args:
        grammar: what to write.
        header: lines of the comment at the top.
        counts: path -> number of observations of what was learned; the rest is marked as the base's where the file does not extend that.
        base: where it is given, only what differs from it is written.
        extends: name of the file of ``base``.
    """
    data = _plain(grammar)
    lines = [f"# {line}".rstrip() for line in header]
    if base is not None:
        data = _differences(data, _plain(base), grammar)
        lines += ["", f"extends: {extends}"]
    for name, value in data.items():
        lines.append("")
        if name in _BLOCKS:
            lines.append(f"{name}:")
            _block(lines, value, 1, _BLOCKS[name], name, counts, "" if base is not None else "  # base")
        else:
            lines.append(f"{name}: {_flow(value)}")
    return "\n".join(lines) + "\n"


class _Whole(dict[str, Any]):
    """A mapping that is written with the tag by which it takes the place of the base's."""


def _differences(data: Mapping[str, Any], before: Mapping[str, Any], new: Any, path: tuple[str, ...] = ()) -> dict[str, Any]:
    """Return what a file that extends another one has to say.

    Args:
        data: a mapping or dataclass of the grammar as it is written, without values at their defaults.
        before: that of the base.
        new: the mapping or dataclass itself.
        path: where it is in the grammar.
    """
    found: dict[str, Any] = {}
    for key in [*data, *(key for key in before if key not in data)]:
        if key not in data:
            found[key] = _plain(getattr(new, key))  # at its default, other than in the base
        elif key not in before:
            found[key] = data[key]
        elif not _same(data[key], before[key]):
            if len(path) < _TAKEN_APART.get((*path, key)[0], 0):
                inner = new[key] if isinstance(new, Mapping) else getattr(new, key)
                found[key] = _differences(data[key], before[key], inner, (*path, key))
            else:
                found[key] = data[key] if _same(_merged(before[key], data[key]), data[key]) else _Whole(data[key])
    return found


def _same(one: Any, other: Any) -> bool:
    """Return whether values are equal, the order of mappings' keys included."""
    if isinstance(one, dict) and isinstance(other, dict):
        return [*one] == [*other] and all(_same(value, other[key]) for key, value in one.items())
    return bool(one == other)


def _merged(base: Any, top: Any) -> Any:
    """Return what :mod:`grammar.spec.grammar_file` makes of a value and that which the file it extends has in its place."""
    return (
        {**base, **{key: _merged(base.get(key), value) for key, value in top.items()}}
        if isinstance(base, dict) and isinstance(top, dict)
        else top
    )


def _block(
    lines: list[str], data: Mapping[str, Any], depth: int, levels: int, path: str, counts: Mapping[str, float], unlearned: str
) -> None:
    for key, value in data.items():
        here = f"{path}.{key}"
        if levels > depth and isinstance(value, dict):
            lines.append(f"{'  ' * depth}{key}:")
            _block(lines, value, depth + 1, levels, here, counts, unlearned)
        else:
            lines.append(f"{'  ' * depth}{key}: {_flow(value)}{_comment(here, counts, unlearned)}")


def _comment(path: str, counts: Mapping[str, float], unlearned: str) -> str:
    section, _, rest = path.partition(".")
    if section not in _COMMENTED:
        return ""
    if path in counts:
        count = counts[path]
        return f"  # learned from {count:.0f}" if abs(count - round(count)) < 0.05 else f"  # learned from {count:.1f}"
    own = ("category", "mount", "access", "reach_any", "view_depth_m", "low_m", "high_m", "room_centre")
    return "" if rest.rpartition(".")[2] in own else unlearned


def _plain(value: Any, name: str = "") -> Any:
    """Return dataclasses as dicts; values at their defaults are left out, None is kept where it is not the default."""
    if dataclasses.is_dataclass(value):
        pairs = [(f.name, getattr(value, f.name), f.default) for f in dataclasses.fields(value)]
        return {key: _plain(item, key) for key, item, default in pairs if default is dataclasses.MISSING or item != default}
    if isinstance(value, Mapping):
        items = {key: _plain(item) for key, item in value.items()}
        return _summing_to_one(items) if name in ("cores", "supporters") else items
    if isinstance(value, (tuple, list)):
        items_ = [_plain(item) for item in value]
        if name == "multiplicity":
            return list(_summing_to_one(dict(enumerate(items_))).values())
        if items_ and all(isinstance(item, dict) for item in items_) and any("probability" in item for item in items_):
            shares = _summing_to_one({i: item.get("probability", 1.0) for i, item in enumerate(items_)})
            return [item | {"probability": shares[i]} for i, item in enumerate(items_)]
        return items_
    return value


def _summing_to_one(shares: dict[Any, float]) -> dict[Any, float]:
    """Return probabilities rounded to five decimals whose sum is 1 as exactly as decimals allow."""
    rounded = {key: round(value, 5) for key, value in shares.items()}
    largest = max(rounded, key=lambda key: rounded[key])
    rounded[largest] = round(rounded[largest] + 1.0 - sum(rounded.values()), 5)
    return rounded


def _flow(value: Any) -> str:
    if isinstance(value, dict):
        return (
            ("!whole " if isinstance(value, _Whole) else "") + "{" + ", ".join(f"{key}: {_flow(item)}" for key, item in value.items()) + "}"
        )
    if isinstance(value, list):
        return "[" + ", ".join(_flow(item) for item in value) + "]"
    if isinstance(value, str):
        return value if _BARE.fullmatch(value) and value not in _WORDS else json.dumps(value)
    if isinstance(value, float):
        return f"{value:.6g}" if abs(value) >= 1.0 or value == 0.0 else f"{value:.5f}".rstrip("0").rstrip(".") or "0"
    return json.dumps(value)
