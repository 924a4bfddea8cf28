"""Which small things of the grammar are there below clutter 1."""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Sequence

import numpy as np

from grammar.derivation.constraints import numbers_asked
from grammar.spec.categories import Categories
from grammar.spec.request import SceneRequest
from scene_description import SceneObject

THINNING = 0
"""Names the streams of random numbers of thinning; those of supports have their objects' ids, which count from 1."""


def small_things(
    objects: Sequence[SceneObject], categories: Categories, lamps: Collection[str] = (), kept: Collection[str] = ()
) -> frozenset[int]:
    """Return the ids of the small things among objects: what stands on others, but no lamp, watched screen, or what carries one of these.

    Args:
        objects: of a room.
        categories: their table.
        lamps: categories that give light.
        kept: further categories that are no small things here.
    """
    by_id = {item.id: item for item in objects}
    staying = {
        item.id
        for item in objects
        if item.support.kind != "object" or item.category in (*lamps, *kept) or "screen" in categories[item.category].roles
    }
    for key in tuple(staying):
        below = by_id[key].support.id
        while below in by_id and below not in staying:
            staying.add(below)
            below = by_id[below].support.id
    return frozenset(by_id) - staying


def taken_away(
    objects: Sequence[SceneObject], categories: Categories, lamps: Collection[str], request: SceneRequest, root: int
) -> frozenset[int]:
    """Return the ids of the small things that come above the clutter asked for.

    A thing comes at a level that is uniform between 0 and 1, but not before what it stands on.  What a request asks for at least stays.
    """
    if request.clutter >= 1.0:
        return frozenset()
    fixed = {text.split(":")[0].strip() for text in request.fixed}
    small = small_things(objects, categories, lamps, fixed)
    level: dict[int, float] = {}
    for item in sorted(objects, key=lambda item: (item.position_m[2], item.id)):
        if item.id in small:
            own = float(np.random.default_rng([root, THINNING, item.id]).random())
            level[item.id] = max(own, level.get(item.support.id or 0, 0.0))
    # take away the last to come first
    least: dict[str, int] = {}
    for name, low, _, _ in numbers_asked(request, categories):
        least[name] = max(low, least.get(name, low))
    count, gone = Counter(item.category for item in objects), set[int]()
    by_level = sorted((item for item in objects if item.id in level), key=lambda item: (level[item.id], item.position_m[2]), reverse=True)
    for item in by_level:
        few = count[item.category] <= least.get(item.category, 0) or len(objects) - len(gone) <= request.min_objects
        carries = any(other.support.id == item.id and other.id not in gone for other in objects)
        if level[item.id] >= request.clutter and not few and not carries:
            gone.add(item.id)
            count[item.category] -= 1
    return frozenset(gone)
