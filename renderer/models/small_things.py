"""Small things: speakers, photo frames, clocks; fronts look along +x."""

import math

import numpy as np
from numpy.typing import ArrayLike

from renderer.geometry.lofts import points
from renderer.geometry.mesh import Mesh
from renderer.geometry.shapes import block, flat_quads, lathe, merged, moved, rod, rotated, rounded_box, slab
from renderer.models.model import Model, Parts, Pieces, Size, halved
from renderer.models.wall_things import molding


def upright(outline: ArrayLike, x0: float, x1: float) -> Mesh:
    """Return the plate from x0 to x1 over an outline (n, 2) of (y, z), counter-clockwise seen from +x."""
    points = np.asarray(outline, np.float64)
    return rotated(slab(np.column_stack([-points[:, 1], points[:, 0]]), x0, x1), "y", 0.5 * math.pi)


def turned_forward(profile: ArrayLike, y: float, z: float, segments: int = 20) -> Mesh:
    """Return a body turned about an axis along x through (y, z); the profile's heights are x."""
    return moved(rotated(lathe(profile, segments), "y", 0.5 * math.pi), y=y, z=z)


def build_speaker(rng: np.random.Generator, size_m: Size, style: str) -> Pieces:
    """Return a loudspeaker with visible cones, or with a cloth over its front; tall boxes have more cones."""
    _, width, height, half_d, half_w = halved(size_m)
    front = half_d - 0.012
    body = rounded_box((-half_d, -half_w, 0.0), (front, half_w, height), 0.006, 1)
    plate = rounded_box((front - 0.002, -0.92 * half_w, 0.02 * height), (front + 0.006, 0.92 * half_w, 0.98 * height), 0.003, 1)
    if style == "cloth":
        panel = rounded_box((front - 0.002, -0.94 * half_w, 0.03 * height), (half_d, 0.94 * half_w, 0.97 * height), 0.009, 3)
        badge = block(
            (half_d - 0.001, -0.16 * half_w, 0.06 * height), (half_d + 0.001, 0.16 * half_w, 0.06 * height + 0.1 * half_w), 0.0005
        )
        return {"body": body, "front": panel, "trim": badge}
    big = 0.74 * half_w
    count = max(1, min(3, round((height - 1.3 * width) / (2.2 * big))))
    cones, rims = [], []
    spots = [(0.05 * height + big * (1.1 + 2.1 * k), big) for k in range(count)]
    spots.append((min(spots[-1][0] + 1.75 * big, height - 0.55 * big), 0.42 * big))
    rise = max(0.0, height - 0.05 * height - spots[-1][0] - 0.6 * big)
    for low, r in spots:
        z = low + rise
        bowl = [(0.0, front), (0.82 * r, front), (0.8 * r, front + 0.009), (0.35 * r, front + 0.0065), (0.3 * r, front + 0.009)]
        cones.append(turned_forward([*bowl, (0.15 * r, front + 0.011), (0.0, front + 0.0115)], 0.0, z))
        ring = [(0.82 * r, front + 0.003), (r, front + 0.003), (r, front + 0.009), (0.9 * r, front + 0.012), (0.82 * r, front + 0.01)]
        rims.append(moved(rotated(lathe(ring, 20, closed=True), "y", 0.5 * math.pi), z=z))
    return {"body": [body, plate], "front": cones, "trim": rims}


