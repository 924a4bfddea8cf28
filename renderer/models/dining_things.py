"""Things on dining tables: plates, glasses, fruit bowls, wine bottles."""

from __future__ import annotations

import math

import numpy as np

from renderer.geometry.mesh import Mesh
from renderer.geometry.shapes import lathe, merged, moved, rotated, sweep
from renderer.models.living_things import bowl_body
from renderer.models.model import Model, Parts, Size, fitted


def build_plate(rng: np.random.Generator, size_m: Size, style: str) -> Parts:
    """Return a plate: a rim round a flat middle, or one even curve; the part ``band`` is a line of colour on it."""
    depth, width, height = size_m
    r = 0.5 * min(depth, width)
    wall = min(0.004, 0.25 * height)
    if style == "rimmed":
        lower = [(0.0, 0.0), (0.55 * r, 0.0), (0.66 * r, 0.35 * height), (r, height - 0.5 * wall)]
        upper = [(0.995 * r, height), (0.66 * r, 0.35 * height + wall), (0.56 * r, wall), (0.0, wall)]
        band_at = [(0.93 * r, 0.87 * height), (0.97 * r, 0.93 * height)]
    else:
        lower = [(0.0, 0.0), (0.5 * r, 0.0), (0.75 * r, 0.12 * height), (0.92 * r, 0.5 * height), (r, height - 0.3 * wall)]
        upper = [(0.985 * r, height), (0.9 * r, 0.5 * height + wall), (0.73 * r, 0.12 * height + wall), (0.5 * r, wall), (0.0, wall)]
        band_at = [(0.955 * r, 0.8 * height), (0.975 * r, 0.9 * height)]
    (r0, z0), (r1, z1) = band_at
    lift = 0.8 * wall
    band = lathe([(r0, z0), (r1, z1), (r1, z1 + lift), (r0, z0 + lift)], 40, closed=True)
    return fitted({"body": lathe(lower + upper, 40), "band": band}, size_m)


def build_drinking_glass(rng: np.random.Generator, size_m: Size, style: str) -> Parts:
    """Return an empty glass: a tumbler with a thick bottom, or a wine glass on a stem."""
    depth, width, height = size_m
    r = 0.5 * min(depth, width)
    wall = min(0.0025, 0.08 * r)
    if style == "tumbler":
        base = rng.uniform(0.78, 0.9)
        profile = [(0.0, 0.0), (base * r, 0.0), (r, height - 0.001), (r - 0.5 * wall, height), (r - wall, height - 0.001)]
        return fitted({"body": lathe([*profile, (base * r - wall, 0.09 * height), (0.0, 0.08 * height)], 32)}, size_m)
    stem, foot = rng.uniform(0.42, 0.5) * height, 0.88 * r
    lower = [(0.0, 0.0), (foot, 0.0), (foot, 0.0015), (0.3 * foot, 0.02 * height), (0.003, 0.07 * height), (0.003, 0.93 * stem)]
    angle = np.linspace(0.2, 0.5 * math.pi, 6)
    swell = stem + 0.42 * (height - stem)
    cup = [(r * math.sin(a), stem + (swell - stem) * (1.0 - math.cos(a))) for a in angle]
    rim = [
        (0.9 * r, stem + 0.75 * (height - stem)),
        (0.74 * r, height - 0.001),
        (0.74 * r - 0.5 * wall, height),
        (0.74 * r - wall, height - 0.001),
    ]
    inner = [(0.9 * r - wall, stem + 0.75 * (height - stem))]
    inner += [((r - wall) * math.sin(a), stem + wall + (swell - stem - wall) * (1.0 - math.cos(a))) for a in angle[::-1]]
    return fitted({"body": lathe([*lower, *cup, *rim, *inner, (0.0, stem + wall)], 28)}, size_m)


def _apple(r: float) -> Mesh:
    """Return a round fruit, dented at both ends."""
    angle = np.linspace(-0.5 * math.pi, 0.5 * math.pi, 8)[1:-1]
    side = [(r * math.cos(a) ** 0.8, r * (0.92 * math.sin(a) + 0.05)) for a in angle]
    return lathe([(0.0, -0.8 * r), *side, (0.0, 0.72 * r)], 11)


