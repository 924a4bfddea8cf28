"""Lamps and panes as balls and rectangles: how much of each gloss mirrors is known, and shadow rays ask whether it is seen."""

import numpy as np
from numpy.typing import NDArray

from renderer.bsdf.microfacet import schlick_weight
from renderer.cached_frames import records as rec
from renderer.cached_frames.gloss_rays import base_fresnel, lobe_fresnel, pixel_noise
from renderer.cached_frames.lamp_shapes import Lamps
from renderer.cached_frames.lobe_shares import (
    build_frames,
    cosines_along,
    ggx_reflected,
    in_frame,
    lobe_width_m,
    mirrored_reach,
    mirrored_share,
    mirroring_span,
    nearest_place,
    place_density,
    place_near,
    row_length,
    slopes_in_disc,
    spread_aside,
    to_local,
    to_world,
)
from renderer.cached_frames.records import LAMP_RAYS, SHARP, ShadeScratch, asks_lamps
from renderer.core import lanes as ln
from renderer.core.color import Rgb
from renderer.core.kernel import inlined, kernel
from renderer.core.ray_packet import LANES
from renderer.core.sampling import Vector, coordinate_system
from renderer.irradiance_cache.outside import show_sky, sky_about
from renderer.irradiance_cache.specular import pass_glass
from renderer.path import surface_tables as st
from renderer.path.emission import pane_transmittance, surface_le
from renderer.path.records import LitScene
from renderer.path.surface_tables import Surfaces

_ZERO, _HALF, _ONE = np.float32(0.0), np.float32(0.5), np.float32(1.0)
_LEAST_COSINE, _INFINITE, _TINY = np.float32(0.05), np.float32(np.inf), np.float32(1e-20)
_INVERSE_PI, _BEFORE_FLAT = np.float32(1.0 / np.pi), np.float32(0.98)
_BELOW_ONE, _GOLDEN, _DISC = np.float32(1.0 - 2.0**-24), np.float32(0.618034), np.float32(0.5 * np.sqrt(np.pi))
_LEAST, _LEFT_OUT, _FAINT = np.float32(0.002), np.float32(0.01), np.float32(0.3)
"""Shares of a pixel's other light from which on a lamp in its gloss counts, and from which on all are worth one shadow ray, or more."""
_SPAN = np.float32(5.0)
"""How far to the sides of the mirrored direction what is flat is looked for, in widths of GGX."""
_MOST_WEIGHT = np.float32(8.0)
"""The most that a point counts, over the mean of all."""
_PER_FLANK, _STEEPEST = np.float32(20.0), np.float32(4.0)
"""One over the share of a lobe below which a rectangle is on its flank, and the most that this is raised to GGX's density."""
_NEAR, _ASIDE = np.float32(0.7), np.float32(0.15)
"""Where what is flat is taken to be bright and reflected: how much by the place nearest to the mirrored ray, and by each end."""
_KEY, _FIRST_ASKED = np.uint32(11), np.uint32(13)


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
        noise, _ = pixel_noise(memory.pixels[0, k], memory.pixels[1, k], _KEY)
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
        offset = _from_hit(balls, i, k, lanes)
        squared = offset[0] * offset[0] + offset[1] * offset[1] + offset[2] * offset[2]
        squared = squared if squared > _TINY else _TINY
        shown = _shown_radius_squared(balls, i, offset, squared)
        alpha, under_alpha = gloss[rec.LOBE_ALPHA + k], gloss[rec.LOBE_UNDER_ALPHA + k]
        facet, half = _aim_facets(offset, np.sqrt(squared), k, lanes, gloss)
        spread = shown / squared
        over, under = slopes_in_disc(facet, half, alpha, spread), slopes_in_disc(facet, half, under_alpha, spread)
        cosine, height = _cosine(k, lanes, gloss), lanes[ln.WO_Z + k]
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
        gloss[rec.BALL_FACET + k], _ = _aim_facets((x, y, z), distance, k, lanes, gloss)
        gloss[rec.BALL_FACING + k] = facing if facing > _ZERO else _ZERO
    for k in range(LANES):
        alpha, energy = gloss[rec.LOBE_ALPHA + k], lanes[ln.E_WO + k] if gloss[rec.LOBE_UNDER_ALPHA + k] == _ONE else lanes[ln.E_COAT + k]
        over = _mirrored_part(_from_hit(balls, i, k, lanes), first, second, rec.OVER_FRAME, alpha, energy, k, lanes, gloss)
        _keep_mirrored(over, _ZERO, gloss[rec.BALL_FACING + k] > _ZERO, k, lanes, gloss)
    if coated:
        for k in range(LANES):
            alpha, energy = gloss[rec.LOBE_UNDER_ALPHA + k], lanes[ln.E_WO + k]
            under = _mirrored_part(_from_hit(balls, i, k, lanes), first, second, rec.UNDER_FRAME, alpha, energy, k, lanes, gloss)
            _keep_mirrored(gloss[rec.BALL_OVER + k], under, gloss[rec.BALL_FACING + k] > _ZERO, k, lanes, gloss)


