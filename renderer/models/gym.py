"""Gym machines, weights and exercise bikes.

Who uses a treadmill or bike mounts it from +x and looks towards its console at -x.
"""

import math

import numpy as np

from renderer.geometry.lofts import Point, bent, disc, loft, lying, oval, points, ring
from renderer.geometry.mesh import Mesh
from renderer.geometry.shapes import block, blocks, lathe, merged, mirrored, moved, rod, rotated, rounded_box, sweep
from renderer.geometry.upholstery import cushion
from renderer.models.lamps import globe
from renderer.models.model import Model, Parts, Pieces, Size, halved, side_boards
from renderer.models.vehicles import saddle


def build_treadmill(rng: np.random.Generator, size_m: Size, style: str) -> Pieces:
    """Return a treadmill: deck with belt and side rails, motor hood, uprights with hand rails or short bars, console."""
    depth, _, height, half_d, half_w = halved(size_m)
    compact = style == "compact"
    deck = min(0.2, 0.15 * height) * (0.7 if compact else 1.0)
    hood_end = -half_d + 0.26 * depth
    belt_half = 0.62 * half_w
    belt = rounded_box((hood_end - 0.1, -belt_half, deck - 0.045), (half_d - 0.02, belt_half, deck), 0.02, 2)
    rails = side_boards(half_w, half_w - belt_half, (hood_end - 0.1, half_d - 0.05), (deck - 0.03, deck + 0.014), 0.008)
    frame = [
        block((-half_d + 0.1, s * belt_half - 0.03, 0.03), (half_d - 0.1, s * belt_half + 0.03, deck - 0.02), 0.006) for s in (-1.0, 1.0)
    ]
    frame += [rod((half_d - 0.06, -belt_half, deck - 0.05), (half_d - 0.06, belt_half, deck - 0.05), 0.04)]
    frame += [rod((x, s * belt_half, 0.0), (x, s * belt_half, 0.05), 0.03) for x in (-half_d + 0.2, half_d - 0.16) for s in (-1.0, 1.0)]
    caps = [
        rounded_box(
            (half_d - 0.09, s * 0.8 * half_w - 0.2 * half_w, 0.03), (half_d, s * 0.8 * half_w + 0.2 * half_w, deck + 0.016), 0.02, 2
        )
        for s in (-1.0, 1.0)
    ]
    outline = [
        oval(0.5 * (hood_end + half_d) + e, half_w - i, z, -half_d + 0.5 * (hood_end + half_d) + e, 7.0)
        for e, i, z in (
            (0.0, 0.0, 0.03),
            (0.0, 0.0, deck),
            (-0.03, 0.03, deck + (0.03 if compact else 0.07)),
            (-0.07, 0.09, deck + (0.04 if compact else 0.085)),
        )
    ]
    hood = loft(outline)
    top, post_y = 0.82 * height, half_w - 0.05
    posts, grips, x = _uprights(size_m, style, top, post_y)
    bar = rod((x + 0.1, -post_y, top - 0.03), (x + 0.1, post_y, top - 0.03), 0.018)
    tray = rounded_box((x - 0.08, -post_y - 0.04, top - 0.03), (x + 0.12, post_y + 0.04, top + 0.03), 0.025, 2)
    console = rounded_box((-0.03, -0.72 * half_w, 0.0), (0.03, 0.72 * half_w, height - top), 0.022, 2)
    screen = block((0.02, -0.5 * half_w, 0.3 * (height - top)), (0.033, 0.5 * half_w, 0.86 * (height - top)), 0.002)
    keys = [disc("x", (0.03, y, 0.15 * (height - top)), 0.012, 0.01, 12) for y in np.linspace(-0.45, 0.45, 7) * half_w]
    console, screen, buttons = (moved(rotated(mesh, "y", -0.3), x, z=top) for mesh in (console, screen, merged(*keys)))
    return {
        "frame": [*frame, *posts],
        "rails": [rails, *caps],
        "belt": belt,
        "hood": hood,
        "grips": [*grips, bar],
        "console": [tray, console],
        "screen": screen,
        "buttons": buttons,
    }


