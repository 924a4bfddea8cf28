"""Desk chairs, dining chairs, bar stools and low stools; the sitter looks along +x."""

import math

import numpy as np
from numpy.typing import NDArray

import kernel_cache.elementary as el
from renderer.geometry.lofts import points
from renderer.geometry.mesh import Mesh
from renderer.geometry.shapes import block, blocks, lathe, merged, moved, rod, rotated, rounded_box, sheet, sweep
from renderer.geometry.upholstery import cushion
from renderer.models.model import CORNERS, Model, Parts, Pieces, Size, halved


def build_desk_chair(rng: np.random.Generator, size_m: Size, style: str) -> Pieces:
    """Return an office chair on a five-star base with castors, or a wooden chair on four legs."""
    return {"office": _office_chair, "wooden": _wooden_chair, "shell": _shell_chair}[style](rng, size_m)


def _office_chair(rng: np.random.Generator, size_m: Size) -> Parts:
    depth, width, height = size_m
    base, castors = _star_base(0.5 * min(depth, width))
    seat_z = min(0.46, 0.47 * height)
    column = merged(
        rod((0, 0, 0.13), (0, 0, 0.27), 0.026),
        rod((0, 0, 0.26), (0, 0, seat_z - 0.055), 0.015),
        block((-0.13, -0.08, seat_z - 0.085), (0.11, 0.08, seat_z - 0.05), 0.01),
    )
    half_w = 0.40 * width
    front, back = 0.36 * depth, -0.34 * depth
    seat = cushion(rng, (back, -half_w, seat_z - 0.055), (front, half_w, seat_z + 0.045), 0.038, 0.03)
    back_low = seat_z + 0.10
    rest = cushion(rng, (back - 0.075, -0.92 * half_w, back_low), (back - 0.01, 0.92 * half_w, height - 0.002), 0.03, 0.018, axis=0)
    rest = _curved_back(rest, back_low, half_w)
    spine = sweep(
        points([-0.10, back - 0.05, back - 0.095, back - 0.09], 0.0, [seat_z - 0.066, seat_z - 0.055, seat_z + 0.03, back_low + 0.18]),
        0.02,
        10,
        1.6,
    )
    rests: list[Mesh] = []
    rest_z = 0.6 * height - 0.026
    for s in (-1.0, 1.0):
        y = s * (0.5 * width - 0.035)
        rests.append(
            sweep(
                [(-0.02, s * 0.1, seat_z - 0.065), (-0.02, y - s * 0.05, seat_z - 0.06), (-0.02, y, seat_z - 0.02), (-0.03, y, rest_z)],
                [0.014, 0.014, 0.015, 0.014],
                8,
            )
        )
        rests.append(rounded_box((-0.17, y - 0.035, rest_z - 0.008), (0.11, y + 0.035, rest_z + 0.022), 0.014))
    return {"base": base, "castors": castors, "column": merged(column, spine), "seat": seat, "backrest": rest, "armrests": merged(*rests)}


def _star_base(reach: float) -> tuple[Mesh, Mesh]:
    """Return five arms round a hub, and their castors with twin wheels; the wheels reach to ``reach`` from the middle."""
    arms: list[Mesh] = []
    castors: list[Mesh] = []
    wheel = 0.028
    tip = reach - wheel
    arm = sweep([(0.02, 0.0, 0.115), (0.55 * tip, 0.0, 0.095), (tip, 0.0, 0.07)], [0.026, 0.021, 0.015], 8, 0.7)
    half = [(0.6 * wheel, 0.004), (wheel, 0.005), (wheel, 0.016), (0.8 * wheel, 0.022), (0.0, 0.022)]
    roll = rotated(lathe([*((r, -z) for r, z in half[::-1]), *half], 12), "x", math.pi / 2)
    pin = rod((tip, 0.0, wheel), (tip, 0.0, 0.075), 0.007, segments=8)
    for k in range(5):
        angle = 2.0 * math.pi * k / 5 + math.pi
        arms.append(rotated(arm, "z", angle))
        castors += [
            moved(rotated(roll, "z", angle + 0.8 * k), tip * math.cos(angle), tip * math.sin(angle), wheel),
            rotated(pin, "z", angle),
        ]
    hub = lathe([(0.0, 0.085), (0.045, 0.085), (0.045, 0.12), (0.03, 0.135), (0.0, 0.135)], 16)
    return merged(hub, *arms), merged(*castors)


