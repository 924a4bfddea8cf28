"""The user's own models: what a catalogue's file says of them, and what reading them adds."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Annotated, Literal

from scene_description.strict import Limits
from scene_description.types import Axis, FilePath, FileReading, Length, Material, Name

Odds = Annotated[float, Limits(ge=0.0, le=1e6)]
Families = Annotated[Mapping[str, Odds], Limits(min_length=1)]


@dataclass(frozen=True, slots=True, kw_only=True)
class CatalogSurface:
    """A top that carries other things: its height as fraction of the model's height plus metres, and its inset from the edges."""

    height_fraction: Annotated[float, Limits(ge=0.0, le=1.0)] = 0.0
    height_m: Annotated[float, Limits(ge=0.0, le=10.0, unit="m")] = 0.0
    inset_m: Annotated[float, Limits(ge=0.0, le=1.0, unit="m")] = 0.0


@dataclass(frozen=True, slots=True, kw_only=True)
class CatalogEntry:
    """One model as ``catalog.yaml`` has it.

    ``front`` and ``up`` are axes of the file, ``unit_m`` the length of its unit.  ``scale``: ``stretch`` to any size that the grammar
    draws, ``uniform``ly to the drawn length of its longest side, or ``fixed`` at its own size.  ``odds`` are held against those of the
    other models of the category and of its procedural styles.  ``split`` and ``rename`` make parts (see ``FileReading``).  ``materials``:
    the ``file``'s own, or ``sample`` ours by ``families`` (part -> family -> odds, ``*`` for the rest; else as the category's part of that
    name).  ``surfaces`` replaces the category's tops.
    """

    file: FilePath
    category: Name
    front: Axis | None = None
    up: Axis | None = None
    unit_m: Annotated[float, Limits(ge=1e-6, le=1e6, unit="m")] = 1.0
    scale: Literal["stretch", "uniform", "fixed"] = "stretch"
    odds: Odds = 1.0
    split: Literal["nodes", "materials", "none"] = "nodes"
    rename: Annotated[Mapping[str, Name], Limits(max_length=256)] = field(default_factory=dict)
    materials: Literal["file", "sample"] = "file"
    families: Annotated[Mapping[str, Families], Limits(max_length=64)] = field(default_factory=dict)
    surfaces: Annotated[tuple[CatalogSurface, ...], Limits(max_length=32)] | None = None
    note: Annotated[str, Limits(max_length=1000)] = ""

    @property
    def reading(self) -> FileReading:
        """How the file becomes parts."""
        return FileReading(front=self.front, up=self.up, split=self.split, rename=self.rename, own_materials=self.materials == "file")


@dataclass(frozen=True, slots=True, kw_only=True)
class CatalogList:
    """``catalog.yaml``: the models, and by category the odds of all procedural styles together (1 where absent, 0: files only)."""

    models: Annotated[tuple[CatalogEntry, ...], Limits(min_length=1, max_length=2000)]
    procedural: Annotated[Mapping[Name, Odds], Limits(max_length=1000)] = field(default_factory=dict)


@dataclass(frozen=True, slots=True, kw_only=True)
class CatalogModel:
    """A model that has been read: its own size (depth, width, height), and its parts with the file's materials."""

    entry: CatalogEntry
    size_m: tuple[Length, Length, Length]
    parts: Mapping[str, Material]


@dataclass(frozen=True, slots=True, kw_only=True)
class Catalog:
    """The models of a catalogue that can be used, and the odds of procedural styles."""

    models: tuple[CatalogModel, ...] = ()
    procedural: Mapping[str, float] = field(default_factory=dict)
