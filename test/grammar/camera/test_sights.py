"""Sights of a room: slabs where openings are, bright where windows are and lamps shine."""

import numpy as np
import pytest

from grammar import SceneRequest
from grammar.camera.sights import find_sights
from grammar.geometry.solids import object_solids
from grammar.synthesize import CameraTimes, SceneSynthesizer


def test_openings_are_slabs_on_their_walls_and_windows_and_lamps_are_bright():
    synthesizer = SceneSynthesizer.from_config()
    scene = synthesizer.synthesize(SceneRequest(room_type="bedroom"), 3, 0, CameraTimes(frames=1, start_ns=0, rate_hz=10.0))
    _, owners = object_solids(synthesizer.categories, scene.objects)
    sights = find_sights(scene.room, owners, scene.lights)
    openings = scene.room.openings
    assert len(sights.openings) == len(openings) and len(sights.bright) == len(owners) + len(openings)
    assert sights.bright[len(owners) :].tolist() == [opening.category == "window" for opening in openings]
    assert set(owners[sights.bright[: len(owners)]].tolist()) == {light.object for light in scene.lights if light.on} & set(owners.tolist())
    for slab, opening in zip(sights.openings, openings, strict=True):
        a = np.array(scene.room.polygon_m[opening.wall])
        b = np.array(scene.room.polygon_m[(opening.wall + 1) % len(scene.room.polygon_m)])
        along = (b - a) / np.linalg.norm(b - a)
        assert slab[:2] == pytest.approx(a + along * (opening.offset_m + 0.5 * opening.width_m))
        assert abs(slab[6:8] @ along) < 1e-9 and slab[3] - slab[2] == pytest.approx(opening.height_m)