def _curved_back(mesh: Mesh, low_z: float, half_w: float) -> Mesh:
    """Bend a backrest round the sitter and lean its upper part backward."""
    points = mesh.vertices.astype(np.float64)
    rise = np.maximum(points[:, 2] - low_z, 0.0)
    points[:, 0] += 0.05 * (points[:, 1] / half_w) ** 2 - 0.16 * el.power(rise, 1.5)
    return mesh._replace(vertices=points.astype(np.float32))


def _wooden_chair(rng: np.random.Generator, size_m: Size) -> Parts:
    _, _, height, half_d, half_w = halved(size_m)
    seat_z = min(0.46, 0.54 * height)
    lean = 0.13 * (height - seat_z)
    back_x = -half_d + lean + 0.02
    frame: list[Mesh] = []
    for s in (-1.0, 1.0):
        y = s * (half_w - 0.03)
        frame.append(rod((half_d - 0.025, y, 0.0), (half_d - 0.045, s * (half_w - 0.04), seat_z - 0.02), 0.013, 0.02))
        frame.append(
            sweep(
                points(
                    [back_x - 0.05, back_x, back_x - 0.3 * lean, -half_d + 0.02], y, [0.0, seat_z, seat_z + 0.4 * (height - seat_z), height]
                ),
                [0.014, 0.019, 0.018, 0.014],
                12,
            )
        )
        frame.append(rod((half_d - 0.04, s * (half_w - 0.04), 0.42 * seat_z), (back_x - 0.02, y, 0.42 * seat_z), 0.009))
    for z in (seat_z - 0.045,):
        frame.append(block((back_x, -half_w + 0.035, z - 0.025), (back_x + 0.018, half_w - 0.035, z + 0.025)))
        frame.append(block((half_d - 0.055, -half_w + 0.04, z - 0.025), (half_d - 0.035, half_w - 0.04, z + 0.025)))
        frame += [block((back_x, s * (half_w - 0.038), z - 0.025), (half_d - 0.045, s * (half_w - 0.055), z + 0.025)) for s in (-1.0, 1.0)]
    rails = [
        _back_rail(-half_d + 0.012 + 0.3 * t * lean, half_w - 0.035, height - 0.005 - 0.16 * t, 0.06 if t else 0.085)
        for t in range(int(rng.integers(2, 4)))
    ]
    seat = cushion(rng, (back_x - 0.01, -half_w + 0.012, seat_z - 0.02), (half_d, half_w - 0.012, seat_z + 0.032), 0.018, 0.014)
    return {"frame": merged(*frame), "seat": seat, "backrest": merged(*rails)}


def _back_rail(x: float, half_w: float, top: float, tall: float) -> Mesh:
    """Return a board between the back posts, bent backward in the middle."""
    y = np.linspace(-half_w, half_w, 15)
    bow = x + 0.02 * (y / half_w) ** 2
    front = np.stack([points(bow + 0.012, y, top - tall), points(bow + 0.006, y, top)], axis=1)
    return sheet(front, front - np.array([0.014, 0.0, 0.0]))