@inlined
def _shown_place(balls: NDArray[np.float32], i: int, k: int, lanes: NDArray[np.float32], gloss: NDArray[np.float32]) -> Vector:
    """Return the way, metres, from lane k's hit to where row i, something flat, has much of the lobe: what varies is taken there."""
    first, second = (balls[i, 8], balls[i, 9], balls[i, 10]), (balls[i, 11], balls[i, 12], balls[i, 13])
    offset = _from_hit(balls, i, k, lanes)
    middle, wo = to_local(offset, k, lanes), (lanes[ln.WO_X + k], lanes[ln.WO_Y + k], lanes[ln.WO_Z + k])
    squared = middle[0] * middle[0] + middle[1] * middle[1] + middle[2] * middle[2]
    width_m = _SPAN * _lobe_width(k, gloss) * np.sqrt(squared)
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
    share = -(cosines_along(p, q) + cosines_along(q, v) + cosines_along(v, u) + cosines_along(u, p))
    share = share if share > _ZERO else _ZERO
    to = in_frame((gloss[rec.BALL_X + k], gloss[rec.BALL_Y + k], gloss[rec.BALL_Z + k]), frame, k, gloss)
    squared = to[0] * to[0] + to[1] * to[1] + to[2] * to[2]
    cosines = to[2] * row_length(frame, k, gloss) * row_length(frame + 3 * LANES, k, gloss) / (squared * squared)
    density = ggx_reflected(gloss[rec.BALL_FACET + k], _cosine(k, lanes, gloss), lanes[ln.WO_Z + k], alpha)
    ratio = density / (cosines if cosines > _TINY else _TINY)
    core = share * _PER_FLANK if share * _PER_FLANK < _ONE else _ONE
    part: np.float32 = share * (core * energy + (_ONE - core) * (ratio if ratio < _STEEPEST else _STEEPEST))
    return part


@inlined
def _lobe_width(k: int, gloss: NDArray[np.float32]) -> np.float32:
    """Return the width of GGX of lane k; that of the lobe under a coat, if there is one."""
    under_alpha, alpha = gloss[rec.LOBE_UNDER_ALPHA + k], gloss[rec.LOBE_ALPHA + k]
    return under_alpha if under_alpha < _ONE else max(alpha, SHARP)


@inlined
def _coat_width(k: int, gloss: NDArray[np.float32]) -> np.float32:
    """Return the width of GGX of lane k's outer lobe, or that of the one under it where that one alone shows lamps."""
    alpha = gloss[rec.LOBE_ALPHA + k]
    return alpha if alpha >= SHARP else _lobe_width(k, gloss)


@inlined
def _from_hit(balls: NDArray[np.float32], i: int, k: int, lanes: NDArray[np.float32]) -> Vector:
    return balls[i, 0] - lanes[ln.P_X + k], balls[i, 1] - lanes[ln.P_Y + k], balls[i, 2] - lanes[ln.P_Z + k]


