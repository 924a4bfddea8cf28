"""Exercise bikes and saddles; the rider looks along -x."""

from __future__ import annotations

import math

import numpy as np

from renderer.geometry.mesh import Mesh
from renderer.geometry.shapes import block, merged, mirrored, moved, rod, rotated, rounded_box, sheet, sweep
from renderer.models.lofts import bent, disc, ring
from renderer.models.model import Model, Parts, Size, fitted
from renderer.models.soft import cushion


def build_exercise_bike(rng: np.random.Generator, size_m: Size, style: str) -> Parts:
    """Return a spinning bike with bare flywheel, an upright bike with covered drive, or a recumbent one; bars at -x, saddle at +x."""
    if style == "recumbent":
        return fitted(_recumbent(rng, size_m), size_m)
    depth, width, height = size_m
    half_d, half_w = 0.5 * depth, 0.5 * width
    feet = [rounded_box((x - 0.035, -half_w, 0.0), (x + 0.035, half_w, 0.06), 0.02, 2) for x in (-half_d + 0.05, half_d - 0.05)]
    r = min(0.24, 0.23 * depth, 0.2 * height)
    wheel = (-half_d + r + 0.05, 0.0, r + 0.09)
    crank = (0.04 * depth, 0.0, 0.29 * height)
    seat_top = (0.26 * depth, 0.0, 0.74 * height)
    bar_top = (-0.27 * depth, 0.0, 0.84 * height)
    beam = [bent([(-half_d + 0.05, 0, 0.05), (0.0, 0.0, 0.09), (half_d - 0.05, 0, 0.05)], 0.03, 0.2, 10)]
    beam += [sweep([(0.0, 0.0, 0.08), crank, (0.2 * depth, 0.0, 0.56 * height)], 0.034, 10)]
    beam += [sweep([crank, (-0.2 * depth, 0.0, 0.62 * height), (-0.22 * depth, 0.0, 0.66 * height)], 0.034, 10)]
    fork = [
        bent([(wheel[0], s * 0.05, wheel[2]), (-0.22 * depth, s * 0.045, 0.5 * height), (-0.2 * depth, 0.0, 0.6 * height)], 0.016, 0.1, 8)
        for s in (-1.0, 1.0)
    ]
    posts = [sweep([(0.19 * depth, 0, 0.5 * height), (seat_top[0], 0, seat_top[2] - 0.05)], 0.022, 10)]
    posts += [sweep([(-0.21 * depth, 0.0, 0.6 * height), (bar_top[0], 0.0, bar_top[2])], 0.022, 10)]
    if style == "spinning":
        fly = merged(
            disc("y", wheel, r, 0.03, 40, 0.006), disc("y", wheel, 0.3 * r, 0.07, 20, 0.01), ring("y", wheel, 0.95 * r, 0.02, 40, 8)
        )
        cover = [sweep([wheel, crank], [0.55 * r, 0.11], 24, 0.16)]
        cover = [moved(mesh, y=-0.055) for mesh in cover]
    else:
        fly = disc("y", (wheel[0], 0.0, wheel[2]), 0.8 * r, 0.14, 36, 0.02)
        shell = [disc("y", (wheel[0] + 0.02, 0.0, wheel[2] + 0.01), 1.02 * r, 0.11, 36, 0.04), disc("y", crank, 0.17, 0.11, 28, 0.04)]
        cover = [*shell, sweep([(wheel[0], 0, wheel[2] + 0.1 * r), crank], [0.9 * r, 0.15], 24, 0.2)]
    pedals, arms = [], [rod((crank[0], -0.1, crank[2]), (crank[0], 0.1, crank[2]), 0.016)]
    turn, reach = rng.uniform(0.0, 2.0 * math.pi), min(0.17, crank[2] - 0.1)
    for s in (-1.0, 1.0):
        px, pz = crank[0] + s * reach * math.cos(turn), crank[2] + s * reach * math.sin(turn)
        arms.append(sweep([(crank[0], s * 0.095, crank[2]), (px, s * 0.1, pz)], 0.013, 8))
        pedals.append(block((px - 0.045, s * 0.14 - 0.04, pz - 0.012), (px + 0.045, s * 0.14 + 0.04, pz + 0.012), 0.006))
    grip_w = 0.92 * half_w
    reach = -half_d + 0.02
    bars = bent(
        [
            (reach + 0.2 * depth, -grip_w, bar_top[2] + 0.02),
            (reach, -grip_w, bar_top[2] + 0.05),
            (bar_top[0] - 0.02, -0.06, bar_top[2]),
            (bar_top[0] - 0.02, 0.06, bar_top[2]),
            (reach, grip_w, bar_top[2] + 0.05),
            (reach + 0.2 * depth, grip_w, bar_top[2] + 0.02),
        ],
        0.015,
        0.06,
        10,
    )
    z = bar_top[2] + 0.03
    console = rounded_box((-0.02, -0.13, 0.0), (0.02, 0.13, height - z), 0.014, 2)
    screen = block((0.012, -0.1, 0.25 * (height - z)), (0.023, 0.1, 0.85 * (height - z)), 0.002)
    console, screen = (moved(rotated(mesh, "y", -0.5), bar_top[0] + 0.02, z=z) for mesh in (console, screen))
    return fitted(
        {
            "frame": merged(*feet, *beam, *fork),
            "posts": merged(*posts, *arms),
            "flywheel": fly,
            "cover": merged(*cover),
            "pedals": merged(*pedals),
            "saddle": saddle(rng, 0.27, 0.21, seat_top, -1.0),
            "handlebar": bars,
            "console": console,
            "screen": screen,
        },
        size_m,
    )