def _shell_chair(rng: np.random.Generator, size_m: Size) -> Parts:
    """A moulded shell, seat and back in one curve, on four splayed wooden legs with a seat pad."""
    _, _, height, half_d, half_w = halved(size_m)
    seat_z = min(0.45, 0.55 * height)
    rise = height - seat_z
    profile = points(
        [half_d, half_d - 0.03, 0.4 * half_d, -0.25 * half_d, -0.55 * half_d, -0.75 * half_d, -0.88 * half_d, -half_d + 0.012],
        [seat_z - 0.03, seat_z + 0.005, seat_z, seat_z - 0.015, seat_z + 0.02, seat_z + 0.25 * rise, seat_z + 0.6 * rise, height],
    )
    t = np.linspace(0.0, 1.0, len(profile))
    fine = np.linspace(0.0, 1.0, 25)
    curve = np.column_stack([_smooth(t, profile[:, 0], fine), _smooth(t, profile[:, 1], fine)])
    v = np.linspace(-1.0, 1.0, 17)
    uu, vv = np.meshgrid(np.arange(25), v, indexing="ij")
    taper = 1.0 - 0.24 * el.power(np.clip((fine - 0.5) / 0.5, 0.0, 1.0), 1.5)
    round_front = 1.0 - 0.30 * el.power(np.clip(1.0 - fine / 0.14, 0.0, 1.0), 2.2)
    round_top = 1.0 - 0.34 * el.power(np.clip(1.0 - (1.0 - fine) / 0.14, 0.0, 1.0), 2.2)
    y = half_w * vv * (taper * round_front * round_top)[uu]
    along = np.gradient(curve, axis=0)
    along /= np.linalg.norm(along, axis=1, keepdims=True)
    strength = 0.075 * np.interp(fine, [0.0, 0.15, 0.42, 0.7, 1.0], [0.0, 0.35, 1.0, 0.9, 0.35])
    wing = strength[uu] * el.power(np.abs(vv), 2.4)
    x = curve[uu, 0] + wing * along[uu, 1]
    z = curve[uu, 1] - wing * along[uu, 0]
    top = np.dstack([x, y, z])[::-1]
    shell = sheet(top, top - np.array([0.006, 0.0, 0.008]))
    legs = []
    for sx in (-1.0, 1.0):
        for sy in (-1.0, 1.0):
            legs.append(
                rod((sx * (half_d - 0.03), sy * (half_w - 0.03), 0.0), (sx * 0.42 * half_d, sy * 0.4 * half_w, seat_z - 0.02), 0.011, 0.019)
            )
    braces = [
        rod((-0.42 * half_d, -0.4 * half_w, seat_z - 0.04), (0.42 * half_d, 0.4 * half_w, seat_z - 0.04), 0.008),
        rod((0.42 * half_d, -0.4 * half_w, seat_z - 0.04), (-0.42 * half_d, 0.4 * half_w, seat_z - 0.04), 0.008),
    ]
    pad = cushion(rng, (-0.42 * half_d, -0.62 * half_w, seat_z - 0.012), (0.72 * half_d, 0.62 * half_w, seat_z + 0.026), 0.017, 0.014)
    return {"frame": merged(*legs, *braces), "seat": pad, "backrest": shell}


def _smooth(t: NDArray[np.float64], values: NDArray[np.float64], fine: NDArray[np.float64]) -> NDArray[np.float64]:
    """Interpolate with a cubic Hermite spline of centred slopes."""
    slope = np.gradient(values, t)
    i = np.clip(np.searchsorted(t, fine, side="right") - 1, 0, len(t) - 2)
    step = t[i + 1] - t[i]
    s = (fine - t[i]) / step
    return np.asarray(
        (1 + 2 * s) * (1 - s) ** 2 * values[i]
        + s * (1 - s) ** 2 * step * slope[i]
        + s**2 * (3 - 2 * s) * values[i + 1]
        + s**2 * (s - 1) * step * slope[i + 1]
    )


def build_dining_chair(rng: np.random.Generator, size_m: Size, style: str) -> Pieces:
    """Return a dining chair: upright slats, a cross between the back posts, or a padded back and seat on tapered legs."""
    return {"slats": _slats, "cross": _cross, "padded": _padded}[style](rng, size_m)


def _post_x(z: float, half_d: float, seat_z: float, height: float) -> float:
    """Return where along x the middle of a back post lies at height z; it leans backward above the seat and below it."""
    return float(np.interp(z, [0.0, seat_z, height], [-half_d + 0.03, -half_d + 0.075, -half_d + 0.018]))


def _wooden_frame(size_m: Size, seat_z: float) -> list[Mesh]:
    """Return legs, back posts, stretchers and the seat's frame."""
    _, _, height, half_d, half_w = halved(size_m)
    frame: list[Mesh] = []
    for s in (-1.0, 1.0):
        y = s * (half_w - 0.025)
        zs = [0.0, 0.5 * seat_z, seat_z, seat_z + 0.5 * (height - seat_z), height - 0.002]
        path = [(_post_x(z, half_d, seat_z, height), y, z) for z in zs]
        frame.append(sweep(path, [0.015, 0.018, 0.02, 0.018, 0.014], 12))
        frame.append(rod((half_d - 0.025, s * (half_w - 0.022), 0.0), (half_d - 0.04, s * (half_w - 0.03), seat_z - 0.01), 0.014, 0.02))
        frame.append(rod((half_d - 0.04, s * (half_w - 0.03), 0.4 * seat_z), (-half_d + 0.06, y, 0.4 * seat_z), 0.009))
        low, high = sorted((s * (half_w - 0.02), s * (half_w - 0.042)))
        frame.append(block((-half_d + 0.06, low, seat_z - 0.07), (half_d - 0.03, high, seat_z - 0.012)))
    for x in (-half_d + 0.065, half_d - 0.05):
        frame.append(block((x, -half_w + 0.035, seat_z - 0.07), (x + 0.02, half_w - 0.035, seat_z - 0.012)))
    frame.append(rod((0.0, -half_w + 0.03, 0.4 * seat_z), (0.0, half_w - 0.03, 0.4 * seat_z), 0.009))
    return frame


