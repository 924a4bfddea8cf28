"""The flat form of a scene that kernels take: one world-space triangle mesh and small look-up tables.

Hit triangle -> part -> (object, class, material); everything after the hit is table look-up.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from renderer.geometry.mesh import Mesh
from scene_description import Environment, Material

if TYPE_CHECKING:
    from renderer.textures.apply import AppliedTexture
from renderer.textures.wear import NO_WEAR, Wear


class PartTable(NamedTuple):
    """What each part is; all arrays have one entry per part.

    object_id: (p,) uint16, 0 for the room's shell; label: (p,) uint8, NYU40 class, or that of the standard which
    ``renderer.scene.semantic_classes`` has put there; material: (p,) int32, row of the material table; emission: (p, 3) float32, RGB
    luminance in cd/m2 that leaves the surface diffusely, 0 for what does not shine; portal: (p,) bool, True for window panes: they show the
    environment behind them, times ``transmission`` of their material.
    """

    object_id: NDArray[np.uint16]
    label: NDArray[np.uint8]
    material: NDArray[np.int32]
    emission: NDArray[np.float32]
    portal: NDArray[np.bool_]


class MaterialTable(NamedTuple):
    """Material parameters, one row per material, float32: base_color (k, 3), linear; the others (k,), as in ``Material``."""

    base_color: NDArray[np.float32]
    roughness: NDArray[np.float32]
    metallic: NDArray[np.float32]
    transmission: NDArray[np.float32]
    diffuse_transmission: NDArray[np.float32]
    ior: NDArray[np.float32]
    clearcoat: NDArray[np.float32]
    clearcoat_roughness: NDArray[np.float32]
    sheen: NDArray[np.float32]
    glow_cd_m2: NDArray[np.float32]
    wear: NDArray[np.float32]


def tabulate_materials(materials: Sequence[Material]) -> MaterialTable:
    """Return one row per material."""
    return MaterialTable(*(np.array([getattr(material, name) for material in materials], np.float32) for name in MaterialTable._fields))


NO_MAP = np.zeros((0, 0, 3), np.float32)
"""``table`` and ``bright`` of a sky without them."""

NO_SUN = np.zeros(0, np.float32)
"""``sun`` of a sky without one."""


class Sky(NamedTuple):
    """Environment luminance: zenith, horizon and ground, each (3,) float32, cd/m2.

    Where ``table`` is not empty it replaces these three: (h, w, 3) float32, an equirectangular map of the whole sphere, zenith in the first
    row, +x in the middle column, columns clockwise as seen from above.  sun: (7,) float32, unit direction to it, 1 - cos of its angular
    radius, mean luminance RGB; or ``NO_SUN``.  bright: (h, w, 3) float32, a map of what is added to ``table`` and sampled by direction.
    """

    zenith: NDArray[np.float32]
    horizon: NDArray[np.float32]
    ground: NDArray[np.float32]
    table: NDArray[np.float32] = NO_MAP
    sun: NDArray[np.float32] = NO_SUN
    bright: NDArray[np.float32] = NO_MAP


UNTEXTURED = np.zeros(0, np.int32)
"""``part_texture`` of a scene without any texture."""


NO_PROFILE = np.zeros(0, np.int32)
"""``part_profile`` of a scene whose lights all shine evenly."""

NO_PROFILES = np.zeros((0, 0), np.float32)
"""``profiles`` of such a scene."""

ALL_REFLECT = np.zeros(0, np.bool_)
"""``absorbs`` of a scene whose parts all reflect."""


UNNUMBERED = np.zeros(0, np.uint16)
"""``part_id`` of a scene whose parts have no numbers."""

NO_BOXES = np.zeros((0, 3, 4), np.float32)
"""``part_box`` of a scene that tells none."""


class FlatScene(NamedTuple):
    """A whole scene for the kernels.

    mesh: world-space triangles; face_part: (m,) int32, row of ``parts`` for each triangle; part_names: (p,) names, for people and layers
    by part: ``<object id>/<part name>``.  part_texture: (p,) int32, index of each part's texture among ``textures``, -1 for none; empty
    where no part has any.  absorbs: (p,) bool, parts that reflect nothing, whatever their material; empty where none does.
    part_profile: (p,) int32, row of ``profiles`` by which each part's luminance depends on direction, -1 for none; empty where none does.
    profiles: as ``renderer.scene.spot_lights.profile_row`` has them.  part_box: (p, 3, 4) float32, affine map from the world to the box of
    the object that each part belongs to, whose corners are (0, 0, 0) and (1, 1, 1); empty where no boxes are told.
    part_id: (p,) uint16, as ``scene_description.labels.part_ids`` has them, 0 for what it does not have; empty where none are told.
    light_id: the same, as ``scene_description.light_labels.light_ids`` has them.  steady: whether what is seen of a part shall not depend
    on other parts that are not seen, to the last bit, as scenes that are compared with each other need it.  wear: its layers.  outside: the
    environment whose surroundings ``renderer.scene.sky.sky_of`` adds to ``sky``; None where nothing stands there, or no window shows it.
    """

    mesh: Mesh
    face_part: NDArray[np.int32]
    parts: PartTable
    part_names: tuple[str, ...]
    materials: MaterialTable
    sky: Sky
    part_texture: NDArray[np.int32] = UNTEXTURED
    textures: tuple[AppliedTexture, ...] = ()
    absorbs: NDArray[np.bool_] = ALL_REFLECT
    part_profile: NDArray[np.int32] = NO_PROFILE
    profiles: NDArray[np.float32] = NO_PROFILES
    part_box: NDArray[np.float32] = NO_BOXES
    part_id: NDArray[np.uint16] = UNNUMBERED
    light_id: NDArray[np.uint16] = UNNUMBERED
    steady: bool = False
    wear: Wear = NO_WEAR
    outside: Environment | None = None


_PARTS = ("object_id", "material", "portal")
_FIELDS = ("mesh", "face_part", "materials", "part_texture", "textures", "absorbs", "wear")


def is_same_geometry(one: FlatScene, other: FlatScene) -> bool:
    """Return whether two scenes are alike but for sky, sun, labels, and the emission of parts whose material does not glow."""
    if not all(_is_equal(getattr(one, name), getattr(other, name)) for name in _FIELDS):
        return False
    if not all(_is_equal(getattr(one.parts, name), getattr(other.parts, name)) for name in _PARTS):
        return False
    glows = one.materials.glow_cd_m2[one.parts.material] > 0.0
    return bool(np.array_equal(one.parts.emission[glows], other.parts.emission[glows]))


def _is_equal(one: Any, other: Any) -> bool:
    """Return whether two values are equal: arrays, tuples of values, or anything that can be compared."""
    if one is other:
        return True
    if isinstance(one, np.ndarray):
        return one.dtype == other.dtype and np.array_equal(one, other)
    if isinstance(one, tuple):
        return len(one) == len(other) and all(map(_is_equal, one, other))
    return bool(one == other)
