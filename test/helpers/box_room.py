"""Small scenes made by hand, with known answers: quads and boxes, a room with window, lamp and boxes."""

from __future__ import annotations

from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from renderer.geometry.mesh import Mesh
from renderer.path import lights as lt
from renderer.scene.flat_scene import FlatScene, PartTable, Sky, tabulate_materials
from scene_description import Material
from scene_description.poses import look_at
from scene_description.types import CameraPose

BLACK = (0.0, 0.0, 0.0)
LOOK = ("transmission", "diffuse_transmission", "ior", "roughness", "metallic", "clearcoat", "clearcoat_roughness", "sheen", "glow_cd_m2")
DARK = Sky(*(np.zeros(3, np.float32) for _ in range(3)))


class Piece(NamedTuple):
    """One part of a scene: corner arrays (v, 3) and (f, 3), what it is and how it looks; matt unless told otherwise."""

    vertices: NDArray[np.float64]
    faces: NDArray[np.int64]
    name: str = "1/part"
    object_id: int = 1
    label: int = 1
    color: tuple[float, float, float] = (0.5, 0.5, 0.5)
    emission: tuple[float, float, float] = BLACK
    portal: bool = False
    transmission: float = 0.0
    diffuse_transmission: float = 0.0
    ior: float = 1.0
    roughness: float = 0.8
    metallic: float = 0.0
    clearcoat: float = 0.0
    clearcoat_roughness: float = 0.05
    sheen: float = 0.0
    glow_cd_m2: float = 0.0


def quad(corner: tuple[float, ...], along: tuple[float, ...], across: tuple[float, ...], **what: object) -> Piece:
    """A rectangle whose front looks along ``along`` x ``across``."""
    c, a, b = (np.array(item, np.float64) for item in (corner, along, across))
    return Piece(np.array([c, c + a, c + a + b, c + b]), np.array([[0, 1, 2], [0, 2, 3]]), **what)  # type: ignore[arg-type]


def box(low: tuple[float, ...], high: tuple[float, ...], inside: bool = False, **what: object) -> Piece:
    """An axis-aligned box with split vertices; ``inside`` turns its faces inwards."""
    low_, size = np.array(low, np.float64), np.subtract(high, low)
    vertices, faces = [], []
    for axis in range(3):
        for side in (0, 1):
            u, v = ((axis + 1) % 3, (axis + 2) % 3) if side != inside else ((axis + 2) % 3, (axis + 1) % 3)
            corner, along, across = np.zeros(3), np.zeros(3), np.zeros(3)
            corner[axis], along[u], across[v] = side, 1, 1
            faces.append(np.array([[0, 1, 2], [0, 2, 3]]) + 4 * len(vertices))
            vertices.append((np.array([corner, corner + along, corner + along + across, corner + across])) * size + low_)
    return Piece(np.concatenate(vertices), np.concatenate(faces), **what)  # type: ignore[arg-type]


def pierced(room: Piece, low: tuple[float, float], high: tuple[float, float]) -> Piece:
    """A room, a box seen from inside, with a hole from ``low`` to ``high`` (x, z) in its wall of greatest y, where a pane goes."""
    (x0, _, z0), (x1, y, z1) = room.vertices.min(axis=0), room.vertices.max(axis=0)
    (a, c), (b, d) = low, high
    strips = [(x0, z0, x1, c), (x0, d, x1, z1), (x0, c, a, d), (b, c, x1, d)]
    corners = np.array([[(p, y, q), (r, y, q), (r, y, s), (p, y, s)] for p, q, r, s in strips])
    faces = [np.array([[0, 1, 2], [0, 2, 3]]) + len(room.vertices) + 4 * i for i in range(4)]
    others = np.delete(room.faces, [6, 7], axis=0)
    return room._replace(vertices=np.concatenate([room.vertices, *corners]), faces=np.concatenate([others, *faces]))


