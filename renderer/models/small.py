"""Small things: alarm clocks, mugs, waste bins."""

from __future__ import annotations

import math

import numpy as np

from renderer.geometry.mesh import Mesh
from renderer.geometry.shapes import block, blocks, lathe, merged, moved, rod, rotated, rounded_box, sweep
from renderer.models.model import Model, Parts, Size, fitted

SEGMENTS = ("abcdef", "bc", "abged", "abgcd", "fgbc", "afgcd", "afgedc", "abc", "abcdefg", "abcdfg")
"""Lit segments of the digits 0 to 9 of a seven-segment display (a top, then clockwise, g middle)."""


def build_alarm_clock(rng: np.random.Generator, size_m: Size, style: str) -> Parts:
    """Return a digital clock with seven-segment figures or a round one with two bells; the face looks along +x."""
    return fitted({"digital": _digital, "bells": _bells}[style](rng, size_m), size_m)


def _digital(rng: np.random.Generator, size_m: Size) -> Parts:
    depth, width, height = size_m
    half_d, half_w = 0.5 * depth, 0.5 * width
    body = rounded_box((-half_d, -half_w, 0.0), (half_d - 0.002, half_w, height), min(0.012, 0.2 * height), 3)
    face = block((half_d - 0.006, -0.9 * half_w, 0.14 * height), (half_d - 0.0008, 0.9 * half_w, 0.88 * height), 0.0008)
    hour, minute = int(rng.integers(24)), int(rng.integers(60))
    low, high = [], []
    cell = 1.6 * half_w / 4.6
    tall = min(0.5 * height, 1.7 * cell)
    bar = 0.13 * cell
    z0 = 0.5 * height + 0.01 * height - 0.5 * tall
    spans = {
        "a": (0, 1, 1, 1),
        "g": (0, 0.5, 1, 0.5),
        "d": (0, 0, 1, 0),
        "f": (0, 0.5, 0, 1),
        "e": (0, 0, 0, 0.5),
        "b": (1, 0.5, 1, 1),
        "c": (1, 0, 1, 0.5),
    }
    for k, digit in enumerate(f"{hour:02d}{minute:02d}"):
        left = -2.19 * cell + cell * (k * 1.12 + (0.3 if k > 1 else 0.0))
        for name in SEGMENTS[int(digit)]:
            u0, v0, u1, v1 = spans[name]
            low.append(
                (
                    half_d - 0.003,
                    left + 0.72 * cell * u0 - bar * 0.5 * (u0 == u1) + bar * 0.6 * (u0 != u1),
                    z0 + tall * v0 - bar * 0.5 * (v0 == v1) + bar * 0.6 * (v0 != v1),
                )
            )
            high.append(
                (
                    half_d,
                    left + 0.72 * cell * u1 + bar * 0.5 * (u0 == u1) - bar * 0.6 * (u0 != u1),
                    z0 + tall * v1 + bar * 0.5 * (v0 == v1) - bar * 0.6 * (v0 != v1),
                )
            )
    for v in (0.3, 0.7):
        y = -2.19 * cell + cell * 2.23
        low.append((half_d - 0.003, y - 0.6 * bar, z0 + tall * v - 0.6 * bar))
        high.append((half_d, y + 0.6 * bar, z0 + tall * v + 0.6 * bar))
    return {"body": body, "face": face, "hands": blocks(low, high, 0.0004)}


def _disc(radius: float, x0: float, x1: float, z: float, segments: int = 32) -> Mesh:
    """Return a flat round body with its axis along x."""
    return moved(rotated(lathe([(0.0, x0), (radius, x0), (radius, x1), (0.0, x1)], segments), "y", math.pi / 2), z=z)


