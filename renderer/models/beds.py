"""Beds, foot end at +x, headboard at -x: bedsteads with carved and turned wood, and what lies on them."""

import itertools
import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

import kernel_cache.elementary as el
from renderer.geometry.cloth import Drape, cloth, drape, layer, lined
from renderer.geometry.lofts import points
from renderer.geometry.mesh import Mesh
from renderer.geometry.shapes import block, blocks, lathe, merged, moved, rod, rotated, rounded_box, sheet, sweep
from renderer.geometry.upholstery import cushion, pillow, piping, rounded_loop, tufted
from renderer.models.model import CORNERS, Model, Parts, Pieces, Size, halved


def relief_board(
    rng: np.random.Generator, half_w: float, z: tuple[float, float, float], x: tuple[float, float], columns: int, rows: int
) -> Mesh:
    """Return an upright board with a carved front that looks along +x and a crest that rises in the middle.

    Its front bears a moulded border, a fan in the middle and scrolls beside it.

    Args:
        rng: for the number of the fan's blades and the turns of the scrolls.
        half_w: half its width along y.
        z: lower edge, upper edge at the ends, and how far the middle rises above that.
        x: back and furthest front.
        columns: odd count of vertices across.
        rows: odd count of vertices upward.
    """
    low, shoulder, rise = z
    u, v = np.meshgrid(np.linspace(-1.0, 1.0, columns), np.linspace(0.0, 1.0, rows), indexing="ij")
    crest = np.where(np.abs(u) < 0.72, 0.5 + 0.5 * el.cos(math.pi * u / 0.72), 0.0) + 0.16 * el.exp(-(((np.abs(u) - 0.86) / 0.09) ** 2))
    top = shoulder + rise * crest / crest.max()
    y, height = half_w * u, low + (top - low) * v
    blades = int(rng.integers(7, 11))
    turns = rng.uniform(2.2, 3.2)
    edge = np.minimum(half_w - np.abs(y), np.minimum(height - low, top - height))
    border = el.power(np.clip(1.0 - np.abs(edge - 0.024) / 0.022, 0.0, 1.0), 0.6)
    span = shoulder + rise - low
    fan_r = np.hypot(y / (0.32 * half_w), (height - (low + 0.42 * span)) / (0.42 * span))
    fan_a = el.arctan2(y / (0.32 * half_w), (height - (low + 0.42 * span)) / (0.42 * span))
    fan = np.clip(6.0 * (1.0 - fan_r), 0.0, 1.0) * np.clip(8.0 * fan_r, 0.0, 1.0) * (0.35 + 0.65 * np.abs(el.cos(0.5 * blades * fan_a)))
    side_r = np.hypot((np.abs(y) - 0.64 * half_w) / (0.24 * half_w), (height - (low + 0.5 * (shoulder - low))) / (0.32 * (shoulder - low)))
    side_a = el.arctan2(height - (low + 0.5 * (shoulder - low)), np.abs(y) - 0.64 * half_w)
    scroll = np.clip(5.0 * (1.0 - side_r), 0.0, 1.0) * (0.5 + 0.5 * el.cos(2.0 * math.pi * turns * el.power(side_r, 0.8) + side_a))
    relief = np.maximum.reduce([border, 0.85 * fan, 0.7 * scroll])
    front = x[0] + (x[1] - x[0]) * (0.55 + 0.45 * relief)
    board = lined(np.dstack([front, y, height]), np.dstack([np.full_like(front, x[0]), y, height]))
    foot = block((x[0] + 0.002, -half_w, low - 0.02), (x[1] - 0.002, half_w, low + 0.06), 0.006)
    return merged(board, foot)


