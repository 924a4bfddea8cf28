"""The JSON form of a scene description, strict both ways.

Reading checks the size of the text, its form, every field (types, ranges, finite numbers, unknown and missing keys) and then that the
parts of the scene agree: ids are unique, references point to something, quaternions have unit length, the floor polygon is simple and
counter-clockwise, model files stay inside the catalogue.  Nothing is allocated beyond the text's own size.
"""

import json
import math
from collections.abc import Iterable
from pathlib import Path, PurePosixPath
from typing import Final, NoReturn

from scene_description.ceilings import ceiling_over_opening_m, check_slopes
from scene_description.errors import SceneSynthError, read_at_most
from scene_description.kinematics import check_motion
from scene_description.polygons import signed_area_m2
from scene_description.strict import FieldError, from_mapping, shorten, to_mapping
from scene_description.types import MAX_OBJECTS, Material, ModelReference, Opening, Part, SceneDescription

SCHEMA: Final = "scene_synth/1"
MAX_TEXT_LENGTH = 32_000_000
MIN_EDGE_M = 0.001
SURFACES = ("floor", "wall", "ceiling")
"""What every room has a material for; ``skirting`` is there where it has one."""


def scene_to_json(scene: SceneDescription) -> str:
    """Return the canonical JSON text of a scene: fields in the order of the types, shortest exact numbers, one line."""
    return json.dumps(to_mapping(scene), ensure_ascii=True, allow_nan=False, separators=(",", ":"))


def scene_from_json(text: str | bytes) -> SceneDescription:
    """Read and check a scene description.

    Raises:
        FieldError: the text is too long, is no JSON, has another schema, or a field does not fit; one line with the field's path.
    """
    if len(text) > MAX_TEXT_LENGTH:
        raise FieldError("", f"at most {MAX_TEXT_LENGTH} characters", f"{len(text)}")
    try:
        data = json.loads(text, parse_constant=_refuse_constant, object_pairs_hook=_unique_keys)
    except RecursionError:
        raise FieldError("", "JSON of a scene", "nesting beyond the parser's depth") from None
    except ValueError as error:
        raise FieldError("", "JSON", f"text that does not parse ({error})") from None
    if not isinstance(data, dict):
        raise FieldError("", f"a JSON object with schema '{SCHEMA}'", shorten(data))
    if data.get("schema") != SCHEMA:
        raise FieldError("schema", f"'{SCHEMA}'", shorten(data.get("schema")))
    scene = from_mapping(SceneDescription, data)
    check_scene(scene)
    return scene


def read_scene(path: Path) -> SceneDescription:
    """Read and check the scene description in a file.

    Raises:
        FieldError: as of :func:`scene_from_json`, with the file before the field's path.
        SceneSynthError: it is too long.
        OSError: it cannot be read.
    """
    data = read_at_most(path, MAX_TEXT_LENGTH, SceneSynthError)
    try:
        return scene_from_json(data)
    except FieldError as error:
        raise FieldError(f"{path}: {error.path or 'document'}", error.expected, error.got) from None


def check_scene(scene: SceneDescription) -> None:
    """Check that the parts of a scene agree with each other.

    Raises:
        FieldError: with the path of the field that does not agree.
    """
    materials = {material.id for material in scene.materials}
    _check_unique("materials", [material.id for material in scene.materials])
    _check_materials(scene.materials)
    ids = [opening.id for opening in scene.room.openings] + [thing.id for thing in scene.objects]
    if len(ids) > MAX_OBJECTS:
        raise FieldError("objects", f"at most {MAX_OBJECTS} objects and openings", f"{len(ids)}")
    _check_unique("objects", ids)
    _check_parts("room.surfaces", scene.room.surfaces, materials)
    names = {part.name for part in scene.room.surfaces}
    for name in SURFACES:
        if name not in names:
            raise FieldError("room.surfaces", f"a material for '{name}'", "none")
    _check_polygon(scene)
    check_slopes(scene.room)
    _check_openings(scene, materials)
    _check_objects(scene, set(ids), materials)
    _check_lights(scene)
    if scene.environment.map is not None:
        check_file_path("environment.map.file", scene.environment.map.file)
    daylight = scene.environment.daylight
    if daylight is not None and abs(math.hypot(*daylight.sun_direction) - 1.0) > 1e-3:
        raise FieldError("environment.daylight.sun_direction", "a unit vector", f"length {math.hypot(*daylight.sun_direction):.6g}")
    for i, pose in enumerate(scene.camera_path):
        norm = math.hypot(*pose.orientation)
        if abs(norm - 1.0) > 1e-4:
            raise FieldError(f"camera_path[{i}].orientation", "a unit quaternion", f"length {norm:.6g}")
        if i and pose.stamp_ns <= scene.camera_path[i - 1].stamp_ns:
            raise FieldError(f"camera_path[{i}].stamp_ns", "stamps that increase", f"{pose.stamp_ns}")
    if scene.motion is not None:
        check_motion(scene.motion)
    for i, node in enumerate(scene.parse_graph.nodes):
        if node.parent is not None and node.parent >= i:
            raise FieldError(f"parse_graph.nodes[{i}].parent", f"an index below {i}", f"{node.parent}")