def _bells(rng: np.random.Generator, size_m: Size) -> Parts:
    depth, width, height = size_m
    radius = min(0.46 * width, 0.37 * height)
    z = radius + 0.07 * height
    half_d = 0.5 * depth
    ring = rotated(
        lathe(
            [
                (0.0, -half_d),
                (0.9 * radius, -half_d),
                (radius, -half_d + 0.008),
                (radius, half_d - 0.004),
                (0.97 * radius, half_d),
                (0.9 * radius, half_d),
                (0.89 * radius, half_d - 0.006),
                (0.0, half_d - 0.006),
            ],
            36,
        ),
        "y",
        math.pi / 2,
    )
    face = _disc(0.9 * radius, half_d - 0.008, half_d - 0.005, z)
    hands = [
        _hand(half_d, z, angle, length * radius, 0.03 * radius)
        for angle, length in ((rng.uniform(0, 6.28), 0.5), (rng.uniform(0, 6.28), 0.75))
    ]
    marks = [_hand(half_d, z, math.pi * k / 6, 0.86 * radius, 0.022 * radius, 0.74 * radius) for k in range(12)]
    bells, feet = [], []
    for s in (-1.0, 1.0):
        bell = lathe(
            [(0.0, 0.0), (0.36 * radius, 0.0), (0.34 * radius, 0.12 * radius), (0.22 * radius, 0.25 * radius), (0.0, 0.3 * radius)], 20
        )
        tilt = rotated(bell, "x", -s * 0.5)
        bells.append(moved(tilt, y=s * 0.55 * radius, z=z + 0.92 * radius))
        bells.append(
            rod((0.0, s * 0.45 * radius, z + 0.8 * radius), (0.0, s * 0.56 * radius, z + 0.95 * radius), 0.05 * radius, segments=8)
        )
        feet.append(rod((0.0, s * 0.72 * radius, 0.0), (0.0, s * 0.45 * radius, z - 0.8 * radius), 0.05 * radius, 0.07 * radius, 8))
    arch = sweep(
        [
            (0.0, -0.25 * radius, z + radius),
            (0.0, -0.12 * radius, z + 1.42 * radius),
            (0.0, 0.12 * radius, z + 1.42 * radius),
            (0.0, 0.25 * radius, z + radius),
        ],
        0.035 * radius,
        8,
    )
    return {"body": moved(ring, z=z), "face": face, "hands": merged(*hands, *marks), "bells": merged(*bells, arch), "feet": merged(*feet)}


def _hand(x: float, z: float, angle: float, reach: float, half_width: float, start: float = 0.0) -> Mesh:
    bar = block((x - 0.006, -half_width, start), (x - 0.003, half_width, reach), 0.0004)
    return moved(rotated(bar, "x", angle), z=z)


def build_mug(rng: np.random.Generator, size_m: Size, style: str) -> Parts:
    """Return a mug with a drink in it, its handle along the longer side of its box; straight or rounded."""
    along_x = size_m[0] > size_m[1]
    depth, width, height = (size_m[1], size_m[0], size_m[2]) if along_x else size_m
    grip = 0.24 * width
    radius = 0.5 * (width - grip)
    r = min(radius, 0.5 * depth)
    wall = min(0.004, 0.1 * r)
    if style == "straight":
        outer = [(0.0, 0.0), (0.9 * r, 0.0), (r, 0.05 * height), (r, height - 0.002)]
    else:
        outer = [
            (0.0, 0.0),
            (0.6 * r, 0.0),
            (0.8 * r, 0.08 * height),
            (0.97 * r, 0.3 * height),
            (r, 0.5 * height),
            (0.97 * r, 0.8 * height),
            (r, height - 0.002),
        ]
    inner = [
        (r - 0.4 * wall, height),
        (r - wall, height - 0.002),
        (r - wall, 0.3 * height),
        (0.8 * r - wall, 0.1 * height),
        (0.0, 0.08 * height),
    ]
    angle = np.linspace(-0.55 * math.pi, 0.55 * math.pi, 11)
    y0 = r - 0.5 * wall
    path = np.column_stack(
        [np.zeros(11), y0 - 0.16 * grip + (grip + 0.1 * grip) * np.cos(angle), 0.52 * height + 0.31 * height * np.sin(angle)]
    )
    handle = sweep(path, 0.09 * grip + 0.0028, 8, 1.3)
    drink_level = height * rng.uniform(0.72, 0.85)
    drink = lathe(
        [(0.0, drink_level - 0.004), (r - 1.05 * wall, drink_level - 0.004), (r - 1.05 * wall, drink_level), (0.0, drink_level)], 24
    )
    turn = -0.5 * math.pi if along_x else 0.0
    parts = {"body": merged(lathe(outer + inner, 28), handle), "drink": drink}
    return fitted({name: rotated(moved(mesh, y=-0.5 * grip), "z", turn) for name, mesh in parts.items()}, size_m)


