"""Tiles, bricks and stone: everything hard that walls, floors and tops are covered with."""

import math
from functools import partial

import numpy as np
from numpy.typing import NDArray

import kernel_cache.elementary as el
from renderer.textures.noise import Field, cells, coordinates, covered, noise, per_cell, smooth_step
from renderer.textures.pattern import Generator, Pattern, Request

PANEL_M, JOINT_M, TIE_M = 1.25, 0.003, 0.024
"""Of formwork: width of a panel, of a joint between panels, and of the hole that a tie leaves."""
LAPS = 0.015
"""Deviation of the lightness of rolled paint, as a share of it."""
GROUT = ((0.62, 0.61, 0.58), (0.7, 0.7, 0.7), (0.5, 0.5, 0.5))


def _laid(
    rng: np.random.Generator, request: Request, index: NDArray[np.integer], edge: Field, joint: float, second: float, spread: float
) -> Pattern:
    """Draw glazed tiles from their index and the distance to their edges, in tile sides; ``second`` is the share of the second colour."""
    count = int(index.max()) + 1
    tone = per_cell(rng, index, count) - np.float32(0.5)
    other = per_cell(rng, index, count) < second
    pick = per_cell(rng, index, count)
    cloud = noise(rng, request.shape, 2.0, 24.0, 1.0)
    grout = smooth_step(1.15 * joint, 0.85 * joint, edge)
    free = 1.0 - grout
    rounding = smooth_step(3.2 * joint, 1.0 * joint, edge)
    lean_u, lean_v = (per_cell(rng, index, count) - np.float32(0.5) for _ in range(2))
    u, v = coordinates(request.shape)
    lean = 0.06 * (el.sin(2 * math.pi * u) * lean_u + el.sin(2 * math.pi * v) * lean_v)
    shade = (1.0 + spread * tone + 0.02 * cloud * free) * (1.0 - 0.25 * rounding * free)
    height = -rounding * rounding * 0.8 - 0.2 * grout + 0.03 * cloud * free + lean * free
    rough = 0.55 * grout + 0.02 * cloud * free
    weights = (grout, other * free * (pick < 0.6), other * free * (pick >= 0.6))
    return Pattern(tuple(w for w in weights), shade, rough, height)


def _grid(request: Request, across: int, down: int, bond: float) -> tuple[NDArray[np.integer], Field, Field]:
    """Return the cell's index and the place in it in [0, 1), along u and v; every other row is moved by ``bond`` cells."""
    u, v = coordinates(request.shape)
    y = v * down
    row = np.floor(y).astype(np.int32)
    x = (u * across + bond * (row % 2)) % across
    column = np.floor(x).astype(np.int32)
    px, py = np.broadcast_arrays(x - np.floor(x), y - np.floor(y))
    return row * across + column, px, py


def grid_tiles(rng: np.random.Generator, request: Request, across: int, down: int, bond: float, joint: float, second: float) -> Pattern:
    """Draw a grid or a running bond of tiles that are ``down / across`` times as long as high; the unit is their height."""
    index, px, py = _grid(request, across, down, bond)
    edge = np.minimum(np.minimum(px, 1.0 - px) * np.float32(down / across), np.minimum(py, 1.0 - py))
    return _laid(rng, request, index, edge, joint, second, float(rng.uniform(0.02, 0.10)))


def checker_tiles(rng: np.random.Generator, request: Request) -> Pattern:
    """Draw square tiles in two colours, laid as a chessboard."""
    laid = grid_tiles(rng, request, 4, 4, 0.0, 0.007, 0.0)
    u, v = coordinates(request.shape)
    odd = (np.floor(u * 4) + np.floor(v * 4)) % 2 == 1
    return laid._replace(weights=(laid.weights[0], (odd * (1.0 - laid.weights[0]))))


