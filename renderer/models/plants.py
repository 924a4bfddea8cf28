"""Plants in pots and vases with flowers."""

import math

import numpy as np

import kernel_cache.elementary as el
from renderer.core.arrays import Array
from renderer.geometry.lofts import points
from renderer.geometry.mesh import Mesh
from renderer.geometry.shapes import grid_faces, lathe, make_mesh, merged, moved, rounded_box, sheet, smooth_normals, sweep
from renderer.models.model import Model, Parts, Pieces, Size
from scene_description.products import matmul

_EDGE_WAVE, _EDGE_TURNS = 0.16, 9.0
"""How far a leaf's edges rise and sink in units of half its width, and the radians of their waves along it."""


def leaves(roots: Array, directions: Array, lengths: Array, widths: Array, droop: Array, fold: float = 0.25, steps: int = 6) -> Mesh:
    """Return leaves without thickness that start at ``roots`` (n, 3) along ``directions`` (n, 3) and bend down under their weight.

    ``droop`` (n,) is how far the tip sinks in units of the length; ``fold`` raises the edges above the midrib, and they lie in waves, each
    leaf's and each edge's of its own.
    """
    count = len(roots)
    unit = directions / np.linalg.norm(directions, axis=1, keepdims=True)
    flat = np.cross((0.0, 0.0, 1.0), unit)
    weak = np.linalg.norm(flat, axis=1) < 1e-3
    flat[weak] = (0.0, 1.0, 0.0)
    side = flat / np.linalg.norm(flat, axis=1, keepdims=True)
    t = np.linspace(0.0, 1.0, steps)
    outline = el.sin(math.pi * el.power(np.clip(t, 0.04, 0.985), 0.75))
    across = np.array([-1.0, 0.0, 1.0])
    waves = _EDGE_WAVE * el.sin(_EDGE_TURNS * t[None, :, None] + 2.4 * np.arange(count)[:, None, None] + 1.7 * across)
    middle = roots[:, None] + unit[:, None] * (lengths[:, None] * t)[..., None]
    middle[..., 2] -= droop[:, None] * lengths[:, None] * t**2
    spread = 0.5 * widths[:, None] * outline
    up = np.cross(unit, side)
    grid = (
        middle[:, :, None]
        + side[:, None, None] * (spread[..., None] * across)[..., None]
        + up[:, None, None] * (spread[..., None] * np.abs(across) * (fold + waves))[..., None]
    )
    points = grid.reshape(-1, 3)
    faces = (grid_faces(steps, 3)[None] + (3 * steps * np.arange(count))[:, None, None]).reshape(-1, 3)
    return make_mesh(points, smooth_normals(points, faces), faces)


def _pot(rng: np.random.Generator, radius: float, height: float, square: bool) -> tuple[Mesh, Mesh]:
    """Return a pot with rim and hollow, and the soil in it."""
    if square:
        wall = 0.012
        body = rounded_box((-radius, -radius, 0.0), (radius, radius, height), 0.012)
        soil = rounded_box((-radius + wall, -radius + wall, height - 0.01), (radius - wall, radius - wall, height + 0.006), 0.005)
        return body, soil
    base = rng.uniform(0.62, 0.8)
    rim = 0.014 if rng.random() < 0.6 else 0.0
    profile = points(
        [0.0, base * radius, (0.15 + 0.85 * base) * radius, radius - rim, radius, radius, 0.9 * radius, 0.86 * radius, 0.0],
        [0.0, 0.0, 0.012, 0.84 * height, 0.85 * height, height, height, 0.88 * height, 0.87 * height],
    )
    filling = points(
        [0.0, 0.875 * radius, 0.875 * radius, 0.5 * radius, 0.0], [0.8 * height, 0.8 * height, 0.9 * height, 0.925 * height, 0.93 * height]
    )
    return lathe(profile, 32), lathe(filling, 20)


