"""Armchairs, poufs, sofas and corner sofas; the sitters look along +x."""

import itertools
import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

import kernel_cache.elementary as el
from renderer.geometry.lofts import points
from renderer.geometry.mesh import Mesh
from renderer.geometry.shapes import block, lathe, merged, mirrored, moved, rod, rotated, rounded_box, sheet, sweep
from renderer.geometry.upholstery import cushion, pillow, piping, rounded_loop, tufted
from renderer.models.model import CORNERS, Model, Parts, Pieces, Size, halved
from renderer.models.throws import with_throw


def build_armchair(rng: np.random.Generator, size_m: Size, style: str) -> Pieces:
    """Return an upholstered lounge chair, a wooden frame with loose cushions, a rounded tub, or a buttoned wing chair."""
    return {"lounge": _lounge, "frame": _wood_frame, "tub": _tub, "wing": _wing}[style](rng, size_m)


def _lounge(rng: np.random.Generator, size_m: Size) -> Parts:
    _, width, height, half_d, half_w = halved(size_m)
    leg = 0.10
    arm = min(0.15, 0.18 * width)
    seat_z = min(0.44, 0.55 * height)
    arm_z = min(seat_z + 0.19, 0.8 * height)
    inner = half_w - arm
    arms = []
    for s in (-1.0, 1.0):
        low, high = sorted((s * half_w, s * inner))
        arms.append(rounded_box((-half_d + 0.02, low, leg), (half_d - 0.01, high, arm_z), 0.045, 3))
    base = rounded_box((-half_d + 0.03, -inner - 0.02, leg), (half_d - 0.035, inner + 0.02, seat_z - 0.13), 0.02)
    shell = rounded_box((-half_d, -half_w + 0.015, leg), (-half_d + 0.13, half_w - 0.015, height - 0.03), 0.05, 3)
    seat = cushion(
        rng, (-half_d + 0.11, -inner + 0.003, seat_z - 0.14), (half_d, inner - 0.003, seat_z + 0.025), 0.05, 0.04, piping_m=0.005
    )
    near, far = (-half_d + 0.09, -inner + 0.006, seat_z - 0.01), (-half_d + 0.30, inner - 0.006, height)
    back = cushion(rng, near, far, 0.06, 0.07, axis=0, piping_m=0.005)
    back = rotated(back, "y", -0.10, (-half_d + 0.1, 0.0, seat_z))
    legs = [
        rod((sx * (half_d - 0.07), sy * (half_w - 0.06), 0.0), (sx * (half_d - 0.08), sy * (half_w - 0.07), leg + 0.02), 0.014, 0.023)
        for sx, sy in CORNERS
    ]
    return {"body": merged(base, shell, *arms), "seat": seat, "back": back, "legs": merged(*legs)}


def _wood_frame(rng: np.random.Generator, size_m: Size) -> Parts:
    _, _, height, half_d, half_w = halved(size_m)
    seat_z = min(0.40, 0.5 * height)
    arm_z = min(seat_z + 0.20, 0.78 * height)
    frame: list[Mesh] = []
    for s in (-1.0, 1.0):
        y = s * (half_w - 0.03)
        frame.append(rod((half_d - 0.03, y, 0.0), (half_d - 0.09, y, arm_z - 0.012), 0.014, 0.022))
        frame.append(rod((-half_d + 0.06, y, 0.0), (-half_d + 0.17, y, arm_z - 0.012), 0.014, 0.022))
        frame.append(rounded_box((-half_d + 0.08, y - 0.03, arm_z - 0.014), (half_d - 0.03, y + 0.03, arm_z + 0.014), 0.012))
        frame.append(rod((half_d - 0.07, y, seat_z - 0.12), (-half_d + 0.12, y, seat_z - 0.17), 0.016))
        frame.append(
            rod((-half_d + 0.2, s * (half_w - 0.1), seat_z - 0.16), (-half_d + 0.025, s * (half_w - 0.1), height - 0.015), 0.017, 0.014)
        )
    span = half_w - 0.035
    frame.append(rod((half_d - 0.075, -span, seat_z - 0.12), (half_d - 0.075, span, seat_z - 0.12), 0.016))
    frame.append(rod((-half_d + 0.13, -span, seat_z - 0.165), (-half_d + 0.13, span, seat_z - 0.165), 0.016))
    for z in np.linspace(seat_z + 0.05, height - 0.03, 4):
        x = np.interp(z, [seat_z - 0.16, height - 0.015], [-half_d + 0.2, -half_d + 0.025])
        frame.append(rod((x, -half_w + 0.1, z), (x, half_w - 0.1, z), 0.011))
    inner = half_w - 0.068
    seat = rotated(
        cushion(rng, (-half_d + 0.12, -inner, seat_z - 0.13), (half_d - 0.01, inner, seat_z + 0.02), 0.04, 0.03),
        "y",
        -0.07,
        (half_d, 0.0, seat_z),
    )
    angle = -math.atan2(0.175, height - seat_z + 0.145)
    back = rotated(
        cushion(rng, (-half_d + 0.20, -inner, seat_z - 0.02), (-half_d + 0.35, inner, height + 0.01), 0.045, 0.045, axis=0),
        "y",
        angle,
        (-half_d + 0.2, 0.0, seat_z - 0.1),
    )
    return {"body": merged(*frame), "seat": seat, "back": back}


