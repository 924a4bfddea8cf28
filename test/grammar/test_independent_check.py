"""Rooms of every type against a check that shares no geometry with the generator's."""

import copy
from dataclasses import replace

import pytest
from independent_check import faults
from small_grammar import CATEGORIES

from grammar import SceneRequest
from grammar.counterfactual import Change, apply_change
from grammar.counterfactual.gate import report_of
from grammar.synthesize import CameraTimes, SceneSynthesizer
from scene_description import SceneDescription, from_mapping, to_mapping
from scene_description.ceilings import ceiling_height_m

TIMES = CameraTimes(frames=1, start_ns=0, rate_hz=10.0)


@pytest.fixture(scope="module")
def synthesizer():
    return SceneSynthesizer.from_config()


@pytest.fixture(scope="module")
def scenes(synthesizer):
    return [
        to_mapping(synthesizer.synthesize(SceneRequest(room_type=name, clutter=(1.0, 3.0)[index % 2]), 11, index, TIMES))
        for index, name in enumerate(synthesizer.grammars)
    ]


def grammar_of(synthesizer, scene):
    return synthesizer.grammar_of(SceneRequest(room_type=scene["category"]))


def test_no_room_has_a_fault(scenes, synthesizer):
    assert [line for scene in scenes for line in faults(scene, grammar_of(synthesizer, scene), CATEGORIES)] == []


def test_the_gate_on_changes_judges_a_room_as_its_sampler_does(scenes, synthesizer):
    bed_by_a_mirror = synthesizer.synthesize(SceneRequest(room_type="bedroom"), 9, 0, TIMES)  # one that small things bring
    for scene in (*(from_mapping(SceneDescription, scene) for scene in scenes), bed_by_a_mirror):
        assert scene.validity.valid
        assert [(check.name, check.objects) for check in report_of(synthesizer, scene).checks if not check.passed] == []


def test_every_kind_of_fault_is_found(synthesizer):
    request = SceneRequest(room_type="bedroom", grammar_set="by_hand", room_shape="rectangle", min_objects=16)
    scene = to_mapping(synthesizer.synthesize(request, 12, 0, TIMES))
    grammar = synthesizer.grammar_of(request)
    bed = next(k for k, item in enumerate(scene["objects"]) if item["category"] == "bed")
    wardrobe = max((k for k, item in enumerate(scene["objects"]) if k != bed and item["support"]["kind"] == "floor"
                    and CATEGORIES[item["category"]].solids is None), key=lambda k: scene["objects"][k]["size_m"][2])  # fmt: skip
    door = next(opening for opening in scene["room"]["openings"] if opening["category"] == "door")

    def spoilt(change):
        other = copy.deepcopy(scene)
        change(other["objects"])
        return " ".join(faults(other, grammar, CATEGORIES))

    def at(k, **fields):
        return lambda objects: objects[k].update(fields)

    x, y, _ = scene["objects"][bed]["position_m"]
    assert "collision" in spoilt(at(wardrobe, position_m=[x, y, 0.0]))
    assert "outside" in spoilt(at(bed, position_m=[x + 20.0, y, 0.0]))
    assert "floating" in spoilt(at(bed, position_m=[x, y, 0.02]))
    (ax, ay), (bx, by) = (scene["room"]["polygon_m"][(door["wall"] + k) % len(scene["room"]["polygon_m"])] for k in (0, 1))
    length = ((bx - ax) ** 2 + (by - ay) ** 2) ** 0.5
    along = (door["offset_m"] + 0.5 * door["width_m"]) / length
    inwards = [ax + along * (bx - ax) - 0.3 * (by - ay) / length, ay + along * (by - ay) + 0.3 * (bx - ax) / length, 0.0]
    assert "door blocked" in spoilt(at(wardrobe, position_m=inwards))
    carried = next(k for k, item in enumerate(scene["objects"]) if item["support"]["kind"] == "object")
    px, py, pz = scene["objects"][carried]["position_m"]
    assert "overhang" in spoilt(at(carried, position_m=[px + 3.0, py, pz]))
    # a wall of a wardrobe right through the room leaves the robot half of it
    low, high = (f(a) for f, a in ((min, scene["room"]["polygon_m"]), (max, scene["room"]["polygon_m"])))
    fences = [
        {"size_m": [0.2, 40.0, 2.0], "position_m": [low[0] + share * (high[0] - low[0]), 0.0, 0.0], "yaw_rad": 0.0}
        for share in (0.35, 0.5, 0.65)
    ]
    fences += [
        {**fence, "position_m": [0.0, low[1] + 0.5 * (high[1] - low[1]), 0.0], "yaw_rad": 1.5707963267948966} for fence in fences[:1]
    ]
    found = [spoilt(at(wardrobe, **fence)) for fence in fences]
    assert all("walkable share" in text for text in found) and any("not reached" in text for text in found)


def test_all_lies_below_a_sloped_ceiling_and_so_does_the_camera(synthesizer):
    request = SceneRequest(room_type="bedroom", grammar_set="by_hand", room_ceiling="two_slopes")
    scene = synthesizer.synthesize(request, 3, 1, replace(TIMES, frames=40))
    grammar = synthesizer.grammar_of(request)
    assert faults(to_mapping(scene), grammar, CATEGORIES) == []
    assert all(z < ceiling_height_m(scene.room, x, y) - 0.1 for x, y, z in (pose.position_m for pose in scene.camera_path))
    lowered = to_mapping(replace(scene, room=replace(scene.room, slopes=tuple(replace(s, eaves_height_m=0.1) for s in scene.room.slopes))))
    assert "above the slope of wall" in " ".join(faults(lowered, grammar, CATEGORIES))
    larger = apply_change(scene, Change(factor="room_size", value=1.3), synthesizer)
    assert larger.room.slopes == scene.room.slopes and faults(to_mapping(larger), grammar, CATEGORIES) == []
