"""What is stored: shelves, cardboard boxes, plastic crates, suitcases; and plain boxes for what is of no known kind."""

import itertools
from collections.abc import Sequence

import numpy as np

from renderer.geometry.lofts import bent, disc, loft, oval
from renderer.geometry.mesh import Mesh
from renderer.geometry.shapes import block, blocks, lathe, merged, moved, rod, rounded_box, sweep
from renderer.models.model import Model, Pieces, Size, halved
from renderer.models.printed import letter, on_side

SHELF_LEVELS = (0.055, 0.29, 0.525, 0.76, 1.0)
"""Heights of the boards of a storage shelf as shares of its own; what stands on them are objects of their own."""


def build_storage_shelf(rng: np.random.Generator, size_m: Size, style: str) -> Pieces:
    """Return boards between posts, the top one at full height."""
    del rng
    _, _, height, half_d, half_w = halved(size_m)
    levels = height * np.array(SHELF_LEVELS)
    thick = {"steel": 0.03, "wooden": 0.022, "tubes": 0.05}[style]
    shelves = blocks([(-half_d, -half_w, z - thick) for z in levels], [(half_d, half_w, z) for z in levels], 0.003)
    posts = []
    side = {"steel": 0.035, "wooden": 0.045, "tubes": 0.06}[style]
    if style == "tubes":
        posts = _tube_posts(half_d - 0.04, half_w - 0.04, levels, thick)
    for sx, sy in [] if style == "tubes" else itertools.product((-1.0, 1.0), repeat=2):
        x, y = sx * half_d, sy * half_w
        top = height - 0.002
        if style == "steel":
            posts.append(
                block((min(x, x - sx * 0.003), min(y, y - sy * side), 0.0), (max(x, x - sx * 0.003), max(y, y - sy * side), top), 0.001)
            )
            posts.append(
                block((min(x, x - sx * side), min(y, y - sy * 0.003), 0.0), (max(x, x - sx * side), max(y, y - sy * 0.003), top), 0.001)
            )
        else:
            posts.append(
                block((min(x, x - sx * side), min(y, y - sy * side), 0.0), (max(x, x - sx * side), max(y, y - sy * side), top), 0.004)
            )
    if style == "steel":
        posts += [
            sweep(
                [(-half_d + 0.004, s * (half_w - 0.02), levels[0]), (-half_d + 0.004, -s * (half_w - 0.02), levels[-1] - thick)], 0.004, 6
            )
            for s in (-1.0, 1.0)
        ]
    elif style == "wooden":
        posts += [
            block(
                (-half_d + 0.01, s * half_w - 0.02 * (s > 0), z - 0.05),
                (half_d - 0.01, s * half_w + 0.02 * (s < 0), z - thick + 0.002),
                0.003,
            )
            for s in (-1.0, 1.0)
            for z in levels
        ]
    return {"frame": posts, "shelves": shelves}


def _tube_posts(x: float, y: float, levels: np.ndarray, thick: float) -> list[Mesh]:
    """Round tubes between boards, in collars, with caps on the floor."""
    posts = []
    for sx, sy in itertools.product((-1.0, 1.0), repeat=2):
        profile, below = [(0.0, 0.0), (0.03, 0.0), (0.03, 0.012)], 0.012
        for level in levels:
            under = float(level) - thick
            profile += [(0.021, below + 0.004), (0.021, under - 0.022), (0.028, under - 0.02), (0.028, under + 0.004)]
            below = under + 0.004
        posts.append(moved(lathe([*profile, (0.0, below)], 14), sx * x, sy * y))
    return posts


def build_cardboard_box(rng: np.random.Generator, size_m: Size, style: str) -> Pieces:
    """Return a shut box with tape along its seam, or two straps and their clasps; a label on one side, print on two."""
    _, _, height, half_d, half_w = halved(size_m)
    thick = min(0.004, 0.03 * min(size_m))
    body = [block((-half_d, -half_w, 0.0), (half_d, half_w, height - thick), 0.003)]
    body += [block((s * half_d, -half_w + 0.001, height - thick), (s * 0.001, half_w - 0.001, height), 0.001) for s in (-1.0, 1.0)]
    low = height - rng.uniform(0.1, 0.3) * height
    tape = [block((-0.024, -half_w, height - 0.002), (0.024, half_w, height + 0.0005), 0.0002)]
    tape += [block((-0.024, s * half_w - 0.0006, low), (0.024, s * half_w + 0.0006, height), 0.0002) for s in (-1.0, 1.0)]
    if style == "strapped":
        tape = []
        for y in (-0.5 * half_w, 0.5 * half_w):
            strap = ((-half_d, y - 0.007), (half_d, y + 0.007))
            tape.append(block((strap[0][0], strap[0][1], height - 0.001), (strap[1][0], strap[1][1], height + 0.0008), 0.0002))
            tape += [block((s * half_d - 0.0008, y - 0.007, 0.0), (s * half_d + 0.0008, y + 0.007, height), 0.0002) for s in (-1.0, 1.0)]
            tape.append(block((half_d - 0.001, y - 0.012, 0.6 * height), (half_d + 0.003, y + 0.012, 0.6 * height + 0.03), 0.001))
    y, z = rng.uniform(0.0, 0.4) * half_w, rng.uniform(0.45, 0.6) * height
    label = block((half_d - 0.002, y - 0.28 * half_w, z), (half_d + 0.0006, y + 0.28 * half_w, z + 0.24 * height), 0.0002)
    prints = [_printed(rng, side * half_d, half_w, height) for side in (-1.0, 1.0)]
    return {"body": body, "tape": tape, "label": label, "print": prints}