def _refuse_constant(name: str) -> NoReturn:
    raise FieldError("", "finite numbers", name)


def _unique_keys(pairs: list[tuple[str, object]]) -> dict[str, object]:
    mapping = dict(pairs)
    if len(mapping) < len(pairs):
        _check_unique("", (key for key, _ in pairs), "keys")
    return mapping


def _check_unique(path: str, ids: Iterable[object], noun: str = "ids") -> None:
    seen = set()
    for item in ids:
        if item in seen:
            raise FieldError(path, f"{noun} that are unique", f"{shorten(item)} twice")
        seen.add(item)


def _check_parts(path: str, parts: tuple[Part, ...], materials: set[str]) -> None:
    _check_unique(path, (part.name for part in parts))
    for part in parts:
        if part.material not in materials:
            raise FieldError(f"{path}.{part.name}", "the id of a material of the scene", repr(part.material))


def _check_model(path: str, model: ModelReference) -> None:
    if (model.generator is None) == (model.file is None):
        raise FieldError(path, "either a generator or a file", "both" if model.file else "neither")
    if model.file is not None:
        check_file_path(f"{path}.file", model.file)
    reading = model.reading
    if reading is not None and reading.front and reading.up and reading.front[1] == reading.up[1]:
        raise FieldError(f"{path}.reading.front", f"an axis across 'up' ({reading.up})", repr(reading.front))


def check_file_path(path: str, file: str) -> None:
    """Check that a path is relative and stays inside its folder.

    Raises:
        FieldError: it does not.
    """
    pure = PurePosixPath(file)
    if pure.is_absolute() or ".." in pure.parts or not pure.name or "\\" in file or not file.isprintable():
        raise FieldError(path, "a relative path inside the catalogue", shorten(file))


def _check_materials(materials: Iterable[Material]) -> None:
    for i, material in enumerate(materials):
        if material.images is not None:
            check_file_path(f"materials[{i}].images.file", material.images.file)
            if material.texture is not None:
                raise FieldError(f"materials[{i}]", "a texture or images", "both")


def _check_polygon(scene: SceneDescription) -> None:
    points = scene.room.polygon_m
    n = len(points)
    area = signed_area_m2(points)
    if area <= 0.01:
        raise FieldError("room.polygon_m", "a counter-clockwise outline with an area", f"signed area {area:.4g} m2")
    for i in range(n):
        if math.dist(points[i], points[(i + 1) % n]) < MIN_EDGE_M:
            raise FieldError(f"room.polygon_m[{i}]", f"edges of at least {MIN_EDGE_M} m", "two corners at one place")
    for i in range(n):
        for j in range(i + 1, n):
            neighbours = j == i + 1 or (i == 0 and j == n - 1)
            if not neighbours and _segments_cross(points[i], points[(i + 1) % n], points[j], points[(j + 1) % n]):
                raise FieldError("room.polygon_m", "an outline that does not cross itself", f"edges {i} and {j} cross")


def _segments_cross(a: tuple[float, float], b: tuple[float, float], c: tuple[float, float], d: tuple[float, float]) -> bool:
    def side(p: tuple[float, float], q: tuple[float, float], r: tuple[float, float]) -> float:
        return (q[0] - p[0]) * (r[1] - p[1]) - (q[1] - p[1]) * (r[0] - p[0])

    apart = any(max(a[k], b[k]) < min(c[k], d[k]) or max(c[k], d[k]) < min(a[k], b[k]) for k in (0, 1))
    return not apart and side(a, b, c) * side(a, b, d) <= 0.0 and side(c, d, a) * side(c, d, b) <= 0.0


