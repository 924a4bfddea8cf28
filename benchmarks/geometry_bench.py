"""Geometry: from the description of a bedroom with 30 objects to its flat scene, one core, and what it takes of memory."""

from __future__ import annotations

import time
from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from benchmarks.table import Row, at_most
from grammar import SceneRequest
from grammar.synthesize import CameraTimes, SceneSynthesizer
from renderer.path.surface_tables import build_surfaces
from renderer.scene.flat_scene import FlatScene
from renderer.scene.flatten import flatten
from renderer.textures.tile import forget_tiles
from scene_description import SceneDescription, SceneObject

OBJECTS, BEDROOMS, WARM_BEDROOMS = 30, 40, 24
LIMIT_S = 0.3


def measure() -> list[Row]:
    """Build bedrooms one after the other, as a renderer does, and return the times of one room."""
    rooms = list(_bedrooms())
    for room in rooms:
        flatten(room)  # compiles and loads the kernels
    forget_tiles()
    seconds = [_processor_seconds(room) for room in rooms]
    next_rooms, again = seconds[WARM_BEDROOMS:], [_processor_seconds(room) for room in rooms[WARM_BEDROOMS:]]
    cold = []
    for room in rooms[:6]:
        forget_tiles()
        cold.append(_processor_seconds(room))
    flats = [flatten(room) for room in rooms[WARM_BEDROOMS:]]
    return [
        at_most(f"geometry of the next bedroom of {OBJECTS} objects, warm, median", float(np.median(next_rooms)), "s", LIMIT_S),
        Row(f"geometry of the next bedroom of {OBJECTS} objects, warm, longest", max(next_rooms), "s"),
        at_most("geometry of a bedroom whose textures are known, median", float(np.median(again)), "s", LIMIT_S),
        Row("geometry of a bedroom without any texture known, median", float(np.median(cold)), "s"),
        Row("triangles of a room, median", float(np.median([len(flat.mesh.faces) for flat in flats])), ""),
        Row("memory of a room's meshes and tables, median", float(np.median([_mesh_bytes(flat) for flat in flats])) / 1e6, "MB"),
        Row("memory of a room's textures, median", float(np.median([_texture_bytes(flat) for flat in flats])) / 1e6, "MB"),
    ]


def _bedrooms() -> Iterator[SceneDescription]:
    """Yield bedrooms of 30 objects: sampled ones, made up to the number by the things of the bedroom that follows."""
    synthesizer, times = SceneSynthesizer.from_config(), CameraTimes(frames=1, start_ns=0, rate_hz=1.0)
    rooms = [synthesizer.synthesize(SceneRequest(room_type="bedroom"), 1, index, times) for index in range(BEDROOMS + 4)]
    for first in range(BEDROOMS):
        room = rooms[first]
        objects, materials = list(room.objects), list(room.materials)
        for number, other in enumerate(rooms[first + 1 :]):
            objects += [_renamed(thing, number) for thing in other.objects]
            materials += [replace(material, id=f"{number}:{material.id}") for material in other.materials]
            if len(objects) >= OBJECTS:
                break
        yield replace(room, objects=tuple(objects[:OBJECTS]), materials=tuple(materials))


def _renamed(thing: SceneObject, number: int) -> SceneObject:
    parts = tuple(replace(part, material=f"{number}:{part.material}") for part in thing.parts)
    return replace(thing, id=thing.id + 1000 * (number + 1), parts=parts)


def _processor_seconds(room: SceneDescription) -> float:
    began = time.process_time()
    flatten(room)
    return time.process_time() - began


def _mesh_bytes(flat: FlatScene) -> int:
    arrays = (*flat.mesh, flat.face_part, *flat.parts, flat.part_texture)
    return sum(array.nbytes for array in arrays)


def _texture_bytes(flat: FlatScene) -> int:
    return build_surfaces(flat).textures.texels.nbytes
