"""What a camera would see from a point of the room in every horizontal direction, judged coarsely by casting rays at walls and boxes.

A ring is a bundle of rays, ``RING_COLUMNS`` azimuths times the given elevations.  A view is as many neighbouring columns as the field of
view spans.  Its value grows with how far it sees, how many different objects it shows, and with windows and lamps; it falls with what
stands right before the lens, and with a plane or an object that fills it.
"""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

import kernel_cache.elementary as el
from grammar.camera.path_config import CameraPathConfig, ViewWeights
from grammar.geometry.arrays import Bools, Boxes, Floats, Ints
from grammar.geometry.boxes import COS_YAW, HALF_DEPTH, HALF_WIDTH, SIN_YAW, Z_HIGH, Z_LOW, X, Y
from grammar.geometry.kernels import entry, kernel

RING_COLUMNS = 72

_ENOUGH_OBJECTS = 4
"""Things in view from which none is missing: three, and one that others may hide from more than a ray."""
_NARROW_M, _WIDE_M = 2.0, 3.0
"""Free widths at which a room counts as narrow, and as not narrow at all."""
_REFUSED = 5.0
"""What a view loses whose median depth is too small."""
_MOST_BARE = 0.3
"""Share of a view that bare walls and the ceiling may fill."""
_MAIN_SHARE = 0.04
"""Share of a view from which the main thing counts as shown."""
_LEAST_OF_LINE = 0.4
"""Of the longest free line from a point, the median depth that is enough there: tiny rooms have no deeper views."""

NOT_TALL = np.zeros(0, np.bool_)

_CORNER = 1e-9
"""Share of an edge's length by which it overlaps its neighbours, so that no ray passes between them."""


def column_azimuth_rad() -> Floats:
    """Return (RING_COLUMNS,) the azimuth of each column's centre, radians counter-clockwise from +x."""
    return np.arange(RING_COLUMNS, dtype=np.float64) * (2.0 * math.pi / RING_COLUMNS)


class Ring(NamedTuple):
    """What the rays from a point meet.

    distance_m: (RING_COLUMNS, e) float64, along the ray.
    hit: (RING_COLUMNS, e) int64, row of the box that was hit, -1 for walls, floor and ceiling.
    plane: (RING_COLUMNS, e) int64, which of the planes was hit: walls, floor and ceiling, three of each box.
    """

    distance_m: Floats
    hit: Ints
    plane: Ints


def cast_ring(polygon: Floats, height_m: float, boxes: Boxes, position_m: Floats, elevations_rad: Floats) -> Ring:
    """Cast the rays of a ring from a point inside a room.

    Args:
        polygon: (n, 2) float64 floor outline, world, metres.
        height_m: height of the ceiling.
        boxes: (b, 8) float64 solids, rows as grammar.geometry.boxes defines them.
        position_m: (3,) float64 world.
        elevations_rad: (e,) float64, up is positive.
    """
    shape = (RING_COLUMNS, len(elevations_rad))
    ring = Ring(np.empty(shape), np.full(shape, -1, np.int64), np.empty(shape, np.int64))
    _cast_ring(polygon, height_m, boxes, position_m, elevations_rad, *ring)
    return ring


@entry
def _cast_ring(polygon, height_m, boxes, position_m, elevations_rad, distance_m, hit, plane):  # type: ignore[no-untyped-def]
    """Write distances, hits and planes: of each ray the nearest of wall, floor or ceiling, and boxes."""
    walls = len(polygon)
    for column in range(RING_COLUMNS):
        azimuth = column * (2.0 * math.pi / RING_COLUMNS)
        dx, dy = math.cos(azimuth), math.sin(azimuth)
        wall, edge = _nearest_wall(polygon, position_m[0], position_m[1], dx, dy)
        for row in range(len(elevations_rad)):
            slope = math.tan(elevations_rad[row])
            nearest, met = wall, edge
            if slope != 0.0:
                level = (-position_m[2] if slope < 0.0 else height_m - position_m[2]) / slope
                if level < nearest:
                    nearest, met = level, walls + (0 if slope < 0.0 else 1)
            for b in range(len(boxes)):
                t, axis = _box_entry(boxes[b], position_m, dx, dy, slope)
                if t < nearest:
                    nearest, met = t, walls + 2 + 3 * b + axis
                    hit[column, row] = b
            plane[column, row] = met
            distance_m[column, row] = nearest * math.sqrt(1.0 + slope * slope)