def _tub(rng: np.random.Generator, size_m: Size) -> Parts:
    _, _, height, half_d, half_w = halved(size_m)
    leg = 0.12
    seat_z = min(0.44, 0.56 * height)
    angle = np.linspace(math.radians(62.0), math.radians(298.0), 34)
    v = np.linspace(0.0, 1.0, 9)
    aa, vv = np.meshgrid(angle, v, indexing="ij")
    back = 0.5 - 0.5 * el.cos(aa)
    rim = seat_z + 0.14 + (height - seat_z - 0.14) * el.power(back, 1.6)
    z = leg + (rim - leg) * vv
    outer = 0.90 + 0.10 * el.power(vv, 0.7)
    thick = 0.085 * (1.0 - 0.35 * vv)
    round_x, round_y = np.sign(el.cos(aa)) * el.power(np.abs(el.cos(aa)), 0.8), np.sign(el.sin(aa)) * el.power(np.abs(el.sin(aa)), 0.8)
    outside = np.dstack([half_d * round_x * outer, half_w * round_y * outer, z])
    inside = np.dstack([(half_d * outer - thick) * round_x, (half_w * outer - thick) * round_y, z - 0.012 * (1.0 - vv)])
    shell = sheet(outside, inside)
    seat_half = half_w - 0.105
    seat = cushion(rng, (-half_d + 0.12, -seat_half, seat_z - 0.15), (half_d, seat_half, seat_z + 0.015), 0.06, 0.035, piping_m=0.005)
    base = rounded_box((-half_d + 0.14, -half_w + 0.13, leg), (half_d - 0.05, half_w - 0.13, seat_z - 0.13), 0.03)
    legs = [
        rod((sx * (half_d - 0.12), sy * (half_w - 0.12), 0.0), (sx * (half_d - 0.17), sy * (half_w - 0.17), leg + 0.03), 0.012, 0.02)
        for sx, sy in CORNERS
    ]
    return {"body": merged(base, shell), "seat": seat, "legs": merged(*legs)}


def _wing(rng: np.random.Generator, size_m: Size) -> Parts:
    """A high buttoned back between wings, rolled arms, turned feet."""
    depth, width, height, half_d, half_w = halved(size_m)
    leg, arm, seat_z = 0.15 * height, 0.15 * width, min(0.45, 0.52 * height)
    arm_z = min(seat_z + 0.18, 0.76 * height)
    inner = half_w - arm
    body = [
        rounded_box((-half_d, -inner - 0.02, leg), (-half_d + 0.12, inner + 0.02, height), 0.045, 3),
        rounded_box((-half_d + 0.03, -inner - 0.02, leg), (half_d - 0.03, inner + 0.02, seat_z - 0.11), 0.02),
    ]
    v, u = np.meshgrid(np.linspace(0.0, 1.0, 13), np.linspace(0.0, 1.0, 7), indexing="ij")
    reach = 0.14 * depth + 0.26 * depth * el.power(el.sin(math.pi * np.clip(0.35 + 0.62 * v, 0.0, 1.0)), 0.7)
    z = seat_z + (height - 0.015 - seat_z) * v
    x = -half_d + 0.01 + reach * u
    radius = min(0.065, 0.5 * arm)
    for s in (-1.0, 1.0):
        y = half_w - 0.55 * arm - 0.02 * u
        fat = 0.036 * np.sqrt(np.clip(1.0 - el.power(2.0 * u - 1.0, 4), 0.02, 1.0))
        faces = np.dstack([x, s * y + fat, z]), np.dstack([x, s * y - fat, z])
        body.append(sheet(*faces))
        middle = s * (half_w - radius)
        path = points(np.linspace(-half_d + 0.06, half_d - 0.05, 4), middle, arm_z - radius)
        body.append(sweep(path, radius, 18))
        low, high = sorted((s * (half_w - 0.03), s * (inner - 0.002)))
        body.append(rounded_box((-half_d + 0.04, low, leg), (half_d - 0.06, high, arm_z - radius), 0.025))
    back_z = (seat_z - 0.02, height - 0.05)
    panel = tufted((-inner, inner), back_z, (-half_d + 0.09, -half_d + 0.18), (0.16, 0.14), 0.04)
    near, far = (-half_d + 0.13, -inner + 0.004, seat_z - 0.12), (half_d, inner - 0.004, seat_z + 0.02)
    profile = [(0.0, 0.0), (0.014, 0.0), (0.02, 0.12 * leg), (0.014, 0.3 * leg), (0.026, 0.7 * leg), (0.02, 0.8 * leg), (0.03, leg + 0.01)]
    foot = lathe([*profile, (0.0, leg + 0.01)], 14)
    legs = [moved(foot, x, sy * (half_w - 0.09)) for x in (-half_d + 0.08, half_d - 0.09) for sy in (-1.0, 1.0)]
    return {"body": merged(*body), "seat": cushion(rng, near, far, 0.045, 0.035, piping_m=0.005), "back": panel, "legs": merged(*legs)}