_ARROW = (
    (-0.12, 0.0, 0.12, 0.55),
    (-0.36, 0.55, 0.36, 0.67),
    (-0.24, 0.67, 0.24, 0.79),
    (-0.12, 0.79, 0.12, 0.91),
    (-0.05, 0.91, 0.05, 1.0),
)
"""An arrow that points up, one high: rectangles by left, low, right and high."""


def _printed(rng: np.random.Generator, x: float, half_w: float, height: float) -> Mesh:
    """Return what is printed on a side of a box at ``x``: a few words in strokes, and two arrows beside them."""
    size = min(0.04, 0.1 * height, 0.12 * half_w)
    low, y, strokes = float(rng.uniform(0.2, 0.3)) * height, -0.85 * half_w, []
    for line in range(int(rng.integers(1, 3))):
        z, end = low - 1.5 * size * line, y + size
        for place in np.cumsum(rng.choice([0.75, 1.5], int(rng.integers(5, 12)), p=[0.8, 0.2])).tolist():
            left = y + place * size
            end = left + 0.55 * size
            strokes += letter(rng, left, z, 0.55 * size, size, 0.14 * size)
    for middle in (end + 1.2 * size, end + 2.3 * size):
        strokes += [(middle + a * size, low + 1.2 * b * size, middle + c * size, low + 1.2 * d * size) for a, b, c, d in _ARROW]
    return on_side(strokes, x)


def build_plain_box(rng: np.random.Generator, size_m: Size, style: str) -> Pieces:
    """Return a box with rounded edges: what stands for objects of no known kind."""
    del rng, style
    depth, width, height = size_m
    edge = min(0.01, 0.1 * min(size_m))
    return {"body": block((-0.5 * depth, -0.5 * width, 0.0), (0.5 * depth, 0.5 * width, height), edge)}


def build_plastic_crate(rng: np.random.Generator, size_m: Size, style: str) -> Pieces:
    """Return an open stacking crate with slotted sides, or a box with a lid and latches."""
    _, _, height, half_d, half_w = halved(size_m)
    if style == "lidded":
        lid_low = 0.86 * height
        box = [(0.88, 0.0), (0.95, lid_low - 0.02), (0.98, lid_low - 0.018), (0.98, lid_low)]
        body = loft([oval(s * half_d, s * half_w, z, power=11.0) for s, z in box])
        cover = [
            (0.98, lid_low + 0.002),
            (1.0, lid_low + 0.002),
            (1.0, lid_low + 0.02),
            (0.95, lid_low + 0.02),
            (0.9, height - 0.004),
            (0.88, height),
        ]
        lid = loft([oval(s * half_d, s * half_w, z, power=11.0) for s, z in cover])
        latches = [
            block((-0.07, s * half_w - 0.012, lid_low - 0.05), (0.07, s * half_w + 0.002, lid_low + 0.022), 0.004) for s in (-1.0, 1.0)
        ]
        return {"body": body, "lid": [lid, *latches]}
    wall = 0.005
    pieces = [((-half_d + 0.012, -half_w + 0.012, 0.0), (half_d - 0.012, half_w - 0.012, 0.006))]
    rows = [(0.0, 0.2), (0.26, 0.4), (0.46, 0.6), (0.66, 0.78), (0.86, 1.0)]
    for s in (-1.0, 1.0):
        for along, across, axis in ((half_w, half_d, 0), (half_d, half_w, 1)):
            for k, (a, b) in enumerate(rows):
                inset = 0.008 if 0 < k < 4 else 0.0
                spans = [(-along + inset, along - inset)] if k != 3 else [(-along + inset, -0.32 * along), (0.32 * along, along - inset)]
                for start, end in spans:
                    flat = sorted((s * (across - inset), s * (across - inset - wall)))
                    low, high = (flat[0], start), (flat[1], end)
                    pieces.append(((*(low if axis == 0 else low[::-1]), a * height), (*(high if axis == 0 else high[::-1]), b * height)))
            for t in (-0.99, -0.5, 0.5, 0.99):
                flat = sorted((s * (across - 0.004), s * (across - 0.012)))
                low, high = (flat[0], t * along - 0.012 * (t > -0.9) * 1.0), (flat[1], t * along + 0.012 * (t < 0.9))
                pieces.append(((*(low if axis == 0 else low[::-1]), 0.0), (*(high if axis == 0 else high[::-1]), 0.99 * height)))
    rim = [((-half_d, s * half_w - 0.016 * (s > 0), 0.955 * height), (half_d, s * half_w + 0.016 * (s < 0), height)) for s in (-1.0, 1.0)]
    rim += [((s * half_d - 0.016 * (s > 0), -half_w, 0.955 * height), (s * half_d + 0.016 * (s < 0), half_w, height)) for s in (-1.0, 1.0)]
    return {"body": _boxes(pieces), "lid": _boxes(rim)}


