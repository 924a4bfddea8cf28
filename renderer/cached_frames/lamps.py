"""Lamps and panes as balls and rectangles: how much of each gloss mirrors where nothing hides it, and which are asked for."""

import numpy as np
from numpy.typing import NDArray

from renderer.bsdf.microfacet import schlick_weight
from renderer.cached_frames import records as rec
from renderer.cached_frames.gloss_rays import base_fresnel, pixel_noise
from renderer.cached_frames.lamp_lobes import aim_facets, ball_cosine, from_hit, lobe_width, outer_fresnel, shown_radius_squared
from renderer.cached_frames.lamp_shapes import Lamps
from renderer.cached_frames.lobe_places import mirrored_reach, mirroring_span
from renderer.cached_frames.lobe_shares import (
    build_frames,
    ggx_reflected,
    in_frame,
    mirrored_share,
    quadrilateral_share,
    row_length,
    slopes_in_disc,
    to_local,
)
from renderer.cached_frames.records import LAMP_RAYS, SHARP, ShadeScratch, asks_lamps
from renderer.core import lanes as ln
from renderer.core.color import Rgb
from renderer.core.kernel import inlined, kernel
from renderer.core.ray_packet import LANES
from renderer.core.sampling import Vector, dot
from renderer.irradiance_cache.outside import sky_about
from renderer.path import surface_tables as st
from renderer.path.emission import pane_transmittance, surface_le
from renderer.path.surface_tables import Surfaces

_ZERO, _ONE = np.float32(0.0), np.float32(1.0)
_INFINITE, _TINY, _BELOW_ONE = np.float32(np.inf), np.float32(1e-20), np.float32(1.0 - 2.0**-24)
_LEAST, _LEFT_OUT, _FAINT = np.float32(0.002), np.float32(0.01), np.float32(0.3)
"""Shares of a pixel's other light from which on a lamp in its gloss counts, and from which on all are worth one shadow ray, or more."""
_SPAN = np.float32(5.0)
"""How far to the sides of the mirrored direction what is flat is looked for, in widths of GGX."""
_PER_FLANK, _STEEPEST = np.float32(20.0), np.float32(4.0)
"""One over the share of a lobe below which a rectangle is on its flank, and the most that this is raised to GGX's density."""
_NEAR, _ASIDE = np.float32(0.7), np.float32(0.15)
"""Where what is flat is taken to be bright and reflected: how much by the place nearest to the mirrored ray, and by each end."""
CHOICE = np.uint32(11)
"""Key of the two noises of a pixel by which its lamps and points on them are chosen."""


@inlined
def choose_lamps(surfaces: Surfaces, lamps: Lamps, alone: bool, memory: ShadeScratch) -> int:
    """Choose balls that the lanes with ASKS mirror, by how much each adds to the pixel; return the most rays that one sends.

    LAMPLIGHT becomes what all add together, r + g + b, and PICKED which they are; the numbers that choose are evenly apart, and what is
    left of them serves to choose points.  Less than a hundredth of the pixel's light is left out, and what is little asks fewer rays.
    ``alone``: whether each sends rays of its own; else every second one of those that are little lit by lamps does.
    """
    lanes, gloss, primary = memory.trace.lanes, memory.gloss, memory.primary
    for k in range(LANES):
        gloss[rec.LOBE_R + k], gloss[rec.LOBE_G + k], gloss[rec.LOBE_B + k] = _lobe(primary, k)
        gloss[rec.LOBE_ALPHA + k], gloss[rec.LOBE_UNDER_ALPHA + k] = primary[rec.SHOWN_ALPHA, k], primary[rec.UNDER_ALPHA, k]
        light = primary[rec.LIGHT, k] + primary[rec.LIGHT + 1, k] + primary[rec.LIGHT + 2, k]
        gloss[rec.LEAST + k] = _LEAST * light if gloss[rec.ASKS + k] > _ZERO else _INFINITE
        gloss[rec.LAMPLIGHT + k] = gloss[rec.ASKED + k] = _ZERO
        noise, _ = pixel_noise(memory.pixels[0, k], memory.pixels[1, k], CHOICE)
        for j in range(LAMP_RAYS):
            gloss[rec.PICKED_U + LANES * j + k] = (np.float32(j) + noise) / np.float32(LAMP_RAYS)
    coated = build_frames(lanes, gloss)
    for i in range(len(lamps.balls)):
        if lamps.balls[i, 7] > _ZERO:
            _mirror_rectangle(lamps.balls, i, coated, lanes, gloss)
        else:
            _mirror_ball(lamps.balls, i, lanes, gloss)
        if _reflect_ball(lamps.most[i], lanes, gloss):
            _show_ball(surfaces, lamps.part[i], gloss)
            _pick(np.float32(i), gloss)
    most = _ZERO
    for k in range(LANES):
        light = primary[rec.LIGHT, k] + primary[rec.LIGHT + 1, k] + primary[rec.LIGHT + 2, k]
        count = _ray_count(gloss[rec.LAMPLIGHT + k], light)
        gloss[rec.LAMPLIGHT + k] = gloss[rec.LAMPLIGHT + k] if count > _ZERO else _ZERO
        count = count if alone or count > _ONE or asks_lamps(memory.pixels[0, k], memory.pixels[1, k]) else _ZERO
        gloss[rec.LAMP_RAY_COUNT + k], most = count, max(most, count)
    return int(most)


