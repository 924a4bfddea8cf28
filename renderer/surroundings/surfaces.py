"""What surfaces of a neighbourhood look like: facades with windows and doors, roofs, boards, ground; kernels, metres, linear colours."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from renderer.core.kernel import inlined, kernel
from renderer.core.random_numbers import mix_bits
from renderer.surroundings import neighbourhood as nb

_ZERO, _ONE, _HALF = np.float32(0.0), np.float32(1.0), np.float32(0.5)
_TO_UNIT = np.float32(2.0**-32)
_WINDOW_WIDTH, _WINDOW_HEIGHT, _SILL, _FRAME, _REVEAL = (np.float32(c) for c in (1.15, 1.35, 0.9, 0.07, 0.12))
_DOOR_WIDTH, _DOOR_HEIGHT = np.float32(1.05), np.float32(2.1)
_PLINTH = np.float32(0.5)
_LIT, _CURTAINED = np.float32(0.22), np.float32(0.6)
"""Shares of windows that are lit in the dark, and that have curtains."""


class Hit(NamedTuple):
    """A surface that a ray meets: base colour, unit normal, share of the sky that it mirrors, and of a lit window's light that it sends."""

    red: np.float32
    green: np.float32
    blue: np.float32
    nx: np.float32
    ny: np.float32
    nz: np.float32
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
def body_surface(
    kind: int,
    corner: NDArray[np.float32],
    look: NDArray[np.float32],
    face: int,
    x: np.float32,
    y: np.float32,
    z: np.float32,
    nx: np.float32,
    ny: np.float32,
    nz: np.float32,
) -> Hit:
    """Return the surface of a body at a point of one of its faces with a unit normal."""
    along = y - corner[1] if abs(nx) > abs(ny) else x - corner[0]
    length = look[nb.DEPTH] if abs(nx) > abs(ny) else look[nb.WIDTH]
    if kind == nb.FACADE and face < 4:
        return _facade(look, face, corner[2], along, length, z, nx, ny, nz)
    number = int(look[nb.NUMBER])
    if kind == nb.ROOF and nz > np.float32(0.3):
        # rows of tiles up the slope, each tile of its own tone
        across = (x - corner[0]) if abs(ny) > abs(nx) else (y - corner[1])
        row, tile = np.int32(np.floor(z * np.float32(4.5))), np.int32(np.floor(across * np.float32(3.6)))
        within = z * np.float32(4.5) - np.float32(row)
        tone = np.float32(0.75) + np.float32(0.3) * hash_unit(tile, row, number) + np.float32(0.25) * value_noise(across, z, number)
        tone *= np.float32(0.7) if within < np.float32(0.15) else _ONE
        return Hit(look[4] * tone, look[5] * tone, look[6] * tone, nx, ny, nz, _ZERO, _ZERO)
    tone = np.float32(0.8) + np.float32(0.3) * value_noise(along, z * np.float32(3.0), number)
    if kind == nb.BOARDS:
        board = np.int32(np.floor(along * np.float32(8.0)))
        gap = along * np.float32(8.0) - np.float32(board)
        tone *= np.float32(0.35) if gap < np.float32(0.12) else np.float32(0.75) + np.float32(0.4) * hash_unit(board, 3, number)
    return Hit(look[4] * tone, look[5] * tone, look[6] * tone, nx, ny, nz, _ZERO, _ZERO)


