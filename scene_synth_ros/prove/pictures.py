"""Checks of what cameras see: depth, ids and normals against the room's mesh, and pictures against each other."""

from __future__ import annotations

from collections.abc import Iterator
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from scene_synth_ros.dataset.camera import Camera, read_camera
from scene_synth_ros.dataset.part import CameraTopics, find_cameras
from scene_synth_ros.messages.cdr import CdrReader
from scene_synth_ros.messages.image_reader import read_image
from scene_synth_ros.prove.decode import PoseRows
from scene_synth_ros.prove.evidence import Evidence, Room
from scene_synth_ros.prove.lens import MODELS, directions, pixels
from scene_synth_ros.prove.room_mesh import Hits
from scene_synth_ros.prove.verdict import Verdict, at_most, share_off

Floats = NDArray[np.float64]

SAMPLES = 96
"""Pixels that are looked at in a frame."""
_EXACT_M, _EXACT_SHARE, _MILLIMETRE_M = 1e-3, 1e-4, 6e-4
_LAYERS = ("depth", "instance", "semantic", "normals", "flow")
_MOST_PAIRS = 60


class View(NamedTuple):
    """A frame at some pixels.

    Attributes:
        stamp_ns: its stamp.
        place: of the optical frame in the map, (3,).
        turn: of the optical frame to the map.
        pixels: (n, 2) int64, column and row.
        rays: (n, 3) unit, in the optical frame.
        images: layer -> whole image.
        values: layer -> (n,) or (n, c), the image at the pixels.
    """

    stamp_ns: int
    place: Floats
    turn: Rotation
    pixels: NDArray[np.int64]
    rays: Floats
    images: dict[str, NDArray[Any]]
    values: dict[str, NDArray[Any]]

    @property
    def distance(self) -> Floats:
        """How far along its ray each pixel's depth lies; infinite where nothing is, NaN where that is unknown."""
        return np.asarray(_metres(self.values["depth"]) / self.rays[:, 2])

    @property
    def points(self) -> Floats:
        """The points that are seen, in the map."""
        return np.asarray(self.place + self.turn.apply(self.rays * self.distance[:, None]))


def _metres(depth: NDArray[Any]) -> Floats:
    """Return depth in metres, NaN where it is unknown."""
    return np.where(depth == 0, np.nan, depth / 1000.0) if depth.dtype == np.uint16 else depth.astype(np.float64)


class Film(NamedTuple):
    """A camera in a room: its name, topics, lens and frames in the order of their stamps."""

    name: str
    topics: CameraTopics
    camera: Camera
    views: list[View]


@lru_cache(maxsize=64)
def films(evidence: Evidence, room: Room) -> tuple[Film, ...]:
    """Return what the cameras with depth and pose see in a room; lenses that CameraInfo cannot tell, and rolling shutters, are left out."""
    found = []
    for name, topics in find_cameras(evidence.messages.types).items():
        poses = room.poses(topics.pose) if topics.pose else None
        depth, info = topics.images.get("depth"), topics.infos.get("depth")
        first = next(iter(room.each(info)), None) if info else None
        if poses is None or not depth or first is None or room.group("camera").get("row_time_s"):
            continue
        camera = read_camera(name, first[1])
        if camera.model in MODELS and camera.K[0, 0] > 0.0:
            found.append(Film(name, topics, camera, list(_views(evidence, room, topics, camera, poses))))
    return tuple(found)


def _views(evidence: Evidence, room: Room, topics: CameraTopics, camera: Camera, poses: PoseRows) -> Iterator[View]:
    layers = {layer: topics.images[layer] for layer in _LAYERS if layer in topics.images}
    images: dict[int, dict[str, NDArray[Any]]] = {}
    for layer, topic in layers.items():
        for _, data in room.each(topic):
            image = read_image(evidence.messages.types[topic], data, topic, None)
            images.setdefault(image.header.stamp_ns, {})[layer] = image.pixels
    for stamp, place, quaternion in zip(poses.stamps.tolist(), poses.place, poses.quaternion, strict=True):
        shown = images.get(stamp, {})
        if "depth" not in shown or shown["depth"].shape != (camera.height, camera.width):
            continue
        random = np.random.default_rng(stamp % 2**32)
        spots = np.column_stack([random.integers(0, camera.width, SAMPLES), random.integers(0, camera.height, SAMPLES)])
        rays = directions(camera, spots.astype(np.float64))
        values = {layer: image[spots[:, 1], spots[:, 0]] for layer, image in shown.items() if image.shape[:2] == shown["depth"].shape}
        yield View(stamp, place, Rotation.from_quat(quaternion), spots, rays, shown, values)