@inlined
def _ray_count(lamplight: np.float32, light: np.float32) -> np.float32:
    """Return by how many points it is asked what of lamps' light is hidden from a pixel that has so much other light."""
    return _ZERO if lamplight <= _LEFT_OUT * light else _ONE if lamplight < _FAINT * light else np.float32(LAMP_RAYS)


@inlined
def _lobe(primary: NDArray[np.float32], k: int) -> Rgb:
    return primary[rec.SHARE, k], primary[rec.SHARE + 1, k], primary[rec.SHARE + 2, k]


@kernel
def _mirror_ball(balls: NDArray[np.float32], i: int, lanes: NDArray[np.float32], gloss: NDArray[np.float32]) -> None:
    """Fill BALL_X to BALL_HALF of ball i.

    Lobes narrower than SHARP see lamps and panes by their rays.
    """
    radius = balls[i, 3]
    for k in range(LANES):
        offset = from_hit(balls, i, k, lanes)
        squared = dot(offset, offset)
        squared = squared if squared > _TINY else _TINY
        shown = shown_radius_squared(balls, i, offset, squared)
        alpha, under_alpha = gloss[rec.LOBE_ALPHA + k], gloss[rec.LOBE_UNDER_ALPHA + k]
        facet, half = aim_facets(offset, np.sqrt(squared), k, lanes, gloss)
        spread = shown / squared
        over, under = slopes_in_disc(facet, half, alpha, spread), slopes_in_disc(facet, half, under_alpha, spread)
        cosine, height = ball_cosine(k, lanes, gloss), lanes[ln.WO_Z + k]
        over = mirrored_share(over, facet, half, cosine, height, alpha)
        under = mirrored_share(under, facet, half, cosine, height, under_alpha)
        gloss[rec.BALL_FACING + k] = _ONE
        _keep_mirrored(over, under, squared > radius * radius, k, lanes, gloss)


@kernel
def _mirror_rectangle(balls: NDArray[np.float32], i: int, coated: bool, lanes: NDArray[np.float32], gloss: NDArray[np.float32]) -> None:
    """Do the same for row i, something flat, by its rectangle; ``coated``: whether any lane has a lobe under a coat."""
    first, second = (balls[i, 8], balls[i, 9], balls[i, 10]), (balls[i, 11], balls[i, 12], balls[i, 13])
    for k in range(LANES):
        x, y, z = _shown_place(balls, i, k, lanes, gloss)
        squared = x * x + y * y + z * z
        distance = np.sqrt(squared if squared > _TINY else _TINY)
        facing = -(x * balls[i, 4] + y * balls[i, 5] + z * balls[i, 6]) / distance
        gloss[rec.BALL_FACET + k], _ = aim_facets((x, y, z), distance, k, lanes, gloss)
        gloss[rec.BALL_FACING + k] = facing if facing > _ZERO else _ZERO
    for k in range(LANES):
        alpha, energy = gloss[rec.LOBE_ALPHA + k], lanes[ln.E_WO + k] if gloss[rec.LOBE_UNDER_ALPHA + k] == _ONE else lanes[ln.E_COAT + k]
        over = _mirrored_part(from_hit(balls, i, k, lanes), first, second, rec.OVER_FRAME, alpha, energy, k, lanes, gloss)
        _keep_mirrored(over, _ZERO, gloss[rec.BALL_FACING + k] > _ZERO, k, lanes, gloss)
    if coated:
        for k in range(LANES):
            alpha, energy = gloss[rec.LOBE_UNDER_ALPHA + k], lanes[ln.E_WO + k]
            under = _mirrored_part(from_hit(balls, i, k, lanes), first, second, rec.UNDER_FRAME, alpha, energy, k, lanes, gloss)
            _keep_mirrored(gloss[rec.BALL_OVER + k], under, gloss[rec.BALL_FACING + k] > _ZERO, k, lanes, gloss)


