"""The view of a neighbourhood all around, lit by sun, sky and lamps, as an equirectangular map.

Each pixel sends rays from the room's middle at eye height; where they meet something, its surface is matt and lit by the sun (with a
shadow ray), by the sky and the ground (irradiance of an environment by spherical harmonics: R. Ramamoorthi and P. Hanrahan, "An Efficient
Representation for Irradiance Environment Maps", SIGGRAPH 2001, equation 13), and by street lamps.  Bodies and leaves are looked up by tiles
of the map.  Window panes show the sky by mirror and, in the dark, some are lit.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from renderer.core.color import Rgb
from renderer.core.equirectangular import arcsin, bilinear_map, map_position
from renderer.core.kernel import entry, inlined, kernel
from renderer.core.sampling import Vector
from renderer.surroundings import neighbourhood as nb
from renderer.surroundings.neighbourhood import Neighbourhood
from renderer.surroundings.surfaces import Surface, body_surface, ground_surface, hash_unit, value_noise

ROWS, COLUMNS, TILE = 1024, 2048, 16
ALL_AROUND = np.ones(COLUMNS, np.bool_)
"""Columns of a map that is drawn all around."""
_FINE_ROWS = (0.30, 0.62)
"""Between these shares of the rows, about 36 degrees above and 22 below the horizon, each pixel has two rays."""
_FAR = np.float32(1e9)
_BARK = np.float32(nb.BARK)
_ZERO, _ONE, _TINY = np.float32(0.0), np.float32(1.0), np.float32(1e-12)
_INV_PI = np.float32(1.0 / np.pi)
_LEAF_SHADE = np.float32(0.35)
"""Of the sun, where a tree stands before it."""
_LIFT_M, _LEAF_GAPS = np.float32(0.02), np.float32(0.72)
_HAZE_M = np.float32(1.0 / 900.0)
_ROOF_M = np.float32(3.5)
"""From the eye to the roof of the room's own house, which is not seen and casts its shadow."""


class OutsideLight(NamedTuple):
    """What lights a neighbourhood, for kernels; float32.

    sky: (h, w, 3), the sky's luminance in cd/m2 as an equirectangular map in the neighbourhood's frame.  to_sun: (3,), unit vector; beam:
    (3,), the sun's illuminance in lux.  harmonics: (9, 3) of irradiance.  lamp: (3,), luminous intensity of a street lamp in cd, 0 by day.
    pane: (3,), luminance of a lit window in cd/m2, 0 by day.  clouds: (2,), how steeply the sky's luminance varies with them, and by which
    share at most.
    """

    sky: NDArray[np.float32]
    to_sun: NDArray[np.float32]
    beam: NDArray[np.float32]
    harmonics: NDArray[np.float32]
    lamp: NDArray[np.float32]
    pane: NDArray[np.float32]
    clouds: NDArray[np.float32]


class Tiles(NamedTuple):
    """Which bodies and leaves each tile of the map may show: ``begin`` (tiles + 1,) int32 and ``item`` int32, bodies first, then leaves."""

    begin: NDArray[np.int32]
    item: NDArray[np.int32]


