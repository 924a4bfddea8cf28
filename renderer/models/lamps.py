"""Lamps; the part ``shade`` is a closed hollow body that shines."""

import math

import numpy as np

import kernel_cache.elementary as el
from renderer.geometry.lofts import points
from renderer.geometry.mesh import Mesh
from renderer.geometry.shapes import lathe, merged, moved, rod, rotated, sweep
from renderer.models.model import Model, Parts, Pieces, Size

PLEATS = 30


def hollow_shade(low_radius: float, high_radius: float, low: float, high: float, pleated: bool = False, thickness: float = 0.004) -> Mesh:
    """Return a drum or cone shade, open above and below, with an outer and an inner surface."""
    t = thickness
    profile = [(low_radius - t, low), (low_radius, low), (high_radius, high), (high_radius - t, high)]
    wave = (lambda angle: np.asarray(1.0 + 0.022 * el.cos(PLEATS * angle))) if pleated else None
    return lathe(profile, 4 * PLEATS if pleated else 40, closed=True, wave=wave)


def globe(radius: float, center_z: float, squash: float = 1.0, steps: int = 14) -> Mesh:
    """Return a closed sphere, flattened by ``squash``."""
    angle = np.linspace(-0.5 * math.pi, 0.5 * math.pi, steps + 1)
    profile = [
        (radius * max(math.cos(a), 0.0) if 0 < i < steps else 0.0, center_z + squash * radius * math.sin(a)) for i, a in enumerate(angle)
    ]
    return lathe(profile, 28)


def bulb(center_z: float, radius: float = 0.03) -> Mesh:
    """Return a lamp bulb with its cap below."""
    r = radius
    profile = points(
        [0.0, 0.42 * r, 0.42 * r, 0.7 * r, 0.95 * r, r, 0.85 * r, 0.5 * r, 0.0],
        [-2.2 * r, -2.2 * r, -1.2 * r, -0.75 * r, -0.25 * r, 0.1 * r, 0.55 * r, 0.88 * r, r],
    )
    return moved(lathe(profile, 16), z=center_z)


def build_table_lamp(rng: np.random.Generator, size_m: Size, style: str) -> Pieces:
    """Return a lamp with a turned ceramic foot and pleated shade, a slim metal one with a drum shade, or a glowing globe."""
    depth, width, height = size_m
    r = 0.5 * min(depth, width)
    if style == "globe":
        ball = min(r, 0.36 * height)
        foot = [(0.0, 0.0), (0.62 * ball, 0.0), (0.62 * ball, 0.012), (0.55 * ball, 0.02), (0.0, 0.02)]
        stem = rod((0, 0, 0.018), (0, 0, height - 1.9 * ball), 0.05 * ball + 0.006)
        cup = lathe(
            points(
                [0.0, 0.3 * ball, 0.42 * ball, 0.0],
                [height - 2.0 * ball - 0.012, height - 2.0 * ball - 0.01, height - 1.9 * ball, height - 1.86 * ball],
            ),
            20,
        )
        parts = {
            "base": lathe(foot, 32),
            "stem": merged(stem, cup),
            "shade": globe(r, height - ball, ball / r),
            "bulb": bulb(height - ball, 0.3 * ball),
        }
        return parts
    shade_low = height * rng.uniform(0.52, 0.6)
    top = r * (rng.uniform(0.55, 0.72) if style == "ceramic" else rng.uniform(0.85, 1.0))
    shade = hollow_shade(r, top, shade_low, height, pleated=style == "ceramic")
    neck = shade_low + 0.15 * (height - shade_low)
    if style == "ceramic":
        b = r * rng.uniform(0.5, 0.62)
        z = shade_low * 0.9
        belly = rng.uniform(0.3, 0.5)
        base = lathe(
            points(
                [0.0, 0.62 * b, 0.64 * b, 0.55 * b, 0.9 * b, b, 0.86 * b, 0.45 * b, 0.24 * b, 0.26 * b, 0.0],
                [0.0, 0.0, 0.015, 0.03, belly * z * 0.6, belly * z, (belly + 0.2) * z, (belly + 0.4) * z, 0.93 * z, z, z],
            ),
            32,
        )
    else:
        b = r * 0.66
        base = lathe([(0.0, 0.0), (b, 0.0), (b, 0.008), (0.92 * b, 0.016), (0.2 * b, 0.022), (0.0, 0.022)], 32)
    stem = merged(
        rod((0, 0, 0.01), (0, 0, neck), 0.008),
        lathe([(0.0, neck - 0.01), (0.014, neck - 0.01), (0.014, neck + 0.03), (0.0, neck + 0.03)], 14),
        *_spider(r, top, shade_low, height),
    )
    return {"base": base, "stem": stem, "shade": shade, "bulb": bulb(neck + 0.085, min(0.03, 0.3 * r))}