def build_potted_plant(rng: np.random.Generator, size_m: Size, style: str) -> Pieces:
    """Return a ficus, a palm of arching fronds, upright snake-plant blades, or large leaves on long stalks in a pot."""
    depth, width, height = size_m
    spread = 0.5 * min(depth, width)
    pot_height = min(0.26 * height, 0.32)
    pot_radius = min((0.58 if style == "snake" else 0.46) * spread, 0.62 * pot_height + 0.02)
    pot, soil = _pot(rng, pot_radius, pot_height, square=style == "snake" and bool(rng.random() < 0.4))
    grown = {"ficus": _ficus, "palm": _palm, "snake": _snake, "stalks": _stalks}[style](rng, spread, pot_radius, 0.88 * pot_height, height)
    return {"pot": pot, "soil": soil} | grown


def _ficus(rng: np.random.Generator, spread: float, pot_radius: float, low: float, height: float) -> Parts:
    del pot_radius
    stems, roots, directions = [], [], []
    for k in range(3):
        angle = 2.0 * math.pi * (k + rng.uniform(-0.2, 0.2)) / 3
        lean = spread * rng.uniform(0.25, 0.5)
        top = height * rng.uniform(0.80, 0.95)
        t = np.linspace(0.0, 1.0, 8)
        wobble = 0.04 * spread * el.sin(7.0 * t + rng.uniform(0, 6))
        path = np.column_stack(
            [lean * el.power(t, 1.4) * math.cos(angle) + wobble, lean * el.power(t, 1.4) * math.sin(angle) - wobble, low + (top - low) * t]
        )
        stems.append(sweep(path, np.linspace(0.012, 0.004, 8) * min(1.0, height), 8))
        count = 26
        place = el.power(rng.uniform(0.32, 1.0, count), 0.8)
        around = np.arange(count) * 2.39996 + rng.uniform(0, 6)
        roots.append(np.column_stack([np.interp(place, t, path[:, i]) for i in range(3)]))
        directions.append(np.column_stack([el.cos(around), el.sin(around), rng.uniform(0.1, 0.9, count)]))
    root, direction = np.concatenate(roots), np.concatenate(directions)
    length = np.minimum(rng.uniform(0.5, 0.85, len(root)) * spread, 0.26 * height)
    return {
        "stem": merged(*stems),
        "leaves": leaves(root, direction, length, length * rng.uniform(0.42, 0.58, len(root)), rng.uniform(0.2, 0.7, len(root))),
    }


def _palm(rng: np.random.Generator, spread: float, pot_radius: float, low: float, height: float) -> Parts:
    del pot_radius
    stems, roots, directions, lengths = [], [], [], []
    fronds = 13
    for k in range(fronds):
        angle = 2.39996 * k + rng.uniform(-0.2, 0.2)
        outward = spread * (0.35, 0.7, 0.88)[k % 3] * rng.uniform(0.85, 1.0)
        top = height * (1.0, 0.84, 0.68)[k % 3] * rng.uniform(0.9, 0.99)
        t = np.linspace(0.0, 1.0, 12)
        reach, rise = outward * el.power(t, 1.6), low + (top - low) * el.power(el.sin(0.5 * math.pi * t * (1.1, 1.25, 1.38)[k % 3]), 0.9)
        path = np.column_stack([reach * math.cos(angle), reach * math.sin(angle), rise])
        stems.append(sweep(path, np.linspace(0.007, 0.0018, 12), 6))
        along = np.gradient(path, axis=0)
        along /= np.linalg.norm(along, axis=1, keepdims=True)
        lateral = np.array([-math.sin(angle), math.cos(angle), 0.0])
        place = np.linspace(0.36, 0.99, 10)
        for s in (-1.0, 1.0):
            base = np.column_stack([np.interp(place, t, path[:, i]) for i in range(3)])
            forward = np.column_stack([np.interp(place, t, along[:, i]) for i in range(3)])
            roots.append(base)
            directions.append(s * lateral + 0.75 * forward + (0.0, 0.0, 0.15))
            lengths.append(0.40 * spread * (1.0 - 0.6 * ((place - 0.36) / 0.63) ** 2))
    root, direction, length = np.concatenate(roots), np.concatenate(directions), np.concatenate(lengths)
    return {
        "stem": merged(*stems),
        "leaves": leaves(root, direction, length, np.full(len(root), 0.085 * spread + 0.008), rng.uniform(0.2, 0.45, len(root)), 0.3, 4),
    }


