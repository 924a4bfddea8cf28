"""What is left about a home: a pair of shoes, clothes in a heap or folded, sheets of paper and magazines, a remote control."""

from __future__ import annotations

import math

import numpy as np

from renderer.geometry.mesh import Mesh
from renderer.geometry.shapes import block, blocks, merged, moved, rotated, rounded_box, sheet
from renderer.models.hallway import build_shoe
from renderer.models.model import Model, Parts, Size, fitted
from renderer.models.soft import wrinkle_field

_SHEET_M = 0.0006
_FOLDED = 4
_BUTTON_ROWS = 6


def build_shoes(rng: np.random.Generator, size_m: Size, style: str) -> Parts:
    """Return a pair of shoes, toes to the front: side by side, or one a step ahead of the other."""
    depth, width, height = size_m
    ahead = {"pair": 0.0, "kicked_off": 0.22}[style] * depth
    uppers: list[Mesh] = []
    soles: list[Mesh] = []
    for side in (-1.0, 1.0):
        upper, sole = build_shoe(rng, depth - ahead, height)
        turn = 0.0 if style == "pair" else side * float(rng.uniform(0.1, 0.3))
        for into, mesh in ((uppers, upper), (soles, sole)):
            into.append(rotated(moved(mesh, -0.5 * (depth - ahead) + 0.5 * side * ahead, side * 0.25 * width), "z", turn))
    return fitted({"uppers": merged(*uppers), "soles": merged(*soles)}, size_m)


def build_clothes(rng: np.random.Generator, size_m: Size, style: str) -> Parts:
    """Return clothes: a heap in folds, or a few folded pieces on each other."""
    depth, width, height = size_m
    if style == "heap":
        return fitted(
            {"cloth_0": _heap(rng, size_m, 1.0), "cloth_1": moved(_heap(rng, size_m, 0.62), 0.1 * depth, -0.08 * width, 0.28 * height)},
            size_m,
        )
    pieces: list[list[Mesh]] = [[], []]
    thick = height / _FOLDED
    for k in range(_FOLDED):
        half_d, half_w = (0.5 * side * float(rng.uniform(0.88, 1.0)) for side in (depth, width))
        piece = rounded_box((-half_d, -half_w, k * thick), (half_d, half_w, (k + 1) * thick), 0.42 * thick, 2)
        pieces[k % 2].append(rotated(piece, "z", float(rng.uniform(-0.04, 0.04))))
    return fitted({"cloth_0": merged(*pieces[0]), "cloth_1": merged(*pieces[1])}, size_m)


def _heap(rng: np.random.Generator, size_m: Size, share: float) -> Mesh:
    """Return cloth in folds over a low dome, ``share`` times as wide as the whole heap."""
    depth, width, height = size_m
    u, v = np.meshgrid(np.linspace(0.0, 1.0, 15), np.linspace(0.0, 2.0 * math.pi, 41), indexing="ij")
    outline, folds = wrinkle_field(rng, 5, 0.25, 0.7), wrinkle_field(rng, 7, 0.5, 1.4)
    x, y = u * np.cos(v), u * np.sin(v)
    edge = 1.0 + 0.2 * np.clip(outline(np.cos(v), np.sin(v)), -1.3, 1.3)
    dome = np.clip(1.0 - u**2, 0.0, 1.0)
    z = height * share * (0.05 + 0.3 * dome + 0.4 * np.clip(0.5 + 0.5 * folds(x, y), 0.0, 1.2) * dome**0.4)
    top = np.dstack([0.5 * share * depth * edge * x, 0.5 * share * width * edge * y, z])
    under = np.dstack([top[..., 0], top[..., 1], np.zeros_like(z)])
    return sheet(top, under)


def build_papers(rng: np.random.Generator, size_m: Size, style: str) -> Parts:
    """Return loose sheets fanned out, or a few magazines with coloured covers on each other."""
    depth, width, height = size_m
    count, turn = {"sheets": (6, 0.2), "magazines": (3, 0.2)}[style]
    pages: list[Mesh] = []
    covers: list[Mesh] = []
    thick = height / count
    for k in range(count):
        half_d, half_w = 0.43 * depth, 0.43 * width
        angle = float(rng.uniform(-turn, turn)) if k else 0.0
        low, high = k * thick, (k + 1) * thick - 0.2 * thick
        if style == "sheets":
            pages.append(rotated(block((-half_d, -half_w, low), (half_d, half_w, high), 0.0), "z", angle))
            continue
        skin = min(_SHEET_M, 0.2 * thick)
        pages.append(
            rotated(block((-half_d + 0.002, -half_w + 0.002, low + skin), (half_d - 0.002, half_w - 0.002, high - skin), 0.0), "z", angle)
        )
        both = blocks(
            [(-half_d, -half_w, low), (-half_d, -half_w, high - skin)], [(half_d, half_w, low + skin), (half_d, half_w, high)], 0.0
        )
        covers.append(rotated(both, "z", angle))
    parts = {"pages": merged(*pages)}
    return fitted(parts if style == "sheets" else {**parts, "covers": merged(*covers)}, size_m)


def build_remote_control(rng: np.random.Generator, size_m: Size, style: str) -> Parts:
    """Return a slim remote control with rows of buttons; its far end looks along +x."""
    depth, width, height = size_m
    body = rounded_box((-0.5 * depth, -0.5 * width, 0.0), (0.5 * depth, 0.5 * width, 0.86 * height), 0.4 * height, 2)
    columns = np.linspace(-0.3, 0.3, 3) * width
    rows = np.linspace(-0.36, 0.36, _BUTTON_ROWS) * depth
    side = min(0.09 * width, 0.04 * depth)
    spots = [(float(x), float(y)) for x in rows for y in columns if rng.random() < 0.85] or [(0.0, 0.0)]
    buttons = blocks([(x - side, y - side, 0.8 * height) for x, y in spots], [(x + side, y + side, height) for x, y in spots], 0.2 * side)
    return fitted({"body": body, "buttons": buttons}, size_m)


MODELS = {
    "shoes": Model(build_shoes, ("pair", "kicked_off")),
    "clothes": Model(build_clothes, ("heap", "folded")),
    "papers": Model(build_papers, ("sheets", "magazines")),
    "remote_control": Model(build_remote_control, ("slim",)),
}
