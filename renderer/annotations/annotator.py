"""Tells of a frame which objects it shows, and where: from its instance image, its rays and the scene's description.

The visible pixels are those of the instance image.  What an object would cover if it were alone is told by the same rays, cast at a scene
that holds nothing else; what it would cover beyond the image's borders by its projected triangles.
"""

from types import TracebackType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from renderer.annotations.extents import Extent, project_extent
from renderer.annotations.object_meshes import ObjectMeshes
from renderer.annotations.pixels import BOTTOM, COUNT, LEFT, RIGHT, TOP, empty_tally, find_hidden, tally_cover, tally_ids
from renderer.annotations.projection import Projection
from renderer.annotations.run_lengths import mask_of
from renderer.annotations.things import corners_m, seen_from, things_of
from renderer.camera.camera_rays import CENTRE, TILE
from renderer.camera.cameras import PosedCamera
from renderer.camera.config import CameraConfig
from renderer.core.arrays import Array
from renderer.core.embree import SceneHandle
from renderer.core.ray_packet import make_packet
from renderer.core.workers import Workers
from renderer.scene.flat_scene import FlatScene
from scene_description import SceneDescription
from scene_description.annotations import Box2D, FrameAnnotations, KeyPoint, ObjectAnnotation, Relation
from scene_description.label_standards import StandardName, label_standard
from scene_description.types import CameraPose

MARGIN_PX, _BENT_MARGIN_PX = 2.0, 8.0
"""How far beyond its projected triangles an object is looked for; between the points that bound it, a bent edge may bulge."""


class Annotator:
    """Annotates the frames of one room and one camera; a context manager that releases Embree's memory.

    An object's triangles are set apart when the first frame shows it.  Results depend on the scene, the camera and the frame only.

    ``masks``: whether masks are wanted; ``portable``: as of ``RenderConfig``; ``classes``: the label standard that classes are told in.
    """

    def __init__(
        self,
        flat: FlatScene,
        scene: SceneDescription,
        camera: CameraConfig,
        *,
        masks: bool = False,
        portable: bool = False,
        classes: StandardName = "nyu40",
    ) -> None:
        self._meshes = ObjectMeshes(flat, portable=portable)
        self._things = things_of(scene, self._meshes, label_standard(classes))
        self._rows = max((*self._meshes.ids, 0)) + 1
        self._scene, self._camera, self._masks = scene.id, camera, masks

    def annotate(
        self, instance: NDArray[Any], pose: CameraPose, view: PosedCamera, tree: SceneHandle, workers: Workers
    ) -> FrameAnnotations:
        """Return the annotations of a frame.

        ``instance``: (height, width) uint16, the layer of this name; ``pose``: of the optical frame; ``view``, ``tree``: the camera as its
        rays were aimed, and what they were cast at.
        """
        height, width = instance.shape
        tallies = empty_tally(self._rows, width, height)
        tally_ids(instance, tallies)
        keys = [key for key in sorted(self._things) if tallies[key, COUNT]]
        projection = Projection(self._camera, pose, view)
        extents = {key: project_extent(self._meshes, key, projection) for key in keys}
        covers = self._covers(instance, view, extents, projection, workers)
        corners = self._corners(keys, projection, tree)
        columns = np.ascontiguousarray(instance.T) if self._masks else None
        objects = []
        for key in keys:
            thing, own, cover = self._things[key], tallies[key], covers[key]
            full, outside = _full_box(cover, extents[key], width, height)
            objects.append(
                ObjectAnnotation(
                    id=key,
                    category=thing.category,
                    label=thing.label,
                    label_name=thing.label_name,
                    visible_box=pixel_box(own),
                    full_box=full,
                    visible_pixels=int(own[COUNT]),
                    full_pixels=int(cover[COUNT]),
                    visible_fraction=round(int(own[COUNT]) / int(cover[COUNT]), 6),
                    truncation=outside,
                    camera_box=seen_from(thing.box, pose),
                    world_box=thing.box,
                    corners=corners[key],
                    mask=None if columns is None else mask_of(columns, key, int(own[LEFT]), int(own[RIGHT])),
                )
            )
        return FrameAnnotations(
            stamp_ns=pose.stamp_ns,
            scene=self._scene,
            width=width,
            height=height,
            objects=tuple(objects),
            relations=self._relations_among(keys),
        )

    def _relations_among(self, keys: list[int]) -> tuple[Relation, ...]:
        there = {None, *keys}
        return tuple(relation for key in keys for relation in self._things[key].relations if relation.object in there)

    def _covers(
        self, instance: NDArray[np.uint16], view: PosedCamera, extents: dict[int, Extent], projection: Projection, workers: Workers
    ) -> dict[int, NDArray[np.int64]]:
        """Return the tally of the pixels that each object would cover if it were alone."""
        covers = {key: empty_tally(1, view.width, view.height)[0] for key in extents}
        trees = {key: self._meshes.tree(key).handle for key in extents}
        packets = [make_packet() for _ in range(workers.count)]
        margin = MARGIN_PX if projection.is_straight else _BENT_MARGIN_PX

        def count(worker: int, key: int) -> None:
            tiles = tiles_of(extents[key], margin, view, projection.is_planar)
            tally_cover(trees[key], view, packets[worker], CENTRE, instance, key, tiles, covers[key])

        workers.run(count, extents)
        return covers

    def _corners(self, keys: list[int], projection: Projection, tree: SceneHandle) -> dict[int, tuple[KeyPoint, ...]]:
        """Return the corners of the boxes of objects."""
        points = np.concatenate([corners_m(self._things[key].box) for key in keys]) if keys else np.zeros((0, 3))
        seen = projection.see(points)
        places = projection.place(seen.optical_m)
        hidden = np.zeros(len(points), np.bool_)
        origins, ends = (np.ascontiguousarray(item, np.float32) for item in (seen.origin_m, points))
        find_hidden(tree, make_packet(), origins, ends, hidden)
        size = np.array([self._camera.width, self._camera.height])
        inside: NDArray[np.bool_] = np.all((places >= 0.0) & (places < size), axis=1)
        depths = seen.optical_m[:, 2]
        told = [_key_point(*row) for row in zip(places.tolist(), depths.tolist(), inside.tolist(), hidden.tolist(), strict=True)]
        return {key: tuple(told[8 * i : 8 * i + 8]) for i, key in enumerate(keys)}

    def close(self) -> None:
        """Release Embree's memory; harmless when repeated."""
        self._meshes.close()

    def __enter__(self) -> "Annotator":
        """Return the annotator itself."""
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        """Release everything."""
        self.close()