def build_pouf(rng: np.random.Generator, size_m: Size, style: str) -> Pieces:
    """Return a round or square upholstered stool; ``knitted`` is a ribbed ball, flattened."""
    depth, width, height = size_m
    radius = 0.5 * width
    if style == "square":
        body = cushion(rng, (-0.5 * depth, -0.5 * width, 0.02), (0.5 * depth, 0.5 * width, height), 0.04, 0.03)
        lid = 0.3 * height
        piping = rounded_box(
            (-0.5 * depth - 0.002, -0.5 * width - 0.002, height - lid),
            (0.5 * depth + 0.002, 0.5 * width + 0.002, height - lid + 0.012),
            0.006,
        )
        feet = merged(
            *(
                rod((sx * 0.4 * depth, sy * 0.4 * width, 0.0), (sx * 0.4 * depth, sy * 0.4 * width, 0.03), 0.02)
                for sx in (-1, 1)
                for sy in (-1, 1)
            )
        )
        return {"body": body, "piping": [piping, feet]}
    angle = np.linspace(-0.5 * math.pi, 0.5 * math.pi, 15)
    if style == "knitted":
        profile = [(radius * math.pow(math.cos(a), 0.55) if abs(a) < 1.57 else 0.0, 0.5 * height * (1.0 + math.sin(a))) for a in angle]
        body = lathe(profile, 72, wave=lambda a: 1.0 + 0.018 * el.cos(24 * a))
        return {
            "body": body,
            "piping": lathe(
                [(0.0, height - 0.004), (0.05, height - 0.004), (0.052, height + 0.003), (0.03, height + 0.008), (0.0, height + 0.009)], 20
            ),
        }
    top = [
        (radius, 0.72 * height),
        (radius + 0.001, 0.82 * height),
        (0.97 * radius, 0.91 * height),
        (0.86 * radius, 0.965 * height),
        (0.5 * radius, 0.995 * height),
        (0.0, height),
    ]
    side = [(0.0, 0.02), (0.94 * radius, 0.02), (0.98 * radius, 0.06), (radius, 0.2 * height)]
    seams = [
        lathe(
            [(radius - 0.006, z - 0.007), (radius + 0.003, z - 0.004), (radius + 0.003, z + 0.004), (radius - 0.006, z + 0.007)],
            40,
            closed=True,
        )
        for z in (0.72 * height, 0.10 * height)
    ]
    feet = lathe([(0.0, 0.0), (0.8 * radius, 0.0), (0.8 * radius, 0.025), (0.0, 0.025)], 24)
    return {"body": lathe(side + top, 40), "piping": [*seams, feet]}


SEAT_WIDTH_M = 0.7

GAP_M = 0.004

PIPING_M = 0.005


class _Build(NamedTuple):
    """Heights and widths of an upholstered frame, m: legs, armrests' width and height, seat, back frame, thickness of cushions."""

    leg: float
    arm: float
    arm_z: float
    seat_z: float
    back_z: float
    pad: float
    piping: float


