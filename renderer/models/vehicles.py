"""Cars, whose bonnet points along +x, and bicycles.

Lengths along a car are shares of its length from the tail, heights shares of its height.  The bodies are those of small and middle-sized
cars: hatchback, estate, saloon.
"""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

import kernel_cache.elementary as el
from renderer.core.arrays import Array
from renderer.geometry.lofts import bent, chain, disc, loft, lying, oval, points, ring
from renderer.geometry.mesh import Mesh
from renderer.geometry.shapes import block, blocks, lathe, merged, moved, rod, rotated, rounded_box, sheet, sweep
from renderer.models.car_cabin import Tub, dashboard, panes, seats
from renderer.models.model import Model, Parts, Pieces, Size
from renderer.models.printed import letter, on_side

_REAR_AXLE, _FRONT_AXLE = 0.19, 0.805

_MIRROR_SHARE = 0.9
"""Width of the body, over that with mirrors."""

_SECTION = 34
"""Points round a section of the body."""

_DOOR_SEAMS = (0.34, 0.5, 0.69)

_BONNET_SHARES, _BONNET_WIDE = (0.765, 0.955), 0.8
"""Where the bonnet begins and ends, in shares of the length, and its half width over that of the body."""
_WIPER_SHARE = 0.755

_TUB_BEHIND, _TUB_BEFORE, _TUB_WALL = 0.075, 0.075, 0.003
"""How far within the panes' ends the hollow for people begins and ends, and half the thickness of its end walls, over the length."""
_TUB_WIDE, _TUB_FLOOR = 0.8, 0.24
"""Half the width of that hollow over that of the body, and the height of its floor over that of the car."""

_LAMP_ACROSS = 0.72
"""Where lamps begin at the ends of a car, over half its width there."""

_PLATE_M = (0.52, 0.11)
"""Width and height of a number plate of the European Union."""
_LETTERS, _LETTER_M, _LETTER_PITCH_M = "abc def", (0.042, 0.072, 0.01), 0.061
"""Places of a plate's letters and of the gap among them; width, height and strokes of one, and from one to the next."""


class _Profile(NamedTuple):
    """The side view of a style.

    belt: (share of the length, share of the height) along the upper edge of the body below the windows.
    cabin_base, cabin_roof: share of the length at which the windows begin and end, at the belt and below the roof.
    """

    belt: tuple[tuple[float, float], ...]
    cabin_base: tuple[float, float]
    cabin_roof: tuple[float, float]


_BONNET = ((0.46, 0.64), (0.7, 0.62), (0.76, 0.605), (0.88, 0.56), (0.955, 0.5), (0.985, 0.45), (1.0, 0.4))

_PROFILES = {
    "hatchback": _Profile(((0.0, 0.56), (0.015, 0.62), (0.06, 0.66), *_BONNET), (0.03, 0.75), (0.11, 0.56)),
    "estate": _Profile(((0.0, 0.56), (0.015, 0.62), (0.06, 0.65), *_BONNET), (0.02, 0.75), (0.055, 0.56)),
    "saloon": _Profile(((0.0, 0.56), (0.012, 0.6), (0.05, 0.625), (0.2, 0.65), *_BONNET), (0.14, 0.75), (0.29, 0.56)),
}


