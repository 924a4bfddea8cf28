"""Coffee, side, dining and console tables, benches, and desks.

Table tops are 4 cm thick and flat at the table's height; the side of who sits at a desk is +x, where the space for the knees is free.
"""

import itertools

import numpy as np
from numpy.typing import ArrayLike, NDArray

import kernel_cache.elementary as el
from renderer.geometry.lofts import points
from renderer.geometry.mesh import Mesh
from renderer.geometry.shapes import block, blocks, lathe, merged, moved, rod, stretched
from renderer.geometry.upholstery import cushion
from renderer.models.cabinets import Front, bar_handle, fronts, pulls, square_legs
from renderer.models.model import CORNERS, Model, Parts, Pieces, Size, halved, side_boards

TOP_M = 0.04


def soft_body(profile: ArrayLike, half_d: float, half_w: float, power: float, segments: int = 64) -> Mesh:
    """Return a body over a superellipse |x / half_d|^power + |y / half_w|^power = 1 (G. Lame, 1818): a rectangle with bulging sides.

    ``profile`` is as for a turned body, with radii as shares of the outline.
    """

    def wave(angle: NDArray[np.float64]) -> NDArray[np.float64]:
        share = el.power(np.abs(el.cos(angle)), power) + el.power(np.abs(el.sin(angle)), power)
        return np.asarray(el.power(share, -1.0 / power))

    return stretched(lathe(profile, segments, wave=wave), (half_d, half_w, 1.0), (0.0, 0.0, 0.0))


def soft_top(half_d: float, half_w: float, low: float, high: float, power: float = 6.0) -> Mesh:
    """Return a table top over a superellipse, its lower edge drawn in."""
    rim = 0.0025 / min(half_d, half_w)
    under = 0.02 / min(half_d, half_w)
    return soft_body(
        [(0.0, low), (1.0 - under, low), (1.0, low + 0.6 * (high - low)), (1.0, high - 0.0025), (1.0 - rim, high), (0.0, high)],
        half_d,
        half_w,
        power,
    )


def plain_top(half_d: float, half_w: float, low: float, high: float) -> Mesh:
    """Return a rectangular table top."""
    return block((-half_d, -half_w, low), (half_d, half_w, high), 0.003)


def _apron(half_d: float, half_w: float, low: float, high: float, thick: float = 0.02) -> Mesh:
    """Return four boards under the edges of a top."""
    return blocks(
        [(-half_d, -half_w, low), (half_d - thick, -half_w, low), (-half_d, -half_w, low), (-half_d, half_w - thick, low)],
        [(-half_d + thick, half_w, high), (half_d, half_w, high), (half_d, -half_w + thick, high), (half_d, half_w, high)],
        0.002,
    )


def _splayed(half_d: float, half_w: float, height: float, radius: float, splay: float = 0.05) -> Mesh:
    """Return four tapered round legs whose feet stand ``splay`` further out than their heads."""
    return merged(
        *(
            rod((sx * half_d, sy * half_w, 0.0), (sx * (half_d - splay), sy * (half_w - splay), height), 0.6 * radius, radius, 16)
            for sx, sy in CORNERS
        )
    )


def _metal_frame(half_d: float, half_w: float, height: float, bar: float, low_rails: bool = True) -> Mesh:
    """Return four posts with rails under the top, and near the floor between the posts of each end."""
    low, high = [], []
    for y in (-half_w, half_w - bar):
        low += [(x, y, 0.0) for x in (-half_d, half_d - bar)] + [(-half_d, y, height - bar)]
        high += [(x + bar, y + bar, height) for x in (-half_d, half_d - bar)] + [(half_d, y + bar, height)]
        if low_rails:
            low.append((-half_d, y, 0.0))
            high.append((half_d, y + bar, bar))
    low += [(x, -half_w, height - bar) for x in (-half_d, half_d - bar)]
    high += [(x + bar, half_w, height) for x in (-half_d, half_d - bar)]
    return blocks(low, high, 0.002)