def turned_post(side: float, height: float, square_to: float) -> Mesh:
    """Return a post on the floor at the origin: a square block up to ``square_to`` + 0.16 m, turned vase, rings and finial above."""
    half = 0.5 * side
    shaft = min(square_to + 0.16, 0.62 * height)
    foot = min(0.5 * square_to, 0.14)
    turned_foot = lathe(
        points(
            [0.0, 0.55 * half, 0.8 * half, 0.5 * half, 0.8 * half, 0.8 * half, 0.0],
            [0.0, 0.0, 0.25 * foot, 0.6 * foot, 0.8 * foot, foot, foot],
        ),
        12,
    )
    body = block((-half, -half, foot), (half, half, shaft), 0.006)
    rest = height - shaft
    profile = [
        (0.78, 0.0),
        (0.55, 0.06),
        (0.9, 0.16),
        (1.0, 0.3),
        (0.75, 0.5),
        (0.45, 0.62),
        (0.85, 0.66),
        (0.4, 0.71),
        (0.62, 0.82),
        (0.5, 0.93),
    ]
    vase = [(0.0, 0.0), *((half * r, rest * share) for r, share in profile), (0.0, rest)]
    return merged(turned_foot, body, moved(lathe(vase, 12), z=shaft))


DUVET_M = 0.03

_RAIL_BEHIND_M = 0.004
"""How far outer faces of rails lie behind those of the mattress, so that a duvet that hangs down covers them in its valleys too."""


class BedPlan(NamedTuple):
    """Where things lie: mattress from ``head`` to ``foot`` along x, half width ``half``, between ``z_low`` and ``z_top``."""

    head: float
    foot: float
    half: float
    z_low: float
    z_top: float


def mattress(plan: BedPlan) -> Mesh:
    """Return a mattress with a tape round its upper and lower edge."""
    body = rounded_box((plan.head, -plan.half, plan.z_low), (plan.foot, plan.half, plan.z_top), 0.05, 2)
    half_x, center = 0.5 * (plan.foot - plan.head), 0.5 * (plan.foot + plan.head)
    loop = rounded_loop(half_x - 0.010, plan.half - 0.010, 0.05, 1)
    tapes = [piping(points(center + loop[:, 0], loop[:, 1], z), 0.006, 4) for z in (plan.z_low + 0.012, plan.z_top - 0.012)]
    return merged(body, *tapes)


def slats(plan: BedPlan) -> Mesh:
    """Return the boards across the bed that the mattress lies on."""
    count = max(4, round((plan.foot - plan.head) / 0.22))
    xs = np.linspace(plan.head + 0.06, plan.foot - 0.06, count)
    return blocks(
        points(xs - 0.035, -plan.half + 0.012, plan.z_low - 0.014), points(xs + 0.035, plan.half - 0.012, plan.z_low + 0.004), 0.003
    )


def bedding(rng: np.random.Generator, plan: BedPlan, height: float, fall_m: float, over_foot: bool) -> Parts:
    """Return duvet, sheet, throw, pillows and cushion.

    Args:
        rng: for folds and places.
        plan: the mattress.
        height: of the bed, up to which pillows may reach.
        fall_m: how far the duvet hangs down at the sides.
        over_foot: it hangs down at the foot as well.
    """
    length = plan.foot - plan.head
    deep = min(0.44, 0.24 * length)
    start = plan.head + deep * rng.uniform(0.95, 1.1)
    center = 0.5 * (start + plan.foot)
    quilt = float(rng.choice((0.0, 0.0, 0.26, 0.34)))
    lies = Drape(plan.foot - center, plan.half, plan.z_top + DUVET_M, fall_m, fall_m if over_foot else 0.02, 0.0, 0.065)
    cover = drape(rng, lies, 41, 41, 0.034, quilt)
    throw_end = plan.foot - center - rng.uniform(0.12, 0.25)
    layers = {
        "duvet": cloth(cover, DUVET_M),
        "sheet": layer(cover, (float(cover.s[0]), float(cover.s[0]) + rng.uniform(0.17, 0.26)), 0.95, 0.016, 0.014, 7),
        "throw": layer(cover, (throw_end - rng.uniform(0.42, 0.58), throw_end), 0.97, 0.009, 0.008, 13),
    }
    parts = {name: moved(mesh, x=center) for name, mesh in layers.items()}
    return parts | _pillows(rng, plan, height, deep)


