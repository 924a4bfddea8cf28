"""Desk chairs; the sitter looks along +x."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from renderer.geometry.mesh import Mesh
from renderer.geometry.shapes import block, lathe, merged, moved, rod, rotated, rounded_box, sheet, sweep
from renderer.models.model import Model, Parts, Size, fitted
from renderer.models.soft import cushion


def build_desk_chair(rng: np.random.Generator, size_m: Size, style: str) -> Parts:
    """Return an office chair on a five-star base with castors, or a wooden chair on four legs."""
    return fitted({"office": _office_chair, "wooden": _wooden_chair, "shell": _shell_chair}[style](rng, size_m), size_m)


def _office_chair(rng: np.random.Generator, size_m: Size) -> Parts:
    depth, width, height = size_m
    base, castors = _star_base(0.5 * min(depth, width))
    seat_z = min(0.46, 0.47 * height)
    column = merged(
        rod((0, 0, 0.13), (0, 0, 0.27), 0.026),
        rod((0, 0, 0.26), (0, 0, seat_z - 0.055), 0.015),
        block((-0.13, -0.08, seat_z - 0.085), (0.11, 0.08, seat_z - 0.05), 0.01),
    )
    half_w = 0.40 * width
    front, back = 0.36 * depth, -0.34 * depth
    seat = cushion(rng, (back, -half_w, seat_z - 0.055), (front, half_w, seat_z + 0.045), 0.038, 0.03)
    back_low = seat_z + 0.10
    rest = cushion(rng, (back - 0.075, -0.92 * half_w, back_low), (back - 0.01, 0.92 * half_w, height - 0.002), 0.03, 0.018, axis=0)
    rest = _curved_back(rest, back_low, half_w)
    spine = sweep(
        [
            (-0.10, 0.0, seat_z - 0.066),
            (back - 0.05, 0.0, seat_z - 0.055),
            (back - 0.095, 0.0, seat_z + 0.03),
            (back - 0.09, 0.0, back_low + 0.18),
        ],
        0.02,
        10,
        1.6,
    )
    rests: list[Mesh] = []
    rest_z = 0.6 * height - 0.026
    for s in (-1.0, 1.0):
        y = s * (0.5 * width - 0.035)
        rests.append(
            sweep(
                [(-0.02, s * 0.1, seat_z - 0.065), (-0.02, y - s * 0.05, seat_z - 0.06), (-0.02, y, seat_z - 0.02), (-0.03, y, rest_z)],
                [0.014, 0.014, 0.015, 0.014],
                8,
            )
        )
        rests.append(rounded_box((-0.17, y - 0.035, rest_z - 0.008), (0.11, y + 0.035, rest_z + 0.022), 0.014))
    return {
        "base": base,
        "castors": castors,
        "column": merged(column, spine),
        "seat": seat,
        "backrest": rest,
        "armrests": merged(*rests),
    }


def _star_base(reach: float) -> tuple[Mesh, Mesh]:
    """Return five arms round a hub, and their castors with twin wheels; the wheels reach to ``reach`` from the middle."""
    arms: list[Mesh] = []
    castors: list[Mesh] = []
    wheel = 0.028
    tip = reach - wheel
    arm = sweep([(0.02, 0.0, 0.115), (0.55 * tip, 0.0, 0.095), (tip, 0.0, 0.07)], [0.026, 0.021, 0.015], 8, 0.7)
    half = [(0.6 * wheel, 0.004), (wheel, 0.005), (wheel, 0.016), (0.8 * wheel, 0.022), (0.0, 0.022)]
    roll = rotated(lathe([*((r, -z) for r, z in half[::-1]), *half], 12), "x", math.pi / 2)
    pin = rod((tip, 0.0, wheel), (tip, 0.0, 0.075), 0.007, segments=8)
    for k in range(5):
        angle = 2.0 * math.pi * k / 5 + math.pi
        arms.append(rotated(arm, "z", angle))
        castors += [
            moved(rotated(roll, "z", angle + 0.8 * k), tip * math.cos(angle), tip * math.sin(angle), wheel),
            rotated(pin, "z", angle),
        ]
    hub = lathe([(0.0, 0.085), (0.045, 0.085), (0.045, 0.12), (0.03, 0.135), (0.0, 0.135)], 16)
    return merged(hub, *arms), merged(*castors)


def _curved_back(mesh: Mesh, low_z: float, half_w: float) -> Mesh:
    """Bend a backrest round the sitter and lean its upper part backward."""
    points = mesh.vertices.astype(np.float64)
    rise = np.maximum(points[:, 2] - low_z, 0.0)
    points[:, 0] += 0.05 * (points[:, 1] / half_w) ** 2 - 0.16 * rise**1.5
    return mesh._replace(vertices=points.astype(np.float32))


def _wooden_chair(rng: np.random.Generator, size_m: Size) -> Parts:
    depth, width, height = size_m
    half_d, half_w = 0.5 * depth, 0.5 * width
    seat_z = min(0.46, 0.54 * height)
    lean = 0.13 * (height - seat_z)
    back_x = -half_d + lean + 0.02
    frame: list[Mesh] = []
    for s in (-1.0, 1.0):
        y = s * (half_w - 0.03)
        frame.append(rod((half_d - 0.025, y, 0.0), (half_d - 0.045, s * (half_w - 0.04), seat_z - 0.02), 0.013, 0.02))
        frame.append(
            sweep(
                [
                    (back_x - 0.05, y, 0.0),
                    (back_x, y, seat_z),
                    (back_x - 0.3 * lean, y, seat_z + 0.4 * (height - seat_z)),
                    (-half_d + 0.02, y, height),
                ],
                [0.014, 0.019, 0.018, 0.014],
                12,
            )
        )
        frame.append(rod((half_d - 0.04, s * (half_w - 0.04), 0.42 * seat_z), (back_x - 0.02, y, 0.42 * seat_z), 0.009))
    for z in (seat_z - 0.045,):
        frame.append(block((back_x, -half_w + 0.035, z - 0.025), (back_x + 0.018, half_w - 0.035, z + 0.025)))
        frame.append(block((half_d - 0.055, -half_w + 0.04, z - 0.025), (half_d - 0.035, half_w - 0.04, z + 0.025)))
        frame += [block((back_x, s * (half_w - 0.038), z - 0.025), (half_d - 0.045, s * (half_w - 0.055), z + 0.025)) for s in (-1.0, 1.0)]
    rails = [
        _back_rail(-half_d + 0.012 + 0.3 * t * lean, half_w - 0.035, height - 0.005 - 0.16 * t, 0.06 if t else 0.085)
        for t in range(int(rng.integers(2, 4)))
    ]
    seat = cushion(rng, (back_x - 0.01, -half_w + 0.012, seat_z - 0.02), (half_d, half_w - 0.012, seat_z + 0.032), 0.018, 0.014)
    return {"frame": merged(*frame), "seat": seat, "backrest": merged(*rails)}


def _back_rail(x: float, half_w: float, top: float, tall: float) -> Mesh:
    """Return a board between the back posts, bent backward in the middle."""
    y = np.linspace(-half_w, half_w, 15)
    bow = x + 0.02 * (y / half_w) ** 2
    front = np.stack(
        [np.column_stack([bow + 0.012, y, np.full(15, top - tall)]), np.column_stack([bow + 0.006, y, np.full(15, top)])], axis=1
    )
    return sheet(front, front - np.array([0.014, 0.0, 0.0]))


def _shell_chair(rng: np.random.Generator, size_m: Size) -> Parts:
    """A moulded shell, seat and back in one curve, on four splayed wooden legs with a seat pad."""
    depth, width, height = size_m
    half_d, half_w = 0.5 * depth, 0.5 * width
    seat_z = min(0.45, 0.55 * height)
    rise = height - seat_z
    profile = np.array(
        [
            (half_d, seat_z - 0.03),
            (half_d - 0.03, seat_z + 0.005),
            (0.4 * half_d, seat_z),
            (-0.25 * half_d, seat_z - 0.015),
            (-0.55 * half_d, seat_z + 0.02),
            (-0.75 * half_d, seat_z + 0.25 * rise),
            (-0.88 * half_d, seat_z + 0.6 * rise),
            (-half_d + 0.012, height),
        ]
    )
    t = np.linspace(0.0, 1.0, len(profile))
    fine = np.linspace(0.0, 1.0, 25)
    curve = np.column_stack([_smooth(t, profile[:, 0], fine), _smooth(t, profile[:, 1], fine)])
    v = np.linspace(-1.0, 1.0, 17)
    uu, vv = np.meshgrid(np.arange(25), v, indexing="ij")
    taper = 1.0 - 0.24 * np.clip((fine - 0.5) / 0.5, 0.0, 1.0) ** 1.5
    round_front = 1.0 - 0.30 * np.clip(1.0 - fine / 0.14, 0.0, 1.0) ** 2.2
    round_top = 1.0 - 0.34 * np.clip(1.0 - (1.0 - fine) / 0.14, 0.0, 1.0) ** 2.2
    y = half_w * vv * (taper * round_front * round_top)[uu]
    along = np.gradient(curve, axis=0)
    along /= np.linalg.norm(along, axis=1, keepdims=True)
    strength = 0.075 * np.interp(fine, [0.0, 0.15, 0.42, 0.7, 1.0], [0.0, 0.35, 1.0, 0.9, 0.35])
    wing = strength[uu] * np.abs(vv) ** 2.4
    x = curve[uu, 0] + wing * along[uu, 1]
    z = curve[uu, 1] - wing * along[uu, 0]
    top = np.dstack([x, y, z])[::-1]
    shell = sheet(top, top - np.array([0.006, 0.0, 0.008]))
    legs = []
    for sx in (-1.0, 1.0):
        for sy in (-1.0, 1.0):
            legs.append(
                rod((sx * (half_d - 0.03), sy * (half_w - 0.03), 0.0), (sx * 0.42 * half_d, sy * 0.4 * half_w, seat_z - 0.02), 0.011, 0.019)
            )
    braces = [
        rod((-0.42 * half_d, -0.4 * half_w, seat_z - 0.04), (0.42 * half_d, 0.4 * half_w, seat_z - 0.04), 0.008),
        rod((0.42 * half_d, -0.4 * half_w, seat_z - 0.04), (-0.42 * half_d, 0.4 * half_w, seat_z - 0.04), 0.008),
    ]
    pad = cushion(rng, (-0.42 * half_d, -0.62 * half_w, seat_z - 0.012), (0.72 * half_d, 0.62 * half_w, seat_z + 0.026), 0.017, 0.014)
    return {"frame": merged(*legs, *braces), "seat": pad, "backrest": shell}


def _smooth(t: NDArray[np.float64], values: NDArray[np.float64], fine: NDArray[np.float64]) -> NDArray[np.float64]:
    """Interpolate with a cubic Hermite spline of centred slopes."""
    slope = np.gradient(values, t)
    i = np.clip(np.searchsorted(t, fine, side="right") - 1, 0, len(t) - 2)
    step = t[i + 1] - t[i]
    s = (fine - t[i]) / step
    return np.asarray(
        (1 + 2 * s) * (1 - s) ** 2 * values[i]
        + s * (1 - s) ** 2 * step * slope[i]
        + s**2 * (3 - 2 * s) * values[i + 1]
        + s**2 * (s - 1) * step * slope[i + 1]
    )


MODELS = {"desk_chair": Model(build_desk_chair, ("office", "wooden", "shell"))}