def build_coffee_table(rng: np.random.Generator, size_m: Size, style: str) -> Pieces:
    """Return a low table: square legs and a shelf, a soft outline on splayed legs, or a glass plate on a metal frame."""
    depth, width, height = size_m
    half_d, half_w, under = 0.5 * depth, 0.5 * width, height - TOP_M
    if style == "shelf":
        leg = rng.uniform(0.045, 0.065)
        legs = square_legs(-half_d, half_d, half_w, under, leg, 0.004)
        shelf_z = rng.uniform(0.25, 0.4) * under
        shelf = block((-half_d + 0.02, -half_w + 0.02, shelf_z), (half_d - 0.02, half_w - 0.02, shelf_z + 0.02))
        skirt = _apron(half_d - 0.018, half_w - 0.018, under - 0.05, under + 0.002)
        return {"top": plain_top(half_d, half_w, under, height), "legs": [legs, skirt], "shelf": shelf}
    if style == "soft":
        power = rng.uniform(4.8, 6.5)
        legs = _splayed(0.86 * half_d, 0.86 * half_w, under + 0.01, rng.uniform(0.02, 0.028), 0.06)
        brace = merged(
            rod((-0.62 * half_d, -0.62 * half_w, under - 0.02), (0.62 * half_d, 0.62 * half_w, under - 0.02), 0.012),
            rod((0.62 * half_d, -0.62 * half_w, under - 0.02), (-0.62 * half_d, 0.62 * half_w, under - 0.02), 0.012),
        )
        return {"top": soft_top(half_d, half_w, under, height, power), "legs": [legs, brace]}
    plate = block((-half_d, -half_w, height - 0.012), (half_d, half_w, height), 0.003)
    frame = _metal_frame(half_d - 0.015, half_w - 0.02, height - 0.011, rng.uniform(0.022, 0.032))
    return {"top": plate, "legs": frame}


def build_side_table(rng: np.random.Generator, size_m: Size, style: str) -> Pieces:
    """Return a small table: square legs and a shelf, a soft outline on a turned pedestal, or a metal frame open to the front."""
    depth, width, height = size_m
    half_d, half_w, under = 0.5 * depth, 0.5 * width, height - TOP_M
    if style == "square":
        legs = square_legs(-half_d, half_d, half_w, under, 0.035, 0.006)
        z = rng.uniform(0.2, 0.35) * under
        shelf = block((-half_d + 0.015, -half_w + 0.015, z), (half_d - 0.015, half_w - 0.015, z + 0.018))
        skirt = _apron(half_d - 0.014, half_w - 0.014, under - 0.045, under + 0.002)
        return {"top": plain_top(half_d, half_w, under, height), "legs": [legs, skirt, shelf]}
    if style == "pedestal":
        r = 0.7 * min(half_d, half_w)
        neck = rng.uniform(0.018, 0.03)
        foot = [(0.0, 0.0), (r, 0.0), (r, 0.012), (0.9 * r, 0.02), (0.3 * r, 0.035), (1.3 * neck, 0.07), (neck, 0.16 * under)]
        head = [(neck, 0.85 * under), (1.6 * neck, under - 0.03), (3.0 * neck, under + 0.002), (0.0, under + 0.002)]
        return {"top": soft_top(half_d, half_w, under, height, 5.5), "legs": lathe([*foot, *head], 32)}
    bar = 0.02
    legs = merged(
        _metal_frame(half_d - 0.01, half_w - 0.01, under + 0.002, bar),
        block((-half_d + 0.01, -half_w + 0.01, 0.0), (-half_d + 0.03, half_w - 0.01, bar), 0.002),
    )
    return {"top": plain_top(half_d, half_w, under, height), "legs": legs}


