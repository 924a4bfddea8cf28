"""Dining chairs and bar stools; the sitter looks along +x."""

from __future__ import annotations

import math

import numpy as np

from renderer.geometry.mesh import Mesh
from renderer.geometry.shapes import block, lathe, merged, rod, rounded_box, sheet, sweep
from renderer.models.model import Model, Parts, Size, fitted
from renderer.models.soft import cushion


def build_dining_chair(rng: np.random.Generator, size_m: Size, style: str) -> Parts:
    """Return a dining chair: upright slats, a cross between the back posts, or a padded back and seat on tapered legs."""
    return fitted({"slats": _slats, "cross": _cross, "padded": _padded}[style](rng, size_m), size_m)


def _post_x(z: float, half_d: float, seat_z: float, height: float) -> float:
    """Return where along x the middle of a back post lies at height z; it leans backward above the seat and below it."""
    return float(np.interp(z, [0.0, seat_z, height], [-half_d + 0.03, -half_d + 0.075, -half_d + 0.018]))


def _wooden_frame(size_m: Size, seat_z: float) -> list[Mesh]:
    """Return legs, back posts, stretchers and the seat's frame."""
    depth, width, height = size_m
    half_d, half_w = 0.5 * depth, 0.5 * width
    frame: list[Mesh] = []
    for s in (-1.0, 1.0):
        y = s * (half_w - 0.025)
        zs = [0.0, 0.5 * seat_z, seat_z, seat_z + 0.5 * (height - seat_z), height - 0.002]
        path = [(_post_x(z, half_d, seat_z, height), y, z) for z in zs]
        frame.append(sweep(path, [0.015, 0.018, 0.02, 0.018, 0.014], 12))
        frame.append(rod((half_d - 0.025, s * (half_w - 0.022), 0.0), (half_d - 0.04, s * (half_w - 0.03), seat_z - 0.01), 0.014, 0.02))
        frame.append(rod((half_d - 0.04, s * (half_w - 0.03), 0.4 * seat_z), (-half_d + 0.06, y, 0.4 * seat_z), 0.009))
        low, high = sorted((s * (half_w - 0.02), s * (half_w - 0.042)))
        frame.append(block((-half_d + 0.06, low, seat_z - 0.07), (half_d - 0.03, high, seat_z - 0.012)))
    for x in (-half_d + 0.065, half_d - 0.05):
        frame.append(block((x, -half_w + 0.035, seat_z - 0.07), (x + 0.02, half_w - 0.035, seat_z - 0.012)))
    frame.append(rod((0.0, -half_w + 0.03, 0.4 * seat_z), (0.0, half_w - 0.03, 0.4 * seat_z), 0.009))
    return frame


def _rail(x: float, half_w: float, low: float, high: float, lean: float, bow: float = 0.022) -> Mesh:
    """Return a board between the back posts, bent backward in the middle; its upper edge lies ``lean`` behind its lower one."""
    y = np.linspace(-half_w, half_w, 15)
    back = x - bow * (1.0 - (y / half_w) ** 2)
    thick = 0.018
    front = np.stack(
        [np.column_stack([back + 0.5 * thick, y, np.full(15, low)]), np.column_stack([back + 0.5 * thick - lean, y, np.full(15, high)])],
        axis=1,
    )
    return sheet(front, front - np.array([thick, 0.0, 0.0]))


def _seat_board(rng: np.random.Generator, size_m: Size, seat_z: float) -> Mesh:
    half_d, half_w = 0.5 * size_m[0], 0.5 * size_m[1]
    return cushion(rng, (-half_d + 0.085, -half_w + 0.004, seat_z - 0.014), (half_d, half_w - 0.004, seat_z + 0.03), 0.018, 0.012)


def _slats(rng: np.random.Generator, size_m: Size) -> Parts:
    depth, width, height = size_m
    half_d, half_w = 0.5 * depth, 0.5 * width
    seat_z = min(0.46, 0.505 * height)
    span = half_w - 0.03
    top = height - 0.01
    bottom = seat_z + 0.14 * (height - seat_z)
    x_top, x_low = (_post_x(z, half_d, seat_z, height) for z in (top - 0.07, bottom))
    rails = [_rail(x_top, span, top - 0.08, top, 0.006), _rail(x_low, span, bottom - 0.02, bottom + 0.02, 0.002, 0.012)]
    count = int(rng.integers(5, 9))
    for y in np.linspace(-0.78 * span, 0.78 * span, count):
        share = 1.0 - (y / span) ** 2
        start, end = (x_low - 0.012 * share, y, bottom + 0.01), (x_top - 0.022 * share, y, top - 0.07)
        rails.append(sweep(np.linspace(start, end, 4), 0.0085, 8))
    return {"frame": merged(*_wooden_frame(size_m, seat_z)), "seat": _seat_board(rng, size_m, seat_z), "backrest": merged(*rails)}


def _cross(rng: np.random.Generator, size_m: Size) -> Parts:
    depth, width, height = size_m
    half_d, half_w = 0.5 * depth, 0.5 * width
    seat_z = min(0.46, 0.505 * height)
    span = half_w - 0.028
    top = height - 0.006
    x_top, x_low = (_post_x(z, half_d, seat_z, height) for z in (top - 0.06, seat_z + 0.1))
    rails = [_rail(x_top, span, top - 0.065, top, 0.005)]
    t = np.linspace(-1.0, 1.0, 9)
    for s in (-1.0, 1.0):
        z = seat_z + 0.03 + (top - 0.07 - seat_z) * 0.5 * (t + 1.0)
        x = x_low + (x_top - x_low) * 0.5 * (t + 1.0) - 0.02 * (1.0 - t**2) - 0.008 * s
        rails.append(sweep(np.column_stack([x, s * 0.94 * span * t, z]), 0.011, 8))
    return {"frame": merged(*_wooden_frame(size_m, seat_z)), "seat": _seat_board(rng, size_m, seat_z), "backrest": merged(*rails)}