def build_sofa(rng: np.random.Generator, size_m: Size, style: str) -> Pieces:
    """Return a sofa: deep with broad round arms, slim on tall legs, rolled arms as high as the back, or a buttoned chesterfield."""
    _, width, height, half_d, half_w = halved(size_m)
    if style == "chesterfield":
        return _chesterfield(rng, size_m)
    plan = _plan(style, width, height)
    inner = half_w - plan.arm
    edges = np.linspace(-inner, inner, max(1, round(2.0 * inner / SEAT_WIDTH_M)) + 1)
    back = (-half_d, -half_w + 0.02, plan.leg), (-half_d + 0.13, half_w - 0.02, plan.back_z)
    base = (-half_d + 0.03, -inner - 0.02, plan.leg), (half_d - 0.03, inner + 0.02, plan.seat_z - plan.pad)
    body = [rounded_box(*back, 0.05, 3), rounded_box(*base, 0.02), *(_arm(style, plan, s, half_w, -half_d, half_d) for s in (-1.0, 1.0))]
    front = -half_d + 0.13
    backs = _back_cushions(rng, edges, front, height, plan)
    spots = [(s * (inner - 0.24), s * rng.uniform(0.1, 0.4)) for s in (-1.0, 1.0)]
    return {
        "body": body,
        "seat": _seat_cushions(rng, edges, front - 0.03, half_d, plan),
        "back": backs,
        "legs": _feet(style, plan.leg, [(x, y) for x in (-half_d + 0.08, half_d - 0.08) for y in (-half_w + 0.09, half_w - 0.09)]),
        "pillows": _pillows(rng, spots, front + 0.2, plan.seat_z, height),
    }


def _chesterfield(rng: np.random.Generator, size_m: Size) -> Parts:
    """Arms and back of one height, rolled outward, with deep buttons inside; loose seat cushions; turned feet."""
    depth, width, height, half_d, half_w = halved(size_m)
    leg, seat_z, pad = 0.1 * height / 0.8, min(0.44, 0.56 * height), 0.13
    roll = min(0.085, 0.11 * height, 0.06 * width)
    arm = 2.0 * roll + 0.05
    inner, x_back, top = half_w - arm, -half_d + arm, height - roll
    rise = (top - seat_z + 0.03) / 3.2
    pitch = (max(0.17, 2.0 * inner / 9.0), rise)
    z = (seat_z - 0.03, top)
    panel = tufted((-inner - 0.02, inner + 0.02), z, (x_back - 0.05, x_back + 0.02), pitch, 0.02)
    side = tufted((-half_d + arm - 0.02, half_d - 0.02), z, (0.0, 0.07), (max(0.2, 0.25 * depth), rise), 0.02)
    right = mirrored(moved(rotated(side, "z", 0.5 * math.pi), y=-half_w + arm - 0.05), "x")
    arms = [right, mirrored(right, "y")]
    rolls, low = [], leg
    for s in (-1.0, 1.0):
        y = s * (half_w - roll)
        rolls.append(sweep(points(np.linspace(-half_d + roll, half_d - 0.008, 3), y, top), roll, 20))
        face = [(0.0, 0.0), (0.62 * roll, 0.0), (0.6 * roll, 0.004), (0.3 * roll, 0.007), (0.0, 0.007)]
        rolls.append(moved(rotated(lathe(face, 16), "y", 0.5 * math.pi), half_d - 0.01, y, top))
        a, b = sorted((s * (half_w - 0.045), s * (inner - 0.002)))
        rolls.append(rounded_box((-half_d + 0.03, a, low), (half_d - 0.018, b, top), 0.025))
    rolls.append(sweep(points(-half_d + roll, np.linspace(-half_w + roll, half_w - roll, 3), top), roll, 20))
    rolls.append(rounded_box((-half_d + 0.045, -half_w + 0.06, low), (x_back, half_w - 0.06, top), 0.02))
    rolls.append(rounded_box((x_back - 0.02, -inner - 0.02, low), (half_d - 0.03, inner + 0.02, seat_z - pad), 0.02))
    edges = np.linspace(-inner, inner, max(1, round(2.0 * inner / SEAT_WIDTH_M)) + 1)
    plan = _Build(leg, arm, height, seat_z, height, pad, PIPING_M)
    feet = [(x, y) for x in (-half_d + 0.1, half_d - 0.08) for y in (-half_w + 0.1, half_w - 0.1)]
    spots = [(s * (inner - 0.2), s * rng.uniform(0.15, 0.4)) for s in (-1.0, 1.0)]
    return {
        "body": merged(*rolls, *arms),
        "seat": _seat_cushions(rng, edges, x_back - 0.01, half_d - 0.012, plan),
        "back": panel,
        "legs": _feet("rolled", leg, feet),
        "pillows": _pillows(rng, spots, x_back + 0.12, seat_z, height),
    }


