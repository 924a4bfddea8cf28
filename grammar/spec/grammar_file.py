"""Grammar files: YAML -> :class:`grammar.spec.rules.Grammar`, strict.

A file may name another one in ``extends``, beside it or, where there is none, one that comes with the program; its own keys then win over
those, mapping by mapping, lists, numbers and mappings with the tag ``!whole`` whole.  So what all room types share is written once.

A section ``categories`` has sizes of categories, for the objects whose rules give none of their own.
"""

import functools
import re
from collections.abc import Collection, Iterable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from grammar.spec.check import check_grammar
from grammar.spec.request import GRAMMAR_SETS, GrammarSet
from grammar.spec.room_rules import RoomNeeds
from grammar.spec.rules import Grammar, GrammarError
from scene_description import FieldError, error_line, from_mapping
from scene_description.share import config_path
from scene_description.strict import shorten
from scene_description.yaml_text import read_yaml

_NEEDS: dict[str, RoomNeeds] = {}
"""Room type -> what its rooms need, of those asked for or read so far: reading a file takes a tenth of a second."""
_OF_CATEGORIES = ("sizes", "low_m", "high_m")
"""Fields that a rule may leave to its category; none of them has a value of its own where both leave it out."""


class _Whole(dict[str, Any]):
    """A mapping that takes the place of the one below it, keys and their order."""


@dataclass(frozen=True, slots=True, kw_only=True)
class _Needed:
    needs: RoomNeeds


def read_grammar(path: Path, categories: Collection[str]) -> Grammar:
    """Read and check the grammar of one room type; ``categories``: names of the known object categories.

    Raises:
        GrammarError: one line with the file and the path of the field that does not fit.
    """
    data = _with_sizes(path, _read_extended(path, ()))
    try:
        needs = _needs(data)
        grammar = from_mapping(Grammar, {key: value for key, value in data.items() if key != "needs"})
        check_grammar(grammar, categories)
    except FieldError as error:
        raise GrammarError(f"{path}: {error}") from None
    if path == _shipped(path.stem):
        _NEEDS[path.stem] = needs
    return grammar


def _needs(data: Mapping[str, Any]) -> RoomNeeds:
    return from_mapping(_Needed, {"needs": data.get("needs", {})}).needs


def _shipped(room_type: str) -> Path:
    return config_path("grammars") / f"{room_type}.yaml"


def room_needs(room_type: str) -> RoomNeeds:
    """Return what rooms of a type are expected to have; of a type that does not come with the program nothing."""
    if room_type not in _NEEDS:
        _NEEDS[room_type] = _needs(_read_extended(_shipped(room_type), ())) if room_type in room_types() else RoomNeeds()
    return _NEEDS[room_type]


def room_types() -> tuple[str, ...]:
    """Return the names of the room types whose grammars come with the program."""
    folder = config_path("grammars")
    return tuple(sorted(file.stem for file in folder.glob("*.yaml") if file.stem != "base"))


def learned_types() -> tuple[str, ...]:
    """Return the names of the room types that have a grammar learned from real rooms beside the one written by hand."""
    return tuple(sorted(file.stem for file in config_path("learned").glob("*.yaml")))


def read_room_type(room_type: str, categories: Collection[str], grammar_set: GrammarSet = "by_hand") -> Grammar:
    """Read the grammar of a room type that comes with the program.

    ``grammar_set``: "learned" takes the one learned from real rooms where there is one, "by_hand" the one written by hand.

    Raises:
        GrammarError: there is none of that name, or its file does not fit.
    """
    known = room_types()
    if room_type not in known or not re.fullmatch(r"[a-z0-9_]+", room_type):
        raise GrammarError(f"room type: expected one of {', '.join(known)}, got {room_type!r}")
    if grammar_set not in GRAMMAR_SETS:
        raise GrammarError(f"grammar set: expected one of {', '.join(GRAMMAR_SETS)}, got {grammar_set!r}")
    folder = "learned" if grammar_set == "learned" and room_type in learned_types() else "grammars"
    return read_grammar(config_path(f"{folder}/{room_type}.yaml"), categories)


@functools.lru_cache(maxsize=64)
def _read_once(path: Path, modified_ns: int) -> Any:
    """Return the content of a file, which several grammars may share and nobody changes."""
    return read_yaml(path, GrammarError, {"!whole": _Whole})


