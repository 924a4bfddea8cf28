"""A small sampled room of each type, by day, and how two scenes differ: what tests of counterfactuals share."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from functools import cache

from grammar.spec.grammar_file import room_types
from grammar.spec.request import SceneRequest
from grammar.synthesize import CameraTimes, SceneSynthesizer
from scene_description import SceneDescription, to_mapping

ROOM_TYPES = room_types()
SEED = 7
ASKED = {  # furniture where tests can change it: two nightstands with lamps, a seat and a plant with free floor about them
    "bedroom": SceneRequest(
        room_shape="rectangle", room_ceiling="flat", room_width_m=5.2, room_depth_m=4.8, max_objects=40,
        must_not=("desk", "dresser", "bookshelf", "floor_lamp", "rug", "radiator"),
        counts=("bed:1:1", "nightstand:2:2", "table_lamp:2:2", "book_stack:2:2", "wardrobe:1:1", "armchair:1:1", "potted_plant:1:1"),
        fixed=(
            "double_bed:-1.53:0:0:size=2.1x1.6x1.0", "wardrobe:0.5:2.08:-1.5708:size=0.6x1.2x2.0",
            "armchair:1.8:1.5:-2.2:size=0.8x0.75x0.85", "potted_plant:1.3:-1.2:0:size=0.4x0.4x1.0",
        ),
    ),
}  # fmt: skip


@cache
def rules() -> SceneSynthesizer:
    return SceneSynthesizer.from_config()


@cache
def room(room_type: str, seed: int = SEED) -> SceneDescription:
    request = replace(ASKED.get(room_type, SceneRequest()), room_type=room_type, grammar_set="by_hand", daylight="clear")
    return rules().synthesize(request, seed, 0, CameraTimes(frames=5, start_ns=1_000, rate_hz=10.0))


def difference(before: SceneDescription, after: SceneDescription) -> set[str]:
    """Return the paths of the JSON at which two scenes differ; objects, openings and materials are compared by id."""
    return set(_differing(to_mapping(before), to_mapping(after), ""))


def _differing(a: object, b: object, path: str) -> Iterator[str]:
    a, b = _by_id(a), _by_id(b)
    if isinstance(a, dict) and isinstance(b, dict):
        for key in [*a, *(key for key in b if key not in a)]:
            here = f"{path}.{key}" if path else str(key)
            if key not in a or key not in b:
                yield here
            else:
                yield from _differing(a[key], b[key], here)
    elif a != b:
        yield path


def _by_id(value: object) -> object:
    if isinstance(value, list) and value and all(isinstance(item, dict) for item in value):
        return {item.get("id", k): item for k, item in enumerate(value)}
    return value