def _rail(x: float, half_w: float, low: float, high: float, lean: float, bow: float = 0.022) -> Mesh:
    """Return a board between the back posts, bent backward in the middle; its upper edge lies ``lean`` behind its lower one."""
    y = np.linspace(-half_w, half_w, 15)
    back = x - bow * (1.0 - (y / half_w) ** 2)
    thick = 0.018
    front = np.stack([points(back + 0.5 * thick, y, low), points(back + 0.5 * thick - lean, y, high)], axis=1)
    return sheet(front, front - np.array([thick, 0.0, 0.0]))


def _seat_board(rng: np.random.Generator, size_m: Size, seat_z: float) -> Mesh:
    half_d, half_w = 0.5 * size_m[0], 0.5 * size_m[1]
    return cushion(rng, (-half_d + 0.085, -half_w + 0.004, seat_z - 0.014), (half_d, half_w - 0.004, seat_z + 0.03), 0.018, 0.012)


def _slats(rng: np.random.Generator, size_m: Size) -> Parts:
    _, _, height, half_d, half_w = halved(size_m)
    seat_z = min(0.46, 0.505 * height)
    span = half_w - 0.03
    top = height - 0.01
    bottom = seat_z + 0.14 * (height - seat_z)
    x_top, x_low = (_post_x(z, half_d, seat_z, height) for z in (top - 0.07, bottom))
    rails = [_rail(x_top, span, top - 0.08, top, 0.006), _rail(x_low, span, bottom - 0.02, bottom + 0.02, 0.002, 0.012)]
    count = int(rng.integers(5, 9))
    for y in np.linspace(-0.78 * span, 0.78 * span, count):
        share = 1.0 - (y / span) ** 2
        start, end = (x_low - 0.012 * share, y, bottom + 0.01), (x_top - 0.022 * share, y, top - 0.07)
        rails.append(sweep(np.linspace(start, end, 4), 0.0085, 8))
    return {"frame": merged(*_wooden_frame(size_m, seat_z)), "seat": _seat_board(rng, size_m, seat_z), "backrest": merged(*rails)}


def _cross(rng: np.random.Generator, size_m: Size) -> Parts:
    _, _, height, half_d, half_w = halved(size_m)
    seat_z = min(0.46, 0.505 * height)
    span = half_w - 0.028
    top = height - 0.006
    x_top, x_low = (_post_x(z, half_d, seat_z, height) for z in (top - 0.06, seat_z + 0.1))
    rails = [_rail(x_top, span, top - 0.065, top, 0.005)]
    t = np.linspace(-1.0, 1.0, 9)
    for s in (-1.0, 1.0):
        z = seat_z + 0.03 + (top - 0.07 - seat_z) * 0.5 * (t + 1.0)
        x = x_low + (x_top - x_low) * 0.5 * (t + 1.0) - 0.02 * (1.0 - t**2) - 0.008 * s
        rails.append(sweep(np.column_stack([x, s * 0.94 * span * t, z]), 0.011, 8))
    return {"frame": merged(*_wooden_frame(size_m, seat_z)), "seat": _seat_board(rng, size_m, seat_z), "backrest": merged(*rails)}


def _padded(rng: np.random.Generator, size_m: Size) -> Parts:
    _, _, height, half_d, half_w = halved(size_m)
    seat_z = min(0.48, 0.505 * height)
    legs = [
        rod((sx * (half_d - 0.025), sy * (half_w - 0.025), 0.0), (sx * (half_d - 0.06), sy * (half_w - 0.05), seat_z - 0.05), 0.011, 0.02)
        for sx, sy in CORNERS
    ]
    seat = cushion(rng, (-half_d + 0.06, -half_w, seat_z - 0.075), (half_d, half_w, seat_z + 0.025), 0.035, 0.022)
    rest = cushion(rng, (-half_d + 0.045, -half_w + 0.012, seat_z - 0.06), (-half_d + 0.095, half_w - 0.012, height), 0.02, 0.014, axis=0)
    points = rest.vertices.astype(np.float64)
    rise = np.clip((points[:, 2] - seat_z) / (height - seat_z), 0.0, 1.0)
    points[:, 0] += 0.018 * (points[:, 1] / half_w) ** 2 - 0.045 * el.power(rise, 1.3)
    points[:, 1] *= 1.0 - 0.1 * rise**2
    return {"frame": merged(*legs), "seat": seat, "back": rest._replace(vertices=points.astype(np.float32))}


