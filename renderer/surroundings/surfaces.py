"""What surfaces of a neighbourhood look like: facades with windows and doors, roofs, boards, ground; kernels, metres, linear colours."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from renderer.core.kernel import inlined, kernel
from renderer.core.random_numbers import mix_bits
from renderer.surroundings import neighbourhood as nb
from renderer.surroundings.neighbourhood import Neighbourhood

_ZERO, _ONE, _HALF = np.float32(0.0), np.float32(1.0), np.float32(0.5)
_TO_UNIT = np.float32(2.0**-32)
_WINDOW_WIDTH, _WINDOW_HEIGHT, _SILL, _FRAME, _REVEAL = (np.float32(c) for c in (1.15, 1.35, 0.9, 0.07, 0.12))
_DOOR_WIDTH, _DOOR_HEIGHT = np.float32(1.05), np.float32(2.1)
_PLINTH, _MOST, _SKY_SHARE = np.float32(0.5), np.float32(0.8), np.float32(0.16)
"""Height of plinths, m; greatest base colour; share of the sky that panes mirror."""
_TERRACE_M = np.float32(3.2)
"""How far slabs reach from the house."""
_LIT, _CURTAINED = np.float32(0.22), np.float32(0.6)
"""Shares of windows that are lit in the dark, and that have curtains."""


class Surface(NamedTuple):
    """What a ray meets: base colour, share of the sky that it mirrors, and of a lit window's light that it sends."""

    red: np.float32
    green: np.float32
    blue: np.float32
    mirror: np.float32
    glow: np.float32


@inlined
def hash_unit(i: int | np.int32, j: int | np.int32, k: int | np.int32) -> np.float32:
    """Return a number in [0, 1] that belongs to three integers."""
    mixed = mix_bits(np.uint32(i) * np.uint32(0x9E3779B1) ^ mix_bits(np.uint32(j) * np.uint32(0x85EBCA77) ^ mix_bits(np.uint32(k))))
    return np.float32(mixed) * _TO_UNIT


@inlined
def value_noise(x: np.float32, y: np.float32, number: int) -> np.float32:
    """Return smooth noise in [0, 1] with features of about 1."""
    i, j = np.int32(np.floor(x)), np.int32(np.floor(y))
    s, t = x - np.float32(i), y - np.float32(j)
    s, t = s * s * (np.float32(3.0) - np.float32(2.0) * s), t * t * (np.float32(3.0) - np.float32(2.0) * t)
    low = hash_unit(i, j, number) + s * (hash_unit(i + 1, j, number) - hash_unit(i, j, number))
    high = hash_unit(i, j + 1, number) + s * (hash_unit(i + 1, j + 1, number) - hash_unit(i, j + 1, number))
    return low + t * (high - low)


@kernel
def body_surface(place: Neighbourhood, body: int, face: int, x: np.float32, y: np.float32, z: np.float32) -> Surface:
    """Return the surface of a body at a point of one of its faces."""
    corner, look, kind, normal = place.corner[body], place.looks[body], place.kind[body], place.planes[body, face]
    east = abs(normal[0]) > abs(normal[1])
    along = y - corner[1] if east else x - corner[0]
    if kind == nb.FACADE and face < 4:
        return _facade(look, face, corner[2], along, look[nb.DEPTH] if east else look[nb.WIDTH], z)
    number = int(look[nb.NUMBER])
    if kind == nb.ROOF and normal[2] > np.float32(0.3):
        # rows of tiles up the slope, each tile of its own tone
        row, tile = np.int32(np.floor(z * np.float32(4.5))), np.int32(np.floor(along * np.float32(3.6)))
        within = z * np.float32(4.5) - np.float32(row)
        tone = np.float32(0.75) + np.float32(0.3) * hash_unit(tile, row, number) + np.float32(0.25) * value_noise(along, z, number)
        return _toned(look[nb.RED], look[nb.GREEN], look[nb.BLUE], tone * (np.float32(0.7) if within < np.float32(0.15) else _ONE))
    tone = np.float32(0.8) + np.float32(0.3) * value_noise(along, z * np.float32(3.0), number)
    if kind == nb.BOARDS:
        board = np.int32(np.floor(along * np.float32(8.0)))
        gap = along * np.float32(8.0) - np.float32(board)
        tone *= np.float32(0.35) if gap < np.float32(0.12) else np.float32(0.75) + np.float32(0.4) * hash_unit(board, 3, number)
    return _toned(look[nb.RED], look[nb.GREEN], look[nb.BLUE], tone)


@inlined
def _toned(red: np.float32, green: np.float32, blue: np.float32, tone: np.float32) -> Surface:
    return Surface(min(red * tone, _MOST), min(green * tone, _MOST), min(blue * tone, _MOST), _ZERO, _ZERO)


