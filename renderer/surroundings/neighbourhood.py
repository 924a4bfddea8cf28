"""Neighbourhoods by seed: houses, fences, trees, hedges and street lamps around a room.

Metres, x along the street, y across it, z up from the ground; the room stands at the origin, the street runs on the side of +y.  Houses
keep 12 m and more from the room.  What would stand between the room and the sun is left out, so that sunlight in the room and what is seen
through its windows agree.
"""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from renderer.core.arrays import Array

PLANES = 8
FACADE, ROOF, BOARDS, POST = range(4)
"""What the surface of a convex body looks like."""

WIDTH, DEPTH, STOREY_M, WINDOW_PITCH_M, RED, GREEN, BLUE, NUMBER = range(8)
"""Columns of ``Neighbourhood.looks``: size along its own axes, height of storeys, distance of windows, base colour, its number."""
LOOK = 8
CLUMP = 8
"""Columns of a clump: centre x, y, z, radius, base colour, brightness within its crown, or ``BARK``."""


class Neighbourhood(NamedTuple):
    """What stands around a room, for kernels; float32 where nothing else is said.

    planes: (c, PLANES, 4), convex bodies as unit normals n and distances d, inside where n . p <= d; faces 0 to 3 of a facade are its walls
    towards +x, +y, -x, -y.  kind: (c,) int32.  corner: (c, 3), x and y of a body's corner, height of its eaves.  looks: (c, LOOK).
    spheres: (c, 4), a sphere around each body.  clumps: (n, CLUMP), balls of leaves.  crowns: (t, 4), spheres about trees, for shadows.
    lamps: (l, 3), heads of street lamps.  street: (3,), y of the street's middle, half the width of the carriageway, and half that of
    carriageway and pavements.
    """

    planes: NDArray[np.float32]
    kind: NDArray[np.int32]
    corner: NDArray[np.float32]
    looks: NDArray[np.float32]
    spheres: NDArray[np.float32]
    clumps: NDArray[np.float32]
    crowns: NDArray[np.float32]
    lamps: NDArray[np.float32]
    street: NDArray[np.float32]


class Row(NamedTuple):
    """A row of houses along the street: where its front is, in m, which way its depth goes, gaps between houses, and their storeys."""

    front_m: tuple[float, float]
    side: float
    gap_m: tuple[float, float]
    width_m: tuple[float, float]
    storeys: tuple[int, int]
    left_out_m: float = 0.0
    """Half the length along the street that stays free, where the room's own house stands."""


class Setting(NamedTuple):
    """What a setting has: rows of houses, share of flat roofs, numbers and heights of trees, places of hedges, street and fence."""

    rows: tuple[Row, ...]
    flat_roofs: float
    trees: tuple[int, int]
    tree_height_m: tuple[float, float]
    hedges_y_m: tuple[float, ...]
    street_y_m: float
    half_street_m: float
    fence_y_m: float = 0.0
    belt: int = 0
    """Trees of the belt behind everything."""


_DETACHED = ((5.0, 9.0), (8.0, 12.0), (1, 2))
SETTINGS: dict[str, Setting] = {
    "suburb": Setting(
        (
            Row((21.0, 24.0), 1.0, *_DETACHED),
            Row((-30.0, -25.0), -1.0, *_DETACHED),
            Row((4.0, 5.0), -1.0, (4.0, 6.0), (9.0, 12.0), (1, 2), 12.0),
        ),
        0.1, (18, 28), (4.0, 11.0), (-15.0, 8.2, 18.6), 13.0, 2.8, -9.0, 50,
    ),
    "town": Setting(
        (
            Row((17.0, 18.0), 1.0, (0.0, 0.0), (9.0, 16.0), (3, 5)),
            Row((-34.0, -28.0), -1.0, (0.0, 4.0), (12.0, 20.0), (3, 5)),
            Row((5.0, 5.5), -1.0, (0.0, 0.5), (10.0, 15.0), (3, 4), 12.0),
        ),
        0.35, (14, 24), (6.0, 12.0), (-24.0,), 11.0, 3.4, belt=30,
    ),
    "country": Setting(
        (Row((34.0, 42.0), 1.0, (25.0, 60.0), (9.0, 13.0), (1, 2)), Row((-60.0, -48.0), -1.0, (30.0, 70.0), (10.0, 18.0), (1, 2))),
        0.0, (26, 40), (5.0, 14.0), (-12.0,), 20.0, 2.2, 8.5, 70,
    ),
}  # fmt: skip
"""Name -> what it has; written by hand, after common distances and sizes."""

