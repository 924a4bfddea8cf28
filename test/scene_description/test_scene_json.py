"""The JSON form: byte-equal round trips, and every kind of bad document refused in one line."""

from __future__ import annotations

import json
import math
import re
from collections.abc import Callable
from dataclasses import fields, is_dataclass
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from sample_scene import sample_scene

from scene_description import FieldError, SceneDescription, read_scene, scene_from_json, scene_to_json
from scene_description.scene_json import MAX_TEXT_LENGTH

TEXT = scene_to_json(sample_scene())


def document() -> dict[str, Any]:
    data: dict[str, Any] = json.loads(TEXT)
    return data


def refusal(text: str | bytes) -> FieldError:
    with pytest.raises(FieldError) as refused:
        scene_from_json(text)
    assert str(refused.value).isprintable(), "one line"
    assert len(str(refused.value)) < 600
    return refused.value


def put(data: Any, path: tuple[str | int, ...], value: object) -> None:
    for key in path[:-1]:
        data = data[key]
    data[path[-1]] = value


def places(data: Any, path: tuple[str | int, ...] = ()) -> list[tuple[str | int, ...]]:
    inner = data.items() if isinstance(data, dict) else enumerate(data) if isinstance(data, list) else ()
    return [path] * bool(path) + [place for key, item in inner for place in places(item, (*path, key))]


def test_a_file_is_refused_with_its_name_and_bytes_that_are_no_text_too(tmp_path: Path) -> None:
    path = tmp_path / "scene.json"
    path.write_text(TEXT)
    assert read_scene(path) == sample_scene()
    for content, line in ((b"\xff\xfe\x00", "document: expected JSON, got"), (b'{"schema": 1}', "schema: expected 'scene_synth/1', got 1")):
        path.write_bytes(content)
        with pytest.raises(FieldError, match=f"^{re.escape(f'{path}: {line}')}"):
            read_scene(path)


def test_round_trip_is_byte_equal_and_gives_an_equal_scene() -> None:
    scene = scene_from_json(TEXT)
    assert scene == sample_scene()
    assert scene_to_json(scene) == TEXT
    assert scene_from_json(TEXT.encode()) == scene
    assert scene_from_json(json.dumps(json.loads(TEXT), indent=2)) == scene


def test_text_is_plain_json_in_the_order_of_the_types() -> None:
    assert TEXT.isascii()
    assert "\n" not in TEXT
    assert list(document()) == [field.name for field in fields(SceneDescription) if field.default is not None]
    assert document()["objects"][2]["support"] == {"kind": "object", "id": 4}


def test_every_value_read_is_immutable_but_for_mappings_of_numbers() -> None:
    def check(value: object) -> None:
        if is_dataclass(value):
            assert not hasattr(value, "__dict__")
            for field in fields(value):
                check(getattr(value, field.name))
        elif isinstance(value, tuple):
            for item in value:
                check(item)
        else:
            assert isinstance(value, (int, float, str, bool, dict, type(None)))

    check(scene_from_json(TEXT))


