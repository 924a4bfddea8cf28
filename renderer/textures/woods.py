"""Wood: grain with rings, knots and fibres along u; planks and parquet cut from it."""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

import kernel_cache.elementary as el
from renderer.core.kernel import entry
from renderer.textures.noise import Field, Shape, coordinates, covered, noise, per_cell, smooth_step
from renderer.textures.pattern import Generator, Pattern, Request

WOOD_TINTS = ((0.60, 0.54, 0.48), (0.26, 0.21, 0.18), (1.12, 1.05, 0.96))
GRAIN_SHAPE = (512, 512)
_LEAVES = 4
"""Across a tile of furniture's wood."""
_BOARD_OF_LOG = 0.25
"""Share of the grain's height that a floor board is wide."""
_ODD_BOARDS, _EASED = 0.125, 2.5
"""Share of boards that differ most, and how much wider than a joint what is eased about it is."""


class Grain(NamedTuple):
    """Share of dark late wood and of pores and knots, and the shade of the fibres, (h, w) float32 each."""

    late: Field
    dark: Field
    shade: Field


class Boards(NamedTuple):
    """Which board a texel lies on, how far along and across it in board widths, and its distances to the board's sides and ends.

    ``sides``, ``ends``: distance and the size of a texel in its direction, in board widths.
    """

    number: NDArray[np.integer]
    along: Field
    across: Field
    sides: tuple[Field, float]
    ends: tuple[Field, float]

    def joint(self, half_width: float) -> Field:
        """Return which share of each texel is joint."""
        return np.maximum(covered(self.sides[0], half_width, self.sides[1]), covered(self.ends[0], half_width, self.ends[1]))


def grain(rng: np.random.Generator, shape: Shape, staves: int, rings: tuple[int, int], knots: int) -> Grain:
    """Return grain along u of so many boards side by side, with knots that the rings flow round.

    Boards are flat-sawn: rings, ``rings`` (least, most) in a board's half width, close in arches over a board's own middle line.
    """
    u, v = coordinates(shape)
    board = np.floor(v * staves).astype(np.int32)
    off = np.abs(v * staves - board - rng.uniform(0.3, 0.7, staves).astype(np.float32)[board])
    off = np.minimum(off, 1.0 - off) if staves == 1 else off
    turn = (u + rng.random((2, staves), np.float32)[:, board[:, 0], None]) * (2.0 * math.pi)
    flow = noise(rng, shape, 0.5 * staves, 5.0 * staves, 1.6, (3.0, 1.0))
    dip = 0.19 + 0.10 * el.cos(turn[0]) + 0.04 * el.cos(2.0 * turn[1]) + 0.014 * flow
    phase = 2.0 * rng.integers(*rings, staves).astype(np.float32)[board] * np.sqrt(off * off + dip * dip)
    dark = np.zeros(shape, np.float32)
    for _ in range(knots):
        du = ((u - float(rng.random()) + 0.5) % 1.0 - 0.5) * 3.0
        dv = (v - float(rng.random()) + 0.5) % 1.0 - 0.5
        size = float(rng.uniform(0.012, 0.03))
        distance = np.sqrt(du * du + dv * dv * 1.4)
        phase = phase + 2.4 * el.exp(-distance / (2.2 * size)) * (1.0 + 0.15 * flow)
        dark = np.maximum(dark, smooth_step(1.25 * size, 0.7 * size, distance))
    wander = noise(rng, shape, 2.0, 40.0, 1.0, (14.0, 1.0))
    phase = phase + 0.16 * wander
    ring = np.floor(phase).astype(np.int32)
    part = phase - ring
    strength = per_cell(rng, (ring + 37 * board) % 256, 256)
    late = (el.power(part, 1.8)) * smooth_step(1.0, 0.80, part) * 1.25 * (0.25 + 0.75 * strength)
    fibre = noise(rng, shape, 30.0, 220.0, 0.1, (20.0, 1.0))
    pores = smooth_step(1.35, 2.3, fibre) * (0.35 + 0.5 * late)
    broad = noise(rng, shape, 0.5, 3.0, 1.0, (2.0, 1.0))
    tone = rng.uniform(-1.0, 1.0, staves).astype(np.float32)[board] if staves > 1 else np.float32(0.0)
    shade = 1.0 + 0.04 * fibre + 0.045 * broad + 0.02 * wander + 0.03 * tone
    return Grain(np.clip(late, 0.0, 1.0), np.maximum(dark, pores), shade.astype(np.float32))