def _uprights(size_m: Size, style: str, top: float, post_y: float) -> tuple[list[Mesh], list[Mesh], float]:
    """Return a treadmill's posts and hand rails (short bars of the compact one), and where along x the posts end."""
    depth, half_d = size_m[0], 0.5 * size_m[0]
    compact = style == "compact"
    lean = {"straight": 0.16, "curved": 0.1, "compact": 0.04}[style]
    posts: list[Mesh] = []
    grips: list[Mesh] = []
    for s in (-1.0, 1.0):
        foot, head = (-half_d + 0.12 + 0.1, s * post_y, 0.06), (-half_d + 0.1 + lean, s * post_y, top)
        if style == "curved":
            posts.append(bent([foot, (-half_d + 0.1, s * post_y, 0.5 * top), head], 0.032, 0.3, 12))
        else:
            posts.append(sweep([foot, head], [0.042, 0.034], 12, 0.7))
        reach = head[0] + (0.2 if compact else 0.32) * depth
        if compact:
            grips.append(sweep([(head[0] - 0.02, s * post_y, top - 0.02), (reach, s * post_y, top - 0.05)], [0.022, 0.019], 12))
            continue
        way = points([head[0] - 0.02, reach, reach - 0.05, foot[0] - 0.03], s * post_y, [top - 0.01, top - 0.05, 0.55 * top, 0.42 * top])
        grips.append(bent(way, 0.02, 0.08, 10))
    return posts, grips, -half_d + 0.1 + lean


def build_weight_bench(rng: np.random.Generator, size_m: Size, style: str) -> Pieces:
    """Return a padded bench, flat, with raised back, or flat with rollers for the legs, and a bar with plates.

    A bench at least 0.95 m wide and 0.75 m high has a rack that carries the bar; the bar of a smaller one lies under its pad.
    """
    depth, width, height, half_d, half_w = halved(size_m)
    racked = width >= 0.95 and height >= 0.75
    r = min(0.21, 0.2 * height + 0.03, 0.3 * depth) if racked else min(0.13, 0.27 * height, 0.2 * width)
    bar_x, bar_z = (-half_d + r, height - r) if racked else (-0.08 * depth, r)
    post_y = min(half_w - 0.2, 0.45) if racked else half_w - 0.14
    seat = min(0.45, 0.42 * height) if racked else height * (0.72 if style == "incline" else 1.0)
    pad_half = min(0.15, 0.26 * width)
    head = bar_x if racked else -half_d
    split = 0.34 * half_d
    room = 0.8 * (bar_z - seat) if racked else height - seat
    back_len = split - head
    steep = rng.uniform(0.35, 0.6) if racked else 1.0
    lift = 0.0 if style != "incline" else min(steep, math.asin(min(0.9, room / back_len)))
    back = cushion(rng, (-back_len, -pad_half, 0.0), (0.0, pad_half, 0.065), 0.02, 0.012)
    back = moved(rotated(back, "y", lift), split, 0.0, seat - 0.065)
    pads = merged(
        cushion(
            rng, (split + 0.01, -pad_half, seat - 0.065), (half_d - (0.13 if style == "rollers" else 0.0), pad_half, seat), 0.02, 0.012
        ),
        back,
    )
    end = half_d - (0.13 if style == "rollers" else 0.0)
    if style == "rollers":
        rolls = [(end + 0.02, seat - 0.1), (half_d - 0.055, max(0.3 * seat, 0.06))]
        pads = merged(pads, *(rod((x, -0.9 * pad_half - 0.05, z), (x, 0.9 * pad_half + 0.05, z), 0.05, segments=16) for x, z in rolls))
    beam = blocks([(head + 0.1, -0.03, seat - 0.13)], [(half_d - 0.12, 0.03, seat - 0.07)], 0.005)
    frame = [beam, *_bench_feet(half_d, 0.85 * pad_half + 0.06, seat, head, racked)]
    if style == "rollers":
        frame.append(sweep([(end - 0.06, 0.0, seat - 0.1), (rolls[0][0], 0.0, rolls[0][1]), (rolls[1][0], 0.0, rolls[1][1])], 0.018, 8))
    if lift > 0.0:
        reach = 0.6 * back_len
        prop = (split - reach * math.cos(lift), 0.0, seat - 0.07 + reach * math.sin(lift))
        frame.append(sweep([prop, (max(split - reach - 0.02, head + 0.12), 0.0, seat - 0.1)], 0.02, 8))
    if racked:
        frame += _rack(bar_x, post_y, bar_z, 0.28 * r + 0.1)
    bar, plates = _barbell(rng, half_w, post_y, r)
    at = {"x": bar_x, "z": bar_z}
    return {"frame": frame, "pads": pads, "bar": moved(bar, **at), "plates": moved(plates, **at)}