def build_dining_table(rng: np.random.Generator, size_m: Size, style: str) -> Pieces:
    """Return a dining table: four square or turned legs with apron, or a soft outline on slanting legs; chairs tuck between the legs."""
    depth, width, height = size_m
    half_d, half_w, under = 0.5 * depth, 0.5 * width, height - TOP_M
    if style == "legs":
        side = rng.uniform(0.055, 0.066)
        legs = square_legs(-half_d, half_d, half_w, under, side, 0.012)
        skirt = _apron(half_d - 0.03, half_w - 0.03, under - 0.08, under + 0.002)
        return {"top": plain_top(half_d, half_w, under, height), "legs": [legs, skirt]}
    if style == "soft":
        legs = _splayed(half_d - 0.022, half_w - 0.022, under + 0.01, rng.uniform(0.024, 0.029), 0.026)
        skirt = _apron(0.72 * half_d, 0.78 * half_w, under - 0.06, under + 0.002)
        return {"top": soft_top(half_d, half_w, under, height, rng.uniform(13.0, 18.0)), "legs": [legs, skirt]}
    spots = [(sx * (half_d - 0.042), sy * (half_w - 0.042)) for sx, sy in CORNERS]
    legs = merged(*(moved(_turned_leg(under + 0.001, rng.uniform(0.032, 0.036)), x, y) for x, y in spots))
    skirt = _apron(half_d - 0.028, half_w - 0.028, under - 0.085, under + 0.002)
    return {"top": plain_top(half_d, half_w, under, height), "legs": [legs, skirt]}


def build_console_table(rng: np.random.Generator, size_m: Size, style: str) -> Pieces:
    """Return a narrow table for the wall: drawers under the top on square legs, or a metal frame with a low shelf."""
    depth, width, height = size_m
    half_d, half_w, under = 0.5 * depth, 0.5 * width, height - TOP_M
    if style == "frame":
        frame = _metal_frame(half_d - 0.006, half_w - 0.006, under + 0.001, 0.024, low_rails=False)
        z = rng.uniform(0.12, 0.25) * under
        shelf = block((-half_d + 0.008, -half_w + 0.008, z), (half_d - 0.008, half_w - 0.008, z + 0.022))
        return {"top": plain_top(half_d, half_w, under, height), "legs": frame, "shelf": shelf}
    reach = min(0.016, 0.05 * depth)
    low = under - min(0.13, 0.2 * height)
    turned = style == "turned"
    front = half_d - reach
    box = blocks(
        [(-half_d + 0.01, -half_w + 0.015, low), (-half_d + 0.01, -half_w + 0.015, low), (-half_d + 0.01, half_w - 0.035, low)],
        [(front - 0.02, half_w - 0.015, low + 0.015), (front, -half_w + 0.035, under + 0.001), (front, half_w - 0.015, under + 0.001)],
        0.002,
    )
    edges = np.linspace(-half_w + 0.036, half_w - 0.036, max(1, round(width / 0.45)) + 1)
    areas = [Front(float(a), float(b), low + 0.004, under - 0.003) for a, b in itertools.pairwise(edges)]
    legs = square_legs(-half_d, half_d - 0.004, half_w, low + 0.01, 0.036, 0.012)
    if turned:
        spots = [(x, s * (half_w - 0.03)) for x in (-half_d + 0.03, half_d - 0.034) for s in (-1.0, 1.0)]
        legs = merged(*(moved(_turned_leg(low + 0.01, 0.019), x, y) for x, y in spots))
    return {
        "top": plain_top(half_d, half_w, under, height),
        "legs": [legs, box],
        "drawers": fronts(front, areas),
        "handles": pulls(front, areas, str(rng.choice(("knob", "bar"))), reach - 0.002),
    }


def _turned_leg(height: float, radius: float) -> Mesh:
    """Return a turned leg on the floor at the origin: foot, tapering shaft between rings, square shoulder."""
    shares = [
        (0.5, 0.0),
        (0.75, 0.03),
        (0.5, 0.07),
        (0.62, 0.1),
        (0.95, 0.52),
        (0.6, 0.58),
        (0.95, 0.63),
        (0.6, 0.68),
        (0.8, 0.75),
        (0.7, 0.82),
    ]
    profile = [(0.0, 0.0), *((radius * r, height * z) for r, z in shares), (0.0, 0.82 * height)]
    return merged(lathe(profile, 14), block((-radius, -radius, 0.8 * height), (radius, radius, height), 0.002))