def wood(rng: np.random.Generator, request: Request) -> Pattern:
    """Draw the grain of solid or veneered furniture: leaves one unit wide, set side by side."""
    found = grain(rng, request.shape, _LEAVES, (14, 30), int(rng.integers(0, 3)))
    late = 0.62 * found.late * (1.0 - found.dark)
    height = -0.25 * found.late - 0.75 * found.dark
    return Pattern((late, 0.8 * found.dark), found.shade, 0.05 * found.late + 0.12 * found.dark, height)


def floor_boards(rng: np.random.Generator, boards: Boards, along_texels: float, gap: float, spread: float) -> Pattern:
    """Draw boards cut from one piece of grain: each at another place, darker or lighter, with a joint round it.

    Boards differ in tone by ``spread``, one of eight by twice that.

    ``along_texels`` is how many texels of grain a board width spans along the board, ``gap`` the half width of a joint in board widths.
    """
    found = grain(rng, GRAIN_SHAPE, 1, (24, 44), int(rng.integers(1, 4)))
    height, width = GRAIN_SHAPE
    count = int(boards.number.max()) + 1
    starts = np.stack([rng.integers(0, width, count), rng.integers(0, height, count)], axis=1).astype(np.int32)
    tones = rng.random((count, 2), np.float32)
    odd = rng.random(count) < _ODD_BOARDS
    tones[:, 0] = 1.0 + spread * np.where(odd, 2.0, 1.0) * (tones[:, 0] - np.float32(0.5))
    shape = boards.number.shape
    fields = np.empty((6, *shape), np.float32)
    numbers = np.array([along_texels, _BOARD_OF_LOG * height], np.float32)
    places = np.stack([boards.along, boards.across, boards.joint(gap), boards.joint(_EASED * gap)]).astype(np.float32)
    _lay_boards(boards.number.astype(np.int32), places, starts, tones, np.stack(found).astype(np.float32), numbers, fields)
    return Pattern((fields[0], fields[1], fields[2]), fields[3], fields[4], fields[5])


@entry
def _lay_boards(
    number: NDArray[np.int32],
    places: NDArray[np.float32],
    starts: NDArray[np.int32],
    tones: NDArray[np.float32],
    found: NDArray[np.float32],
    numbers: NDArray[np.float32],
    fields: NDArray[np.float32],
) -> None:
    """Fill three weights, shade, roughness and height (6, h, w) of boards cut from the grain ``found`` (3, h, w).

    ``places`` (4, h, w): how far along and across its board a texel lies, in widths, and which share of it is joint, and eased edge;
    ``starts`` (n, 2): where each board is cut, column and row; ``tones`` (n, 2): its shade and how much warmer it is; ``numbers``: texels
    of grain along and across a board's width.
    """
    one = np.float32(1.0)
    _, tall, wide = found.shape
    per_along, per_across = numbers
    for row in range(number.shape[0]):
        for column in range(number.shape[1]):
            board = number[row, column]
            x = (starts[board, 0] + int(places[0, row, column] * per_along)) % wide
            y = (starts[board, 1] + int(places[1, row, column] * per_across)) % tall
            late, dark, shade = found[0, y, x], found[1, y, x], found[2, y, x]
            joint, groove = places[2, row, column], places[3, row, column]
            free = (one - joint) * (one - dark)
            fields[0, row, column] = np.float32(0.55) * late * free
            fields[1, row, column] = max(np.float32(0.75) * dark, np.float32(0.85) * joint)
            fields[2, row, column] = np.float32(0.5) * tones[board, 1] * free * (one - late)
            fields[3, row, column] = shade * tones[board, 0] * (one - np.float32(0.6) * joint)
            fields[4, row, column] = np.float32(0.06) * late + np.float32(0.25) * joint
            fields[5, row, column] = -groove - np.float32(0.06) * late - np.float32(0.1) * dark


