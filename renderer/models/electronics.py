"""Screens and what belongs to them; their fronts look along +x."""

from __future__ import annotations

import itertools
import math

import numpy as np
from numpy.typing import NDArray

from renderer.geometry.mesh import Mesh
from renderer.geometry.shapes import block, flat_quads, merged, moved, rod, rotated, rounded_box
from renderer.models.model import Model, Parts, Size, fitted


def build_laptop(rng: np.random.Generator, size_m: Size, style: str) -> Parts:
    """Return an open laptop; its keyboard lies on the +x side of the hinge."""
    depth, width, height = size_m
    half_d, half_w = 0.5 * depth, 0.5 * width
    thick = 0.016 if style == "slim" else 0.024
    hinge = -half_d + 0.28 * min(depth, height)
    angle = math.radians(90.0) + math.atan2(hinge + half_d, height)
    base = rounded_box((hinge, -half_w, 0.0), (half_d, half_w, thick), 0.35 * thick, 2)
    reach = math.hypot(height - 0.7 * thick, hinge + half_d)
    lid = rounded_box((0.0, -half_w, 0.0), (reach, half_w, 0.4 * thick), 0.18 * thick, 2)
    rim = 0.012 if style == "slim" else 0.02
    screen = block((rim * 1.6, -half_w + rim, -0.0005), (reach - rim, half_w - rim, 0.001), 0.0003)
    hinge_z = 0.7 * thick
    lid, screen = (moved(rotated(mesh, "y", -angle), x=hinge + 0.004, z=hinge_z) for mesh in (lid, screen))
    deep = half_d - hinge
    keys = _key_grid((hinge + 0.12 * deep, hinge + 0.58 * deep), 0.9 * half_w, thick - 0.001, 0.0018, 14, 5)
    pad = block((hinge + 0.63 * deep, -0.28 * half_w, thick - 0.001), (hinge + 0.94 * deep, 0.28 * half_w, thick + 0.0006), 0.0003)
    return fitted({"base": merged(base, pad), "keyboard": keys, "lid": lid, "screen": screen}, size_m)


def _key_grid(x: tuple[float, float], half_w: float, z: float, travel: float, columns: int, rows: int) -> Mesh:
    """Return rows of keys between two x, the front row with a space bar; ``columns`` keys to a row."""
    low, high = [], []
    xs = np.linspace(x[0], x[1], rows + 1)
    for r in range(rows):
        edges = np.linspace(-half_w, half_w, columns + 1)
        if r == rows - 1:
            edges = np.concatenate([edges[:4], edges[columns - 4 + 1 :]])
        for a, b in itertools.pairwise(edges):
            gap = min(0.0016, 0.12 * (xs[1] - xs[0]))
            low.append((xs[r] + gap, a + gap, z))
            high.append((xs[r + 1] - gap, b - gap, z + travel))
    return keycaps(np.asarray(low), np.asarray(high))


def keycaps(low: NDArray[np.float64], high: NDArray[np.float64], taper_m: float = 0.0012) -> Mesh:
    """Return boxes (n, 3) whose tops are ``taper_m`` smaller on each side than their feet, 12 triangles each."""
    taper = np.minimum(taper_m, 0.12 * (high - low)[:, :2].min(axis=1))[:, None]
    rings = []
    for z, inset in ((low[:, 2:], 0.0 * taper), (high[:, 2:], taper)):
        x0, y0, x1, y1 = low[:, :1] + inset, low[:, 1:2] + inset, high[:, :1] - inset, high[:, 1:2] - inset
        rings.append([np.hstack([x, y, z]) for x, y in ((x0, y0), (x1, y0), (x1, y1), (x0, y1))])
    foot, top = rings
    sides = [[foot[k], foot[(k + 1) % 4], top[(k + 1) % 4], top[k]] for k in range(4)]
    quads = np.asarray([*sides, top, foot[::-1]])
    return flat_quads(quads.transpose(0, 2, 1, 3).reshape(-1, 4, 3))