def build_bench(rng: np.random.Generator, size_m: Size, style: str) -> Pieces:
    """Return a backless bench: planks on slanting legs with a rail, an upholstered pad on a frame, or a panelled chest with a pad."""
    depth, width, height, half_d, half_w = halved(size_m)
    if style == "chest":
        top = height - 0.07
        edges = np.linspace(-half_w + 0.022, half_w - 0.022, max(2, round(width / 0.45)) + 1)
        areas = [Front(float(a), float(b), 0.06, top - 0.022) for a, b in itertools.pairwise(edges)]
        case = blocks(
            [(-half_d + 0.004, -half_w + 0.004, 0.05), (-half_d + 0.02, -half_w + 0.02, 0.0), (-half_d, -half_w, top - 0.022)],
            [(half_d - 0.022, half_w - 0.004, top - 0.02), (half_d - 0.05, half_w - 0.02, 0.051), (half_d, half_w, top)],
            0.003,
        )
        pad = cushion(rng, (-half_d + 0.004, -half_w + 0.004, top), (half_d - 0.004, half_w - 0.004, height), 0.02, 0.008, piping_m=0.004)
        return {"frame": [case, fronts(half_d - 0.006, areas, framed=True)], "seat": pad}
    if style == "padded":
        top = height - 0.09
        pad = cushion(rng, (-half_d, -half_w, top), (half_d, half_w, height), 0.025, 0.01, piping_m=0.004)
        frame = merged(
            _splayed(half_d - 0.01, half_w - 0.04, top + 0.02, 0.022, 0.05), _apron(half_d - 0.05, half_w - 0.06, top - 0.05, top + 0.01)
        )
        return {"frame": frame, "seat": pad}
    count = max(2, round(depth / 0.11))
    edges = np.linspace(-half_d, half_d, count + 1)
    top = height - 0.03
    planks = blocks([(a + 0.004, -half_w, top) for a in edges[:-1]], [(b - 0.004, half_w, height) for b in edges[1:]], 0.006)
    legs = []
    for s in (-1.0, 1.0):
        y = s * (half_w - 0.14)
        legs.append(block((-half_d + 0.02, y - 0.025, top - 0.06), (half_d - 0.02, y + 0.025, top + 0.002)))
        legs += [rod((sx * (half_d - 0.02), y + s * 0.03, 0.0), (sx * (half_d - 0.07), y, top - 0.02), 0.018, 0.026) for sx in (-1.0, 1.0)]
    rail = block((-0.015, -half_w + 0.14, top - 0.05), (0.015, half_w - 0.14, top - 0.01))
    return {"frame": [*legs, rail], "seat": planks}


def build_desk(rng: np.random.Generator, size_m: Size, style: str) -> Pieces:
    """Return a desk on side panels with flat drawers, on four legs with a flat drawer, or a plain top on a metal frame."""
    return {"panels": _paneled, "legs": _legged, "frame": _framed}[style](rng, size_m)


def _paneled(rng: np.random.Generator, size_m: Size) -> Parts:
    """Side panels, a modesty panel at the back and flat drawers below the top."""
    _, _, height, half_d, half_w = halved(size_m)
    thick, side = 0.03, 0.032
    under = height - thick
    inner = half_w - 0.006 - side
    panels = side_boards(half_w - 0.006, side, (-half_d + 0.008, half_d - 0.016), (0.0, under + 0.001), 0.004)
    modesty = block((-half_d + 0.03, -inner - 0.002, under - 0.095), (-half_d + 0.048, inner + 0.002, under))
    divide = block((-half_d + 0.05, -0.009, under - 0.085), (half_d - 0.03, 0.009, under + 0.001))
    front = half_d - 0.02
    areas = [Front(a, b, under - 0.09, under - 0.002) for a, b in ((-inner, -0.001), (0.001, inner))]
    boxes = blocks(
        [(-half_d + 0.05, a.left + 0.012, a.low + 0.006) for a in areas], [(front - 0.01, a.right - 0.012, a.high - 0.01) for a in areas]
    )
    return {
        "top": block((-half_d, -half_w, under), (half_d, half_w, height), 0.004),
        "legs": merged(panels, modesty, divide),
        "drawers": merged(fronts(front, areas, 0.016), boxes),
        "handles": pulls(front, areas, str(rng.choice(("bar", "knob"))), 0.018),
    }


