"""Cars; the bonnet points along +x.

Lengths along a car are shares of its length from the tail, heights shares of its height.  The bodies are those of small and middle-sized
cars: hatchback, estate, saloon.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from renderer.core.arrays import Array
from renderer.geometry.mesh import Mesh
from renderer.geometry.shapes import block, lathe, merged, moved, rotated, rounded_box, sweep
from renderer.models.lofts import disc, loft, lying, oval
from renderer.models.model import Model, Parts, Size, fitted

_REAR_AXLE, _FRONT_AXLE = 0.19, 0.805
_MIRROR_SHARE = 0.9
"""Width of the body, over that with mirrors."""

_SECTION = 34
"""Points round a section of the body."""
_DOOR_SEAMS = (0.34, 0.5, 0.69)
_PLATE_M = (0.52, 0.11)
"""Width and height of a number plate of the European Union."""


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


def build_car(rng: np.random.Generator, size_m: Size, style: str) -> Parts:
    """Return a car with dark windows: body, glass, trim, tyres, rims, headlamps, tail lamps and number plates."""
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
    belly = rounded_box((-0.45 * length, -0.7 * half, 0.115 * height), (0.44 * length, 0.7 * half, 0.4 * height), 0.04, 2)
    grille = rounded_box((0.44 * length, -0.45 * half, 0.2 * height), (0.497 * length, 0.45 * half, 0.34 * height), 0.03, 2)
    tyre, rim = _wheel(radius, 0.21, 5 + int(rng.integers(0, 5)))
    places = [(shell.x(f), s * (half - 0.115), s) for f in (_REAR_AXLE, _FRONT_AXLE) for s in (-1.0, 1.0)]
    return fitted(
        {
            "body": merged(loft(shell.rings()), loft(crown), *_pillars(cabin), *mirrors),
            "glass": loft(cabin),
            "trim": merged(belly, grille, *(shell.seam(f, s) for f in _DOOR_SEAMS for s in (-1.0, 1.0)), *_handles(shell)),
            "tyres": merged(*(moved(tyre, x, y, radius) for x, y, _ in places)),
            "rims": merged(*(moved(rotated(rim, "z", 0.0 if s > 0.0 else math.pi), x, y, radius) for x, y, s in places)),
            "headlamps": merged(*(_lamp(shell, 0.925, s, 0.455, (0.2, 0.3, 0.1)) for s in (-1.0, 1.0))),
            "tail_lamps": merged(*(_lamp(shell, 0.035, s, 0.565, (0.14, 0.24, 0.13)) for s in (-1.0, 1.0))),
            "plates": merged(_plate(0.4985 * length, 0.29 * height), _plate(-0.5 * length, 0.45 * height)),
        },
        size_m,
    )


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
        return [self.section(f, self._bottom(f)) for f in sorted({*ends, *arches, *steps, *np.linspace(0.05, 0.94, 22).tolist()})]

    def section(self, share: float, bottom: float) -> Array:
        """Return the section (n, 3) at a share of the length, from ``bottom`` to the belt, counter-clockwise seen from the front."""
        top, w = self.belt(share), self.half_width(share)
        flat = oval(w, 0.5 * (top - bottom), 0.0, power=4.6, points=_SECTION)
        z = 0.5 * (top + bottom) + flat[:, 1]
        waist = (z / self.height - 0.36) / 0.3
        crown = 0.012 * self.height * (1.0 - (flat[:, 0] / w) ** 2) * (flat[:, 1] > 0.0)
        return np.column_stack([np.full(_SECTION, self.x(share)), flat[:, 0] * (1.0 - 0.05 * waist**2), z + crown])

    def seam(self, share: float, side: float) -> Mesh:
        """Return the gap at the edge of a door: a thin dark line down the side of the body."""
        ring = self.section(share, self._bottom(share))
        line = ring[(side * ring[:, 1] > 0.7 * self.half) & (ring[:, 2] > 0.2 * self.height)]
        return sweep(line[np.argsort(line[:, 2])], 0.005, 6)

    def _bottom(self, share: float) -> float:
        low = self.height * float(np.interp(share, (0.0, 0.03, 0.1, 0.9, 0.97, 1.0), (0.3, 0.2, 0.125, 0.125, 0.17, 0.22)))
        axle = _REAR_AXLE if share < 0.5 else _FRONT_AXLE
        away = (share - axle) * self.length / self.arch
        centre = self.arch - 0.045
        return max(low, centre + self.arch * math.sqrt(1.0 - away**2)) if abs(away) < 1.0 else low


def _cabin_ring(shell: _Shell, profile: _Profile, t: float) -> Array:
    """Return the outline (40, 3) of the windows, ``t`` of the way from the belt to the roof."""
    rear, front = (a + (b - a) * t**1.1 for a, b in zip(profile.cabin_base, profile.cabin_roof, strict=True))
    base = min(shell.belt(rear), shell.belt(front)) - 0.06
    z = base + (0.965 * shell.height - base) * t
    half = shell.half * (0.9 - 0.2 * t)
    return oval(0.5 * shell.length * (front - rear), half, z, x=shell.x(0.5 * (front + rear)), power=5.0, points=40)


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


def _handles(shell: _Shell) -> list[Mesh]:
    handles = []
    for share in (0.385, 0.545):
        x, z, y = shell.x(share), shell.belt(share) - 0.12, shell.half
        handles += [
            rounded_box((x - 0.09, s * y - 0.025 - 0.005 * s, z), (x + 0.09, s * y + 0.025 - 0.005 * s, z + 0.03), 0.012, 2)
            for s in (-1.0, 1.0)
        ]
    return handles


def _lamp(shell: _Shell, share: float, side: float, level: float, size: tuple[float, float, float]) -> Mesh:
    """Return a lamp in a corner of the body, a little proud of it."""
    end = 1.0 if share > 0.5 else -1.0
    x = shell.x(share) + end * 0.28 * size[0]
    y = side * (shell.half_width(share) - 0.46 * size[1])
    z = level * shell.height
    return rounded_box(
        (x - 0.5 * size[0], y - 0.5 * size[1], z - 0.5 * size[2]), (x + 0.5 * size[0], y + 0.5 * size[1], z + 0.5 * size[2]), 0.03, 2
    )


def _plate(x: float, z: float) -> Mesh:
    wide, tall = _PLATE_M
    return block((x - 0.012, -0.5 * wide, z - 0.5 * tall), (x + 0.012, 0.5 * wide, z + 0.5 * tall), 0.004)


def _wheel(radius: float, width: float, spokes: int) -> tuple[Mesh, Mesh]:
    """Return tyre and rim about the y axis; the rim's face looks along +y."""
    half, inner = 0.5 * width, 0.66 * radius
    tread = [
        (inner, -half + 0.01),
        (radius - 0.025, -half),
        (radius, -half + 0.03),
        (radius, half - 0.03),
        (radius - 0.025, half),
        (inner, half - 0.01),
    ]
    barrel = [(inner + 0.004, -half + 0.015), (inner + 0.004, half - 0.012), (inner - 0.015, half - 0.012), (inner - 0.03, -half + 0.015)]
    bars = [
        rotated(block((-0.028, half - 0.055, 0.0), (0.028, half - 0.022, inner - 0.01), 0.008), "y", k * 2.0 * math.pi / spokes)
        for k in range(spokes)
    ]
    hub = disc("y", (0.0, half - 0.04, 0.0), 0.075, 0.05, 24, 0.012)
    back = disc("y", (0.0, -half + 0.05, 0.0), inner - 0.01, 0.02, 20)
    return lying(lathe(tread, 28, closed=True), "y"), merged(lying(lathe(barrel, 28, closed=True), "y"), *bars, hub, back)


MODELS = {"car": Model(build_car, ("hatchback", "estate", "saloon"))}