_WALLS = (
    (0.48, 0.45, 0.39),
    (0.55, 0.52, 0.46),
    (0.46, 0.37, 0.25),
    (0.27, 0.12, 0.085),
    (0.37, 0.37, 0.355),
    (0.48, 0.40, 0.31),
    (0.32, 0.18, 0.13),
)
_ROOFS = ((0.24, 0.09, 0.06), (0.10, 0.10, 0.11), (0.17, 0.10, 0.08), (0.06, 0.06, 0.065))
_LEAVES = ((0.060, 0.088, 0.026), (0.076, 0.105, 0.030), (0.044, 0.068, 0.024), (0.095, 0.112, 0.030))
BARK = 2.0
"""Last column of a ball of bark."""
_BELT_M = (38.0, 62.0)
_FULL_LEAVES_M = 14.0
"""Distance beyond which crowns have fewer balls of leaves, larger ones."""
_REACH_M = 70.0
_KEPT_FREE_M = 4.5
"""No tree stands nearer to the room than this."""
_CLEAR_OF_SUN_RAD = math.radians(4.0)


class _Body(NamedTuple):
    planes: list[tuple[float, float, float, float]]
    kind: int
    corner: tuple[float, float, float]
    look: tuple[float, ...]
    sphere: tuple[float, float, float, float]


def make_neighbourhood(rng: np.random.Generator, setting: Setting, to_sun: Sequence[float] | None) -> Neighbourhood:
    """Draw what stands around a room.

    Args:
        rng: source of randomness.
        setting: an entry of ``SETTINGS``.
        to_sun: unit vector towards the sun in the neighbourhood's frame, None where no sun shines.
    """
    bodies: list[_Body] = []
    for row in setting.rows:
        bodies += _houses(rng, row, setting.flat_roofs)
    if setting.fence_y_m:
        bodies += [
            _box((x, setting.fence_y_m, 0.0), (4.0, 0.04, 1.15), BOARDS, (0.30, 0.22, 0.14), rng) for x in np.arange(-26.0, 26.0, 4.0)
        ]
    lamps = [
        (x, setting.street_y_m - setting.half_street_m - 0.8, 5.6) for x in np.arange(-52.0, 53.0, 26.0) + float(rng.uniform(-8.0, 8.0))
    ]
    bodies += [_box((x - 0.05, y - 0.05, 0.0), (0.1, 0.1, z), POST, (0.2, 0.2, 0.2), rng) for x, y, z in lamps]
    crowns, clumps = _trees(rng, setting)
    hedges = [_hedge(rng, y) for y in setting.hedges_y_m]
    kept = [body for body in bodies if not _before_sun(body.sphere, to_sun)]
    standing = [i for i, crown in enumerate(crowns) if not _before_sun(crown, to_sun)]
    leaves = [clumps[i] for i in standing] + hedges
    return Neighbourhood(
        np.array([body.planes for body in kept], np.float32).reshape(-1, PLANES, 4),
        np.array([body.kind for body in kept], np.int32),
        np.array([body.corner for body in kept], np.float32).reshape(-1, 3),
        np.array([body.look for body in kept], np.float32).reshape(-1, LOOK),
        np.array([body.sphere for body in kept], np.float32).reshape(-1, 4),
        np.concatenate([np.zeros((0, CLUMP)), *leaves]).astype(np.float32),
        np.array([crowns[i] for i in standing], np.float32).reshape(-1, 4),
        np.array(lamps, np.float32),
        np.array([setting.street_y_m, setting.half_street_m, setting.half_street_m + 1.8], np.float32),
    )


def _before_sun(sphere: Sequence[float], to_sun: Sequence[float] | None) -> bool:
    """Return whether a sphere (x, y, z, radius) comes within some degrees of the sun, or is higher at the sun's azimuth."""
    if to_sun is None:
        return False
    x, y, z, radius = sphere
    distance = math.hypot(x, y)
    aside = math.asin(min(radius / max(distance, radius), 1.0)) + _CLEAR_OF_SUN_RAD
    turn = abs(math.remainder(math.atan2(y, x) - math.atan2(to_sun[1], to_sun[0]), 2.0 * math.pi))
    top = math.atan2(z + radius, max(distance - radius, 1.0))
    return turn < aside and math.asin(max(min(to_sun[2], 1.0), -1.0)) < top + _CLEAR_OF_SUN_RAD


