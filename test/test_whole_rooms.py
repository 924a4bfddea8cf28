"""Grammar and renderer fit together: every category has a model and a look, and a room of every type becomes a mesh."""

import pytest

from grammar import SceneRequest
from grammar.synthesize import CameraTimes, SceneSynthesizer
from renderer.models import MODELS
from renderer.models.openings import OPENING_MODELS
from renderer.scene.flatten import flatten
from scene_description import scene_from_json, scene_to_json

MAX_TRIANGLES = 150_000
SYNTHESIZER = SceneSynthesizer.from_config()


def test_every_category_has_a_model_and_a_look() -> None:
    categories = set(SYNTHESIZER.categories)
    assert categories == set(MODELS) | set(OPENING_MODELS)
    assert categories == set(SYNTHESIZER.appearance.categories)


@pytest.mark.parametrize("room_type", SYNTHESIZER.grammars)
def test_a_room_of_every_type_is_valid_json_and_a_mesh_within_budget(room_type: str) -> None:
    times = CameraTimes(frames=3, start_ns=10**9, rate_hz=10.0)
    scene = SYNTHESIZER.synthesize(SceneRequest(room_type=room_type), seed=5, index=0, times=times)
    assert scene_from_json(scene_to_json(scene)) == scene
    flat = flatten(scene)
    assert 0 < len(flat.mesh.faces) <= MAX_TRIANGLES
    assert set(flat.parts.object_id.tolist()) == {0} | {thing.id for thing in (*scene.room.openings, *scene.objects)}
    assert any(light.on for light in scene.lights) or any(opening.category == "window" for opening in scene.room.openings)
