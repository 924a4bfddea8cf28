"""What is true of a room, as files: lights, camera path, map, mesh with ids, parse graph, labels; ``docs/truth.md`` tells their fields.

The free floor is as Nav2's ``map_server`` reads it.  It turns a pixel p into the occupancy (255 - p) / 255, and in its trinary mode calls a
cell occupied above ``occupied_thresh``, free below ``free_thresh``, unknown between them.  The image begins with the row of greatest y, an
OccupancyGrid with that of the lowest; ``origin`` is the pose of the image's lower left corner.
"""

import json
import math
import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from nav_msgs.msg import OccupancyGrid
from numpy.typing import NDArray

from grammar.drawing.parse_tree_view import parse_tree_view
from grammar.drawing.shapes import to_svg
from grammar.synthesize import FloorMap
from renderer.camera.config import CameraConfig
from renderer.export.lights import lights_table
from renderer.export.scene_glb import scene_to_glb
from renderer.scene.flatten import SURFACE_LABELS, flatten
from scene_description import CameraPose, Opening, SceneDescription, SceneObject, SceneSynthError, scene_to_json
from scene_description.label_standards import STANDARDS, label_standard
from scene_description.labels import instance_labels, part_ids
from scene_description.strict import to_mapping
from scene_description.tum_trajectory import trajectory_to_tum

MAP_IMAGE = "map.pgm"
_NUMBERS = re.compile(r"\[\n[-+0-9.eE,\s]+\]")


def truth_files(
    scene: SceneDescription, catalog_dir: Path | None, floor: FloorMap | None, recorded: Mapping[str, Sequence[CameraPose]]
) -> dict[str, bytes]:
    """Return file name -> content.

    ``floor``: its free floor; None: no map is written.
    ``recorded``: camera -> its poses in the room, where they are known from a bag; the scene's own path is written anyway.

    Raises:
        FlattenError: the scene cannot be made.
    """
    flat = flatten(scene, catalog_dir)
    files = {
        "scene.json": f"{scene_to_json(scene)}\n".encode(),
        "scene.glb": scene_to_glb(scene, flat, CameraConfig()),
        "lights.json": _json(lights_table(scene, flat)),
        "labels.json": _json(labels_table(scene)),
        "parse_graph.json": _json(to_mapping(scene.parse_graph)),
        "parse_graph.svg": to_svg(parse_tree_view(scene)).encode(),
        "trajectory.txt": trajectory_to_tum(scene.camera_path).encode(),
    }
    if floor is not None:
        files |= {MAP_IMAGE: map_pgm(floor.cells), "map.yaml": map_yaml(MAP_IMAGE, floor.resolution_m, floor.origin_m).encode()}
    return files | {f"trajectory_{camera}.txt": trajectory_to_tum(poses).encode() for camera, poses in recorded.items() if poses}


def labels_table(scene: SceneDescription) -> dict[str, Any]:
    """Return what the ids of a scene mean: surfaces, objects, parts and materials, with classes in every standard, and the standards."""
    things: list[Opening | SceneObject] = [*scene.room.openings, *scene.objects]
    colors = {key: row["color"] for key, row in instance_labels(scene).items()}
    objects: dict[str, dict[str, Any]] = {"0": {"name": "room", "color": colors[0]}}
    for thing in things:
        classes = _classes(thing.category, thing.label)
        objects[str(thing.id)] = {"name": thing.category, "color": colors[thing.id], "classes": classes}
    material_ids = {material.id: number for number, material in enumerate(scene.materials, 1)}
    owned = [(0, scene.room.surfaces), *((thing.id, thing.parts) for thing in things)]
    material_of = {f"{owner}/{part.name}": material_ids[part.material] for owner, parts in owned for part in parts}
    parts = {
        str(number): {"object": int(name.partition("/")[0]), "part": name.partition("/")[2], "material": material_of[name]}
        for name, number in part_ids(scene).items()
    }
    return {
        "schema": "scene_synth/labels/1",
        "scene": scene.id,
        "surfaces": {name: {"classes": _classes("", label)} for name, label in SURFACE_LABELS.items()},
        "objects": objects,
        "parts": parts,
        "materials": {str(number): {"name": name} for name, number in material_ids.items()},
        "standards": {name: {str(key): row for key, row in label_standard(name).semantic_labels().items()} for name in STANDARDS},
    }


def _classes(category: str, label: int) -> dict[str, int]:
    """Return the class of an object of a category and an NYU40 class in every standard."""
    return {name: label_standard(name).class_of(category, label) for name in STANDARDS}


def _json(data: Any) -> bytes:
    """Return JSON with lists of numbers on one line each; strings keep what is in them, as names and choices have no line breaks."""
    text = json.dumps(data, allow_nan=False, indent=1)
    return f"{_NUMBERS.sub(lambda found: ' '.join(found[0].split()).replace('[ ', '[').replace(' ]', ']'), text)}\n".encode()


FREE_PIXEL, UNKNOWN_PIXEL, OCCUPIED_PIXEL = 254, 205, 0
"""What ``map_saver`` writes for each."""

OCCUPIED_THRESH, FREE_THRESH = 0.65, 0.15
"""205 is an occupancy of 0.196: above this ``free_thresh``, so that unknown stays unknown."""

MAX_CELLS = 100_000_000


class MapError(SceneSynthError):
    """A map that cannot be written; one line."""


def map_pgm(cells: NDArray[np.int8]) -> bytes:
    """Return the image of a grid (h, w): 0 free, 100 occupied, -1 unknown, row 0 at the lowest y; a binary PGM of 8 bits."""
    pixels = np.full(cells.shape, UNKNOWN_PIXEL, np.uint8)
    pixels[cells == 0] = FREE_PIXEL
    pixels[cells == 100] = OCCUPIED_PIXEL
    height, width = cells.shape
    return f"P5\n{width} {height}\n255\n".encode() + np.flipud(pixels).tobytes()


def map_yaml(image: str, resolution_m: float, origin_m: tuple[float, float]) -> str:
    """Return the text beside the image of that name."""
    x, y = (repr(float(value)) for value in origin_m)
    lines = (
        f"image: {image}",
        "mode: trinary",
        f"resolution: {resolution_m!r}",
        f"origin: [{x}, {y}, 0.0]",
        "negate: 0",
        f"occupied_thresh: {OCCUPIED_THRESH}",
        f"free_thresh: {FREE_THRESH}",
    )
    return "\n".join(lines) + "\n"


def floor_of_message(grid: OccupancyGrid) -> FloorMap:
    """Return the free floor that was published.

    Raises:
        MapError: its numbers of rows, columns and cells do not agree, or its place is not finite.
    """
    width, height, cells = grid.info.width, grid.info.height, np.frombuffer(grid.data, np.int8)
    place = grid.info.origin.position
    if width * height != cells.size or not 0 < cells.size <= MAX_CELLS:
        raise MapError(f"map: expected {width} x {height} cells, at most {MAX_CELLS}, got {cells.size}")
    if not all(map(math.isfinite, (place.x, place.y, grid.info.resolution))) or grid.info.resolution <= 0.0:
        raise MapError(f"map: expected a finite origin and a resolution above 0, got {place.x}, {place.y}, {grid.info.resolution}")
    resolution_m = float(str(np.float32(grid.info.resolution)))  # the message has 32 bits: the shortest number that is the same there
    return FloorMap(cells.reshape(height, width), resolution_m, (place.x, place.y))