def _padded(rng: np.random.Generator, size_m: Size) -> Parts:
    depth, width, height = size_m
    half_d, half_w = 0.5 * depth, 0.5 * width
    seat_z = min(0.48, 0.505 * height)
    legs = [
        rod((sx * (half_d - 0.025), sy * (half_w - 0.025), 0.0), (sx * (half_d - 0.06), sy * (half_w - 0.05), seat_z - 0.05), 0.011, 0.02)
        for sx in (-1.0, 1.0)
        for sy in (-1.0, 1.0)
    ]
    seat = cushion(rng, (-half_d + 0.06, -half_w, seat_z - 0.075), (half_d, half_w, seat_z + 0.025), 0.035, 0.022)
    rest = cushion(rng, (-half_d + 0.045, -half_w + 0.012, seat_z - 0.06), (-half_d + 0.095, half_w - 0.012, height), 0.02, 0.014, axis=0)
    points = rest.vertices.astype(np.float64)
    rise = np.clip((points[:, 2] - seat_z) / (height - seat_z), 0.0, 1.0)
    points[:, 0] += 0.018 * (points[:, 1] / half_w) ** 2 - 0.045 * rise**1.3
    points[:, 1] *= 1.0 - 0.1 * rise**2
    return {"frame": merged(*legs), "seat": seat, "back": rest._replace(vertices=points.astype(np.float32))}


def build_bar_stool(rng: np.random.Generator, size_m: Size, style: str) -> Parts:
    """Return a high stool with a ring for the feet: round on four legs, or a padded seat with a low back on a column and plate."""
    depth, width, height = size_m
    half_d, half_w = 0.5 * depth, 0.5 * width
    r = min(half_d, half_w)
    if style == "round":
        top = height - 0.035
        profile = [(0.0, top), (0.68 * r, top), (0.78 * r, top + 0.012), (0.78 * r, height - 0.008), (0.72 * r, height)]
        seat = lathe([*profile, (0.4 * r, height - 0.006), (0.0, height - 0.009)], 36)
        out = 0.94 * r / math.sqrt(2.0)
        legs, rails = [], []
        feet_z = 0.34 * height
        for sx, sy in ((-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)):
            legs.append(rod((sx * out, sy * out, 0.0), (sx * 0.6 * out, sy * 0.6 * out, top + 0.004), 0.014, 0.019))
        at = out * (1.0 - 0.4 * feet_z / top)
        corners = [(-at, -at), (at, -at), (at, at), (-at, at)]
        for k, ((ax, ay), (bx, by)) in enumerate(zip(corners, corners[1:] + corners[:1], strict=True)):
            z = feet_z + (0.05 if k % 2 else 0.0)
            rails.append(rod((ax, ay, z), (bx, by, z), 0.01))
        return fitted({"legs": merged(*legs), "footrest": merged(*rails), "seat": seat}, size_m)
    seat_z = min(0.68, 0.76 * height)
    plate = lathe([(0.0, 0.0), (r, 0.0), (r, 0.006), (0.95 * r, 0.012), (0.2 * r, 0.022), (0.03, 0.05), (0.0, 0.05)], 40)
    column = rod((0.0, 0.0, 0.02), (0.0, 0.0, seat_z - 0.06), 0.022, segments=20)
    ring = _ring(0.62 * r, 0.32 * seat_z, 0.01)
    arm = rod((0.0, 0.0, 0.32 * seat_z), (0.62 * r, 0.0, 0.32 * seat_z), 0.009)
    seat = cushion(rng, (-0.9 * r, -0.95 * r, seat_z - 0.06), (r, 0.95 * r, seat_z + 0.025), 0.045, 0.02)
    under = rounded_box((-0.5 * r, -0.5 * r, seat_z - 0.075), (0.5 * r, 0.5 * r, seat_z - 0.05), 0.01)
    return fitted(
        {
            "legs": merged(plate, column, under),
            "footrest": merged(ring, arm),
            "seat": merged(seat, _low_back(0.95 * r, seat_z - 0.03, height)),
        },
        size_m,
    )


def _ring(radius: float, z: float, bar: float) -> Mesh:
    """Return a lying torus."""
    angle = np.arange(10) * (2.0 * math.pi / 10)
    return lathe([(radius + bar * math.cos(a), z + bar * math.sin(a)) for a in angle], 32, closed=True)


def _low_back(r: float, low: float, high: float) -> Mesh:
    """Return a padded band round the back of a seat."""
    angle = np.linspace(math.radians(105.0), math.radians(255.0), 22)
    v = np.linspace(0.0, 1.0, 6)
    aa, vv = np.meshgrid(angle, v, indexing="ij")
    fade = np.sin((aa - angle[0]) / (angle[-1] - angle[0]) * math.pi) ** 0.5
    z = low + (high - low) * vv * (0.45 + 0.55 * fade)
    thick = 0.045 * np.sqrt(np.clip(1.0 - (2.0 * vv - 1.0) ** 4, 0.05, 1.0))
    outer = np.dstack([r * 1.02 * np.cos(aa), r * 1.0 * np.sin(aa), z])
    inner = np.dstack([(r - thick) * np.cos(aa), (r - thick) * np.sin(aa), z])
    return sheet(outer, inner)


MODELS = {
    "dining_chair": Model(build_dining_chair, ("slats", "cross", "padded")),
    "bar_stool": Model(build_bar_stool, ("round", "backed")),
}
