"""Bare rooms for tests of shells, and the areas of their triangles."""

import numpy as np

from renderer.geometry.mesh import Mesh
from scene_description import ModelReference, Opening, Part, Room

RECTANGLE = ((0.0, 0.0), (4.0, 0.0), (4.0, 3.0), (0.0, 3.0))
L_SHAPE = ((0.0, 0.0), (5.0, 0.0), (5.0, 2.0), (2.5, 2.0), (2.5, 4.0), (0.0, 4.0))


def opening(number: int, category: str, wall: int, offset: float, sill: float, width: float, height: float, **more: str) -> Opening:
    return Opening(
        id=number,
        category=category,  # type: ignore[arg-type]
        label=8 if category == "door" else 9,
        wall=wall,
        offset_m=offset,
        sill_m=sill,
        width_m=width,
        height_m=height,
        model=ModelReference(generator=category),
        parts=(),
        **more,  # type: ignore[arg-type]
    )


def room_of(outline: tuple[tuple[float, float], ...], openings: tuple[Opening, ...] = ()) -> Room:
    surfaces = tuple(Part(name=name, material="m") for name in ("floor", "wall", "ceiling", "skirting"))
    return Room(polygon_m=outline, height_m=2.6, wall_thickness_m=0.15, openings=openings, surfaces=surfaces)


def area_vectors(mesh: Mesh) -> np.ndarray:
    a, b, c = (mesh.vertices[mesh.faces[:, k]].astype(np.float64) for k in range(3))
    return 0.5 * np.cross(b - a, c - a)
