"""The light at a hit: by the nodes around it, or by what was computed for a stray; and what of it a wide lobe mirrors."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from renderer.bsdf.microfacet import schlick_weight
from renderer.cached_frames.lobe_shares import ggx_reflected
from renderer.cached_frames.records import ShadeScratch, Tables
from renderer.cached_frames.strays import Strays
from renderer.core import lanes as ln
from renderer.core import ray_packet as ray
from renderer.core.kernel import inlined
from renderer.core.ray_packet import Packet
from renderer.irradiance_cache.nodes import LAMPS, LIGHT, SUN, TOWARD, VALID
from renderer.path.light_nodes import GRID, Atlas, find_nodes

_ZERO, _ONE, _TWO, _TINY = np.float32(0.0), np.float32(1.0), np.float32(2.0), np.float32(1e-20)
_INVERSE_PI = np.float32(1.0 / np.pi)
_LEAST_VALID, _LEAST_ALPHA = np.float32(1e-4), np.float32(1e-4)
_FIRST_ORDER, _MOST_FIRST_ORDER, _MOST_AROUND = np.float32(0.13), np.float32(1.7), np.float32(2.0)
"""By how much the light's direction changes what a lobe of GGX with alpha 1 mirrors of it, and that and the whole at most."""

_LEAST_LAMPS, _MOST_TANGENT = np.float32(0.5), np.float32(3.0)
"""The share of lamps at least by which what is theirs of the light's direction is told, and the most tangent of their angle."""
_LEAST_COSINE, _LEAST_LAMPS_ALPHA = np.float32(0.05), np.float32(0.3)


class Incident(NamedTuple):
    """What is known of the light at a hit.

    r, g, b: illuminance without the sun's, lux; x, y, z: its direction (``NodeLight.toward``); rest: what is to be added to the cosine
    between that and a normal; sun: the most of the sun's share that any node has; lamps: the share of lamps; known: whether any node that
    is not within something knows it.
    """

    r: np.float32
    g: np.float32
    b: np.float32
    x: np.float32
    y: np.float32
    z: np.float32
    rest: np.float32
    sun: np.float32
    lamps: np.float32
    known: bool


@inlined
def read_light(tables: Tables, k: int, memory: ShadeScratch) -> Incident:
    """Return the light at the hit of lane k, by the nodes around it."""
    nodes, weights, rows, rays = memory.trace.nodes, memory.trace.weights, tables.rows, memory.trace.rays
    face, u, v = rays.integer[ray.PRIM_ID + k], rays.real[ray.BARY_U + k], rays.real[ray.BARY_V + k]
    front = memory.trace.lanes[ln.COS_FRONT + k] > _ZERO
    count = find_nodes(tables.fine, face, u, v, front, nodes, weights)
    r = g = b = x = y = z = sun = lamps = total = _ZERO
    for i in range(count):
        node = nodes[i]
        weight = weights[i] * rows[node, VALID]
        total += weight
        r, g, b = r + weight * rows[node, LIGHT], g + weight * rows[node, LIGHT + 1], b + weight * rows[node, LIGHT + 2]
        x += weight * rows[node, TOWARD]
        y += weight * rows[node, TOWARD + 1]
        z += weight * rows[node, TOWARD + 2]
        lamps += weight * rows[node, LAMPS]
        sun = max(sun, rows[node, SUN])
    # Nodes that are black may lie in gaps that what is seen stands out of: it looks around itself.
    if total > _LEAST_VALID and r + g + b + sun > _ZERO:
        scale = _ONE / total
        x, y, z = scale * x, scale * y, scale * z
        rest = _ZERO if tables.fine.cells[face, 3] == GRID else _turned(tables.fine, count, x, y, z, memory)
        return Incident(scale * r, scale * g, scale * b, x, y, z, rest, sun, scale * lamps, True)
    return Incident(_ZERO, _ZERO, _ZERO, _ZERO, _ZERO, _ZERO, _ZERO, _ZERO, _ZERO, False)


@inlined
def light_of_stray(strays: Strays, row: int, place: int) -> Incident:
    """Return the light at the hit at a place of a row, computed for it or another stray."""
    light, i = strays.light, strays.lit_by[row, strays.server[row, place]]
    r, g, b = light.indirect[i, 0], light.indirect[i, 1], light.indirect[i, 2]
    red, green, blue = light.direct[i, 0], light.direct[i, 1], light.direct[i, 2]
    lamps = (red + green + blue) / max(r + g + b + red + green + blue, _TINY)
    x, y, z = light.toward[i, 0], light.toward[i, 1], light.toward[i, 2]
    return Incident(r + red, g + green, b + blue, x, y, z, _ZERO, light.sun[i, 3], lamps, True)


