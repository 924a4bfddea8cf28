"""Checks of what cameras see: depth, ids and normals against the room's mesh, and pictures against each other."""

import math
from collections.abc import Iterator, Mapping

import numpy as np
from numpy.typing import NDArray

from scene_synth_ros.messages.cdr import CdrReader
from scene_synth_ros.messages.image_reader import read_image
from scene_synth_ros.messages.streams import TRANSPORTS
from scene_synth_ros.prove.evidence import Evidence, Room
from scene_synth_ros.prove.film import SAMPLES, Film, Floats, films
from scene_synth_ros.prove.room_mesh import Hits
from scene_synth_ros.prove.verdict import Verdict, at_most, share_off

_EXACT_M, _EXACT_SHARE, _MILLIMETRE_M = 1e-3, 1e-4, 6e-4
_CODES_PER_M = 2e-4
"""Of compressedDepth: half a step of inverse depth, times the squared depth, is what depth is off by."""
_MOST_PAIRS = 24


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
        stamps = np.repeat([view.stamp_ns for view in film.views], len(film.views[0].pixels))
        distance, topics = np.concatenate([view.distance for view in film.views]), film.topics.images
        known, slack = ~np.isnan(distance), _EXACT_M + _EXACT_SHARE * np.where(np.isfinite(distance), distance, 0.0)
        if film.views[0].values["depth"].dtype == np.uint16:
            slack = slack + _MILLIMETRE_M
        elif topics["depth"].endswith(TRANSPORTS[2]):
            slack = slack + _CODES_PER_M * np.where(np.isfinite(distance), distance, 0.0) ** 2
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
    of_views = hits.normal.reshape(len(film.views), -1, 3)
    turned = np.concatenate([view.turn.inv().apply(faces) for view, faces in zip(film.views, of_views, strict=True)])[met]
    cosine = np.clip((normals * turned).sum(axis=1) / np.maximum(length, 1e-9), -1.0, 1.0)
    away = np.degrees(np.arccos(cosine))
    middle = [np.median(away)] if len(away) else []
    yield at_most("normals", topic, "median angle to the mesh's faces, whose edges are smoothed", middle, 2.0, "deg")


def reprojection(evidence: Evidence, room: Room) -> Iterator[Verdict]:
    """Yield whether what a frame sees falls, in the next, on or behind what that sees, with its depth, its object and its flow."""
    for film in films(evidence, room):
        if not film.pairs:
            continue
        depth = film.topics.images["depth"]
        stamps = np.concatenate([np.full(len(pair.before), pair.stamp_ns) for pair in film.pairs])
        before, lost = np.concatenate([pair.before for pair in film.pairs]), np.concatenate([pair.lost for pair in film.pairs])
        yield from share_off("reprojection", depth, "points before what the next frame sees", before, stamps)
        yield at_most("reprojection", depth, "share of points not seen again", [lost.mean()] if len(lost) else [], 0.35)
        told = [(pair.strange, np.full(len(pair.strange), pair.stamp_ns)) for pair in film.pairs if pair.strange is not None]
        if told:
            strange, of = (np.concatenate(values) for values in zip(*told, strict=True))
            yield from share_off("reprojection", film.topics.images["instance"], "points of another object in the next frame", strange, of)
        flows = [pair.flow for pair in film.pairs if pair.flow is not None and len(pair.flow)]
        if flows:
            median = [np.median(np.concatenate(flows))]
            yield at_most("reprojection", film.topics.images["flow"], "median error of flow", median, 0.05, "px")


def color(evidence: Evidence, room: Room) -> Iterator[Verdict]:
    """Yield whether colours stay on the points that depth and poses say, better than those of a frame earlier or later would."""
    for film in films(evidence, room):
        topic, inner = film.topics.images.get("color"), range(1, len(film.pairs) - 1)
        if topic is None or not inner:
            continue
        wanted = inner[:: max(len(inner) // _MOST_PAIRS, 1)]
        needed = {film.views[k + j].stamp_ns for k in wanted for j in (-1, 0, 1, 2)}
        shown = {stamp: bytes(data) for _, data in room.each(topic, needed) if (stamp := CdrReader(data).header().stamp_ns) in needed}
        errors: dict[int, list[Floats]] = {-1: [], 0: [], 1: []}
        for k in wanted:
            old, new = film.pairs[k].old, film.pairs[k].new
            four = [shown.get(film.views[k + j].stamp_ns) for j in (-1, 0, 1, 2)]
            images = [read_image(evidence.types[topic], data, topic, None).pixels.astype(np.float64) for data in four if data]
            if len(images) == 4:
                for shift, found in errors.items():
                    found.append(np.abs(images[1 + shift][old[:, 1], old[:, 0]] - images[2 + shift][new[:, 1], new[:, 0]]).mean(axis=-1))
        if sum(map(len, errors[0])) >= SAMPLES:
            ratio = ratio_of_colors({shift: np.concatenate(values) for shift, values in errors.items()})
            yield at_most("color", topic, "difference of colours, over that if they were of the frame before or after", [ratio], 1.15)


def ratio_of_colors(errors: Mapping[int, Floats]) -> float:
    """Return by how much colours of points differ, over what they would, were they of the frame before (-1) or after (1).

    ``errors``: shift -> (n,) differences of the same points in codes; 0: of their own frame.  What three standard errors of the difference
    explain is taken off: few points of a noisy picture say little.
    """
    shift = min((-1, 1), key=lambda shift: float(errors[shift].mean()))
    noise = float((errors[0] - errors[shift]).std()) / math.sqrt(len(errors[0]))
    return (max(float(errors[0].mean()) - 3.0 * noise, 0.0) + 0.5) / (float(errors[shift].mean()) + 0.5)