def _hits(room: Room, film: Film) -> Hits | None:
    """Return what all rays of all views meet, view after view."""
    if room.mesh is None or not film.views:
        return None
    origins = np.concatenate([np.tile(view.place, (len(view.rays), 1)) for view in film.views])
    return room.mesh.cast(origins, np.concatenate([view.turn.apply(view.rays) for view in film.views]))


def depth_and_ids(evidence: Evidence, room: Room) -> Iterator[Verdict]:
    """Yield whether depth, object, class and normal of pixels are those of what their rays meet in the exported mesh."""
    for film in films(evidence, room):
        hits = _hits(room, film)
        if hits is None:
            continue
        stamps = np.repeat([view.stamp_ns for view in film.views], SAMPLES)
        distance, topics = np.concatenate([view.distance for view in film.views]), film.topics.images
        known, slack = ~np.isnan(distance), _EXACT_M + _EXACT_SHARE * np.where(np.isfinite(distance), distance, 0.0)
        if film.views[0].values["depth"].dtype == np.uint16:
            slack = slack + _MILLIMETRE_M
        with np.errstate(invalid="ignore"):
            near = (np.abs(distance - hits.distance) <= slack) | (np.isinf(distance) & np.isinf(hits.distance))
        yield from share_off("depth", topics["depth"], "pixels more than 1 mm off the exported mesh", ~near[known], stamps[known])
        met = near & known & np.isfinite(hits.distance)
        for layer, truth in (("instance", hits.object_id), ("semantic", hits.label)):
            if layer in topics and all(layer in view.values for view in film.views) and _is_nyu40(room, layer):
                values = np.concatenate([view.values[layer] for view in film.views])
                sure = met & (truth >= 0)
                wrong = values[sure] != truth[sure]
                yield from share_off("ids", topics[layer], "pixels with another id than the mesh", wrong, stamps[sure])
        if "normals" in topics and all("normals" in view.values for view in film.views):
            yield from _normals(film, hits, met, stamps)


def _is_nyu40(room: Room, layer: str) -> bool:
    return layer != "semantic" or room.group("streams").get("semantic_classes", "nyu40") == "nyu40"


def _normals(film: Film, hits: Hits, met: NDArray[np.bool_], stamps: NDArray[np.int64]) -> Iterator[Verdict]:
    topic = film.topics.images["normals"]
    normals = np.concatenate([view.values["normals"] for view in film.views]).astype(np.float64)[met]
    length = np.linalg.norm(normals, axis=1)
    yield from share_off("normals", topic, "normals not of unit length", np.abs(length - 1.0) > 1e-3, stamps[met])
    of_views = hits.normal.reshape(len(film.views), SAMPLES, 3)
    turned = np.concatenate([view.turn.inv().apply(faces) for view, faces in zip(film.views, of_views, strict=True)])[met]
    cosine = np.clip((normals * turned).sum(axis=1) / np.maximum(length, 1e-9), -1.0, 1.0)
    away = np.degrees(np.arccos(cosine))
    middle = [np.median(away)] if len(away) else []
    yield at_most("normals", topic, "median angle to the mesh's faces, whose edges are smoothed", middle, 2.0, "deg")


def reprojection(evidence: Evidence, room: Room) -> Iterator[Verdict]:
    """Yield whether what a frame sees falls, in the next, on or behind what that sees, with its depth, its object and its flow."""
    for film in films(evidence, room):
        pairs = [_Pair.of(film.camera, one, two) for one, two in zip(film.views[:-1], film.views[1:], strict=True)]
        if not pairs:
            continue
        depth, stamps = film.topics.images["depth"], np.concatenate([pair.stamps for pair in pairs])
        before, lost = (np.concatenate([getattr(pair, name) for pair in pairs]) for name in ("before", "lost"))
        yield from share_off("reprojection", depth, "points before what the next frame sees", before, stamps)
        yield at_most("reprojection", depth, "share of points not seen again", [lost.mean()] if len(lost) else [], 0.35)
        told = [(pair.strange, np.full(len(pair.strange), pair.stamp_ns)) for pair in pairs if pair.strange is not None]
        if told:
            strange, of = (np.concatenate(values) for values in zip(*told, strict=True))
            yield from share_off("reprojection", film.topics.images["instance"], "points of another object in the next frame", strange, of)
        flows = [pair.flow for pair in pairs if pair.flow is not None and len(pair.flow)]
        if flows:
            median = [np.median(np.concatenate(flows))]
            yield at_most("reprojection", film.topics.images["flow"], "median error of flow", median, 0.05, "px")