@inlined
def _turned(atlas: Atlas, count: int, x: np.float32, y: np.float32, z: np.float32, memory: ShadeScratch) -> np.float32:
    """Return what the light's direction lacks of a cosine of 1 with the normal that lies between those of the nodes around.

    Each node knows illuminance for its own normal.  Between nodes of other normals it is interpolated; only how relief turns the
    normal away from the one in between changes it.
    """
    nx = ny = nz = _ZERO
    for i in range(count):
        node, weight = memory.trace.nodes[i], memory.trace.weights[i]
        nx += weight * atlas.normal[node, 0]
        ny += weight * atlas.normal[node, 1]
        nz += weight * atlas.normal[node, 2]
    cosine: np.float32 = (x * nx + y * ny + z * nz) / max(np.sqrt(nx * nx + ny * ny + nz * nz), np.float32(1e-6))
    return _ONE - cosine


@inlined
def around_share(incident: Incident, along: np.float32, alpha: np.float32, rays: Packet, lanes: NDArray[np.float32], k: int) -> np.float32:
    """Return the share of the illuminance that comes from where lane k mirrors by a lobe of width ``alpha``, by the light's first order.

    The wider a lobe is, the less it matters where light comes from: the numbers are fitted to what GGX mirrors of light from one direction,
    alpha from 0.36 to 1.
    """
    real = rays.real
    nx, ny, nz = lanes[ln.NS_X + k], lanes[ln.NS_Y + k], lanes[ln.NS_Z + k]
    dx, dy, dz = real[ray.DIR_X + k], real[ray.DIR_Y + k], real[ray.DIR_Z + k]
    cosine = -_TWO * (dx * nx + dy * ny + dz * nz)
    mx, my, mz = dx + cosine * nx, dy + cosine * ny, dz + cosine * nz
    ahead = incident.x * mx + incident.y * my + incident.z * mz - (mx * nx + my * ny + mz * nz) * along
    wide = max(alpha, _LEAST_ALPHA)
    turned = min(_FIRST_ORDER / (wide * wide * wide * np.sqrt(wide)), _MOST_FIRST_ORDER) * ahead
    share: np.float32 = min(max(_ONE + turned, min(alpha, _ONE)), _MOST_AROUND) * _INVERSE_PI
    return share


@inlined
def lamps_share(
    incident: Incident, along: np.float32, alpha: np.float32, rays: Packet, lanes: NDArray[np.float32], k: int
) -> tuple[np.float32, np.float32]:
    """Return what a wide lobe of lane k mirrors of lamps over their illuminance and the Fresnel term, and its weight after Schlick.

    Lamps shine from one direction: what the direction of all light has along the surface is theirs.
    """
    real = rays.real
    nx, ny, nz = lanes[ln.NS_X + k], lanes[ln.NS_Y + k], lanes[ln.NS_Z + k]
    tx, ty, tz = incident.x - along * nx, incident.y - along * ny, incident.z - along * nz
    over = _ONE / max(incident.lamps, _LEAST_LAMPS)
    over = min(over, _MOST_TANGENT / max(np.sqrt(tx * tx + ty * ty + tz * tz), _TINY))
    tx, ty, tz = over * tx, over * ty, over * tz
    cosine = _ONE / np.sqrt(_ONE + tx * tx + ty * ty + tz * tz)
    lx, ly, lz = cosine * (nx + tx), cosine * (ny + ty), cosine * (nz + tz)
    hx, hy, hz = lx - real[ray.DIR_X + k], ly - real[ray.DIR_Y + k], lz - real[ray.DIR_Z + k]
    scale = _ONE / np.sqrt(max(hx * hx + hy * hy + hz * hz, _TINY))
    facet, half = scale * (hx * nx + hy * ny + hz * nz), scale * (hx * lx + hy * ly + hz * lz)
    reflected = ggx_reflected(facet, cosine, max(lanes[ln.WO_Z + k], _LEAST_COSINE), max(alpha, _LEAST_LAMPS_ALPHA))
    return _INVERSE_PI * reflected / cosine, schlick_weight(half)