def test_every_truncation_is_refused() -> None:
    for cut in range(len(TEXT)):
        with pytest.raises(FieldError):
            scene_from_json(TEXT[:cut])


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "document: expected JSON, got text that does not parse"),
        ("scene", "document: expected JSON, got text that does not parse"),
        (b"\xff\xfe{}", "document: expected JSON, got text that does not parse"),
        ("[]", "document: expected a JSON object with schema 'scene_synth/1', got []"),
        ("null", "document: expected a JSON object with schema 'scene_synth/1', got None"),
        ("{}", "schema: expected 'scene_synth/1', got None"),
        ('{"schema":"scene_synth/2"}', "schema: expected 'scene_synth/1', got 'scene_synth/2'"),
        ('{"schema":["scene_synth/1"]}', "schema: expected 'scene_synth/1', got ['scene_synth/1']"),
        ('{"schema":"scene_synth/1"}', "id: expected a value, got nothing (the key is missing)"),
        ('{"schema":NaN}', "document: expected finite numbers, got NaN"),
        ('{"schema":-Infinity}', "document: expected finite numbers, got -Infinity"),
        (TEXT[:-1] + ',"seed":8}', "document: expected keys that are unique, got 'seed' twice"),
        ("[" * 1_000_000, "document: expected JSON of a scene, got nesting beyond the parser's depth"),
        (TEXT.replace('"seed":7', '"seed":' + "9" * 100_000), "document: expected JSON, got text that does not parse"),
        (TEXT.replace('"seed":7', '"seed":' + "9" * 4000), "seed: expected an integer in [0, 9223372036854775807], got 999999"),
        (" " * (MAX_TEXT_LENGTH + 1), f"document: expected at most {MAX_TEXT_LENGTH} characters, got {MAX_TEXT_LENGTH + 1}"),
    ],
)
def test_refuses_texts(text: str | bytes, message: str) -> None:
    assert str(refusal(text)).startswith(message)


@pytest.mark.parametrize("depth", [100, *range(800, 1000, 9), 5000, 50_000])
def test_refuses_nesting_of_any_depth(depth: int) -> None:
    refusal(TEXT.replace('"seed":7', '"seed":' + "[" * depth + "]" * depth))
    refusal('{"schema":' + "[" * depth + "]" * depth + "}")


def test_a_million_objects_are_refused_before_any_is_read() -> None:
    data = document()
    data["objects"] = [{}] * 1_000_000
    assert str(refusal(json.dumps(data))) == "objects: expected at most 1000 items, got 1000000"