class _Pair(NamedTuple):
    """Points of a frame in the next.

    Where that is smooth: ``before``, in front of what is seen there, ``lost``, neither there nor in front, and ``stamps``.  Of those that
    are seen again: ``strange``, another object; ``flow``, its error (px).  None where the layer was not recorded.
    """

    stamp_ns: int
    stamps: NDArray[np.int64]
    before: NDArray[np.bool_]
    lost: NDArray[np.bool_]
    strange: NDArray[np.bool_] | None
    flow: Floats | None

    @classmethod
    def of(cls, camera: Camera, one: View, two: View) -> _Pair:
        """Look for the points of a view in another."""
        kept, columns, rows, z, spot = _seen_again(camera, one, two)
        around = np.stack([_metres(two.images["depth"][rows + i, columns + j]) for i in (-1, 0, 1) for j in (-1, 0, 1)])
        around = np.where(np.isnan(around), np.inf, around)
        low, high = around.min(axis=0), around.max(axis=0)
        off = np.abs(z - around[4])
        smooth = (high < 1.1 * low) & np.isfinite(high)
        same = (high < 1.02 * low) & (off < 0.005 * z)
        strange = flow = None
        if "instance" in one.values and "instance" in two.images:
            strange = (two.images["instance"][rows, columns] != one.values["instance"][kept])[same]
        if "flow" in one.values:
            told = one.values["flow"][kept].astype(np.float64)
            flow = np.linalg.norm(told - (spot - one.pixels[kept]), axis=1)[same]
        stamps = np.full(int(smooth.sum()), two.stamp_ns)
        return cls(two.stamp_ns, stamps, (z < 0.99 * low - 0.003)[smooth], (off > 0.02 * z + 0.003)[smooth], strange, flow)


def _seen_again(camera: Camera, one: View, two: View) -> tuple[NDArray[np.bool_], NDArray[np.int64], NDArray[np.int64], Floats, Floats]:
    """Return which points of a view fall into the next, and there: column, row, depth, and pixel with its fraction."""
    good = np.isfinite(one.distance)
    optical = two.turn.inv().apply(np.where(good[:, None], one.points, 0.0) - two.place)
    with np.errstate(invalid="ignore"):
        spot = pixels(camera, optical)
        inside = good & (optical[:, 2] > 0.05) & (spot > 1.0).all(axis=1) & (spot < (camera.width - 2.0, camera.height - 2.0)).all(axis=1)
    whole = np.rint(spot[inside]).astype(np.int64)
    return inside, whole[:, 0], whole[:, 1], optical[inside, 2], spot[inside]


def color(evidence: Evidence, room: Room) -> Iterator[Verdict]:
    """Yield whether colours stay on the points that depth and poses say, better than those of a frame earlier or later would."""
    for film in films(evidence, room):
        topic = film.topics.images.get("color")
        if topic is None or len(film.views) < 4:
            continue
        inner = range(1, len(film.views) - 2)
        wanted = inner[:: max(len(inner) // _MOST_PAIRS, 1)]
        needed = {film.views[k + j].stamp_ns for k in wanted for j in (-1, 0, 1, 2)}
        shown = {stamp: data for _, data in room.each(topic) if (stamp := CdrReader(data).header().stamp_ns) in needed}
        errors: dict[int, list[Floats]] = {-1: [], 0: [], 1: []}
        for k in wanted:
            one, two = film.views[k], film.views[k + 1]
            kept, columns, rows, z, _ = _seen_again(film.camera, one, two)
            same = np.abs(z - _metres(two.images["depth"][rows, columns])) < 0.01 * z
            old, rows, columns = one.pixels[kept][same], rows[same], columns[same]
            four = [shown.get(film.views[k + j].stamp_ns) for j in (-1, 0, 1, 2)]
            images = [read_image(evidence.messages.types[topic], data, topic, None).pixels.astype(np.float64) for data in four if data]
            if len(images) == 4:
                for shift, found in errors.items():
                    found.append(np.abs(images[1 + shift][old[:, 1], old[:, 0]] - images[2 + shift][rows, columns]).mean(axis=-1))
        if sum(map(len, errors[0])) >= SAMPLES:
            mean = {shift: float(np.mean(np.concatenate(values))) for shift, values in errors.items()}
            ratio = (mean[0] + 0.5) / (min(mean[-1], mean[1]) + 0.5)
            yield at_most("color", topic, "difference of colours, over that if they were of the frame before or after", [ratio], 1.15)