def build_keyboard(rng: np.random.Generator, size_m: Size, style: str) -> Parts:
    """Return a keyboard whose space bar lies on the +x side; ``full`` has a number pad."""
    depth, width, height = size_m
    half_d, half_w = 0.5 * depth, 0.5 * width
    case_top = 0.62 * height
    case = rounded_box((-half_d, -half_w, 0.0), (half_d, half_w, case_top), 0.35 * case_top, 2)
    x = (-half_d + 0.07 * depth, half_d - 0.07 * depth)
    rim = 0.02 * width
    if style == "full":
        split = half_w - rim - 0.2 * width
        left = _key_grid(x, 0.5 * (split + half_w - rim) - 0.004, case_top - 0.001, height - case_top + 0.001, 15, 5)
        left = moved(left, y=0.5 * (split - half_w + rim) - 0.004)
        pad = moved(_key_grid(x, 0.095 * width, case_top - 0.001, height - case_top + 0.001, 4, 4), y=half_w - rim - 0.097 * width)
        keys = merged(left, pad)
    else:
        keys = _key_grid(x, half_w - rim, case_top - 0.001, height - case_top + 0.001, 15, 5)
    return fitted({"case": case, "keys": keys}, size_m)


def build_monitor(rng: np.random.Generator, size_m: Size, style: str) -> Parts:
    """Return a computer screen on a foot plate, or on a V-shaped foot."""
    depth, width, height = size_m
    half_d, half_w = 0.5 * depth, 0.5 * width
    low = height * rng.uniform(0.2, 0.27)
    x = 0.02
    frame = merged(
        rounded_box((x - 0.025, -half_w, low), (x, half_w, height), 0.006),
        rounded_box((x - 0.05, -0.45 * half_w, low + 0.2 * (height - low)), (x - 0.02, 0.45 * half_w, low + 0.75 * (height - low)), 0.015),
    )
    rim = 0.009
    screen = block((x - 0.004, -half_w + rim, low + 1.8 * rim), (x + 0.0006, half_w - rim, height - rim), 0.0004)
    neck = block((x - 0.075, -0.03, 0.01), (x - 0.045, 0.03, low + 0.45 * (height - low)), 0.006)
    if style == "plate":
        foot = rounded_box((-half_d, -0.24 * width, 0.0), (half_d, 0.24 * width, 0.012), 0.005)
    else:
        feet = [rod((x - 0.06, 0.0, 0.014), (half_d - 0.012, s * 0.27 * width, 0.009), 0.014, 0.009) for s in (-1.0, 1.0)]
        foot = merged(*feet, block((-half_d, -0.035, 0.0), (x - 0.04, 0.035, 0.014), 0.004))
    return fitted({"stand": merged(neck, foot), "frame": frame, "screen": screen}, size_m)


def build_television(rng: np.random.Generator, size_m: Size, style: str) -> Parts:
    """Return a television on two feet or on a central plate."""
    depth, width, height = size_m
    half_d, half_w = 0.5 * depth, 0.5 * width
    low = 0.09 * height
    thin = min(0.035, 0.4 * depth)
    frame = merged(
        rounded_box((-0.5 * thin, -half_w, low), (0.5 * thin, half_w, height), 0.006),
        rounded_box((-0.5 * thin - 0.03, -0.7 * half_w, low + 0.01), (-0.4 * thin, 0.7 * half_w, low + 0.55 * (height - low)), 0.015),
    )
    rim = 0.011
    screen = block((0.5 * thin - 0.004, -half_w + rim, low + 1.8 * rim), (0.5 * thin + 0.0008, half_w - rim, height - rim), 0.0005)
    if style == "feet":
        stand = []
        for s in (-1.0, 1.0):
            y = s * 0.72 * half_w
            stand += [rod((0.0, y, low + 0.02), (sx * (half_d - 0.008), y + s * 0.02, 0.008), 0.009, 0.008) for sx in (-1.0, 1.0)]
        foot = merged(*stand)
    else:
        wide = rng.uniform(0.2, 0.3) * width
        foot = merged(
            rounded_box((-half_d, -wide, 0.0), (half_d, wide, 0.014), 0.006), block((-0.02, -0.07, 0.01), (0.01, 0.07, low + 0.03), 0.005)
        )
    return fitted({"stand": foot, "frame": frame, "screen": screen}, size_m)


MODELS = {
    "laptop": Model(build_laptop, ("slim", "classic")),
    "keyboard": Model(build_keyboard, ("full", "compact")),
    "monitor": Model(build_monitor, ("plate", "vee")),
    "television": Model(build_television, ("feet", "plate")),
}