def build_waste_bin(rng: np.random.Generator, size_m: Size, style: str) -> Parts:
    """Return an open tapered bin, a basket of hoops and rods, or a pedal bin with lid."""
    depth, width, height = size_m
    r = 0.5 * min(depth, width)
    if style == "open":
        base = rng.uniform(0.7, 0.88)
        profile = [
            (0.0, 0.0),
            (base * r, 0.0),
            ((base + 0.02) * r, 0.01),
            (0.98 * r, height - 0.012),
            (r, height - 0.006),
            (0.995 * r, height),
            (0.965 * r, height),
            (0.95 * r, height - 0.012),
            (base * r - 0.004, 0.012),
            (0.0, 0.012),
        ]
        liner = [
            ((0.97 * r), height - 0.035),
            (1.002 * r, height - 0.035),
            (1.006 * r, height + 0.002),
            (0.95 * r, height + 0.002),
            (0.9 * r, height - 0.3 * height),
            (0.6 * r, 0.25 * height),
            (0.0, 0.2 * height),
            (0.0, 0.195 * height),
            (0.61 * r, 0.244 * height),
            (0.91 * r, height - 0.302 * height),
            (0.96 * r, height - 0.002),
        ]
        return fitted({"body": lathe(profile, 32), "liner": lathe(liner, 32, closed=True)}, size_m)
    if style == "basket":
        bars: list[Mesh] = []
        for k in range(26):
            a = 2.0 * math.pi * k / 26
            bars.append(
                rod(
                    (0.74 * r * math.cos(a), 0.74 * r * math.sin(a), 0.004),
                    (0.97 * r * math.cos(a), 0.97 * r * math.sin(a), height - 0.004),
                    0.0022,
                    segments=5,
                )
            )
        for share in (0.02, 0.25, 0.5, 0.75, 0.975):
            ring_r, z = (0.745 + 0.235 * share) * r, share * height
            bars.append(
                lathe(
                    [(ring_r - 0.003, z - 0.004), (ring_r + 0.004, z - 0.004), (ring_r + 0.004, z + 0.004), (ring_r - 0.003, z + 0.004)],
                    28,
                    closed=True,
                )
            )
        foot = lathe([(0.0, 0.0), (0.75 * r, 0.0), (0.75 * r, 0.006), (0.0, 0.006)], 26)
        return fitted({"body": merged(*bars, foot)}, size_m)
    body = lathe([(0.0, 0.012), (0.93 * r, 0.012), (0.95 * r, 0.02), (0.95 * r, 0.86 * height), (0.0, 0.86 * height)], 32)
    rings = lathe([(0.0, 0.0), (0.965 * r, 0.0), (0.98 * r, 0.006), (0.98 * r, 0.03), (0.95 * r, 0.034), (0.0, 0.034)], 32)
    lid = lathe(
        [
            (0.0, 0.865 * height),
            (0.97 * r, 0.865 * height),
            (0.98 * r, 0.88 * height),
            (0.96 * r, 0.91 * height),
            (0.75 * r, 0.965 * height),
            (0.4 * r, 0.992 * height),
            (0.0, height),
        ],
        32,
    )
    pedal = block((0.85 * r, -0.03, 0.006), (0.5 * depth + 0.01, 0.03, 0.016), 0.003)
    return fitted({"body": body, "lid": lid, "pedal": merged(rings, pedal)}, size_m)


MODELS = {
    "alarm_clock": Model(build_alarm_clock, ("digital", "bells")),
    "mug": Model(build_mug, ("straight", "rounded")),
    "waste_bin": Model(build_waste_bin, ("open", "basket", "pedal")),
}
