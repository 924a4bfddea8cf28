"""Light that falls on the nodes of an atlas."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray


class NodeLight(NamedTuple):
    """Light that falls on n nodes, float32.

    indirect, direct: (n, 3), illuminance in lux, by other surfaces and the sky in panes, and by lamps; sun: (n, 4), that by the sun, and
    which share of it arrives; toward: (n, 3), luminance of the light times its direction, world, over the illuminance of indirect and
    direct; valid: (n,), 1, less where nearly all is close by, 0 within an object; open_m: (n,), harmonic mean distance of what surrounds
    the node, metres.
    """

    indirect: NDArray[np.float32]
    direct: NDArray[np.float32]
    sun: NDArray[np.float32]
    toward: NDArray[np.float32]
    valid: NDArray[np.float32]
    open_m: NDArray[np.float32]


def make_node_light(count: int) -> NodeLight:
    """Return light of so many nodes, all dark."""
    color = (count, 3)
    return NodeLight(*(np.zeros(shape, np.float32) for shape in (color, color, (count, 4), color, count, count)))