def hollow_sphere(rings: int, first: int = 0, **what: object) -> Piece:
    """A ball of radius 1 about the origin that is seen from within, of 4 * rings * rings facets with split vertices.

    ``first``: ring with which it begins; those before leave a hole about the pole of greatest z.
    """
    polar, turn = np.meshgrid(np.linspace(0.0, np.pi, rings + 1), np.linspace(0.0, 2.0 * np.pi, 2 * rings + 1), indexing="ij")
    points = np.stack([np.sin(polar) * np.cos(turn), np.sin(polar) * np.sin(turn), np.cos(polar)], axis=-1)
    row, column = np.meshgrid(np.arange(first, rings), np.arange(2 * rings), indexing="ij")
    a = (row * (2 * rings + 1) + column).ravel()
    b = a + 2 * rings + 1
    faces = np.concatenate([np.stack([a, a + 1, b], axis=1), np.stack([a + 1, b + 1, b], axis=1)])
    return Piece(points.reshape(-1, 3)[faces.ravel()], np.arange(faces.size).reshape(-1, 3), **what)  # type: ignore[arg-type]


def scene(*pieces: Piece, sky: Sky = DARK) -> FlatScene:
    """Flatten pieces: one part and one material each, flat shading normals."""
    starts = np.cumsum([0, *(len(piece.vertices) for piece in pieces)])
    vertices = np.concatenate([piece.vertices for piece in pieces]).astype(np.float32)
    faces = np.concatenate([piece.faces + start for piece, start in zip(pieces, starts, strict=False)]).astype(np.uint32)
    a, b, c = (vertices[faces[:, corner]].astype(np.float64) for corner in range(3))
    normal = np.cross(b - a, c - a)
    normals = np.zeros(vertices.shape)
    normals[faces.ravel()] = np.repeat(normal / np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-30), 3, axis=0)
    counts = [len(piece.faces) for piece in pieces]
    column = lambda field, dtype: np.array([getattr(piece, field) for piece in pieces], dtype)  # noqa: E731
    index = np.arange(len(pieces), dtype=np.int32)
    parts = PartTable(
        column("object_id", np.uint16), column("label", np.uint8), index, column("emission", np.float32), column("portal", np.bool_)
    )
    materials = tabulate_materials(
        [
            Material(id=piece.name, family="test", base_color=piece.color, **{name: getattr(piece, name) for name in LOOK})
            for piece in pieces
        ]
    )
    mesh = Mesh(vertices, normals.astype(np.float32), faces, np.ascontiguousarray(vertices[:, :2]))
    return FlatScene(mesh, np.repeat(index, counts).astype(np.int32), parts, tuple(piece.name for piece in pieces), materials, sky)


def pose(position: tuple[float, float, float], target: tuple[float, float, float]) -> CameraPose:
    """A camera at ``position`` that looks at ``target``."""
    return CameraPose(stamp_ns=0, position_m=position, orientation=look_at(position, target))


def furnished_room() -> FlatScene:
    """A room of 4 x 5 x 2.6 m with a window in the wall y = 5, a lamp under the ceiling and three boxes."""
    day = Sky(np.array([2500, 3500, 6000], np.float32), np.array([6000, 6500, 7500], np.float32), np.array([900, 850, 700], np.float32))
    return scene(
        pierced(
            box((0, 0, 0), (4, 5, 2.6), inside=True, name="0/shell", object_id=0, label=1, color=(0.75, 0.72, 0.68)), (1.2, 0.9), (2.8, 2.1)
        ),
        quad((1.2, 5, 0.9), (1.6, 0, 0), (0, 0, 1.2), name="9/pane", object_id=9, label=9, portal=True, transmission=0.8),
        box((1.9, 1.4, 2.2), (2.1, 1.6, 2.3), name="2/lamp", object_id=2, label=35, emission=(9000, 7000, 4500)),
        box((0.1, 1.0, 0.0), (1.7, 3.0, 0.5), name="3/bed", object_id=3, label=4, color=(0.3, 0.35, 0.6)),
        box((3.3, 1.0, 0.0), (3.95, 2.4, 1.9), name="4/wardrobe", object_id=4, label=39, color=(0.5, 0.3, 0.15)),
        box((0.1, 3.1, 0.0), (0.6, 3.6, 0.55), name="5/stand", object_id=5, label=32, color=(0.6, 0.1, 0.08)),
        sky=day,
    )


