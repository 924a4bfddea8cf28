"""Large kitchen appliances: stoves, refrigerators, range hoods; fronts look along +x."""

import numpy as np

from renderer.geometry.lofts import points
from renderer.geometry.mesh import Mesh
from renderer.geometry.shapes import block, blocks, flat_quads, lathe, merged, moved, rounded_box, slab
from renderer.models.cabinets import bar_handle
from renderer.models.kitchen import OVERHANG_M, PLINTH_M, turned_knob
from renderer.models.model import Model, Pieces, Size, halved
from renderer.models.small_things import turned_forward


def build_stove(rng: np.random.Generator, size_m: Size, style: str) -> Pieces:
    """Return an oven with a hob: a glass hob with marked zones, gas burners under grates up to the full height, or solid iron plates."""
    _, _, height, half_d, half = halved(size_m)
    front = half_d - OVERHANG_M
    low = min(PLINTH_M, 0.13 * height)
    hob_z = height - {"ceramic": 0.0, "gas": 0.03, "plates": 0.005}[style]
    panel_low = hob_z - 0.14 * height
    body = [block((-half_d + 0.005, -half + 0.002, low), (front - 0.02, half - 0.002, hob_z - 0.012))]
    body.append(block((-half_d, -half, hob_z - 0.03), (half_d, half, hob_z - (0.004 if style == "ceramic" else 0.0)), 0.003))
    body.append(rounded_box((front - 0.03, -half + 0.003, panel_low), (front, half - 0.003, hob_z - 0.032), 0.006))
    body.append(block((-half_d + 0.03, -half + 0.004, 0.0), (front - 0.05, half - 0.004, low + 0.002), 0.002))
    drawer_top = low + 0.17 * (panel_low - low)
    door_low, door_high = drawer_top + 0.004, panel_low - 0.004
    door = [
        rounded_box((front - 0.03, -half + 0.004, low + 0.004), (front, half - 0.004, drawer_top), 0.005),
        rounded_box((front - 0.03, -half + 0.004, door_low), (front, half - 0.004, door_high), 0.005),
    ]
    rise = door_high - door_low
    glass = rounded_box((front - 0.004, -0.74 * half, door_low + 0.14 * rise), (front + 0.002, 0.74 * half, door_high - 0.22 * rise), 0.002)
    reach = OVERHANG_M - 0.004
    handle = [bar_handle(front, 0.0, door_high - 0.08 * rise, 1.55 * half, reach), bar_handle(front, 0.0, drawer_top - 0.03, half, reach)]
    z, r = 0.5 * (panel_low + hob_z - 0.032), min(0.02, 0.2 * (hob_z - panel_low))
    knobs = [turned_knob(front, s * half, z, r, reach) for s in (-0.8, -0.58, -0.36, 0.36, 0.58, 0.8)]
    clock = block((front - 0.001, -0.2 * half, z - 0.6 * r), (front + 0.001, 0.2 * half, z + 0.6 * r), 0.0005)
    spots = [
        (x * half_d, y * half, r * half) for x, y, r in ((-0.44, -0.5, 0.26), (0.36, -0.5, 0.34), (-0.44, 0.5, 0.36), (0.36, 0.5, 0.26))
    ]
    hob, rings = {
        "ceramic": lambda: _ceramic(spots, half_d, half, height),
        "gas": lambda: _gas(spots, half_d, half, hob_z, height),
        "plates": lambda: _plates(spots, half_d, half, hob_z, height),
    }[style]()
    return {"body": body, "door": door, "glass": [glass, clock], "handle": handle, "knobs": knobs, "hob": hob, "rings": rings}


def _ceramic(spots: list[tuple[float, float, float]], half_d: float, half: float, height: float) -> tuple[Mesh, Mesh]:
    """Return the glass plate and the rings printed on it round the cooking zones."""
    plate = block((-half_d + 0.02, -half + 0.012, height - 0.008), (half_d - 0.025, half - 0.012, height - 0.0004), 0.002)
    rings = []
    for x, y, r in spots:
        for share in (1.0, 0.62):
            a, b = share * r, share * r - 0.004
            line = [(b, height - 0.002), (a, height - 0.002), (a, height), (b, height)]
            rings.append(moved(lathe(line, 40, closed=True), x, y))
    return plate, merged(*rings)


