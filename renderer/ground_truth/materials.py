"""What the hits belong to and what they are made of."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from renderer.ground_truth.hit_view import HitLayers, HitView
from renderer.ground_truth.opaque import is_clear

MIRROR_METALLIC, MIRROR_ROUGHNESS = 0.5, 0.15
"""From and up to which metalness and roughness a material shows an image of what is before it."""


def part(view: HitView) -> NDArray[np.uint16]:
    """Return ids of parts, (height, width), as ``scene_description.labels.part_ids`` has them."""
    flat = view.scene.flat
    ids = flat.part_id if len(flat.part_id) else np.zeros(len(flat.part_names), np.uint16)
    return view.of_part(ids).astype(np.uint16, copy=False)


def material(view: HitView) -> NDArray[np.uint16]:
    """Return ids of materials, (height, width): their place in the description, from 1 on."""
    return view.of_part((view.scene.flat.parts.material + 1).astype(np.uint16)).astype(np.uint16, copy=False)


def base_color(view: HitView) -> NDArray[np.float32]:
    """Return the linear base colour, (height, width, 3), texture included."""
    return view.surface.base_color


def roughness(view: HitView) -> NDArray[np.float32]:
    """Return the perceptual roughness, (height, width), texture included."""
    return view.surface.roughness


def metallic(view: HitView) -> NDArray[np.float32]:
    """Return the metalness, (height, width), texture included."""
    return view.surface.metallic


def emission(view: HitView) -> NDArray[np.float32]:
    """Return the luminance that the surface itself, or the sky behind a window pane, sends to the camera, (height, width, 3), cd/m2."""
    return view.surface.emission


def glass(view: HitView) -> NDArray[np.uint8]:
    """Return 255 where what is hit lets most of the light through, else 0."""
    return _mask(view, is_clear(view))


def mirror(view: HitView) -> NDArray[np.uint8]:
    """Return 255 where what is hit shows an image of what is before it, by its material's metalness and roughness, else 0."""
    materials, row = view.scene.flat.materials, view.scene.flat.parts.material
    return _mask(view, (materials.metallic[row] >= MIRROR_METALLIC) & (materials.roughness[row] <= MIRROR_ROUGHNESS))


def _mask(view: HitView, parts: NDArray[np.bool_]) -> NDArray[np.uint8]:
    return view.of_part(np.where(parts, 255, 0).astype(np.uint8)).astype(np.uint8, copy=False)


LAYERS: HitLayers = {
    "part": part,
    "material": material,
    "base_color": base_color,
    "roughness": roughness,
    "metallic": metallic,
    "emission": emission,
    "glass": glass,
    "mirror": mirror,
}
