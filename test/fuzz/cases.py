"""A case of fuzzing: a reader of the table, one of its samples, and what was done to that; made again from seed and number alone."""

from __future__ import annotations

import json
import random
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from importlib import import_module
from pathlib import Path
from typing import Any, Literal, NamedTuple

from fuzz.mutations import OF_BYTES, OF_TEXT, OF_YAML, spoil, spoil_tree

from scene_description import SceneSynthError
from scene_description.yaml_text import load_yaml

Kind = Literal["json", "yaml", "text", "bytes"]
TABLES = {"json": (*OF_TEXT, *OF_BYTES), "yaml": (*OF_YAML, *OF_TEXT, *OF_BYTES), "text": (*OF_TEXT, *OF_BYTES), "bytes": OF_BYTES}


@dataclass(frozen=True, kw_only=True)
class Reader:
    """A row of the table.

    kind: which mutations fit: JSON and YAML are spoiled as trees, too.
    make: returns valid samples, made by the program.
    read: reads a case; gets a folder of its own for what it needs on the disk.
    refusals: what it may raise, with a text of one line.
    tree_of, with_tree: for samples that hold a JSON tree in another form: the tree of one, and one with the text of another tree.
    share: of the cases; below 1 for a reader that takes its time.
    """

    kind: Kind
    make: Callable[[], Sequence[bytes]]
    read: Callable[[bytes, Path], object]
    refusals: tuple[type[BaseException], ...] = (SceneSynthError,)
    tree_of: Callable[[bytes], Any] | None = None
    with_tree: Callable[[bytes, bytes], bytes] = field(default=lambda sample, text: text)
    share: float = 1.0

    @cached_property
    def samples(self) -> tuple[bytes, ...]:
        return tuple(self.make())

    @cached_property
    def trees(self) -> tuple[Any, ...]:
        """The trees that the samples stand for, None where they are of another kind."""
        plain = {"json": json.loads, "yaml": lambda text: load_yaml(text, "sample")}.get(self.kind, lambda sample: None)
        return tuple((self.tree_of or plain)(sample) for sample in self.samples)


class Case(NamedTuple):
    """What a reader gets, and the names of the mutations that made it."""

    data: bytes
    mutations: tuple[str, ...]


def readers_of(table: str) -> dict[str, Reader]:
    """Return the table that ``module:name`` names."""
    module, _, name = table.partition(":")
    found: dict[str, Reader] = getattr(import_module(module), name)
    return found


def make_case(name: str, reader: Reader, seed: int, number: int) -> Case:
    """Return a case of a reader; the same for the same seed and number."""
    rng = random.Random(f"{seed}/{name}/{number}")
    place = rng.randrange(len(reader.samples))
    data, names = reader.samples[place], []
    tree = reader.trees[place] if rng.random() < 0.6 else None
    if tree is not None:
        text, names = spoil_tree(tree, rng)
        data = reader.with_tree(data, text)
    if not names or rng.random() < 0.2:
        data, more = spoil(data, TABLES[reader.kind], rng)
        names += more
    return Case(data, tuple(names))