@inlined
def _shown_place(balls: NDArray[np.float32], i: int, k: int, lanes: NDArray[np.float32], gloss: NDArray[np.float32]) -> Vector:
    """Return the way, metres, from lane k's hit to where row i, something flat, has much of the lobe: what varies is taken there."""
    first, second = (balls[i, 8], balls[i, 9], balls[i, 10]), (balls[i, 11], balls[i, 12], balls[i, 13])
    offset = from_hit(balls, i, k, lanes)
    middle, wo = to_local(offset, k, lanes), (lanes[ln.WO_X + k], lanes[ln.WO_Y + k], lanes[ln.WO_Z + k])
    squared = dot(middle, middle)
    width_m = _SPAN * lobe_width(k, gloss) * np.sqrt(squared)
    along, aside = to_local(first, k, lanes), to_local(second, k, lanes)
    reach = mirrored_reach(middle, wo, along, aside)
    near_s, low_s, high_s = mirroring_span(middle, wo, reach, along, width_m)
    near_t, low_t, high_t = mirroring_span(middle, wo, reach, aside, width_m)
    s, t = _NEAR * near_s + _ASIDE * (low_s + high_s), _NEAR * near_t + _ASIDE * (low_t + high_t)
    return (
        offset[0] + s * first[0] + t * second[0],
        offset[1] + s * first[1] + t * second[1],
        offset[2] + s * first[2] + t * second[2],
    )


@inlined
def _mirrored_part(
    offset: Vector,
    first: Vector,
    second: Vector,
    frame: int,
    alpha: np.float32,
    energy: np.float32,
    k: int,
    lanes: NDArray[np.float32],
    gloss: NDArray[np.float32],
) -> np.float32:
    """Return what a lobe of lane k mirrors of a rectangle that faces the hit, over its luminance and the Fresnel term.

    ``offset``: from the hit to its middle; ``first``, ``second``: half its sides, anticlockwise as seen from its front; ``frame``:
    OVER_FRAME or UNDER_FRAME; ``energy``: what the lobe would reflect of all light.  The cosine lobe is like GGX's where most of it is;
    what the rectangle has of its flank alone is scaled to GGX's density in direction BALL_X to BALL_Z.
    """
    c, s, t = in_frame(offset, frame, k, gloss), in_frame(first, frame, k, gloss), in_frame(second, frame, k, gloss)
    low, high = (c[0] - s[0], c[1] - s[1], c[2] - s[2]), (c[0] + s[0], c[1] + s[1], c[2] + s[2])
    p, q = (low[0] - t[0], low[1] - t[1], low[2] - t[2]), (high[0] - t[0], high[1] - t[1], high[2] - t[2])
    u, v = (low[0] + t[0], low[1] + t[1], low[2] + t[2]), (high[0] + t[0], high[1] + t[1], high[2] + t[2])
    share = quadrilateral_share(p, u, v, q)
    to = in_frame((gloss[rec.BALL_X + k], gloss[rec.BALL_Y + k], gloss[rec.BALL_Z + k]), frame, k, gloss)
    squared = dot(to, to)
    cosines = to[2] * row_length(frame, k, gloss) * row_length(frame + 3 * LANES, k, gloss) / (squared * squared)
    density = ggx_reflected(gloss[rec.BALL_FACET + k], ball_cosine(k, lanes, gloss), lanes[ln.WO_Z + k], alpha)
    ratio = density / (cosines if cosines > _TINY else _TINY)
    core = share * _PER_FLANK if share * _PER_FLANK < _ONE else _ONE
    part: np.float32 = share * (core * energy + (_ONE - core) * (ratio if ratio < _STEEPEST else _STEEPEST))
    return part


@inlined
def _keep_mirrored(
    over: np.float32, under: np.float32, shown: bool, k: int, lanes: NDArray[np.float32], gloss: NDArray[np.float32]
) -> None:
    """Fill BALL_OVER and BALL_UNDER of lane k by what its lobes mirror, if it is ``shown`` what they do."""
    seen = (gloss[rec.ASKS + k] > _ZERO) & (ball_cosine(k, lanes, gloss) > _ZERO) & shown
    gloss[rec.BALL_OVER + k] = over if seen & (gloss[rec.LOBE_ALPHA + k] >= SHARP) else _ZERO
    gloss[rec.BALL_UNDER + k] = under if seen & (gloss[rec.LOBE_UNDER_ALPHA + k] < _ONE) else _ZERO