def _bench_feet(half_d: float, half: float, seat: float, head: float, racked: bool) -> list[Mesh]:
    """A T-shaped foot at the sitting end, and one at the head end or the strut to the rack."""
    feet = []
    for x in (half_d - 0.18, *(() if racked else (-half_d + 0.12,))):
        feet.append(block((x, -0.03, 0.0), (x + 0.06, 0.03, seat - 0.07), 0.005))
        feet.append(block((x, -half, 0.0), (x + 0.06, half, 0.05), 0.005))
    if racked:
        feet.append(block((head + 0.02, -0.03, 0.15), (head + 0.12, 0.03, seat - 0.07), 0.005))
    return feet


def _rack(x: float, post_y: float, bar_z: float, reach: float) -> list[Mesh]:
    """Two posts with forks for the bar, on skids, joined by two rails."""
    rails = [block((x - 0.025, -post_y, z), (x + 0.025, post_y, z + 0.05), 0.005) for z in (0.15, 0.72 * bar_z)]
    for s in (-1.0, 1.0):
        rails.append(block((x - 0.03, s * post_y - 0.03, 0.0), (x + 0.03, s * post_y + 0.03, bar_z - 0.03), 0.005))
        rails.append(block((x - reach, s * post_y - 0.03, 0.0), (x + 0.25, s * post_y + 0.03, 0.05), 0.005))
        for dx in (-0.04, 0.04):
            low = (x + dx - 0.008, s * post_y - 0.03, bar_z - 0.05)
            rails.append(block(low, (x + dx + 0.008, s * post_y + 0.03, bar_z + 0.035), 0.003))
    return rails


def _barbell(rng: np.random.Generator, half_w: float, inside: float, r: float) -> tuple[Mesh, Mesh]:
    """A bar along y through the origin and its plates, which begin ``inside`` off the middle and are up to r in radius."""
    count, thick = 1 + int(rng.integers(1, 3)), min(0.034, 0.2 * (half_w - inside))
    sleeve = min(inside + 0.08, half_w - 0.035 - count * (thick + 0.004))
    bar = [rod((0.0, -half_w, 0.0), (0.0, half_w, 0.0), 0.014)]
    bar += [rod((0.0, s * (half_w - 0.005), 0.0), (0.0, s * sleeve, 0.0), 0.024) for s in (-1.0, 1.0)]
    plates = []
    for s in (-1.0, 1.0):
        for k, share in enumerate((1.0, 1.0, 0.72)[:count]):
            at = (0.0, s * (sleeve + 0.02 + k * (thick + 0.004) + 0.5 * thick), 0.0)
            plates += [disc("y", at, share * r, thick, 36, 0.006), ring("y", at, 0.86 * share * r, 0.5 * thick, 32, 6)]
    return merged(*bar), merged(*plates)


def dumbbell(length: float, radius: float, hexagonal: bool) -> tuple[Mesh, Mesh]:
    """Return grip and heads of a dumbbell along x, centred at the origin."""
    head = 0.32 * length
    profile = [(0.0, 0.0), (0.8 * radius, 0.0), (radius, 0.2 * head), (radius, 0.8 * head), (0.8 * radius, head), (0.0, head)]
    body = lying(lathe(profile, 6 if hexagonal else 14), "x")
    heads = merged(moved(body, -0.5 * length), moved(body, 0.5 * length - head))
    return rod((-0.3 * length, 0.0, 0.0), (0.3 * length, 0.0, 0.0), min(0.016, 0.5 * radius), segments=8), heads


