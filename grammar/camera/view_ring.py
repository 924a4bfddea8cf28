"""What a camera would see from a point of the room in every horizontal direction, judged coarsely by casting rays at walls and boxes.

A ring is a bundle of rays, ``RING_COLUMNS`` azimuths times the given elevations.  A view is as many neighbouring columns as the field of
view spans.  Its value grows with how far it sees and how many different objects it shows, and falls with what stands right before the lens.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from grammar.camera.path_config import CameraPathConfig, ViewWeights
from grammar.geometry.arrays import Boxes, Floats, Ints
from grammar.geometry.boxes import COS_YAW, HALF_DEPTH, HALF_WIDTH, SIN_YAW, Z_HIGH, Z_LOW, X, Y
from grammar.geometry.kernels import entry, kernel

RING_COLUMNS = 72


def column_azimuth_rad() -> Floats:
    """Return (RING_COLUMNS,) the azimuth of each column's centre, radians counter-clockwise from +x."""
    return np.arange(RING_COLUMNS, dtype=np.float64) * (2.0 * math.pi / RING_COLUMNS)


def cast_ring(polygon: Floats, height_m: float, boxes: Boxes, position_m: Floats, elevations_rad: Floats) -> tuple[Floats, Ints]:
    """Cast the rays of a ring from a point inside a room.

    Args:
        polygon: (n, 2) float64 floor outline, world, metres.
        height_m: height of the ceiling.
        boxes: (b, 8) float64 solids, rows as grammar.geometry.boxes defines them.
        position_m: (3,) float64 world.
        elevations_rad: (e,) float64, up is positive.

    Returns:
        distance_m: (RING_COLUMNS, e) float64, along the ray.
        hit: (RING_COLUMNS, e) int64, row of the box that was hit, -1 for walls, floor and ceiling.
    """
    distance_m = np.empty((RING_COLUMNS, len(elevations_rad)))
    hit = np.full((RING_COLUMNS, len(elevations_rad)), -1, np.int64)
    _cast_ring(polygon, height_m, boxes, position_m, elevations_rad, distance_m, hit)
    return distance_m, hit


@entry
def _cast_ring(polygon, height_m, boxes, position_m, elevations_rad, distance_m, hit):  # type: ignore[no-untyped-def]
    """Write distances and hits: of each ray the nearest of wall, floor or ceiling, and boxes."""
    for column in range(RING_COLUMNS):
        azimuth = column * (2.0 * math.pi / RING_COLUMNS)
        dx, dy = math.cos(azimuth), math.sin(azimuth)
        wall = _wall_distance(polygon, position_m[0], position_m[1], dx, dy)
        for row in range(len(elevations_rad)):
            slope = math.tan(elevations_rad[row])
            nearest = wall
            if slope < 0.0:
                nearest = min(nearest, -position_m[2] / slope)
            elif slope > 0.0:
                nearest = min(nearest, (height_m - position_m[2]) / slope)
            for b in range(len(boxes)):
                t = _box_distance(boxes[b], position_m, dx, dy, slope)
                if t < nearest:
                    nearest = t
                    hit[column, row] = b
            distance_m[column, row] = nearest * math.sqrt(1.0 + slope * slope)


def view_values(distance_m: Floats, hit: Ints, box_count: int, columns_wide: int, weights: ViewWeights) -> Floats:
    """Return (RING_COLUMNS,) float64, the value of the view that is centred on each column of a ring.

    value = depth * mean(min(d, far) / far) + objects * (1 - 0.8^k) - near * share of rays shorter than near, with k the number of different
    boxes in view.
    """
    values = np.empty(len(distance_m))
    _value_views(distance_m, hit, np.full(box_count, -1, np.int64), columns_wide, weights, values)
    return values


