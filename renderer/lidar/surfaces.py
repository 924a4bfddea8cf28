"""What each part of a scene does to a laser beam."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from renderer.scene.flat_scene import FlatScene

MATT, GLOSS, ALPHA, THROUGH, MIRRORED = range(5)
"""Columns of ``LaserSurfaces.parts``."""
SMOOTH = 0.2
"""Greatest roughness of surfaces that a beam goes through, or leaves as from a mirror, in one piece."""
_NARROWEST = 0.02
_RED = 0


class LaserSurfaces(NamedTuple):
    """Triangle -> part, (m,) int32; parts: (p, 5) float32, see :func:`laser_surfaces`."""

    face_part: NDArray[np.int32]
    parts: NDArray[np.float32]


def laser_surfaces(flat: FlatScene) -> LaserSurfaces:
    """Tabulate a scene's parts.

    Scanners shine red or in the near infrared; colours are known in RGB only, so red stands for both.  Textures are left out: a part has
    the base colour of its material.  Columns: MATT, the matt reflectance; GLOSS, the Fresnel reflectance head-on; ALPHA, the width of the
    gloss (roughness squared, as of the renderer's materials, but 0.02 at least, the width over which a receiver collects); THROUGH and
    MIRRORED, the share of a beam that goes on behind the surface, or leaves as from a mirror, head-on.  Clear glass swallows what it does
    not let through; frosted glass is matt.
    """
    look, row = flat.materials, flat.parts.material
    base, metallic, through = look.base_color[row, _RED], look.metallic[row], look.transmission[row]
    smooth = look.roughness[row] <= SMOOTH
    parts = np.zeros((len(row), 5), np.float32)
    parts[:, MATT] = np.where(smooth & (through > 0.0), 0.0, base * (1.0 - metallic))
    parts[:, GLOSS] = ((look.ior[row] - 1.0) / (look.ior[row] + 1.0)) ** 2 * (1.0 - metallic) + base * metallic
    parts[:, ALPHA] = np.maximum(look.roughness[row] ** 2, _NARROWEST)
    clear = np.where(flat.parts.portal, 1.0, base)
    parts[:, THROUGH] = np.where(smooth, through * clear * (1.0 - metallic), 0.0)
    parts[:, MIRRORED] = np.where(smooth, parts[:, GLOSS], 0.0)
    if len(flat.absorbs):
        parts[flat.absorbs] = 0.0
        parts[flat.absorbs, ALPHA] = 1.0
    return LaserSurfaces(np.ascontiguousarray(flat.face_part), parts)