def _key_point(place: list[float], depth: float, inside: bool, hidden: bool) -> KeyPoint:
    u, v = (None if np.isnan(item) else round(item, 3) + 0.0 for item in place)
    behind = depth <= 0.0
    return KeyPoint(depth_m=round(depth, 6) + 0.0, in_image=inside, behind=behind, occluded=hidden, u_px=u, v_px=v)


def tiles_of(extent: Extent, margin: float, view: PosedCamera, planar: bool) -> NDArray[np.int64]:
    """Return first and last column and row of the tiles where an object may be; all, where its extent does not bound it."""
    last = np.array([(view.width - 1) // TILE, (view.height - 1) // TILE])
    if not (planar and extent.whole):
        return np.array([0, last[0], 0, last[1]], np.int64)
    low = np.array([extent.left - margin, extent.top - margin])
    high = np.array([extent.right + margin, extent.bottom + margin])
    first = np.clip(np.floor(low / TILE), 0, last).astype(np.int64)
    end = np.clip(np.floor(high / TILE), first, last).astype(np.int64)
    return np.array([first[0], end[0], first[1], end[1]], np.int64)


def pixel_box(tally: NDArray[np.int64]) -> Box2D:
    """Return the box around the pixels of a tally (5,), which has some."""
    x, y = float(tally[LEFT]), float(tally[TOP])
    return Box2D(x=x, y=y, width=float(tally[RIGHT]) + 1.0 - x, height=float(tally[BOTTOM]) + 1.0 - y)


def _full_box(cover: NDArray[np.int64], extent: Extent, width: int, height: int) -> tuple[Box2D, float]:
    """Return the box around all of an object, and the share of it outside the image.

    An object that ends within the image has the box of the pixels that it would cover; one that does not, the box of these and of its
    projected triangles.
    """
    box = pixel_box(cover)
    if not (extent.left < 0.0 or extent.top < 0.0 or extent.right > width or extent.bottom > height):
        return box, 0.0
    low: Array = np.minimum([box.x, box.y], [extent.left, extent.top])
    high: Array = np.maximum([box.x + box.width, box.y + box.height], [extent.right, extent.bottom])
    inside = np.minimum(high, [width, height]) - np.maximum(low, 0.0)
    x, y, right, bottom = (round(float(value), 3) + 0.0 for value in (*low, *high))
    share = 1.0 - float(np.prod(inside)) / float(np.prod(high - low))
    return Box2D(x=x, y=y, width=round(right - x, 3), height=round(bottom - y, 3)), round(min(max(share, 0.0), 1.0), 6)
