"""Armchairs and poufs; the sitter looks along +x."""

from __future__ import annotations

import math

import numpy as np

from renderer.geometry.mesh import Mesh
from renderer.geometry.shapes import lathe, merged, moved, rod, rotated, rounded_box, sheet, sweep
from renderer.models.model import Model, Parts, Size, fitted
from renderer.models.soft import cushion
from renderer.models.upholstery import tufted


def build_armchair(rng: np.random.Generator, size_m: Size, style: str) -> Parts:
    """Return an upholstered lounge chair, a wooden frame with loose cushions, a rounded tub, or a buttoned wing chair."""
    return fitted({"lounge": _lounge, "frame": _wood_frame, "tub": _tub, "wing": _wing}[style](rng, size_m), size_m)


def _lounge(rng: np.random.Generator, size_m: Size) -> Parts:
    depth, width, height = size_m
    half_d, half_w = 0.5 * depth, 0.5 * width
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
        for sx in (-1.0, 1.0)
        for sy in (-1.0, 1.0)
    ]
    return {"body": merged(base, shell, *arms), "seat": seat, "back": back, "legs": merged(*legs)}


def _wood_frame(rng: np.random.Generator, size_m: Size) -> Parts:
    depth, width, height = size_m
    half_d, half_w = 0.5 * depth, 0.5 * width
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
    depth, width, height = size_m
    half_d, half_w = 0.5 * depth, 0.5 * width
    leg = 0.12
    seat_z = min(0.44, 0.56 * height)
    angle = np.linspace(math.radians(62.0), math.radians(298.0), 34)
    v = np.linspace(0.0, 1.0, 9)
    aa, vv = np.meshgrid(angle, v, indexing="ij")
    back = 0.5 - 0.5 * np.cos(aa)
    rim = seat_z + 0.14 + (height - seat_z - 0.14) * back**1.6
    z = leg + (rim - leg) * vv
    outer = 0.90 + 0.10 * vv**0.7
    thick = 0.085 * (1.0 - 0.35 * vv)
    round_x, round_y = np.sign(np.cos(aa)) * np.abs(np.cos(aa)) ** 0.8, np.sign(np.sin(aa)) * np.abs(np.sin(aa)) ** 0.8
    outside = np.dstack([half_d * round_x * outer, half_w * round_y * outer, z])
    inside = np.dstack([(half_d * outer - thick) * round_x, (half_w * outer - thick) * round_y, z - 0.012 * (1.0 - vv)])
    shell = sheet(outside, inside)
    seat_half = half_w - 0.105
    seat = cushion(rng, (-half_d + 0.12, -seat_half, seat_z - 0.15), (half_d, seat_half, seat_z + 0.015), 0.06, 0.035, piping_m=0.005)
    base = rounded_box((-half_d + 0.14, -half_w + 0.13, leg), (half_d - 0.05, half_w - 0.13, seat_z - 0.13), 0.03)
    legs = [
        rod((sx * (half_d - 0.12), sy * (half_w - 0.12), 0.0), (sx * (half_d - 0.17), sy * (half_w - 0.17), leg + 0.03), 0.012, 0.02)
        for sx in (-1.0, 1.0)
        for sy in (-1.0, 1.0)
    ]
    return {"body": merged(base, shell), "seat": seat, "legs": merged(*legs)}


def _wing(rng: np.random.Generator, size_m: Size) -> Parts:
    """A high buttoned back between wings, rolled arms, turned feet."""
    depth, width, height = size_m
    half_d, half_w = 0.5 * depth, 0.5 * width
    leg, arm, seat_z = 0.15 * height, 0.15 * width, min(0.45, 0.52 * height)
    arm_z = min(seat_z + 0.18, 0.76 * height)
    inner = half_w - arm
    body = [
        rounded_box((-half_d, -inner - 0.02, leg), (-half_d + 0.12, inner + 0.02, height), 0.045, 3),
        rounded_box((-half_d + 0.03, -inner - 0.02, leg), (half_d - 0.03, inner + 0.02, seat_z - 0.11), 0.02),
    ]
    v, u = np.meshgrid(np.linspace(0.0, 1.0, 13), np.linspace(0.0, 1.0, 7), indexing="ij")
    reach = 0.14 * depth + 0.26 * depth * np.sin(math.pi * np.clip(0.35 + 0.62 * v, 0.0, 1.0)) ** 0.7
    z = seat_z + (height - 0.015 - seat_z) * v
    x = -half_d + 0.01 + reach * u
    radius = min(0.065, 0.5 * arm)
    for s in (-1.0, 1.0):
        y = half_w - 0.55 * arm - 0.02 * u
        fat = 0.036 * np.sqrt(np.clip(1.0 - (2.0 * u - 1.0) ** 4, 0.02, 1.0))
        faces = np.dstack([x, s * (y - s * fat), z]), np.dstack([x, s * (y + s * fat), z])
        body.append(sheet(*faces))
        middle = s * (half_w - radius)
        path = np.column_stack([np.linspace(-half_d + 0.06, half_d - 0.05, 4), [middle] * 4, [arm_z - radius] * 4])
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


def build_pouf(rng: np.random.Generator, size_m: Size, style: str) -> Parts:
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
        return fitted({"body": body, "piping": merged(piping, feet)}, size_m)
    angle = np.linspace(-0.5 * math.pi, 0.5 * math.pi, 15)
    if style == "knitted":
        profile = [(radius * math.cos(a) ** 0.55 if abs(a) < 1.57 else 0.0, 0.5 * height * (1.0 + math.sin(a))) for a in angle]
        body = lathe(profile, 72, wave=lambda a: 1.0 + 0.018 * np.cos(24 * a))
        return fitted(
            {
                "body": body,
                "piping": lathe(
                    [(0.0, height - 0.004), (0.05, height - 0.004), (0.052, height + 0.003), (0.03, height + 0.008), (0.0, height + 0.009)],
                    20,
                ),
            },
            size_m,
        )
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
    return fitted({"body": lathe(side + top, 40), "piping": merged(*seams, feet)}, size_m)


MODELS = {
    "armchair": Model(build_armchair, ("lounge", "frame", "tub", "wing")),
    "pouf": Model(build_pouf, ("round", "square", "knitted")),
}