def build_car(rng: np.random.Generator, size_m: Size, style: str) -> Pieces:
    """Return a car: body, glass with seats and a dashboard behind it, trim, tyres, rims, headlamps, tail lamps and number plates."""
    length, width, height = size_m
    profile, half = _PROFILES[style], 0.5 * _MIRROR_SHARE * width
    radius = 0.215 * height
    shell = _Shell(profile, length, half, height, radius + 0.045)
    cabin = [_cabin_ring(shell, profile, t) for t in (0.0, 0.35, 0.7, 1.0)]
    roof = cabin[-1]
    centre = roof.mean(axis=0)
    crown = [
        centre + (roof - centre) * (s, s, 1.0) + (0.0, 0.0, z) for s, z in ((1.012, -0.02), (1.02, 0.012), (0.96, 0.035), (0.7, 0.052))
    ]
    mirrors = [_wing_mirror(shell, s, 0.5 * width) for s in (-1.0, 1.0)]
    belly = blocks(*_belly(shell), 0.04)
    grille = rounded_box((0.44 * length, -0.56 * half, 0.235 * height), (0.5 * length + 0.004, 0.56 * half, 0.33 * height), 0.03, 2)
    tyre, rim = _wheel(radius, 0.21, 5 + int(rng.integers(0, 5)))
    board = dashboard(shell.tub, shell.x(profile.cabin_base[0]) + 0.06, shell.x(profile.cabin_base[1]) - 0.1)
    seams = [*(shell.seam(f, s) for f in _DOOR_SEAMS for s in (-1.0, 1.0)), *_bonnet_seams(shell)]
    places = [(shell.x(f), s * (half - 0.115), s) for f in (_REAR_AXLE, _FRONT_AXLE) for s in (-1.0, 1.0)]
    front, rear = (0.4985 * length, 0.29 * height), (-0.5 * length, 0.45 * height)
    return {
        "body": [loft(shell.rings()), loft(crown), *_pillars(cabin), *mirrors],
        "glass": panes(cabin),
        "seats": seats(shell.tub, height),
        "trim": [belly, grille, *seams, *_wipers(shell), *_handles(shell), board, *_registration(rng, (front, rear))],
        "tyres": [moved(tyre, x, y, radius) for x, y, _ in places],
        "rims": [moved(rotated(rim, "z", 0.0 if s > 0.0 else math.pi), x, y, radius) for x, y, s in places],
        "headlamps": [_lamp(shell, s, (0.99, 0.9), (0.33, 0.41)) for s in (-1.0, 1.0)],
        "tail_lamps": [_lamp(shell, s, (0.0, 0.05), (0.43, 0.53)) for s in (-1.0, 1.0)],
        "plates": [_plate(*front), _plate(*rear)],
    }


class _Shell:
    """The body below the windows, cut open round the wheels.

    Args:
        profile: its side view.
        length, half, height: of the car, metres; ``half`` is half the width of the body.
        arch: radius of the wheel arches, metres.
    """

    def __init__(self, profile: _Profile, length: float, half: float, height: float, arch: float) -> None:
        self.length, self.half, self.height, self.arch = length, half, height, arch
        self._belt = np.array(profile.belt)
        self._hollow = (profile.cabin_base[0] + _TUB_BEHIND, profile.cabin_base[1] - _TUB_BEFORE)
        ends = (self.x(self._hollow[0]), self.x(self._hollow[1]))
        self.tub = Tub(ends, _TUB_WIDE * half, _TUB_FLOOR * height, min(self.belt(share) for share in self._hollow))

    def x(self, share: float) -> float:
        """Return x at a share of the length."""
        return (share - 0.5) * self.length

    def belt(self, share: float) -> float:
        """Return the height of the upper edge at a share of the length."""
        return self.height * float(np.interp(share, *self._belt.T))

    def half_width(self, share: float) -> float:
        """Return half the width at a share of the length: rounded towards both ends."""
        return self.half * float(
            np.interp(share, (0.0, 0.01, 0.05, 0.16, 0.8, 0.92, 0.97, 0.992, 1.0), (0.8, 0.87, 0.95, 1.0, 1.0, 0.96, 0.9, 0.8, 0.7))
        )

    def rings(self) -> list[Array]:
        """Return the sections from the tail to the nose, close together where an arch begins."""
        reach = self.arch / self.length
        arches = [axle + reach * math.cos(a) for axle in (_REAR_AXLE, _FRONT_AXLE) for a in np.linspace(0.0, math.pi, 15)]
        ends = [0.0, 0.004, 0.012, 0.025, 0.96, 0.975, 0.985, 0.993, 1.0]
        steps = [axle + s * (reach + 0.0005) for axle in (_REAR_AXLE, _FRONT_AXLE) for s in (-1.0, 1.0)]
        walls = [share + s for share in self._hollow for s in (-_TUB_WALL, _TUB_WALL)]
        return [self._hollowed(f) for f in sorted({*ends, *arches, *steps, *walls, *np.linspace(0.05, 0.94, 15).tolist()})]

    def _hollowed(self, share: float) -> Array:
        """Return the section at a share of the length, where people sit with its upper side pressed down to the floor."""
        bottom = self._bottom(share)
        ring = self.section(share, bottom)
        if self._hollow[0] < share < self._hollow[1]:
            inside = (np.abs(ring[:, 1]) < self.tub.half) & (ring[:, 2] > 0.5 * (bottom + self.belt(share)))
            ring[inside, 2] = max(self.tub.floor, bottom + 0.04)
        return ring

    def section(self, share: float, bottom: float) -> Array:
        """Return the section (n, 3) at a share of the length, from ``bottom`` to the belt, counter-clockwise seen from the front."""
        top, w = self.belt(share), self.half_width(share)
        flat = oval(w, 0.5 * (top - bottom), 0.0, power=4.6, points=_SECTION)
        z = 0.5 * (top + bottom) + flat[:, 1]
        waist = (z / self.height - 0.36) / 0.3
        crown = 0.012 * self.height * (1.0 - (flat[:, 0] / w) ** 2) * (flat[:, 1] > 0.0)
        return points(self.x(share), flat[:, 0] * (1.0 - 0.05 * waist**2), z + crown)

    def seam(self, share: float, side: float) -> Mesh:
        """Return the gap at the edge of a door: a thin dark line down the side of the body."""
        ring = self.section(share, self._bottom(share))
        line = ring[(side * ring[:, 1] > 0.7 * self.half) & (ring[:, 2] > 0.2 * self.height)]
        return sweep(line[np.argsort(line[:, 2], kind="stable")], 0.005, 6)

    def on_top(self, share: float, across: float) -> Array:
        """Return the point (3,) of the upper side at a share of the length, ``across`` half the width from the middle."""
        ring = self.section(share, self._bottom(share))
        upper = ring[ring[:, 2] > 0.5 * (ring[:, 2].min() + ring[:, 2].max())]
        upper = upper[np.argsort(upper[:, 1], kind="stable")]
        y = across * self.half_width(share)
        return np.array([self.x(share), y, np.interp(y, upper[:, 1], upper[:, 2])])

    def _bottom(self, share: float) -> float:
        low = self.height * float(np.interp(share, (0.0, 0.03, 0.1, 0.9, 0.97, 1.0), (0.3, 0.2, 0.125, 0.125, 0.17, 0.22)))
        axle = _REAR_AXLE if share < 0.5 else _FRONT_AXLE
        away = (share - axle) * self.length / self.arch
        centre = self.arch - 0.045
        return max(low, centre + self.arch * math.sqrt(1.0 - away**2)) if abs(away) < 1.0 else low


