"""What every object category is: its semantic class, its collision boxes and its support surfaces."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal

from grammar.spec.object_rules import Access
from grammar.spec.rules import GrammarError
from scene_description import FieldError, Limits, from_mapping
from scene_description.labels import LABEL_ID
from scene_description.yaml_text import read_yaml

Offset = Annotated[float, Limits(ge=-10.0, le=10.0, unit="m")]
Fraction = Annotated[float, Limits(ge=0.0, le=1.0)]

Role = Literal[
    "seat", "pulled_up", "table", "store", "shelf", "wardrobe", "bed", "backed", "bedside", "screen", "shown", "switch", "drape", "curtain",
    "unit", "wall_unit", "sink", "hob", "hood", "fridge", "bathing", "basin", "mirror", "lounge", "low_table",
    "mat", "bath_mat", "floor_work", "machine", "vehicle", "towel", "hooks", "heater", "filler", "toilet", "paper", "pot", "dining", "desk",
    "wall_shelf",
]  # fmt: skip
"""How people use an object, as far as the checks of use ask for it; ``config/categories.yaml`` says what each stands for."""

BACK_GAP_M: Mapping[Role, float] = {"shelf": 0.1, "wardrobe": 0.1, "bed": 0.15, "backed": 0.15, "fridge": 0.15, "bathing": 0.08}
"""Roles of what stands with its back to a wall, and the gap behind it that a person would still leave."""

SIDE_GAP_M: Mapping[Role, float] = {"bathing": 0.12}
"""Roles of what stands in a corner, a side to another wall, and the gap beside it that is still left: real ones leave 0.12 m at most."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Solid:
    """One box of a compound, in its object's frame.

    Each bound is a fraction of the object's size plus metres.  Fractions count depth from the back, width from the right, height from the
    bottom.
    """

    low_fraction: tuple[Fraction, Fraction, Fraction] = (0.0, 0.0, 0.0)
    high_fraction: tuple[Fraction, Fraction, Fraction] = (1.0, 1.0, 1.0)
    low_m: tuple[Offset, Offset, Offset] = (0.0, 0.0, 0.0)
    high_m: tuple[Offset, Offset, Offset] = (0.0, 0.0, 0.0)


@dataclass(frozen=True, slots=True, kw_only=True)
class SupportSurface:
    """A horizontal surface that supports objects: its height (fraction of the owner's height plus metres) and its inset from the edges."""

    height_fraction: Fraction = 1.0
    height_m: Offset = 0.0
    inset_m: Annotated[float, Limits(ge=0.0, le=1.0, unit="m")] = 0.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Rest:
    """A seat, mattress or inner board that carries small things: fractions of depth, width and height, from back, right and bottom.

    It lies ``height_m`` above that fraction of the height.
    """

    depth: tuple[Fraction, Fraction] = (0.0, 1.0)
    width: tuple[Fraction, Fraction] = (0.0, 1.0)
    height: Fraction
    height_m: Offset = 0.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Category:
    """One category.  ``solids`` None stands for one box of the object's whole size.  An ``underlay`` lies under objects on the floor.

    ``surfaces`` carry what the grammar stands on them, ``rests`` only small things.  The layout keeps all else out of the whole box of what
    is ``open`` to its front, whatever its solids are.  ``roles`` say how people use it, for the checks of :mod:`grammar.checks.faults`.
    ``access`` is the space that people need where an object's rule names none.
    """

    label: str
    solids: Annotated[tuple[Solid, ...], Limits(max_length=32)] | None = None
    surfaces: Annotated[tuple[SupportSurface, ...], Limits(max_length=32)] = ()
    rests: Annotated[tuple[Rest, ...], Limits(max_length=8)] = ()
    underlay: bool = False
    open: bool = False
    roles: Annotated[tuple[Role, ...], Limits(max_length=8)] = ()
    access: Annotated[tuple[Access, ...], Limits(max_length=8)] = ()

    @property
    def back_gap_m(self) -> float:
        """Greatest gap between its back and a wall; infinite for what may stand anywhere."""
        return min((BACK_GAP_M[role] for role in self.roles if role in BACK_GAP_M), default=math.inf)

    @property
    def opens(self) -> bool:
        """Whether doors or drawers at its front need its full width: those of appliances, cabinets and the like."""
        return "store" in self.roles and not {"shelf", "wardrobe"} & set(self.roles)

    @property
    def side_gap_m(self) -> float:
        """Greatest gap between one of its sides and a wall; infinite for what needs no corner."""
        return min((SIDE_GAP_M[role] for role in self.roles if role in SIDE_GAP_M), default=math.inf)

    @property
    def label_id(self) -> int:
        """Class id of NYU40."""
        return LABEL_ID[self.label]


Categories = Mapping[str, Category]


@dataclass(frozen=True, slots=True, kw_only=True)
class _CategoryFile:
    categories: Mapping[str, Category]


def read_categories(path: Path) -> Categories:
    """Read and check the table of categories, for example ``config_path("categories.yaml")``.

    Raises:
        GrammarError: the file does not parse or a field does not fit; one line with file and field.
    """
    try:
        categories = from_mapping(_CategoryFile, read_yaml(path, GrammarError)).categories
        for name, category in categories.items():
            if category.label not in LABEL_ID:
                raise FieldError(f"categories.{name}.label", "the name of an NYU40 class", repr(category.label))
    except FieldError as error:
        raise GrammarError(f"{path}: {error}") from None
    return categories
