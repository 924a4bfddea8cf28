"""Every factor in a room of each type: nothing else in the JSON changes, and pixels that cannot see the change stay to the bit."""

from __future__ import annotations

import re
from collections.abc import Iterator
from functools import cache
from itertools import product

import numpy as np
import pytest
from counterfactual_rooms import ROOM_TYPES, difference, room, rules

from grammar.counterfactual import FACTORS, Change, ChangeError, apply_change, as_base
from renderer import CameraConfig, RenderConfig, Renderer
from renderer.scene.flatten import flatten
from scene_description import SceneDescription, scene_from_json, scene_to_json

PART = r"(room\.surfaces\.\d+|room\.openings\.\d+\.parts\.\d+|objects\.\d+\.parts\.\d+)\.material"
POSES = r"camera_path(\.\d+(\.position_m|\.orientation|\.stamp_ns)?)?"
SURFACE = rf"{PART}|materials\.changed_.*"
NEW_THINGS = r"objects\.\d+|materials\.changed_.*|lights(\.\d+(\..*)?)?|validity\..*"
MAY_CHANGE = {
    "light_intensity": r"(lights|luminaires)\.\d+\.flux_lm",
    "color_temperature_k": r"(lights|luminaires)\.\d+\.color(_temperature_k)?",
    "lamp_on": r"(lights|luminaires)\.\d+\.on",
    "sun_elevation_deg": r"environment\.daylight\.sun_direction",
    "sun_azimuth_deg": r"environment\.daylight\.sun_direction",
    "solar_hour": r"environment\.daylight\.(sun_direction|solar_hour|sun_distance_au)",
    "sun_intensity": r"environment\.daylight\.sun_scale",
    "sky_intensity": r"environment\.daylight\.sky_scale",
    "turbidity": r"environment\.daylight\.turbidity",
    "cloud_cover": r"environment\.daylight\.cloud_cover",
    **dict.fromkeys(("material", "base_color", "roughness", "metallic", "texture", "texture_scale", "texture_contrast"), SURFACE),
    **{f"{name}_finish": rf"room\.surfaces\.{k}\.material|materials\.changed_.*" for k, name in enumerate(("floor", "wall", "ceiling"))},
    "clutter": NEW_THINGS,
    **dict.fromkeys(("object_added", "object_placed"), NEW_THINGS),
    "object_removed": NEW_THINGS + r"|objects\.\d+\.group",
    "object_moved": r"objects\.\d+\.(position_m|yaw_rad)|validity\..*",
    "object_replaced": r"objects\.\d+\.(model\..*|parts.*)|materials\.changed_.*|validity\..*",
    "room_size": r"room\.polygon_m|room\.openings\.\d+\.offset_m|(objects|luminaires)\.\d+\.position_m|validity\..*",
    **dict.fromkeys((name for name in FACTORS if name.startswith("camera_")), POSES),
}
"""Factor -> paths of the JSON that may differ."""

VALUES = {
    "light_intensity": 0.5, "color_temperature_k": 3333.0, "sun_elevation_deg": 33.0, "sun_azimuth_deg": 200.0, "solar_hour": 12.5,
    "sun_intensity": 0.5, "sky_intensity": 0.25, "turbidity": 6.5, "cloud_cover": 0.75, "material": "oak", "base_color": [0.1, 0.2, 0.3],
    "roughness": 0.123, "metallic": 0.456, "texture": "none", "texture_scale": 1.5, "texture_contrast": 0.987, "wall_finish": "walnut",
    "floor_finish": "walnut", "ceiling_finish": "walnut", "camera_height_m": 1.0, "camera_pitch_deg": 3.0,
    "camera_roll_deg": 4.0, "camera_speed": 2.0, "camera_amplitude": 0.5, "camera_offset_m": 0.01, "camera_path": 1,
}  # fmt: skip
SEEN = ("depth", "range", "normals", "instance", "semantic")
OF_OBJECTS = ("clutter", "object_added", "object_placed", "object_removed", "object_moved", "object_replaced")


