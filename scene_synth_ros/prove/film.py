"""The frames of a camera in a room, at some pixels each, and what becomes of these in the next frame."""

from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from scene_synth_ros.dataset.camera import Camera, read_camera
from scene_synth_ros.dataset.part import CameraTopics, find_cameras
from scene_synth_ros.messages.image_reader import read_image
from scene_synth_ros.prove.decode import PoseRows
from scene_synth_ros.prove.evidence import Evidence, Reel, Room
from scene_synth_ros.prove.lens import MODELS, directions, pixels

Floats = NDArray[np.float64]
Images = dict[str, NDArray[Any]]

SAMPLES = 96
"""Pixels that are looked at in a frame, at least."""
_LEAST_OF_ALL = 100 * SAMPLES
"""Of all frames: where these are few, more of each are looked at, as noise hides much of what few pixels say."""
_LAYERS = ("depth", "instance", "semantic", "normals", "flow")
_SMOOTH, _FLAT, _SAME = 1.1, 1.02, 0.005
"""Greatest depth over the least about a pixel where a point may be missed, and where it may be found; share of depth by which it is."""


_NINE = np.array([(i, j) for j in (-1, 0, 1) for i in (-1, 0, 1)])


class View(NamedTuple):
    """A frame at some pixels.

    Attributes:
        stamp_ns: its stamp.
        place: of the optical frame in the map, (3,).
        turn: of the optical frame to the map.
        pixels: (n, 2) int64, column and row.
        rays: (n, 3) unit, in the optical frame.
        values: layer -> (n,) or (n, c), the image at the pixels.
        relief: (n,) what depth differs by about each pixel (m): so much may stand out between pixels; infinite where some is unknown.
    """

    stamp_ns: int
    place: Floats
    turn: Rotation
    pixels: NDArray[np.int64]
    rays: Floats
    values: Images
    relief: Floats

    @property
    def distance(self) -> Floats:
        """How far along its ray each pixel's depth lies; infinite where nothing is, NaN where that is unknown."""
        return np.asarray(metres(self.values["depth"]) / self.rays[:, 2])

    @property
    def points(self) -> Floats:
        """The points that are seen, in the map."""
        return np.asarray(self.place + self.turn.apply(self.rays * self.distance[:, None]))


class Pair(NamedTuple):
    """Points of a frame in the next.

    Attributes:
        stamp_ns: of the next frame.
        before, lost: (k,) where depth is smooth there: whether a point is in front of what is seen by more than its relief, or not there.
        old, new: (m, 2) pixels in both frames of the points that are seen again.
        strange: (m,) whether nothing about there is of their object; None where objects were not recorded.
        flow: (m,) error of their flow (px); None where that was not recorded.
    """

    stamp_ns: int
    before: NDArray[np.bool_]
    lost: NDArray[np.bool_]
    old: NDArray[np.int64]
    new: NDArray[np.int64]
    strange: NDArray[np.bool_] | None
    flow: Floats | None


class Film(NamedTuple):
    """A camera in a room: its topics, its frames in the order of their stamps, and each with the next."""

    topics: CameraTopics
    views: list[View]
    pairs: list[Pair]


@lru_cache(maxsize=1)
def films(evidence: Evidence, room: Room) -> tuple[Film, ...]:
    """Return what the cameras with depth and pose see in a room; lenses that CameraInfo cannot tell, and rolling shutters, are left out."""
    found = []
    for name, topics in find_cameras(evidence.types).items():
        poses = room.poses(topics.pose) if topics.pose else None
        depth, info = topics.images.get("depth"), topics.infos.get("depth")
        first = next(iter(room.each(info)), None) if info else None
        if poses is None or not depth or first is None or room.group("camera").get("row_time_s"):
            continue
        camera = read_camera(name, first[1])
        if camera.model in MODELS and camera.K[0, 0] > 0.0:
            found.append(_film(evidence, room, topics, camera, poses))
    return tuple(found)


def metres(depth: NDArray[Any]) -> Floats:
    """Return depth in metres, NaN where it is unknown."""
    return np.where(depth == 0, np.nan, depth / 1000.0) if depth.dtype == np.uint16 else depth.astype(np.float64)


