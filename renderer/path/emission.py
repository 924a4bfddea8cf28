"""Light that the hit surfaces send by themselves: lamps, window panes, glowing screens, and the weight of finding them by a ray."""

import numpy as np
from numpy.typing import NDArray

from renderer.bsdf.microfacet import fresnel_thin_dielectric
from renderer.core import lanes as ln
from renderer.core import ray_packet as ray
from renderer.core.color import Rgb
from renderer.core.kernel import inlined
from renderer.core.ray_packet import LANES, Packet
from renderer.path import surface_tables as st
from renderer.path.film_sums import CLIPPED_REACH
from renderer.path.infinite_light import infinite_le, sky_le
from renderer.path.lights import Lights, importance, load_bounds
from renderer.path.queues import WAVE
from renderer.path.records import Scratch
from renderer.path.surface_tables import Surfaces
from renderer.scene.spot_lights import profile_toward

_ZERO, _ONE, _TINY = np.float32(0.0), np.float32(1.0), np.float32(1e-30)
_UNLIT = np.float32(0.03)
"""What a glowing surface keeps of its base colour."""


@inlined
def add_emission(limit: np.float32, direct: bool, scratch: Scratch) -> None:
    """Add LE of the hits to the light of their pixels, with the mis weight of the ray.

    ``limit``: the most that a channel may bring to its own pixel; ``direct``: whether to add it to the direct light too.
    """
    lanes, light = scratch.lanes, scratch.light
    for k in range(LANES):
        r, g, b = lanes[ln.LE_R + k], lanes[ln.LE_G + k], lanes[ln.LE_B + k]
        if r + g + b > _ZERO:
            mis_weight = _ONE / (_ONE + lanes[ln.LE_PDF + k] / lanes[ln.RAY_PDF + k])
            r, g, b = r * lanes[ln.BETA_R + k] * mis_weight, g * lanes[ln.BETA_G + k] * mis_weight, b * lanes[ln.BETA_B + k] * mis_weight
            add_stroke((r, g, b), limit, direct, scratch.lane_slot[k], light)


@inlined
def add_stroke(stroke: Rgb, limit: np.float32, direct: bool, slot: int, light: NDArray[np.float32]) -> None:
    """Add light to that of a pixel slot (``Scratch.light``), cd/m2, as far as its limit; ``limit``, ``direct``: of :func:`add_emission`."""
    r, g, b = stroke
    most = max(r, g, b, _TINY)
    scale = min(_ONE, CLIPPED_REACH * limit / most)
    r, g, b, kept = r * scale, g * scale, b * scale, min(_ONE, limit / (most * scale))
    light[slot] += r * kept
    light[WAVE + slot] += g * kept
    light[2 * WAVE + slot] += b * kept
    if direct:
        light[3 * WAVE + slot] += r * kept
        light[4 * WAVE + slot] += g * kept
        light[5 * WAVE + slot] += b * kept
    if kept < _ONE:
        light[6 * WAVE + slot] += r * (_ONE - kept)
        light[7 * WAVE + slot] += g * (_ONE - kept)
        light[8 * WAVE + slot] += b * (_ONE - kept)


@inlined
def escaped_le(surfaces: Surfaces, lights: Lights, packet: Packet, k: int, lanes: NDArray[np.float32]) -> None:
    """Fill LE of lane k, a ray that leaves the scene, with the sky and the infinite light, this by the mis weight of the ray."""
    real = packet.real
    x, y, z = real[ray.DIR_X + k], real[ray.DIR_Y + k], real[ray.DIR_Z + k]
    r, g, b = sky_le(surfaces.sky, x, y, z)
    bright_r, bright_g, bright_b, pdf = infinite_le(lights.infinite, x, y, z)
    scale = _ONE / (_ONE + pdf / lanes[ln.RAY_PDF + k])
    lanes[ln.LE_R + k], lanes[ln.LE_G + k], lanes[ln.LE_B + k] = r + scale * bright_r, g + scale * bright_g, b + scale * bright_b


