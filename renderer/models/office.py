"""Things of offices and studies, and screens: filing cabinets, whiteboards, printers, desk lamps, pens, globes, laptops, monitors.

Fronts look along +x.
"""

import itertools
import math

import numpy as np
from numpy.typing import NDArray

import kernel_cache.elementary as el
from renderer.core.arrays import Array
from renderer.geometry.lofts import arc, bent, chain, disc, loft, points, ring
from renderer.geometry.mesh import Mesh
from renderer.geometry.shapes import block, blocks, flat_quads, lathe, make_mesh, merged, moved, rod, rotated, rounded_box, sweep
from renderer.models.cabinets import Front, fronts
from renderer.models.lamps import bulb, globe
from renderer.models.model import Model, Pieces, Size, halved, side_boards
from scene_description.products import dot


def build_filing_cabinet(rng: np.random.Generator, size_m: Size, style: str) -> Pieces:
    """Return a steel cabinet with deep drawers, bar or cup handles and label holders; a wooden one; or one with a tambour front."""
    _, width, height, half_d, half_w = halved(size_m)
    front = half_d - 0.022
    low = 0.03
    body = [block((-half_d, -half_w, low), (front - 0.02, half_w, height - 0.01), 0.003)]
    body += [block((-half_d, -half_w, height - 0.024), (half_d - 0.004, half_w, height), 0.003)]
    body += [block((-half_d + 0.02, -half_w + 0.015, 0.0), (front - 0.04, half_w - 0.015, low + 0.002))]
    count = max(2, round((height - low) / 0.32))
    edges = np.linspace(low + 0.004, height - 0.03, count + 1)
    areas = [Front(-half_w + 0.004, half_w - 0.004, float(a), float(b)) for a, b in itertools.pairwise(edges)]
    grips, cards = [], []
    if style == "tambour":
        edges = np.linspace(low + 0.03, height - 0.05, max(8, round(height / 0.03)) + 1)
        areas = [Front(-half_w + 0.016, half_w - 0.016, float(a), float(b)) for a, b in itertools.pairwise(edges)]
        rails = [(-half_w, low, -half_w + 0.014, height - 0.02), (half_w - 0.014, low, half_w, height - 0.02)]
        rails += [(-half_w, low, half_w, low + 0.028), (-half_w, height - 0.048, half_w, height - 0.02)]
        body += [block((front - 0.021, a, b), (half_d - 0.006, c, d), 0.002) for a, b, c, d in rails]
    for a in areas[len(areas) // 2 : len(areas) // 2 + 1] if style == "tambour" else areas:
        z, half = a.high - 0.07, min(0.075, 0.3 * width)
        if style != "wooden":
            grips.append(block((front - 0.001, -half, z - 0.004), (half_d, half, z + 0.004), 0.002))
            grips.append(block((half_d - 0.005, -half, z - 0.014), (half_d, half, z + 0.004), 0.002))
        else:
            grips += [rod((front - 0.001, s * half, z), (half_d - 0.003, s * half, z), 0.004, segments=8) for s in (-1.0, 1.0)]
            grips.append(rod((half_d - 0.005, -half - 0.01, z), (half_d - 0.005, half + 0.01, z), 0.005, segments=8))
        holder = (min(0.04, 0.16 * width), z - 0.045)
        frame = [(front - 0.001, -holder[0] - 0.005, holder[1] - 0.019), (front + 0.003, holder[0] + 0.005, holder[1] + 0.019)]
        grips.append(block(frame[0], frame[1], 0.001))
        cards.append(block((front, -holder[0], holder[1] - 0.014), (front + 0.0042, holder[0], holder[1] + 0.014), 0.0005))
    lock = disc("x", (front - 0.002, half_w - 0.035, height - 0.0145), 0.008, 0.04, 12)
    return {"body": body, "drawers": fronts(front, areas), "handles": [*grips, lock], "labels": cards}


def build_whiteboard(rng: np.random.Generator, size_m: Size, style: str) -> Pieces:
    """Return a whiteboard with a diagram on it, pens and eraser on its ledge."""
    depth, _, height, half_d, half_w = halved(size_m)
    face = -half_d + min(0.022, 0.45 * depth)
    low, rim = 0.03, 0.016
    bars = [(-half_w, low, half_w, low + rim), (-half_w, height - rim, half_w, height)]
    bars += [(-half_w, low, -half_w + rim, height), (half_w - rim, low, half_w, height)]
    frame = blocks([(-half_d, a, b) for a, b, _, _ in bars], [(face + 0.006, c, d) for _, _, c, d in bars], 0.004)
    corners = [
        block((-half_d, s * half_w - (0.03 if s > 0 else 0), z), (face + 0.008, s * half_w + (0.03 if s < 0 else 0), z + 0.03), 0.006)
        for s in (-1.0, 1.0)
        for z in (low, height - 0.03)
    ]
    board = block((-half_d + 0.001, -half_w + 0.5 * rim, low + 0.5 * rim), (face, half_w - 0.5 * rim, height - 0.5 * rim), 0.001)
    ledge_half = rng.uniform(0.25, 0.6) * half_w
    ledge = merged(
        block((-half_d, -ledge_half, 0.0), (half_d, ledge_half, 0.007), 0.002),
        block((half_d - 0.005, -ledge_half, 0.0), (half_d, ledge_half, 0.016), 0.002),
    )
    foot = block((-half_d, -ledge_half, 0.0), (face, ledge_half, low + 0.003), 0.002)
    thick = min(0.008, 0.2 * depth)
    reach = min(0.12, 0.3 * ledge_half)
    pens = []
    for y in rng.uniform(-0.8, 0.5, 3) * ledge_half:
        x = half_d - 0.006 - thick
        pens.append(rod((x, float(y), 0.007 + thick), (x, float(y) + reach, 0.007 + thick), thick, segments=8))
    wipe = block((face, 0.6 * ledge_half, 0.006), (half_d - 0.006, 0.6 * ledge_half + reach, 0.03), 0.005)
    strokes = _diagram(rng, face, half_w - 0.12, (low + 0.15 * height, height - 0.12 * height))
    return {"frame": [frame, *corners, ledge, foot], "board": board, "marks": strokes, "pens": [*pens, wipe]}


def _diagram(rng: np.random.Generator, x: float, half: float, z: tuple[float, float]) -> Mesh:
    """Boxes joined by lines, a curve over two axes, and lines of writing."""
    thick = 0.0045

    def line(y0: float, z0: float, y1: float, z1: float) -> Mesh:
        return sweep([(x, y0, z0), (x, y1, z1)], thick, 4, 0.4)

    tall = z[1] - z[0]
    meshes = []
    for k in range(3):
        y, zc, w, h = -half + (0.15 + 0.27 * k) * half, z[0] + rng.uniform(0.55, 0.85) * tall, 0.09 * half, 0.09 * tall
        corners = [(y - w, zc - h), (y + w, zc - h), (y + w, zc + h), (y - w, zc + h)]
        meshes += [line(*a, *b) for a, b in zip(corners, corners[1:] + corners[:1], strict=True)]
        if k < 2:
            meshes.append(line(y + w, zc, y + 0.18 * half, z[0] + 0.7 * tall))
    meshes += [line(0.0, z[0], 0.0, z[0] + 0.85 * tall), line(0.0, z[0], 0.85 * half, z[0])]
    ys = np.linspace(0.03 * half, 0.8 * half, 16)
    curve = z[0] + tall * (
        0.1 + 0.6 * rng.uniform(0.7, 1.2) * el.power(ys / half, 1.5) + 0.05 * el.sin(9.0 * ys / half + rng.uniform(0, 6))
    )
    meshes.append(sweep(points(x, ys, curve), thick, 4, 0.4))
    for k in range(4):
        zc, y0 = z[0] + (0.34 - 0.1 * k) * tall, -half
        for _ in range(int(rng.integers(2, 5))):
            y1 = y0 + rng.uniform(0.08, 0.22) * half
            meshes.append(line(y0, zc, y1, zc + 0.006))
            y0 = y1 + 0.04 * half
    return merged(*meshes)


def build_printer(rng: np.random.Generator, size_m: Size, style: str) -> Pieces:
    """Return a laser printer with paper cassette and output on top, or an inkjet with scanner lid and front tray."""
    depth, _, height, half_d, half_w = halved(size_m)
    if style == "laser":
        front = half_d - 0.02
        body = [rounded_box((-half_d, -half_w, 0.01), (front, half_w, 0.86 * height), 0.02, 2)]
        body += [rounded_box((-half_d, -half_w, 0.7 * height), (-0.25 * half_d, half_w, height), 0.02, 2)]
        body.append(side_boards(half_w, 0.07, (-half_d + 0.02, front - 0.03), (0.8 * height, 0.9 * height), 0.01))
        dark = [block((front - 0.004, -0.9 * half_w, 0.06 * height), (half_d, 0.9 * half_w, 0.3 * height), 0.006)]
        dark.append(block((front - 0.01, -0.25 * half_w, 0.33 * height), (front + 0.003, 0.25 * half_w, 0.36 * height), 0.001))
        paper = block((-0.2 * half_d, -0.55 * half_w, 0.855 * height), (front - 0.05, 0.55 * half_w, 0.885 * height), 0.001)
        at = (front - 0.06, 0.62 * half_w, 0.9 * height)
    else:
        front = half_d - 0.28 * depth
        body = [rounded_box((-half_d, -half_w, 0.01), (front, half_w, 0.68 * height), 0.018, 2)]
        body += [rounded_box((-half_d + 0.01, -half_w + 0.006, 0.7 * height), (front - 0.006, half_w - 0.006, 0.82 * height), 0.012, 2)]
        dark = [block((front - 0.06, -0.7 * half_w, 0.1 * height), (front + 0.002, 0.7 * half_w, 0.36 * height), 0.004)]
        dark.append(block((front - 0.02, -0.6 * half_w, 0.1 * height), (half_d, 0.6 * half_w, 0.135 * height), 0.004))
        back_tray = rotated(block((-0.006, -0.5 * half_w, 0.0), (0.006, 0.5 * half_w, 0.36 * height), 0.003), "y", -0.2, (0.0, 0.0, 0.0))
        dark.append(moved(back_tray, -half_d + 0.09, 0.0, 0.62 * height))
        paper = block((front - 0.04, -0.45 * half_w, 0.134 * height), (half_d - 0.03, 0.45 * half_w, 0.15 * height), 0.001)
        at = (front - 0.004, 0.55 * half_w, 0.52 * height)
    body.append(block((-half_d + 0.03, -half_w + 0.03, 0.0), (front - 0.03, half_w - 0.03, 0.014)))
    panel = block((at[0] - 0.05, at[1] - 0.05, at[2] - 0.012), (at[0] + 0.01, at[1] + 0.05, at[2] + 0.012), 0.003)
    return {"body": body, "trim": dark, "paper": paper, "screen": panel}


HOOD = np.array(
    [(0.98, 0.0), (1.0, 0.0), (0.8, 0.55), (0.4, 1.05), (0.2, 1.2), (0.18, 1.5), (0.14, 1.5), (0.14, 1.18), (0.36, 1.0), (0.77, 0.53)]
)
"""Outside and inside of a desk lamp's shade, radius and height, in units of its radius."""


def build_desk_lamp(rng: np.random.Generator, size_m: Size, style: str) -> Pieces:
    """Return a lamp that leans over the desk: jointed arms with springs, or one slim bar with a flat head; the part ``shade`` shines."""
    depth, width, height = size_m
    half_d = 0.5 * depth
    r = min(0.5 * width, 0.36 * depth, 0.11)
    foot_x = -half_d + r
    if style == "bar":
        base = lathe([(0.0, 0.0), (r, 0.0), (r, 0.01), (0.94 * r, 0.016), (0.0, 0.016)], 28)
        head_x = (foot_x - 0.03, half_d)
        arm = bent([(foot_x, 0.0, 0.01), (foot_x, 0.0, height - 0.008), (half_d - 0.06, 0.0, height - 0.008)], 0.007, 0.04)
        head = rounded_box((head_x[0] + 0.12 * depth, -0.26 * r, height - 0.018), (head_x[1], 0.26 * r, height), 0.006, 2)
        glow = rounded_box((head_x[0] + 0.16 * depth, -0.2 * r, height - 0.028), (head_x[1] - 0.02, 0.2 * r, height - 0.016), 0.004, 1)
        bulbs = block((head_x[0] + 0.2 * depth, -0.1 * r, height - 0.02), (head_x[1] - 0.04, 0.1 * r, height - 0.014))
        return {"base": moved(base, foot_x), "arm": [arm, head], "shade": glow, "bulb": bulbs}
    base = lathe([(0.0, 0.0), (r, 0.0), (r, 0.012), (0.9 * r, 0.024), (0.2 * r, 0.03), (0.16 * r, 0.05), (0.0, 0.05)], 28)
    hood = 0.75 * r
    elbow = (-half_d + 0.02, 0.0, 0.56 * height)
    wrist = (half_d - 1.5 * hood, 0.0, height - 0.04)
    knee = (foot_x, 0.0, 0.05)
    arms = []
    for a, b in ((knee, elbow), (elbow, wrist)):
        for y in (-0.012, 0.012):
            arms += chain([(a[0], y, a[2]), (b[0], y, b[2])], 0.0045)
        spring = np.array(a) + np.outer((0.12, 0.4), np.subtract(b, a))
        arms.append(sweep(spring, 0.009, 8))
    arms += [disc("y", point, 0.018, 0.036, 16, 0.004) for point in (knee, elbow, wrist)]
    shade = lathe(hood * HOOD, 28, closed=True)
    tilt = rng.uniform(0.15, 0.5)
    at = (wrist[0] + 0.55 * hood, 0.0, wrist[2] - 1.25 * hood)
    lamp = {"shade": shade, "bulb": bulb(0.62 * hood, 0.32 * hood)}
    cap = lathe([(0.0, 1.35 * hood), (0.19 * hood, 1.35 * hood), (0.19 * hood, 1.55 * hood), (0.0, 1.55 * hood)], 14)
    placed = {name: moved(rotated(mesh, "y", -tilt), *at) for name, mesh in (lamp | {"cap": cap}).items()}
    top = at[0] - 1.4 * hood * math.sin(tilt), 0.0, at[2] + 1.4 * hood * math.cos(tilt)
    arms += [placed.pop("cap"), sweep([wrist, top], 0.006, 8)]
    return {"base": moved(base, foot_x), "arm": arms, **placed}


def build_globe(rng: np.random.Generator, size_m: Size, style: str) -> Pieces:
    """Return a terrestrial globe, tilted in its meridian, on a turned foot; land is drawn as patches on the sea."""
    depth, width, height = size_m
    r = min(0.46 * min(depth, width), 0.4 * height)
    z, tilt = height - 1.08 * r, 0.41
    sea = globe(r, 0.0, 1.0, 10)
    meridian = sweep(arc((0.0, 0.0, 0.0), 1.06 * r, 0.5 * math.pi, 1.5 * math.pi, "xz", 13), 0.03 * r, 6, 0.6)
    pins = [rod((0.0, 0.0, s * 0.98 * r), (0.0, 0.0, s * 1.09 * r), 0.025 * r, segments=8) for s in (-1.0, 1.0)]
    land = _continents(rng, r)
    turned = [rotated(mesh, "y", tilt) for mesh in (merged(meridian, *pins), sea, land)]
    low = z - 1.05 * r
    foot = [(0.0, 0.0), (0.6 * r, 0.0), (0.6 * r, 0.02 * height), (0.45 * r, 0.06 * height), (0.12 * r, 0.09 * height)]
    neck = [(0.09 * r, 0.5 * low + 0.05 * height), (0.12 * r, low), (0.0, low)]
    stand = lathe([*foot, *neck], 24)
    arm, sphere, patches = (moved(mesh, z=z) for mesh in turned)
    return {"stand": stand, "arm": [arm, ring("z", (0, 0, low), 0.1 * r, 0.02 * r, 16, 6)], "sea": sphere, "land": patches}


def _continents(rng: np.random.Generator, r: float) -> Mesh:
    """Six blobs of land with ragged coasts: (longitude, latitude, half width, half height) in degrees, roughly as on the Earth."""
    places = ((-100, 46, 30, 20), (-60, -18, 17, 30), (18, 4, 20, 32), (15, 52, 17, 12), (90, 50, 48, 22), (134, -26, 18, 12))
    spin = rng.uniform(0.0, 2.0 * math.pi)
    meshes = []
    for lon, lat, wide, tall in places:
        angle = np.arange(16) * (2.0 * math.pi / 16)
        coast = 1.0 + sum(rng.uniform(0.05, 0.16) * el.sin(k * angle + rng.uniform(0, 6)) for k in (2, 3, 5, 7))
        rows = []
        for share in (1.0, 0.6, 0.2):
            phi = np.radians(lat + share * coast * tall * el.sin(angle))
            lam = spin + np.radians(lon + share * coast * wide * el.cos(angle))
            rows.append(np.column_stack([el.cos(phi) * el.cos(lam), el.cos(phi) * el.sin(lam), el.sin(phi)]))
        meshes.append(_patch(rows, r))
    return merged(*meshes)


def _patch(rows: list[Array], r: float) -> Mesh:
    """A thin plate over rings of directions, from its coast inward."""
    skirt = rows[0] * (0.98 * r)
    body = loft([skirt, *(row * (1.025 * r) for row in rows)])
    outward = body.vertices / np.linalg.norm(body.vertices, axis=1, keepdims=True)
    return make_mesh(body.vertices, np.where(dot(outward, body.normals)[:, None] > 0.5, outward, body.normals), body.faces)


def build_laptop(rng: np.random.Generator, size_m: Size, style: str) -> Pieces:
    """Return an open laptop; its keyboard lies on the +x side of the hinge."""
    depth, _, height, half_d, half_w = halved(size_m)
    thick = 0.016 if style == "slim" else 0.024
    hinge = -half_d + 0.28 * min(depth, height)
    angle = math.radians(90.0) + math.atan2(hinge + half_d, height)
    base = rounded_box((hinge, -half_w, 0.0), (half_d, half_w, thick), 0.35 * thick, 2)
    reach = math.hypot(height - 0.7 * thick, hinge + half_d)
    lid = rounded_box((0.0, -half_w, 0.0), (reach, half_w, 0.4 * thick), 0.18 * thick, 2)
    rim = 0.012 if style == "slim" else 0.02
    screen = block((rim * 1.6, -half_w + rim, -0.0005), (reach - rim, half_w - rim, 0.001), 0.0003)
    hinge_z = 0.7 * thick
    lid, screen = (moved(rotated(mesh, "y", -angle), x=hinge + 0.004, z=hinge_z) for mesh in (lid, screen))
    deep = half_d - hinge
    keys = _key_grid((hinge + 0.12 * deep, hinge + 0.58 * deep), 0.9 * half_w, thick - 0.001, 0.0018, 14, 5)
    pad = block((hinge + 0.63 * deep, -0.28 * half_w, thick - 0.001), (hinge + 0.94 * deep, 0.28 * half_w, thick + 0.0006), 0.0003)
    return {"base": [base, pad], "keyboard": keys, "lid": lid, "screen": screen}


def _key_grid(x: tuple[float, float], half_w: float, z: float, travel: float, columns: int, rows: int) -> Mesh:
    """Return rows of keys between two x, the front row with a wide one in its middle; ``columns`` keys to a row."""
    low, high, beside = [], [], min(3, columns // 4)
    xs = np.linspace(x[0], x[1], rows + 1)
    for r in range(rows):
        edges = np.linspace(-half_w, half_w, columns + 1)
        if r == rows - 1:
            edges = np.concatenate([edges[: beside + 1], edges[columns - beside :]])
        for a, b in itertools.pairwise(edges):
            gap = min(0.0016, 0.12 * (xs[1] - xs[0]))
            low.append((xs[r] + gap, a + gap, z))
            high.append((xs[r + 1] - gap, b - gap, z + travel))
    return keycaps(np.asarray(low), np.asarray(high))


def keycaps(low: NDArray[np.float64], high: NDArray[np.float64], taper_m: float = 0.0012) -> Mesh:
    """Return boxes (n, 3) whose tops are ``taper_m`` smaller on each side than their feet, 12 triangles each."""
    taper = np.minimum(taper_m, 0.12 * (high - low)[:, :2].min(axis=1))[:, None]
    rings = []
    for z, inset in ((low[:, 2:], 0.0 * taper), (high[:, 2:], taper)):
        x0, y0, x1, y1 = low[:, :1] + inset, low[:, 1:2] + inset, high[:, :1] - inset, high[:, 1:2] - inset
        rings.append([np.hstack([x, y, z]) for x, y in ((x0, y0), (x1, y0), (x1, y1), (x0, y1))])
    foot, top = rings
    sides = [[foot[k], foot[(k + 1) % 4], top[(k + 1) % 4], top[k]] for k in range(4)]
    quads = np.asarray([*sides, top, foot[::-1]])
    return flat_quads(quads.transpose(0, 2, 1, 3).reshape(-1, 4, 3))


def build_keyboard(rng: np.random.Generator, size_m: Size, style: str) -> Pieces:
    """Return a keyboard whose space bar lies on the +x side; ``full`` has a number pad."""
    depth, width, height, half_d, half_w = halved(size_m)
    case_top = 0.62 * height
    case = rounded_box((-half_d, -half_w, 0.0), (half_d, half_w, case_top), 0.35 * case_top, 2)
    x = (-half_d + 0.07 * depth, half_d - 0.07 * depth)
    rim = 0.02 * width
    if style == "full":
        split = half_w - rim - 0.2 * width
        left = _key_grid(x, 0.5 * (split + half_w - rim) - 0.004, case_top - 0.001, height - case_top + 0.001, 15, 5)
        left = moved(left, y=0.5 * (split - half_w + rim) - 0.004)
        pad = moved(_key_grid(x, 0.095 * width, case_top - 0.001, height - case_top + 0.001, 4, 4), y=half_w - rim - 0.097 * width)
        keys = merged(left, pad)
    else:
        keys = _key_grid(x, half_w - rim, case_top - 0.001, height - case_top + 0.001, 15, 5)
    return {"case": case, "keys": keys}


def build_monitor(rng: np.random.Generator, size_m: Size, style: str) -> Pieces:
    """Return a computer screen on a foot plate, or on a V-shaped foot."""
    _, width, height, half_d, half_w = halved(size_m)
    low = height * rng.uniform(0.2, 0.27)
    x = 0.02
    frame = merged(
        rounded_box((x - 0.025, -half_w, low), (x, half_w, height), 0.006),
        rounded_box((x - 0.05, -0.45 * half_w, low + 0.2 * (height - low)), (x - 0.02, 0.45 * half_w, low + 0.75 * (height - low)), 0.015),
    )
    rim = 0.009
    screen = block((x - 0.004, -half_w + rim, low + 1.8 * rim), (x + 0.0006, half_w - rim, height - rim), 0.0004)
    neck = block((x - 0.075, -0.03, 0.01), (x - 0.045, 0.03, low + 0.45 * (height - low)), 0.006)
    if style == "plate":
        foot = rounded_box((-half_d, -0.24 * width, 0.0), (half_d, 0.24 * width, 0.012), 0.005)
    else:
        feet = [rod((x - 0.06, 0.0, 0.014), (half_d - 0.012, s * 0.27 * width, 0.009), 0.014, 0.009) for s in (-1.0, 1.0)]
        foot = merged(*feet, block((-half_d, -0.035, 0.0), (x - 0.04, 0.035, 0.014), 0.004))
    return {"stand": [neck, foot], "frame": frame, "screen": screen}


def build_television(rng: np.random.Generator, size_m: Size, style: str) -> Pieces:
    """Return a television on two feet or on a central plate."""
    depth, width, height, half_d, half_w = halved(size_m)
    low = 0.09 * height
    thin = min(0.035, 0.4 * depth)
    frame = merged(
        rounded_box((-0.5 * thin, -half_w, low), (0.5 * thin, half_w, height), 0.006),
        rounded_box((-0.5 * thin - 0.03, -0.7 * half_w, low + 0.01), (-0.4 * thin, 0.7 * half_w, low + 0.55 * (height - low)), 0.015),
    )
    rim = 0.011
    screen = block((0.5 * thin - 0.004, -half_w + rim, low + 1.8 * rim), (0.5 * thin + 0.0008, half_w - rim, height - rim), 0.0005)
    if style == "feet":
        stand = []
        for s in (-1.0, 1.0):
            y = s * 0.72 * half_w
            stand += [rod((0.0, y, low + 0.02), (sx * (half_d - 0.008), y + s * 0.02, 0.008), 0.009, 0.008) for sx in (-1.0, 1.0)]
        foot = merged(*stand)
    else:
        wide = rng.uniform(0.2, 0.3) * width
        foot = merged(
            rounded_box((-half_d, -wide, 0.0), (half_d, wide, 0.014), 0.006), block((-0.02, -0.07, 0.01), (0.01, 0.07, low + 0.03), 0.005)
        )
    return {"stand": foot, "frame": frame, "screen": screen}


MODELS = {
    "filing_cabinet": Model(build_filing_cabinet, ("steel", "wooden", "tambour")),
    "whiteboard": Model(build_whiteboard, ("framed",)),
    "printer": Model(build_printer, ("laser", "inkjet")),
    "desk_lamp": Model(build_desk_lamp, ("jointed", "bar")),
    "globe": Model(build_globe, ("globe",)),
    "laptop": Model(build_laptop, ("slim", "classic")),
    "keyboard": Model(build_keyboard, ("full", "compact")),
    "monitor": Model(build_monitor, ("plate", "vee")),
    "television": Model(build_television, ("feet", "plate")),
}
