"""Wear: traces of use that lie over all materials by where they are in the room, in layers whose places and sizes are metres.

Each layer has a pattern, a tile of coverages from 0 to 1 that repeats over the planes of the world's axes, a band of heights, and the faces
that it lies on.  Wide ray cones see the pattern's mean.
"""

import functools
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from renderer.core import lanes as ln
from renderer.core.kernel import inlined, kernel
from renderer.core.layout import Layout
from renderer.core.ray_packet import LANES
from renderer.textures.noise import Field, noise, smooth_step
from renderer.textures.packing import in_blocks, texel_place
from scene_description import WearLayer

_SIDE_LOG = 9
_SIDE = 1 << _SIDE_LOG
_FACES = {"any": 0.0, "side": 1.0, "up": 2.0}

_ROW = Layout()
PATTERN = _ROW.field()  # which tile
PER_M = _ROW.field()  # tiles per metre
LOW, HIGH, PER_FADE = _ROW.field(), _ROW.field(), _ROW.field()  # band of heights, metres, and one over the way in which it fades
FACES = _ROW.field()
ROUGHEST = _ROW.field()
COLOR = _ROW.field(3)
STRENGTH = _ROW.field()  # coverage of the colour where the pattern is 1
ROUGHNESS = _ROW.field()  # added there
MEAN = _ROW.field()  # of the pattern
ROW_SIZE = _ROW.size

_ZERO, _HALF, _ONE = np.float32(0.0), np.float32(0.5), np.float32(1.0)
_BYTE, _TEXELS = np.float32(1.0 / 255.0), np.float32(_SIDE)
_LEAST, _WIDE_TEXELS, _SMOOTHEST = np.float32(2e-3), np.float32(0.35), np.float32(0.02)


class Wear(NamedTuple):
    """layers: (n, ROW_SIZE) float32; tiles: (k * 512 * 512,) uint8, coverage of the patterns, each ``in_blocks``."""

    layers: NDArray[np.float32]
    tiles: NDArray[np.uint8]


def _cloud(rng: np.random.Generator) -> Field:
    """Draw soft patches of dirt or dust with grains in them."""
    patches = noise(rng, (_SIDE, _SIDE), 2.0, 60.0, 1.0)
    grains = noise(rng, (_SIDE, _SIDE), 60.0, 250.0, 0.2)
    return np.asarray(smooth_step(-0.8, 2.2, patches + 0.35 * grains))


def _streaks(rng: np.random.Generator) -> Field:
    """Draw scuffs: short thin marks, most of them level, in groups."""
    marks = noise(rng, (_SIDE, _SIDE), 24.0, 200.0, 0.0, (5.0, 1.0))
    slanting = noise(rng, (_SIDE, _SIDE), 24.0, 200.0, 0.0, (1.5, 1.0))
    groups = smooth_step(0.2, 1.6, noise(rng, (_SIDE, _SIDE), 2.0, 9.0, 0.6))
    return np.asarray(groups * np.maximum(smooth_step(1.25, 2.25, marks), 0.7 * smooth_step(1.9, 2.8, slanting)))


def _smudges(rng: np.random.Generator) -> Field:
    """Draw what hands leave: blurred patches of the size of fingers and palms."""
    palms = smooth_step(0.3, 1.8, noise(rng, (_SIDE, _SIDE), 3.0, 14.0, 0.7))
    fingers = smooth_step(0.2, 1.4, noise(rng, (_SIDE, _SIDE), 12.0, 50.0, 0.3))
    return np.asarray(palms * (0.35 + 0.65 * fingers))


def _stains(rng: np.random.Generator) -> Field:
    """Draw spots with darker rims, few and of all sizes."""
    field = noise(rng, (_SIDE, _SIDE), 2.0, 70.0, 0.8)
    rim = smooth_step(1.25, 1.45, field) - 0.6 * smooth_step(1.45, 2.2, field)
    return np.asarray(0.8 * rim + 0.25 * smooth_step(0.3, 1.3, field))


_PATTERNS: dict[str, Callable[[np.random.Generator], Field]] = {
    "cloud": _cloud,
    "streaks": _streaks,
    "smudges": _smudges,
    "stains": _stains,
}


@functools.cache
def _tiles() -> tuple[NDArray[np.uint8], NDArray[np.float64]]:
    """Return ``Wear.tiles``, and the means of the patterns, 0 to 1."""
    fields = (draw(np.random.default_rng(20 + i)) for i, draw in enumerate(_PATTERNS.values()))
    tiles = np.stack([in_blocks(np.rint(255.0 * np.clip(field, 0.0, 1.0)).astype(np.uint8)) for field in fields])
    return tiles.reshape(-1), tiles.mean(axis=1) / 255.0


