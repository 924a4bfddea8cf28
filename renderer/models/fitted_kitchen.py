"""Units of fitted kitchens that stand in corners, reach up to the ceiling's height, or hide a machine under the worktop."""

from __future__ import annotations

import itertools
import math

import numpy as np

from renderer.geometry.shapes import block, blocks, merged, moved, rotated, rounded_box, slab
from renderer.models.bathroom import build_washing_machine
from renderer.models.cabinets import Front, bar_handle, fronts, knob
from renderer.models.kitchen import GRIP_M, OVERHANG_M, PLINTH_M, WORKTOP_M
from renderer.models.model import Model, Parts, Size, fitted

_WALL_UNIT_DEPTH_M = 0.35
_DOOR_M = 0.019


def build_kitchen_corner(rng: np.random.Generator, size_m: Size, style: str) -> Parts:
    """Return the closed base unit in a corner: its back and its right side at walls, units against its front and its left side."""
    del rng
    return fitted(corner_unit(size_m, style), size_m)


def corner_unit(size_m: Size, style: str, clad_m: float = 0.0) -> Parts:
    """Return body, plinth and worktop of a corner unit, with room for cladding on its right side."""
    half_d, half_w, high = 0.5 * size_m[0], 0.5 * size_m[1], size_m[2] - WORKTOP_M
    low = min(PLINTH_M, 0.13 * size_m[2])
    cut = OVERHANG_M + (0.6 * GRIP_M if style == "handleless" else 0.0)
    right = -half_w + clad_m
    return {
        "body": block((-half_d, right, low), (half_d - cut, half_w - cut, high + 0.001), 0.002),
        "plinth": block((-half_d + 0.02, right + 0.02, 0.0), (half_d - 0.09, half_w - 0.09, low + 0.002), 0.001),
        "worktop": block((-half_d, -half_w, high), (half_d, half_w, size_m[2]), 0.002),
    }


def build_corner_wall_cabinet(rng: np.random.Generator, size_m: Size, style: str) -> Parts:
    """Return a hanging unit with its back and its right side at walls and a door across the corner between its neighbours' fronts."""
    del rng
    depth, width, height = size_m
    half_d, half_w = 0.5 * depth, 0.5 * width
    beside = min(_WALL_UNIT_DEPTH_M - 0.026, 0.7 * min(depth, width))
    outline = [(-half_d, -half_w), (half_d, -half_w), (half_d, -half_w + beside), (-half_d + beside, half_w), (-half_d, half_w)]
    # the door stands on the line between the third and the fourth point
    (ax, ay), (bx, by) = outline[2], outline[3]
    angle, wide = math.atan2(by - ay, bx - ax) - 0.5 * math.pi, math.hypot(bx - ax, by - ay)
    low = GRIP_M if style == "handleless" else 0.004
    door = fronts(_DOOR_M, [Front(-0.5 * wide + 0.014, 0.5 * wide - 0.014, low, height - 0.003)], _DOOR_M, framed=style == "framed")
    if style == "flat":
        pull = bar_handle(_DOOR_M, -0.5 * wide + 0.06, 0.13, 0.16, 0.024, upright=True)
    elif style == "framed":
        pull = knob(_DOOR_M, -0.5 * wide + 0.06, 0.1, 0.024)
    else:
        pull = block((0.0, -0.5 * wide + 0.02, 0.0), (_DOOR_M - 0.006, 0.5 * wide - 0.02, GRIP_M - 0.002), 0.002)
    middle = 0.5 * (ax + bx), 0.5 * (ay + by)
    turned = [moved(rotated(mesh, "z", angle), *middle) for mesh in (door, pull)]
    return fitted({"body": slab(outline, 0.0, height), "fronts": turned[0], "handles": turned[1]}, size_m)


def _tall_fronts(x: float, areas: list[Front], style: str) -> Parts:
    """Return doors one above the other with their handles on the left, or grips along an edge."""
    handles = []
    for area in areas:
        tall = area.high - area.low
        if style == "handleless":
            handles.append(block((x - 0.03, area.left, area.low + 0.002), (x - 0.012, area.left + 0.019, area.high - 0.002), 0.002))
        elif style == "flat":
            length = min(0.4 * tall, 0.5)
            handles.append(bar_handle(x, area.right - 0.05, 0.5 * (area.low + area.high), length, OVERHANG_M - 0.004, upright=True))
        else:
            handles.append(knob(x, area.right - 0.05, 0.5 * (area.low + area.high), OVERHANG_M - 0.004))
    cut = GRIP_M if style == "handleless" else 0.0
    shut = [area._replace(left=area.left + cut) for area in areas]
    return {"fronts": fronts(x, shut, _DOOR_M, framed=style == "framed"), "handles": merged(*handles)}