def _recumbent(rng: np.random.Generator, size_m: Size) -> Parts:
    """A low bike with a seat with back at +x, pedals before it, a covered drive, and bars beside the seat."""
    depth, width, height = size_m
    half_d, half_w = 0.5 * depth, 0.5 * width
    r = min(0.22, 0.2 * depth, 0.19 * height)
    feet = [rounded_box((x - 0.035, -half_w, 0.0), (x + 0.035, half_w, 0.055), 0.02, 2) for x in (-half_d + 0.12, half_d - 0.05)]
    hub, crank = (-half_d + r + 0.02, 0.0, 0.3 * height), (-half_d + 1.5 * r + 0.1, 0.0, 0.4 * height)
    seat_z = 0.48 * height
    beam = rounded_box((-half_d + 0.08, -0.045, 0.05), (half_d - 0.03, 0.045, 0.13), 0.02, 2)
    rest = rod((0.27 * depth, 0.0, 0.1), (0.27 * depth, 0.0, seat_z - 0.05), 0.035)
    shell = [disc("y", hub, 1.05 * r, 0.13, 36, 0.04), disc("y", crank, 0.55 * r, 0.13, 28, 0.04)]
    shell += [
        sweep([hub, crank], [0.95 * r, 0.5 * r], 24, 0.06 / r),
        rounded_box((hub[0] - 0.5 * r, -0.06, 0.08), (crank[0], 0.06, hub[2]), 0.03, 2),
    ]
    turn, reach = rng.uniform(0.0, 2.0 * math.pi), min(0.16, crank[2] - 0.14)
    pedals, arms = [], [rod((crank[0], -0.11, crank[2]), (crank[0], 0.11, crank[2]), 0.016)]
    for s in (-1.0, 1.0):
        px, pz = crank[0] + s * reach * math.cos(turn), crank[2] + s * reach * math.sin(turn)
        arms.append(sweep([(crank[0], s * 0.1, crank[2]), (px, s * 0.105, pz)], 0.013, 8))
        pedals.append(block((px - 0.012, s * 0.15 - 0.04, pz - 0.05), (px + 0.03, s * 0.15 + 0.04, pz + 0.05), 0.008))
    wide = min(0.2, 0.75 * half_w)
    seat = cushion(rng, (0.08 * depth, -wide, seat_z - 0.05), (0.36 * depth, wide, seat_z + 0.03), 0.03, 0.03)
    back = rotated(cushion(rng, (-0.03, -wide, 0.0), (0.05, wide, 0.34 * height), 0.03, 0.03, axis=0), "y", math.pi)
    back = moved(rotated(mirrored(back, "z"), "y", 0.18), 0.36 * depth, z=seat_z)
    mast_x, mast_z = -0.2 * depth, 0.86 * height
    mast = sweep([(crank[0] - 0.5 * r, 0.0, crank[2] + 0.3 * r), (mast_x - 0.06, 0.0, mast_z)], 0.028, 10)
    bars = [
        bent(
            [
                (mast_x - 0.05, s * 0.02, 0.9 * mast_z),
                (mast_x, s * 0.8 * half_w, 0.92 * mast_z),
                (mast_x + 0.16, s * 0.8 * half_w, 0.9 * mast_z),
            ],
            0.015,
            0.05,
            8,
        )
        for s in (-1.0, 1.0)
    ]
    bars += [
        bent(
            [
                (0.3 * depth, s * 0.1, seat_z - 0.08),
                (0.28 * depth, s * 0.92 * half_w, seat_z - 0.08),
                (0.12 * depth, s * 0.92 * half_w, seat_z + 0.12),
            ],
            0.015,
            0.06,
            8,
        )
        for s in (-1.0, 1.0)
    ]
    rise = height - mast_z + 0.02
    console = rounded_box((-0.02, -0.15, 0.0), (0.02, 0.15, rise), 0.014, 2)
    screen = block((0.012, -0.12, 0.2 * rise), (0.023, 0.12, 0.88 * rise), 0.002)
    console, screen = (moved(rotated(mesh, "y", -0.35), mast_x - 0.04, z=mast_z - 0.02) for mesh in (console, screen))
    return {
        "frame": merged(*feet, beam, mast),
        "posts": merged(rest, *arms),
        "flywheel": disc("y", hub, 0.6 * r, 0.15, 36, 0.02),
        "cover": merged(*shell),
        "pedals": merged(*pedals),
        "saddle": merged(seat, back),
        "handlebar": merged(*bars),
        "console": console,
        "screen": screen,
    }


def saddle(rng: np.random.Generator, length: float, width: float, top: tuple[float, float, float], nose: float) -> Mesh:
    """Return a padded saddle whose nose looks along x times ``nose``; its highest point is ``top``."""
    shares = np.linspace(-0.5, 0.5, 11)
    half = 0.5 * width * np.interp(shares, [-0.5, -0.44, -0.3, 0.0, 0.2, 0.45, 0.5], [0.5, 0.85, 1.0, 0.6, 0.28, 0.2, 0.08])
    t = np.linspace(-1.0, 1.0, 9)
    x = nose * length * np.repeat(shares[:, None], 9, axis=1)
    y = half[:, None] * np.sin(0.5 * math.pi * t)[None]
    crown = np.sqrt(np.clip(1.0 - np.sin(0.5 * math.pi * t) ** 2, 0.0, 1.0))[None]
    z = -0.012 * (1.0 - np.cos(2.5 * shares))[:, None] - 0.045 * (1.0 - crown)
    upper = np.dstack([x, y, z])
    lower = np.dstack([x, y, np.minimum(z - 0.004, -0.05 + 0.0 * z)])
    if nose < 0.0:
        upper, lower = upper[::-1], lower[::-1]
    return moved(sheet(upper, lower), *top)


MODELS = {"exercise_bike": Model(build_exercise_bike, ("spinning", "upright", "recumbent"))}