def build_dumbbell_rack(rng: np.random.Generator, size_m: Size, style: str) -> Pieces:
    """Return two or three tilted shelves full of dumbbells, larger ones below, on side frames."""
    depth, width, height, half_d, half_w = halved(size_m)
    tiers = 2 if height < 0.75 else 3
    frame: list[Mesh] = []
    grips: list[Mesh] = []
    heads: list[Mesh] = []
    top_z = height - 0.2 * height / tiers
    for s in (-1.0, 1.0):
        y = s * (half_w - 0.025)
        frame.append(block((-half_d, y - 0.025, 0.0), (half_d, y + 0.025, 0.05), 0.006))
        frame.append(bent([(half_d - 0.08, y, 0.03), (-half_d + 0.04, y, height - 0.03), (-half_d + 0.04, y, 0.03)], 0.024, 0.04, 8))
    for k in range(tiers):
        share = (k + 0.4) / tiers
        z = 0.12 * height + share * (top_z - 0.12 * height)
        x = half_d - 0.22 * depth - share * 0.5 * depth
        reach = 0.17 * depth
        for dx, dz in ((-reach, 0.05), (reach, -0.02)):
            frame.append(block((x + dx - 0.02, -half_w + 0.02, z + dz - 0.02), (x + dx + 0.02, half_w - 0.02, z + dz), 0.004))
        r = min((0.078, 0.064, 0.05)[k], 0.24 * height / tiers)
        count = max(2, int((width - 0.1) / (2.35 * r)))
        for y in np.linspace(-half_w + 0.06 + r, half_w - 0.06 - r, count):
            for into, mesh in zip((grips, heads), dumbbell(2.0 * reach + 0.12, r, style == "hexagonal"), strict=True):
                into.append(moved(rotated(mesh, "y", 0.2), x, float(y), z + 0.012 + r))
    return {"frame": frame, "grips": grips, "weights": heads}


def build_gym_ball(rng: np.random.Generator, size_m: Size, style: str) -> Pieces:
    """Return an inflated ball with grooves round its equator and a plug."""
    r = 0.5 * float(min(size_m))
    angle = np.linspace(-0.5 * math.pi, 0.5 * math.pi, 25)
    profile = []
    for k, a in enumerate(angle):
        groove = 0.992 if 6 <= k <= 18 and k % 3 == 0 else 1.0
        profile.append((r * groove * math.cos(a) if 0 < k < 24 else 0.0, r + r * math.sin(a) * (groove if 0 < k < 24 else 1.0)))
    lean = rng.uniform(0.2, 1.2)
    ball = rotated(lathe(profile, 36), "x", lean, (0.0, 0.0, r))
    ball = ball._replace(
        vertices=np.maximum(ball.vertices, np.array([-np.inf, -np.inf, 0.02 * r], np.float32))
    )  # pressed flat by its weight
    plug = rotated(moved(globe(0.02, 0.0, 0.4, 6), z=1.994 * r), "x", lean + 0.4, (0.0, 0.0, r))
    return {"ball": ball, "plug": plug}