def _belly(shell: _Shell) -> tuple[Array, Array]:
    """Return two opposite corners each, (3, 3), of the body's underside and of what is seen behind the wheels."""
    x = [
        (-0.45 * shell.length, 0.44 * shell.length),
        *((shell.x(f) - shell.arch, shell.x(f) + shell.arch) for f in (_REAR_AXLE, _FRONT_AXLE)),
    ]
    low, high = np.array(x).T
    tops = shell.height * np.array([_TUB_FLOOR - 0.02, 0.4, 0.4])
    return points(low, -0.7 * shell.half, 0.115 * shell.height), points(high, 0.7 * shell.half, tops)


def _cabin_ring(shell: _Shell, profile: _Profile, t: float) -> Array:
    """Return the outline (32, 3) of the windows, ``t`` of the way from the belt to the roof."""
    rear, front = (a + (b - a) * el.power(t, 1.1) for a, b in zip(profile.cabin_base, profile.cabin_roof, strict=True))
    base = min(shell.belt(rear), shell.belt(front)) - 0.06
    z = base + (0.965 * shell.height - base) * t
    half = shell.half * (0.9 - 0.2 * t)
    return oval(0.5 * shell.length * (front - rear), half, z, x=shell.x(0.5 * (front + rear)), power=5.0, points=32)


def _pillars(cabin: list[Array]) -> list[Mesh]:
    """Return the posts between the windows: at the corners and at the sides, just proud of the glass."""
    rings = np.array(cabin)
    low = rings[0]
    x = (low[:, 0] - low[:, 0].mean()) / np.ptp(low[:, 0])
    columns = [int(np.argmin(np.abs(x - at) + 10.0 * (s * low[:, 1] < 0.0))) for at in (-0.47, -0.2, 0.08, 0.47) for s in (-1.0, 1.0)]
    return [sweep(rings[:, column], 0.03, 8) for column in columns]