def _houses(rng: np.random.Generator, row: Row, flat_roofs: float) -> list[_Body]:
    """Return a row of houses, from one end of the street to the other."""
    bodies: list[_Body] = []
    x = -_REACH_M + float(rng.uniform(0.0, 12.0))
    while x < _REACH_M:
        width, depth = float(rng.uniform(*row.width_m)), float(rng.uniform(9.0, 12.0))
        front = float(rng.uniform(*row.front_m))
        storeys, flat = int(rng.integers(row.storeys[0], row.storeys[1] + 1)), bool(rng.random() < flat_roofs)
        pitch = math.tan(math.radians(float(rng.uniform(28.0, 42.0))))
        wall, tiles = _WALLS[int(rng.integers(len(_WALLS)))], _ROOFS[int(rng.integers(len(_ROOFS)))]
        end, along = x + width, bool(rng.random() < 0.6)
        if end < -row.left_out_m or x > row.left_out_m:
            corner = (x, front if row.side > 0.0 else front - depth)
            bodies += _house(rng, corner, (width, depth), storeys, 0.0 if flat else pitch, along, wall, tiles)
        x = end + float(rng.uniform(*row.gap_m))
    return bodies


def _house(
    rng: np.random.Generator,
    corner: tuple[float, float],
    size: tuple[float, float],
    storeys: int,
    pitch: float,
    along: bool,
    wall: tuple[float, float, float],
    tiles: tuple[float, float, float],
) -> list[_Body]:
    """Return walls and roof of a house; ``pitch``: the roof's slope, 0 if flat; ``along``: the ridge runs along the street."""
    (x, y), (width, depth) = corner, size
    storey = float(rng.uniform(2.7, 3.1))
    eaves = storeys * storey + 0.5
    half = 0.5 * (depth if along else width)
    normals = ((1.0, 0.0), (0.0, 1.0), (-1.0, 0.0), (0.0, -1.0))
    offsets = (x + width, y + depth, -x, -y)
    middle = (x + 0.5 * width, y + 0.5 * depth)
    walls = [(a, b, 0.0, d) for (a, b), d in zip(normals, offsets, strict=True)]
    slope = _slopes(middle, half, eaves, pitch, along)
    ridge = eaves + half * pitch
    look = (width, depth, storey, float(rng.uniform(2.1, 3.2)), *wall, float(rng.integers(1, 1 << 20)))
    sphere = (*middle, 0.5 * ridge, math.hypot(0.5 * width, 0.5 * depth, 0.5 * ridge) + 0.8)
    top = slope if pitch > 0.0 else [(0.0, 0.0, 1.0, eaves)] * 2
    bodies = [_Body([*walls, *top, (0.0, 0.0, -1.0, 0.0), _EVERYWHERE], FACADE, (x, y, eaves), look, sphere)]
    if pitch > 0.0:
        over = 0.45
        ends = [(a, b, 0.0, d + (over if (abs(a) > 0.5) != along else 0.25)) for (a, b), d in zip(normals, offsets, strict=True)]
        upper = [(a, b, c, d + 0.18) for a, b, c, d in slope]
        low = (0.0, 0.0, -1.0, -(eaves - over * pitch))
        bodies.append(_Body([*ends, *upper, low, _EVERYWHERE], ROOF, (x, y, eaves), (*look[:4], *tiles, look[7]), sphere))
    return bodies


_EVERYWHERE = (0.0, 0.0, 0.0, 1.0)
"""A plane that cuts nothing off."""


def _slopes(middle: tuple[float, float], half: float, eaves: float, pitch: float, along: bool) -> list[tuple[float, float, float, float]]:
    """Return the two planes of a gable roof."""
    scale = 1.0 / math.sqrt(1.0 + pitch * pitch)
    across = (0.0, 1.0) if along else (1.0, 0.0)
    at = middle[1] if along else middle[0]
    return [
        (s * pitch * scale * across[0], s * pitch * scale * across[1], scale, scale * (eaves + pitch * (half + s * at)))
        for s in (1.0, -1.0)
    ]


def _box(
    corner: tuple[float, float, float],
    size: tuple[float, float, float],
    kind: int,
    color: tuple[float, float, float],
    rng: np.random.Generator,
) -> _Body:
    (x, y, z), (w, d, h) = corner, size
    planes = [(1.0, 0.0, 0.0, x + w), (0.0, 1.0, 0.0, y + d), (-1.0, 0.0, 0.0, -x), (0.0, -1.0, 0.0, -y)]
    planes += [(0.0, 0.0, 1.0, z + h), (0.0, 0.0, -1.0, -z), _EVERYWHERE, _EVERYWHERE]
    sphere = (x + 0.5 * w, y + 0.5 * d, z + 0.5 * h, 0.5 * math.hypot(w, d, h))
    return _Body(planes, kind, (x, y, z + h), (w, d, h, 1.0, *color, float(rng.integers(1, 1 << 20))), sphere)