@inlined
def emitter_le(surfaces: Surfaces, lights: Lights, part: int, primary: bool, packet: Packet, k: int, lanes: NDArray[np.float32]) -> None:
    """Fill LE and LE_PDF of lane k if it hit the front of an emitter; of panes such that show the sky.

    LE_PDF stays 0 for camera rays (``primary``).
    """
    real = packet.real
    group = lights.face_group[packet.integer[ray.PRIM_ID + k]]
    if group >= 0 and lanes[ln.COS_FRONT + k] > _ZERO and lanes[ln.OPEN + k] >= lanes[ln.THIN + k]:
        x, y, z = real[ray.DIR_X + k], real[ray.DIR_Y + k], real[ray.DIR_Z + k]
        r, g, b = surface_le(surfaces, part, x, y, z, lanes[ln.COS_FRONT + k])
        lanes[ln.LE_R + k], lanes[ln.LE_G + k], lanes[ln.LE_B + k] = r, g, b
        if not primary:
            lanes[ln.LE_PDF + k] = _light_pdf(packet, lights, group, k, lanes)
        if len(lights.infinite.part) > 0 and surfaces.materials[part * st.ROW_SIZE + st.PORTAL] > _ZERO:
            _add_infinite_le(surfaces, lights, part, k, x, y, z, lanes)


@inlined
def material_glow(luminance: np.float32, k: int, lanes: NDArray[np.float32]) -> None:
    """Let the front of lane k emit its colour times a luminance, and leave a dark surface.

    Only rays that happen to hit it find such light, at full weight: lights are not sampled there (LE_PDF stays 0).
    """
    if luminance > _ZERO and lanes[ln.COS_FRONT + k] > _ZERO:
        for channel in range(0, 3 * LANES, LANES):
            lanes[ln.LE_R + channel + k] = luminance * lanes[ln.BASE_R + channel + k]
            lanes[ln.BASE_R + channel + k] *= _UNLIT


@inlined
def surface_le(surfaces: Surfaces, part: int, x: np.float32, y: np.float32, z: np.float32, cosine: np.float32) -> Rgb:
    """Return the smooth luminance (r, g, b) that the front of a part sends back to where a ray comes from, cd/m2.

    (x, y, z): the ray's unit direction in the world; ``cosine`` > 0 between wo and the front.
    """
    table, row = surfaces.materials, part * st.ROW_SIZE
    if table[row + st.PORTAL] > _ZERO:
        through = pane_transmittance(surfaces, part, cosine)
        r, g, b = sky_le(surfaces.sky, x, y, z)
        return through * r, through * g, through * b
    share = _ONE
    if table[row + st.PROFILE] > _ZERO:
        share = profile_toward(surfaces.profiles, int(table[row + st.PROFILE]) - 1, -x, -y, -z)
    return share * table[row + st.EMISSION], share * table[row + st.EMISSION + 1], share * table[row + st.EMISSION + 2]


@inlined
def pane_transmittance(surfaces: Surfaces, part: int, cosine: np.float32) -> np.float32:
    """Return the share of light that a pane lets through at this cosine: what it does not reflect, times its transmission."""
    table, row = surfaces.materials, part * st.ROW_SIZE
    through: np.float32 = table[row + st.TRANSMISSION] * (_ONE - fresnel_thin_dielectric(cosine, table[row + st.IOR]))
    return through


@inlined
def _light_pdf(packet: Packet, lights: Lights, group: int, k: int, lanes: NDArray[np.float32]) -> np.float32:
    """Return the density per steradian with which sampling lights at the ray's origin gives the point that the ray hit."""
    real, groups = packet.real, lights.groups
    x, y, z = real[ray.ORG_X + k], real[ray.ORG_Y + k], real[ray.ORG_Z + k]
    value = importance(load_bounds(groups, group), x, y, z, lanes[ln.PREV_NS_X + k], lanes[ln.PREV_NS_Y + k], lanes[ln.PREV_NS_Z + k])
    t, cosine = real[ray.TFAR + k], lanes[ln.COS_FRONT + k]
    pdf: np.float32 = value / lanes[ln.PREV_IMPORTANCE + k] * t * t / (groups.area[group] * cosine)
    return pdf


@inlined
def _add_infinite_le(
    surfaces: Surfaces, lights: Lights, part: int, k: int, x: np.float32, y: np.float32, z: np.float32, lanes: NDArray[np.float32]
) -> None:
    """Add the infinite light to LE of a portal.

    It has a light_pdf of its own, while add_emission weighs by the portal's: LE is scaled so that the product is right.
    """
    r, g, b, pdf = infinite_le(lights.infinite, x, y, z)
    if r + g + b > _ZERO:
        ray_pdf = lanes[ln.RAY_PDF + k]
        through = pane_transmittance(surfaces, part, lanes[ln.COS_FRONT + k])
        scale = through * (_ONE + lanes[ln.LE_PDF + k] / ray_pdf) / (_ONE + pdf / ray_pdf)
        lanes[ln.LE_R + k] += scale * r
        lanes[ln.LE_G + k] += scale * g
        lanes[ln.LE_B + k] += scale * b