def _stalks(rng: np.random.Generator, spread: float, pot_radius: float, low: float, height: float) -> Parts:
    """Return stalks that rise from the middle of the pot and bend outward, each with one large hanging leaf."""
    stems, roots, directions, lengths = [], [], [], []
    count = 25
    for k in range(count):
        angle, share = 2.39996 * k + rng.uniform(-0.25, 0.25), (k + 0.5) / count
        length = min(rng.uniform(0.5, 0.8) * spread, 0.3 * (height - low))
        outward = max(spread * (0.3 + 0.66 * el.power(share, 0.8)) - 0.5 * length, 0.12 * spread)
        top = low + (height - low) * (1.0 - 0.68 * el.power(share, 1.1)) * rng.uniform(0.9, 0.98)
        t = np.linspace(0.0, 1.0, 8)
        reach = 0.2 * pot_radius + (outward - 0.2 * pot_radius) * el.power(t, 1.15)
        rise = low + (top - low) * el.power(el.sin(0.5 * math.pi * t), 0.85)
        path = np.column_stack([reach * math.cos(angle), reach * math.sin(angle), rise])
        stems.append(sweep(path, np.linspace(0.0065, 0.003, 8) * min(1.0, 0.4 + height), 6))
        roots.append(path[-1])
        directions.append((math.cos(angle), math.sin(angle), rng.uniform(-0.15, 0.35)))
        lengths.append(length)
    long = np.array(lengths)
    wide = long * rng.uniform(0.5, 0.7, count)
    return {
        "stem": merged(*stems),
        "leaves": leaves(np.array(roots), np.array(directions), long, wide, rng.uniform(0.25, 0.8, count), 0.25, 10),
    }


def _snake(rng: np.random.Generator, spread: float, pot_radius: float, low: float, height: float) -> Parts:
    blades: list[Mesh] = []
    for k in range(13):
        angle, ring = 2.39996 * k, pot_radius * 0.62 * math.sqrt((k + 0.5) / 13)
        tall = (height - low) * (rng.uniform(0.55, 0.9) if k else 1.0)
        lean = (0.25 + 0.75 * k / 13) * (spread - ring) * rng.uniform(0.5, 0.95)
        wide = rng.uniform(0.03, 0.045) * min(1.0, 0.4 + height)
        t = np.linspace(0.0, 1.0, 9)
        twist = angle + 0.5 * math.pi + rng.uniform(-0.5, 0.5) + rng.uniform(-0.7, 0.7) * t
        profile = wide * np.minimum(1.0, 0.75 + 0.6 * t) * np.sqrt(np.clip(1.0 - el.power(t, 5), 0.0004, 1.0))
        center = np.column_stack(
            [(ring + lean * el.power(t, 1.8)) * math.cos(angle), (ring + lean * el.power(t, 1.8)) * math.sin(angle), low + tall * t]
        )
        across = points(el.cos(twist), el.sin(twist), 0.0)
        normal = points(-el.sin(twist), el.cos(twist), 0.0)
        s = np.array([-1.0, -0.5, 0.0, 0.5, 1.0])
        grid = (
            center[:, None]
            + across[:, None] * (profile[:, None] * s)[..., None]
            - normal[:, None] * (0.25 * profile[:, None] * (1.0 - s**2))[..., None]
        )
        thick = normal[:, None] * (0.0015 + 0.003 * (1.0 - s**2))[None, :, None]
        blades.append(
            sheet(grid + thick, grid - thick)
            if matmul(np.cross((0, 0, 1.0), across[0]), normal[0]) > 0
            else sheet(grid - thick, grid + thick)
        )
    return {"leaves": merged(*blades)}


