"""Refuses flat scenes that would make kernels read out of bounds or return NaN."""

import numpy as np
from numpy.typing import NDArray

from renderer.core.errors import RenderError
from renderer.scene.flat_scene import FlatScene, Sky
from renderer.textures.tile import TileKey
from scene_description.products import norm

SKY_COLORS = ("zenith", "horizon", "ground")

_RANGES = {"ior": (1.0, 3.0), "glow_cd_m2": (0.0, 1e6)}
"""Of material parameters that are no shares."""


def check_scene(flat: FlatScene) -> None:
    """Check shapes, types, index ranges and numbers of a flat scene.

    Raises:
        RenderError: the first fault found; faults of the mesh name the part.
    """
    mesh, parts, materials = flat.mesh, flat.parts, flat.materials
    faces, vertices, count, kinds = len(mesh.faces), len(mesh.vertices), len(flat.part_names), len(materials.roughness)
    for name, array, shape, dtype in (
        ("mesh.vertices", mesh.vertices, (vertices, 3), np.float32),
        ("mesh.normals", mesh.normals, (vertices, 3), np.float32),
        ("mesh.faces", mesh.faces, (faces, 3), np.uint32),
        ("mesh.uvs", mesh.uvs, (vertices, 2), np.float32),
        ("face_part", flat.face_part, (faces,), np.int32),
        ("parts.object_id", parts.object_id, (count,), np.uint16),
        ("parts.label", parts.label, (count,), np.uint8),
        ("parts.material", parts.material, (count,), np.int32),
        ("parts.emission", parts.emission, (count, 3), np.float32),
        ("parts.portal", parts.portal, (count,), np.bool_),
        *(
            (f"materials.{name}", table, (kinds, 3) if name == "base_color" else (kinds,), np.float32)
            for name, table in materials._asdict().items()
        ),
        *((f"sky.{name}", getattr(flat.sky, name), (3,), np.float32) for name in SKY_COLORS),
    ):
        if array.shape != shape or array.dtype != dtype:
            raise RenderError(f"scene {name}: expected {np.dtype(dtype)} {shape}, got {array.dtype} {array.shape}")
    _check_index("face_part", flat.face_part, count)
    _check_index("mesh.faces", mesh.faces, vertices)
    _check_index("parts.material", parts.material, kinds)
    _check_textures(flat)
    _check_mesh(flat, "vertices", mesh.vertices)
    _check_mesh(flat, "normals", mesh.normals)
    _check_mesh(flat, "uvs", mesh.uvs)
    for name, table in (("parts.emission", parts.emission), *((f"sky.{key}", getattr(flat.sky, key)) for key in SKY_COLORS)):
        _check_range(name, table, 0.0, np.inf)
    _check_sky(flat.sky)
    for name, table in materials._asdict().items():
        _check_range(f"materials.{name}", table, *_RANGES.get(name, (0.0, 1.0)))


def _check_sky(sky: Sky) -> None:
    """Check maps and sun."""
    for name, image in (("table", sky.table), ("bright", sky.bright)):
        if image.ndim != 3 or image.shape[2] != 3 or image.dtype != np.float32:
            raise RenderError(f"scene sky.{name}: expected float32 (h, w, 3), got {image.dtype} {image.shape}")
        if image.size:
            _check_range(f"sky.{name}", image, 0.0, np.inf)
    sun = sky.sun
    if len(sun) and (sun.shape != (7,) or sun.dtype != np.float32 or not np.isfinite(sun).all()):
        raise RenderError(f"scene sky.sun: expected 7 finite float32, got {sun.dtype} {sun.shape}")
    if len(sun) and not (abs(float(norm(sun[:3])) - 1.0) < 1e-3 and 0.0 < sun[3] < 1.0 and sun[4:].min() >= 0.0):
        raise RenderError(f"scene sky.sun: expected a unit direction, a radius and luminance of at least 0, got {sun.tolist()}")


def _check_textures(flat: FlatScene) -> None:
    chosen, count = flat.part_texture, len(flat.textures)
    if len(chosen) not in (0, len(flat.part_names)) or chosen.dtype != np.int32:
        raise RenderError(f"scene part_texture: expected int32, one per part or none, got {chosen.dtype} {chosen.shape}")
    _check_index("part_texture", chosen[chosen >= 0], count)
    for k, texture in enumerate(flat.textures):
        numbers = (*texture.size, texture.rotation_rad, texture.contrast, texture.relief, texture.shift, *np.ravel(texture.colors))
        if not np.isfinite(numbers).all() or min(texture.size) <= 0.0 or len(texture.colors) > 3:
            raise RenderError(f"scene textures[{k}]: expected finite numbers, a size above 0 and at most 3 colours, got {numbers}")
        if isinstance(texture.source, TileKey):
            continue
        shapes = [level.shape for level in texture.source.levels]
        wanted = [(max(shapes[0][0] >> n, 1), max(shapes[0][1] >> n, 1), 8) for n in range(max(shapes[0][:2]).bit_length())]
        powers = all(side & (side - 1) == 0 for side in shapes[0][:2])
        if not powers or shapes != wanted or any(level.dtype != np.uint8 for level in texture.source.levels):
            raise RenderError(f"scene textures[{k}].tile: expected uint8 levels from powers of two, halved down to 1 x 1, got {shapes}")


def _check_index(name: str, index: NDArray[np.signedinteger] | NDArray[np.unsignedinteger], count: int) -> None:
    if len(index) and (int(index.min()) < 0 or int(index.max()) >= count):
        raise RenderError(f"scene {name}: expected indices in [0, {count}), got {int(index.min())} to {int(index.max())}")


def _check_mesh(flat: FlatScene, what: str, rows: NDArray[np.float32]) -> None:
    """Refuse rows that are not finite, by the name of the first part that uses one."""
    bad = np.asarray(~np.isfinite(rows).all(axis=1))
    if not bad.any():
        return
    users = np.flatnonzero(bad[flat.mesh.faces].any(axis=1))
    owner = f"part '{flat.part_names[flat.face_part[users[0]]]}'" if len(users) else "no part"
    row = int(np.flatnonzero(bad)[0])
    raise RenderError(f"scene mesh.{what}: expected finite numbers, got {rows[row].tolist()} at vertex {row} of {owner}")


def _check_range(name: str, table: NDArray[np.float32], low: float, high: float) -> None:
    if not np.isfinite(table).all() or (len(table) and (table.min() < low or table.max() > high)):
        raise RenderError(f"scene {name}: expected finite numbers in [{low:g}, {high:g}], got {table.min():g} to {table.max():g}")