def _gas(spots: list[tuple[float, float, float]], half_d: float, half: float, hob_z: float, top: float) -> tuple[Mesh, Mesh]:
    """Return the enamelled tray, and burners with caps under two iron grates."""
    tray = block((-half_d + 0.02, -half + 0.012, hob_z - 0.004), (half_d - 0.025, half - 0.012, hob_z + 0.002), 0.002)
    pieces = []
    for x, y, r in spots:
        q = 0.42 * r
        lower = [(0.0, 0.0), (q, 0.0), (q, 0.008), (0.85 * q, 0.012), (0.85 * q, 0.016), (0.7 * q, 0.019), (0.0, 0.019)]
        pieces.append(moved(lathe(lower, 20), x, y, hob_z + 0.001))
    bar, low, high = 0.009, [], []
    for s in (-1.0, 1.0):
        y0, y1 = sorted((s * 0.02 * half, s * 0.96 * half))
        x0, x1 = -0.9 * half_d, 0.86 * half_d
        for y in (y0, y1 - bar):
            low.append((x0, y, top - 0.012))
            high.append((x1, y + bar, top))
        for x in np.linspace(x0, x1 - bar, 7):
            low.append((x, y0, top - 0.012))
            high.append((x + bar, y1, top))
        for x, y in ((a, b) for a in (x0, x1 - bar) for b in (y0, y1 - bar)):
            low.append((x, y, hob_z))
            high.append((x + bar, y + bar, top - 0.004))
    for x, y, r in spots:
        for dx, dy in ((1.0, 0.0), (-1.0, 0.0), (0.0, 1.0), (0.0, -1.0)):
            ends = np.sort([[x + 0.25 * r * dx, x + 1.15 * r * dx], [y + 0.25 * r * dy, y + 1.15 * r * dy]], axis=1)
            low.append((float(ends[0, 0]) - 0.004, float(ends[1, 0]) - 0.004, top - 0.01))
            high.append((float(ends[0, 1]) + 0.004, float(ends[1, 1]) + 0.004, top))
    return tray, merged(*pieces, blocks(low, high, 0.002))


def _plates(spots: list[tuple[float, float, float]], half_d: float, half: float, hob_z: float, top: float) -> tuple[Mesh, Mesh]:
    """Return the enamelled tray with steel collars, and iron cooking plates with a dished middle."""
    tray = [block((-half_d + 0.02, -half + 0.012, hob_z - 0.004), (half_d - 0.025, half - 0.012, hob_z + 0.002), 0.002)]
    irons = []
    for x, y, r in spots:
        q = 0.92 * r
        collar = [(0.0, hob_z), (1.1 * q, hob_z), (1.1 * q, hob_z + 0.001), (1.02 * q, hob_z + 0.003), (0.0, hob_z + 0.003)]
        tray.append(moved(lathe(collar, 32), x, y))
        plate = [(0.0, hob_z + 0.001), (q, hob_z + 0.001), (q, top - 0.001), (0.97 * q, top), (0.3 * q, top), (0.24 * q, top - 0.002)]
        irons.append(moved(lathe([*plate, (0.0, top - 0.002)], 32), x, y))
    return merged(*tray), merged(*irons)


