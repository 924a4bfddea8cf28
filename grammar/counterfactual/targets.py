"""What a change is of: objects by id, name, category or functional group, their parts, lamps, and the surfaces of the room.

A target is a mapping with any of these keys; together they narrow it.  An empty one means all.

- ``object``: an id; ``name``: category and place among the objects of that category in the order of ids, as in ``chair_2``
- ``category``: of objects, or ``door`` and ``window``; ``group``: the id of a core object, which stands for its whole functional group
- ``part``: name of a part of objects or openings; ``surface``: ``floor``, ``wall``, ``ceiling`` or ``skirting`` of the room
- ``luminaire``: place of a luminaire in the scene's list, from 0
"""

from collections.abc import Sequence

from grammar.counterfactual.change import Change, ChangeError
from scene_description import Opening, SceneDescription, SceneObject
from scene_description.strict import shorten

Thing = SceneObject | Opening

OBJECTS = ("object", "name", "category", "group")
"""Keys that choose objects."""

ALL = "all"
LONGEST = 120
"""Characters of a target's value."""


def check_keys(change: Change, known: Sequence[str]) -> None:
    """Refuse a target with keys that the factor has no use for, or with values that are neither whole numbers nor texts.

    Raises:
        ChangeError: there is one.
    """
    for key, value in change.target.items():
        if isinstance(value, bool) or not isinstance(value, (int, str)) or len(str(value)) > LONGEST:
            raise ChangeError(f"{change.factor}: target: {key}: expected a whole number or a text, got {shorten(value)}")
        if key not in known:
            raise ChangeError(f"{change.factor}: target: expected {' or '.join(known) or 'none: it is of the whole scene'}, got '{key}'")


def all_things(scene: SceneDescription) -> tuple[Thing, ...]:
    """Return the openings and objects of a scene."""
    return (*scene.room.openings, *scene.objects)


def names(things: Sequence[Thing]) -> dict[int, str]:
    """Return id -> category and number, for example ``chair_2``."""
    count: dict[str, int] = {}
    found = {}
    for thing in sorted(things, key=lambda thing: thing.id):
        count[thing.category] = count.get(thing.category, 0) + 1
        found[thing.id] = f"{thing.category}_{count[thing.category]}"
    return found


def chosen_objects(scene: SceneDescription, change: Change) -> tuple[SceneObject, ...]:
    """Return the objects that a target means, in the scene's order.

    Raises:
        ChangeError: it means none; the line says what there is.
    """
    return tuple(thing for thing in _chosen(change, scene.objects) if isinstance(thing, SceneObject))


def chosen_things(scene: SceneDescription, change: Change) -> tuple[Thing, ...]:
    """Return the openings and objects that a target means, in the scene's order.

    Raises:
        ChangeError: it means none; the line says what there is.
    """
    return _chosen(change, all_things(scene))


def _chosen(change: Change, things: Sequence[Thing]) -> tuple[Thing, ...]:
    name = names(things)
    kept = list(things)
    for key in OBJECTS:
        if key in change.target and change.target[key] != ALL:
            value = str(change.target[key])
            kept = [thing for thing in kept if value in _words(key, thing, name)]
            if not kept:
                there = sorted({word for thing in things for word in _words(key, thing, name)}, key=lambda word: (len(word), word))
                raise ChangeError(
                    f"{change.factor}: target: expected {key} of the room ({', '.join(there) or 'there is none'}), got '{value}'"
                )
    return tuple(kept)


def _words(key: str, thing: Thing, name: dict[int, str]) -> tuple[str, ...]:
    """Return the texts by which a key of a target means a thing."""
    if key == "group":
        group = thing.group if isinstance(thing, SceneObject) else None
        return (str(thing.id),) if group is None else (str(group), str(thing.id))
    return {"object": (str(thing.id),), "name": (name[thing.id],), "category": (thing.category,)}[key]


def chosen_lamps(scene: SceneDescription, change: Change) -> tuple[tuple[int, ...], tuple[int, ...]]:
    """Return which lights and which luminaires a target means, as places in the scene's lists; all where it is empty.

    Raises:
        ChangeError: it means none, or the room has none; the line says what there is.
    """
    if "luminaire" in change.target:
        asked = str(change.target["luminaire"])
        found = tuple(k for k in range(len(scene.luminaires)) if asked in (ALL, str(k)))
        if not found:
            last = f"0 to {len(scene.luminaires) - 1}" if scene.luminaires else "there is none"
            raise ChangeError(f"{change.factor}: target: expected a luminaire of the room ({last}), got {shorten(asked)}")
        return (), found
    if any(change.target.get(key, ALL) != ALL for key in OBJECTS):
        ids = {thing.id for thing in chosen_objects(scene, change)}
        lights = tuple(k for k, light in enumerate(scene.lights) if light.object in ids)
        if not lights:
            lamps = {light.object: None for light in scene.lights}
            there = ", ".join(f"{thing.id} {thing.category}" for thing in scene.objects if thing.id in lamps) or "there is none"
            raise ChangeError(f"{change}: target: expected a lamp of the room ({there}), got objects that do not shine")
        return lights, ()
    if not scene.lights and not scene.luminaires:
        raise ChangeError(f"{change.factor}: target: expected a lamp of the room, which has none")
    return tuple(range(len(scene.lights))), tuple(range(len(scene.luminaires)))
