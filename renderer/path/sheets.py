"""Thin sheets that scatter light to both sides: cloth, blinds, leaves.

What a sheet sends to the viewer has arrived on this side or on the other.  A hit on one is taken from one side, chosen at random in
proportion to what the base scatters to either, and its beta makes up for the choice; from behind it has point and normals on the far side,
and of its BSDF the diffuse base alone.  All that follows, sampling of lights, of directions, and the weights of both, goes on from that
side as from any surface, so that it needs to know nothing of sheets.

Nets have holes: camera rays go straight on through that share of them, as through a pane that mirrors nothing.  For scattered light what
passes holes leaves as all that the sheet lets through does, in every direction: suns and lamps behind a net are found by sampling then.
"""

import numpy as np
from numpy.typing import NDArray

from renderer.core import lanes as ln
from renderer.core.kernel import inlined, kernel
from renderer.core.random_numbers import sample_2d
from renderer.core.ray_packet import LANES
from renderer.path.records import Scratch
from renderer.path.surfaces import lift_height

_ZERO, _ONE, _TWO = np.float32(0.0), np.float32(1.0), np.float32(2.0)
_SIDE_PAIRS = 1 << 19
_AIR = np.float32(1.0003)
"""Index of refraction."""


@inlined
def any_sheet(lanes: NDArray[np.float32]) -> bool:
    """Return whether any lane has hit a sheet that lets light through."""
    most = _ZERO
    for k in range(LANES):
        through = lanes[ln.HIT + k] * lanes[ln.DIFFUSE_TRANSMISSION + k]
        most = through if through > most else most
    return bool(most > _ZERO)


@inlined
def choose_sides(depth: int, sample: np.uint32, scratch: Scratch) -> None:
    """Take hits on sheets from behind as often as their light leaves there, and divide BETA by the probability; pass camera rays on."""
    lanes = scratch.lanes
    if not any_sheet(lanes):
        return
    # These fields get numbers of their own once the side is chosen.
    sample_2d(scratch.lane_seeds, sample, np.uint32(_SIDE_PAIRS + depth), lanes[ln.U_PATCH :])
    for k in range(LANES):
        through = lanes[ln.HIT + k] * lanes[ln.DIFFUSE_TRANSMISSION + k]
        if through > _ZERO:
            if depth == 0 and lanes[ln.U_PATCH + k] < lanes[ln.OPENNESS + k]:
                _take_as_hole(lanes, k)
                continue
            behind = lanes[ln.U_PATCH + k] < through
            scale = _ONE / (through if behind else _ONE - through)
            for channel in range(0, 3 * LANES, LANES):
                lanes[ln.BETA_R + channel + k] *= scale
            if behind:
                take_from_behind(lanes, k)


@inlined
def _take_as_hole(lanes: NDArray[np.float32], k: int) -> None:
    """Make lane k a clear pane of the sheet's colour, which BETA takes."""
    lanes[ln.THIN + k] = lanes[ln.TRANSMISSION + k] = _ONE
    lanes[ln.OPEN + k], lanes[ln.IOR + k] = _ZERO, _AIR
    for channel in range(0, 3 * LANES, LANES):
        lanes[ln.BETA_R + channel + k] *= lanes[ln.BASE_R + channel + k]


@kernel
def take_from_behind(lanes: NDArray[np.float32], k: int) -> None:
    """Bring point and normals of lane k to the other side of its sheet, before its shading frame and BSDF are built."""
    down = _TWO * lift_height(lanes[ln.P_X + k], lanes[ln.P_Y + k], lanes[ln.P_Z + k])
    for axis in range(0, 3 * LANES, LANES):
        lanes[ln.P_X + axis + k] -= down * lanes[ln.NG_X + axis + k]
        lanes[ln.NG_X + axis + k] = -lanes[ln.NG_X + axis + k]
        lanes[ln.NS_X + axis + k] = -lanes[ln.NS_X + axis + k]
    lanes[ln.COS_FRONT + k] = -lanes[ln.COS_FRONT + k]
    lanes[ln.BEHIND + k] = _ONE