def build_refrigerator(rng: np.random.Generator, size_m: Size, style: str) -> Pieces:
    """Return a refrigerator: two doors above each other, two side by side with a dispenser, or rounded and old-fashioned."""
    depth, width, height, half_d, half = halved(size_m)
    reach = min(0.045, 0.08 * depth)
    front = half_d - reach
    thick = 0.075
    low = 0.05
    feet = block((-half_d + 0.03, -half + 0.02, 0.0), (front - thick - 0.01, half - 0.02, low + 0.002), 0.002)
    case_radius = 0.06 if style == "retro" else 0.006
    body = rounded_box((-half_d, -half, low - 0.02), (front - thick - 0.008, half, height), case_radius, 4)
    seal = block((front - thick - 0.012, -half + 0.02, low + 0.02), (front - thick + 0.004, half - 0.02, height - 0.02), 0.001)
    bar_y = half - 0.05

    def leaf(left: float, right: float, bottom: float, top: float) -> Mesh:
        radius = 0.05 if style == "retro" else 0.009
        return rounded_box((front - thick, left, bottom), (front, right, top), min(radius, 0.45 * thick if style != "retro" else 0.04), 4)

    if style == "side_by_side":
        split = -0.08 * width
        doors = [leaf(-half, split - 0.003, low, height), leaf(split + 0.003, half, low, height)]
        length = 0.5 * height
        handles = [bar_handle(front, y, 0.55 * height, length, reach, upright=True) for y in (split - 0.045, split + 0.045)]
        y, z = 0.5 * (split - half), 0.62 * height
        w, h = 0.28 * (split + half), 0.09 * height
        niche = [
            rounded_box((front - 0.004, y - w, z - h), (front + 0.003, y + w, z + h), 0.002),
            block((front - 0.001, y - 0.7 * w, z + 0.55 * h), (front + 0.005, y + 0.7 * w, z + 0.85 * h), 0.001),
            block((front - 0.001, y - 0.35 * w, z - 0.2 * h), (front + 0.012, y + 0.35 * w, z + 0.25 * h), 0.003),
        ]
        return {"body": body, "doors": doors, "handles": handles, "trim": [feet, seal, *niche]}
    freezer_above = style == "retro" or bool(rng.random() < 0.25)
    split = low + (rng.uniform(0.68, 0.73) if freezer_above else rng.uniform(0.34, 0.42)) * (height - low)
    doors = [leaf(-half, half, low, split - 0.004), leaf(-half, half, split + 0.004, height)]
    spans = [(low, split), (split, height)]
    handles = []
    for k, (z0, z1) in enumerate(spans):
        length = min(0.5, 0.55 * (z1 - z0))
        z = z1 - 0.06 - 0.5 * length if k == 0 else z0 + 0.06 + 0.5 * length
        if style == "retro":
            handles.append(bar_handle(front, 0.55 * bar_y, z1 - 0.1, 0.4 * width, reach))
        else:
            handles.append(bar_handle(front, bar_y, z, length, reach, upright=True))
    badge = block((front - 0.002, -0.12 * half, height - 0.12), (front + 0.002, 0.12 * half, height - 0.1), 0.0008)
    return {"body": body, "doors": doors, "handles": handles, "trim": [feet, seal, badge]}


def _frustum(low: tuple[float, float, float, float], high: tuple[float, float, float, float], z0: float, z1: float) -> Mesh:
    """Return a body between two rectangles (x0, y0, x1, y1) at heights z0 and z1."""
    foot, top = ([(a[0], a[1], z), (a[2], a[1], z), (a[2], a[3], z), (a[0], a[3], z)] for a, z in ((low, z0), (high, z1)))
    sides = [[foot[k], foot[(k + 1) % 4], top[(k + 1) % 4], top[k]] for k in range(4)]
    return flat_quads(np.asarray([*sides, top, foot[::-1]]))