def _wing_mirror(shell: _Shell, side: float, half_width: float) -> Mesh:
    """Return the housing of a mirror at the foot of the windscreen, out to half the width of the car."""
    x, z, near = shell.x(0.665), shell.belt(0.665) + 0.02, 0.74 * shell.half
    a, b = sorted((side * near, side * half_width))
    return rounded_box((x - 0.05, a, z), (x + 0.09, b, z + 0.13), 0.04, 2)


def _bonnet_seams(shell: _Shell) -> list[Mesh]:
    """Return the gaps round the bonnet: along both wings, and across above the grille."""
    shares, across = np.linspace(*_BONNET_SHARES, 8), np.linspace(-_BONNET_WIDE, _BONNET_WIDE, 7)
    sides = [np.array([shell.on_top(float(f), s * _BONNET_WIDE) for f in shares]) for s in (-1.0, 1.0)]
    front = np.array([shell.on_top(_BONNET_SHARES[1], float(a)) for a in across])
    return [sweep(line, 0.004, 5) for line in (*sides, front)]


def _wipers(shell: _Shell) -> list[Mesh]:
    """Return the two wipers, which rest at the foot of the windscreen."""
    ends = ((-0.62, 0.05), (0.08, 0.75))
    return [sweep(np.array([shell.on_top(_WIPER_SHARE, a) for a in pair]) + np.array([0.0, 0.0, 0.02]), 0.009, 8) for pair in ends]


def _handles(shell: _Shell) -> list[Mesh]:
    handles = []
    for share in (0.385, 0.545):
        x, z, y = shell.x(share), shell.belt(share) - 0.12, shell.half
        handles += [
            block((x - 0.09, s * y - 0.025 - 0.005 * s, z), (x + 0.09, s * y + 0.025 - 0.005 * s, z + 0.03), 0.009) for s in (-1.0, 1.0)
        ]
    return handles


def _lamp(shell: _Shell, side: float, shares: tuple[float, float], levels: tuple[float, float]) -> Mesh:
    """Return a lamp that wraps a corner of the body, a little proud of it: across the end and along the side, between two heights.

    ``shares``: of the length, first that at the end; ``levels``: of the height.
    """
    end = math.copysign(1.0, shares[0] - shares[1])
    z, out = shell.height * np.linspace(*levels, 4), 0.014 * np.array([0.7 * end, 0.7 * side, 0.0])
    rows = []
    for share in np.linspace(*shares, 9).tolist():
        ring = shell.section(share, 0.2 * shell.height)
        outer = ring[side * ring[:, 1] > 0.0]
        outer = outer[np.argsort(outer[:, 2], kind="stable")]
        rows.append(points(shell.x(share), np.interp(z, outer[:, 2], outer[:, 1]), z))
    rows.insert(0, rows[0] * (1.0, _LAMP_ACROSS, 1.0))
    grid = np.array(rows)[:: int(side * end)]
    return sheet(grid + out, grid - 2.0 * out)


def _plate(x: float, z: float) -> Mesh:
    wide, tall = _PLATE_M
    return block((x - 0.012, -0.5 * wide, z - 0.5 * tall), (x + 0.012, 0.5 * wide, z + 0.5 * tall), 0.004)


def _registration(rng: np.random.Generator, plates: Sequence[tuple[float, float]]) -> list[Mesh]:
    """Return the same made-up letters on plates at x and z, on the side that looks away from the car."""
    wide, tall, thick = _LETTER_M
    left = -0.5 * ((len(_LETTERS) - 1) * _LETTER_PITCH_M + wide)
    strokes = [
        stroke
        for place, sign in enumerate(_LETTERS)
        if sign != " "
        for stroke in letter(rng, left + place * _LETTER_PITCH_M, -0.5 * tall, wide, tall, thick)
    ]
    return [moved(on_side(strokes, x + math.copysign(0.012, x)), 0.0, 0.0, z) for x, z in plates]


