"""Views from points of a room at the height of the lens."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from grammar.camera.path_config import CameraPathConfig
from grammar.camera.view_ring import RING_COLUMNS, cast_ring, view_values
from grammar.geometry.arrays import Boxes, Floats, Ints


class Ring(NamedTuple):
    """What the rays from a point meet, as :func:`grammar.camera.view_ring.cast_ring` returns it."""

    distance_m: Floats
    hit: Ints


class Views(NamedTuple):
    """What views are judged in: the settings, what rays meet ((n, 2) outline, ceiling height, (b, 8) solids), the height of the lens.

    The first ``things`` of the solids are worth looking at; those after them are parts of the room's ceiling.
    """

    config: CameraPathConfig
    polygon: Floats
    height_m: float
    boxes: Boxes
    lens_m: float
    things: int

    @property
    def columns_wide(self) -> int:
        """Columns of a ring that the field of view spans."""
        return max(round(self.config.field_of_view_rad / (2.0 * math.pi) * RING_COLUMNS), 1)

    def ring(self, station_m: Floats) -> Ring:
        """Cast a ring of rays from a point (2,) of the floor."""
        position = np.array([station_m[0], station_m[1], self.lens_m])
        distance_m, hit = cast_ring(self.polygon, self.height_m, self.boxes, position, np.array(self.config.elevations_rad))
        return Ring(distance_m, np.where(hit < self.things, hit, -1))

    def values(self, ring: Ring) -> Floats:
        """Return (RING_COLUMNS,) the values of the views in all directions of a ring."""
        return np.asarray(view_values(ring.distance_m, ring.hit, len(self.boxes), self.columns_wide, self.config.view_weights))

    def best(self, station_m: Floats) -> float:
        """Return the value of the best view from a point."""
        return float(self.values(self.ring(station_m)).max())