def hexagon_tiles(rng: np.random.Generator, request: Request) -> Pattern:
    """Draw hexagons with two flat sides along v; the unit is the width across flats, a tile has 6 across and 4 rows."""
    across, rows = 6, 4
    u, v = coordinates(request.shape)
    pitch = math.sqrt(3.0)
    x, y = np.broadcast_arrays(u * across, v * (rows * pitch / 2.0))
    best = np.full(request.shape, 9.0, np.float32)
    index = np.zeros(request.shape, np.int64)
    edge = np.zeros(request.shape, np.float32)
    for shift in (0, 1):
        cx = np.round(x - 0.5 * shift)
        cy = np.round((y - 0.5 * pitch * shift) / pitch)
        dx, dy = x - (cx + 0.5 * shift), y - (cy * pitch + 0.5 * pitch * shift)
        reach = np.maximum(np.abs(dx), 0.5 * np.abs(dx) + 0.5 * pitch * np.abs(dy))
        closer = reach < best
        best = np.where(closer, reach, best)
        edge = np.where(closer, 0.5 - reach, edge)
        number = ((cy.astype(np.int64) % (rows // 2)) * 2 + shift) * across + cx.astype(np.int64) % across
        index = np.where(closer, number, index)
    return _laid(rng, request, index, edge, 0.016, float(rng.choice([0.0, 0.0, 0.2, 0.45])), float(rng.uniform(0.02, 0.08)))


def brick(rng: np.random.Generator, request: Request) -> Pattern:
    """Draw a wall of bricks in running bond; the unit is a course's height, a tile has 12 courses of 4 bricks."""
    index, px, py = _grid(request, 4, 12, 0.5)
    rough_edge = noise(rng, request.shape, 8.0, 90.0, 0.6)
    edge = np.minimum(np.minimum(px, 1.0 - px) * np.float32(3.0), np.minimum(py, 1.0 - py)) + 0.018 * rough_edge
    tone, burnt = per_cell(rng, index, 48), per_cell(rng, index, 48)
    mortar = smooth_step(0.10, 0.06, edge)
    free = 1.0 - mortar
    grit = noise(rng, request.shape, 30.0, 200.0, 0.2)
    shade = 1.0 + free * 0.34 * (tone - 0.5) + 0.07 * grit + 0.04 * rough_edge
    height = -smooth_step(0.16, 0.05, edge) + free * (0.12 * rough_edge + 0.10 * grit) + mortar * 0.06 * grit
    return Pattern((mortar, (0.55 * burnt * burnt * burnt * free)), shade, 0.05 * mortar, height)


def concrete(rng: np.random.Generator, request: Request) -> Pattern:
    """Draw cast concrete: faint mottles a tenth of the tile wide, fine grit and pores."""
    mottle = noise(rng, request.shape, 8.0, 60.0, 0.7)
    grit = noise(rng, request.shape, 60.0, 220.0, 0.0)
    pores = smooth_step(2.6, 3.3, noise(rng, request.shape, 20.0, 90.0, 0.0))
    shade = 1.0 + 0.04 * mottle + 0.02 * grit
    height = 0.08 * grit - 0.7 * pores
    return Pattern((0.6 * pores,), shade, (0.03 * mottle + 0.1 * pores), height)


def formed_concrete(rng: np.random.Generator, request: Request) -> Pattern:
    """Draw a panel of concrete as it came out of its form: a joint round it, four holes of the ties, pores, traces of the form's grain.

    The unit is the panel's width; it is twice as high, and its tile is the panel.
    """
    width = request.shape[1]
    u, v = coordinates(request.shape)
    x, y = np.broadcast_arrays(u, 2.0 * v)
    texel = 1.0 / width
    edge = np.minimum(np.minimum(x, 1.0 - x), np.minimum(y, 2.0 - y))
    joint = covered(edge, JOINT_M / (2.0 * PANEL_M), texel)
    hole = np.full(request.shape, 9.0, np.float32)
    for across in (0.25, 0.75):
        for up in (0.5, 1.5):
            hole = np.minimum(hole, np.hypot(x - across, y - up))
    tie = covered(hole, TIE_M / (2.0 * PANEL_M), texel)
    collar = covered(hole, 1.7 * TIE_M / (2.0 * PANEL_M), 2.0 * texel) - tie
    pores = smooth_step(2.35, 3.0, noise(rng, request.shape, 0.12 * width, 0.4 * width, 0.0, (1.0, 0.5)))
    grain = noise(rng, request.shape, 4.0, 0.3 * width, 0.3, (1.0, 2.5))
    grit = noise(rng, request.shape, 0.2 * width, 0.5 * width, 0.0, (1.0, 0.5))
    dark = np.clip(0.75 * pores + 0.9 * joint + tie, 0.0, 1.0)
    shade = 1.0 + 0.014 * grain + 0.03 * grit - 0.06 * collar
    return Pattern((dark,), shade, 0.1 * dark + 0.02 * grain, 0.03 * grit - 0.5 * pores - joint - tie)


def plaster(rng: np.random.Generator, request: Request) -> Pattern:
    """Draw painted plaster, on half a metre: a roller's stipple of 2 to 4 mm and its laps, and what a float left uneven over 2 to 8 cm."""
    stipple = noise(rng, request.shape, 115.0, 200.0, 0.0)
    uneven = noise(rng, request.shape, 6.0, 26.0, 0.3)
    laps = _laps(rng, request)
    drops = smooth_step(0.4, 2.4, stipple)
    return Pattern((), 1.0 + 0.01 * stipple + 0.008 * uneven + laps, 0.02 * drops, 0.35 * drops + 0.06 * stipple + 0.4 * uneven)


def _laps(rng: np.random.Generator, request: Request) -> Field:
    """Return how much lighter paint is where a roller has laid more of it, on half a metre: spots of 1 to 4 cm, a little longer upright."""
    laps: Field = np.float32(LAPS) * noise(rng, request.shape, 12.0, 48.0, 0.2, (1.0, 1.4))
    return laps


def woodchip(rng: np.random.Generator, request: Request) -> Pattern:
    """Draw painted woodchip paper: chips of 5 to 15 mm, some of them large, on a tile of half a metre, under a roller's stipple."""
    large = smooth_step(1.25, 1.9, noise(rng, request.shape, 22.0, 55.0, 0.0))
    small = smooth_step(1.1, 1.9, noise(rng, request.shape, 50.0, 110.0, 0.0))
    stipple = noise(rng, request.shape, 110.0, 220.0, 0.0)
    height = np.maximum(large, 0.6 * small) + 0.06 * stipple
    return Pattern((), 1.0 + 0.012 * stipple - 0.02 * large + _laps(rng, request), 0.02 * small, height - 1.0)


def rubbed_plaster(rng: np.random.Generator, request: Request) -> Pattern:
    """Draw plaster rubbed with a float: grains of 2 to 4 mm on a tile of half a metre, and the furrows that they have torn."""
    grains = noise(rng, request.shape, 70.0, 170.0, 0.0)
    furrows = smooth_step(1.2, 2.2, noise(rng, request.shape, 16.0, 140.0, 0.2, (1.0, 2.6)))
    broad = noise(rng, request.shape, 8.0, 30.0, 0.4)
    height = 0.3 * grains - 0.8 * furrows + 0.12 * broad
    return Pattern((0.25 * furrows,), 1.0 + 0.02 * grains, 0.03 * furrows, height - 0.5)


def marble(rng: np.random.Generator, request: Request) -> Pattern:
    """Draw polished marble: clouds, broad soft veins and thin sharp ones across a tile, all folded.

    Veins are where a sine of the way across them, shifted by noise, is 0 (K. Perlin, "An Image Synthesizer", SIGGRAPH 1985).
    """
    shape = request.shape
    down, right = (np.float32(math.pi / side) * np.arange(side, dtype=np.float32) for side in shape)
    fold = noise(rng, shape, 1.0, 12.0, 1.5)
    first = noise(rng, shape, 1.0, 10.0, 1.6) + 0.35 * fold
    second = noise(rng, shape, 2.0, 30.0, 1.4) + 0.25 * fold
    strength = smooth_step(-1.1, 1.0, noise(rng, shape, 1.0, 5.0, 1.0))
    broad = np.abs(el.sin(down[:, None] + right + 0.55 * first))
    veins = el.exp(-broad * 14.0) * strength + 0.35 * el.exp(-broad * 4.0) * strength
    threads = 0.4 * el.exp(-np.abs(el.sin(2.0 * down[:, None] + right + 0.3 * second)) * 24.0) * strength
    cloud = 0.32 * smooth_step(-0.5, 2.2, fold)
    vein = np.clip(veins + threads, 0.0, 1.0)
    return Pattern(((0.85 * vein), (cloud * (1.0 - vein))), None, (0.04 * vein), None)


def terrazzo(rng: np.random.Generator, request: Request) -> Pattern:
    """Draw chips of stone in polished cement; the unit is some four large chips, a tile has 4 x 4."""
    shape = request.shape
    chips: list[Field] = [np.zeros(shape, np.float32) for _ in range(3)]
    free = np.ones(shape, np.float32)
    shade = np.ones(shape, np.float32)
    for count, size in ((16, 0.62), (34, 0.5)):
        found = cells(rng, shape, count, count, 0.95)
        kind, reach = per_cell(rng, found.number, count * count), per_cell(rng, found.number, count * count)
        chip = (
            smooth_step(0.06, 0.12, found.second - found.nearest) * (found.nearest < size * (0.45 + 0.55 * reach)) * (reach > 0.25) * free
        )
        for k, (low, high) in enumerate(((0.0, 0.4), (0.4, 0.72), (0.72, 1.0))):
            chips[k] += chip * ((kind >= low) & (kind < high))
        shade *= 1.0 + chip * 0.25 * (kind - 0.5)
        free *= 1.0 - chip
    return Pattern(tuple(chips), shade, 0.03 * free, None)


def speckle(rng: np.random.Generator, request: Request) -> Pattern:
    """Draw granite or engineered stone: grains of three colours; the unit is some ten grains, a tile has 4 x 4."""
    shape, count = request.shape, 36
    found = cells(rng, shape, count, count, 1.0)
    kind = per_cell(rng, found.number, count * count) + 0.09 * noise(rng, shape, 1.0, 6.0, 1.0)
    shares = ((kind < 0.22), (kind >= 0.22) & (kind < 0.34), (kind > 0.86))
    shade = 1.0 + 0.16 * (per_cell(rng, found.number, count * count) - 0.5)
    return Pattern(tuple(0.8 * share for share in shares), shade, None, None)


def cork(rng: np.random.Generator, request: Request) -> Pattern:
    """Draw pressed cork: granules of many browns with dark bark between."""
    found = cells(rng, request.shape, 40, 40, 1.0)
    tone, bark = per_cell(rng, found.number, 1600), per_cell(rng, found.number, 1600)
    gap = smooth_step(0.16, 0.02, found.second - found.nearest)
    dark = np.maximum(0.6 * gap, 0.8 * (bark > 0.9))
    return Pattern((dark,), (1.0 + 0.3 * (tone - 0.5)), None, (-0.6 * gap))


GENERATORS = {
    "tiles": Generator(partial(grid_tiles, across=4, down=4, bond=0.0, joint=0.007, second=0.0), (4.0, 4.0), (512, 512), GROUT),
    "checker_tiles": Generator(checker_tiles, (4.0, 4.0), (512, 512), GROUT),
    "metro_tiles": Generator(partial(grid_tiles, across=4, down=8, bond=0.5, joint=0.018, second=0.0), (8.0, 8.0), (512, 512), GROUT),
    "mosaic": Generator(partial(grid_tiles, across=24, down=24, bond=0.0, joint=0.05, second=0.55), (24.0, 24.0), (512, 512), GROUT),
    "hexagon_tiles": Generator(hexagon_tiles, (6.0, 2.0 * math.sqrt(3.0)), (512, 512), GROUT),
    "brick": Generator(brick, (12.0, 12.0), (512, 512), ((1.5, 1.9, 2.1), (0.35, 0.3, 0.3))),
    "concrete": Generator(concrete, (1.0, 1.0), (512, 512), ((0.45, 0.45, 0.45),), variants=4),
    "formed_concrete": Generator(formed_concrete, (1.0, 2.0), (1024, 512), ((0.4, 0.4, 0.4),), variants=4),
    "plaster": Generator(plaster, (1.0, 1.0), (512, 512), (), variants=4),
    "woodchip": Generator(woodchip, (1.0, 1.0), (512, 512), (), variants=4),
    "rubbed_plaster": Generator(rubbed_plaster, (1.0, 1.0), (512, 512), ((0.7, 0.7, 0.7),), variants=4),
    "marble": Generator(marble, (1.0, 1.0), (512, 512), ((0.34, 0.35, 0.38), (0.78, 0.79, 0.82))),
    "terrazzo": Generator(terrazzo, (4.0, 4.0), (512, 512), ((0.5, 0.48, 0.46), (0.75, 0.66, 0.56), (1.25, 1.22, 1.2))),
    "speckle": Generator(speckle, (4.0, 4.0), (256, 256), ((0.3, 0.3, 0.31), (0.62, 0.56, 0.52), (1.6, 1.6, 1.6)), variants=4),
    "cork": Generator(cork, (1.0, 1.0), (256, 256), ((0.35, 0.28, 0.24),), variants=4),
}
