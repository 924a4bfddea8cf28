"""YAML of unknown origin, read within bounds of time and memory, and the YAML of our own files.  The only file that imports PyYAML.

Files, parameters, looks, and the metadata and QoS texts of bags are all read by :func:`load_yaml`.  It makes values from the parser's
events, one after the other, so that nothing grows beyond what it counts: an alias costs as much as all that it repeats, nesting has a
greatest depth, a number a greatest length.
"""

import re
from collections.abc import Callable, Hashable, Mapping
from pathlib import Path
from typing import Any, NamedTuple, TypeAlias

import yaml

from scene_description.errors import SceneSynthError, error_line, read_at_most

MAX_BYTES = 16 * 2**20
MAX_VALUES = 300_000
"""Keys and values of a document; a text counts once more for every hundred characters, an alias as what it repeats."""
MAX_DEPTH = 100
MAX_NUMBER_LENGTH = 100
_CHARACTERS = 100

Tags: TypeAlias = Mapping[str, Callable[[dict[Any, Any]], Any]]
"""Tag of a mapping, as in ``!whole {a: 1}`` -> what makes its value from a dict."""

_MERGE = object()
"""Stands for the key ``<<``, whose mapping, or list of mappings, gives what the mapping around it does not say itself."""
_STANDARD = "tag:yaml.org,2002:"
_FLOAT = re.compile(r"[-+]?(\.[0-9]+|[0-9]+(\.[0-9]*)?)[eE][-+]?[0-9]+\Z")
"""Numbers with an exponent as YAML 1.2 has them; YAML 1.1 asks for a point and a sign, so that 1e-9 would be a text."""


def _with_floats(base: Any) -> Any:
    """Return a loader or a dumper to which such numbers are numbers, and texts that look like them are quoted."""
    kind: Any = type(base.__name__, (base,), {})
    kind.add_implicit_resolver(f"{_STANDARD}float", _FLOAT, list("-+.0123456789"))
    return kind


_Loader: Any = _with_floats(getattr(yaml, "CSafeLoader", yaml.SafeLoader))
"""Parses and says what a scalar is; that of libyaml, which not every PyYAML has, is eight times as fast."""
_DUMPER = _with_floats(yaml.SafeDumper)
_FAST_DUMPER: Any = _with_floats(getattr(yaml, "CSafeDumper", yaml.SafeDumper))
_SCALARS: Mapping[str, Callable[[Any, yaml.ScalarNode], Any]] = {
    f"{_STANDARD}null": lambda loader, node: None,
    f"{_STANDARD}bool": lambda loader, node: loader.construct_yaml_bool(node),
    f"{_STANDARD}int": lambda loader, node: loader.construct_yaml_int(node),
    f"{_STANDARD}float": lambda loader, node: loader.construct_yaml_float(node),
    f"{_STANDARD}str": lambda loader, node: node.value,
    f"{_STANDARD}timestamp": lambda loader, node: node.value,
    f"{_STANDARD}value": lambda loader, node: node.value,
    f"{_STANDARD}merge": lambda loader, node: _MERGE,
}
_NUMBERS = (f"{_STANDARD}int", f"{_STANDARD}float")


class YamlError(SceneSynthError):
    """A text that is no YAML of plain values, or goes beyond a bound; one line."""


class _Counted(NamedTuple):
    """A value and what it counts against the bound."""

    value: Any
    cost: int


def read_yaml(path: Path, error: type[SceneSynthError] = YamlError, tags: Tags | None = None) -> Any:
    """Return the content of a YAML file (:func:`load_yaml`).

    Raises:
        error: the file cannot be read, has more than ``MAX_BYTES``, or is no YAML of plain values; one line that begins with the path.
    """
    try:
        data = read_at_most(path, MAX_BYTES, error)
    except OSError as reason:
        raise error(error_line(reason)) from None
    return load_yaml(data, str(path), error, tags)


def load_yaml(text: str | bytes, where: str, error: type[SceneSynthError] = YamlError, tags: Tags | None = None) -> Any:
    """Return the plain value of a text, YAML 1.1 with the numbers of 1.2: None, booleans, numbers, texts, lists, dicts; dates stay texts.

    Args:
        text: one document; bytes are UTF-8.
        where: what the text is, with which an error begins.
        error: what is raised.
        tags: of mappings that mean something else; no others are allowed.

    Raises:
        error: it is no YAML, has a key twice or a tag that is not known, or is beyond a bound; one line with its place in the text.
    """
    if len(text) > MAX_BYTES:
        raise error(f"{where}: expected at most {MAX_BYTES} bytes of YAML, got more")
    try:
        return _Document(text.decode("utf-8-sig") if isinstance(text, bytes) else text, tags or {}).value()
    except yaml.YAMLError as reason:
        mark = getattr(reason, "problem_mark", None)
        place = f" line {mark.line + 1}, column {mark.column + 1}:" if mark else ""
        got = " ".join(str(getattr(reason, "problem", None) or "text that does not parse").split())
        raise error(f"{where}:{place} expected YAML, got {got[:160]}") from None
    except (ValueError, LookupError, ArithmeticError) as reason:  # text that is not Unicode, numbers that only look like some
        raise error(f"{where}: expected YAML, got {type(reason).__name__} ({error_line(reason)[:120]})") from None