def build_corner_sofa(rng: np.random.Generator, size_m: Size, style: str) -> Pieces:
    """Return an L: a sofa along the back (0.55 of the depth) whose seat runs on to the front at the +y end (0.4 of the width)."""
    depth, width, height, half_d, half_w = halved(size_m)
    plan = _plan(style, width, height)
    knee = -half_d + 0.55 * depth
    side = half_w - 0.4 * width
    inner = half_w - plan.arm
    low, top = plan.leg, plan.seat_z - plan.pad
    body = [
        rounded_box((-half_d, -half_w + 0.02, low), (-half_d + 0.13, half_w - 0.02, plan.back_z), 0.05, 3),
        rounded_box((-half_d + 0.03, -inner - 0.02, low), (knee - 0.03, inner + 0.02, top), 0.02),
        rounded_box((knee - 0.06, side + 0.01, low), (half_d - 0.02, inner + 0.02, top), 0.02),
        *(_arm(style, plan, s, half_w, -half_d, knee) for s in (-1.0, 1.0)),
    ]
    count = max(1, round((side + inner) / SEAT_WIDTH_M))
    edges = np.linspace(-inner, side, count + 1)
    front = -half_d + 0.13
    seats = [_seat_cushions(rng, edges, front - 0.03, knee, plan), _seat_cushions(rng, [side, inner], front - 0.03, half_d, plan)]
    feet = [(-half_d + 0.08, y) for y in (-half_w + 0.09, side + 0.08, half_w - 0.09)]
    feet += [(knee - 0.1, -half_w + 0.09), (knee - 0.1, half_w - 0.09), (half_d - 0.1, side + 0.09), (half_d - 0.1, inner - 0.09)]
    spots = [(-inner + 0.26, -rng.uniform(0.1, 0.4)), (-inner + 0.62, rng.uniform(-0.2, 0.2)), (inner - 0.24, rng.uniform(0.1, 0.4))]
    return {
        "body": body,
        "seat": seats,
        "back": _back_cushions(rng, [*edges, inner], front, height, plan),
        "legs": _feet(style, low, feet),
        "pillows": _pillows(rng, spots, front + 0.2, plan.seat_z, height),
    }


def _plan(style: str, width: float, height: float) -> _Build:
    seat_z = min(0.45, 0.56 * height)
    leg = {"lounge": 0.05, "slim": 0.15, "rolled": 0.09, "modular": 0.025}[style] * height / 0.85
    arm = min({"lounge": 0.22, "slim": 0.10, "rolled": 0.20, "modular": 0.26}[style], 0.13 * width)
    rise = {"lounge": 0.15, "slim": 0.20, "rolled": 0.26, "modular": 0.12}[style] * height / 0.85
    back_z = {"lounge": 0.86, "slim": 0.9, "rolled": 0.95, "modular": 0.84}[style] * height
    pad = {"lounge": 0.15, "slim": 0.12, "rolled": 0.14, "modular": 0.2}[style]
    cord = {"lounge": PIPING_M, "slim": 0.004, "rolled": 0.006, "modular": 0.0}[style]
    return _Build(leg, arm, min(seat_z + rise, 0.9 * height), seat_z, back_z, min(pad, 0.45 * seat_z), cord)


def _arm(style: str, plan: _Build, side: float, half_w: float, x0: float, x1: float) -> Mesh:
    """Return one armrest from x0 to x1: a soft block, a thin board, or a roll over a block; with a welt round its front."""
    low, high = sorted((side * half_w, side * (half_w - plan.arm)))
    y, middle = 0.5 * (low + high), 0.5 * (plan.leg + plan.arm_z)
    if style != "rolled":
        radius = {"lounge": 0.075, "slim": 0.03, "modular": 0.05}[style]
        soft = rounded_box((x0 + 0.02, low, plan.leg), (x1 - 0.008, high, plan.arm_z), radius, 3)
        if plan.piping <= 0.0:
            return soft
        inset = 0.3 * min(radius, 0.49 * plan.arm)
        loop = rounded_loop(0.5 * plan.arm - inset, 0.5 * (plan.arm_z - plan.leg) - inset, radius)
        front = points(x1 - 0.008 - inset, y + loop[:, 0], middle + loop[:, 1])
        return merged(soft, piping(front, plan.piping))
    radius = 0.5 * plan.arm
    z = plan.arm_z - radius
    roll = sweep(points(np.linspace(x0 + 0.03, x1 - 0.006, 6), y, z), radius, 24)
    inset = 0.18 * plan.arm
    face = rotated(
        lathe([(0.0, 0.0), (0.62 * radius, 0.0), (0.6 * radius, 0.004), (0.3 * radius, 0.006), (0.0, 0.006)], 20), "y", math.pi / 2
    )
    angle = np.arange(20) * (2.0 * math.pi / 20)
    rim = points(x1 - 0.01, y + radius * el.cos(angle), z + radius * el.sin(angle))
    block_under = rounded_box((x0 + 0.03, low + inset, plan.leg), (x1 - 0.02, high - inset, z), 0.02)
    return merged(roll, moved(face, x1 - 0.007, y, z), piping(rim, 0.004), block_under)


