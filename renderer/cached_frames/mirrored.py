"""What hits mirror and what is seen through glass: one ray each, shaded by the light of the coarse nodes.

What smooth mirrors and clear glass show is lit by fine ones, as what is seen itself, so that it has its shadows.
"""

import numpy as np
from numpy.typing import NDArray

from renderer.bsdf.reflectance import rough_shares
from renderer.cached_frames import records as rec
from renderer.cached_frames.added_on_way import add_from_glass, add_scattered
from renderer.cached_frames.hit_light import light_on, look_up
from renderer.cached_frames.records import ROUGH, SHARP, ShadeScratch, Tables, is_faint
from renderer.cached_frames.sunlit_metal import add_sun_on_metal, stand_on_metal
from renderer.cached_frames.wanted import DEEPEST
from renderer.core import lanes as ln
from renderer.core import ray_packet as ray
from renderer.core.color import Rgb
from renderer.core.embree import intersect16
from renderer.core.kernel import inlined, kernel
from renderer.core.random_numbers import mix_bits
from renderer.core.ray_packet import INVALID_ID, LANES, MEET_ALL, PASS_PANES, Packet
from renderer.irradiance_cache.outside import mirrored_sky, outside_light
from renderer.irradiance_cache.specular import (
    along_normal,
    clear_share,
    go_on,
    is_brushed,
    is_clear,
    is_mirror,
    metal_lobe,
    mirror_by_facet,
    ray_cosine,
)
from renderer.path import surface_tables as st
from renderer.path.emission import pane_transmittance
from renderer.path.records import LitScene, Scratch
from renderer.path.surface_tables import Surfaces
from renderer.path.surfaces import evaluate_surfaces

_ZERO, _ONE, _INFINITE = np.float32(0.0), np.float32(1.0), np.float32(np.inf)
_MOST_BRUSHED = 3
_MOST_TIMES = np.float32(8.0)
_BOTH_WAYS = np.float32(1.5)
"""KIND beyond which rays go through, too."""


@inlined
def add_gloss(scene: LitScene, tables: Tables, is_read: NDArray[np.bool_], spread: np.float32, memory: ShadeScratch) -> None:
    """Trace the rays that are sent, on by mirrors and through glass, and add what they see.  ``is_read``: as of ``CachedView``."""
    scratch, primary = memory.trace, memory.primary
    _see_mirrored(scene, tables, is_read, spread, memory)
    _see_more(scene, tables, is_read, spread, memory)
    if _aim_through(scratch, primary) > 0:
        _trace_on(scene, tables, True, memory)
        _see_surfaces(scene, tables, is_read, spread, True, memory)
        for k in range(LANES):
            if primary[rec.KIND, k] > _BOTH_WAYS:
                for channel in range(3):
                    share = (_ONE - primary[rec.SHARE + channel, k]) * primary[rec.BASE + channel, k]
                    primary[rec.LIGHT + channel, k] += share * primary[rec.GLASS + channel, k]


@kernel
def _see_mirrored(scene: LitScene, tables: Tables, is_read: NDArray[np.bool_], spread: np.float32, memory: ShadeScratch) -> None:
    """Trace the mirrored rays and fill SEEN with what they see, by GAIN."""
    primary = memory.primary
    _aim_mirrored(memory.trace, primary)
    _trace_on(scene, tables, False, memory)
    if _see_nodes(scene.surfaces, tables, memory) > 0:
        _see_surfaces(scene, tables, is_read, spread, False, memory)
    limit_seen(primary)
    for k in range(LANES):
        if primary[rec.KIND, k] > _ZERO:
            for channel in range(3):
                primary[rec.SEEN + channel, k] += primary[rec.GLASS + channel, k] + primary[rec.SUNLIGHT + channel, k]
                primary[rec.SEEN + channel, k] *= primary[rec.GAIN + channel, k]