def _pillows(rng: np.random.Generator, plan: BedPlan, height: float, depth: float) -> Parts:
    """Sleeping pillows in one or two rows, leaning on the headboard, and a smaller cushion before them."""
    count = 2 if plan.half > 0.58 else 1
    room = max(height - plan.z_top, 0.12)
    width = min(2.0 * plan.half / count * 0.94, 0.74)
    thick = min(0.19, 0.8 * room)
    rows = 2 if room > 0.32 and rng.random() < 0.6 else 1
    pillows = []
    front = plan.head + 0.01
    for row in range(rows):
        steep = rng.uniform(48.0, 60.0) if row + 1 < rows else rng.uniform(20.0, 32.0)
        lean = min(math.radians(steep), math.asin(min(1.0, 0.62 * room / depth)))
        share = 1.0 if row == 0 else 0.94
        for i in range(count):
            soft = rotated(rotated(pillow(rng, share * depth, share * width, thick, 10), "y", lean), "z", rng.uniform(-0.04, 0.04))
            low = soft.vertices.min(axis=0).tolist()
            shift = (i - 0.5 * (count - 1)) * (2.0 * plan.half / count)
            pillows.append(moved(soft, front - low[0], shift + rng.uniform(-0.015, 0.015), plan.z_top - low[2] - 0.014))
        front += 0.10 + 0.45 * thick if rows > 1 else 0.0
    small = 0.36 if plan.half > 0.5 else 0.32
    upright = min(math.radians(54.0), math.asin(min(1.0, 0.75 * room / small)))
    accent = rotated(pillow(rng, small, small * rng.uniform(1.0, 1.4), 0.14, 10, piped=True), "y", upright)
    accent = rotated(accent, "z", rng.uniform(-0.12, 0.12))
    low = accent.vertices.min(axis=0).tolist()
    place = moved(accent, x=front + 0.5 * depth - low[0], y=rng.uniform(-0.08, 0.08), z=plan.z_top - low[2] + 0.02)
    return {"pillows": merged(*pillows), "cushion": place}


Build = Callable[[np.random.Generator, Size, BedPlan], Parts]


class Bedstead(NamedTuple):
    """How a style is built, and how much room it needs around the mattress, m; how far a duvet falls, as share of its thickness."""

    build: Build
    head: float
    foot: float
    inset: float
    fall: float
    over_foot: bool


def _corners(half_d: float, half_w: float) -> list[tuple[float, float]]:
    return [(sx * half_d, sy * half_w) for sx, sy in CORNERS]


def _platform(rng: np.random.Generator, size_m: Size, plan: BedPlan) -> Parts:
    """A low slab on recessed legs, a wide headboard of planks."""
    _, _, height, half_d, half_w = halved(size_m)
    base = plan.z_low - 0.02
    slab = block((-half_d, -half_w, base - 0.09), (half_d, half_w, base + 0.05), 0.008)
    rim = blocks(
        [(plan.head, -half_w + 0.01, base), (plan.head, half_w - 0.04, base), (half_d - 0.04, -half_w + 0.03, base)],
        points(half_d - 0.01, [-half_w + 0.04, half_w - 0.01, half_w - 0.03], base + 0.06),
        0.006,
    )
    seams = int(rng.integers(2, 5))
    if rng.random() < 0.5:
        edges = np.linspace(-half_w, half_w, seams + 1)
        low = [(-half_d, y + 0.0015, base) for y in edges[:-1]]
        high = [(-half_d + 0.04, y - 0.0015, height) for y in edges[1:]]
    else:
        edges = np.linspace(base, height, seams + 2)
        low = [(-half_d, -half_w, z + 0.002) for z in edges[:-1]]
        high = [(-half_d + 0.04, half_w, z - 0.002) for z in edges[1:]]
        high[-1] = (-half_d + 0.04, half_w, height)
    inset = 0.14
    legs = [
        block((x - 0.035, y - 0.035, 0.0), (x + 0.035, y + 0.035, base - 0.08), 0.005) for x, y in _corners(half_d - inset, half_w - inset)
    ]
    back = block((-half_d + 0.008, -half_w + 0.01, base + 0.01), (-half_d + 0.03, half_w - 0.01, height - 0.01), 0.002)
    return {"frame": merged(slab, rim), "headboard": merged(blocks(low, high, 0.007), back), "legs": merged(*legs)}


