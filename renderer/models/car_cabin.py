"""What is inside a car, and the panes through which it is seen.

Lengths are metres; x points to the bonnet and z upwards, as in :mod:`renderer.models.vehicles`.
"""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from renderer.core.arrays import Array
from renderer.geometry.lofts import ring
from renderer.geometry.mesh import Mesh
from renderer.geometry.shapes import block, merged, moved, rod, rotated, sheet

_PANE_M = 0.004
_SEAT_M = (0.5, 0.5, 0.14)
"""Depth, width and thickness of a seat's cushion."""
_CUSHION_SHARE, _HEADREST_SHARE = 0.34, 0.86
"""Tops of cushions and of headrests, over the height of the car."""
_RECLINE_RAD, _WHEEL_TILT_RAD = 0.3, 0.45
_WHEEL_M = 0.18


class Tub(NamedTuple):
    """The hollow of a body where people sit: its ends (rear, front), half its width, and the heights of its floor and its upper edge."""

    ends: tuple[float, float]
    half: float
    floor: float
    edge: float


def panes(outlines: Sequence[Array]) -> Mesh:
    """Return the glass along outlines (n, 3) from the belt to the roof, open below and above, 4 mm thick."""
    rings = np.array(outlines)
    along = (np.roll(rings, -1, axis=1) - np.roll(rings, 1, axis=1))[..., :2]
    inward = np.stack([-along[..., 1], along[..., 0], np.zeros(rings.shape[:2])], axis=2)
    inward /= np.linalg.norm(inward, axis=2, keepdims=True)
    outer, inner = (np.concatenate([each, each[:, :1]], axis=1) for each in (rings, rings + _PANE_M * inward))
    return sheet(outer[::-1], inner[::-1])


def seats(tub: Tub, height: float) -> Mesh:
    """Return two front seats and a bench behind them, with headrests, for a car of a height."""
    front = tub.ends[0] + 0.56 * (tub.ends[1] - tub.ends[0])
    rear = tub.ends[0] + 0.1
    wide = min(_SEAT_M[1], 0.92 * tub.half)
    side = 0.52 * tub.half
    bench = 1.9 * tub.half
    heads = [(rear, y) for y in (-side, side)]
    return merged(
        *(_seat(tub, height, front, y, wide) for y in (-side, side)),
        _seat(tub, height, rear, 0.0, bench, heads=False),
        *(_headrest(height, x, y) for x, y in heads),
    )


def dashboard(tub: Tub, behind: float, ahead: float) -> Mesh:
    """Return the dashboard with steering wheel in front of the front seats, and the shelf behind the rear ones.

    ``behind``, ``ahead``: x at which the panes end, at the belt.
    """
    top, x, y = tub.edge + 0.035, tub.ends[1], 0.52 * tub.half
    board = block((x - 0.22, -0.98 * tub.half, tub.floor + 0.25), (ahead, 0.98 * tub.half, top), 0.05)
    shelf = merged(  # narrower where the panes round the corners
        *(
            block((start, -wide * tub.half, tub.edge - 0.05), (tub.ends[0] + 0.02, wide * tub.half, tub.edge + 0.02), 0.012)
            for start, wide in ((behind + 0.06, 0.74), (behind + 0.22, 0.94))
        )
    )
    hub = (x - 0.36, y, top - 0.06)
    spokes = [_spoke(hub, turn) for turn in (0.0, math.pi, -0.5 * math.pi)]
    wheel = rotated(merged(ring("x", hub, _WHEEL_M, 0.015, 16, 5), *spokes), "y", -_WHEEL_TILT_RAD, hub)
    column = rod(hub, (x - 0.1, y, top - 0.16), 0.035, segments=8)
    return merged(board, shelf, wheel, column)


def _spoke(hub: tuple[float, float, float], turn_rad: float) -> Mesh:
    x, y, z = hub
    return rod(hub, (x, y + _WHEEL_M * math.cos(turn_rad), z + _WHEEL_M * math.sin(turn_rad)), 0.022, 0.014, 6)


def _seat(tub: Tub, height: float, x: float, y: float, wide: float, *, heads: bool = True) -> Mesh:
    """Return a seat whose back stands at ``x``: cushion, back that leans, and a headrest."""
    deep, _, thick = _SEAT_M
    top, shoulder = _CUSHION_SHARE * height, 0.72 * height
    cushion = block((x, y - 0.5 * wide, max(tub.floor + 0.02, top - 2.0 * thick)), (x + deep, y + 0.5 * wide, top), 0.05)
    upright = block((x - 0.5 * thick, y - 0.48 * wide, top - 0.08), (x + 0.4 * thick, y + 0.48 * wide, shoulder), 0.05)
    back = rotated(upright, "y", -_RECLINE_RAD, (x, y, top))
    return merged(cushion, back, *([_headrest(height, x, y)] if heads else []))


def _headrest(height: float, x: float, y: float) -> Mesh:
    """Return the headrest over a back that stands at ``x``."""
    top, lean = _HEADREST_SHARE * height, math.tan(_RECLINE_RAD) * (0.75 - _CUSHION_SHARE) * height
    rest = block((-0.05, -0.13, top - 0.17), (0.05, 0.13, top), 0.04)
    return merged(moved(rest, x - lean, y), rod((x - lean, y, top - 0.26), (x - lean, y, top - 0.16), 0.03, segments=6))