@inlined
def _see_more(scene: LitScene, tables: Tables, is_read: NDArray[np.bool_], spread: np.float32, memory: ShadeScratch) -> None:
    """Trace the further rays of the lanes that send some, and let SEEN be the mean of all."""
    primary, waiting = memory.primary, 0
    for k in range(LANES):
        waiting += primary[rec.MORE, k] > _ZERO
    if waiting == 0:
        return
    for k in range(LANES):
        primary[rec.KIND_BEFORE, k] = primary[rec.KIND, k]
        primary[rec.KIND, k] = primary[rec.MORE, k]
        for channel in range(3):
            primary[rec.SEEN_BEFORE + channel, k] = primary[rec.SEEN + channel, k]
    for turn in range(rec.MORE_RAYS):
        for k in range(LANES):
            for axis in range(3):
                primary[rec.AHEAD + axis, k] = primary[rec.MORE_AHEAD + 3 * turn + axis, k]
                primary[rec.GAIN + axis, k] = primary[rec.MORE_GAIN + 3 * turn + axis, k]
                primary[rec.SEEN + axis, k] = _ZERO
        _see_mirrored(scene, tables, is_read, spread, memory)
        for k in range(LANES):
            if primary[rec.MORE, k] > _ZERO:
                for channel in range(3):
                    primary[rec.SEEN_BEFORE + channel, k] += primary[rec.SEEN + channel, k]
    for k in range(LANES):
        scale = _ONE / np.float32(1 + rec.MORE_RAYS) if primary[rec.MORE, k] > _ZERO else _ONE
        primary[rec.KIND, k] = primary[rec.KIND_BEFORE, k]
        for channel in range(3):
            primary[rec.SEEN + channel, k] = scale * primary[rec.SEEN_BEFORE + channel, k]


@inlined
def limit_seen(primary: NDArray[np.float32]) -> None:
    """Make what a rough lobe's ray has seen no brighter than _MOST_TIMES the mean of the packet's others, where these have seen any light.

    Few rays of such lobes meet what is small and bright, a ceiling above a lamp say, and each would leave a spot as wide as its neighbours
    share it.  Sky that they have come to is as bright as it is between slats: there a few of many do.
    """
    total, count = _ZERO, _ZERO
    for k in range(LANES):
        if primary[rec.KIND, k] > _ZERO and primary[rec.RAY_ALPHA, k] >= SHARP:
            total += primary[rec.SEEN, k] + primary[rec.SEEN + 1, k] + primary[rec.SEEN + 2, k]
            count += _ONE
    for k in range(LANES):
        if primary[rec.KIND, k] > _ZERO and primary[rec.RAY_ALPHA, k] >= SHARP and primary[rec.LEFT, k] == _ZERO:
            seen = primary[rec.SEEN, k] + primary[rec.SEEN + 1, k] + primary[rec.SEEN + 2, k]
            even = primary[rec.EVEN, k] + primary[rec.EVEN + 1, k] + primary[rec.EVEN + 2, k]
            most = _MOST_TIMES * (total - seen + even) / count
            scale = most / seen if seen > most > _ZERO else _ONE
            for channel in range(3):
                primary[rec.SEEN + channel, k] *= scale


@inlined
def _aim_mirrored(scratch: Scratch, primary: NDArray[np.float32]) -> None:
    """Aim the rays of all that mirrors."""
    for k in range(LANES):
        _aim(primary, rec.POINT, rec.AHEAD, primary[rec.KIND, k] > _ZERO, k, scratch.rays)


@inlined
def _aim_through(scratch: Scratch, primary: NDArray[np.float32]) -> int:
    """Aim rays straight on through glass, as if it were thin; return how many there are."""
    count = 0
    for k in range(LANES):
        goes, pane = primary[rec.KIND, k] > _BOTH_WAYS, primary[rec.PANE, k] > _ZERO
        _aim(primary, rec.POINT if pane else rec.EYE, rec.WAY, goes, k, scratch.rays)
        if goes and pane:
            scratch.rays.integer[ray.MASK + k] = PASS_PANES
        count += goes
    return count


@inlined
def _aim(primary: NDArray[np.float32], point: int, way: int, goes: bool, k: int, rays: Packet) -> None:
    """Aim ray k from a point of ``primary`` along a direction there, if it ``goes``."""
    real = rays.real
    rays.alive[k], rays.integer[ray.GEOM_ID + k] = -1 if goes else 0, INVALID_ID
    real[ray.TNEAR + k], real[ray.TFAR + k] = _ZERO, np.inf
    real[ray.NG_X + k], real[ray.NG_Y + k], real[ray.NG_Z + k] = _ZERO, _ZERO, _ZERO
    if goes:
        for axis in range(3):
            real[ray.ORG_X + LANES * axis + k] = primary[point + axis, k]
            real[ray.DIR_X + LANES * axis + k] = primary[way + axis, k]


