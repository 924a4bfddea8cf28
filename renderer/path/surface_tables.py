"""What the hit of a ray is looked up in: normals of triangles, the material of each part, textures, sky, profiles of lamps."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from renderer.bsdf.albedo import STEPS, Albedos, glass_table, reflected_table
from renderer.core.layout import Layout
from renderer.scene.flat_scene import FlatScene, Sky
from renderer.scene.sky import sky_of
from renderer.textures.look_up import Textures, build_textures
from renderer.textures.wear import Wear

# A row of ``Surfaces.materials``: what is known of a part before textures.
_ROW = Layout()
BASE = _ROW.field(3)  # linear r, g, b
EMISSION = _ROW.field(3)  # cd/m2
ROUGHNESS = _ROW.field()
METALLIC = _ROW.field()
TRANSMISSION = _ROW.field()
DIFFUSE_TRANSMISSION = _ROW.field()
OPENNESS = _ROW.field()  # share of a thin sheet that is holes
IOR = _ROW.field()
COAT = _ROW.field()
COAT_ROUGHNESS = _ROW.field()
SHEEN = _ROW.field()
PORTAL = _ROW.field()  # 1 for window panes
GLASS = _ROW.field()  # row of the albedo tables of glass, or -1
PROFILE = _ROW.field()  # 1 + row of the profiles, 0 for none
GLOW = _ROW.field()  # ``glow_cd_m2`` of the material: luminance of its own where the colour is white
WEAR = _ROW.field()  # how much of the scene's wear is shown
SPECIAL = _ROW.field()  # 1 where more than this row must be looked up, texture or wear, 2 where light of its own too
ROW_SIZE = _ROW.size


CLEAR = np.float32(0.5)
"""Transmission beyond which glass is clear."""
_MARGIN_M = 1e-3


class Surfaces(NamedTuple):
    """Triangles and parts of a scene, for kernels.

    normals: (m * 9,) float32, of the corners of each triangle; face_part: (m,) int32; materials: (p * ROW_SIZE,) float32, one row per part
    (flat, because LLVM turns look-ups at constant offsets into vector code); glass_boxes: (g, 6) float32, least and greatest corner of each
    part of clear glass, with a margin, metres; profiles: as in ``FlatScene``.
    """

    normals: NDArray[np.float32]
    face_part: NDArray[np.int32]
    materials: NDArray[np.float32]
    albedos: Albedos
    glass_boxes: NDArray[np.float32]
    textures: Textures
    sky: Sky
    profiles: NDArray[np.float32]
    wear: Wear


def build_surfaces(flat: FlatScene) -> Surfaces:
    """Resolve the materials of a scene's parts."""
    materials, parts = flat.materials, flat.parts
    row = parts.material
    holes = np.where(materials.diffuse_transmission > 0.0, materials.transmission, np.float32(0.0))
    clear = (materials.transmission[row] > holes[row]) & ~parts.portal
    iors, glass = np.unique(materials.ior[row[clear]], return_inverse=True)
    table = np.zeros((len(row), ROW_SIZE), np.float32)
    table[:, BASE : BASE + 3] = materials.base_color[row]
    table[:, EMISSION : EMISSION + 3] = parts.emission
    for column, values in (
        (ROUGHNESS, materials.roughness),
        (METALLIC, materials.metallic),
        (TRANSMISSION, materials.transmission - holes),
        (DIFFUSE_TRANSMISSION, holes + (np.float32(1.0) - holes) * materials.diffuse_transmission),
        (OPENNESS, holes),
        (IOR, materials.ior),
        (COAT, materials.clearcoat),
        (COAT_ROUGHNESS, materials.clearcoat_roughness),
        (SHEEN, materials.sheen),
        (GLOW, materials.glow_cd_m2),
    ):
        table[:, column] = values[row]
    # What has holes is matt: a boundary of its threads would make up for what they do not cover.
    table[holes[row] > 0.0, IOR] = 1.0
    for column in (METALLIC, COAT, SHEEN):
        table[holes[row] > 0.0, column] = 0.0
    table[:, PORTAL] = parts.portal
    table[clear, GLASS] = glass
    if len(flat.part_profile):
        table[:, PROFILE] = flat.part_profile + 1
    textured = flat.part_texture if len(flat.part_texture) else np.full(len(row), -1, np.int32)
    # What swallows all light is black and rough, and has no boundary.
    if len(flat.absorbs):
        table[flat.absorbs, :PROFILE] = 0.0
        table[flat.absorbs, EMISSION : EMISSION + 3] = parts.emission[flat.absorbs]
        table[flat.absorbs, ROUGHNESS] = table[flat.absorbs, IOR] = 1.0
        textured = np.where(flat.absorbs, -1, textured).astype(np.int32)
    lit = parts.portal | (parts.emission > 0.0).any(axis=1) | (table[:, GLOW] > 0.0)
    if len(flat.wear.layers):
        table[:, WEAR] = np.where(lit, 0.0, materials.wear[row])
    table[:, SPECIAL] = np.where(lit, 2.0, (textured >= 0) | (table[:, WEAR] > 0.0))
    return Surfaces(
        flat.mesh.normals[flat.mesh.faces].reshape(-1),
        np.ascontiguousarray(flat.face_part),
        table.reshape(-1),
        Albedos(
            reflected_table(),
            np.stack([glass_table(float(ior)) for ior in iors]) if len(iors) else np.zeros((0, 2, STEPS, STEPS), np.float32),
        ),
        _boxes(flat, np.flatnonzero(clear & (table[:, TRANSMISSION] > CLEAR))),
        build_textures(textured, flat.textures, flat.mesh.vertices, flat.mesh.uvs, flat.mesh.faces),
        Sky(*(np.ascontiguousarray(item, np.float32) for item in sky_of(flat))),
        np.ascontiguousarray(flat.profiles, np.float32),
        flat.wear,
    )


def _boxes(flat: FlatScene, parts: NDArray[np.int64]) -> NDArray[np.float32]:
    """Return the corners of boxes about parts, (n, 6) float32, metres."""
    corners = [flat.mesh.vertices[flat.mesh.faces[flat.face_part == part]].reshape(-1, 3) for part in parts]
    boxes = [np.concatenate([points.min(axis=0) - _MARGIN_M, points.max(axis=0) + _MARGIN_M]) for points in corners if len(points)]
    return np.array(boxes, np.float32).reshape(-1, 6)