NO_WEAR = Wear(np.zeros((0, ROW_SIZE), np.float32), np.zeros(0, np.uint8))
"""Of a scene in which all is new."""


def tabulate_wear(layers: tuple[WearLayer, ...]) -> Wear:
    """Return the layers of a scene for kernels."""
    if not layers:
        return NO_WEAR
    (tiles, means), names = _tiles(), list(_PATTERNS)
    rows = np.zeros((len(layers), ROW_SIZE), np.float32)
    for row, layer in zip(rows, layers, strict=True):
        which = names.index(layer.pattern)
        row[PATTERN], row[PER_M], row[MEAN] = which, 1.0 / layer.size_m, means[which]
        row[LOW], row[HIGH], row[PER_FADE] = layer.low_m, layer.high_m, 1.0 / layer.fade_m
        row[FACES], row[ROUGHEST] = _FACES[layer.faces], layer.roughest
        row[COLOR : COLOR + 3] = layer.color
        row[STRENGTH], row[ROUGHNESS] = layer.strength, layer.roughness
    return Wear(rows, tiles)


@inlined
def apply_wear(wear: Wear, worn: np.float32, k: int, lanes: NDArray[np.float32]) -> None:
    """Change base colour, roughnesses and metalness of lane k, whose material shows ``worn`` of all wear, where it lies."""
    x, y, z = lanes[ln.P_X + k], lanes[ln.P_Y + k], lanes[ln.P_Z + k]
    nx, ny, nz = lanes[ln.NG_X + k], lanes[ln.NG_Y + k], lanes[ln.NG_Z + k]
    for row in range(len(wear.layers)):
        layer = wear.layers[row]
        low, high = _ONE - (layer[LOW] - z) * layer[PER_FADE], _ONE - (z - layer[HIGH]) * layer[PER_FADE]
        band = min(max(min(low, high), _ZERO), _ONE)
        facing = _ONE if layer[FACES] == _ZERO else _ONE - abs(nz) if layer[FACES] == _ONE else max(nz, _ZERO)
        most = worn * band * facing
        if most < _LEAST or lanes[ln.ROUGHNESS + k] > layer[ROUGHEST]:
            continue
        # The pattern on the plane that the face is nearest to, or its mean where the cone covers many texels.
        u, v = (x, y) if abs(nz) > _HALF else (y, z) if abs(nx) > abs(ny) else (x, z)
        texels = lanes[ln.WIDTH + k] * layer[PER_M] * _TEXELS * _WIDE_TEXELS
        sharp = _ONE / (_ONE + texels * texels)
        covered = layer[MEAN]
        if sharp > np.float32(0.05):
            covered += sharp * (_coverage(wear.tiles, int(layer[PATTERN]), u * layer[PER_M], v * layer[PER_M]) - covered)
        covered *= most
        share = covered * layer[STRENGTH]
        for channel in range(3):
            at = channel * LANES + k
            lanes[ln.BASE_R + at] += share * (layer[COLOR + channel] - lanes[ln.BASE_R + at])
        lanes[ln.METALLIC + k] *= _ONE - share
        more = covered * layer[ROUGHNESS]
        lanes[ln.ROUGHNESS + k] = min(max(lanes[ln.ROUGHNESS + k], _SMOOTHEST) + more, _ONE)
        if lanes[ln.COAT + k] > _ZERO:
            lanes[ln.COAT_ROUGHNESS + k] = min(lanes[ln.COAT_ROUGHNESS + k] + more, _ONE)


@inlined
def _texel(tiles: NDArray[np.uint8], which: int, column: int, line: int) -> np.float32:
    return np.float32(tiles[(which << (2 * _SIDE_LOG)) + texel_place(column, line, _SIDE_LOG, _SIDE_LOG)])


@kernel
def _coverage(tiles: NDArray[np.uint8], which: int, u: np.float32, v: np.float32) -> np.float32:
    """Return the mean of four texels of a tile, 0 to 1."""
    x, y = u * _TEXELS - _HALF, v * _TEXELS - _HALF
    column, line = int(np.floor(x)), int(np.floor(y))
    s, t = x - np.floor(x), y - np.floor(y)
    low = (_ONE - s) * _texel(tiles, which, column, line) + s * _texel(tiles, which, column + 1, line)
    high = (_ONE - s) * _texel(tiles, which, column, line + 1) + s * _texel(tiles, which, column + 1, line + 1)
    covered: np.float32 = _BYTE * (low + t * (high - low))
    return covered