@inlined
def _trace_on(scene: LitScene, tables: Tables, through: bool, memory: ShadeScratch) -> None:
    """Trace the rays that are aimed to what is no mirror and no clear glass, and fill BETA with what those leave of its light.

    Rough metal mirrors them on, too, by a microfacet, up to _MOST_BRUSHED times.  GLASS becomes what the fronts of glass, and metal as far
    as it scatters, send towards them beside, by the light of the coarse nodes there.
    ``through``: rays through glass begin at the camera, and what the face that it sees lets through is in BASE already.
    """
    scratch, primary, surfaces = memory.trace, memory.primary, scene.surfaces
    rays, lanes = scratch.rays, scratch.lanes
    real, integer, alive = rays.real, rays.integer, rays.alive
    waiting, has_sun = 0, len(scene.lights.infinite.sun) > 0 and len(scene.lights.infinite.part) > 0
    for k in range(LANES):
        primary[rec.TURNED, k] = primary[rec.LEFT, k] = _ZERO
        primary[rec.GLASS, k] = primary[rec.GLASS + 1, k] = primary[rec.GLASS + 2, k] = _ZERO
        primary[rec.SUNLIGHT, k] = primary[rec.SUNLIGHT + 1, k] = primary[rec.SUNLIGHT + 2, k] = _ZERO
        lanes[ln.BETA_R + k] = lanes[ln.BETA_G + k] = lanes[ln.BETA_B + k] = _ONE
        waiting += alive[k] != 0
    for depth in range(DEEPEST):
        if waiting == 0:
            break
        intersect16(alive.ctypes.data, scene.tree.address, real.ctypes.data, scene.tree.incoherent)
        scratch.traced[0] += waiting
        waiting = metal = 0
        for k in range(LANES):
            lanes[ln.HIT + k] = _ZERO
            met = alive[k] != 0 and integer[ray.GEOM_ID + k] != INVALID_ID
            alive[k] = 0
            if not met:
                continue
            part = surfaces.face_part[integer[ray.PRIM_ID + k]]
            table, at = surfaces.materials, part * st.ROW_SIZE
            if table[at + st.PORTAL] > _ZERO and primary[rec.LEFT, k] == _ZERO and depth + 1 < DEEPEST:
                # Out of a window.
                share = pane_transmittance(surfaces, part, ray_cosine(rays, k))
                for channel in range(0, 3 * LANES, LANES):
                    lanes[ln.BETA_R + channel + k] *= share
                primary[rec.LEFT, k], integer[ray.MASK + k] = _ONE, PASS_PANES
                go_on(rays, k, False)
                waiting += 1
                continue
            clear, mirror = is_clear(table, at), is_mirror(table, at)
            if (clear or mirror) and depth + 1 < DEEPEST:
                if not through or depth > 0 or primary[rec.PANE, k] > _ZERO:
                    if clear:
                        add_from_glass(table, at, tables, through, k, memory)
                    for channel in range(3):
                        lanes[ln.BETA_R + LANES * channel + k] *= (
                            clear_share(table, at, channel) if clear else table[at + st.BASE + channel]
                        )
                go_on(rays, k, mirror)
                waiting += 1
                # What a rough lobe shows of lamps and panes is known only where no mirror turns it.
                if mirror and not through and primary[rec.RAY_ALPHA, k] >= SHARP:
                    primary[rec.TURNED, k] = _ONE
            elif not through and depth < _MOST_BRUSHED and is_brushed(table, at):
                # Numbers that have nothing to do with those of the pixel's own lobe.
                seed = mix_bits(np.uint32(memory.pixels[0, k]) ^ mix_bits(np.uint32(memory.pixels[1, k] + 8192 * (depth + 1))))
                lobe = metal_lobe(table, at)
                add_scattered(table, at, tables, k, memory)
                if has_sun:
                    stand_on_metal(scene, lobe, k, memory)
                    metal += 1
                went = mirror_by_facet(surfaces, lobe, seed, k, scratch)
                primary[rec.TURNED, k] = _ONE if went else primary[rec.TURNED, k]
                waiting += went
        if metal > 0:
            add_sun_on_metal(scene, memory)
    # All rays that were sent are to be shaded where they ended.
    for k in range(LANES):
        alive[k] = -1 if primary[rec.KIND, k] > (_BOTH_WAYS if through else _ZERO) else 0
        integer[ray.MASK + k] = MEET_ALL
        if alive[k] == 0:
            integer[ray.GEOM_ID + k] = INVALID_ID