def build_range_hood(rng: np.random.Generator, size_m: Size, style: str) -> Pieces:
    """Return a hood for the wall: a pyramid with a chimney, a flat visor under a box, or a slab that slants forward."""
    depth, width, height, half_d, half = halved(size_m)
    duct_d, duct_w = min(0.26, 0.6 * depth), min(0.3, 0.5 * width)
    duct = block((-half_d, -0.5 * duct_w, 0.3 * height), (-half_d + duct_d, 0.5 * duct_w, height), 0.003)
    sleeve = block((-half_d, -0.5 * duct_w - 0.004, 0.3 * height), (-half_d + duct_d + 0.004, 0.5 * duct_w + 0.004, 0.72 * height), 0.002)
    if style == "pyramid":
        lip = min(0.05, 0.12 * height)
        skirt = [
            block((-half_d, -half, 0.0), (half_d, -half + 0.012, lip), 0.002),
            block((-half_d, half - 0.012, 0.0), (half_d, half, lip), 0.002),
            block((half_d - 0.012, -half + 0.002, 0.0), (half_d, half - 0.002, lip), 0.002),
            block((-half_d, -half + 0.002, 0.0), (-half_d + 0.012, half - 0.002, lip), 0.002),
        ]
        slope = _frustum(
            (-half_d, -half + 0.001, half_d - 0.001, half - 0.001),
            (-half_d, -0.5 * duct_w - 0.01, -half_d + duct_d + 0.01, 0.5 * duct_w + 0.01),
            lip - 0.001,
            min(0.42 * height, lip + 0.3),
        )
        body = [duct, sleeve, slope, *skirt]
        filter_z, knob_x, knob_z = 0.3 * lip, half_d, 0.5 * lip
        panes = _filters(-half_d + 0.02, half_d - 0.02, half - 0.03, filter_z, 0.9 * lip - filter_z)
    elif style == "slanted":
        lip = 0.06 * height
        rise = 0.72 * height
        corners = points(
            [-half_d, -half_d + 0.34 * depth, half_d, half_d - 0.1 * depth, -half_d], [0.0, 0.0, rise - lip, rise, 0.3 * height]
        )
        slope = slab(corners, -half, half)
        order = [0, 2, 1]
        slope = slope._replace(
            vertices=np.ascontiguousarray(slope.vertices[:, order]),
            normals=np.ascontiguousarray(slope.normals[:, order]),
            faces=np.ascontiguousarray(slope.faces[:, ::-1]),
        )
        body = [duct, sleeve, slope]
        panes = _filters(-half_d + 0.02, -half_d + 0.3 * depth, half - 0.03, -0.002, 0.008)
        knob_x, knob_z = -half_d + 0.3 * depth, 0.001
    else:
        box = 0.5 * depth
        lip = 0.32 * height
        body = [duct, sleeve, block((-half_d, -half + 0.01, 0.03 * height), (-half_d + box, half - 0.01, lip + 0.01), 0.004)]
        front = blocks([(-half_d, -half, 0.0)], [(half_d, half, 0.035 * height)], 0.004)
        body.append(front)
        panes = _filters(-half_d + 0.02, half_d - 0.02, half - 0.03, -0.004, 0.012)
        knob_x, knob_z = -half_d + box, 0.6 * lip
    buttons = [
        turned_forward(
            [(0.0, knob_x - 0.004), (0.009, knob_x - 0.004), (0.009, knob_x + 0.004), (0.0, knob_x + 0.004)], 0.03 * k, knob_z, 14
        )
        for k in range(-2, 3)
    ]
    return {"body": body, "filter": panes, "buttons": buttons}


def _filters(x0: float, x1: float, half: float, z: float, thick: float) -> Mesh:
    """Return two grease filters with ribs that show below."""
    low, high = [(x0, -half, z)], [(x1, half, z + thick)]
    count = 14
    for y0, y1 in ((-half + 0.01, -0.006), (0.006, half - 0.01)):
        step = (y1 - y0) / count
        low += [(x0 + 0.01, y0 + step * k, z - 0.002) for k in range(count)]
        high += [(x1 - 0.01, y0 + step * k + 0.55 * step, z + 0.5 * thick) for k in range(count)]
    return blocks(low, high, 0.001)


MODELS = {
    "stove": Model(build_stove, ("ceramic", "gas", "plates")),
    "refrigerator": Model(build_refrigerator, ("two_doors", "side_by_side", "retro")),
    "range_hood": Model(build_range_hood, ("pyramid", "flat", "slanted")),
}