@inlined
def _shown_radius_squared(balls: NDArray[np.float32], i: int, offset: Vector, squared: np.float32) -> np.float32:
    """Return the squared radius, m2, of the disc that row i, nothing flat, shows along an offset of that squared length."""
    x, y, z = offset
    form = balls[i, 8] * x * x + balls[i, 9] * y * y + balls[i, 10] * z * z
    form += np.float32(2.0) * (balls[i, 11] * x * y + balls[i, 12] * x * z + balls[i, 13] * y * z)
    shown: np.float32 = np.sqrt(max(form / squared, _ZERO))
    return shown


@inlined
def _aim_facets(
    offset: Vector, distance: np.float32, k: int, lanes: NDArray[np.float32], gloss: NDArray[np.float32]
) -> tuple[np.float32, np.float32]:
    """Fill BALL_X to BALL_Z and BALL_HALF of lane k; return the cosines of the microfacets that mirror what lies there, and of the view."""
    lx, ly, lz = offset[0] / distance, offset[1] / distance, offset[2] / distance
    wo_x, wo_y, wo_z = to_world((lanes[ln.WO_X + k], lanes[ln.WO_Y + k], lanes[ln.WO_Z + k]), k, lanes)
    hx, hy, hz = lx + wo_x, ly + wo_y, lz + wo_z
    length = hx * hx + hy * hy + hz * hz
    scale = _ONE / np.sqrt(length if length > _TINY else _TINY)
    facet = (hx * lanes[ln.NS_X + k] + hy * lanes[ln.NS_Y + k] + hz * lanes[ln.NS_Z + k]) * scale
    half = (hx * lx + hy * ly + hz * lz) * scale
    facet, half = facet if facet > _LEAST_COSINE else _LEAST_COSINE, half if half > _LEAST_COSINE else _LEAST_COSINE
    gloss[rec.BALL_X + k], gloss[rec.BALL_Y + k], gloss[rec.BALL_Z + k], gloss[rec.BALL_HALF + k] = lx, ly, lz, half
    return facet, half


@inlined
def _cosine(k: int, lanes: NDArray[np.float32], gloss: NDArray[np.float32]) -> np.float32:
    """Return the cosine of the direction to a ball, of lane k."""
    x, y, z = gloss[rec.BALL_X + k], gloss[rec.BALL_Y + k], gloss[rec.BALL_Z + k]
    cosine: np.float32 = x * lanes[ln.NS_X + k] + y * lanes[ln.NS_Y + k] + z * lanes[ln.NS_Z + k]
    return cosine


@inlined
def _keep_mirrored(
    over: np.float32, under: np.float32, shown: bool, k: int, lanes: NDArray[np.float32], gloss: NDArray[np.float32]
) -> None:
    """Fill BALL_OVER and BALL_UNDER of lane k by what its lobes mirror, if it is ``shown`` what they do."""
    seen = (gloss[rec.ASKS + k] > _ZERO) & (_cosine(k, lanes, gloss) > _ZERO) & shown
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
        red, green, blue = _lobe_fresnel(schlick, k, lanes, gloss)
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

    Panes show what is about there of the sky; what each point of them shows is asked with it.
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
                    reflected = through * gloss[rec.BALL_R + at]
                    gloss[rec.BALL_R + at] = reflected * shown
                    gloss[rec.SENT_R + at] = reflected if pane else reflected * shown
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


@inlined
def add_lamps(scene: LitScene, lamps: Lamps, rays: int, alone: bool, memory: ShadeScratch) -> None:
    """Add what the balls that were chosen send to the pixels, each where nothing stands before a point of it; ``rays``: the most of any.

    ``alone``: of all LAMPLIGHT each pixel sees the share that its own points do, as no neighbours' take part in the mean.
    """
    lanes, gloss, primary = memory.trace.lanes, memory.gloss, memory.primary
    for i in range(rays):
        for k in range(LANES):
            lanes[ln.LIGHT_PDF + k] = _ONE if i < int(gloss[rec.LAMP_RAY_COUNT + k]) else _ZERO
            if lanes[ln.LIGHT_PDF + k] > _ZERO:
                _ask_ball(scene.surfaces, lamps, i, k, memory)
        pass_glass(scene, memory.trace)
        for k in range(LANES):
            if lanes[ln.LIGHT_PDF + k] > _ZERO:
                for channel in range(3):
                    primary[rec.LAMPS + channel, k] += lanes[ln.LI_R + LANES * channel + k]
    if alone:
        for k in range(LANES):
            scale = gloss[rec.LAMPLIGHT + k] / gloss[rec.ASKED + k] if gloss[rec.ASKED + k] > _ZERO else _ZERO
            for channel in range(3):
                primary[rec.LAMPS + channel, k] *= scale


