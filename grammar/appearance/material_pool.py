"""The materials of one room while parts take theirs: a palette, and a few materials of each family that its parts share."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence

import numpy as np

from grammar.appearance.appearance_rules import Appearance, Families
from grammar.appearance.materials import Palette, draw_material
from scene_description import Material


def draw_index_by_odds(rng: np.random.Generator, odds: Sequence[float]) -> int:
    """Draw an index with a probability proportional to its odds; one number is taken from ``rng``."""
    share = np.array(odds, np.float64)
    return int(np.searchsorted(np.cumsum(share) / share.sum(), rng.random(), side="right"))


def draw_name(rng: np.random.Generator, odds: Mapping[str, float]) -> str:
    """Draw a name with a probability proportional to its odds."""
    return list(odds)[draw_index_by_odds(rng, list(odds.values()))]


class MaterialPool:
    """The materials of one room: all that were drawn, in order, and those kept by family; also the styles that suites have taken."""

    def __init__(self, rng: np.random.Generator, appearance: Appearance) -> None:
        self.materials: list[Material] = []
        self.suites: dict[str, str] = {}
        self._rng, self._appearance = rng, appearance
        palette = appearance.palette
        main = draw_index_by_odds(rng, [hue.odds for hue in palette.hues_deg])
        apart = draw_index_by_odds(rng, [distance.odds for distance in palette.apart_deg])
        hue = palette.hues_deg[main].hue + float(rng.uniform(-palette.jitter_deg, palette.jitter_deg))
        second = hue + palette.apart_deg[apart].hue + float(rng.uniform(-palette.jitter_deg, palette.jitter_deg))
        self._palette = Palette(main_deg=hue, second_deg=second)
        self._kept: dict[str, tuple[str, ...]] = {}
        self._count: dict[str, int] = {}

    def use(self, rng: np.random.Generator) -> None:
        """Draw from another source of randomness from now on."""
        self._rng = rng

    def choose(self, families: Families) -> str:
        """Return the id of a material of one of the families, a kept one where the family is kept."""
        family = draw_name(self._rng, families)
        wanted = self._appearance.palette.kept.get(family, 0)
        if not wanted:
            return self._draw(family, ())
        if family not in self._kept:
            self._kept[family] = self._draw_kept(family, wanted)
        kept = self._kept[family]
        first = self._appearance.palette.first_odds
        if len(kept) == 1 or (len(kept) == 2 and self._rng.random() < first):
            return kept[0]
        return kept[int(self._rng.integers(len(kept)))] if len(kept) > 2 else kept[1]

    def _draw_kept(self, family: str, count: int) -> tuple[str, ...]:
        """Draw the room's materials of a family, as many different kinds as there are."""
        ids: list[str] = []
        kinds: list[str] = []
        for _ in range(count):
            ids.append(self._draw(family, kinds))
            kinds.append(ids[-1].rsplit("_", 1)[0])
        return tuple(ids)

    def _draw(self, family: str, avoid: Collection[str]) -> str:
        names = [name for name in self._appearance.families[family] if name not in avoid] or list(self._appearance.families[family])
        return self.draw_material(draw_name(self._rng, {name: self._appearance.materials[name].odds for name in names}))

    def draw_material(self, name: str) -> str:
        """Draw a new material of a name; return its id."""
        self._count[name] = self._count.get(name, 0) + 1
        material = draw_material(self._rng, self._appearance.materials[name], f"{name}_{self._count[name]}", self._palette)
        self.materials.append(material)
        return material.id
