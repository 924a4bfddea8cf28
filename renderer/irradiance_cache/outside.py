"""The sky outside: its light on what stands there, and what gloss there and within shows of it."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from renderer.bsdf.layers import boundary_reflectance
from renderer.bsdf.microfacet import schlick_weight
from renderer.bsdf.reflectance import WIDE
from renderer.core import lanes as ln
from renderer.core import ray_packet as ray
from renderer.core.color import Rgb
from renderer.core.kernel import inlined
from renderer.core.ray_packet import Packet
from renderer.path.infinite_light import sky_le
from renderer.scene.flat_scene import Sky

_ZERO, _HALF, _ONE, _TWO, _TINY = np.float32(0.0), np.float32(0.5), np.float32(1.0), np.float32(2.0), np.float32(1e-20)
_LEAN = np.float32(0.7)
_ABOVE, _HIGHER = np.float32(0.1), np.float32(0.5)
"""Height of the least direction whose sky a pane shows about, and how much higher the other is."""


class UnderSky(NamedTuple):
    """What nodes see of the sky: share: (n,) float32, of the hemisphere, by the cosine; way: (n, 3) float32, the mean direction there.

    The mean of unblocked directions is the bent normal of Landis, "Production-Ready Global Illumination" (2002), times the share.
    """

    share: NDArray[np.float32]
    way: NDArray[np.float32]


NOT_OUTSIDE = UnderSky(np.zeros(0, np.float32), np.zeros((0, 3), np.float32))
"""Of nodes of which none is outside."""


@inlined
def outside_light(sky: Sky, nx: np.float32, ny: np.float32, nz: np.float32) -> Rgb:
    """Return about the mean luminance (r, g, b) of the sky around a unit direction of the world, weighted by the cosine, cd/m2.

    From two directions, 35 degrees above and below.
    """
    up, down = nz + _LEAN, nz - _LEAN
    high = _ONE / np.sqrt(max(nx * nx + ny * ny + up * up, _TINY))
    low = _ONE / np.sqrt(max(nx * nx + ny * ny + down * down, _TINY))
    r, g, b = sky_le(sky, nx * high, ny * high, up * high)
    red, green, blue = sky_le(sky, nx * low, ny * low, down * low)
    return _HALF * (r + red), _HALF * (g + green), _HALF * (b + blue)


@inlined
def mirrored_sky(sky: Sky, rays: Packet, k: int, lanes: NDArray[np.float32]) -> Rgb:
    """Return the luminance (r, g, b), cd/m2, of the sky that what ray k has hit mirrors to it, 0 if that is rough."""
    if lanes[ln.ROUGHNESS + k] >= WIDE:
        return _ZERO, _ZERO, _ZERO
    real = rays.real
    dx, dy, dz = real[ray.DIR_X + k], real[ray.DIR_Y + k], real[ray.DIR_Z + k]
    nx, ny, nz = lanes[ln.NS_X + k], lanes[ln.NS_Y + k], lanes[ln.NS_Z + k]
    along = dx * nx + dy * ny + dz * nz
    r, g, b = sky_le(sky, dx - _TWO * along * nx, dy - _TWO * along * ny, dz - _TWO * along * nz)
    f0, f90 = boundary_reflectance(lanes[ln.IOR + k])
    metallic, schlick = lanes[ln.METALLIC + k], schlick_weight(abs(along))
    f0, f90 = (_ONE - metallic) * f0, (_ONE - metallic) * f90 + metallic
    red, green, blue = f0 + metallic * lanes[ln.BASE_R + k], f0 + metallic * lanes[ln.BASE_G + k], f0 + metallic * lanes[ln.BASE_B + k]
    return (red + (f90 - red) * schlick) * r, (green + (f90 - green) * schlick) * g, (blue + (f90 - blue) * schlick) * b


@inlined
def sky_about(sky: Sky, x: np.float32, y: np.float32, z: np.float32) -> Rgb:
    """Return about the luminance (r, g, b), cd/m2, of the sky around a unit direction: the mean of that there, if it is up, and higher."""
    low = max(z, _ABOVE)
    flat, high = x * x + y * y, low + _HIGHER
    scale, other = _ONE / np.sqrt(flat + low * low), _ONE / np.sqrt(flat + high * high)
    r, g, b = sky_le(sky, scale * x, scale * y, scale * low)
    red, green, blue = sky_le(sky, other * x, other * y, other * high)
    return _HALF * (r + red), _HALF * (g + green), _HALF * (b + blue)


@inlined
def show_sky(sky: Sky, k: int, lanes: NDArray[np.float32]) -> None:
    """Let LI of lane k, which is over the sky's luminance, be by that to which TO_LIGHT leads."""
    x, y, z = lanes[ln.TO_LIGHT_X + k], lanes[ln.TO_LIGHT_Y + k], lanes[ln.TO_LIGHT_Z + k]
    scale = _ONE / np.sqrt(max(x * x + y * y + z * z, _TINY))
    r, g, b = sky_le(sky, scale * x, scale * y, scale * z)
    lanes[ln.LI_R + k] *= r
    lanes[ln.LI_G + k] *= g
    lanes[ln.LI_B + k] *= b