def _read_extended(path: Path, above: tuple[Path, ...]) -> Mapping[str, Any]:
    if path in above:
        raise GrammarError(f"{path}: extends: expected files without a cycle, got {' -> '.join(p.name for p in (*above, path))}")
    try:
        data = _read_once(path, path.stat().st_mtime_ns)
    except OSError as error:
        raise GrammarError(error_line(error)) from None
    if not isinstance(data, Mapping):
        raise GrammarError(f"{path}: document: expected a mapping, got {type(data).__name__}")
    if "extends" not in data:
        return data
    name = data["extends"]
    if not isinstance(name, str) or not re.fullmatch(r"(?!\.{1,2}$)[A-Za-z0-9_.-]{1,100}", name):
        raise GrammarError(f"{path}: extends: expected the name of a file in the same folder, got {shorten(name)}")
    base = _read_extended(_extended(path, name), (*above, path))
    merged: Mapping[str, Any] = _merge(base, {key: value for key, value in data.items() if key != "extends"})
    return merged


def grammar_sources(path: Path) -> list[Path]:
    """Return a grammar's file and those that it extends, one after the other.

    Raises:
        GrammarError: one of them cannot be read.
    """
    sources = [path]
    _read_extended(path, ())  # which refuses what does not fit, a cycle, say
    while isinstance(name := _read_once(sources[-1], sources[-1].stat().st_mtime_ns).get("extends"), str):
        sources.append(_extended(sources[-1], name))
    return sources


def _with_sizes(path: Path, data: Mapping[str, Any]) -> Mapping[str, Any]:
    """Return a grammar's content with the sizes of its section ``categories`` in the rules of objects that give none."""
    categories, objects = data.get("categories", {}), data.get("objects")
    if not isinstance(categories, Mapping):
        raise GrammarError(f"{path}: categories: expected a mapping, got {type(categories).__name__}")
    for name, sizes in categories.items():
        if not isinstance(sizes, Mapping) or not set(_OF_CATEGORIES).issuperset(sizes):
            raise GrammarError(f"{path}: categories.{name}: expected a mapping with {', '.join(_OF_CATEGORIES)}, got {shorten(sizes)}")
    content = {key: value for key, value in data.items() if key != "categories"}
    if isinstance(objects, Mapping):
        content["objects"] = {symbol: _sized(rule, categories) for symbol, rule in objects.items()}
    return content


def _sized(rule: Any, categories: Mapping[str, Any]) -> Any:
    name = rule.get("category") if isinstance(rule, Mapping) else None
    return {**categories[name], **rule} if isinstance(name, str) and name in categories else rule


def _extended(path: Path, name: str) -> Path:
    """Return the file that ``path`` extends: another one of its folder, else one of those that come with the program."""
    beside, shipped = path.with_name(name), {file.name: file for file in sorted(config_path("grammars").glob("*.yaml"))}
    # a file may extend the shipped one of its own name
    if beside.exists() and (beside != path or name not in shipped):
        return beside
    if name in shipped:
        return shipped[name]
    known = ", ".join(shipped)
    raise GrammarError(f"{path}: extends: expected a file in the same folder, or one of {known}, got {name!r}; check the name")


def _merge(base: Any, top: Any) -> Any:
    if not isinstance(base, Mapping) or not isinstance(top, Mapping) or isinstance(top, _Whole):
        return top
    return {**base, **{key: _merge(base.get(key), value) for key, value in top.items()}}


class GrammarTable(Mapping[str, Grammar]):
    """Room type -> grammar, of those that come with the program and of ``own``, which take the place of those of the same names.

    Looking a room type up raises GrammarError where its file does not fit; one line with file and field.
    """

    def __init__(self, names: Iterable[str], grammar_set: GrammarSet, categories: Collection[str], own: Mapping[str, Grammar]) -> None:
        self._names = tuple(dict.fromkeys((*names, *own)))
        self._grammar_set, self._categories = grammar_set, categories
        self._read = dict(own)

    def __getitem__(self, name: str) -> Grammar:
        if name not in self._names:
            raise KeyError(name)
        if name not in self._read:
            self._read[name] = read_room_type(name, self._categories, self._grammar_set)
        return self._read[name]

    def __contains__(self, name: object) -> bool:
        return name in self._names

    def __iter__(self) -> Iterator[str]:
        return iter(self._names)

    def __len__(self) -> int:
        return len(self._names)
