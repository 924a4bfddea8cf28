"""A furnished room for the renderer's speed tables: procedural models set out by hand, so that figures stay comparable."""

from __future__ import annotations

import math

import numpy as np

from renderer import FlatScene, Mesh, PartTable, Sky, tabulate_materials
from renderer.geometry.coordinates import box_mapped
from renderer.geometry.shapes import merged, moved, rotated
from renderer.models import build_model
from renderer.scene.room_shell import build_opening, build_shell
from scene_description import CameraPose, Material, ModelReference, Opening, Part, Room
from scene_description.labels import LABEL_ID
from scene_description.poses import look_at

ROOM_M, HEIGHT_M = (5.0, 4.2), 2.7
FURNITURE = (
    # generator, size (depth, width, height), position, yaw in degrees
    ("bed", (2.1, 1.7, 1.1), (1.15, 3.0, 0.0), 0.0),
    ("nightstand", (0.4, 0.45, 0.5), (0.3, 1.85, 0.0), 0.0),
    ("table_lamp", (0.25, 0.25, 0.45), (0.3, 1.85, 0.5), 0.0),
    ("wardrobe", (0.6, 1.6, 2.1), (1.4, 0.35, 0.0), 90.0),
    ("desk", (0.7, 1.4, 0.75), (4.6, 1.4, 0.0), 180.0),
    ("desk_chair", (0.6, 0.6, 1.0), (3.9, 1.4, 0.0), 10.0),
    ("laptop", (0.25, 0.35, 0.24), (4.6, 1.3, 0.75), 180.0),
    ("mug", (0.1, 0.08, 0.1), (4.5, 1.8, 0.75), 40.0),
    ("armchair", (0.85, 0.9, 0.85), (4.2, 3.3, 0.0), 215.0),
    ("pouf", (0.45, 0.45, 0.4), (3.3, 2.9, 0.0), 0.0),
    ("rug", (1.6, 2.2, 0.012), (2.9, 2.2, 0.0), 0.0),
    ("bookshelf", (0.3, 0.9, 1.9), (3.2, 0.2, 0.0), 90.0),
    ("floor_lamp", (0.35, 0.35, 1.6), (4.7, 3.9, 0.0), 0.0),
    ("ceiling_lamp", (0.4, 0.4, 0.4), (2.5, 2.1, 2.3), 0.0),
    ("potted_plant", (0.5, 0.5, 1.0), (4.65, 0.4, 0.0), 0.0),
    ("potted_plant", (0.4, 0.4, 0.7), (2.6, 3.8, 0.0), 70.0),
    ("vase", (0.2, 0.2, 0.5), (4.7, 1.9, 0.75), 0.0),
    ("waste_bin", (0.25, 0.25, 0.3), (4.75, 2.3, 0.0), 0.0),
    ("book_stack", (0.2, 0.25, 0.15), (3.3, 2.9, 0.4), 25.0),
    ("picture", (0.03, 0.8, 0.6), (0.02, 3.0, 1.5), 0.0),
)
"""About 50,000 triangles."""
SHINING = {"shade": (2300.0, 1900.0, 1300.0)}
VIEW = CameraPose(stamp_ns=0, position_m=(4.75, 0.35, 1.65), orientation=look_at((4.75, 0.35, 1.65), (1.6, 2.9, 0.7)))


def furnished_room(copies: int = 1) -> FlatScene:
    """Return the room; every further copy adds all furniture again, a hand's breadth aside, to make the mesh heavier."""
    window = Opening(
        id=2, category="window", label=LABEL_ID["window"], wall=2, offset_m=1.6, sill_m=0.9, width_m=1.8, height_m=1.3,
        model=ModelReference(generator="window", seed=4), parts=(),
    )  # fmt: skip
    (depth, width), paint = ROOM_M, Part(name="wall", material="paint")
    room = Room(
        polygon_m=((0.0, 0.0), (depth, 0.0), (depth, width), (0.0, width)),
        height_m=HEIGHT_M,
        wall_thickness_m=0.2,
        openings=(window,),
        surfaces=(paint,),
    )
    parts: list[tuple[str, int, int, Mesh]] = [(name, 0, LABEL_ID["wall"], mesh) for name, mesh in build_shell(room).items()]
    parts += [(name, 2, window.label, mesh) for name, mesh in build_opening(room, window, "window", "default", 4).items()]
    for copy in range(copies):
        for index, (generator, size, (x, y, z), yaw_deg) in enumerate(FURNITURE):
            identity = 3 + copy * len(FURNITURE) + index
            for name, mesh in build_model(generator, "default", identity, size).items():
                turned = rotated(mesh, "z", math.radians(yaw_deg))
                parts.append((name, identity, 1 + index % 40, moved(turned, x + 0.07 * copy, y - 0.05 * copy, z)))
    return _flat_scene(parts)


def _flat_scene(parts: list[tuple[str, int, int, Mesh]]) -> FlatScene:
    """Give every part a material of its own, in a colour drawn from its index."""
    count = len(parts)
    names, identities, labels, meshes = zip(*parts, strict=True)
    colors = np.random.default_rng(1).uniform(0.2, 0.8, (count, 3)).astype(np.float32)
    colors[[name in ("wall", "ceiling") for name in names]] = 0.78
    shell = np.array(identities) == 0
    emission = np.array([(0.0, 0.0, 0.0) if dark else SHINING.get(name, (0.0, 0.0, 0.0)) for name, dark in zip(names, shell, strict=True)])
    panes = np.array([name == "pane" for name in names])
    return FlatScene(
        mesh=merged(*map(box_mapped, meshes)),
        face_part=np.repeat(np.arange(count, dtype=np.int32), [len(mesh.faces) for mesh in meshes]),
        parts=PartTable(
            np.array(identities, np.uint16),
            np.array(labels, np.uint8),
            np.arange(count, dtype=np.int32),
            emission.astype(np.float32),
            panes,
        ),
        part_names=tuple(f"{identity}/{name}" for identity, name in zip(identities, names, strict=True)),
        materials=tabulate_materials(
            [
                Material(id=name, family="bench", base_color=tuple(color), transmission=0.85 if pane else 0.0)
                for name, color, pane in zip(names, colors, panes, strict=True)
            ]
        ),
        sky=Sky(*(np.array(color, np.float32) for color in ((2500, 3500, 6000), (6000, 6500, 7500), (900, 850, 700)))),
    )