def build_exercise_bike(rng: np.random.Generator, size_m: Size, style: str) -> Pieces:
    """Return a spinning bike with bare flywheel, an upright bike with covered drive, or a recumbent one; bars at -x, saddle at +x."""
    if style == "recumbent":
        return _recumbent(rng, size_m)
    depth, _, height, half_d, half_w = halved(size_m)
    feet = [rounded_box((x - 0.035, -half_w, 0.0), (x + 0.035, half_w, 0.06), 0.02, 2) for x in (-half_d + 0.05, half_d - 0.05)]
    r = min(0.24, 0.23 * depth, 0.2 * height)
    wheel = (-half_d + r + 0.05, 0.0, r + 0.09)
    crank = (0.04 * depth, 0.0, 0.29 * height)
    seat_top = (0.26 * depth, 0.0, 0.74 * height)
    bar_top = (-0.27 * depth, 0.0, 0.84 * height)
    beam = [bent([(-half_d + 0.05, 0, 0.05), (0.0, 0.0, 0.09), (half_d - 0.05, 0, 0.05)], 0.03, 0.2, 10)]
    beam += [sweep([(0.0, 0.0, 0.08), crank, (0.2 * depth, 0.0, 0.56 * height)], 0.034, 10)]
    beam += [sweep([crank, (-0.2 * depth, 0.0, 0.62 * height), (-0.22 * depth, 0.0, 0.66 * height)], 0.034, 10)]
    fork = [
        bent([(wheel[0], s * 0.05, wheel[2]), (-0.22 * depth, s * 0.045, 0.5 * height), (-0.2 * depth, 0.0, 0.6 * height)], 0.016, 0.1, 8)
        for s in (-1.0, 1.0)
    ]
    posts = [sweep([(0.19 * depth, 0, 0.5 * height), (seat_top[0], 0, seat_top[2] - 0.05)], 0.022, 10)]
    posts += [sweep([(-0.21 * depth, 0.0, 0.6 * height), (bar_top[0], 0.0, bar_top[2])], 0.022, 10)]
    if style == "spinning":
        fly = merged(
            disc("y", wheel, r, 0.03, 40, 0.006), disc("y", wheel, 0.3 * r, 0.07, 20, 0.01), ring("y", wheel, 0.95 * r, 0.02, 40, 8)
        )
        cover = [sweep([wheel, crank], [0.55 * r, 0.11], 24, 0.16)]
        cover = [moved(mesh, y=-0.055) for mesh in cover]
    else:
        fly = disc("y", (wheel[0], 0.0, wheel[2]), 0.8 * r, 0.14, 36, 0.02)
        shell = [disc("y", (wheel[0] + 0.02, 0.0, wheel[2] + 0.01), 1.02 * r, 0.11, 36, 0.04), disc("y", crank, 0.17, 0.11, 28, 0.04)]
        cover = [*shell, sweep([(wheel[0], 0, wheel[2] + 0.1 * r), crank], [0.9 * r, 0.15], 24, 0.2)]
    arms, pedals = _cranks(rng, crank, min(0.17, crank[2] - 0.1), (0.1, 0.095, 0.1), ((-0.045, 0.1, -0.012), (0.045, 0.18, 0.012)), 0.006)
    grip_w = 0.92 * half_w
    reach = -half_d + 0.02
    half_bar = points(
        [reach + 0.2 * depth, reach, bar_top[0] - 0.02], [grip_w, grip_w, 0.06], [bar_top[2] + 0.02, bar_top[2] + 0.05, bar_top[2]]
    )
    bars = bent(np.concatenate([half_bar * (1.0, -1.0, 1.0), half_bar[::-1]]), 0.015, 0.06, 10)
    z = bar_top[2] + 0.03
    console, screen = _console((bar_top[0] + 0.02, z), 0.13, height - z, (0.25, 0.85), -0.5)
    return {
        "frame": [*feet, *beam, *fork],
        "posts": [*posts, *arms],
        "flywheel": fly,
        "cover": cover,
        "pedals": pedals,
        "saddle": saddle(rng, 0.27, 0.21, seat_top, -1.0),
        "handlebar": bars,
        "console": console,
        "screen": screen,
    }


def _cranks(
    rng: np.random.Generator, crank: Point, reach: float, wide: Point, pedal: tuple[Point, Point], bevel: float
) -> tuple[list[Mesh], list[Mesh]]:
    """Return axle and arms of cranks of length ``reach``, turned at random, and their pedals.

    ``wide``: how far off the middle the axle ends, and the arms begin and end; ``pedal``: corners of the pedal on the +y side, seen from
    the end of its arm.
    """
    x, _, z = crank
    turn = rng.uniform(0.0, 2.0 * math.pi)
    arms, pedals = [rod((x, -wide[0], z), (x, wide[0], z), 0.016)], []
    for s in (-1.0, 1.0):
        px, pz = x + s * reach * math.cos(turn), z + s * reach * math.sin(turn)
        arms.append(sweep([(x, s * wide[1], z), (px, s * wide[2], pz)], 0.013, 8))
        low, high = pedal
        pedals.append(block((px + low[0], s * low[1], pz + low[2]), (px + high[0], s * high[1], pz + high[2]), bevel))
    return arms, pedals


def _console(at: tuple[float, float], half: float, rise: float, shares: tuple[float, float], tilt: float) -> tuple[Mesh, Mesh]:
    """Return a tilted console at (x, z) and its screen, which lies between two shares of the console's height ``rise``."""
    case = rounded_box((-0.02, -half, 0.0), (0.02, half, rise), 0.014, 2)
    screen = block((0.012, 0.03 - half, shares[0] * rise), (0.023, half - 0.03, shares[1] * rise), 0.002)
    return moved(rotated(case, "y", tilt), at[0], z=at[1]), moved(rotated(screen, "y", tilt), at[0], z=at[1])


