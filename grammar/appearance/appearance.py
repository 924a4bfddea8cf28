"""The appearance of a room: style, model seed and a material for every part, harmonised by a palette of the room.

A room has a main and a second hue and one for accents, and keeps a few materials of each family (two woods, one metal, ...), which its
parts share; so objects match without being all alike.
"""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace

import numpy as np

from grammar.appearance.appearance_rules import Appearance, CategoryLook, Families, PaletteRule
from grammar.appearance.materials import Palette, draw_material
from grammar.spec.rules import GrammarError
from scene_description import Material, ModelReference, Opening, Part, Room, SceneObject


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
        second = _kept_off(
            hue + palette.apart_deg[apart].hue + float(rng.uniform(-palette.jitter_deg, palette.jitter_deg)), *palette.avoided_deg
        )
        self._palette = Palette(main_deg=hue, second_deg=second, accent_deg=_accent(rng, palette, hue))
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
        kind = self._appearance.materials[name]
        shown = self._appearance.wear.shown.get(kind.family, 0.0)
        material = draw_material(self._rng, kind, f"{name}_{self._count[name]}", self._palette, shown)
        self.materials.append(material)
        return material.id


def _kept_off(hue_deg: float, low_deg: float, high_deg: float) -> float:
    """Return a hue in degrees, moved to the nearer end of a range if it lies in it."""
    turn = hue_deg % 360.0
    if not low_deg < turn < high_deg:
        return hue_deg
    return low_deg if turn - low_deg < high_deg - turn else high_deg


def _accent(rng: np.random.Generator, palette: PaletteRule, main_deg: float) -> float:
    """Draw the hue of a room's accents, degrees: of those that lie far enough from its main hue."""
    apart = [abs((accent.hue - main_deg + 180.0) % 360.0 - 180.0) for accent in palette.accents_deg]
    odds = [accent.odds * (away >= palette.accent_apart_deg) for accent, away in zip(palette.accents_deg, apart, strict=True)]
    index = draw_index_by_odds(rng, odds) if any(odds) else int(np.argmax(apart))
    return palette.accents_deg[index].hue + float(rng.uniform(-palette.jitter_deg, palette.jitter_deg))


_MAX_SEED = 2**63 - 1

ModelAndParts = tuple[ModelReference, tuple[Part, ...]]
"""Model and parts of an object."""


def sample_appearance(
    rng: np.random.Generator, appearance: Appearance, room: Room, objects: Sequence[SceneObject], room_type: str = ""
) -> tuple[Room, tuple[SceneObject, ...], tuple[Material, ...]]:
    """Sample models and materials of parts for a room and its objects; return both and the scene's materials.

    The room's surfaces follow the rules of ``room_type``.  Objects with a model file keep it and their parts.  Objects share style, seed
    and materials as their category says.

    Raises:
        GrammarError: a category has no look.
    """
    pool = MaterialPool(rng, appearance)
    changed, new_objects = sample_appearance_from(pool, rng, appearance, room, objects, room_type)
    return changed, new_objects, tuple(pool.materials)


def sample_appearance_from(
    pool: MaterialPool, rng: np.random.Generator, appearance: Appearance, room: Room, objects: Sequence[SceneObject], room_type: str
) -> tuple[Room, tuple[SceneObject, ...]]:
    """Do as :func:`sample_appearance`, but draw the materials into a new pool that the caller keeps."""
    for category in (*(opening.category for opening in room.openings), *(item.category for item in objects)):
        if category not in appearance.categories:
            raise GrammarError(
                f"appearance: expected a look for category '{category}', got none; known are {', '.join(sorted(appearance.categories))}"
            )
    surfaces = _surfaces(pool, appearance, room_type)
    looks: dict[tuple[str, int], ModelAndParts] = {}
    by_id = {item.id: item for item in objects}
    openings: list[Opening] = []
    for opening in room.openings:
        model, parts = _look(rng, appearance, pool, looks, opening.category, opening.id, 0)
        openings.append(replace(opening, model=model, parts=parts))
    new_objects: list[SceneObject] = []
    for item in objects:
        if item.model.file is not None:
            new_objects.append(item)
            continue
        owner = core_of(item, by_id)
        model, parts = _look(rng, appearance, pool, looks, item.category, item.id, owner)
        new_objects.append(replace(item, model=replace(model, ajar=item.model.ajar), parts=parts))
    return replace(room, surfaces=surfaces, openings=tuple(openings)), tuple(new_objects)


def _surfaces(pool: MaterialPool, appearance: Appearance, room_type: str) -> tuple[Part, ...]:
    """Return the room's surfaces with their materials, but for those that walls of the chosen material do not have."""
    chosen: dict[str, str] = {}
    for name, rule in appearance.surfaces.items():
        walls = {material.family for material in pool.materials if material.id == chosen.get("wall")}
        if walls.isdisjoint(rule.not_on):
            chosen[name] = pool.choose(rule.by_room.get(room_type, rule.families))
    return tuple(Part(name=name, material=material) for name, material in chosen.items())


def _look(
    rng: np.random.Generator,
    appearance: Appearance,
    pool: MaterialPool,
    looks: dict[tuple[str, int], ModelAndParts],
    category: str,
    identifier: int,
    core: int,
) -> ModelAndParts:
    """Return model and parts of one object: those of an object that it shares its look with, if there is one, else new ones."""
    rule = appearance.categories[category]
    key = (category, {"room": -1, "group": core or -1 - identifier, "none": -1 - identifier}[rule.shared])
    if key not in looks:
        style = _style(rng, pool, rule)
        chosen: dict[str, str] = {}
        for name in rule.styles[style].parts:
            chosen[name] = _part_material(rng, pool, rule, style, name, chosen)
        model = ModelReference(generator=rule.generator or category, style=style, seed=int(rng.integers(_MAX_SEED)))
        looks[key] = (model, tuple(Part(name=name, material=material) for name, material in chosen.items()))
    return looks[key]


def _style(rng: np.random.Generator, pool: MaterialPool, rule: CategoryLook) -> str:
    """Return the style of the category's suite in this room, if it has one, else a drawn one."""
    taken = None if rule.suite is None else pool.suites.get(rule.suite)
    if taken is not None and taken in rule.styles:
        return taken
    style = draw_name(rng, {name: item.odds for name, item in rule.styles.items()})
    if rule.suite is not None:
        pool.suites.setdefault(rule.suite, style)
    return style


def _part_material(
    rng: np.random.Generator, pool: MaterialPool, rule: CategoryLook, style: str, name: str, chosen: Mapping[str, str]
) -> str:
    """Return the id of a part's material; ``chosen`` are those of the parts before it."""
    part = rule.parts[name]
    if style in part.by_style:
        return pool.choose(part.by_style[style])
    if part.like is not None and part.like in chosen and (not part.families or rng.random() < part.like_odds):
        return chosen[part.like]
    return pool.choose(part.families)


def core_of(item: SceneObject, by_id: Mapping[int, SceneObject]) -> int:
    """Return the id of the last object above an object, up from core to core or from supporter to supporter; 0 for none."""
    seen: set[int] = set()
    current = item
    while current.id not in seen:
        seen.add(current.id)
        above = current.group if current.group is not None else current.support.id
        if above is None or above not in by_id or above == current.id:
            break
        current = by_id[above]
    return 0 if current.id == item.id else current.id
