"""What comes back of laser beams: rays through Embree, on behind glass and off mirrors, and the strongest echo of each.

The light that returns from distance d of a surface under the angle a is proportional to r / d^2 (the laser range equation for targets
wider than the beam; W. Wagner et al., "Gaussian decomposition and calibration of a novel small-footprint full-waveform digitising
airborne laser scanner", ISPRS J. 60, 2006), where the *remission* r = (m + pi f) cos a is 1 for a white matt surface head-on: m is the
matt reflectance, f what a rough mirror sends straight back, F D(a) / (4 cos^2 a) with Beckmann's distribution, whose lobe ends (B. Walter
et al., "Microfacet Models for Refraction through Rough Surfaces", 2007; facets hardly hide each other where the lobe is).  So a window
is seen head-on only.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from renderer.core import ray_packet as ray
from renderer.core.embree import SceneHandle, intersect16
from renderer.core.kernel import entry, kernel
from renderer.core.ray_packet import INVALID_ID, LANES, Packet
from renderer.scene.flat_scene import FlatScene

MATT, GLOSS, ALPHA, THROUGH, MIRRORED = range(5)
"""Columns of ``LaserSurfaces.parts``."""
SMOOTH = 0.2
"""Greatest roughness of surfaces that a beam goes through, or leaves as from a mirror, in one piece."""
_NARROWEST = 0.02
_RED = 0


class LaserSurfaces(NamedTuple):
    """Triangle -> part, (m,) int32; parts: (p, 5) float32, see :func:`laser_surfaces`."""

    face_part: NDArray[np.int32]
    parts: NDArray[np.float32]


def laser_surfaces(flat: FlatScene) -> LaserSurfaces:
    """Tabulate a scene's parts.

    Scanners shine red or in the near infrared; colours are known in RGB only, so red stands for both.  Textures are left out: a part has
    the base colour of its material.  Columns: MATT, the matt reflectance; GLOSS, the Fresnel reflectance head-on; ALPHA, the width of the
    gloss (roughness squared, as of the renderer's materials, but 0.02 at least, the width over which a receiver collects); THROUGH and
    MIRRORED, the share of a beam that goes on behind the surface, or leaves as from a mirror, head-on.  Clear glass swallows what it does
    not let through; frosted glass is matt.
    """
    look, row = flat.materials, flat.parts.material
    base, metallic, through = look.base_color[row, _RED], look.metallic[row], look.transmission[row]
    smooth = look.roughness[row] <= SMOOTH
    parts = np.zeros((len(row), 5), np.float32)
    parts[:, MATT] = np.where(smooth & (through > 0.0), 0.0, base * (1.0 - metallic))
    parts[:, GLOSS] = ((look.ior[row] - 1.0) / (look.ior[row] + 1.0)) ** 2 * (1.0 - metallic) + base * metallic
    parts[:, ALPHA] = np.maximum(look.roughness[row] ** 2, _NARROWEST)
    clear = np.where(flat.parts.portal, 1.0, base)
    parts[:, THROUGH] = np.where(smooth, through * clear * (1.0 - metallic), 0.0)
    parts[:, MIRRORED] = np.where(smooth, parts[:, GLOSS], 0.0)
    if len(flat.absorbs):
        parts[flat.absorbs] = 0.0
        parts[flat.absorbs, ALPHA] = 1.0
    return LaserSurfaces(np.ascontiguousarray(flat.face_part), parts)


MOST_SURFACES = 6
"""Surfaces that a beam is followed to; a drinking glass has four."""
WEAKEST = np.float32(0.01)
"""Share of the light, there and back, below which a beam is not followed."""

_ZERO, _ONE, _TWO, _FOUR, _TINY = np.float32(0.0), np.float32(1.0), np.float32(2.0), np.float32(4.0), np.float32(1e-6)
_PI, _INFINITE, _AWAY_M = np.float32(np.pi), np.float32(np.inf), np.float32(1e-4)


class Echoes(NamedTuple):
    """What comes back along n rays, (n,) float32 each.

    first: distance to the first surface, infinite where there is none; length: way to the surface of the strongest echo, infinite where
    nothing comes back; remission: of that surface, less what was lost on the way; last, last_remission: of the last echo.
    """

    first: NDArray[np.float32]
    length: NDArray[np.float32]
    remission: NDArray[np.float32]
    last: NDArray[np.float32]
    last_remission: NDArray[np.float32]


@entry
def trace_echoes(
    scene: SceneHandle,
    surfaces: LaserSurfaces,
    origins: NDArray[np.float32],
    directions: NDArray[np.float32],
    packet: Packet,
    lanes: NDArray[np.float32],
    echoes: Echoes,
) -> None:
    """Trace rays from ``origins`` along unit ``directions``, (n, 3) each, world, metres; ``packet`` and ``lanes`` (32,) are scratch memory.

    In lane k, ``lanes[k]`` is the share of the light that is left, there and back, and ``lanes[16 + k]`` the way so far.
    """
    alive = packet.alive
    for start in range(0, len(origins), LANES):
        for k in range(LANES):
            _begin(origins, directions, start, k, packet, lanes, echoes)
        for count in range(MOST_SURFACES):
            going = 0
            for k in range(LANES):
                packet.real[ray.TFAR + k] = _INFINITE
                packet.integer[ray.GEOM_ID + k] = INVALID_ID
                going += alive[k]
            if going == 0:
                break
            intersect16(alive.ctypes.data, scene.address, packet.real.ctypes.data, scene.incoherent)
            for k in range(LANES):
                if alive[k] != 0:
                    _meet(surfaces, start + k, k, count == 0, packet, lanes, echoes)


@kernel
def _begin(
    origins: NDArray[np.float32],
    directions: NDArray[np.float32],
    start: int,
    k: int,
    packet: Packet,
    lanes: NDArray[np.float32],
    echoes: Echoes,
) -> None:
    """Aim ray ``start + k`` in lane k, which is switched off beyond the last one."""
    i = min(start + k, len(origins) - 1)
    for axis in range(3):
        packet.real[ray.ORG_X + LANES * axis + k] = origins[i, axis]
        packet.real[ray.DIR_X + LANES * axis + k] = directions[i, axis]
    packet.real[ray.TNEAR + k] = _ZERO
    packet.alive[k] = -1 if start + k < len(origins) else 0
    lanes[k], lanes[LANES + k] = _ONE, _ZERO
    echoes.first[i], echoes.length[i], echoes.remission[i] = _INFINITE, _INFINITE, _ZERO
    echoes.last[i], echoes.last_remission[i] = _INFINITE, _ZERO


@kernel
def _meet(surfaces: LaserSurfaces, i: int, k: int, first: bool, packet: Packet, lanes: NDArray[np.float32], echoes: Echoes) -> None:
    """Keep the echo of what ray i, in lane k, has hit as the last one, and if it is the strongest so far; send the ray on."""
    if packet.integer[ray.GEOM_ID + k] == INVALID_ID:
        packet.alive[k] = 0
        return
    length, remission = echoes.length, echoes.remission
    way = lanes[LANES + k] + packet.real[ray.TFAR + k]
    if first:
        echoes.first[i] = way
    part = surfaces.parts[surfaces.face_part[packet.integer[ray.PRIM_ID + k]]]
    cosine = _cosine(packet.real, k)
    back = lanes[k] * _remission(part, abs(cosine))
    if back > _ZERO:
        echoes.last[i], echoes.last_remission[i] = way, back
    # The strongest by r / d^2.
    if back * length[i] * length[i] > remission[i] * way * way or (np.isinf(length[i]) and back > _ZERO):
        length[i], remission[i] = way, back
    lanes[LANES + k] = way
    _go_on(part, cosine, packet, lanes, k)


@kernel
def _cosine(real: NDArray[np.float32], k: int) -> np.float32:
    """Return the cosine between a ray and the normal of what it hits, negative where it comes against the normal."""
    nx, ny, nz = real[ray.NG_X + k], real[ray.NG_Y + k], real[ray.NG_Z + k]
    along = nx * real[ray.DIR_X + k] + ny * real[ray.DIR_Y + k] + nz * real[ray.DIR_Z + k]
    cosine: np.float32 = along / max(np.sqrt(nx * nx + ny * ny + nz * nz), _TINY)
    return cosine


@kernel
def _remission(part: NDArray[np.float32], cosine: np.float32) -> np.float32:
    """Return what comes straight back, as a share of what a white matt surface sends back head-on."""
    square, alpha_square = max(cosine * cosine, _TINY), part[ALPHA] * part[ALPHA]
    lobe = np.exp(-(_ONE - square) / (square * alpha_square)) / (_PI * alpha_square * square * square)
    remission: np.float32 = part[MATT] * cosine + _PI * part[GLOSS] * lobe / (_FOUR * max(cosine, _TINY))
    return remission


@kernel
def _go_on(part: NDArray[np.float32], cosine: np.float32, packet: Packet, lanes: NDArray[np.float32], k: int) -> None:
    """Send a ray on behind the surface or off it, whichever takes more of the light there and back; switch it off if that is too weak."""
    real = packet.real
    grazing = _ONE - min(abs(cosine), _ONE)
    power = grazing * grazing * grazing * grazing * grazing
    fresnel = part[MIRRORED] + (_ONE - part[MIRRORED]) * power if part[MIRRORED] > _ZERO else _ZERO
    through = part[THROUGH] * (_ONE - fresnel)
    share = max(through, fresnel)
    lanes[k] *= share * share
    if lanes[k] < WEAKEST:
        packet.alive[k] = 0
        return
    distance = real[ray.TFAR + k]
    nx, ny, nz = real[ray.NG_X + k], real[ray.NG_Y + k], real[ray.NG_Z + k]
    turn = _ZERO if through >= fresnel else _TWO * cosine / max(np.sqrt(nx * nx + ny * ny + nz * nz), _TINY)
    for axis in range(3):
        real[ray.ORG_X + LANES * axis + k] += distance * real[ray.DIR_X + LANES * axis + k]
        real[ray.DIR_X + LANES * axis + k] -= turn * real[ray.NG_X + LANES * axis + k]
    real[ray.TNEAR + k] = _AWAY_M