def _boxes(corners: Sequence[tuple[tuple[float, ...], tuple[float, ...]]]) -> Mesh:
    """Plain boxes of 12 triangles between pairs of corners."""
    meshes = []
    for a, b in corners:
        outline = [(a[0], a[1]), (b[0], a[1]), (b[0], b[1]), (a[0], b[1])]
        meshes.append(loft([[(x, y, z) for x, y in outline] for z in (a[2], b[2])]))
    return merged(*meshes)


def build_suitcase(rng: np.random.Generator, size_m: Size, style: str) -> Pieces:
    """Return a standing suitcase with ribbed hard shell or soft pockets, pull handle and wheels."""
    depth, _, height, half_d, half_w = halved(size_m)
    low = min(0.06, 0.09 * height)
    top = height * (0.8 if rng.random() < 0.6 else 0.95)
    shell = [rounded_box((-half_d + 0.008, -half_w + 0.008, low), (half_d - 0.012, half_w - 0.008, top), 0.2 * depth, 3)]
    trim = [rounded_box((-0.012, -half_w + 0.003, low - 0.004), (0.006, half_w - 0.003, top + 0.004), 0.008, 2)]
    if style == "hard":
        for y in np.linspace(-0.66, 0.66, 6) * half_w:
            shell.append(rounded_box((-half_d, y - 0.05 * half_w, low + 0.05), (half_d, y + 0.05 * half_w, top - 0.05), 0.012, 1))
    else:
        for a, b in ((0.1, 0.5), (0.56, 0.92)):
            shell.append(rounded_box((0.0, -0.78 * half_w, low + a * (top - low)), (half_d, 0.78 * half_w, low + b * (top - low)), 0.02, 2))
            trim.append(
                rod(
                    (half_d - 0.004, -0.7 * half_w, low + b * (top - low) - 0.03),
                    (half_d - 0.004, 0.7 * half_w, low + b * (top - low) - 0.03),
                    0.004,
                    segments=6,
                )
            )
        shell.append(block((-half_d, -0.8 * half_w, low + 0.03), (-half_d + 0.02, 0.8 * half_w, top - 0.05), 0.006))
    grip = bent([(0.0, -0.1, top - 0.01), (0.0, -0.09, top + 0.025), (0.0, 0.09, top + 0.025), (0.0, 0.1, top - 0.01)], 0.009, 0.02, 8)
    x, y = -half_d + 0.24 * depth, 0.34 * half_w
    pole = [rod((x, s * y, top - 0.03), (x, s * y, height - 0.012), 0.008, segments=8) for s in (-1.0, 1.0)]
    handle = rounded_box((x - 0.014, -y - 0.02, height - 0.03), (x + 0.014, y + 0.02, height), 0.01, 2)
    wheels = []
    for wx in (-half_d + 0.22 * depth, half_d - 0.22 * depth):
        for wy in (-half_w + 0.06, half_w - 0.06):
            wheels += [
                disc("y", (wx, wy, 0.42 * low), 0.42 * low, 0.022, 16, 0.004),
                block((wx - 0.018, wy - 0.02, 0.5 * low), (wx + 0.018, wy + 0.02, low + 0.01), 0.004),
            ]
    return {"shell": shell, "trim": [*trim, grip, handle], "poles": pole, "wheels": wheels}


MODELS = {
    "storage_shelf": Model(build_storage_shelf, ("steel", "wooden", "tubes")),
    "cardboard_box": Model(build_cardboard_box, ("closed", "strapped")),
    "other_furniture": Model(build_plain_box, ("plain",)),
    "other_prop": Model(build_plain_box, ("plain",)),
    "plastic_crate": Model(build_plastic_crate, ("slotted", "lidded")),
    "suitcase": Model(build_suitcase, ("hard", "soft")),
}