@inlined
def _facade(
    look: NDArray[np.float32],
    face: int,
    eaves: np.float32,
    along: np.float32,
    length: np.float32,
    z: np.float32,
    nx: np.float32,
    ny: np.float32,
    nz: np.float32,
) -> Hit:
    """Return a wall with a plinth, a window in each cell of each storey, and a door in one cell of the lowest."""
    number = int(look[nb.NUMBER]) + 7 * face
    stain = np.float32(0.86) + np.float32(0.2) * value_noise(along * _HALF, z * np.float32(0.7), number)
    stain *= np.float32(0.95) + np.float32(0.1) * hash_unit(np.int32(along * np.float32(9.0)), np.int32(z * np.float32(13.0)), number)
    red, green, blue = look[nb.RED] * stain, look[nb.GREEN] * stain, look[nb.BLUE] * stain
    if z < _PLINTH:
        return Hit(np.float32(0.22) * stain, np.float32(0.21) * stain, np.float32(0.20) * stain, nx, ny, nz, _ZERO, _ZERO)
    cells = np.int32(max(length / look[nb.WINDOW_PITCH_M], _ONE))
    pitch = length / np.float32(cells)
    cell, storey = (
        np.int32(min(max(along, _ZERO) / pitch, np.float32(cells) - np.float32(0.01))),
        np.int32((z - _PLINTH) / look[nb.STOREY_M]),
    )
    s = abs(along - (np.float32(cell) + _HALF) * pitch)
    t = z - _PLINTH - np.float32(storey) * look[nb.STOREY_M]
    if storey == 0 and cell == number % cells and (face == 1 or face == 3):
        if s < _HALF * _DOOR_WIDTH and t < _DOOR_HEIGHT:
            edge = s > _HALF * _DOOR_WIDTH - _FRAME or t > _DOOR_HEIGHT - _FRAME
            tone = np.float32(0.6) if edge else np.float32(0.08) + np.float32(0.12) * hash_unit(number, 1, 2)
            return Hit(tone, tone * np.float32(0.7), tone * np.float32(0.55), nx, ny, nz, _ZERO, _ZERO)
        return Hit(red, green, blue, nx, ny, nz, _ZERO, _ZERO)
    # gables above the eaves have no windows
    u, v = s, t - _SILL
    if z + look[nb.STOREY_M] - t > eaves + np.float32(0.1) or hash_unit(number, cell, 99) < np.float32(0.12):
        return Hit(red, green, blue, nx, ny, nz, _ZERO, _ZERO)
    if u > _HALF * _WINDOW_WIDTH + _REVEAL or v < -_REVEAL or v > _WINDOW_HEIGHT + _REVEAL:
        return Hit(red, green, blue, nx, ny, nz, _ZERO, _ZERO)
    if u > _HALF * _WINDOW_WIDTH or v < _ZERO or v > _WINDOW_HEIGHT:
        # reveals: lighter surrounds, a dark line under the lintel
        tone = np.float32(0.35) if v > _WINDOW_HEIGHT else np.float32(1.12)
        return Hit(
            min(red * tone, np.float32(0.8)),
            min(green * tone, np.float32(0.8)),
            min(blue * tone, np.float32(0.8)),
            nx,
            ny,
            nz,
            _ZERO,
            _ZERO,
        )
    edge = u > _HALF * _WINDOW_WIDTH - _FRAME or v < _FRAME or v > _WINDOW_HEIGHT - _FRAME or u < np.float32(0.035)
    if edge:
        return Hit(np.float32(0.66), np.float32(0.66), np.float32(0.64), nx, ny, nz, _ZERO, _ZERO)
    own = hash_unit(number, cell, storey)
    draped = hash_unit(cell, storey, number) < _CURTAINED
    curtain = draped and u > _HALF * _WINDOW_WIDTH * (np.float32(0.25) + np.float32(0.6) * hash_unit(storey, number, cell))
    tone = np.float32(0.30) if curtain else np.float32(0.03)
    glow = (np.float32(0.45) + np.float32(0.55) * v / _WINDOW_HEIGHT) * (np.float32(0.4) + own * np.float32(3.0)) if own < _LIT else _ZERO
    glow = glow * (np.float32(0.5) if curtain else _ONE)
    return Hit(tone, tone, tone, nx, ny, nz, np.float32(0.16), glow)


@kernel
def ground_surface(street: NDArray[np.float32], x: np.float32, y: np.float32, distance: np.float32) -> Hit:
    """Return the ground: carriageway with its middle line, pavements of slabs, lawn elsewhere."""
    aside = abs(y - street[0])
    fine = value_noise(x * np.float32(7.0), y * np.float32(7.0), 1) if distance < np.float32(30.0) else _HALF
    broad = value_noise(x * np.float32(0.35), y * np.float32(0.35), 2)
    if aside < street[1]:
        tone = np.float32(0.075) + np.float32(0.03) * broad + np.float32(0.02) * fine
        dash = x * np.float32(1.0 / 6.0)
        if aside < np.float32(0.06) and dash - np.floor(dash) < _HALF:
            tone = np.float32(0.5)
        return Hit(tone, tone, tone, _ZERO, _ZERO, _ONE, _ZERO, _ZERO)
    if aside < street[2]:
        i, j = np.int32(np.floor(x * np.float32(2.0))), np.int32(np.floor(y * np.float32(2.0)))
        s, t = x * np.float32(2.0) - np.float32(i), y * np.float32(2.0) - np.float32(j)
        joint = min(min(s, _ONE - s), min(t, _ONE - t)) < np.float32(0.03)
        tone = np.float32(0.25) + np.float32(0.07) * hash_unit(i, j, 5) + np.float32(0.04) * fine
        tone *= np.float32(0.6) if joint and distance < np.float32(25.0) else _ONE
        return Hit(tone, tone * np.float32(0.97), tone * np.float32(0.93), _ZERO, _ZERO, _ONE, _ZERO, _ZERO)
    tone = np.float32(0.6) + np.float32(0.5) * broad + np.float32(0.5) * fine * fine
    dry = value_noise(x * np.float32(0.12), y * np.float32(0.12), 3) * np.float32(0.05)
    return Hit(
        (np.float32(0.05) + dry) * tone, (np.float32(0.085) + dry) * tone, np.float32(0.028) * tone, _ZERO, _ZERO, _ONE, _ZERO, _ZERO
    )