def _seat_cushions(rng: np.random.Generator, edges: Sequence[float] | np.ndarray, x0: float, x1: float, plan: _Build) -> Mesh:
    """Return seat cushions side by side between the edges (n,) along y."""
    low, high = plan.seat_z - plan.pad - 0.002, plan.seat_z + 0.028
    radius = 0.05 if plan.piping else 0.035
    return merged(
        *(
            cushion(rng, (x0, a + GAP_M, low), (x1, b - GAP_M, high), radius, 0.04, divisions=5, piping_m=plan.piping)
            for a, b in itertools.pairwise(edges)
        )
    )


def _back_cushions(rng: np.random.Generator, edges: Sequence[float] | np.ndarray, front: float, height: float, plan: _Build) -> Mesh:
    """Return loose back cushions that lean on the frame, whose front lies at ``front``."""
    rows = []
    for a, b in itertools.pairwise(edges):
        top = height - rng.uniform(0.0, 0.015)
        low, high = (front - 0.03, a + GAP_M, plan.seat_z - 0.01), (front + 0.18, b - GAP_M, top)
        pad = cushion(rng, low, high, 0.06, 0.075, axis=0, divisions=5, piping_m=plan.piping)
        rows.append(
            rotated(rotated(pad, "y", -0.11, (front, 0.0, plan.seat_z)), "x", rng.uniform(-0.012, 0.012), (0.0, 0.5 * (a + b), plan.seat_z))
        )
    return merged(*rows)


def _pillows(rng: np.random.Generator, spots: Sequence[tuple[float, float]], x: float, seat_z: float, height: float) -> Mesh:
    """Return scatter cushions that stand on the seat at (y, turn about z) and lean on the back."""
    rows = []
    for y, turn in spots:
        side = min(0.42, 1.0 * (height - seat_z)) * rng.uniform(0.88, 1.0)
        angle = 0.5 * math.pi - rng.uniform(0.22, 0.36)
        standing = rotated(rotated(pillow(rng, side, side, 0.15, 10, piped=True), "y", angle), "z", -turn)
        rows.append(moved(standing, x, y, seat_z + 0.02 - float(standing.vertices[:, 2].min())))
    return merged(*rows)


def _feet(style: str, height: float, spots: Sequence[tuple[float, float]]) -> Mesh:
    """Return low blocks, tapered pegs or turned feet at (x, y)."""
    if style in ("lounge", "modular"):
        return merged(*(block((x - 0.03, y - 0.03, 0.0), (x + 0.03, y + 0.03, height + 0.004)) for x, y in spots))
    if style == "slim":
        return merged(*(rod((1.03 * x, 1.03 * y, 0.0), (x, y, height + 0.02), 0.011, 0.02) for x, y in spots))
    profile = [(0.0, 0.0), (0.02, 0.0), (0.036, 0.3 * height), (0.03, 0.6 * height), (0.018, 0.75 * height), (0.03, height + 0.01)]
    return merged(*(moved(lathe([*profile, (0.0, height + 0.01)], 16), x, y) for x, y in spots))


MODELS = {
    "armchair": Model(with_throw(build_armchair, (-0.08, 0.08)), ("lounge", "frame", "tub", "wing", "lounge_throw")),
    "pouf": Model(build_pouf, ("round", "square", "knitted")),
    "sofa": Model(with_throw(build_sofa, (-0.2, 0.2)), ("lounge", "slim", "rolled", "chesterfield", "lounge_throw", "slim_throw")),
    "corner_sofa": Model(build_corner_sofa, ("lounge", "slim", "modular")),
}