@inlined
def _facade(look: NDArray[np.float32], face: int, eaves: np.float32, along: np.float32, length: np.float32, z: np.float32) -> Surface:
    """Return a wall with a plinth, a window in each cell of each storey below the eaves, and a door in one cell of the lowest."""
    number = int(look[nb.NUMBER]) + 7 * face
    stain = np.float32(0.86) + np.float32(0.2) * value_noise(along * _HALF, z * np.float32(0.7), number)
    stain *= np.float32(0.95) + np.float32(0.1) * hash_unit(np.int32(along * np.float32(9.0)), np.int32(z * np.float32(13.0)), number)
    if z < _PLINTH:
        return _toned(np.float32(0.22), np.float32(0.21), np.float32(0.20), stain)
    wall = _toned(look[nb.RED], look[nb.GREEN], look[nb.BLUE], stain)
    cells = np.int32(max(length / look[nb.WINDOW_PITCH_M], _ONE))
    pitch = length / np.float32(cells)
    cell = np.int32(min(max(along, _ZERO) / pitch, np.float32(cells) - np.float32(0.01)))
    storey = np.int32((z - _PLINTH) / look[nb.STOREY_M])
    # distances from the middle of the cell, and from the floor of the storey
    s, t = abs(along - (np.float32(cell) + _HALF) * pitch), z - _PLINTH - np.float32(storey) * look[nb.STOREY_M]
    if storey == 0 and cell == number % cells and (face == 1 or face == 3):
        if s > _HALF * _DOOR_WIDTH or t > _DOOR_HEIGHT:
            return wall
        edge = s > _HALF * _DOOR_WIDTH - _FRAME or t > _DOOR_HEIGHT - _FRAME
        return _toned(_ONE, np.float32(0.7), np.float32(0.55), _MOST if edge else _HALF * _HALF * hash_unit(number, 1, 2))
    if z - t + look[nb.STOREY_M] > eaves + np.float32(0.1) or hash_unit(number, cell, 99) < np.float32(0.12):
        return wall
    return _window(wall, s, t - _SILL, hash_unit(number, cell, storey), hash_unit(cell, storey, number))


@inlined
def _window(wall: Surface, u: np.float32, v: np.float32, lit: np.float32, draped: np.float32) -> Surface:
    """Return a window in its wall: ``u`` from its middle, ``v`` from its sill; ``lit``, ``draped``: numbers in [0, 1] that are its own."""
    if u > _HALF * _WINDOW_WIDTH + _REVEAL or v < -_REVEAL or v > _WINDOW_HEIGHT + _REVEAL:
        return wall
    if u > _HALF * _WINDOW_WIDTH or v < _ZERO or v > _WINDOW_HEIGHT:
        # a lighter surround, in shadow under the lintel
        return _toned(wall.red, wall.green, wall.blue, np.float32(0.35) if v > _WINDOW_HEIGHT else np.float32(1.12))
    if u > _HALF * _WINDOW_WIDTH - _FRAME or v < _FRAME or v > _WINDOW_HEIGHT - _FRAME or u < _HALF * _FRAME:
        return _toned(_ONE, _ONE, np.float32(0.97), np.float32(0.66))
    curtain = draped < _CURTAINED and u > _HALF * _WINDOW_WIDTH * (np.float32(0.25) + draped)
    tone = np.float32(0.30) if curtain else np.float32(0.03)
    glow = (np.float32(0.45) + np.float32(0.55) * v / _WINDOW_HEIGHT) * (np.float32(0.4) + np.float32(3.0) * lit)
    return Surface(tone, tone, tone, _SKY_SHARE, _ZERO if lit > _LIT else glow * (_HALF if curtain else _ONE))


@kernel
def ground_surface(street: NDArray[np.float32], x: np.float32, y: np.float32, distance: np.float32) -> Surface:
    """Return the ground: carriageway with its middle line, pavements and a terrace of slabs, lawn elsewhere."""
    aside = abs(y - street[0])
    fine = value_noise(x * np.float32(7.0), y * np.float32(7.0), 1) if distance < np.float32(30.0) else _HALF
    broad = value_noise(x * np.float32(0.35), y * np.float32(0.35), 2)
    if aside < street[1]:
        tone = np.float32(0.075) + np.float32(0.03) * broad + np.float32(0.02) * fine
        dash = x * np.float32(1.0 / 6.0)
        if aside < np.float32(0.06) and dash - np.floor(dash) < _HALF:
            tone = np.float32(0.5)
        return Surface(tone, tone, tone, _ZERO, _ZERO)
    if aside < street[2] or x * x + y * y < _TERRACE_M * _TERRACE_M:
        i, j = np.int32(np.floor(x * np.float32(2.0))), np.int32(np.floor(y * np.float32(2.0)))
        s, t = x * np.float32(2.0) - np.float32(i), y * np.float32(2.0) - np.float32(j)
        joint = min(min(s, _ONE - s), min(t, _ONE - t)) < np.float32(0.03)
        tone = np.float32(0.25) + np.float32(0.07) * hash_unit(i, j, 5) + np.float32(0.04) * fine
        tone *= np.float32(0.6) if joint and distance < np.float32(25.0) else _ONE
        return Surface(tone, tone * np.float32(0.97), tone * np.float32(0.93), _ZERO, _ZERO)
    tuft = value_noise(x * np.float32(1.7), y * np.float32(1.7), 4)
    tone = np.float32(0.35) + np.float32(0.5) * broad + np.float32(0.5) * fine * fine + np.float32(0.5) * tuft
    dry = value_noise(x * np.float32(0.12), y * np.float32(0.12), 3) * np.float32(0.05)
    return _toned(np.float32(0.05) + dry, np.float32(0.085) + dry, np.float32(0.028), tone)