def _trees(rng: np.random.Generator, setting: Setting) -> tuple[list[tuple[float, float, float, float]], list[Array]]:
    """Return spheres about crowns, and for each the balls of leaves that it is made of: trees between the houses, and a belt far behind."""
    count = int(rng.integers(setting.trees[0], setting.trees[1] + 1))
    crowns: list[tuple[float, float, float, float]] = []
    clumps: list[Array] = []
    while len(crowns) < count + setting.belt:
        x, y = (float(v) for v in rng.uniform(-30.0, 30.0, 2))
        if len(crowns) >= count:
            scale = float(rng.uniform(*_BELT_M)) / max(math.hypot(x, y), 1.0)
            x, y = scale * x, scale * y
        height = float(rng.uniform(*setting.tree_height_m))
        radius = height * float(rng.uniform(0.32, 0.44))
        if math.hypot(x, y) < radius + _KEPT_FREE_M or abs(y - setting.street_y_m) < setting.half_street_m:
            continue
        z = height - 1.1 * radius if len(crowns) < count else 0.85 * radius
        crowns.append((x, y, z, radius))
        clumps.append(_crown(rng, (x, y, z), radius, int((200 + 120 * height) * min(1.0, _FULL_LEAVES_M / math.hypot(x, y)))))
    return crowns, clumps


def _crown(rng: np.random.Generator, center: tuple[float, float, float], radius: float, count: int) -> Array:
    """Return balls of leaves (count + trunk, CLUMP) in the lobes of a crown, darker towards its middle and its lower side."""
    lobes = _directions(rng, int(rng.integers(7, 12))) * rng.uniform(0.25, 0.62, (1, 1)) * np.array([1.0, 1.0, 1.25])
    which = rng.integers(len(lobes), size=count)
    lobe = rng.uniform(0.34, 0.52, len(lobes))[which, None]
    offset = lobes[which] + lobe * _directions(rng, count) * np.sqrt(rng.random((count, 1)))
    deep = np.sqrt((offset * offset).sum(axis=1, keepdims=True))
    size = radius * rng.uniform(0.03, 0.09, (count, 1)) * math.sqrt(600.0 / max(count, 150))
    color = np.array(_LEAVES[int(rng.integers(len(_LEAVES)))]) * rng.uniform(0.75, 1.3, (count, 1))
    lit = 0.35 + 0.65 * np.clip(0.75 * deep + 0.35 * offset[:, 2:] / np.maximum(deep, 0.1), 0.0, 1.0)
    steps = np.arange(0.1, center[2], 0.16)[:, None]
    trunk = np.hstack([np.full_like(steps, center[0]), np.full_like(steps, center[1]), steps, np.full_like(steps, 0.03 + 0.045 * radius)])
    bark = np.broadcast_to(np.array([0.11, 0.085, 0.065, BARK]), (len(steps), 4))
    return np.vstack([np.hstack([np.array(center) + radius * offset, size, color, lit]), np.hstack([trunk, bark])])


def _directions(rng: np.random.Generator, count: int) -> Array:
    """Return unit vectors (count, 3), evenly spread."""
    away = rng.standard_normal((count, 3))
    return np.asarray(away / np.sqrt((away * away).sum(axis=1, keepdims=True)))


def _hedge(rng: np.random.Generator, y: float) -> Array:
    """Return the balls of leaves (n, CLUMP) of a hedge along the street, with a gap or two."""
    count, height = 5000, float(rng.uniform(1.1, 1.7))
    x = rng.uniform(-24.0, 24.0, count)
    gap = float(rng.uniform(-16.0, 16.0))
    z, deep = rng.random(count), rng.uniform(-1.0, 1.0, count)
    color = np.array(_LEAVES[int(rng.integers(len(_LEAVES)))]) * rng.uniform(0.7, 1.25, (count, 1))
    balls = np.column_stack([x, y + 0.3 * deep, 0.1 + z * height, rng.uniform(0.06, 0.13, count), color, 0.35 + 0.6 * z])
    return balls[np.abs(x - gap) > 1.2]
