"""The environment outside the portals (window panes): luminance by direction, and its brightest parts as an infinite light.

The environment is split in two.  What is smooth, the sky, is sampled by points on the portals (:mod:`renderer.path.lights`).  What is small
and bright, the sun's disc or bright pixels of an environment map, is the *infinite light*: it is sampled by direction, and lights a point
only where that direction leads through a portal.  Both share their light with BSDF samples by mis weights, so that mirrors show them too.

The sun is sampled evenly over its disc; its limb is darker by I / I0 = 1 - u (1 - mu), mu the cosine at the sun's surface, u = 0.6 for
visible light (Cox, Allen's Astrophysical Quantities, 4th edition, 2000, section 14.7, tabulates u by wavelength).
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from renderer.core.color import LUMINANCE, Rgb
from renderer.core.equirectangular import bilinear_map, map_position, pixel_solid_angles
from renderer.core.kernel import inlined, kernel
from renderer.core.sampling import coordinate_system, cos_sin_two_pi
from renderer.scene.flat_scene import FlatScene, Sky
from renderer.scene.sky import sky_of
from scene_description.products import matmul

_ZERO, _ONE, _TINY = np.float32(0.0), np.float32(1.0), np.float32(1e-30)
_PI = np.float32(np.pi)


_TWO, _HALF = np.float32(2.0), np.float32(0.5)
_TURN = np.float32(2.0 * np.pi)
_LIMB = np.float32(0.6)
_LIMB_MEAN = np.float32(1.0 - 0.6 / 3.0)


class InfiniteLight(NamedTuple):
    """Portals, and what is sampled by direction through them, for kernels.

    portals: (p, 12) float32, corner, two edges and unit normal (into the room) of each portal triangle; part: (p,) int32.  sun: as in
    ``Sky``.  bright: (h, w, 3) float32, luminance above the smooth part of an environment map, cd/m2; pdf: (h, w) float32, density per
    steradian of sampling each pixel; rows: (h,) and columns: (h, w) float32, cumulative probabilities of rows, and of pixels within their
    rows.  All of them are empty where there is nothing to sample.
    """

    portals: NDArray[np.float32]
    part: NDArray[np.int32]
    sun: NDArray[np.float32]
    bright: NDArray[np.float32]
    pdf: NDArray[np.float32]
    rows: NDArray[np.float32]
    columns: NDArray[np.float32]


def build_infinite_light(flat: FlatScene) -> InfiniteLight:
    """Collect portals, and the tables by which bright parts of the environment are sampled."""
    sky = sky_of(flat)
    portal = np.flatnonzero(flat.parts.portal[flat.face_part]) if len(sky.sun) or sky.bright.size else np.zeros(0, np.int64)
    a, b, c = (flat.mesh.vertices.astype(np.float64)[flat.mesh.faces[portal, i]] for i in range(3))
    normal = np.cross(b - a, c - a)
    size = np.linalg.norm(normal, axis=1, keepdims=True)
    flat_enough = size[:, 0] > 1e-10
    rows = np.concatenate([a, b - a, c - a, normal / np.maximum(size, 1e-30)], axis=1)[flat_enough]
    tables = (
        sampling_tables(sky.bright)
        if sky.bright.size
        else (np.zeros((0, 0), np.float32), np.zeros(0, np.float32), np.zeros((0, 0), np.float32))
    )
    return InfiniteLight(
        np.ascontiguousarray(rows, np.float32),
        np.ascontiguousarray(flat.face_part[portal][flat_enough], np.int32),
        np.ascontiguousarray(sky.sun, np.float32),
        np.ascontiguousarray(sky.bright, np.float32),
        *tables,
    )


def sampling_tables(bright: NDArray[np.float32]) -> tuple[NDArray[np.float32], NDArray[np.float32], NDArray[np.float32]]:
    """Return pdf (h, w), rows (h,) and columns (h, w) of ``InfiniteLight`` for luminance (h, w, 3): by flux, pixel by pixel."""
    height, width = bright.shape[:2]
    angle = pixel_solid_angles(height, width)
    flux = matmul(bright.astype(np.float64), LUMINANCE) * angle[:, None]
    share = flux / flux.sum()
    by_row = share.sum(axis=1)
    rows = np.cumsum(by_row)
    columns = np.cumsum(share, axis=1) / np.maximum(by_row, 1e-300)[:, None]
    pdf = share / angle[:, None]
    return (
        np.ascontiguousarray(pdf, np.float32),
        np.ascontiguousarray(rows / rows[-1], np.float32),
        np.ascontiguousarray(columns, np.float32),
    )


@inlined
def sky_le(sky: Sky, x: np.float32, y: np.float32, z: np.float32) -> Rgb:
    """Return the smooth luminance of the environment towards a unit direction of the world, cd/m2."""
    table = sky.table
    if table.shape[0] == 0:
        if z < _ZERO:
            return sky.ground[0], sky.ground[1], sky.ground[2]
        low, high = sky.horizon, sky.zenith
        return low[0] + z * (high[0] - low[0]), low[1] + z * (high[1] - low[1]), low[2] + z * (high[2] - low[2])
    return bilinear_map(table, x, y, z)


@inlined
def infinite_le(
    infinite: InfiniteLight, x: np.float32, y: np.float32, z: np.float32
) -> tuple[np.float32, np.float32, np.float32, np.float32]:
    """Return luminance (r, g, b) of the infinite light in a unit direction, cd/m2, and the density per steradian of sampling it there."""
    sun = infinite.sun
    if len(sun) > 0:
        dx, dy, dz = x - sun[0], y - sun[1], z - sun[2]
        apart = _HALF * (dx * dx + dy * dy + dz * dz) / sun[3]
        if apart < _ONE:
            scale = limb_darkening(apart)
            return scale * sun[4], scale * sun[5], scale * sun[6], _ONE / (_TURN * sun[3])
    elif infinite.bright.shape[0] > 0:
        height, width = infinite.bright.shape[0], infinite.bright.shape[1]
        across, down = map_position(x, y, z, np.int32(height), np.int32(width))
        j, i = min(int(across), width - 1), min(int(down), height - 1)
        return infinite.bright[i, j, 0], infinite.bright[i, j, 1], infinite.bright[i, j, 2], infinite.pdf[i, j]
    return _ZERO, _ZERO, _ZERO, _ZERO


@inlined
def limb_darkening(apart: np.float32) -> np.float32:
    """Return the sun's luminance over its mean; ``apart``: squared distance from the middle over the squared radius, in [0, 1]."""
    mu = np.sqrt(max(_ONE - apart, _ZERO))
    shade: np.float32 = (_ONE - _LIMB * (_ONE - mu)) / _LIMB_MEAN
    return shade