def build_bar_stool(rng: np.random.Generator, size_m: Size, style: str) -> Pieces:
    """Return a high stool with a ring for the feet: round on four legs, or a padded seat with a low back on a column and plate."""
    _, _, height, half_d, half_w = halved(size_m)
    r = min(half_d, half_w)
    if style == "round":
        top = height - 0.035
        profile = [(0.0, top), (0.68 * r, top), (0.78 * r, top + 0.012), (0.78 * r, height - 0.008), (0.72 * r, height)]
        seat = lathe([*profile, (0.4 * r, height - 0.006), (0.0, height - 0.009)], 36)
        out = 0.94 * r / math.sqrt(2.0)
        legs, rails = [], []
        feet_z = 0.34 * height
        for sx, sy in ((-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)):
            legs.append(rod((sx * out, sy * out, 0.0), (sx * 0.6 * out, sy * 0.6 * out, top + 0.004), 0.014, 0.019))
        at = out * (1.0 - 0.4 * feet_z / top)
        corners = [(-at, -at), (at, -at), (at, at), (-at, at)]
        for k, ((ax, ay), (bx, by)) in enumerate(zip(corners, corners[1:] + corners[:1], strict=True)):
            z = feet_z + (0.05 if k % 2 else 0.0)
            rails.append(rod((ax, ay, z), (bx, by, z), 0.01))
        return {"legs": legs, "footrest": rails, "seat": seat}
    seat_z = min(0.68, 0.76 * height)
    plate = lathe([(0.0, 0.0), (r, 0.0), (r, 0.006), (0.95 * r, 0.012), (0.2 * r, 0.022), (0.03, 0.05), (0.0, 0.05)], 40)
    column = rod((0.0, 0.0, 0.02), (0.0, 0.0, seat_z - 0.06), 0.022, segments=20)
    angles = np.arange(10) * (2.0 * math.pi / 10)
    ring = lathe([(0.62 * r + 0.01 * math.cos(a), 0.32 * seat_z + 0.01 * math.sin(a)) for a in angles], 32, closed=True)
    arm = rod((0.0, 0.0, 0.32 * seat_z), (0.62 * r, 0.0, 0.32 * seat_z), 0.009)
    seat = cushion(rng, (-0.9 * r, -0.95 * r, seat_z - 0.06), (r, 0.95 * r, seat_z + 0.025), 0.045, 0.02)
    under = rounded_box((-0.5 * r, -0.5 * r, seat_z - 0.075), (0.5 * r, 0.5 * r, seat_z - 0.05), 0.01)
    return {"legs": [plate, column, under], "footrest": [ring, arm], "seat": [seat, _low_back(0.95 * r, seat_z - 0.03, height)]}


def _low_back(r: float, low: float, high: float) -> Mesh:
    """Return a padded band round the back of a seat."""
    angle = np.linspace(math.radians(105.0), math.radians(255.0), 22)
    v = np.linspace(0.0, 1.0, 6)
    aa, vv = np.meshgrid(angle, v, indexing="ij")
    fade = np.sqrt(el.sin((aa - angle[0]) / (angle[-1] - angle[0]) * math.pi))
    z = low + (high - low) * vv * (0.45 + 0.55 * fade)
    thick = 0.045 * np.sqrt(np.clip(1.0 - el.power(2.0 * vv - 1.0, 4), 0.05, 1.0))
    outer = np.dstack([r * 1.02 * el.cos(aa), r * 1.0 * el.sin(aa), z])
    inner = np.dstack([(r - thick) * el.cos(aa), (r - thick) * el.sin(aa), z])
    return sheet(outer, inner)


def build_stool(rng: np.random.Generator, size_m: Size, style: str) -> Pieces:
    """Return a low stool on four legs with a round, slightly hollow seat, or a square one on an apron."""
    del rng
    _, _, height, half_d, half_w = halved(size_m)
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
    return {"legs": [*legs, *rails], "seat": seat}


MODELS = {
    "desk_chair": Model(build_desk_chair, ("office", "wooden", "shell")),
    "dining_chair": Model(build_dining_chair, ("slats", "cross", "padded")),
    "bar_stool": Model(build_bar_stool, ("round", "backed")),
    "stool": Model(build_stool, ("round", "square")),
}