def _recumbent(rng: np.random.Generator, size_m: Size) -> Parts:
    """A low bike with a seat with back at +x, pedals before it, a covered drive, and bars beside the seat."""
    depth, _, height, half_d, half_w = halved(size_m)
    r = min(0.22, 0.2 * depth, 0.19 * height)
    feet = [rounded_box((x - 0.035, -half_w, 0.0), (x + 0.035, half_w, 0.055), 0.02, 2) for x in (-half_d + 0.12, half_d - 0.05)]
    hub, crank = (-half_d + r + 0.02, 0.0, 0.3 * height), (-half_d + 1.5 * r + 0.1, 0.0, 0.4 * height)
    seat_z = 0.48 * height
    beam = rounded_box((-half_d + 0.08, -0.045, 0.05), (half_d - 0.03, 0.045, 0.13), 0.02, 2)
    rest = rod((0.27 * depth, 0.0, 0.1), (0.27 * depth, 0.0, seat_z - 0.05), 0.035)
    shell = [disc("y", hub, 1.05 * r, 0.13, 36, 0.04), disc("y", crank, 0.55 * r, 0.13, 28, 0.04)]
    shell += [
        sweep([hub, crank], [0.95 * r, 0.5 * r], 24, 0.06 / r),
        rounded_box((hub[0] - 0.5 * r, -0.06, 0.08), (crank[0], 0.06, hub[2]), 0.03, 2),
    ]
    arms, pedals = _cranks(rng, crank, min(0.16, crank[2] - 0.14), (0.11, 0.1, 0.105), ((-0.012, 0.11, -0.05), (0.03, 0.19, 0.05)), 0.008)
    wide = min(0.2, 0.75 * half_w)
    seat = cushion(rng, (0.08 * depth, -wide, seat_z - 0.05), (0.36 * depth, wide, seat_z + 0.03), 0.03, 0.03)
    back = rotated(cushion(rng, (-0.03, -wide, 0.0), (0.05, wide, 0.34 * height), 0.03, 0.03, axis=0), "y", math.pi)
    back = moved(rotated(mirrored(back, "z"), "y", 0.18), 0.36 * depth, z=seat_z)
    mast_x, mast_z = -0.2 * depth, 0.86 * height
    mast = sweep([(crank[0] - 0.5 * r, 0.0, crank[2] + 0.3 * r), (mast_x - 0.06, 0.0, mast_z)], 0.028, 10)
    ways = (
        ([mast_x - 0.05, mast_x, mast_x + 0.16], (0.02, 0.8 * half_w), [0.9 * mast_z, 0.92 * mast_z, 0.9 * mast_z], 0.05),
        ([0.3 * depth, 0.28 * depth, 0.12 * depth], (0.1, 0.92 * half_w), [seat_z - 0.08, seat_z - 0.08, seat_z + 0.12], 0.06),
    )
    bars = [bent(points(xs, [s * y0, s * y1, s * y1], zs), 0.015, bend, 8) for xs, (y0, y1), zs, bend in ways for s in (-1.0, 1.0)]
    console, screen = _console((mast_x - 0.04, mast_z - 0.02), 0.15, height - mast_z + 0.02, (0.2, 0.88), -0.35)
    return {
        "frame": merged(*feet, beam, mast),
        "posts": merged(rest, *arms),
        "flywheel": disc("y", hub, 0.6 * r, 0.15, 36, 0.02),
        "cover": merged(*shell),
        "pedals": merged(*pedals),
        "saddle": merged(seat, back),
        "handlebar": merged(*bars),
        "console": console,
        "screen": screen,
    }


MODELS = {
    "treadmill": Model(build_treadmill, ("straight", "curved", "compact")),
    "weight_bench": Model(build_weight_bench, ("flat", "incline", "rollers")),
    "dumbbell_rack": Model(build_dumbbell_rack, ("hexagonal", "round")),
    "gym_ball": Model(build_gym_ball, ("ball",)),
    "exercise_bike": Model(build_exercise_bike, ("spinning", "upright", "recumbent")),
}
