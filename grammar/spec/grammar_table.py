"""The grammars of a synthesizer by room type: those that come with the program are read when a room asks for them."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Mapping

from grammar.spec.grammar_file import read_room_type
from grammar.spec.request import GrammarSet
from grammar.spec.rules import Grammar


class GrammarTable(Mapping[str, Grammar]):
    """Room type -> grammar.

    Args:
        names: room types that come with the program.
        grammar_set: which of their grammars is meant.
        categories: names of the known object categories.
        own: grammars that have been read, in place of those of the same room types, or besides.

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