def _spider(low_radius: float, high_radius: float, low: float, high: float) -> list[Mesh]:
    """Return three wires that carry a shade on the stem."""
    z = low + 0.12 * (high - low)
    radius = low_radius + 0.12 * (high_radius - low_radius) - 0.003
    turn = [2.0 * math.pi * k / 3 for k in range(3)]
    return [rod((0.0, 0.0, z), (radius * math.cos(a), radius * math.sin(a), z), 0.002, segments=6) for a in turn]


def build_floor_lamp(rng: np.random.Generator, size_m: Size, style: str) -> Pieces:
    """Return a straight standing lamp, one on a wooden tripod, or an arc that hangs its shade forward."""
    depth, width, height = size_m
    r = 0.5 * min(depth, width)
    if style == "arc":
        return _arc(depth, r, height)
    shade_height = min(0.34, 0.22 * height)
    low = height - shade_height
    shade_radius = 0.5 * max(depth, width) if style == "straight" else 0.9 * r
    shade = hollow_shade(shade_radius, shade_radius * rng.uniform(0.72, 0.95), low, height, pleated=bool(rng.random() < 0.3))
    neck = low + 0.05
    holder = lathe([(0.0, neck - 0.03), (0.017, neck - 0.03), (0.017, neck + 0.03), (0.0, neck + 0.03)], 14)
    wires = _spider(shade_radius, 0.85 * shade_radius, low, height)
    if style == "straight":
        base = lathe([(0.0, 0.0), (0.75 * r, 0.0), (0.75 * r, 0.012), (0.68 * r, 0.022), (0.12 * r, 0.032), (0.0, 0.032)], 36)
        pole = merged(rod((0, 0, 0.02), (0, 0, neck), 0.011), holder, *wires)
    else:
        top = low - 0.02
        feet = [2.0 * math.pi * k / 3 for k in range(3)]
        base = merged(
            *(
                rod((0.97 * r * math.cos(a), 0.97 * r * math.sin(a), 0.0), (0.03 * math.cos(a), 0.03 * math.sin(a), top), 0.013, 0.016)
                for a in feet
            )
        )
        hub = lathe([(0.0, top - 0.05), (0.05, top - 0.05), (0.05, top - 0.02), (0.03, top + 0.005), (0.0, top + 0.005)], 20)
        pole = merged(hub, rod((0, 0, top), (0, 0, neck), 0.01), holder, *wires)
    return {"base": base, "pole": pole, "shade": shade, "bulb": bulb(neck + 0.1, 0.032)}


def _arc(depth: float, r: float, height: float) -> Parts:
    back = -0.5 * depth + 0.7 * r
    shade_r = 0.62 * r
    end = 0.5 * depth - shade_r
    shade_low, shade_high = 0.70 * height, 0.82 * height
    angle = np.linspace(0.0, math.pi, 22)
    path = points(
        back + 0.5 * (end - back) * (1.0 - el.cos(angle)), 0.0, 0.55 * height + (0.445 * height - 0.012) * el.power(el.sin(angle), 0.8)
    )
    down = path[:, 0] > 0.55 * end + 0.45 * back
    path[down, 2] = np.maximum(path[down, 2], shade_high + 0.03)
    path = np.vstack([[back, 0.0, 0.02], [back, 0.0, 0.3 * height], path])
    dome = points(
        [shade_r - 0.004, shade_r, 0.93 * shade_r, 0.6 * shade_r, 0.05, 0.048, 0.57 * shade_r, 0.89 * shade_r],
        [
            shade_low,
            shade_low,
            0.4 * shade_low + 0.6 * shade_high,
            0.1 * shade_low + 0.9 * shade_high,
            shade_high,
            shade_high - 0.004,
            0.12 * shade_low + 0.88 * shade_high - 0.004,
            0.41 * shade_low + 0.59 * shade_high - 0.002,
        ],
    )
    base = moved(lathe([(0.0, 0.0), (0.7 * r, 0.0), (0.7 * r, 0.035), (0.66 * r, 0.042), (0.0, 0.042)], 36), x=back)
    wide = moved(lathe([(0.0, 0.0), (r, 0.0), (r, 0.004), (0.0, 0.004)], 36), x=back + 0.3 * r)
    cap = moved(rod((0, 0, shade_high - 0.03), (0, 0, path[-1, 2] + 0.004), 0.052, 0.02), x=path[-1, 0])
    return {
        "base": merged(base, wide),
        "pole": merged(sweep(path, 0.011, 10), cap),
        "shade": moved(lathe(dome, 36, closed=True), x=path[-1, 0]),
        "bulb": moved(rotated(bulb(0.0, 0.03), "x", math.pi), x=path[-1, 0], z=0.6 * shade_high + 0.4 * shade_low),
    }


