"""Low and high case furniture: media units, sideboards, wall shelves, bookshelves filled with books, stacks of books."""

import itertools
from collections.abc import Iterable

import numpy as np

import kernel_cache.elementary as el
from renderer.geometry.lofts import points
from renderer.geometry.mesh import Mesh
from renderer.geometry.shapes import block, blocks, lathe, merged, moved, rod, rotated
from renderer.models.cabinets import PANEL_M, Front, carcass, case_places, fronts, pulls, splayed_legs, square_legs
from renderer.models.model import Model, Parts, Pieces, Size, halved
from renderer.models.office import keycaps


def build_tv_stand(rng: np.random.Generator, size_m: Size, style: str) -> Pieces:
    """Return a long low unit: open bays over drawers on a plinth, slatted doors on splayed legs, or wide drawers on metal runners."""
    _, width, height = size_m
    back, front, half, body_depth, reach = case_places(size_m, 0.016, 0.004)
    leg = {"open": 0.12, "slatted": 0.32, "runners": 0.3}[style] * height
    inner = half - PANEL_M - 0.005
    count = max(2, round(width / 0.55))
    edges = np.linspace(-inner, inner, count + 1)
    low, top = leg + 0.02, height - 0.025
    body = [carcass(body_depth, width, leg, height, 0.005, back)]
    body.append(_uprights(edges[1:-1], back + 0.006, front - 0.02, leg + 0.004, height - 0.02))
    if style == "open":
        split = low + 0.5 * (top - low)
        body.append(block((back + 0.006, -inner, split - 0.009), (front - 0.02, inner, split + 0.009), 0.002))
        areas = [Front(float(a), float(b), low - 0.004, split + 0.004) for a, b in itertools.pairwise(edges)]
        drawers = fronts(front, areas)
        legs = block((back + 0.03, -half + 0.04, 0.0), (front - 0.04, half - 0.04, leg + 0.002))
    elif style == "runners":
        levels = np.linspace(low - 0.004, top, 2 if height < 0.45 else 3)
        sides = [(float(edges[0]), float(edges[len(edges) // 2])), (float(edges[len(edges) // 2]), float(edges[-1]))]
        areas = [Front(a, b, float(z0), float(z1)) for a, b in sides for z0, z1 in itertools.pairwise(levels)]
        drawers = fronts(front, areas)
        legs = _runners(back + 0.03, front - 0.03, half - 0.16 * width, leg)
    else:
        areas = [Front(float(a), float(b), low - 0.004, top) for a, b in itertools.pairwise(edges)]
        drawers = _slatted(front, areas)
        legs = splayed_legs(back, front, half, leg, 0.03, 0.019)
    handles = pulls(front, areas, "cup", reach + 0.002)
    return {"body": body, "drawers": drawers, "handles": handles, "legs": legs}


def _uprights(ys: np.ndarray, x0: float, x1: float, low: float, high: float) -> Mesh:
    """Return upright boards inside a case at the given y, or a strip at the back where there are none."""
    spots = ys if len(ys) else np.zeros(1)
    return blocks([(x0, y - 0.009, low) for y in spots], [(x1, y + 0.009, high) for y in spots], 0.002)


def _runners(x0: float, x1: float, half_w: float, height: float, bar: float = 0.016) -> Mesh:
    """Return two rectangular loops of flat steel that stand across the depth."""
    low, high = [], []
    for y in (-half_w, half_w):
        low += [(x0, y - 0.02, 0.0), (x1 - bar, y - 0.02, 0.0), (x0, y - 0.02, 0.0), (x0, y - 0.02, height - bar)]
        high += [(x0 + bar, y + 0.02, height), (x1, y + 0.02, height), (x1, y + 0.02, bar), (x1, y + 0.02, height + 0.001)]
    return blocks(low, high, 0.002)


def _slatted(x: float, areas: list[Front]) -> Mesh:
    """Return doors of upright slats on a board."""
    low, high = [], []
    for a in areas:
        low.append((x - 0.018, a.left + 0.0015, a.low + 0.0015))
        high.append((x - 0.008, a.right - 0.0015, a.high - 0.0015))
        count = max(4, round((a.right - a.left) / 0.022))
        edges = np.linspace(a.left + 0.002, a.right - 0.002, count + 1)
        low += [(x - 0.009, s + 0.002, a.low + 0.002) for s in edges[:-1]]
        high += [(x, e - 0.004, a.high - 0.002) for e in edges[1:]]
    return blocks(low, high, 0.0015)


def build_sideboard(rng: np.random.Generator, size_m: Size, style: str) -> Pieces:
    """Return a sideboard: drawers between doors; plain on a plinth, framed on feet, or mid-century on splayed legs."""
    _, width, height = size_m
    back, front, half, body_depth, reach = case_places(size_m, 0.02, 0.006)
    leg = {"plain": 0.07, "framed": 0.1, "midcentury": min(0.2, 0.26 * height)}[style]
    inner = half - PANEL_M - 0.007
    count = max(2, round(width / rng.uniform(0.42, 0.52)))
    edges = [float(edge) for edge in np.linspace(-inner, inner, count + 1)]
    low, top = leg + 0.01, height - 0.028
    drawer_column = int(rng.integers(count))
    doors, drawers = [], []
    for k, (a, b) in enumerate(itertools.pairwise(edges)):
        if k == drawer_column:
            levels = np.linspace(low, top, max(2, round((top - low) / 0.2)) + 1)
            drawers += [Front(a, b, float(z0), float(z1)) for z0, z1 in itertools.pairwise(levels)]
        else:
            doors.append(Front(a, b, low, top))
    knob = {"plain": "bar", "framed": "knob", "midcentury": "cup"}[style]
    legs = {
        "plain": lambda: block((back + 0.03, -half + 0.03, 0.0), (front - 0.05, half - 0.03, leg + 0.002)),
        "framed": lambda: square_legs(back, front, half, leg, 0.055, 0.004),
        "midcentury": lambda: splayed_legs(back, front, half, leg, 0.03, 0.02),
    }[style]()
    return {
        "body": carcass(body_depth, width, leg, height, 0.007, back),
        "drawers": fronts(front, [*doors, *drawers], framed=style == "framed"),
        "handles": [pulls(front, drawers, knob, reach + 0.005), pulls(front, doors, knob, reach + 0.005)],
        "legs": legs,
    }


def build_wall_shelf(rng: np.random.Generator, size_m: Size, style: str) -> Pieces:
    """Return a shelf on a wall: a board on brackets, or a box open to the front; its top is flat."""
    depth, width, height, half_d, half_w = halved(size_m)
    if style == "box":
        board = min(0.018, 0.2 * height)
        low = [(-half_d, -half_w, 0.0), (-half_d, -half_w, height - board), (-half_d, -half_w, 0.0), (-half_d, half_w - board, 0.0)]
        high = points(
            [half_d - 0.002, half_d, half_d - 0.002, half_d - 0.002],
            [half_w, half_w, -half_w + board, half_w],
            [board, height, height - 0.002, height - 0.002],
        )
        back = block((-half_d, -half_w + 0.003, 0.003), (-half_d + 0.005, half_w - 0.003, height - 0.003), 0.001)
        return {"board": blocks(low, high, 0.0015), "brackets": back}
    board = min(0.026, 0.35 * height)
    under = height - board
    top = block((-half_d, -half_w, under), (half_d, half_w, height), 0.002)
    pieces = []
    slope = el.arctan2(under - 0.016, 0.8 * depth)
    for y in (-0.36 * width, 0.36 * width):
        pieces.append(
            blocks(
                [(-half_d, y - 0.012, 0.0), (-half_d, y - 0.012, under - 0.007)],
                [(-half_d + 0.007, y + 0.012, under), (half_d - 0.02, y + 0.012, under + 0.001)],
                0.001,
            )
        )
        length = float(np.hypot(under - 0.016, 0.8 * depth))
        strut = rotated(block((0.0, y - 0.006, -0.004), (length, y + 0.006, 0.004), 0.001), "y", -float(slope))
        pieces.append(moved(strut, -half_d + 0.004, 0.0, 0.008))
    return {"board": top, "brackets": pieces}


BOOK_COLORS = 8

Corner = tuple[float, float, float]


def build_bookshelf(rng: np.random.Generator, size_m: Size, style: str) -> Pieces:
    """Return a shelf unit: classic with cornice and back, cubes, or open boards on a metal frame; all full of books."""
    _, width, height, half_d, half_w = halved(size_m)
    board = 0.022
    foot = {"classic": 0.08, "cubes": 0.0, "industrial": 0.10}[style]
    columns = {"classic": 1 if width < 1.0 else 2, "cubes": max(1, round(width / 0.38)), "industrial": 1}[style]
    rows = max(1, round((height - foot) / (0.36 if style != "cubes" else 0.38)))
    zs = np.linspace(foot, height - board, rows + 1)
    ys = np.linspace(-half_w, half_w - board, columns + 1)
    frame_low = [(-half_d, y, 0.0 if style == "classic" else foot) for y in ys]
    frame_high = [(half_d - 0.004, y + board, height - 0.004) for y in ys]
    parts: Parts = {}
    if style == "industrial":
        bar = 0.022
        corners = [(x, y) for x in (-half_d, half_d - bar) for y in (-half_w, half_w - bar)]
        posts = blocks([(x, y, 0.0) for x, y in corners], [(x + bar, y + bar, height - 0.002) for x, y in corners])
        brace = [
            rod((-half_d + 0.006, -half_w + 0.01, zs[0]), (-half_d + 0.006, half_w - 0.01, zs[-1]), 0.004, segments=6),
            rod((-half_d + 0.006, half_w - 0.01, zs[0]), (-half_d + 0.006, -half_w + 0.01, zs[-1]), 0.004, segments=6),
        ]
        parts["frame"] = merged(posts, *brace)
        parts["shelves"] = blocks(points(-half_d + 0.001, -half_w + 0.001, zs), points(half_d - 0.001, half_w - 0.001, zs + board))
    else:
        extra = [block((-half_d, -half_w, height - board), (half_d, half_w, height))]
        if style == "classic":
            extra.append(block((half_d - 0.022, -half_w + 0.01, 0.0), (half_d - 0.008, half_w - 0.01, foot + 0.001)))
            extra.append(
                blocks(
                    [(half_d - 0.012, y - 0.006, foot) for y in ys[1:-1]] or [(half_d - 0.012, -half_w + 0.004, foot)],
                    [(half_d - 0.001, y + board + 0.006, height - board) for y in ys[1:-1]]
                    or [(half_d - 0.001, half_w - 0.004, foot + board)],
                )
            )
        parts["frame"] = merged(blocks(frame_low, frame_high, 0.002), *extra)
        parts["shelves"] = blocks(
            points(-half_d + 0.003, -half_w + 0.003, zs[:-1]), points(half_d - 0.006, half_w - 0.003, zs[:-1] + board), 0.002
        )
        parts["back"] = block((-half_d, -half_w + 0.004, foot + 0.002), (-half_d + 0.007, half_w - 0.004, height - 0.006), 0.001)
    shelves = list(zip(zs[:-1] + board, zs[1:], strict=True))
    bays = [(y0 + board + 0.004, y1 - 0.004, float(z0), float(z1)) for y0, y1 in itertools.pairwise(ys) for z0, z1 in shelves]
    parts.update(_filled(rng, bays, -half_d, half_d))
    return parts


def _filled(rng: np.random.Generator, bays: Iterable[tuple[float, float, float, float]], back: float, front: float) -> Parts:
    """Fill bays (left, right, floor, ceiling) with rows and piles of books and a few vases, as colour parts ``books_0`` and so on.

    The spines of many standing books bear ``labels``.
    """
    boxes: list[tuple[int, Corner, Corner]] = []
    leaning: list[tuple[int, Mesh]] = []
    ornaments: list[Mesh] = []
    for left, right, floor, ceiling in bays:
        y, room = left + 0.002, ceiling - floor - 0.012
        series = int(rng.integers(BOOK_COLORS))
        while y < right - 0.05:
            kind = rng.random()
            if kind < 0.74:
                y = _upright(rng, boxes, leaning, (y, right, floor, room, back, front), series)
            elif kind < 0.86 and right - y > 0.25:
                y = _pile(rng, boxes, (y, floor, room, back, front))
            elif kind < 0.93 and right - y > 0.2:
                ornaments.append(moved(_ornament(rng, min(0.2, 0.8 * room)), 0.5 * (back + front), y + 0.08, floor))
                y += 0.16
            else:
                y += rng.uniform(0.04, 0.14)
            series = int(rng.integers(BOOK_COLORS))
    if not ornaments:
        left, _, floor, ceiling = next(iter(bays))
        ornaments.append(moved(_ornament(rng, min(0.08, 0.5 * (ceiling - floor))), front - 0.05, left + 0.05, floor))
    parts: Parts = {"ornaments": merged(*ornaments), "labels": _labels(rng, boxes, front)}
    for color in range(BOOK_COLORS):
        mine = [box for box in boxes if box[0] == color]
        meshes = [mesh for index, mesh in leaning if index == color]
        if mine:
            meshes.append(blocks([box[1] for box in mine], [box[2] for box in mine], 0.0025))
        if not meshes:
            left, _, floor, _ = next(iter(bays))
            meshes.append(block((back + 0.02, left, floor + 0.02 * color), (back + 0.12, left + 0.08, floor + 0.02 * color + 0.018), 0.002))
        parts[f"books_{color}"] = merged(*meshes)
    return parts


def _labels(rng: np.random.Generator, boxes: list[tuple[int, Corner, Corner]], front: float) -> Mesh:
    """Return title fields and lines on the spines of about half of the standing books."""
    low, high = [], []
    for _, a, b in boxes:
        wide, tall = b[1] - a[1], b[2] - a[2]
        if tall < 2.0 * wide or rng.random() < 0.45:
            continue
        x0, x1, margin = b[0] - 0.001, min(b[0] + 0.0006, front), 0.14 * wide
        if rng.random() < 0.5:
            z, size = a[2] + tall * rng.uniform(0.5, 0.72), tall * rng.uniform(0.1, 0.22)
            low.append((x0, a[1] + margin, z))
            high.append((x1, b[1] - margin, z + size))
        else:
            low += [(x0, a[1] + margin, a[2] + share * tall) for share in (0.12, 0.82)]
            high += [(x1, b[1] - margin, a[2] + share * tall + 0.006) for share in (0.12, 0.82)]
    if not low:
        _, a, b = boxes[0] if boxes else (0, (front - 0.1, -0.02, 0.1), (front - 0.002, 0.02, 0.14))
        low, high = [(b[0] - 0.001, a[1] + 0.004, a[2] + 0.004)], [(b[0] + 0.0006, b[1] - 0.004, a[2] + 0.01)]
    return keycaps(np.asarray(low), np.asarray(high), 0.0)


def _upright(
    rng: np.random.Generator,
    boxes: list[tuple[int, Corner, Corner]],
    leaning: list[tuple[int, Mesh]],
    bay: tuple[float, float, float, float, float, float],
    series: int,
) -> float:
    """Add a run of standing books, sometimes of one series, the last one sometimes leaning; return where it ends."""
    y, right, floor, room, back, front = bay
    deep = front - back
    same = rng.random() < 0.12
    tall, thick = rng.uniform(0.62, 0.93) * room, rng.uniform(0.014, 0.03)
    count = int(rng.integers(3, 11))
    for k in range(count):
        if not same:
            tall, thick = min(rng.uniform(0.17, 0.30), rng.uniform(0.6, 0.97) * room), rng.uniform(0.012, 0.05)
        if y + thick > right:
            return right
        color = series if same else int(rng.integers(BOOK_COLORS))
        reach = min(deep - 0.02, tall * rng.uniform(0.64, 0.76))
        spine = front - 0.012 - rng.uniform(0.0, 0.018)
        low, high = (spine - reach, y, floor), (spine, y + thick - 0.0012, floor + tall)
        slant = 0.22
        if k == count - 1 and k > 0 and y + thick + tall * slant < right and rng.random() < 0.45:
            leaning.append((color, rotated(block(low, high, 0.002), "x", slant, (0.0, y + thick, floor))))
            lowest = leaning[-1][1].vertices.min(axis=0).tolist()
            leaning[-1] = (color, moved(leaning[-1][1], y=y - lowest[1], z=floor - lowest[2]))
            return y + thick + tall * slant + 0.01
        boxes.append((color, low, high))
        y += thick
    return y + 0.002


def _pile(rng: np.random.Generator, boxes: list[tuple[int, Corner, Corner]], bay: tuple[float, float, float, float, float]) -> float:
    """Add a pile of lying books; return where it ends."""
    y, floor, room, back, front = bay
    z, wide = floor, rng.uniform(0.2, 0.24)
    for _ in range(int(rng.integers(2, 6))):
        thick = rng.uniform(0.015, 0.04)
        if z + thick > floor + room:
            break
        slim = rng.uniform(0.0, 0.03)
        spine = front - rng.uniform(0.015, 0.03)
        boxes.append((int(rng.integers(BOOK_COLORS)), (max(back + 0.01, spine - 0.17), y + slim, z), (spine, y + wide - slim, z + thick)))
        z += thick
    return y + wide + 0.004


def _ornament(rng: np.random.Generator, height: float) -> Mesh:
    """Return a small turned vase or bowl."""
    r = min(rng.uniform(0.25, 0.45) * height, 0.065)
    neck = rng.uniform(0.3, 0.7)
    profile = points(
        [0.0, 0.6 * r, 0.95 * r, r, 0.8 * r, neck * r, neck * r * 1.2, neck * r, neck * 0.8 * r, 0.0],
        [0.0, 0.0, 0.25 * height, 0.45 * height, 0.7 * height, 0.88 * height, height, height, 0.85 * height, 0.8 * height],
    )
    return lathe(profile, 18)


def build_book_stack(rng: np.random.Generator, size_m: Size, style: str) -> Pieces:
    """Return lying books with covers, spines and pages; ``askew`` turns them against each other."""
    depth, width, height = size_m
    share = rng.uniform(0.6, 1.4, 4)
    edges = np.concatenate([[0.0], np.cumsum(share) / share.sum()]) * height
    parts: Parts = {}
    pages: list[Mesh] = []
    turn = 0.14 if style == "askew" else 0.03
    for k, (z0, z1) in enumerate(itertools.pairwise(edges)):
        half_d = 0.5 * depth * (1.0 if k == 0 else rng.uniform(0.82, 0.97))
        half_w = 0.5 * width * (1.0 if k == 0 else rng.uniform(0.8, 0.97))
        cover = min(0.0025, 0.16 * (z1 - z0))
        angle = 0.0 if k == 0 else rng.uniform(-turn, turn)
        z1 -= 0.0003
        boards = blocks(
            [(-half_d, -half_w, z0), (-half_d, -half_w, z1 - cover), (half_d - cover, -half_w, z0)],
            [(half_d, half_w, z0 + cover), (half_d, half_w, z1), (half_d, half_w, z1)],
            0.0008,
        )
        parts[f"books_{k}"] = rotated(boards, "z", angle)
        pages.append(
            rotated(
                block(
                    (-half_d + 0.004, -half_w + 0.004, z0 + 0.7 * cover), (half_d - 0.5 * cover, half_w - 0.004, z1 - 0.7 * cover), 0.0005
                ),
                "z",
                angle,
            )
        )
    parts["pages"] = merged(*pages)
    return parts


MODELS = {
    "tv_stand": Model(build_tv_stand, ("open", "slatted", "runners")),
    "sideboard": Model(build_sideboard, ("plain", "framed", "midcentury")),
    "wall_shelf": Model(build_wall_shelf, ("bracket", "box")),
    "bookshelf": Model(build_bookshelf, ("classic", "cubes", "industrial")),
    "book_stack": Model(build_book_stack, ("neat", "askew")),
}
