"""The sun sampled by its brightness: where nothing stands before it every sample brings the same light."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from renderer.core import lanes as ln
from renderer.core.embree import LANES
from renderer.core.kernel import inlined
from renderer.path.infinite_light import limb_darkening
from renderer.path.light_sampling import sample_infinite_light
from renderer.path.lights import Lights
from renderer.path.records import Scratch
from renderer.path.surface_tables import Surfaces

_ZERO, _HALF, _ONE, _THREE_QUARTERS = np.float32(0.0), np.float32(0.5), np.float32(1.0), np.float32(0.75)


@inlined
def sample_sun(surfaces: Surfaces, lights: Lights, scratch: Scratch) -> None:
    """Fill lanes as :func:`renderer.path.light_sampling.sample_infinite_light` does, but the sun's disc in proportion to its luminance."""
    lanes: NDArray[np.float32] = scratch.lanes
    is_disc = len(lights.infinite.sun) > 0
    if is_disc:
        for k in range(LANES):
            lanes[ln.U_INFINITE_0 + k] = _share_of_disc(lanes[ln.U_INFINITE_0 + k])
    sample_infinite_light(surfaces, lights.infinite, scratch)
    if is_disc:
        for k in range(LANES):
            lanes[ln.LIGHT_PDF + k] *= limb_darkening(lanes[ln.U_INFINITE_0 + k])


@inlined
def _share_of_disc(light: np.float32) -> np.float32:
    """Return the share of the disc's area, from its middle on, that sends this share of its light (Newton's method).

    The share of the light within the area a is the integral of the limb darkening, a / 2 + (1 - (1 - a)^1.5) / 2.
    """
    area = light
    for _ in range(3):
        mu = np.sqrt(_ONE - area)
        within = _HALF * area + _HALF * (_ONE - mu * mu * mu)
        area = min(max(area - (within - light) / (_HALF + _THREE_QUARTERS * mu), _ZERO), _ONE)
    return area