def _panel(rng: np.random.Generator, size_m: Size, plan: BedPlan) -> Parts:
    """Posts and rails with a curved, panelled headboard and a low footboard."""
    _, _, height, half_d, half_w = halved(size_m)
    post = 0.055
    foot_height = plan.z_top + 0.03
    rail_low = plan.z_low - 0.10
    foot = _paneled_board(half_d - 0.01, half_w, post, rail_low, foot_height, 0.03)
    rise = rng.uniform(0.03, 0.09) * min(1.0, height)
    head = _paneled_board(-half_d + post - 0.01, half_w, post, rail_low, height - rise, rise)
    legs = []
    for x, top in ((-half_d + 0.5 * post, height - rise + 0.012), (half_d - 0.5 * post, foot_height + 0.008)):
        legs += [block((x - 0.5 * post, s * half_w, 0.0), (x + 0.5 * post, s * (half_w - post), top), 0.006) for s in (-1.0, 1.0)]
    return {"frame": merged(_side_rails(half_d, plan), foot), "headboard": head, "legs": merged(*legs)}


def _side_rails(half_d: float, plan: BedPlan) -> Mesh:
    """Boards along the sides, with a ledge that carries the slats."""
    low, high, side = plan.z_low - 0.10, plan.z_low + 0.07, plan.half - _RAIL_BEHIND_M
    rails = [block((-half_d + 0.02, s * side, low), (half_d - 0.02, s * (side - 0.026), high), 0.004) for s in (-1.0, 1.0)]
    inner = plan.half - 0.05
    ledges = [block((plan.head, s * (side - 0.002), low + 0.03), (plan.foot, s * inner, plan.z_low - 0.012), 0.002) for s in (-1.0, 1.0)]
    return merged(*rails, *ledges)


def _paneled_board(front: float, half_w: float, post: float, low: float, high: float, rise: float) -> Mesh:
    """Top rail that rises in the middle, bottom rail, stiles and fields between them; its front lies at x = ``front``."""
    inner = half_w - post
    thick = 0.032
    y = np.linspace(-inner, inner, 25)
    arch = rise * el.power(np.maximum(el.cos(0.5 * math.pi * y / inner), 0.0), 0.8)
    rail = 0.075
    front_face = np.stack([points(front, y, high - rail), points(front, y, high + arch)], axis=1)
    back_face = front_face - np.array([thick, 0.0, 0.0])
    top_rail = sheet(front_face, back_face)
    fields = max(3, round(2.0 * inner / 0.42))
    edges = np.linspace(-inner, inner, fields + 1)
    stile = 0.032
    low_corners = [(front - thick, edge - stile, low) for edge in edges[1:-1]] + [(front - thick, -inner, low)]
    high_corners = [(front, edge + stile, high - rail + 0.01) for edge in edges[1:-1]] + [(front, inner, low + 0.09)]
    frame = blocks(low_corners, high_corners, 0.005)
    back = block((front - thick + 0.006, -inner, low + 0.02), (front - 0.018, inner, high - 0.02), 0.002)
    raised = blocks(
        points(front - 0.02, edges[:-1] + stile + 0.03, low + 0.12),
        points(front - 0.008, edges[1:] - stile - 0.03, high - rail - 0.03),
        0.008,
    )
    return merged(top_rail, frame, back, raised)


def _carved(rng: np.random.Generator, size_m: Size, plan: BedPlan) -> Parts:
    """Turned posts with finials between which carved boards rise in the middle."""
    _, _, height, half_d, half_w = halved(size_m)
    post = 0.065
    low = plan.z_low - 0.06
    foot_top = plan.z_top + 0.055
    rise = rng.uniform(0.1, 0.2) * height
    inner = half_w - 0.5 * post
    head_post = height - 0.5 * rise
    head = relief_board(rng, inner, (low, height - rise, rise), (-half_d + 0.012, -half_d + 0.05), 41, 17)
    foot = relief_board(rng, inner, (low, foot_top - 0.07, 0.06), (half_d - 0.058, half_d - 0.022), 35, 9)
    x_head, x_foot = -half_d + 0.5 * post, half_d - 0.5 * post
    posts = [moved(turned_post(post, head_post, low), x_head, s * (half_w - 0.5 * post)) for s in (-1.0, 1.0)]
    posts += [moved(turned_post(post, foot_top, low), x_foot, s * (half_w - 0.5 * post)) for s in (-1.0, 1.0)]
    return {"frame": merged(_side_rails(half_d - 0.02, plan), foot), "headboard": head, "legs": merged(*posts)}