def _legged(rng: np.random.Generator, size_m: Size) -> Parts:
    _, width, height, half_d, half_w = halved(size_m)
    thick, apron = 0.026, 0.10
    under = height - thick
    legs: list[Mesh] = []
    splay = 0.012 if rng.random() < 0.5 else 0.0
    for sx in (-1.0, 1.0):
        for sy in (-1.0, 1.0):
            x, y = sx * (half_d - 0.032 - splay), sy * (half_w - 0.032 - splay)
            legs.append(rod((x + sx * splay, y + sy * splay, 0.0), (x, y, under - 0.01), 0.015, 0.025, 14))
    inner = half_w - 0.067 - splay
    back_edge, front_edge = -half_d + 0.032 + splay, half_d - 0.027 - splay
    rails = blocks(
        [(back_edge, -inner, under - apron), (back_edge, -inner - 0.015, under - apron), (back_edge, inner - 0.01, under - apron)],
        points([back_edge + 0.018, front_edge - 0.02, front_edge - 0.02], [inner, -inner + 0.01, inner + 0.015], under + 0.001),
    )
    count = 1 if width < 1.1 else 2
    edges = np.linspace(-inner + 0.012, inner - 0.012, count + 1)
    areas = [Front(float(a), float(b), under - apron + 0.006, under - 0.004) for a, b in itertools.pairwise(edges)]
    boxes = blocks(
        [(back_edge + 0.02, a.left + 0.01, a.low + 0.008) for a in areas],
        [(front_edge - 0.016, a.right - 0.01, a.high - 0.01) for a in areas],
    )
    return {
        "top": block((-half_d, -half_w, under), (half_d, half_w, height), 0.006),
        "legs": merged(*legs, rails),
        "drawers": merged(fronts(front_edge, areas, 0.018), boxes),
        "handles": pulls(front_edge, areas, "knob", 0.02),
    }


def _framed(rng: np.random.Generator, size_m: Size) -> Parts:
    _, width, height, half_d, half_w = halved(size_m)
    thick = rng.uniform(0.024, 0.036)
    under = height - thick
    bar = 0.02
    inset = 0.026
    low, high = [], []
    for s in (-1.0, 1.0):
        y0, y1 = sorted((s * (half_w - inset), s * (half_w - inset - 2 * bar)))
        for x in (-half_d + inset, half_d - inset - 2 * bar):
            low.append((x, y0, 0.0))
            high.append((x + 2 * bar, y1, under + 0.001))
        for z in (0.0, under - bar):
            low.append((-half_d + inset + bar, y0 + 0.002, z + 0.001))
            high.append((half_d - inset - bar, y1 - 0.002, z + bar))
    low += [(-half_d + inset + 0.002, -half_w + inset, under - 0.045), (-half_d + inset + 0.004, -half_w + inset, under - 0.088)]
    high += [(-half_d + inset + bar, half_w - inset, under), (-half_d + inset + bar, half_w - inset, under - 0.088 + bar)]
    tray_x, tray_half = half_d - 0.05, min(0.26, 0.22 * width)
    area = Front(-tray_half, tray_half, under - 0.075, under - 0.003)
    box = block((-half_d + 0.12, -tray_half + 0.006, under - 0.07), (tray_x - 0.014, tray_half - 0.006, under - 0.005))
    return {
        "top": block((-half_d, -half_w, under), (half_d, half_w, height), 0.004),
        "legs": blocks(low, high, 0.003),
        "drawers": merged(fronts(tray_x, [area], 0.016), box),
        "handles": bar_handle(tray_x, 0.0, under - 0.04, 0.16, 0.02),
    }


MODELS = {
    "coffee_table": Model(build_coffee_table, ("shelf", "soft", "glass")),
    "side_table": Model(build_side_table, ("square", "pedestal", "frame")),
    "dining_table": Model(build_dining_table, ("legs", "turned", "soft")),
    "console_table": Model(build_console_table, ("drawers", "frame", "turned")),
    "bench": Model(build_bench, ("planks", "padded", "chest")),
    "desk": Model(build_desk, ("legs", "panels", "frame")),
}
