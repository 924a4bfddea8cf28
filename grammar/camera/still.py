"""A single picture of a room: the best view of all places that a photographer's arms reach, at the pitch that suits it.

Who takes it stands where a body fits, and holds the lens over furniture, into corners and against walls, as far as arms reach.  Places are
compared at the middle pitch, the best of them at all pitches.
"""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from scipy import ndimage

from grammar.camera.path_config import CameraPathConfig
from grammar.camera.view_ring import Views, column_azimuth_rad
from grammar.camera.walk import LEAST_AREA_M2, RELAXATION, RESERVE_CELLS, around_lens, largest_component
from grammar.geometry.arrays import Boxes, Floats
from grammar.geometry.boxes import Z_LOW
from grammar.geometry.free_space import centres_of, rasterize, standable

_COMPARED = 16
"""Places that are compared at all pitches."""


class Shot(NamedTuple):
    """Where a picture is taken from, (2,) metres, and where it looks, radians."""

    place_m: Floats
    yaw_rad: float
    pitch_rad: float


def places_in_reach(
    polygon: Floats, boxes: Boxes, lens_m: float, config: CameraPathConfig, relaxation: Sequence[tuple[float, float]] = RELAXATION
) -> Floats:
    """Return (n, 2) places of the lens that lie within ``still.reach_m`` of where the photographer stands.

    The distances to keep shrink step by step, by the shares of ``relaxation``, until some places are left; at worst it is the one with the
    greatest clearance.
    """
    step_m = config.resolution_m
    lens = rasterize(polygon, around_lens(boxes, lens_m, config.clearance_m), step_m, math.inf)
    feet = rasterize(polygon, boxes[boxes[:, Z_LOW] < lens_m], step_m, math.inf)
    for body_share, lens_share in relaxation:
        places = standable(lens, lens_share * config.clearance_m + RESERVE_CELLS * step_m)
        if body_share > 0.0:
            stands = largest_component(standable(feet, body_share * config.body_radius_m))
            if not stands.any():
                continue
            places &= ndimage.distance_transform_edt(~stands) * step_m <= config.still.reach_m
        if np.count_nonzero(places) * step_m**2 >= LEAST_AREA_M2:
            return centres_of(lens, places)
    return centres_of(lens, lens.clearance_m == lens.clearance_m.max())[:1]


def best_shot(rng: np.random.Generator, views: Views, places_m: Floats) -> Shot:
    """Return the best view from ``viewpoint_trials`` of the places (n, 2); free lines are measured by the longest of all."""
    config = views.config
    pitches = sorted(config.still.pitches_rad)
    tried = places_m[rng.permutation(len(places_m))[: config.viewpoint_trials]]
    middle = views._replace(pitch_rad=pitches[len(pitches) // 2])
    rings = [middle.ring(place) for place in tried]
    longest_m = max(middle.line_m(ring) for ring in rings)
    middle = middle._replace(longest_m=longest_m)
    quality = np.array([middle.values(ring).max() for ring in rings])
    best, shot = -math.inf, Shot(tried[0], 0.0, 0.0)
    for place in tried[np.argsort(-quality, kind="stable")[:_COMPARED]]:
        for pitch in pitches:
            pitched = views._replace(pitch_rad=pitch, longest_m=longest_m)
            values = pitched.values(pitched.ring(place))
            column = int(np.argmax(values))
            if values[column] > best:
                best, shot = float(values[column]), Shot(place, float(column_azimuth_rad()[column]), pitch)
    return shot