def _wheel(radius: float, width: float, spokes: int) -> tuple[Mesh, Mesh]:
    """Return tyre and rim about the y axis; the rim's face looks along +y."""
    half, inner = 0.5 * width, 0.66 * radius
    tread = points(
        [inner, radius - 0.025, radius, radius, radius - 0.025, inner], [-half + 0.01, -half, -half + 0.03, half - 0.03, half, half - 0.01]
    )
    barrel = [(inner + 0.004, -half + 0.015), (inner + 0.004, half - 0.012), (inner - 0.015, half - 0.012), (inner - 0.03, -half + 0.015)]
    bars = [
        rotated(block((-0.028, half - 0.055, 0.0), (0.028, half - 0.022, inner - 0.01), 0.008), "y", k * 2.0 * math.pi / spokes)
        for k in range(spokes)
    ]
    hub = disc("y", (0.0, half - 0.04, 0.0), 0.075, 0.05, 18, 0.012)
    back = disc("y", (0.0, -half + 0.05, 0.0), inner - 0.01, 0.02, 20)
    return lying(lathe(tread, 28, closed=True), "y"), merged(lying(lathe(barrel, 28, closed=True), "y"), *bars, hub, back)


def saddle(rng: np.random.Generator, length: float, width: float, top: tuple[float, float, float], nose: float) -> Mesh:
    """Return a padded saddle whose nose looks along x times ``nose``; its highest point is ``top``."""
    shares = np.linspace(-0.5, 0.5, 11)
    half = 0.5 * width * np.interp(shares, [-0.5, -0.44, -0.3, 0.0, 0.2, 0.45, 0.5], [0.5, 0.85, 1.0, 0.6, 0.28, 0.2, 0.08])
    t = np.linspace(-1.0, 1.0, 9)
    x = nose * length * np.repeat(shares[:, None], 9, axis=1)
    y = half[:, None] * el.sin(0.5 * math.pi * t)[None]
    crown = np.sqrt(np.clip(1.0 - el.sin(0.5 * math.pi * t) ** 2, 0.0, 1.0))[None]
    z = -0.012 * (1.0 - el.cos(2.5 * shares))[:, None] - 0.045 * (1.0 - crown)
    upper = np.dstack([x, y, z])
    lower = np.dstack([x, y, np.minimum(z - 0.004, -0.05 + 0.0 * z)])
    if nose < 0.0:
        upper, lower = upper[::-1], lower[::-1]
    return moved(sheet(upper, lower), *top)


def turned(parts: Parts, angle_rad: float) -> Parts:
    """Return all parts turned about the vertical axis."""
    return {name: rotated(mesh, "z", angle_rad) for name, mesh in parts.items()}


def build_bicycle(rng: np.random.Generator, size_m: Size, style: str) -> Pieces:
    """Return a diamond-frame or step-through bicycle on its stand, its front wheel towards +x or, where that is the long side, +y."""
    along_y = size_m[1] > size_m[0]
    length, width, height = (size_m[1], size_m[0], size_m[2]) if along_y else size_m
    half_l, half_w = 0.5 * length, 0.5 * width
    r = min(0.345, 0.196 * length, 0.36 * height)
    rear, front = (-half_l + r, 0.0, r), (half_l - r, 0.0, r)
    crank = (-0.06 * length, 0.0, 0.82 * r)
    seat = (crank[0] - 0.1 * length, 0.0, height * 0.74)
    head_low, head_high = (front[0] - 0.1 * length, 0.0, height * 0.6), (front[0] - 0.125 * length, 0.0, height * 0.78)
    down = 0.3 if style == "diamond" else 0.72
    lower = (seat[0] + down * (crank[0] - seat[0]), 0.0, seat[2] + down * (crank[2] - seat[2]))
    tubes = [
        *chain([crank, head_low], 0.02, 10),
        *chain([lower, head_high], 0.018, 10),
        *chain([crank, seat], 0.018, 10),
        *chain([head_low, head_high], 0.022, 10),
    ]
    for s in (-1.0, 1.0):
        hub = (rear[0], s * 0.055, rear[2])
        tubes += [*chain([(crank[0], s * 0.03, crank[2]), hub], 0.009), *chain([(seat[0], s * 0.015, seat[2] - 0.04), hub], 0.008)]
        tubes.append(
            bent(
                [(head_low[0] + 0.002, s * 0.035, head_low[2] - 0.02), (front[0] - 0.03, s * 0.05, 1.25 * r), (front[0], s * 0.05, r)],
                0.012,
                0.1,
                8,
            )
        )
    tubes.append(rod((head_low[0], -0.045, head_low[2] - 0.02), (head_low[0], 0.045, head_low[2] - 0.02), 0.02))
    tyres = [ring("y", hub, r - 0.018, 0.018, 40, 8) for hub in (rear, front)]
    rims = [ring("y", hub, r - 0.042, 0.011, 36, 6) for hub in (rear, front)]
    rims += [piece for hub in (rear, front) for piece in _spokes(hub, r - 0.045)]
    parts = {"frame": merged(*tubes), "tyres": merged(*tyres), "rims": merged(*rims), "drive": _drive(rng, crank, rear, r)}
    post = (seat[0] - 0.012 * length, 0.0, height * 0.86)
    top = (head_high[0] - 0.03, 0.0, height - 0.03)
    back = 0.12 if style == "diamond" else 0.2
    reach = [(top[0] - back, s * (half_w - 0.01), top[2] + 0.012) for s in (-1.0, 1.0)]
    middle = [(top[0] + 0.03, s * 0.5 * half_w, top[2] + 0.005) for s in (-1.0, 1.0)]
    bars = [
        bent([reach[0], middle[0], (top[0] + 0.03, 0.0, top[2] - 0.02), middle[1], reach[1]], 0.012, 0.1, 10),
        *chain([head_high, (top[0] + 0.03, 0.0, top[2] - 0.02)], 0.015),
    ]
    bars += chain([(seat[0], 0.0, seat[2]), (post[0], 0.0, post[2] - 0.04)], 0.014)
    grips = [
        sweep([end, tuple(0.55 * np.asarray(end) + 0.45 * np.asarray(mid))], 0.018, 10) for end, mid in zip(reach, middle, strict=True)
    ]
    parts |= {"bars": merged(*bars), "grips": merged(*grips), "saddle": saddle(rng, 0.26, 0.16 if style == "diamond" else 0.2, post, 1.0)}
    return turned(parts, 0.5 * math.pi) if along_y else parts


