"""What is true of a room, as files: lights, camera path, map, mesh with ids, parse graph, labels; ``docs/truth.md`` tells their fields."""

from __future__ import annotations

import json
import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from grammar.drawing.parse_tree_view import parse_tree_view
from grammar.drawing.shapes import to_svg
from grammar.synthesize import FloorMap
from renderer.camera.config import CameraConfig
from renderer.export.lights import lights_table
from renderer.export.scene_glb import scene_to_glb
from renderer.scene.flatten import SURFACE_LABELS, flatten
from scene_description import CameraPose, Opening, SceneDescription, SceneObject, scene_to_json
from scene_description.label_standards import STANDARDS, label_standard
from scene_description.labels import instance_labels, part_ids
from scene_description.strict import to_mapping
from scene_synth_ros.cli.files.map_files import map_pgm, map_yaml
from scene_synth_ros.convert.tum_trajectory import trajectory_to_tum

MAP_IMAGE = "map.pgm"
_NUMBERS = re.compile(r"\[\n[-+0-9.eE,\s]+\]")


def truth_files(
    scene: SceneDescription, catalog_dir: Path | None, floor: FloorMap | None, recorded: Mapping[str, Sequence[CameraPose]]
) -> dict[str, bytes]:
    """Return file name -> content.

    Args:
        scene: the room.
        catalog_dir: folder of the user's models.
        floor: its free floor; None: no map is written.
        recorded: camera -> its poses in the room, where they are known from a bag; the scene's own path is written anyway.

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