def build_vase(rng: np.random.Generator, size_m: Size, style: str) -> Pieces:
    """Return a turned vase, empty or with a bunch of flowers."""
    depth, width, height = size_m
    r = 0.5 * min(depth, width)
    body_height = height if style == "empty" else 0.48 * height
    radius = r if style == "empty" else min(0.55 * r, 0.45 * body_height)
    belly, neck = rng.uniform(0.3, 0.6), rng.uniform(0.35, 0.6)
    lip = min(1.0, neck * rng.uniform(1.2, 1.5))
    outer = points(
        [0.0, 0.55 * radius, 0.6 * radius, 0.9 * radius, radius, 0.85 * radius, neck * radius, lip * radius],
        [
            0.0,
            0.0,
            0.01 * body_height,
            0.55 * belly * body_height,
            belly * body_height,
            (0.4 + 0.6 * belly) * body_height,
            0.86 * body_height,
            body_height,
        ],
    )
    inner = [
        (0.93 * lip * radius, body_height),
        (0.88 * neck * radius, 0.85 * body_height),
        (0.7 * radius, 0.6 * body_height),
        (0.0, 0.5 * body_height),
    ]
    parts = {"body": lathe([*_rounded(outer), *inner], 18)}
    if style == "empty":
        return parts
    stems, heads, roots, directions = [], [], [], []
    cup = bool(rng.random() < 0.35)
    for k in range(7):
        angle = 2.39996 * k
        out = r * 0.82 * math.sqrt((k + 0.3) / 7)
        top = height * (0.97 - 0.18 * math.pow(k / 7, 1.5)) - 0.02
        t = np.linspace(0.0, 1.0, 6)
        path = np.column_stack(
            [
                out * el.power(t, 1.6) * math.cos(angle),
                out * el.power(t, 1.6) * math.sin(angle),
                0.5 * body_height + (top - 0.5 * body_height) * t,
            ]
        )
        stems.append(sweep(path, 0.0016, 4))
        heads.append(moved(_blossom(rng, 0.16 * r + 0.006, cup), *path[-1]))
        roots.append(path[3])
        directions.append((math.cos(angle + 1.0), math.sin(angle + 1.0), 0.6))
    count = len(roots)
    lengths, widths, droop = (np.full(count, value) for value in (0.45 * r, 0.13 * r, 0.5))
    parts["stems"] = merged(*stems, leaves(np.array(roots), np.array(directions), lengths, widths, droop, steps=4))
    parts["flowers"] = merged(*heads)
    return parts


def _rounded(profile: Array) -> Array:
    """Cut the corners of an open profile once (Chaikin), keeping its ends and its flat foot."""
    a, b = profile[2:-1], profile[3:]
    cut = np.stack([0.75 * a + 0.25 * b, 0.25 * a + 0.75 * b], axis=1).reshape(-1, 2)
    return np.vstack([profile[:3], cut, profile[-1:]])


def _blossom(rng: np.random.Generator, radius: float, cup: bool) -> Mesh:
    """Return a bloom: an open ring of petals about a closed bud, or petals in a cup."""
    petals = int(rng.integers(5, 8))
    if not cup:
        deep, profile = 0.42, [(0.0, -0.3), (1.0, 0.1), (0.42, 0.02), (0.36, 0.36), (0.0, 0.54)]
    else:
        deep, profile = 0.2, [(0.0, -0.5), (0.62, -0.34), (0.85, 0.2), (0.6, 0.75), (0.3, 0.2), (0.0, 0.1)]
    outline = [(radius * r, radius * z) for r, z in profile]
    return lathe(outline, 2 * petals, wave=lambda angle: 1.0 - deep * (0.5 - 0.5 * el.cos(petals * angle)))


MODELS = {"potted_plant": Model(build_potted_plant, ("ficus", "palm", "snake", "stalks")), "vase": Model(build_vase, ("flowers", "empty"))}