def dump_yaml(value: object) -> str:
    """Return the YAML text of a plain value whose keys have 1 to 100 characters, the same with and without libyaml.

    libyaml and PyYAML's own emitter give printable ASCII the same form, and fold and escape other text differently; that is left to the
    latter, which takes ten times as long.
    """
    shown = repr(value)
    fast = shown.isascii() and "\\" not in shown
    return str(yaml.dump(value, Dumper=_FAST_DUMPER if fast else _DUMPER, sort_keys=False, allow_unicode=True))


def flow_yaml(value: object) -> str:
    """Return a plain value in the flow style of YAML, for example of a parameter."""
    return str(yaml.dump([value], Dumper=_DUMPER, default_flow_style=True, width=10**6)).strip()[1:-1]


class _Document:
    """One document that is being read."""

    def __init__(self, text: str, tags: Tags) -> None:
        self._loader = _Loader(text)
        self._tags = tags
        self._anchors: dict[str, _Counted] = {}
        self._cost = 0

    def value(self) -> Any:
        try:
            self._next()  # the stream's start
            if isinstance(self._next(), yaml.StreamEndEvent):
                return None
            value = self._read(self._next(), 1).value
            self._next()  # the document's end
            end = self._next()
            if not isinstance(end, yaml.StreamEndEvent):
                raise _fault("more than one document", end)
            return value
        finally:
            self._loader.dispose()

    def _next(self) -> Any:
        return self._loader.get_event()

    def _read(self, event: Any, depth: int) -> _Counted:
        """Return the value that begins with an event."""
        if isinstance(event, yaml.AliasEvent):
            name = str(event.anchor)
            if name not in self._anchors:
                raise _fault(f"alias '{name[:40]}' of nothing that ends before it", event)
            return self._count(self._anchors[name], event)
        before = self._cost
        self._count(_Counted(None, 1), event)
        if isinstance(event, yaml.ScalarEvent):
            value = self._scalar(event)
        elif depth > MAX_DEPTH:
            raise _fault(f"nesting deeper than {MAX_DEPTH}", event)
        elif isinstance(event, yaml.SequenceStartEvent):
            value = self._sequence(event, depth)
        else:
            value = self._mapping(event, depth)
        counted = _Counted(value, self._cost - before)
        if event.anchor is not None:
            self._anchors[event.anchor] = counted
        return counted

    def _count(self, counted: _Counted, event: Any) -> _Counted:
        self._cost += counted.cost
        if self._cost > MAX_VALUES:
            raise _fault(f"more than {MAX_VALUES} values, with those that aliases repeat", event)
        return counted

    def _scalar(self, event: Any) -> Any:
        text: str = event.value
        self._count(_Counted(None, len(text) // _CHARACTERS), event)
        tag: str = event.tag if event.tag not in (None, "!") else self._loader.resolve(yaml.ScalarNode, text, event.implicit)
        if tag not in _SCALARS:
            raise _fault(f"tag '{tag[:60]}', which means nothing here", event)
        if tag in _NUMBERS and len(text) > MAX_NUMBER_LENGTH:
            raise _fault(f"a number of {len(text)} characters", event)
        try:
            return _SCALARS[tag](self._loader, yaml.ScalarNode(tag, text))
        except (ValueError, LookupError, ArithmeticError):
            raise _fault(f"'{text[:60]}', which is no {tag.removeprefix(_STANDARD)}", event) from None

    def _sequence(self, event: Any, depth: int) -> list[Any]:
        self._check_tag(event, f"{_STANDARD}seq")
        items = []
        while not isinstance(item := self._next(), yaml.SequenceEndEvent):
            items.append(self._plain(self._read(item, depth + 1).value, item))
        return items

    def _mapping(self, event: Any, depth: int) -> Any:
        make = self._tags.get(event.tag)
        if make is None:
            self._check_tag(event, f"{_STANDARD}map")
        values: dict[Any, Any] = {}
        merged: dict[Any, Any] = {}
        while not isinstance(start := self._next(), yaml.MappingEndEvent):
            key = self._read(start, depth + 1).value
            below = self._next()
            value = self._plain(self._read(below, depth + 1).value, below)
            if key is _MERGE:
                sources = value if isinstance(value, list) else [value]
                if not all(isinstance(source, dict) for source in sources):
                    raise _fault("a value of << that is no mapping", below)
                for source in sources:
                    merged = {**source, **merged}
            elif not isinstance(key, Hashable) or key in values:
                raise _fault(f"key {repr(key)[:60]} twice" if isinstance(key, Hashable) else "a key that is no text or number", start)
            else:
                values[key] = value
        values = {**merged, **values}
        return values if make is None else make(values)

    def _plain(self, value: Any, event: Any) -> Any:
        if value is _MERGE:
            raise _fault("<< where a value should be", event)
        return value

    def _check_tag(self, event: Any, standard: str) -> None:
        if event.tag not in (None, "!", standard):
            raise _fault(f"tag '{event.tag[:60]}', which means nothing here", event)


def _fault(got: str, event: Any) -> yaml.MarkedYAMLError:
    return yaml.MarkedYAMLError(problem=got, problem_mark=event.start_mark)