def _spokes(hub: Sequence[float], reach: float) -> list[Mesh]:
    """Return a hub and the spokes from its two ends."""
    x, _, z = hub
    turns = [2.0 * math.pi * (k + 0.3) / 18 for k in range(18)]
    spokes = [
        sweep([(x, 0.025 * (-1) ** k, z), (x + reach * math.cos(a), 0.0, z + reach * math.sin(a))], 0.0016, 4) for k, a in enumerate(turns)
    ]
    return [rod((x, -0.06, z), (x, 0.06, z), 0.018, segments=10), *spokes]


def _drive(rng: np.random.Generator, crank: Sequence[float], rear: Sequence[float], r: float) -> Mesh:
    """Chain wheel, chain, sprocket, cranks with pedals, and the stand."""
    y = -0.045
    wheel, sprocket = min(0.09, 0.27 * r), 0.035
    a, b = np.array([crank[0], y, crank[2]]), np.array([rear[0], y, rear[2]])
    meshes = [ring("y", tuple(a), wheel, 0.008, 24, 6, 0.5), disc("y", tuple(b), sprocket, 0.012, 18)]
    turn = rng.uniform(0.0, 2.0 * math.pi)
    meshes += [sweep([a, a + wheel * np.array([math.cos(t), 0.0, math.sin(t)])], 0.006, 6) for t in turn + np.arange(5) * 2.0 * math.pi / 5]
    meshes += [sweep(np.array([a, b]) + np.outer((wheel, sprocket), (0.0, 0.0, s)), 0.004, 6) for s in (-1.0, 1.0)]
    meshes.append(rod((crank[0], -0.07, crank[2]), (crank[0], 0.07, crank[2]), 0.018))
    for s in (-1.0, 1.0):
        reach = min(0.17, 0.62 * crank[2])
        x, z = crank[0] + s * reach * math.cos(turn), crank[2] + s * reach * math.sin(turn)
        meshes += [
            sweep([(crank[0], s * 0.07, crank[2]), (x, s * 0.075, z)], 0.009, 8),
            block((x - 0.04, s * 0.12 - 0.035, z - 0.011), (x + 0.04, s * 0.12 + 0.035, z + 0.011), 0.004),
        ]
    meshes += [sweep([(crank[0] - 0.08, s * 0.03, crank[2] - 0.01), (crank[0] - 0.05, s * 0.16, 0.009)], 0.009, 8) for s in (-1.0, 1.0)]
    return merged(*meshes)


MODELS = {"car": Model(build_car, ("hatchback", "estate", "saloon")), "bicycle": Model(build_bicycle, ("diamond", "step_through"))}