@kernel
def _reflect_ball(most: np.float32, lanes: NDArray[np.float32], gloss: NDArray[np.float32]) -> bool:
    """Fill BALL_R to BALL_B with what the lanes reflect of the ball, 0 where it is too little to count; return whether it counts in any.

    ``most``: the most that it shows, r + g + b, cd/m2.
    """
    found = _ZERO
    for k in range(LANES):
        over, under, schlick = gloss[rec.BALL_OVER + k], gloss[rec.BALL_UNDER + k], schlick_weight(gloss[rec.BALL_HALF + k])
        red, green, blue = outer_fresnel(schlick, k, lanes, gloss)
        base_r, base_g, base_b = base_fresnel(schlick, k, lanes)
        r, g, b = over * red + under * base_r, over * green + under * base_g, over * blue + under * base_b
        counts = (r + g + b) * most > gloss[rec.LEAST + k]
        r, g, b = r if counts else _ZERO, g if counts else _ZERO, b if counts else _ZERO
        gloss[rec.BALL_R + k], gloss[rec.BALL_G + k], gloss[rec.BALL_B + k], gloss[rec.REFLECTED + k] = r, g, b, r + g + b
        found = r + g + b if r + g + b > found else found
    return bool(found > _ZERO)


@inlined
def _show_ball(surfaces: Surfaces, part: int, gloss: NDArray[np.float32]) -> None:
    """Turn BALL_R to BALL_B into what the ball's part adds to the pixels where nothing stands between, and fill SENT.

    Panes show what is about there of the sky; what each point of them shows, and lets through, is asked with it.
    """
    row = part * st.ROW_SIZE
    pane = surfaces.materials[row + st.PORTAL] > _ZERO
    if pane or surfaces.materials[row + st.PROFILE] > _ZERO:
        for k in range(LANES):
            if gloss[rec.BALL_R + k] + gloss[rec.BALL_G + k] + gloss[rec.BALL_B + k] > _ZERO:
                x, y, z, facing = gloss[rec.BALL_X + k], gloss[rec.BALL_Y + k], gloss[rec.BALL_Z + k], gloss[rec.BALL_FACING + k]
                r, g, b = sky_about(surfaces.sky, x, y, z) if pane else surface_le(surfaces, part, x, y, z, facing)
                through = pane_transmittance(surfaces, part, facing) if pane else _ONE
                for channel, shown in enumerate((r, g, b)):
                    at = LANES * channel + k
                    gloss[rec.SENT_R + at] = gloss[rec.BALL_R + at] if pane else gloss[rec.BALL_R + at] * shown
                    gloss[rec.BALL_R + at] *= through * shown
    else:
        for channel in range(3):
            for k in range(LANES):
                gloss[rec.BALL_R + LANES * channel + k] *= surfaces.materials[row + st.EMISSION + channel]
                gloss[rec.SENT_R + LANES * channel + k] = gloss[rec.BALL_R + LANES * channel + k]


@kernel
def _pick(ball: np.float32, gloss: NDArray[np.float32]) -> None:
    """Add a ball to LAMPLIGHT, and take it for some of PICKED instead of one of those before.

    One number after the other, as in reservoirs: each is used up by the choice and made anew of what is left of it.
    """
    for k in range(LANES):
        gain = gloss[rec.BALL_R + k] + gloss[rec.BALL_G + k] + gloss[rec.BALL_B + k]
        total = gloss[rec.LAMPLIGHT + k] + gain
        chance = gain / total
        gloss[rec.LAMPLIGHT + k] = total
        for j in range(0, LAMP_RAYS * LANES, LANES):
            u = gloss[rec.PICKED_U + j + k]
            picked = (gain > _ZERO) & (u < chance)
            rest = u / chance if picked else (u - chance) / (_ONE - chance)
            rest = rest if rest < _BELOW_ONE else _BELOW_ONE
            gloss[rec.PICKED_U + j + k] = rest if gain > _ZERO else u
            gloss[rec.PICKED + j + k] = ball if picked else gloss[rec.PICKED + j + k]
            gloss[rec.PICKED_REFLECTED + j + k] = gloss[rec.REFLECTED + k] if picked else gloss[rec.PICKED_REFLECTED + j + k]
            gloss[rec.PICKED_R + j + k] = gloss[rec.SENT_R + k] / gain if picked else gloss[rec.PICKED_R + j + k]
            gloss[rec.PICKED_G + j + k] = gloss[rec.SENT_G + k] / gain if picked else gloss[rec.PICKED_G + j + k]
            gloss[rec.PICKED_B + j + k] = gloss[rec.SENT_B + k] / gain if picked else gloss[rec.PICKED_B + j + k]