def view_values(
    ring: Ring,
    bright: NDArray[np.bool_],
    elevations_rad: Floats,
    columns_wide: int,
    weights: ViewWeights,
    longest_m: float = 0.0,
    pitch_rad: float = 0.0,
    floor_plane: int = -1,
    main: int = -1,
    tall: Bools = NOT_TALL,
) -> Floats:
    """Return (RING_COLUMNS,) float64, the value of the view that is centred on each column of a ring.

    value = depth * mean(min(d, far) / far) + objects * (1 - 0.8^(k - c/2)) + shown * (share of rays that meet boxes)
            - near * (share of rays whose depth along the optical axis is less than near + of those that meet boxes)
            - filled * (what the largest plane and the largest object fill beyond most_share) - missing * max(4 - k, 0)
            - bare * (share of rays that meet bare walls or the ceiling, beyond 0.3)
            - slab * (share of rays that meet, nearer than twice near, tall things that its sides or its lower edge cut)
            + light, where a window or a lamp is in view + main, where the main thing fills 0.04 and more of it
            + line * narrowness * (free line ahead / longest free line)
    with k the number of different boxes in view, c of those that its sides or its lower edge cut, and less by 5 where the median of d is
    below least_depth, and below 0.4 times the longest free line.  Boxes beyond those of ``bright`` are doors: they count among the k of
    which no more than 4 can be missing, and else as walls.

    Args:
        ring: what the rays meet.
        bright: (b,) which boxes are windows or lamps; those after them are doors.
        elevations_rad: (e,) of the rays, up is positive; those nearest to 0 are the level ones.
        columns_wide: columns that a view spans.
        weights: of the terms.
        longest_m: of the free lines of other places, the longest; that of the ring itself counts, too.
        pitch_rad: of the optical axis, up is positive.
        floor_plane: which plane is the floor, which does not count as bare.
        main: which box is the main thing, -1: none.
        tall: (t,) which of the first boxes reach from below the lens to above it; the others do not.
    """
    values = np.empty(RING_COLUMNS)
    boxes, planes = int(ring.hit.max()) + 1, int(ring.plane.max()) + 1
    level = _level_m(ring, elevations_rad)
    longest_m = max(longest_m, float(level.max()))
    is_tall = np.zeros(max(boxes, len(tall)), np.bool_)
    is_tall[: len(tall)] = tall
    weights = weights._replace(least_depth_m=min(weights.least_depth_m, _LEAST_OF_LINE * longest_m))
    cosines = _axis_cosines(columns_wide, elevations_rad, pitch_rad)
    counters = np.empty((3, boxes), np.int64), np.empty(planes, np.int64)
    _value_views(*ring, bright, is_tall, cosines, weights, floor_plane, main, *counters, values)
    across = float((level[: RING_COLUMNS // 2] + level[RING_COLUMNS // 2 :]).min())
    narrow = min(max((_WIDE_M - across) / (_WIDE_M - _NARROW_M), 0.0), 1.0)
    return np.asarray(values + weights.line * narrow * level / longest_m)


def _level_m(ring: Ring, elevations_rad: Floats) -> Floats:
    """Return (RING_COLUMNS,) the free lines of a ring, metres: distances of the rays that are nearest to level."""
    return np.asarray(ring.distance_m[:, int(np.argmin(np.abs(elevations_rad)))])


def _axis_cosines(columns_wide: int, elevations_rad: Floats, pitch_rad: float) -> Floats:
    """Return (columns_wide, e) cosines between the rays of a view and its axis."""
    azimuths = (np.arange(columns_wide) - columns_wide // 2) * (2.0 * math.pi / RING_COLUMNS)
    level, upright = el.cos(elevations_rad) * math.cos(pitch_rad), el.sin(elevations_rad) * math.sin(pitch_rad)
    return np.asarray(el.cos(azimuths)[:, None] * level[None, :] + upright[None, :])


@entry
def _value_views(distance_m, hit, plane, bright, tall, cosines, weights, floor_plane, main, box_rays, plane_rays, values):  # type: ignore[no-untyped-def]
    """Write the value of each view but for its free line.

    ``box_rays``, of all rays, of those at a view's sides or lower edge and of near ones, and ``plane_rays`` are counters.
    """
    columns, things = len(distance_m), len(bright)
    columns_wide, rows = cosines.shape
    for centre in range(columns):
        depth, near, close, shown, bare = 0.0, 0, 0, 0, 0
        box_rays[:] = 0
        plane_rays[:] = 0
        for offset in range(columns_wide):
            column = (centre + offset - columns_wide // 2) % columns
            for row in range(rows):
                d = distance_m[column, row]
                depth += min(d, weights.far_m) / weights.far_m
                near += (2 if 0 <= hit[column, row] < things else 1) * (d * cosines[offset, row] < weights.near_m)
                close += d < weights.least_depth_m
                plane_rays[plane[column, row]] += 1
                if hit[column, row] >= 0:
                    shown += hit[column, row] < things
                    box_rays[0, hit[column, row]] += 1
                    box_rays[2, hit[column, row]] += d * cosines[offset, row] < 2.0 * weights.near_m
                    box_rays[1, hit[column, row]] += row == 0 or offset == 0 or offset == columns_wide - 1
                else:
                    bare += plane[column, row] != floor_plane
        rays = columns_wide * rows
        objects, cut, doors, largest, light, value = 0, 0, 0, 0, 0.0, 0.0
        for b in range(box_rays.shape[1]):
            largest = max(largest, box_rays[0, b])
            if tall[b] and box_rays[1, b] > 0:
                value -= weights.slab * box_rays[2, b] / rays
            if b >= things:
                doors += box_rays[0, b] > 0
                continue
            objects += box_rays[0, b] > 0
            cut += box_rays[1, b] > 0
            if box_rays[0, b] > 0 and bright[b]:
                light = weights.light
            if b == main and box_rays[0, b] >= _MAIN_SHARE * columns_wide * rows:
                value += weights.main
        widest = 0
        for p in range(len(plane_rays)):
            widest = max(widest, plane_rays[p])
        filled = max(widest / rays - weights.most_share, 0.0) + max(largest / rays - weights.most_share, 0.0)
        value += weights.depth * depth / rays + weights.objects * (1.0 - 0.8 ** (objects - 0.5 * cut)) - weights.near * near / rays
        value += light + weights.shown * shown / rays - weights.filled * filled - weights.bare * max(bare / rays - _MOST_BARE, 0.0)
        value -= weights.missing * max(_ENOUGH_OBJECTS - objects - doors, 0)
        values[centre] = value - (_REFUSED if 2 * close > rays else 0.0)


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
def _nearest_wall(polygon, x, y, dx, dy):  # type: ignore[no-untyped-def]
    """Return the distance along a horizontal ray of unit direction to the outline, inf for a miss, and which of its edges that is."""
    nearest, edge = np.inf, 0
    n = len(polygon)
    for i in range(n):
        ex, ey = polygon[(i + 1) % n, 0] - polygon[i, 0], polygon[(i + 1) % n, 1] - polygon[i, 1]
        cross = dx * ey - dy * ex
        if abs(cross) > 1e-12:
            ax, ay = polygon[i, 0] - x, polygon[i, 1] - y
            t, s = (ax * ey - ay * ex) / cross, (ax * dy - ay * dx) / cross
            if 0.0 < t < nearest and -_CORNER <= s <= 1.0 + _CORNER:
                nearest, edge = t, i
    return nearest, edge


@kernel
def _box_entry(box, position, dx, dy, dz):  # type: ignore[no-untyped-def]
    """Slab test of a ray with an upright box: the ray parameter of the entry, inf for a miss or an origin inside, and its axis."""
    px, py = position[0] - box[X], position[1] - box[Y]
    u, v = px * box[COS_YAW] + py * box[SIN_YAW], py * box[COS_YAW] - px * box[SIN_YAW]
    du, dv = dx * box[COS_YAW] + dy * box[SIN_YAW], dy * box[COS_YAW] - dx * box[SIN_YAW]
    w = position[2] - 0.5 * (box[Z_LOW] + box[Z_HIGH])
    low, high, entered, axis = 0.0, np.inf, 0, 0
    for start, step, half in ((u, du, box[HALF_DEPTH]), (v, dv, box[HALF_WIDTH]), (w, dz, 0.5 * (box[Z_HIGH] - box[Z_LOW]))):
        if abs(step) < 1e-12:
            if abs(start) > half:
                return np.inf, 0
        else:
            a, b = (-half - start) / step, (half - start) / step
            if min(a, b) > low:
                low, entered = min(a, b), axis
            high = min(high, max(a, b))
        axis += 1
    return (low if 0.0 < low <= high else np.inf), entered


class Views(NamedTuple):
    """What views are judged in: the settings, what rays meet ((n, 2) outline, ceiling height, (b, 8) solids), the height of the lens.

    The first ``things`` of the solids are worth looking at; those after them are parts of the room's ceiling.  ``bright``: which of them
    are windows or lamps, but for doors, which come last.  ``longest_m``: the longest free line of all places, where these are compared;
    else 0.  ``pitch_rad``: of the axis of views, which the settings' elevations are above.  ``main``: which
    solid is the main thing, -1: none.  ``tall``: which of the first solids reach from below the lens to above it.
    """

    config: CameraPathConfig
    polygon: Floats
    height_m: float
    boxes: Boxes
    lens_m: float
    things: int
    bright: NDArray[np.bool_]
    longest_m: float = 0.0
    pitch_rad: float = 0.0
    main: int = -1
    tall: Bools = NOT_TALL

    @property
    def columns_wide(self) -> int:
        """Columns of a ring that the field of view spans."""
        return max(round(self.config.field_of_view_rad / (2.0 * math.pi) * RING_COLUMNS), 1)

    def ring(self, station_m: Floats) -> Ring:
        """Cast a ring of rays from a point (2,) of the floor."""
        position = np.array([station_m[0], station_m[1], self.lens_m])
        ring = cast_ring(self.polygon, self.height_m, self.boxes, position, self._elevations_rad)
        return ring._replace(hit=np.where(ring.hit < self.things, ring.hit, -1))

    def values(self, ring: Ring) -> Floats:
        """Return (RING_COLUMNS,) the values of the views in all directions of a ring."""
        config = self.config
        return view_values(
            ring,
            self.bright,
            self._elevations_rad,
            self.columns_wide,
            config.view_weights,
            self.longest_m,
            self.pitch_rad,
            floor_plane=len(self.polygon),
            main=self.main,
            tall=self.tall,
        )

    def line_m(self, ring: Ring) -> float:
        """Return the longest free line of a ring, metres."""
        return float(_level_m(ring, self._elevations_rad).max())

    @property
    def _elevations_rad(self) -> Floats:
        return self.pitch_rad + np.array(self.config.elevations_rad)