def build_ceiling_lamp(rng: np.random.Generator, size_m: Size, style: str) -> Pieces:
    """Return a pendant on a cord, a flush opal dome, or a drum close below the ceiling."""
    depth, width, height = size_m
    r = 0.5 * min(depth, width)
    if style == "flush":
        stem = height - 0.03
        bowl_high = min(stem, 0.85 * r)
        neck = [rod((0.0, 0.0, bowl_high - 0.01), (0.0, 0.0, stem + 0.005), 0.012)] if stem - bowl_high > 0.01 else []
        ring = lathe([(0.0, height - 0.03), (0.55 * r, height - 0.03), (0.58 * r, height - 0.024), (0.58 * r, height), (0.0, height)], 36)
        bowl_top = bowl_high + 0.008
        angle = np.linspace(0.0, 0.5 * math.pi, 9)
        bowl = [(r * math.sin(a) if i else 0.0, bowl_top - bowl_top * math.cos(a)) for i, a in enumerate(angle)]
        dome = lathe([*bowl, (0.95 * r, bowl_top + 0.006), (0.0, bowl_top + 0.006)], 40)
        return {
            "mount": [ring, *neck],
            "shade": dome,
            "bulb": moved(rotated(bulb(0.0, min(0.03, 0.2 * height)), "x", math.pi), z=0.5 * bowl_top),
        }
    mount = lathe([(0.0, height - 0.028), (0.02, height - 0.028), (0.05, height - 0.008), (0.05, height), (0.0, height)], 24)
    if style == "drum":
        shade_high = min(max(height - 0.07, 0.6 * height), 1.1 * r)
        shade = hollow_shade(r, 0.98 * r, 0.0, shade_high)
        diffuser = lathe([(0.0, 0.012), (0.985 * r, 0.012), (0.985 * r, 0.017), (0.0, 0.017)], 36)
        arms = [
            rod((0, 0, 0.8 * shade_high), (0.97 * r * math.cos(a), 0.97 * r * math.sin(a), 0.8 * shade_high), 0.004, segments=6)
            for a in (0.0, 2.0944, 4.1888)
        ]
        post = rod((0, 0, 0.75 * shade_high), (0, 0, height - 0.02), 0.009)
        return {
            "mount": [mount, post, *arms],
            "shade": [shade, diffuser],
            "bulb": moved(rotated(bulb(0.0, min(0.03, 0.14 * shade_high)), "x", math.pi), z=0.55 * shade_high),
        }
    shade_high = min(0.62 * height, 1.5 * r)
    kind = rng.random()
    if kind < 0.5:
        shade = hollow_shade(r, 0.32 * r, 0.0, shade_high)
    else:
        shade = globe(r, 0.5 * shade_high, 0.5 * shade_high / r)
    cord = rod((0, 0, shade_high - 0.05), (0, 0, height - 0.02), 0.0035, segments=8)
    socket = lathe(
        [(0.0, shade_high - 0.06), (0.02, shade_high - 0.06), (0.024, shade_high), (0.008, shade_high + 0.035), (0.0, shade_high + 0.035)],
        16,
    )
    arms = [
        rod((0, 0, shade_high - 0.01), (0.32 * r * math.cos(a), 0.32 * r * math.sin(a), shade_high - 0.01), 0.002, segments=6)
        for a in (0.0, 2.0944, 4.1888)
    ]
    return {
        "mount": [mount, cord, socket, *arms],
        "shade": shade,
        "bulb": moved(rotated(bulb(0.0, min(0.032, 0.2 * shade_high)), "x", math.pi), z=0.55 * shade_high),
    }


MODELS = {
    "table_lamp": Model(build_table_lamp, ("ceramic", "slim", "globe")),
    "floor_lamp": Model(build_floor_lamp, ("straight", "tripod", "arc")),
    "ceiling_lamp": Model(build_ceiling_lamp, ("pendant", "flush", "drum")),
}
