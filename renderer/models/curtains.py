"""Curtains: cloth in folds at both sides of a window, on a rod; the wall is behind them, the room at +x."""

from __future__ import annotations

import math

import numpy as np

from renderer.geometry.mesh import Mesh
from renderer.geometry.shapes import blocks, grid_faces, lathe, merged, moved, rod, rotated, sheet, smooth_normals
from renderer.models.model import Model, Parts, Size, fitted
from renderer.models.upholstery import repeated


def build_curtain(rng: np.random.Generator, size_m: Size, style: str) -> Parts:
    """Return two curtains drawn to the sides, hanging free, gathered by bands, or below a pelmet; the middle half stays open."""
    depth, width, height = size_m
    half_d, half = 0.5 * depth, 0.5 * width
    bar = min(0.014, 0.16 * depth)
    rod_z = height - 1.6 * bar
    cloth_half = 0.5 * width - 2.6 * bar
    span = min(rng.uniform(0.2, 0.25) * width, 0.55)
    top = rod_z - 1.2 * bar
    hangings = []
    bands = []
    for s in (-1.0, 1.0):
        edge = s * cloth_half
        low, high = sorted((edge, edge - s * span))
        hangings.append(_hanging(rng, (low, high), edge, half_d - 0.004, top, style == "tied"))
        if style == "tied":
            bands.append(_band(edge - s * 0.21 * span, 0.23 * span, half_d - 0.003, 0.42 * height))
    pole = [rod((0.0, -half + 1.8 * bar, rod_z), (0.0, half - 1.8 * bar, rod_z), 0.8 * bar, segments=14)]
    ball = lathe(
        [
            (1.6 * bar * math.cos(a) if abs(a) < 1.57 else 0.0, 1.6 * bar * math.sin(a))
            for a in np.linspace(-0.5 * math.pi, 0.5 * math.pi, 9)
        ],
        16,
    )
    pole += [moved(ball, y=s * (half - 1.6 * bar), z=rod_z) for s in (-1.0, 1.0)]
    for s in (-1.0, 1.0):
        y = s * (half - 4.5 * bar)
        pole.append(rod((-half_d, y, rod_z), (0.0, y, rod_z), 0.5 * bar, segments=10))
        pole.append(
            moved(
                rotated(lathe([(0.0, 0.0), (1.5 * bar, 0.0), (1.5 * bar, 0.004), (0.0, 0.004)], 16), "y", 0.5 * math.pi), -half_d, y, rod_z
            )
        )
    spots = cloth_half - np.linspace(0.04, 0.96, 7) * span
    rings = repeated(_ring(0.0, rod_z, 1.15 * bar, 0.22 * bar), [(0.0, s * y, 0.0) for s in (-1.0, 1.0) for y in spots])
    parts = {"cloth": merged(*hangings, *bands), "rod": merged(*pole, rings)}
    if style == "pelmet":
        parts["pelmet"] = _pelmet(half_d, half, height)
    return fitted(parts, size_m)


def _pelmet(half_d: float, half: float, height: float) -> Mesh:
    """Return a board with a scalloped lower edge that hides the rod, and its returns to the wall."""
    drop = min(0.24, 0.12 * height)
    count = max(3, round(2.0 * half / 0.34))
    y = np.linspace(-half, half, 8 * count + 1)
    low = height - drop + 0.3 * drop * (1.0 - np.abs(np.sin(0.5 * math.pi * count * (y / half + 1.0))) ** 0.7)
    z = low[:, None] + (height - low)[:, None] * np.linspace(0.0, 1.0, 4)
    yy = np.broadcast_to(y[:, None], z.shape)
    face = np.dstack([np.full_like(z, half_d), yy, z])
    board = sheet(face, face - np.array([0.012, 0.0, 0.0]))
    ends = blocks(
        [(-half_d, -half, height - drop), (-half_d, half - 0.012, height - drop), (-half_d, -half, height - 0.012)],
        [(half_d - 0.004, -half + 0.012, height), (half_d - 0.004, half, height), (half_d - 0.002, half, height)],
        0.002,
    )
    return merged(board, ends)


def _ring(y: float, z: float, radius: float, bar: float) -> Mesh:
    """Return a ring round the rod with an eye to the cloth below."""
    loop = [(radius + bar * math.cos(a), bar * math.sin(a)) for a in np.arange(6) * (math.pi / 3)]
    ring = moved(rotated(lathe(loop, 14, closed=True), "x", 0.5 * math.pi), 0.0, y, z)
    return merged(ring, rod((0.0, y, z - 0.95 * radius), (0.0, y, z - 1.9 * radius), 0.8 * bar, segments=6))


def _hanging(rng: np.random.Generator, span: tuple[float, float], edge: float, reach: float, top: float, tied: bool) -> Mesh:
    """Return one curtain between two y: pleats that are tight at the top and swing out below; ``tied`` draws it to ``edge`` at a band."""
    width = span[1] - span[0]
    pleats = max(3, round(width / rng.uniform(0.075, 0.095)))
    columns, rows = 12 * pleats + 1, 14
    u, v = np.meshgrid(np.linspace(0.0, 1.0, columns), np.linspace(0.0, 1.0, rows), indexing="ij")
    phase = rng.uniform(0.0, 2.0 * math.pi, 3)
    drift = 0.35 * np.sin(2.0 * math.pi * (1.3 * u + 0.5 * v) + phase[0]) * (1.0 - v)
    angle = 2.0 * math.pi * pleats * u + drift
    open_m = np.interp(v, [0.0, 0.6, 1.0], [1.0, 0.9, 0.6])
    uneven = 0.82 + 0.18 * np.sin(2.0 * math.pi * 1.7 * u + phase[1])
    thick = 0.003
    amplitude = (reach - thick) * open_m * uneven
    x = amplitude * np.sin(angle)
    y = span[0] + width * u + 0.085 * width / pleats * np.sin(2.0 * angle) * open_m
    z = top * v
    if tied:
        pinch = np.exp(-(((v - 0.42) / 0.16) ** 2)) + np.exp(-(((v - 0.42) / 0.3) ** 2)) * (v > 0.42)
        pull = 0.58 * np.minimum(pinch, 1.0)
        y = y + pull * (edge - y)
    front = np.dstack([np.clip(x, -reach + thick, reach), y, z])
    normals = smooth_normals(front.reshape(-1, 3), grid_faces(columns, rows))
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    return sheet(front, front - thick * normals.reshape(front.shape))


def _band(y: float, half: float, reach: float, z: float) -> Mesh:
    """Return a cloth band round a gathered curtain, higher at the wall's side."""
    turn = np.arange(25) * (2.0 * math.pi / 24)
    ring = np.column_stack([reach * np.cos(turn), y + 1.02 * half * np.sin(turn)])
    heights = np.array([-0.03, 0.03])
    outer = np.stack([np.column_stack([ring, np.full(25, z + h)]) for h in heights], axis=1)
    inner = outer.copy()
    inner[:, :, 0] *= 0.9
    inner[:, :, 1] = y + (inner[:, :, 1] - y) * 0.95
    return sheet(outer, inner)


MODELS = {"curtain": Model(build_curtain, ("free", "tied", "pelmet"))}