def build_photo_frame(rng: np.random.Generator, size_m: Size, style: str) -> Pieces:
    """Return a standing frame that leans back on a strut, with a print within a mat."""
    del rng, style
    depth, width, height = size_m
    thick = min(0.016, 0.2 * depth)
    lean = math.atan2(0.5 * depth, height)
    tall = height / math.cos(lean)
    rim = 0.11 * min(width, height)
    x0, x1 = 0.0, thick
    profile = [(x0, 0.0), (0.7 * thick, 0.0), (x1, 0.3), (x1, 0.6), (0.5 * thick, 1.0), (x0, 1.0)]
    face = 0.4 * thick
    mat = block((0.001, -0.5 * width + 0.8 * rim, 0.8 * rim), (face, 0.5 * width - 0.8 * rim, tall - 0.8 * rim), 0.0003)
    border = rim + 0.09 * min(width, tall)
    half, low, high = 0.5 * width - border, border, tall - border
    area = np.array([(-half, low), (half, low), (half, high), (-half, high)])
    canvas = upright(area, face - 0.001, face + 0.0006)
    parts: Parts = {"frame": molding(width, tall, rim, profile), "mat": mat, "canvas": canvas}
    tilted = {name: rotated(mesh, "y", -lean) for name, mesh in parts.items()}
    strut = rod((-math.sin(lean) * 0.7 * tall, 0.0, 0.7 * height), (-depth + 1.2 * thick, 0.0, 0.004), 0.004, segments=6)
    tilted["frame"] = merged(tilted["frame"], strut)
    return tilted


def build_wall_clock(rng: np.random.Generator, size_m: Size, style: str) -> Pieces:
    """Return a clock for the wall with marks and hands: a round case, or rays round a small one."""
    depth, width, height = size_m
    x0, x1 = -0.5 * depth, 0.5 * depth
    r = 0.5 * min(width, height)
    case = r if style == "round" else 0.56 * r
    z = 0.5 * height
    ring = [(0.9 * case, x0), (case, x0), (case, x1 - 0.15 * depth), (0.97 * case, x1), (0.91 * case, x1), (0.9 * case, x1 - 0.5 * depth)]
    body = [moved(rotated(lathe(ring, 48, closed=True), "y", 0.5 * math.pi), z=z)]
    if style == "rays":
        for k in range(24):
            a = 2.0 * math.pi * k / 24
            reach = r * (1.0 if k % 2 == 0 else 0.82)
            c, s = math.cos(a), math.sin(a)
            body.append(rod((0.0, 0.95 * case * c, z + 0.95 * case * s), (0.0, reach * c, z + reach * s), 0.012 * r, 0.02 * r, 6))
    face_x = x1 - 0.55 * depth
    face = turned_forward([(0.0, x0 + 0.001), (0.92 * case, x0 + 0.001), (0.92 * case, face_x), (0.0, face_x)], 0.0, z, 40)
    hour = rng.uniform(0.0, 2.0 * math.pi)
    marks = [_pointer(face_x, z, math.pi * k / 6, (0.74 if k % 3 else 0.68) * case, 0.84 * case, 0.02 * case) for k in range(12)]
    hands = [_pointer(face_x + 0.06 * depth, z, hour, -0.1 * case, 0.48 * case, 0.03 * case)]
    hands.append(_pointer(face_x + 0.12 * depth, z, 12.0 * hour, -0.14 * case, 0.74 * case, 0.02 * case))
    pin = turned_forward([(0.0, face_x), (0.06 * case, face_x), (0.05 * case, x1 - 0.25 * depth), (0.0, x1 - 0.25 * depth)], 0.0, z, 12)
    return {"body": body, "face": face, "hands": [*marks, *hands, pin]}


def _pointer(x: float, z: float, angle: float, start: float, reach: float, half: float) -> Mesh:
    """Return a flat tapering bar on a dial that points ``angle`` from the top towards +y."""
    tip = 0.5 * half
    thick = 0.002
    loop = np.array([(-half, start), (half, start), (tip, reach), (-tip, reach)])
    front = points(x + thick, loop)
    behind = points(x - 0.0005, loop)
    sides = [[behind[k], behind[(k + 1) % 4], front[(k + 1) % 4], front[k]] for k in range(4)]
    return moved(rotated(flat_quads(np.asarray([*sides, front, behind[::-1]])), "x", -angle), z=z)


MODELS = {
    "speaker": Model(build_speaker, ("cones", "cloth")),
    "photo_frame": Model(build_photo_frame, ("print",)),
    "wall_clock": Model(build_wall_clock, ("round", "rays")),
}