def _film(evidence: Evidence, room: Room, topics: CameraTopics, camera: Camera, poses: PoseRows) -> Film:
    """Look at each frame once; no more than two are in memory."""
    film, count = Film(topics, [], []), max(SAMPLES, _LEAST_OF_ALL // max(len(poses.stamps), 1))
    reels = {layer: Reel(room.each(topics.images[layer])) for layer in _LAYERS if layer in topics.images}
    for stamp, place, quaternion in zip(poses.stamps.tolist(), poses.place, poses.quaternion, strict=True):
        messages = {layer: reel.at(stamp) for layer, reel in reels.items()}
        shown = {
            layer: read_image(evidence.types[topics.images[layer]], data, topics.images[layer], None).pixels
            for layer, data in messages.items()
            if data is not None
        }
        if "depth" not in shown or shown["depth"].shape != (camera.height, camera.width):
            continue
        random = np.random.default_rng(stamp % 2**32)
        spots = np.column_stack([random.integers(0, camera.width, count), random.integers(0, camera.height, count)])
        view = look(camera, stamp, (place, Rotation.from_quat(quaternion)), spots, shown)
        if film.views:
            film.pairs.append(follow(camera, film.views[-1], view, shown))
        film.views.append(view)
    return film


def look(camera: Camera, stamp_ns: int, pose: tuple[Floats, Rotation], spots: NDArray[np.int64], shown: Images) -> View:
    """Return what images, ``shown`` by layer, have at some pixels (n, 2); ``pose``: place and turn of the optical frame in the map."""
    values = {layer: image[spots[:, 1], spots[:, 0]] for layer, image in shown.items() if image.shape[:2] == shown["depth"].shape}
    low, _, high = _depths_about(shown["depth"], spots)
    return View(stamp_ns, *pose, spots, directions(camera, spots.astype(np.float64)), values, high - np.where(np.isfinite(low), low, 0.0))


def follow(camera: Camera, one: View, two: View, shown: Images) -> Pair:
    """Look for the points of a view in the next, whose whole images are ``shown``."""
    good = np.isfinite(one.distance)
    optical = two.turn.inv().apply(np.where(good[:, None], one.points, 0.0) - two.place)
    with np.errstate(invalid="ignore"):
        spot = pixels(camera, optical)
        inside = good & (optical[:, 2] > 0.05) & (spot > 1.0).all(axis=1) & (spot < (camera.width - 2.0, camera.height - 2.0)).all(axis=1)
    spot, z, relief = spot[inside], optical[inside, 2], one.relief[inside]
    new = np.rint(spot).astype(np.int64)
    low, there, high = _depths_about(shown["depth"], new)
    with np.errstate(invalid="ignore"):
        off = np.abs(z - there)
        smooth, same = (high < _SMOOTH * low) & np.isfinite(high), (high < _FLAT * low) & (off < _SAME * z)
    old = one.pixels[inside][same]
    strange = flow = None
    if "instance" in one.values and "instance" in shown:
        strange = (_around(shown["instance"], new[same]) != one.values["instance"][inside][same]).all(axis=0)
    if "flow" in one.values:
        flow = np.linalg.norm(one.values["flow"][inside][same].astype(np.float64) - (spot[same] - old), axis=1)
    before = z < 0.99 * low - 0.003 - relief
    return Pair(two.stamp_ns, before[smooth], (off > 0.02 * z + 0.003)[smooth], old, new[same], strange, flow)


def _depths_about(depth: NDArray[Any], spots: NDArray[np.int64]) -> tuple[Floats, Floats, Floats]:
    """Return the least depth about each pixel, the depth there, and the greatest (m); infinite where it is unknown."""
    around = metres(_around(depth, spots))
    around[np.isnan(around)] = np.inf
    return around.min(axis=0), around[len(_NINE) // 2], around.max(axis=0)


def _around(image: NDArray[Any], spots: NDArray[np.int64]) -> NDArray[Any]:
    """Return what an image has at the nine pixels about each of some (n, 2), (9, n), that one fifth; at its edge those that there are."""
    columns, rows = np.clip(spots[None] + _NINE[:, None], 0, (image.shape[1] - 1, image.shape[0] - 1)).transpose(2, 0, 1)
    return np.asarray(image[rows, columns])