REFUSED: list[tuple[tuple[str | int, ...], object, str]] = [
    (("objects", 0, "position_m", 2), math.inf, "document: expected finite numbers, got Infinity"),
    (("objects", 0, "yaw_rad"), "0", "objects[0].yaw_rad: expected a number in [-100.0, 100.0] rad, got '0'"),
    (("objects", 0, "size_m", 1), -1.0, "objects[0].size_m[1]: expected a number in [0.0005, 100.0] m, got -1.0"),
    (("objects", 0, "size_m"), [1, 2], "objects[0].size_m: expected 3 items, got 2"),
    (("objects", 0, "mass_kg"), 3, "objects[0].mass_kg: expected one of category"),
    (("objects", 0, "id"), 4, "objects: expected ids that are unique, got 4 twice"),
    (("objects", 0, "id"), 1, "objects: expected ids that are unique, got 1 twice"),
    (("objects", 0, "id"), 0, "objects[0].id: expected an integer in [1, 65535], got 0"),
    (("objects", 0, "label"), 41, "objects[0].label: expected an integer in [0, 40], got 41"),
    (("objects", 0, "category"), "bed;rm", "objects[0].category: expected a string that matches"),
    (("objects", 0, "group"), 99, "objects[0].group: expected the id of an object of the scene, got 99"),
    (("objects", 0, "parts", 1, "material"), "gold", "objects[0].parts.headboard: expected the id of a material of the scene, got 'gold'"),
    (("objects", 0, "parts", 1, "name"), "frame", "objects[0].parts: expected ids that are unique, got 'frame' twice"),
    (("objects", 0, "model"), {}, "objects[0].model: expected either a generator or a file, got neither"),
    (("objects", 0, "model", "file"), "bed.glb", "objects[0].model: expected either a generator or a file, got both"),
    (("objects", 0, "support"), {"kind": "object"}, "objects[0].support: expected an id for kind 'object' and for no other"),
    (("objects", 0, "support"), {"kind": "floor", "id": 4}, "objects[0].support: expected an id for kind 'object' and for no other"),
    (("objects", 0, "support"), {"kind": "air"}, "objects[0].support.kind: expected one of 'floor', 'wall', 'ceiling', 'object', got"),
    (("objects", 0, "support"), {"kind": "wall", "wall": 4}, "objects[0].support.wall: expected an edge below 4, got 4"),
    (("objects", 0, "support"), {"kind": "object", "id": 99}, "objects[0].support.id: expected the id of an object of the scene, got 99"),
    (("objects", 0, "support"), {"kind": "object", "id": 3}, "objects[0].support.id: expected supports that end at the room, got a cycle"),
    (("objects", 1, "support"), {"kind": "object", "id": 5}, "objects[1].support.id: expected supports that end at the room, got a cycle"),
    (("materials", 1, "id"), "oak", "materials: expected ids that are unique, got 'oak' twice"),
    (("materials", 1, "base_color", 0), 1.5, "materials[1].base_color[0]: expected a number in [0.0, 1.0], got 1.5"),
    (("room", "surfaces", 2, "name"), "sky", "room.surfaces: expected a material for 'ceiling', got none"),
    (("room", "polygon_m"), [[0, 0], [0, 3], [4, 3], [4, 0]], "room.polygon_m: expected a counter-clockwise outline with an area, got"),
    (("room", "polygon_m"), [[0, 0], [4, 0], [0, 0.001]], "room.polygon_m: expected a counter-clockwise outline with an area, got"),
    (("room", "polygon_m"), [[0, 0], [4, 0], [4, 3], [0, 3], [2, -1]], "room.polygon_m: expected an outline that does not cross itself"),
    (("room", "polygon_m"), [[0, 0], [4, 0], [4, 0], [4, 3], [0, 3]], "room.polygon_m[1]: expected edges of at least 0.001 m"),
    (("room", "polygon_m"), [[0, 0], [4, 0]], "room.polygon_m: expected at least 3 items, got 2"),
    (("room", "openings", 0, "wall"), 4, "room.openings[0].wall: expected an edge below 4, got 4"),
    (("room", "openings", 0, "offset_m"), 3.2, "room.openings[0].offset_m: expected an opening within its wall of 4.000 m, got end"),
    (("room", "openings", 0, "height_m"), 2.7, "room.openings[0].height_m: expected an opening below the ceiling at 2.600 m, got"),
    (("lights", 0, "object"), 99, "lights[0].object: expected the id of an object of the scene, got 99"),
    (("lights", 0, "part"), "wick", "lights[0].part: expected a part of object 5, got 'wick'"),
    (("camera_path",), [], "camera_path: expected at least 1 items, got 0"),
    (("camera_path", 0, "orientation", 3), 0.9, "camera_path[0].orientation: expected a unit quaternion, got length"),
    (("camera_path", 1, "stamp_ns"), 0, "camera_path[1].stamp_ns: expected stamps that increase, got 0"),
    (("camera_path", 1, "stamp_ns"), 10**30, "camera_path[1].stamp_ns: expected an integer in [0, 4611686018427387904] ns, got 1000"),
    (("parse_graph", "nodes", 1, "parent"), 1, "parse_graph.nodes[1].parent: expected an index below 1, got 1"),
    (("parse_graph", "energies", "overlap"), None, "parse_graph.energies.overlap: expected a number, got None"),
]


def dotted(place: object) -> str:
    return ".".join(map(str, place)) if isinstance(place, tuple) else ""


@pytest.mark.parametrize(("path", "value", "message"), REFUSED, ids=dotted)
def test_refuses_values(path: tuple[str | int, ...], value: object, message: str) -> None:
    data = document()
    put(data, path, value)
    assert str(refusal(json.dumps(data))).startswith(message)


def test_refuses_overlapping_openings_but_allows_a_skylight_above_a_door() -> None:
    data = document()
    second = {**data["room"]["openings"][0], "id": 9, "offset_m": 2.0}
    data["room"]["openings"].append(second)
    assert str(refusal(json.dumps(data))).startswith("room.openings[2].offset_m: expected openings that do not overlap")
    second |= {"sill_m": 2.1, "height_m": 0.4}
    assert len(scene_from_json(json.dumps(data)).room.openings) == 3


