"""Whether two scenes differ in their lights at most: then all that depends on shapes and materials can be shared."""

from __future__ import annotations

from typing import Any

import numpy as np

from renderer.scene.flat_scene import FlatScene

_PARTS = ("object_id", "material", "portal")
_FIELDS = ("mesh", "face_part", "materials", "part_texture", "textures", "absorbs")


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
