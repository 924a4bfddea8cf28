"""Sights of a room: slabs where windows are, bright as lamps that shine; doors apart from them."""

import numpy as np
import pytest

from grammar import SceneRequest
from grammar.camera.sights import find_sights
from grammar.geometry.solids import object_solids
from grammar.synthesize import CameraTimes, SceneSynthesizer


def test_windows_are_slabs_on_their_walls_bright_as_lamps_and_doors_are_kept_apart():
    synthesizer = SceneSynthesizer.from_config()
    scene = synthesizer.synthesize(SceneRequest(room_type="bedroom"), 3, 0, CameraTimes(frames=1, start_ns=0, rate_hz=10.0))
    _, owners = object_solids(synthesizer.categories, scene.objects)
    sights = find_sights(scene.room, owners, scene.lights)
    openings = [opening for opening in scene.room.openings if opening.category == "window"]
    assert 0 < len(openings) < len(scene.room.openings), "the room has windows and doors"
    assert len(sights.windows) == len(openings) and len(sights.bright) == len(owners) + len(openings)
    assert len(sights.doors) == len([opening for opening in scene.room.openings if opening.category == "door"])
    assert sights.bright[len(owners) :].all()
    assert set(owners[sights.bright[: len(owners)]].tolist()) == {light.object for light in scene.lights if light.on} & set(owners.tolist())
    for slab, opening in zip(sights.windows, openings, strict=True):
        a = np.array(scene.room.polygon_m[opening.wall])
        b = np.array(scene.room.polygon_m[(opening.wall + 1) % len(scene.room.polygon_m)])
        along = (b - a) / np.linalg.norm(b - a)
        assert slab[:2] == pytest.approx(a + along * (opening.offset_m + 0.5 * opening.width_m))
        assert abs(slab[6:8] @ along) < 1e-9 and slab[3] - slab[2] == pytest.approx(opening.height_m)