@inlined
def sample_infinite(infinite: InfiniteLight, u: np.float32, v: np.float32) -> Rgb:
    """Return a unit direction to the infinite light, for two random numbers in [0, 1)."""
    sun = infinite.sun
    if len(sun) > 0:
        versine = u * sun[3]
        aside = np.sqrt(versine * (_TWO - versine))
        ux, uy, uz, vx, vy, vz = coordinate_system(sun[0], sun[1], sun[2])
        cosine, sine = cos_sin_two_pi(v)
        a, b, c = aside * cosine, aside * sine, _ONE - versine
        return a * ux + b * vx + c * sun[0], a * uy + b * vy + c * sun[1], a * uz + b * vz + c * sun[2]
    height, width = infinite.bright.shape[0], infinite.bright.shape[1]
    i, s = _invert_cdf(infinite.rows, v)
    j, t = _invert_cdf(infinite.columns[i], u)
    top, bottom = np.sin(_PI * (_HALF - np.float32(i) / np.float32(height))), np.sin(_PI * (_HALF - np.float32(i + 1) / np.float32(height)))
    z = top + s * (bottom - top)
    yaw = _PI - _TURN * (np.float32(j) + t) / np.float32(width)
    level = np.sqrt(max(_ONE - z * z, _ZERO))
    return level * np.cos(yaw), level * np.sin(yaw), z


@kernel
def _invert_cdf(cumulative: NDArray[np.float32], u: np.float32) -> tuple[int, np.float32]:
    """Return the first entry beyond ``u`` and where within its step ``u`` is, in [0, 1)."""
    low, high = 0, len(cumulative) - 1
    while low < high:
        middle = (low + high) >> 1
        if u < cumulative[middle]:
            high = middle
        else:
            low = middle + 1
    before = cumulative[low - 1] if low > 0 else _ZERO
    return low, min(max((u - before) / max(cumulative[low] - before, _TINY), _ZERO), np.float32(0.99999994))
