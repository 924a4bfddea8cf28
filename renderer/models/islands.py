"""Islands and peninsulas of fitted kitchens: base units whose worktop reaches out behind them; and low stools."""

from __future__ import annotations

import itertools
import math

import numpy as np

from renderer.geometry.mesh import Mesh
from renderer.geometry.shapes import block, blocks, lathe, merged, moved, rod, rotated, rounded_box
from renderer.models.cabinets import Front, fronts
from renderer.models.fitted_kitchen import corner_unit
from renderer.models.kitchen import WORKTOP_M, base_unit, columns
from renderer.models.model import Model, Parts, Size, fitted

_REACH_M = 0.3
_PANEL_M = 0.02
_SLAT_M, _GROOVE_M = 0.045, 0.008


def build_island_counter(rng: np.random.Generator, size_m: Size, style: str) -> Parts:
    """Return a base unit that stands free: a clad back, and a worktop that reaches out behind it on brackets.

    The back has frames (framed fronts), upright slats (flat ones) or plain panels, down to the floor.
    """
    depth, width, height = size_m
    back = min(_REACH_M, 0.4 * depth) + _PANEL_M - 0.5 * depth
    under, half = height - WORKTOP_M, 0.5 * width
    unit = base_unit(rng, (0.5 * depth - back, width, height), height, style, only_doors=False)
    parts = {name: moved(mesh, 0.5 * (back + 0.5 * depth)) for name, mesh in unit.items()}
    parts["panel"] = moved(rotated(_cladding(width, under, style), "z", math.pi), back)
    reach = back + 0.5 * depth - _PANEL_M
    parts["brackets"] = merged(*(_bracket(back - _PANEL_M, y, under, 0.75 * reach) for y in (-half + 0.14, half - 0.14)))
    parts["worktop"] = block((-0.5 * depth, -half, under), (0.5 * depth, half, height), 0.002)
    return fitted(parts, size_m)


def build_peninsula_corner(rng: np.random.Generator, size_m: Size, style: str) -> Parts:
    """Return a closed corner unit with its back at a wall and its right side, clad, to the room."""
    half = 0.5 * size_m[1]
    side = rotated(_cladding(size_m[0], size_m[2] - WORKTOP_M, style), "z", -0.5 * math.pi)
    return fitted({**corner_unit(size_m, style, clad_m=_PANEL_M), "panel": moved(side, 0.0, _PANEL_M - half)}, size_m)


def _cladding(width: float, high: float, style: str) -> Mesh:
    """Return the cladding of a back, from x = 0 towards +x."""
    edges = columns(width, 0.6)
    if style == "framed":
        return fronts(_PANEL_M, [Front(a, b, 0.0, high) for a, b in itertools.pairwise(edges)], _PANEL_M, framed=True)
    if style == "flat":
        count = max(2, round(width / _SLAT_M))
        lines = np.linspace(-0.5 * width, 0.5 * width, count + 1)
        sheet = block((0.0, -0.5 * width, 0.0), (0.4 * _PANEL_M, 0.5 * width, high))
        low = [(0.0, float(y), 0.0) for y in lines[:-1]]
        return merged(sheet, blocks(low, [(_PANEL_M, float(y) - _GROOVE_M, high) for y in lines[1:]], 0.002))
    return blocks([(0.0, a, 0.0) for a in edges[:-1]], [(_PANEL_M, b - 0.003, high) for b in edges[1:]], 0.002)


def _bracket(x: float, y: float, z: float, reach: float) -> Mesh:
    """Return a flat steel angle below the worktop, from the wall at ``x`` backwards."""
    flat = block((x - reach, y - 0.025, z - 0.008), (x, y + 0.025, z), 0.001)
    return merged(flat, block((x - 0.008, y - 0.025, z - 0.2), (x, y + 0.025, z), 0.001))


def build_stool(rng: np.random.Generator, size_m: Size, style: str) -> Parts:
    """Return a low stool on four legs with a round, slightly hollow seat, or a square one on an apron."""
    del rng
    depth, width, height = size_m
    half_d, half_w = 0.5 * depth, 0.5 * width
    top = height - 0.03
    if style == "round":
        r = min(half_d, half_w)
        rim = [(0.0, top), (0.9 * r, top), (r, top + 0.008), (r, height - 0.006), (0.95 * r, height)]
        seat, out, inner = lathe([*rim, (0.5 * r, height - 0.005), (0.0, height - 0.007)], 40), 0.9 * r / math.sqrt(2.0), 0.62
        square, thick = (out, out), (0.013, 0.017)
    else:
        seat = rounded_box((-half_d, -half_w, top), (half_d, half_w, height), 0.008)
        square, thick, inner = (half_d - 0.03, half_w - 0.03), (0.014, 0.018), 0.97
    corners = [(sx * square[0], sy * square[1]) for sx, sy in ((-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0))]
    legs = [rod((x, y, 0.0), (inner * x, inner * y, top + 0.004), *thick) for x, y in corners]
    low = 0.3 * height
    at = 1.0 - (1.0 - inner) * low / top
    rails = [
        rod((ax * at, ay * at, low), (bx * at, by * at, low), 0.009)
        for (ax, ay), (bx, by) in zip(corners, corners[1:] + corners[:1], strict=True)
    ]
    if style == "square":
        a, b, z = square[0], square[1], top - 0.045
        rails.append(blocks([(-a, -b - 0.009, z), (-a, b - 0.009, z)], [(a, -b + 0.009, top), (a, b + 0.009, top)], 0.002))
        rails.append(blocks([(-a - 0.009, -b, z), (a - 0.009, -b, z)], [(-a + 0.009, b, top), (a + 0.009, b, top)], 0.002))
    return fitted({"legs": merged(*legs, *rails), "seat": seat}, size_m)


MODELS = {
    "island_counter": Model(build_island_counter, ("flat", "framed", "handleless")),
    "peninsula_corner": Model(build_peninsula_corner, ("flat", "framed", "handleless")),
    "stool": Model(build_stool, ("round", "square")),
}