def _metal(rng: np.random.Generator, size_m: Size, plan: BedPlan) -> Parts:
    """Tubes: an arched head and a lower foot end with bars and rings, brass knobs on the posts."""
    _, width, height, half_d, half_w = halved(size_m)
    tube = 0.017
    inner = half_w - tube - 0.004
    low = plan.z_low - 0.04

    def end(x: float, shoulder: float, top: float, bars: int) -> tuple[Mesh, Mesh]:
        angle = np.linspace(-0.5 * math.pi, 0.5 * math.pi, 17)
        arch = points(x, inner * el.sin(angle), shoulder + (top - tube - shoulder) * el.power(el.cos(angle), 1.4))
        rails = [sweep(arch, tube, 10), *(rod((x, -inner, z), (x, inner, z), 0.011) for z in (low + 0.06, shoulder - 0.02))]
        ys = np.linspace(-inner, inner, bars + 2)[1:-1]
        rise = np.interp(ys, arch[:, 1], arch[:, 2])
        rails += [rod((x, y, low + 0.06), (x, y, z), 0.006, segments=6) for y, z in zip(ys, rise, strict=True)]
        mid = 0.5 * (low + 0.06 + shoulder)
        turn = np.arange(12) * (2.0 * math.pi / 12)
        ring = 0.36 * float(ys[1] - ys[0])
        for y in 0.5 * (ys[1:] + ys[:-1]):
            rails.append(piping(points(x, y + ring * el.cos(turn), mid + ring * el.sin(turn)), 0.0055, 4))
        posts, knobs = [], []
        for s in (-1.0, 1.0):
            posts.append(rod((x, s * inner, 0.0), (x, s * inner, shoulder), tube, segments=14))
            ball = points([0.0, 0.019, 0.021, 0.012, 0.024, 0.021, 0.012, 0.0], [-0.01, -0.01, 0.0, 0.006, 0.022, 0.036, 0.045, 0.047])
            knobs.append(moved(lathe(ball, 14), x, s * inner, shoulder))
        return merged(*rails), merged(*posts, *knobs)

    shoulder = height - rng.uniform(0.14, 0.22) * height
    bars = min(max(4, round(width / 0.2)), 9)
    head, head_posts = end(-half_d + 0.024, shoulder, height, bars)
    foot, foot_posts = end(half_d - 0.024, plan.z_top - 0.04, plan.z_top + 0.055, bars)
    middle = plan.half - _RAIL_BEHIND_M - 0.014
    sides = blocks(
        [(-half_d + 0.03, s * middle - 0.014, low) for s in (-1.0, 1.0)],
        [(half_d - 0.03, s * middle + 0.014, plan.z_low + 0.02) for s in (-1.0, 1.0)],
        0.004,
    )
    return {"frame": merged(sides, foot), "headboard": head, "legs": merged(head_posts, foot_posts)}


def _padded_sides(half_d: float, plan: BedPlan, low: float) -> Mesh:
    """Upholstered rails on both sides and at the foot."""
    high, side = plan.z_low + 0.06, plan.half - _RAIL_BEHIND_M
    end = plan.foot - _RAIL_BEHIND_M
    sides = [rounded_box((-half_d + 0.02, s * side, low), (end, s * (side - 0.05), high), 0.02) for s in (-1.0, 1.0)]
    return merged(*sides, rounded_box((end - 0.05, -side, low), (end, side, high), 0.02))