def candidates(scene: SceneDescription, factor: str) -> Iterator[Change]:
    """Changes by one factor, the likeliest first, of which one is valid in an ordinary room."""
    if factor in VALUES:
        yield Change(factor, {}, VALUES[factor])
    elif factor == "lamp_on":
        yield Change(factor, {}, not any(light.on for light in (*scene.lights, *scene.luminaires)))
    elif factor == "room_size":
        yield from (Change(factor, {}, value) for value in (1.4, 1.2))
    elif factor == "clutter":
        yield Change(factor, {}, 0.5)
    elif factor == "object_added":
        yield from (
            Change(factor, {"category": name}, 1) for name in ("potted_plant", "picture", "waste_bin", "wall_clock", "mug", "candle")
        )
    elif factor == "object_placed":
        corner, far = np.min(scene.room.polygon_m, axis=0), np.max(scene.room.polygon_m, axis=0)
        from_middle = sorted(product(range(-9, 10), repeat=2), key=lambda steps: abs(steps[0]) + abs(steps[1]))
        places = ((corner + (far - corner) * [0.5 + i / 20, 0.5 + j / 20]).tolist() for i, j in from_middle)
        yield from (Change(factor, {"category": "waste_bin"}, {"at_m": [x, y, 0.0]}) for x, y in places)
    else:
        value = {"object_removed": True, "object_moved": [0.03, 0.02, 0.0], "object_replaced": {"seed": 5}}[factor]
        yield from (Change(factor, {"object": item.id}, value) for item in sorted(scene.objects, key=lambda item: -np.prod(item.size_m)))


@cache
def base(room_type: str) -> SceneDescription:
    return as_base(room(room_type))


@cache
def variant(room_type: str, factor: str) -> SceneDescription:
    return changed(base(room_type), factor)


def changed(scene: SceneDescription, factor: str) -> SceneDescription:
    for change in candidates(scene, factor):
        try:
            return apply_change(scene, change, rules())
        except ChangeError:
            continue
    raise AssertionError(f"{scene.category}: no {factor} is possible")


def cluttered(scene: SceneDescription) -> bool:
    lamps = {light.object for light in scene.lights}
    return sum(item.support.kind == "object" and item.id not in lamps for item in scene.objects) > 1


def factors_of(scene: SceneDescription) -> list[str]:
    return [name for name in FACTORS if name != "clutter" or cluttered(scene)]


@pytest.mark.parametrize("room_type", ROOM_TYPES)
def test_nothing_else_changes_in_the_description(room_type: str) -> None:
    before = base(room_type)
    text = scene_to_json(before)
    assert set(MAY_CHANGE) == set(FACTORS)
    for name in factors_of(before):
        after = variant(room_type, name)
        paths = difference(before, after) - {"counterfactuals"}
        assert paths, f"{name} changed nothing"
        unexpected = [path for path in paths if not re.fullmatch(MAY_CHANGE[name], path)]
        assert not unexpected, f"{name}: {unexpected[:5]}"
        kept = [item.id for item in before.objects if item.id in {other.id for other in after.objects}]
        assert [item.id for item in after.objects][: len(kept)] == kept
        assert after.validity.valid and after.materials[: len(before.materials)] == before.materials
        assert after.counterfactuals is not None and after.counterfactuals[-1].factor == name
    assert scene_to_json(before) == text and '"counterfactuals":[]' in text


@pytest.mark.parametrize(("number", "factor"), list(enumerate(FACTORS)))
def test_a_changed_description_is_read_back_as_it_was_written(number: int, factor: str) -> None:
    """In a room of one type each; what is written does not depend on the type."""
    room_type = "bedroom" if factor == "clutter" else ROOM_TYPES[number % len(ROOM_TYPES)]
    after = variant(room_type, factor)
    assert scene_from_json(scene_to_json(after)) == after


def seen(scene: SceneDescription) -> dict[str, np.ndarray]:
    config = RenderConfig(samples_per_pixel=1, threads=1)
    with Renderer(flatten(scene), CameraConfig(width=64, height=48), config, 1) as renderer:
        return dict(renderer.render(scene.camera_path[-1], 0, SEEN).layers)


def in_turn(scene: SceneDescription, *touches: str) -> SceneDescription:
    """The scene with all changes of light, or of surfaces, one after the other."""
    for name, factor in FACTORS.items():
        if factor.touches in touches:
            target = {"surface": "all"} if name.startswith("texture_") else {}
            value = "tiles" if name == "texture" else VALUES.get(name)
            scene = changed(scene, name) if value is None else apply_change(scene, Change(name, target, value), rules())
    return scene


@pytest.mark.parametrize("room_type", ROOM_TYPES)
def test_pixels_that_cannot_see_the_change_are_the_same(room_type: str) -> None:
    before = base(room_type)
    images = seen(before)
    others = seen(in_turn(before, "light", "surface"))
    for layer in SEEN:
        np.testing.assert_array_equal(others[layer], images[layer], err_msg=f"light and surfaces: {layer}")
    for name in factors_of(before):
        if name in OF_OBJECTS:
            after = variant(room_type, name)
            assert after.counterfactuals is not None
            record = after.counterfactuals[-1]
            touched = [*record.objects, *record.removed]
            others = seen(after)
            same = ~(np.isin(images["instance"], touched) | np.isin(others["instance"], touched))
            assert same.mean() > 0.2, name
            for layer in SEEN:
                np.testing.assert_array_equal(others[layer][same], images[layer][same], err_msg=f"{name} {layer}")