@entry
def _value_views(distance_m, hit, seen_from, columns_wide, weights, values):  # type: ignore[no-untyped-def]
    """Write the value of each view; ``seen_from`` (b,) remembers for each box the last view that counted it."""
    columns, rows = distance_m.shape
    for centre in range(columns):
        depth, near, objects = 0.0, 0, 0
        for offset in range(columns_wide):
            column = (centre + offset - columns_wide // 2) % columns
            for row in range(rows):
                d = distance_m[column, row]
                depth += min(d, weights.far_m) / weights.far_m
                near += d < weights.near_m
                b = hit[column, row]
                if b >= 0 and seen_from[b] != centre:
                    seen_from[b] = centre
                    objects += 1
        rays = columns_wide * rows
        values[centre] = weights.depth * depth / rays + weights.objects * (1.0 - 0.8**objects) - weights.near * near / rays


def best_columns(values: Floats, most_columns: int, turn_cost: float) -> Ints:
    """Return (m,) int64, the column to look at from each of m stations, by dynamic programming (Viterbi).

    Args:
        values: (m, RING_COLUMNS) float64.
        most_columns: greatest turn between neighbouring stations.
        turn_cost: cost of a turn by one column; it grows with the square of the turn.
    """
    total, came_from = values.copy(), np.zeros(values.shape, np.int64)
    _add_turns(total, most_columns, turn_cost, came_from)
    path = np.empty(len(values), np.int64)
    path[-1] = np.argmax(total[-1])
    for station in range(len(values) - 1, 0, -1):
        path[station - 1] = came_from[station, path[station]]
    return path


@entry
def _add_turns(total, most_columns, turn_cost, came_from):  # type: ignore[no-untyped-def]
    """Add to each station's values (m, columns) the best total of a path to it; note the column before."""
    stations, columns = total.shape
    for station in range(1, stations):
        for column in range(columns):
            best = -np.inf
            for turn in range(-most_columns, most_columns + 1):
                before = (column - turn) % columns
                value = total[station - 1, before] - turn_cost * turn * turn
                if value > best:
                    best = value
                    came_from[station, column] = before
            total[station, column] += best


@kernel
def _wall_distance(polygon, x, y, dx, dy):  # type: ignore[no-untyped-def]
    """Return the distance along a horizontal ray of unit direction to the outline, inf for a miss."""
    nearest = np.inf
    n = len(polygon)
    for i in range(n):
        ex, ey = polygon[(i + 1) % n, 0] - polygon[i, 0], polygon[(i + 1) % n, 1] - polygon[i, 1]
        cross = dx * ey - dy * ex
        if abs(cross) > 1e-12:
            ax, ay = polygon[i, 0] - x, polygon[i, 1] - y
            t, s = (ax * ey - ay * ex) / cross, (ax * dy - ay * dx) / cross
            if t > 0.0 and 0.0 <= s <= 1.0:
                nearest = min(nearest, t)
    return nearest


@kernel
def _box_distance(box, position, dx, dy, dz):  # type: ignore[no-untyped-def]
    """Slab test of a ray with an upright box: the ray parameter of the entry, inf for a miss or an origin inside."""
    px, py = position[0] - box[X], position[1] - box[Y]
    u, v = px * box[COS_YAW] + py * box[SIN_YAW], py * box[COS_YAW] - px * box[SIN_YAW]
    du, dv = dx * box[COS_YAW] + dy * box[SIN_YAW], dy * box[COS_YAW] - dx * box[SIN_YAW]
    w = position[2] - 0.5 * (box[Z_LOW] + box[Z_HIGH])
    low, high = 0.0, np.inf
    for start, step, half in ((u, du, box[HALF_DEPTH]), (v, dv, box[HALF_WIDTH]), (w, dz, 0.5 * (box[Z_HIGH] - box[Z_LOW]))):
        if abs(step) < 1e-12:
            if abs(start) > half:
                return np.inf
        else:
            a, b = (-half - start) / step, (half - start) / step
            low, high = max(low, min(a, b)), min(high, max(a, b))
    return low if 0.0 < low <= high else np.inf


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