def tile_lists(place: Neighbourhood, eye_m: float) -> Tiles:
    """Return the lists by tile; ``eye_m``: height of the eye above the ground."""
    spheres = np.ascontiguousarray(np.concatenate([place.spheres, place.clumps[:, :4]]))
    begin = np.zeros(ROWS * COLUMNS // TILE**2 + 1, np.int32)
    _fill_tiles(spheres, np.float32(eye_m), begin, np.zeros(0, np.int32))
    begin = np.cumsum(begin, dtype=np.int32)
    item = np.zeros(int(begin[-1]), np.int32)
    _fill_tiles(spheres, np.float32(eye_m), begin.copy(), item)
    return Tiles(begin, item)


@entry
def _fill_tiles(spheres: NDArray[np.float32], eye: np.float32, begin: NDArray[np.int32], item: NDArray[np.int32]) -> None:
    """Count the spheres of each tile into ``begin[1:]``, or, where ``item`` has room, write them from ``begin`` on, which moves along."""
    rows, columns = np.int32(ROWS // TILE), np.int32(COLUMNS // TILE)
    for n in range(len(spheres)):
        x, y, z, radius = spheres[n, 0], spheres[n, 1], spheres[n, 2] - eye, spheres[n, 3]
        distance = np.sqrt(x * x + y * y + z * z)
        high, low, left, right = np.int32(0), rows - 1, np.int32(0), columns - 1
        if radius < np.float32(0.95) * distance:
            across, down = map_position(x / distance, y / distance, z / distance, rows, columns)
            sine = radius / distance
            reach = arcsin(sine) * np.float32(ROWS / TILE / np.pi) + np.float32(0.1)
            high, low = np.int32(max(down - reach, _ZERO)), min(np.int32(down + reach), rows - 1)
            level = np.sqrt(x * x + y * y) / distance
            if sine < np.float32(0.95) * level:
                reach = arcsin(sine / level) * np.float32(COLUMNS / TILE / (2.0 * np.pi)) + np.float32(0.1)
                left, right = np.int32(np.floor(across - reach)), np.int32(np.floor(across + reach))
        for i in range(high, low + 1):
            for j in range(left, right + 1):
                tile = i * columns + (j + columns) % columns
                if len(item) == 0:
                    begin[tile + 1] += 1
                else:
                    item[begin[tile]] = n
                    begin[tile] += 1


@entry
def draw_rows(
    place: Neighbourhood,
    light: OutsideLight,
    tiles: Tiles,
    eye: np.float32,
    pixels: tuple[NDArray[np.float32], NDArray[np.bool_]],
    image: NDArray[np.float32],
    memo: NDArray[np.float32],
    first: int,
) -> None:
    """Fill ``TILE`` rows of the map (rows, columns, 3) from ``first`` on, cd/m2.

    ``pixels``: their directions (rows, columns, 3), and which columns show more than sky and level ground; ``memo`` (2,): scratch memory,
    which surface was met last, and how much of the sun reached it.
    """
    directions, shown = pixels
    rows, columns = image.shape[0], image.shape[1]
    fine_first, fine_last = int(_FINE_ROWS[0] * rows), int(_FINE_ROWS[1] * rows)
    for i in range(first, first + TILE):
        count = 2 if fine_first <= i < fine_last else 1
        for j in range(columns):
            if not shown[j]:
                d = directions[i, j]
                image[i, j, 0], image[i, j, 1], image[i, j, 2] = bilinear_map(light.sky, d[0], d[1], d[2])
                continue
            right, below = (j + 1) % columns, min(i + 1, rows - 1)
            tile = (i // TILE) * (columns // TILE) + j // TILE
            begin, end = tiles.begin[tile], tiles.begin[tile + 1]
            red, green, blue, memo[0] = _ZERO, _ZERO, _ZERO, -_ONE
            for k in range(count):
                s = np.float32(0.5 * k - 0.25) if count > 1 else _ZERO
                t = s
                a, b, c = directions[i, j], directions[i, right], directions[below, j]
                dx = a[0] + s * (b[0] - a[0]) + t * (c[0] - a[0])
                dy = a[1] + s * (b[1] - a[1]) + t * (c[1] - a[1])
                dz = a[2] + s * (b[2] - a[2]) + t * (c[2] - a[2])
                scale = _ONE / np.sqrt(dx * dx + dy * dy + dz * dz)
                r, g, b_ = _radiance(place, light, tiles.item[begin:end], memo, eye, (dx * scale, dy * scale, dz * scale))
                red, green, blue = red + r, green + g, blue + b_
            share = _ONE / np.float32(count)
            image[i, j, 0], image[i, j, 1], image[i, j, 2] = share * red, share * green, share * blue


@kernel
def _radiance(
    place: Neighbourhood, light: OutsideLight, items: NDArray[np.int32], memo: NDArray[np.float32], eye: np.float32, direction: Vector
) -> Rgb:
    """Return the luminance towards a unit direction."""
    dx, dy, dz = direction
    nearest, which, face = _FAR, -1, 0
    bodies = len(place.planes)
    for n in items:
        if n < bodies:
            t, entered = _meet_body(place.planes[n], (_ZERO, _ZERO, eye), direction)
        else:
            t, entered = _meet_ball(place.clumps, n - bodies, eye, direction), 0
        if t < nearest:
            nearest, which, face = t, n, entered
    down = -eye / dz if dz < np.float32(-1e-6) else _FAR
    t = min(nearest, down)
    if t >= _FAR:
        return _backdrop(light, dx, dy, dz)
    x, y, z = t * dx, t * dy, eye + t * dz
    if down <= nearest:
        surface, normal = ground_surface(place.street, x, y, t), (_ZERO, _ZERO, _ONE)
    elif which < bodies:
        plane = place.planes[which, face]
        surface, normal = body_surface(place, which, face, x, y, z), (plane[0], plane[1], plane[2])
    else:
        surface, normal = _leaf(place.clumps[which - bodies], which, x, y, z)
    # rays of a pixel that meet the same face share what they know of the sun
    key = np.float32(-2.0) if down <= nearest else np.float32(nb.PLANES * which + face)
    if memo[0] != key:
        memo[0], memo[1] = key, _sunlit(place, light, eye + _ROOF_M, normal, (x, y, z))
    r, g, b = _shaded(place, light, surface, normal, memo[1], (x, y, z), direction)
    # far things fade into the light above the horizon
    haze = t * _HAZE_M / (_ONE + t * _HAZE_M)
    level = np.sqrt(dx * dx + dy * dy + np.float32(0.0025))
    hr, hg, hb = sky_luminance(light.sky, dx / level, dy / level, np.float32(0.05) / level)
    return r + haze * (hr - r), g + haze * (hg - g), b + haze * (hb - b)


@inlined
def _meet_body(planes: NDArray[np.float32], origin: Vector, direction: Vector) -> tuple[np.float32, int]:
    """Return how far along a ray it enters a convex body (PLANES, 4), and by which face; ``_FAR`` where it does not."""
    enter, leave, face = _ZERO, _FAR, -1
    for i in range(nb.PLANES):
        a, b, c = planes[i, 0], planes[i, 1], planes[i, 2]
        toward = a * direction[0] + b * direction[1] + c * direction[2]
        room = planes[i, 3] - (a * origin[0] + b * origin[1] + c * origin[2])
        if toward < _ZERO:
            t = room / toward
            if t > enter:
                enter, face = t, i
        elif toward > _ZERO:
            leave = min(leave, room / toward)
        elif room < _ZERO:
            leave = -_ONE
    return (enter, face) if face >= 0 and enter < leave else (_FAR, 0)


@inlined
def _meet_ball(clumps: NDArray[np.float32], n: int, eye: np.float32, direction: Vector) -> np.float32:
    """Return how far along a ray from the eye it meets a ball of leaves or bark; ``_FAR`` where it does not, or slips through."""
    dx, dy, dz = direction
    cx, cy, cz, radius = clumps[n, 0], clumps[n, 1], clumps[n, 2] - eye, clumps[n, 3]
    along = cx * dx + cy * dy + cz * dz
    aside = cx * cx + cy * cy + cz * cz - along * along
    left = radius * radius - aside
    if left <= _ZERO or along <= radius:
        return _FAR
    # leaves of a size by cells across the ray; more gaps between them towards the rim
    scale = np.float32(22.0) * along
    leaf = hash_unit(np.int32(np.floor(scale * dx)) + 131 * n, np.int32(np.floor(scale * dy)), np.int32(np.floor(scale * dz)))
    inside = left / (radius * radius)
    return along - np.sqrt(left) if clumps[n, 7] >= _BARK or leaf < np.float32(0.2) + np.float32(0.6) * inside else _FAR


@inlined
def _leaf(ball: NDArray[np.float32], which: int, x: np.float32, y: np.float32, z: np.float32) -> tuple[Surface, Vector]:
    """Return surface and normal at a point of a ball of leaves: normals in disorder, colours that differ from leaf to leaf."""
    i, j, k = np.int32(np.floor(x * np.float32(21.0))), np.int32(np.floor(y * np.float32(21.0))), np.int32(np.floor(z * np.float32(21.0)))
    one, two = hash_unit(i + 57 * which, j, k), hash_unit(j, k + 91 * which, i)
    scale = _ONE / ball[3]
    nx = (x - ball[0]) * scale + np.float32(0.9) * (one - np.float32(0.5))
    ny = (y - ball[1]) * scale + np.float32(0.9) * (two - np.float32(0.5))
    nz = (z - ball[2]) * scale + np.float32(0.5)
    length = _ONE / np.sqrt(max(nx * nx + ny * ny + nz * nz, _TINY))
    tone = min(ball[7], _ONE) * (np.float32(0.65) + np.float32(1.4) * one * two)
    return Surface(ball[4] * tone, ball[5] * tone, ball[6] * tone, _ZERO, _ZERO), (nx * length, ny * length, nz * length)


@inlined
def _shaded(
    place: Neighbourhood, light: OutsideLight, surface: Surface, normal: Vector, sunlit: np.float32, point: Vector, direction: Vector
) -> Rgb:
    """Return the luminance that a surface sends back along a ray; ``sunlit``: share of the sun that reaches it."""
    nx, ny, nz = normal
    r, g, b = irradiance(light.harmonics, nx, ny, nz)
    lit = sunlit * max(nx * light.to_sun[0] + ny * light.to_sun[1] + nz * light.to_sun[2], _ZERO)
    r, g, b = r + lit * light.beam[0], g + lit * light.beam[1], b + lit * light.beam[2]
    if light.lamp[0] > _ZERO:
        for i in range(len(place.lamps)):
            ax, ay, az = place.lamps[i, 0] - point[0], place.lamps[i, 1] - point[1], place.lamps[i, 2] - point[2]
            squared = ax * ax + ay * ay + az * az + np.float32(0.1)
            cosine = ax * nx + ay * ny + az * nz
            if cosine > _ZERO:
                # lamps shine down: little of their light goes up
                share = cosine / (squared * np.sqrt(squared)) * (_ONE if az > _ZERO else np.float32(0.1))
                r, g, b = r + share * light.lamp[0], g + share * light.lamp[1], b + share * light.lamp[2]
    r, g, b = surface.red * _INV_PI * r, surface.green * _INV_PI * g, surface.blue * _INV_PI * b
    if surface.mirror > _ZERO:
        dx, dy, dz = direction
        away = np.float32(2.0) * (dx * nx + dy * ny + dz * nz)
        sr, sg, sb = sky_luminance(light.sky, dx - away * nx, dy - away * ny, dz - away * nz)
        r, g, b = r + surface.mirror * sr, g + surface.mirror * sg, b + surface.mirror * sb
    return r + surface.glow * light.pane[0], g + surface.glow * light.pane[1], b + surface.glow * light.pane[2]


@kernel
def _sunlit(place: Neighbourhood, light: OutsideLight, roof: np.float32, normal: Vector, point: Vector) -> np.float32:
    """Return which share of the sun reaches a point of a surface; leaves cast shadows with gaps, the room's house up to ``roof``."""
    sx, sy, sz = light.to_sun[0], light.to_sun[1], light.to_sun[2]
    if light.beam[0] + light.beam[1] + light.beam[2] <= _ZERO or normal[0] * sx + normal[1] * sy + normal[2] * sz <= _ZERO:
        return _ZERO
    # each window is at the origin, in a wall that faces what it shows
    behind = -(point[0] * sx + point[1] * sy)
    if (point[0] * point[0] + point[1] * point[1]) * sz < (roof - point[2]) * behind:
        return _ZERO
    x, y, z = point[0] + _LIFT_M * normal[0], point[1] + _LIFT_M * normal[1], point[2] + _LIFT_M * normal[2]
    for n in range(len(place.spheres)):
        if _is_before(place.spheres[n], (x, y, z), (sx, sy, sz)):
            t, _ = _meet_body(place.planes[n], (x, y, z), (sx, sy, sz))
            if t < _FAR:
                return _ZERO
    for n in range(len(place.crowns)):
        if _is_before(place.crowns[n], (x, y, z), (sx, sy, sz)):
            gap = value_noise((x - z * sx / sz) * np.float32(3.5), (y - z * sy / sz) * np.float32(3.5), 11)
            return _ONE if gap > _LEAF_GAPS else _LEAF_SHADE
    return _ONE


@inlined
def _is_before(sphere: NDArray[np.float32], point: Vector, to_sun: Vector) -> bool:
    """Return whether a ray from a point meets a sphere or begins in it."""
    cx, cy, cz, radius = sphere[0] - point[0], sphere[1] - point[1], sphere[2] - point[2], sphere[3]
    along, squared = cx * to_sun[0] + cy * to_sun[1] + cz * to_sun[2], cx * cx + cy * cy + cz * cz
    return bool((squared - along * along < radius * radius) & (along > -radius))


@inlined
def irradiance(harmonics: NDArray[np.float32], x: np.float32, y: np.float32, z: np.float32) -> Rgb:
    """Return the irradiance (r, g, b) of the environment on a plane with a unit normal, from its nine products with the basis."""
    r, g, b = _order_two(harmonics, 0, x, y, z), _order_two(harmonics, 1, x, y, z), _order_two(harmonics, 2, x, y, z)
    return max(r, _ZERO), max(g, _ZERO), max(b, _ZERO)


_C1, _C2, _C3, _C4, _C5 = (np.float32(c) for c in (0.429043, 0.511664, 0.743125, 0.886227, 0.247708))


@inlined
def _order_two(c: NDArray[np.float32], k: int, x: np.float32, y: np.float32, z: np.float32) -> np.float32:
    """Return equation 13; rows of ``c``: L00, L1-1, L10, L11, L2-2, L2-1, L20, L21, L22."""
    value: np.float32 = _C1 * c[8, k] * (x * x - y * y) + _C3 * c[6, k] * z * z + _C4 * c[0, k] - _C5 * c[6, k]
    value += np.float32(2.0) * _C1 * (c[4, k] * x * y + c[7, k] * x * z + c[5, k] * y * z)
    value += np.float32(2.0) * _C2 * (c[3, k] * x + c[1, k] * y + c[2, k] * z)
    return value


@inlined
def _backdrop(light: OutsideLight, x: np.float32, y: np.float32, z: np.float32) -> Rgb:
    """Return what lies beyond everything: wooded hills in haze up to some degrees above the horizon, the sky with its clouds."""
    r, g, b = sky_luminance(light.sky, x, y, z)
    ridge = np.float32(0.012) + np.float32(0.05) * value_noise(x * np.float32(2.3) + np.float32(7.0), y * np.float32(2.3), 21)
    ridge += np.float32(0.006) * value_noise(x * np.float32(40.0), y * np.float32(40.0), 22)
    ridge += np.float32(0.004) * value_noise(x * np.float32(150.0), y * np.float32(150.0), 23)
    if z < ridge:
        er, eg, eb = irradiance(light.harmonics, _ZERO, _ZERO, _ONE)
        up = max(light.to_sun[2], _ZERO)
        er, eg, eb = er + up * light.beam[0], eg + up * light.beam[1], eb + up * light.beam[2]
        tone = np.float32(0.7) + np.float32(0.6) * value_noise(x * np.float32(90.0), y * np.float32(90.0) + z * np.float32(300.0), 24)
        wr, wg, wb = np.float32(0.03) * tone, np.float32(0.045) * tone, np.float32(0.022) * tone
        far = np.float32(0.45)
        near = (_ONE - far) * _INV_PI
        return far * r + near * wr * er, far * g + near * wg * eg, far * b + near * wb * eb
    if light.clouds[0] <= _ZERO:
        return r, g, b
    scale = np.float32(1.7) / (z + np.float32(0.12))
    u, v, cover, weight = x * scale, y * scale, _ZERO, np.float32(0.5)
    for octave in range(5):
        cover += weight * value_noise(u + np.float32(19.7 * octave), v, 31 + octave)
        u, v, weight = u * np.float32(2.1), v * np.float32(2.1), weight * np.float32(0.55)
    cover = (cover - np.float32(0.55)) * light.clouds[0]
    cover = min(max(cover, -light.clouds[1]), light.clouds[1])
    gray = np.float32(0.2126) * r + np.float32(0.7152) * g + np.float32(0.0722) * b
    white = min(max(np.float32(2.0) * cover, _ZERO), np.float32(0.8))
    gain = _ONE + cover
    return gain * (r + white * (gray - r)), gain * (g + white * (gray - g)), gain * (b + white * (gray - b))


@inlined
def sky_luminance(sky: NDArray[np.float32], x: np.float32, y: np.float32, z: np.float32) -> Rgb:
    """Return the sky's luminance in a unit direction, that of the horizon below it."""
    return bilinear_map(sky, x, y, max(z, np.float32(0.01)))