def joined(pieces: list[Piece]) -> Piece:
    """All of them as one part, which looks as the first does."""
    starts = np.cumsum([0, *(len(piece.vertices) for piece in pieces)])
    faces = [piece.faces + start for piece, start in zip(pieces, starts, strict=False)]
    return pieces[0]._replace(vertices=np.concatenate([piece.vertices for piece in pieces]), faces=np.concatenate(faces))


def l_shaped_room() -> FlatScene:
    """A room of 4 x 4 x 2.6 m with an arm of 1.8 x 3 m, at whose end a window in a recess shines past the bent slats of a blind."""
    wall = {"name": "0/shell", "object_id": 0, "color": (0.8, 0.8, 0.8), "roughness": 1.0}
    outline = [(0, 7), (0, 0), (4, 0), (4, 4), (1.8, 4), (1.8, 7)]
    walls = [quad((*a, 0), (0, 0, 2.6), (b[0] - a[0], b[1] - a[1], 0), **wall) for a, b in pairwise(outline)]
    halls = [((0, 0), (4, 4)), ((0, 4), (1.8, 3))]
    levels = [quad((*corner, 0), (x, 0, 0), (0, y, 0), **wall) for corner, (x, y) in halls]
    levels += [quad((*corner, 2.6), (0, y, 0), (x, 0, 0), **wall) for corner, (x, y) in halls]
    around = ((0, 0, 1.8, 0.9), (0, 2.1, 1.8, 2.6), (0, 0.9, 0.4, 2.1), (1.4, 0.9, 1.8, 2.1))
    end = [quad((a, 7, b), (c - a, 0, 0), (0, 0, d - b), **wall) for a, b, c, d in around]
    rim = [(0.4, 0.9), (0.4, 2.1), (1.4, 2.1), (1.4, 0.9), (0.4, 0.9)]
    recess = [quad((a[0], 7, a[1]), (0, 0.13, 0), (b[0] - a[0], 0, b[1] - a[1]), **wall) for a, b in pairwise(rim)]
    pane = quad((0.4, 7.13, 0.9), (1, 0, 0), (0, 0, 1.2), name="9/pane", object_id=9, portal=True, transmission=0.8)
    turn = np.linspace(-0.9, 0.9, 5)
    profile = np.column_stack([np.sin(turn), np.cos(turn)])
    spots = [(7.1 + 0.0125 * a, z + 0.0125 * b) for z in np.arange(0.92, 2.08, 0.022) for a, b in profile]
    strips = [quad((0.42, *spots[i]), (0.96, 0, 0), (0, *np.subtract(spots[i + 1], spots[i]))) for i in range(len(spots) - 1) if i % 5 < 4]
    blind = joined(strips)._replace(name="8/blind", object_id=8, color=(0.8, 0.8, 0.8), roughness=1.0)
    sky = Sky(np.array([2500, 3500, 6000], np.float32), np.array([6000, 6500, 7500], np.float32), np.array([900, 850, 700], np.float32))
    flat = scene(joined([*walls, *levels, *end, *recess]), pane, blind, sky=sky)
    normals, slats = flat.mesh.normals.copy(), len(blind.vertices)
    smooth = np.column_stack([np.zeros(len(spots)), np.tile(profile, (len(spots) // 5, 1))])
    first = np.array([i for i in range(len(spots) - 1) if i % 5 < 4])
    normals[-slats:] = smooth[np.column_stack([first, first, first + 1, first + 1])].reshape(-1, 3)
    return flat._replace(mesh=flat.mesh._replace(normals=normals))


VIEW = pose((3.4, 0.4, 1.6), (1.3, 3.2, 0.8))
"""A view of :func:`furnished_room` with the window, the bed and the wardrobe in it."""


def emitter_column(lights, column):
    """Return three numbers (e, 3) of each emitter from ``column`` on."""
    return lights.emitters.reshape(-1, lt.EMITTER_SIZE)[:, column : column + 3]
