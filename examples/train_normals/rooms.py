"""The rooms: those to train on, those of other types to test on, and the same rooms with one look and one light for all."""

from collections.abc import Iterator, Sequence
from dataclasses import replace

from grammar.spec.request import SceneRequest
from grammar.synthesize import CameraTimes, SceneSynthesizer
from scene_description import Material, SceneDescription
from scene_description.color_temperature import color_of_temperature
from scene_description.types import Environment, Part

TRAINING_TYPES = ("bedroom", "living_room", "kitchen", "office", "dining_room", "study", "guest_room", "garage")
TEST_TYPES = ("bathroom", "gym", "hallway", "storage")
TEST_SEED_OFFSET = 1_000_003

FRAMES, VIEWS = 31, 4
"""Frames of a room's camera path, and how many of them are rendered, evenly spaced."""

LAMP_K, LAMP_LM = 4000.0, 2000.0
OVERCAST = Environment(zenith=(4000.0, 4000.0, 4000.0), horizon=(1400.0, 1400.0, 1400.0), ground=(450.0, 450.0, 450.0))
"""A white sky, at the horizon about a third as bright as at the zenith (the CIE's standard overcast sky), in cd/m2."""


def sample_rooms(types: Sequence[str], count: int, seed: int) -> list[SceneDescription]:
    """Return ``count`` rooms, of the types in turn; the first n of them are the same whatever the count."""
    synthesizer, times = SceneSynthesizer.from_config(), CameraTimes(frames=FRAMES, start_ns=0, rate_hz=10.0)
    request = SceneRequest(room_type=",".join(types))
    return [synthesizer.synthesize(request.of_room(index), seed, index, times) for index in range(count)]


def with_one_look(scenes: Sequence[SceneDescription]) -> list[SceneDescription]:
    """Return the same rooms without variety of light and materials; shapes, places and camera paths stay.

    Every part of a category has the material that it has in the first of the rooms that have one.  All lamps are lit, equally bright and of
    one colour temperature, and the sky is overcast.
    """
    table: dict[str, Material] = {}
    for scene in scenes:
        materials = {material.id: material for material in scene.materials}
        for owner, part in _parts(scene):
            table.setdefault(f"{owner}/{part.name}", materials[part.material])
    names = {key: f"look_{number}" for number, key in enumerate(table)}
    shared = tuple(replace(material, id=names[key]) for key, material in table.items())
    return [_dressed(scene, names, shared) for scene in scenes]


def _parts(scene: SceneDescription) -> Iterator[tuple[str, Part]]:
    """Yield (owner, part) for all that has a material: objects and openings by category, the shell as "room"."""
    for thing in (*scene.objects, *scene.room.openings):
        yield from ((thing.category, part) for part in thing.parts)
    yield from (("room", part) for part in scene.room.surfaces)


def _dressed(scene: SceneDescription, names: dict[str, str], materials: tuple[Material, ...]) -> SceneDescription:
    def renamed(owner: str, parts: Sequence[Part]) -> tuple[Part, ...]:
        return tuple(replace(part, material=names[f"{owner}/{part.name}"]) for part in parts)

    white = {"on": True, "flux_lm": LAMP_LM, "color_temperature_k": LAMP_K, "color": color_of_temperature(LAMP_K)}
    used = {names[f"{owner}/{part.name}"] for owner, part in _parts(scene)}
    openings = tuple(replace(opening, parts=renamed(opening.category, opening.parts)) for opening in scene.room.openings)
    return replace(
        scene,
        objects=tuple(replace(thing, parts=renamed(thing.category, thing.parts)) for thing in scene.objects),
        room=replace(scene.room, openings=openings, surfaces=renamed("room", scene.room.surfaces)),
        materials=tuple(material for material in materials if material.id in used),
        lights=tuple(replace(light, **white) for light in scene.lights),
        luminaires=tuple(replace(light, **white) for light in scene.luminaires),
        environment=OVERCAST,
    )