def _check_openings(scene: SceneDescription, materials: set[str]) -> None:
    room = scene.room
    for i, opening in enumerate(room.openings):
        path = f"room.openings[{i}]"
        _check_model(f"{path}.model", opening.model)
        _check_parts(f"{path}.parts", opening.parts, materials)
        if opening.wall >= len(room.polygon_m):
            raise FieldError(f"{path}.wall", f"an edge below {len(room.polygon_m)}", f"{opening.wall}")
        length = math.dist(room.polygon_m[opening.wall], room.polygon_m[(opening.wall + 1) % len(room.polygon_m)])
        end, top = opening.offset_m + opening.width_m, opening.sill_m + opening.height_m
        if end > length + 1e-6:
            raise FieldError(f"{path}.offset_m", f"an opening within its wall of {length:.3f} m", f"end at {end:.3f} m")
        ceiling = ceiling_over_opening_m(room, opening)
        if top > ceiling + 1e-6:
            raise FieldError(f"{path}.height_m", f"an opening below the ceiling at {ceiling:.3f} m", f"top at {top:.3f} m")
        for j, other in enumerate(room.openings[:i]):
            if opening.wall == other.wall and _openings_overlap(opening, other):
                raise FieldError(f"{path}.offset_m", "openings that do not overlap", f"an overlap with openings[{j}]")


def _openings_overlap(a: Opening, b: Opening) -> bool:
    def apart(low_a: float, size_a: float, low_b: float, size_b: float) -> bool:
        return low_a + size_a <= low_b + 1e-6 or low_b + size_b <= low_a + 1e-6

    return not (apart(a.offset_m, a.width_m, b.offset_m, b.width_m) or apart(a.sill_m, a.height_m, b.sill_m, b.height_m))


def _check_objects(scene: SceneDescription, ids: set[int], materials: set[str]) -> None:
    supporter = {thing.id: thing.support.id for thing in scene.objects}
    for i, thing in enumerate(scene.objects):
        path = f"objects[{i}]"
        _check_model(f"{path}.model", thing.model)
        _check_parts(f"{path}.parts", thing.parts, materials)
        for name, reference in (("support.id", thing.support.id), ("group", thing.group)):
            if reference is not None and reference not in ids:
                raise FieldError(f"{path}.{name}", "the id of an object of the scene", f"{reference}")
        if (thing.support.kind == "object") != (thing.support.id is not None):
            raise FieldError(f"{path}.support", "an id for kind 'object' and for no other", f"kind '{thing.support.kind}'")
        if thing.support.wall is not None and thing.support.wall >= len(scene.room.polygon_m):
            raise FieldError(f"{path}.support.wall", f"an edge below {len(scene.room.polygon_m)}", f"{thing.support.wall}")
        seen, below = {thing.id}, thing.support.id
        while below is not None:
            if below in seen:
                raise FieldError(f"{path}.support.id", "supports that end at the room", f"a cycle through object {below}")
            seen.add(below)
            below = supporter.get(below)


def _check_lights(scene: SceneDescription) -> None:
    for i, spot in enumerate(scene.luminaires):
        path = f"luminaires[{i}]"
        if abs(math.hypot(*spot.direction) - 1.0) > 1e-3:
            raise FieldError(f"{path}.direction", "a unit vector", f"length {math.hypot(*spot.direction):.6g}")
        if spot.beam_rad > spot.field_rad:
            raise FieldError(f"{path}.beam_rad", f"at most field_rad = {spot.field_rad:g}", f"{spot.beam_rad:g}")
        if spot.intensities and (len(spot.intensities) < 2 or not max(spot.intensities) > 0.0):
            raise FieldError(f"{path}.intensities", "two numbers or more, one above 0", f"{len(spot.intensities)} numbers")
        if not max(spot.color) > 0.0:
            raise FieldError(f"{path}.color", "a colour that shines", "black")
    parts = {thing.id: {part.name for part in thing.parts} for thing in scene.objects}
    for i, light in enumerate(scene.lights):
        if light.object not in parts:
            raise FieldError(f"lights[{i}].object", "the id of an object of the scene", f"{light.object}")
        if light.part not in parts[light.object]:
            raise FieldError(f"lights[{i}].part", f"a part of object {light.object}", repr(light.part))