OUTSIDE = ["/etc/passwd", "../bed.glb", "beds/../../bed.glb", "..\\bed.glb", "a\0.glb", "a\nb", "half\ud800", ".", "~\x7f"]


@pytest.mark.parametrize("file", OUTSIDE)
def test_refuses_files_outside_the_catalogue(file: str) -> None:
    data = document()
    data["objects"][0]["model"] = {"file": file}
    assert refusal(json.dumps(data)).path == "objects[0].model.file"


@pytest.mark.parametrize("file", ["bed.glb", "beds/double bed..v2.glb", "b\u00e4r.obj"])
def test_allows_files_inside_the_catalogue(file: str) -> None:
    data = document()
    data["objects"][0]["model"] = {"file": file}
    assert scene_from_json(json.dumps(data)).objects[0].model.file == file


@pytest.mark.parametrize(
    "outline",
    [
        [[0, 0], [6, 0], [6, 4], [4, 4], [4, 2], [2, 2], [2, 4], [0, 4]],
        [[0, 0], [6, 0], [6, 4], [3, 4], [3, 2], [0, 2]],
        [[0, 0], [4, 0], [4, 3]],
    ],
    ids=["U", "L", "triangle"],
)
def test_allows_outlines_of_other_shapes(outline: list[list[float]]) -> None:
    data = document()
    data["room"] |= {"polygon_m": outline, "openings": []}
    assert len(scene_from_json(json.dumps(data)).room.polygon_m) == len(outline)


@pytest.mark.parametrize("place", [place for place in places(document()) if isinstance(place[-1], str)], ids=dotted)
def test_every_key_is_required_or_has_a_default(place: tuple[str | int, ...]) -> None:
    data = document()
    parent: Any = data
    for key in place[:-1]:
        parent = parent[key]
    del parent[place[-1]]
    try:
        scene_from_json(json.dumps(data))
    except FieldError as error:
        assert str(error).isprintable()
    else:
        optional = {"group", "style", "seed", "ajar", "parent", "choice", "log_probability", "object", "objects", "on", "hinge", "swing"}
        optional |= {
            "roughness",
            "metallic",
            "transmission",
            "diffuse_transmission",
            "ior",
            "clearcoat",
            "clearcoat_roughness",
            "sheen",
            "texture",
            "wear",
            "glow_cd_m2",
            "luminaires",
            "attempts",
            "overlap",
            "wall_distance",
        }
        assert place[-1] in optional


json_values: Callable[..., Any] = st.recursive(
    st.none() | st.booleans() | st.integers() | st.integers(-(10**40), 10**40) | st.floats() | st.text(max_size=20),
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(st.text(max_size=8), inner, max_size=4),
    max_leaves=8,
)  # type: ignore[assignment]


@settings(max_examples=400, deadline=None)
@given(st.sampled_from(places(document())), json_values)
def test_any_value_anywhere_is_read_or_refused(place: tuple[str | int, ...], value: object) -> None:
    data = document()
    put(data, place, value)
    text = json.dumps(data)
    try:
        scene = scene_from_json(text)
    except FieldError as error:
        assert str(error).isprintable()
    else:
        assert scene_from_json(scene_to_json(scene)) == scene


@settings(max_examples=200, deadline=None)
@given(st.binary(max_size=60) | st.text(max_size=60))
def test_any_text_is_refused(text: str | bytes) -> None:
    with pytest.raises(FieldError):
        scene_from_json(text)


@settings(max_examples=300, deadline=None)
@given(st.integers(0, len(TEXT) - 1), st.integers(1, 30), st.text(max_size=6))
def test_any_garbled_document_is_read_or_refused(start: int, length: int, patch: str) -> None:
    try:
        scene_from_json(TEXT[:start] + patch + TEXT[start + length :])
    except FieldError as error:
        assert str(error).isprintable()
