"""What glass and rough metal that a ray passes on its way send towards it beside what comes along it."""

import numpy as np
from numpy.typing import NDArray

from renderer.cached_frames import records as rec
from renderer.cached_frames.hit_light import look_up
from renderer.cached_frames.records import ShadeScratch, Tables
from renderer.core import lanes as ln
from renderer.core import ray_packet as ray
from renderer.core.kernel import inlined
from renderer.core.ray_packet import LANES
from renderer.irradiance_cache.specular import along_normal, clear_share
from renderer.path import surface_tables as st

_ZERO, _ONE, _TWO = np.float32(0.0), np.float32(1.0), np.float32(2.0)
_TINY, _PARALLEL = np.float32(1e-20), np.float32(0.9995)
_FACE = np.float32(0.04)
"""What a face of glass mirrors."""


@inlined
def add_from_glass(table: NDArray[np.float32], at: int, tables: Tables, through: bool, k: int, memory: ShadeScratch) -> None:
    """Add to GLASS what clear glass sends towards ray k, which has met it, beside what comes through it.

    Where the ray leaves the glass that the pixel shows, that is what the face sends back of the light that falls on the pixel's surface;
    of what it scatters into the glass, all that is mirrored within is scattered again.  Where that face lies along the first, as of panes,
    it shows the image that this mirrors once more.
    """
    rays, lanes, primary = memory.trace.rays, memory.trace.lanes, memory.primary
    if along_normal(rays, k) < _ZERO:
        r, g, b, _ = look_up(tables, tables.leaving, True, k, memory)
        primary[rec.GLASS, k] += lanes[ln.BETA_R + k] * (_ONE - clear_share(table, at, 0)) * r
        primary[rec.GLASS + 1, k] += lanes[ln.BETA_G + k] * (_ONE - clear_share(table, at, 1)) * g
        primary[rec.GLASS + 2, k] += lanes[ln.BETA_B + k] * (_ONE - clear_share(table, at, 2)) * b
    elif through:
        opaque, leaves = _ONE - table[at + st.TRANSMISSION], _ONE / (table[at + st.IOR] * table[at + st.IOR])
        slab = _is_parallel(k, memory)
        for channel in range(3):
            base = table[at + st.BASE + channel]
            back = opaque * base * leaves / (_ONE - (_ONE - leaves) * base)
            even, share = primary[rec.EVEN + channel, k], primary[rec.SHARE + channel, k]
            mirrored = share * primary[rec.SEEN + channel, k] if slab else _FACE * even
            lit = clear_share(table, at, channel) * (back * even + (_ONE - opaque) * mirrored)
            primary[rec.GLASS + channel, k] += lanes[ln.BETA_R + LANES * channel + k] * lit


@inlined
def _is_parallel(k: int, memory: ShadeScratch) -> bool:
    """Return whether what ray k has met would send the pixel's ray where the pixel's own surface mirrors it."""
    real, primary, along, squared, alike, length = memory.trace.rays.real, memory.primary, _ZERO, _ZERO, _ZERO, _ZERO
    for axis in range(3):
        way, normal = primary[rec.WAY + axis, k], real[ray.NG_X + LANES * axis + k]
        along, squared, length = along + way * normal, squared + normal * normal, length + way * way
    for axis in range(3):
        mirrored = primary[rec.WAY + axis, k] - _TWO * along / max(squared, _TINY) * real[ray.NG_X + LANES * axis + k]
        alike += mirrored * primary[rec.AHEAD + axis, k]
    return bool(alike > _PARALLEL * np.sqrt(length))


@inlined
def add_scattered(table: NDArray[np.float32], at: int, tables: Tables, k: int, memory: ShadeScratch) -> None:
    """Add to GLASS what brushed metal that ray k has met, as far as it is no metal, scatters towards it."""
    scatters = _ONE - table[at + st.METALLIC]
    if scatters <= _ZERO:
        return
    rays, lanes, primary = memory.trace.rays, memory.trace.lanes, memory.primary
    lit_r, lit_g, lit_b, _ = look_up(tables, tables.even, bool(along_normal(rays, k) < _ZERO), k, memory)
    primary[rec.GLASS, k] += lanes[ln.BETA_R + k] * scatters * table[at + st.BASE] * lit_r
    primary[rec.GLASS + 1, k] += lanes[ln.BETA_G + k] * scatters * table[at + st.BASE + 1] * lit_g
    primary[rec.GLASS + 2, k] += lanes[ln.BETA_B + k] * scatters * table[at + st.BASE + 2] * lit_b