@inlined
def _ask_ball(surfaces: Surfaces, lamps: Lamps, i: int, k: int, memory: ShadeScratch) -> None:
    """Aim shadow ray ``i`` of lane k at a point of a ball that was chosen, and fill LI with what comes from there if nothing hides it.

    A point counts by what the lobes reflect of its light, over the density of such points (importance sampling).
    """
    lanes, gloss = memory.trace.lanes, memory.gloss
    _, noise = pixel_noise(memory.pixels[0, k], memory.pixels[1, k], _KEY)
    first, _ = pixel_noise(memory.pixels[0, k], memory.pixels[1, k], _FIRST_ASKED)
    # Those that are asked are evenly apart among the numbers that have chosen.
    count = int(gloss[rec.LAMP_RAY_COUNT + k])
    j = (int(first * np.float32(LAMP_RAYS)) + i * LAMP_RAYS // count) % LAMP_RAYS
    at = LANES * j + k
    ball, v = int(gloss[rec.PICKED + at]), noise + np.float32(j) * _GOLDEN
    solid = _aim_at_ball(lamps, ball, j, k, gloss[rec.PICKED_U + at], v - np.floor(v), memory)
    weight = solid * _reflected_along(k, lanes, gloss) / gloss[rec.PICKED_REFLECTED + at]
    share = min(weight, _MOST_WEIGHT) * gloss[rec.LAMPLIGHT + k] / np.float32(count)
    gloss[rec.ASKED + k] += share
    lanes[ln.LI_R + k], lanes[ln.LI_G + k] = share * gloss[rec.PICKED_R + at], share * gloss[rec.PICKED_G + at]
    lanes[ln.LI_B + k], lanes[ln.LIGHT_PDF + k] = share * gloss[rec.PICKED_B + at], share
    # What hides the sky may stand outside.
    is_pane = surfaces.materials[lamps.part[ball] * st.ROW_SIZE + st.PORTAL] > _ZERO
    lanes[ln.LIGHT_END + k] = _INFINITE if is_pane else _ONE
    if is_pane:
        show_sky(surfaces.sky, k, lanes)


@inlined
def _aim_at_ball(lamps: Lamps, i: int, number: int, k: int, u: np.float32, v: np.float32, memory: ShadeScratch) -> np.float32:
    """Fill TO_LIGHT of lane k: to a point of ball i, chosen by (u, v) near the mirrored ray, as far as the lobe is wide.

    Points of odd ``number`` are chosen by the lobe of the coat, if there is one (multiple importance sampling, the balance heuristic).

    Of what is flat it is a point of its rectangle, so that it never lies in a wall or bar; of others one of a square across the ball.
    Return the solid angle that stands for the point: one over the density of such directions.
    """
    balls, lanes, gloss = lamps.balls, memory.trace.lanes, memory.gloss
    cx, cy, cz = _from_hit(balls, i, k, lanes)
    distance = np.sqrt(max(cx * cx + cy * cy + cz * cz, _TINY))
    reach = _BEFORE_FLAT
    first, second = (balls[i, 8], balls[i, 9], balls[i, 10]), (balls[i, 11], balls[i, 12], balls[i, 13])
    if balls[i, 7] == _ZERO:
        side = _DISC * np.sqrt(_shown_radius_squared(balls, i, (cx, cy, cz), distance * distance))
        reach = max((distance - balls[i, 3]) / distance, _HALF)
        ux, uy, uz, vx, vy, vz = coordinate_system(cx / distance, cy / distance, cz / distance)
        first, second = (side * ux, side * uy, side * uz), (side * vx, side * vy, side * vz)
    middle, wo = to_local((cx, cy, cz), k, lanes), (lanes[ln.WO_X + k], lanes[ln.WO_Y + k], lanes[ln.WO_Z + k])
    along, aside = to_local(first, k, lanes), to_local(second, k, lanes)
    way = mirrored_reach(middle, wo, along, aside)
    near_s, near_t = nearest_place(middle, wo, way, along), nearest_place(middle, wo, way, aside)
    nearest = (
        middle[0] + near_s * along[0] + near_t * aside[0],
        middle[1] + near_s * along[1] + near_t * aside[1],
        middle[2] + near_s * along[2] + near_t * aside[2],
    )
    widths = _lobe_width(k, gloss), _coat_width(k, gloss)
    chosen_s_m, chosen_t_m = lobe_width_m(nearest, along, widths[number & 1]), lobe_width_m(nearest, aside, widths[number & 1])
    s = place_near(near_s, along, chosen_s_m, u)
    t = place_near(near_t, aside, chosen_t_m * spread_aside(s - near_s, along, chosen_s_m), v)
    density = _ZERO
    for width in widths:
        width_s_m, width_t_m = lobe_width_m(nearest, along, width), lobe_width_m(nearest, aside, width)
        # Far out along one side slopes are as far apart along the other, so that none has a density that is much too small.
        width_t_m *= spread_aside(s - near_s, along, width_s_m)
        density += _HALF * place_density(near_s, along, width_s_m, s) * place_density(near_t, aside, width_t_m, t)
    x, y, z = cx + s * first[0] + t * second[0], cy + s * first[1] + t * second[1], cz + s * first[2] + t * second[2]
    lanes[ln.TO_LIGHT_X + k], lanes[ln.TO_LIGHT_Y + k], lanes[ln.TO_LIGHT_Z + k] = reach * x, reach * y, reach * z
    nx, ny, nz = (
        first[1] * second[2] - first[2] * second[1],
        first[2] * second[0] - first[0] * second[2],
        first[0] * second[1] - first[1] * second[0],
    )
    squared = max(x * x + y * y + z * z, _TINY)
    solid: np.float32 = abs(x * nx + y * ny + z * nz) / (density * squared * np.sqrt(squared))
    return solid


@inlined
def _reflected_along(k: int, lanes: NDArray[np.float32], gloss: NDArray[np.float32]) -> np.float32:
    """Return what the lobes of lane k reflect of light that comes along TO_LIGHT, r + g + b, a steradian."""
    x, y, z = lanes[ln.TO_LIGHT_X + k], lanes[ln.TO_LIGHT_Y + k], lanes[ln.TO_LIGHT_Z + k]
    facet, _ = _aim_facets((x, y, z), np.sqrt(max(x * x + y * y + z * z, _TINY)), k, lanes, gloss)
    cosine, height, schlick = _cosine(k, lanes, gloss), lanes[ln.WO_Z + k], schlick_weight(gloss[rec.BALL_HALF + k])
    alpha, under_alpha = gloss[rec.LOBE_ALPHA + k], gloss[rec.LOBE_UNDER_ALPHA + k]
    over = ggx_reflected(facet, cosine, height, alpha) if alpha >= SHARP else _ZERO
    under = ggx_reflected(facet, cosine, height, under_alpha) if under_alpha < _ONE else _ZERO
    red, green, blue = _lobe_fresnel(schlick, k, lanes, gloss)
    base_r, base_g, base_b = base_fresnel(schlick, k, lanes)
    return _INVERSE_PI * (over * (red + green + blue) + under * (base_r + base_g + base_b))


@inlined
def _lobe_fresnel(schlick: np.float32, k: int, lanes: NDArray[np.float32], gloss: NDArray[np.float32]) -> Rgb:
    """Return what microfacets of lane k's outer lobe reflect at a weight after Schlick."""
    mean = gloss[rec.LOBE_R + k], gloss[rec.LOBE_G + k], gloss[rec.LOBE_B + k]
    return lobe_fresnel(schlick, mean, gloss[rec.LOBE_UNDER_ALPHA + k] != _ONE, k, lanes)