@inlined
def _see_nodes(surfaces: Surfaces, tables: Tables, memory: ShadeScratch) -> int:
    """Fill SEEN, by light and colour of the coarse nodes alone, where the mirror image is rough or faint; return how many rays are left.

    What shines of itself is left to :func:`_see_surfaces`, unless it is shown as a ball.
    """
    rays, lanes, primary = memory.trace.rays, memory.trace.lanes, memory.primary
    integer = rays.integer
    waiting = 0
    for k in range(LANES):
        if rays.alive[k] == 0:
            continue
        alpha = primary[rec.RAY_ALPHA, k]
        blurred = alpha > ROUGH or is_faint(primary, k)
        shown = _ZERO if primary[rec.TURNED, k] > _ZERO else alpha
        if not blurred or integer[ray.GEOM_ID + k] == INVALID_ID or _shines(surfaces, integer[ray.PRIM_ID + k], shown):
            waiting += 1
            continue
        r, g, b, found = look_up(tables, tables.leaving, bool(along_normal(rays, k) < _ZERO), k, memory)
        if not found:
            waiting += 1
            continue
        primary[rec.SEEN, k] = r * lanes[ln.BETA_R + k]
        primary[rec.SEEN + 1, k] = g * lanes[ln.BETA_G + k]
        primary[rec.SEEN + 2, k] = b * lanes[ln.BETA_B + k]
        rays.alive[k] = 0
        integer[ray.GEOM_ID + k] = INVALID_ID
    return waiting


@inlined
def _shines(surfaces: Surfaces, face: int, alpha: np.float32) -> bool:
    """Return whether a ray of a lobe so wide is to see light that a triangle sends itself."""
    materials, at = surfaces.materials, surfaces.face_part[face] * st.ROW_SIZE
    light = materials[at + st.GLOW]
    if alpha < SHARP:
        light += materials[at + st.PORTAL] + materials[at + st.EMISSION + 1]
    return bool(light != _ZERO)