def _tower(size_m: Size, style: str) -> Parts:
    """Return case and plinth of a tall unit."""
    half_d, half_w, height = 0.5 * size_m[0], 0.5 * size_m[1], size_m[2]
    cut = OVERHANG_M + _DOOR_M + (0.6 * GRIP_M if style == "handleless" else 0.0)
    return {
        "body": block((-half_d, -half_w, PLINTH_M), (half_d - cut, half_w, height), 0.002),
        "plinth": block((-half_d + 0.02, -half_w, 0.0), (half_d - 0.09, half_w, PLINTH_M + 0.002), 0.001),
    }


def build_oven_tower(rng: np.random.Generator, size_m: Size, style: str) -> Parts:
    """Return a tall unit with an oven at the height of the worktop and a smaller one above it, doors below and above these."""
    del rng
    half_w, height, front = 0.5 * size_m[1], size_m[2], 0.5 * size_m[0] - OVERHANG_M
    levels = [PLINTH_M, 0.34 * height, 0.62 * height, 0.8 * height, height - 0.002]
    areas = [Front(-half_w, half_w, levels[0], levels[1]), Front(-half_w, half_w, levels[3], levels[4])]
    ovens, panes, pulls = [], [], []
    for low, high in ((levels[1], levels[2]), (levels[2], levels[3])):
        ovens.append(rounded_box((front - 0.04, -half_w + 0.003, low + 0.003), (front, half_w - 0.003, high - 0.003), 0.004))
        strip = 0.2 * (high - low)
        panes.append(block((front - 0.004, -0.86 * half_w, low + 0.04), (front + 0.002, 0.86 * half_w, high - strip - 0.045), 0.001))
        panes.append(
            block((front - 0.002, -0.25 * half_w, high - 0.75 * strip), (front + 0.001, 0.25 * half_w, high - 0.35 * strip), 0.0005)
        )
        pulls.append(bar_handle(front, 0.0, high - strip - 0.012, 1.5 * half_w, OVERHANG_M - 0.004))
    parts = {**_tower(size_m, style), **_tall_fronts(front, areas, style)}
    return fitted({**parts, "oven": merged(*ovens), "glass": merged(*panes), "bars": merged(*pulls)}, size_m)


def build_larder(rng: np.random.Generator, size_m: Size, style: str) -> Parts:
    """Return a tall unit with a long door below a short one, two of each where it is wide."""
    del rng
    half_w, height, front = 0.5 * size_m[1], size_m[2], 0.5 * size_m[0] - OVERHANG_M
    edges = np.linspace(-half_w, half_w, 3 if size_m[1] > 0.65 else 2)
    split = 0.66 * height
    levels = ((PLINTH_M, split), (split, height - 0.002))
    areas = [Front(float(a), float(b), low, high) for low, high in levels for a, b in itertools.pairwise(edges)]
    return fitted({**_tower(size_m, style), **_tall_fronts(front, areas, style)}, size_m)


def build_built_in_washer(rng: np.random.Generator, size_m: Size, style: str) -> Parts:
    """Return a front loader between two thin sides under a worktop."""
    depth, width, height = size_m
    half_d, half_w, high = 0.5 * depth, 0.5 * width, height - WORKTOP_M
    machine = build_washing_machine(rng, (depth - OVERHANG_M, width - 0.02, high - 0.01), style)
    parts = {name: moved(mesh, -0.5 * OVERHANG_M + 0.01) for name, mesh in machine.items()}
    back, front = -half_d, half_d - 2.0 * OVERHANG_M
    sides = blocks([(back, -half_w, 0.0), (back, half_w - 0.008, 0.0)], [(front, -half_w + 0.008, high), (front, half_w, high)], 0.001)
    worktop = block((-half_d, -half_w, high), (half_d, half_w, height), 0.002)
    return fitted({**parts, "sides": sides, "worktop": worktop}, size_m)


_STYLES = ("flat", "framed", "handleless")

MODELS = {
    "kitchen_corner": Model(build_kitchen_corner, _STYLES),
    "corner_wall_cabinet": Model(build_corner_wall_cabinet, _STYLES),
    "oven_tower": Model(build_oven_tower, _STYLES),
    "larder": Model(build_larder, _STYLES),
    "built_in_washer": Model(build_built_in_washer, ("porthole", "inset")),
}