def _orange(r: float) -> Mesh:
    angle = np.linspace(-0.5 * math.pi, 0.5 * math.pi, 8)
    return lathe([(max(r * math.cos(a), 0.0) if abs(a) < 1.57 else 0.0, 0.96 * r * math.sin(a)) for a in angle], 11)


def _banana(length: float) -> Mesh:
    t = np.linspace(-1.0, 1.0, 9)
    path = np.column_stack([0.5 * length * t, np.zeros(9), 0.24 * length * t**2])
    radius = 0.095 * length * np.array([0.3, 0.75, 0.95, 1.0, 1.0, 1.0, 0.95, 0.7, 0.25])
    return sweep(path, radius, 6)


def build_fruit_bowl(rng: np.random.Generator, size_m: Size, style: str) -> Parts:
    """Return a bowl of apples and oranges with bananas on top."""
    depth, width, height = size_m
    r = 0.5 * min(depth, width)
    rim = 0.62 * height
    fruit_r = min(0.28 * r, 0.3 * height)
    bowl = bowl_body(r, rim, style == "footed", 22)
    apples, oranges = [], []
    turn = rng.uniform(0.0, 2.0 * math.pi)
    for k in range(5):
        a = turn + 2.0 * math.pi * k / 5
        at = (0.55 * r * math.cos(a), 0.55 * r * math.sin(a), rim + 0.05 * height)
        if k % 2:
            oranges.append(moved(_orange(0.95 * fruit_r), *at))
        else:
            tipped = rotated(rotated(_apple(fruit_r), "x", rng.uniform(-0.7, 0.7)), "y", rng.uniform(-0.7, 0.7))
            apples.append(moved(tipped, *at))
    oranges.append(moved(_orange(fruit_r), 0.0, 0.0, rim + 0.02 * height))
    bunch = []
    for k in range(3):
        one = rotated(_banana(1.15 * r), "x", 0.35 * (k - 1))
        bunch.append(moved(rotated(one, "z", turn + 0.25 * (k - 1)), 0.03 * r * k, 0.1 * r * (k - 1), rim + 0.15 * height))
    return fitted({"bowl": bowl, "apples": merged(*apples), "oranges": merged(*oranges), "bananas": merged(*bunch)}, size_m)


def build_wine_bottle(rng: np.random.Generator, size_m: Size, style: str) -> Parts:
    """Return a wine bottle with label and capsule: straight with high shoulders, or with sloping shoulders."""
    depth, width, height = size_m
    r = 0.5 * min(depth, width)
    neck = 0.36 * r
    body = [(0.0, 0.02 * height), (0.6 * r, 0.0), (0.94 * r, 0.0), (r, 0.015 * height)]
    if style == "straight":
        shoulder = [
            (r, 0.6 * height),
            (0.94 * r, 0.65 * height),
            (0.7 * r, 0.695 * height),
            (0.46 * r, 0.73 * height),
            (neck, 0.78 * height),
        ]
    else:
        shoulder = [(r, 0.42 * height), (0.96 * r, 0.5 * height), (0.76 * r, 0.6 * height), (0.52 * r, 0.69 * height), (neck, 0.8 * height)]
    glass = lathe([*body, *shoulder, (0.95 * neck, 0.97 * height), (0.0, 0.97 * height)], 28)
    low, high = (0.14, 0.46) if style == "straight" else (0.1, 0.36)
    top = high * height - rng.uniform(0.0, 0.05) * height
    label = lathe([(0.95 * r, low * height), (1.006 * r, low * height), (1.006 * r, top), (0.95 * r, top)], 28, closed=True)
    start = 0.8 * height
    capsule = [
        (0.0, start),
        (1.04 * neck, start),
        (1.04 * neck, 0.95 * height),
        (1.14 * neck, 0.955 * height),
        (1.14 * neck, 0.985 * height),
    ]
    return fitted({"glass": glass, "label": label, "capsule": lathe([*capsule, (1.0 * neck, height), (0.0, height)], 24)}, size_m)


MODELS = {
    "plate": Model(build_plate, ("rimmed", "coupe")),
    "drinking_glass": Model(build_drinking_glass, ("tumbler", "wine")),
    "fruit_bowl": Model(build_fruit_bowl, ("round", "footed")),
    "wine_bottle": Model(build_wine_bottle, ("straight", "sloping")),
}
