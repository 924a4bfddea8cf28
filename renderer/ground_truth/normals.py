"""Normals in other frames than the basic layer's, and those that light is scattered by."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from renderer.ground_truth.hit_view import HitLayers, HitView


def normals_world(view: HitView) -> NDArray[np.float32]:
    """Return geometric unit normals towards the camera, (height, width, 3), world; 0 where nothing is hit."""
    return view.normals_world


def shading_normals(view: HitView) -> NDArray[np.float32]:
    """Return shading normals, (height, width, 3), optical frame at the frame's stamp; 0 where nothing is hit."""
    return view.turned(view.surface.shading_normals, view.camera.rotation.T)


def shading_normals_world(view: HitView) -> NDArray[np.float32]:
    """Return shading normals, those of smooth and textured surfaces, (height, width, 3), world; 0 where nothing is hit."""
    return view.surface.shading_normals


def incidence(view: HitView) -> NDArray[np.float32]:
    """Return the angles between rays and geometric normals, (height, width), radians; NaN where nothing is hit."""
    away = view.camera.position - view.position
    cosine = (away * view.normals_world).sum(axis=2) / np.maximum(np.sqrt((away * away).sum(axis=2)), np.float32(1e-30))
    angles: NDArray[np.float32] = np.arccos(np.clip(cosine, np.float32(0.0), np.float32(1.0)))
    return angles


LAYERS: HitLayers = {
    "normals_world": normals_world,
    "shading_normals": shading_normals,
    "shading_normals_world": shading_normals_world,
    "incidence": incidence,
}