@inlined
def _see_surfaces(
    scene: LitScene, tables: Tables, is_read: NDArray[np.bool_], spread: np.float32, through: bool, memory: ShadeScratch
) -> None:
    """Add what the rays that are left see: textures and emission of what they hit, lit by the nodes around.

    Where none of these knows any, what lights the pixel's own surface does: such places are narrow gaps, as between a mirror and its frame.
    """
    scratch, lanes, primary = memory.trace, memory.trace.lanes, memory.primary
    for k in range(LANES):
        lanes[ln.WIDTH + k], lanes[ln.SPREAD + k] = _ZERO, spread
        lanes[ln.OUTSIDE + k] = max(primary[rec.PANE, k], primary[rec.LEFT, k]) if through else primary[rec.LEFT, k]
        lanes[ln.RAY_PDF + k], lanes[ln.PREV_IMPORTANCE + k] = np.float32(1e-20), _ONE
    evaluate_surfaces(scene, True, True, _INFINITE, scratch)
    for k in range(LANES):
        # What leaves by a pane shows the sky, unless rough gloss knows that; other rays that leave show nothing.
        if scratch.rays.alive[k] == 0 or (lanes[ln.HIT + k] == _ZERO and lanes[ln.OUTSIDE + k] == _ZERO):
            continue
        if lanes[ln.HIT + k] == _ZERO:
            for channel in range(3):
                sky = lanes[ln.LE_R + LANES * channel + k] * lanes[ln.BETA_R + LANES * channel + k]
                if through:
                    primary[rec.LIGHT + channel, k] += (_ONE - primary[rec.SHARE + channel, k]) * primary[rec.BASE + channel, k] * sky
                elif not _knows_lamps(primary, k):
                    primary[rec.SEEN + channel, k] = sky
            continue
        le_r, le_g, le_b = _emitted(scene.surfaces, through, k, memory)
        matt, mirrored = rough_shares(lanes, scene.surfaces.albedos.reflected, k)
        front, outside = lanes[ln.COS_FRONT + k] > _ZERO, lanes[ln.OUTSIDE + k] > _ZERO
        sharp = (through | (primary[rec.RAY_ALPHA, k] < SHARP)) & (primary[rec.TURNED, k] == _ZERO) & (not outside)
        lit_r, lit_g, lit_b, found = light_on(tables, is_read, sharp, front, k, memory)
        around_r, around_g, around_b, _ = look_up(tables, tables.around, front, k, memory)
        if outside and (not found or lit_r + lit_g + lit_b == _ZERO):
            # What no node outside knows is lit by all of the sky.
            lit_r, lit_g, lit_b = outside_light(scene.surfaces.sky, lanes[ln.NS_X + k], lanes[ln.NS_Y + k], lanes[ln.NS_Z + k])
        elif not found:
            lit_r, lit_g, lit_b = primary[rec.EVEN, k], primary[rec.EVEN + 1, k], primary[rec.EVEN + 2, k]
        if outside:
            # Instead of what is even there, which its lacquer shows of the sky.
            r, g, b = mirrored_sky(scene.surfaces.sky, scratch.rays, k, lanes)
            le_r, le_g, le_b, around_r, around_g, around_b = le_r + r, le_g + g, le_b + b, _ZERO, _ZERO, _ZERO
        elif not found:
            around_r, around_g, around_b = lit_r, lit_g, lit_b
        passes = lanes[ln.DIFFUSE_TRANSMISSION + k]
        if passes > _ZERO:
            # A sheet sends on what falls on its other side, too.
            back_r, back_g, back_b, _ = light_on(tables, is_read, sharp, not front, k, memory)
            lit_r, lit_g, lit_b = (
                lit_r + passes * (back_r - lit_r),
                lit_g + passes * (back_g - lit_g),
                lit_b + passes * (back_b - lit_b),
            )
        r = (le_r + matt[0] * lit_r + mirrored[0] * around_r) * lanes[ln.BETA_R + k]
        g = (le_g + matt[1] * lit_g + mirrored[1] * around_g) * lanes[ln.BETA_G + k]
        b = (le_b + matt[2] * lit_b + mirrored[2] * around_b) * lanes[ln.BETA_B + k]
        if through:
            primary[rec.LIGHT, k] += (_ONE - primary[rec.SHARE, k]) * primary[rec.BASE, k] * r
            primary[rec.LIGHT + 1, k] += (_ONE - primary[rec.SHARE + 1, k]) * primary[rec.BASE + 1, k] * g
            primary[rec.LIGHT + 2, k] += (_ONE - primary[rec.SHARE + 2, k]) * primary[rec.BASE + 2, k] * b
        else:
            primary[rec.SEEN, k], primary[rec.SEEN + 1, k], primary[rec.SEEN + 2, k] = r, g, b


@inlined
def _knows_lamps(primary: NDArray[np.float32], k: int) -> bool:
    """Return whether it is known without a ray what the gloss of lane k shows of lamps and panes."""
    return bool((primary[rec.RAY_ALPHA, k] >= SHARP) & (primary[rec.TURNED, k] == _ZERO))


@inlined
def _emitted(surfaces: Surfaces, through: bool, k: int, memory: ShadeScratch) -> Rgb:
    """Return the luminance that what ray k hits sends itself; 0 of lamps and panes of which rough gloss knows what it shows."""
    lanes, materials = memory.trace.lanes, surfaces.materials
    at = surfaces.face_part[memory.trace.rays.integer[ray.PRIM_ID + k]] * st.ROW_SIZE
    if not through and _knows_lamps(memory.primary, k) and materials[at + st.PORTAL] + materials[at + st.EMISSION + 1] > _ZERO:
        return _ZERO, _ZERO, _ZERO
    return lanes[ln.LE_R + k], lanes[ln.LE_G + k], lanes[ln.LE_B + k]