def _peg_legs(half_d: float, half_w: float, low: float) -> Mesh:
    return merged(*(rod((x, y, 0.0), (x, y, low + 0.03), 0.018, 0.028) for x, y in _corners(half_d - 0.12, half_w - 0.12)))


def _upholstered(rng: np.random.Generator, size_m: Size, plan: BedPlan) -> Parts:
    """Padded side rails and a headboard of channels or squares."""
    _, width, height, half_d, half_w = halved(size_m)
    low = 0.09
    back = rounded_box((-half_d, -half_w, low), (-half_d + 0.05, half_w, height), 0.022)
    columns = min(max(3, round(width / rng.uniform(0.2, 0.34))), 11)
    rows = 1 if columns > 5 or rng.random() < 0.4 else 2
    ys = np.linspace(-half_w + 0.012, half_w - 0.012, columns + 1)
    zs = np.linspace(plan.z_low + 0.05, height - 0.012, rows + 1)
    pads = [
        cushion(rng, (-half_d + 0.035, a, c), (-half_d + 0.083, b, d), 0.016, 0.02, axis=0, divisions=3)
        for a, b in itertools.pairwise(ys)
        for c, d in itertools.pairwise(zs)
    ]
    return {"frame": _padded_sides(half_d, plan, low), "headboard": merged(back, *pads), "legs": _peg_legs(half_d, half_w, low)}


def _tufted(rng: np.random.Generator, size_m: Size, plan: BedPlan) -> Parts:
    """A high headboard with deep buttons between piped borders, padded rails."""
    _, _, height, half_d, half_w = halved(size_m)
    low, border = 0.08, 0.07
    back = rounded_box((-half_d, -half_w, low), (-half_d + 0.06, half_w, height), 0.022, 3)
    y, bottom, top = half_w - border, plan.z_low, height - border
    pitch = (max(rng.uniform(0.17, 0.22), 2.0 * y / 8.0), max(rng.uniform(0.15, 0.19), (top - bottom) / 3.4))
    panel = tufted((-y, y), (bottom, top), (-half_d + 0.036, -half_d + 0.085), pitch, 0.035)
    welt = [(-half_d + 0.061, -y, bottom), (-half_d + 0.061, y, bottom), (-half_d + 0.061, y, top), (-half_d + 0.061, -y, top)]
    loop = np.concatenate([np.linspace(a, b, 8, endpoint=False) for a, b in zip(welt, [*welt[1:], welt[0]], strict=True)])
    return {
        "frame": _padded_sides(half_d, plan, low),
        "headboard": merged(back, panel, piping(loop, 0.007)),
        "legs": _peg_legs(half_d, half_w, low),
    }


BEDSTEADS = {
    "platform": Bedstead(_platform, 0.05, 0.05, 0.07, 0.8, True),
    "panel": Bedstead(_panel, 0.055, 0.05, 0.055, 1.4, False),
    "upholstered": Bedstead(_upholstered, 0.075, 0.06, 0.06, 1.4, True),
    "carved": Bedstead(_carved, 0.06, 0.075, 0.065, 1.2, False),
    "tufted": Bedstead(_tufted, 0.075, 0.06, 0.06, 1.3, True),
    "metal": Bedstead(_metal, 0.05, 0.05, 0.055, 1.1, False),
}
"""Style -> bedstead."""


def build_bed(rng: np.random.Generator, size_m: Size, style: str) -> Pieces:
    """Return a bed made up with duvet, turned-down sheet, pillows, decorative cushion and throw."""
    depth, width, height = size_m
    kind = BEDSTEADS[style]
    top = min(0.28 + 0.24 * height, 0.82 * height)
    thickness = min(0.22, 0.5 * top)
    plan = BedPlan(-0.5 * depth + kind.head, 0.5 * depth - kind.foot, 0.5 * width - kind.inset, top - thickness, top)
    parts = kind.build(rng, size_m, plan)
    parts["mattress"] = mattress(plan)
    parts["slats"] = slats(plan)
    parts.update(bedding(rng, plan, height, thickness * kind.fall * rng.uniform(0.9, 1.1), kind.over_foot))
    return parts


MODELS = {"bed": Model(build_bed, tuple(BEDSTEADS))}
