"""What the hits belong to and what they are made of, by tables of the parts."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from renderer.core.kernel import entry
from renderer.ground_truth.hit_view import HitView, shared_fields
from renderer.ground_truth.opaque import is_clear
from renderer.path.ground_truth import Hits

MIRROR_METALLIC, MIRROR_ROUGHNESS = 0.5, 0.15
"""From and up to which metalness and roughness a material shows an image of what is before it."""


class PartValues(NamedTuple):
    """A number of each part (p,), or of the part at each pixel (height, width); a field for each layer of that name.

    part: uint16, as ``scene_description.labels.part_ids`` has them; material: uint16, its place in the description, from 1 on; glass:
    uint8, 255 for what lets most of the light through; mirror: uint8, 255 for what shows an image of what is before it, by its material's
    metalness and roughness.
    """

    part: NDArray[np.uint16]
    material: NDArray[np.uint16]
    glass: NDArray[np.uint8]
    mirror: NDArray[np.uint8]


def part_values(view: HitView) -> PartValues:
    """Return the images that the view's layers need, 0 where nothing is hit; the others have a height of 0."""
    flat, (height, width) = view.scene.flat, view.hits.face.shape
    materials, row = flat.materials, flat.parts.material
    smooth_metal = (materials.metallic[row] >= MIRROR_METALLIC) & (materials.roughness[row] <= MIRROR_ROUGHNESS)
    tables = PartValues(
        flat.part_id if len(flat.part_id) else np.zeros(len(flat.part_names), np.uint16),
        (row + 1).astype(np.uint16),
        np.where(is_clear(view), 255, 0).astype(np.uint8),
        np.where(smooth_metal, 255, 0).astype(np.uint8),
    )
    images = PartValues(*(np.empty((height if name in view.names else 0, width), table.dtype) for name, table in tables._asdict().items()))
    view.scene.in_rows(_look_up, flat.face_part, tables, view.hits, images)
    return images


@entry
def _look_up(face_part: NDArray[np.int32], tables: PartValues, hits: Hits, images: PartValues, first: int, step: int) -> None:
    height, width = hits.face.shape
    for y in range(first, height, step):
        for x in range(width):
            face = hits.face[y, x]
            part = face_part[face] if face >= 0 else -1
            if len(images.part):
                images.part[y, x] = tables.part[part] if part >= 0 else 0
            if len(images.material):
                images.material[y, x] = tables.material[part] if part >= 0 else 0
            if len(images.glass):
                images.glass[y, x] = tables.glass[part] if part >= 0 else 0
            if len(images.mirror):
                images.mirror[y, x] = tables.mirror[part] if part >= 0 else 0


LAYERS = shared_fields(part_values, PartValues._fields)