def planks(rng: np.random.Generator, request: Request) -> Pattern:
    """Draw rows of boards with joints in irregular bond: the unit is a board's width; a tile has 8 rows, 24 widths long."""
    rows, length = 8, 24.0
    u, v = coordinates(request.shape)
    row = np.floor(v * rows).astype(np.int32)
    across = v * rows - np.floor(v * rows)
    start = rng.random(rows, np.float32)
    cut = rng.uniform(0.36, 0.64, rows).astype(np.float32)
    place = (u + start[row]) % 1.0
    second = place > cut[row]
    index = 2 * row + second
    lengths = np.where(second, 1.0 - cut[row], cut[row])
    local = np.where(second, place - cut[row], place)
    end = np.minimum(local, lengths - local) * length
    across = np.broadcast_to(across, end.shape)
    height, width = request.shape
    boards = Boards(index, (local * length), across, (np.minimum(across, 1.0 - across), rows / height), (end, length / width))
    return floor_boards(rng, boards, 16.0, 0.0042, float(rng.uniform(0.1, 0.22)))


def herringbone(rng: np.random.Generator, request: Request) -> Pattern:
    """Draw herringbone parquet of blocks 1 x 5: the unit is a block's width, a tile has 10 x 10."""
    ratio = 5
    u, v = coordinates(request.shape)
    x, y = np.broadcast_arrays(u * (2 * ratio), v * (2 * ratio))
    whole_x, whole_y = np.floor(x), np.floor(y)
    i, j = whole_x.astype(np.int32), whole_y.astype(np.int32)
    turn = (i - j) % (2 * ratio)
    lying = turn < ratio
    steps = np.where(lying, turn, 2 * ratio - 1 - turn)
    along = np.where(lying, x - whole_x, y - whole_y) + steps.astype(np.float32)
    across = np.where(lying, y - whole_y, x - whole_x)
    first = np.where(lying, i - steps, i) % (2 * ratio)
    other = np.where(lying, j, j - steps) % (2 * ratio)
    index = (first * 2 * ratio + other) * 2 + lying
    texel = 2.0 * ratio / request.shape[0]
    boards = Boards(index, along, across, (np.minimum(across, 1.0 - across), texel), (np.minimum(along, ratio - along), texel))
    return floor_boards(rng, boards, 22.0, 0.0075, float(rng.uniform(0.12, 0.25)))


def basket(rng: np.random.Generator, request: Request) -> Pattern:
    """Draw basket-weave parquet of squares of four strips, turned in turn: the unit is a strip's width, a tile has 16 x 16."""
    strips, count = 4, 16
    u, v = coordinates(request.shape)
    x, y = np.broadcast_arrays(u * count, v * count)
    column, row = (np.floor(c / strips).astype(np.int32) for c in (x, y))
    lying = (column + row) % 2 == 0
    inside_x, inside_y = x - strips * column, y - strips * row
    along, side = np.where(lying, inside_x, inside_y), np.where(lying, inside_y, inside_x)
    strip = np.floor(side).astype(np.int32)
    across = side - np.floor(side)
    index = (row * (count // strips) + column) * strips + strip
    texel = count / request.shape[0]
    boards = Boards(index, along, across, (np.minimum(across, 1.0 - across), texel), (np.minimum(along, strips - along), texel))
    return floor_boards(rng, boards, 24.0, 0.014, float(rng.uniform(0.12, 0.25)))


GENERATORS = {
    "wood": Generator(wood, (12.0, float(_LEAVES)), (512, 1024), WOOD_TINTS),
    "planks": Generator(planks, (24.0, 8.0), (1024, 512), WOOD_TINTS, shift=0.382),
    "herringbone": Generator(herringbone, (10.0, 10.0), (512, 512), WOOD_TINTS),
    "basket": Generator(basket, (16.0, 16.0), (512, 512), WOOD_TINTS),
}
