"""Points of lamps and panes that gloss mirrors: chosen about the mirrored ray, and asked by shadow rays whether anything hides them."""

import numpy as np
from numpy.typing import NDArray

from renderer.bsdf.microfacet import schlick_weight
from renderer.cached_frames import records as rec
from renderer.cached_frames.gloss_rays import base_fresnel, pixel_noise
from renderer.cached_frames.lamp_lobes import (
    aim_facets,
    ball_cosine,
    coat_width,
    from_hit,
    lobe_width,
    outer_fresnel,
    shown_radius_squared,
)
from renderer.cached_frames.lamp_shapes import Lamps
from renderer.cached_frames.lamps import CHOICE
from renderer.cached_frames.lobe_places import choose_places, mirrored_reach, nearest_place, places_density
from renderer.cached_frames.lobe_shares import ggx_reflected, to_local
from renderer.cached_frames.records import LAMP_RAYS, SHARP, ShadeScratch
from renderer.core import lanes as ln
from renderer.core.kernel import inlined
from renderer.core.ray_packet import LANES
from renderer.core.sampling import Vector, coordinate_system, cross, dot
from renderer.irradiance_cache.outside import show_sky
from renderer.irradiance_cache.specular import pass_glass
from renderer.path import surface_tables as st
from renderer.path.emission import pane_transmittance
from renderer.path.records import LitScene
from renderer.path.surface_tables import Surfaces

_ZERO, _HALF, _ONE, _TWO = np.float32(0.0), np.float32(0.5), np.float32(1.0), np.float32(2.0)
_INFINITE, _TINY, _INVERSE_PI = np.float32(np.inf), np.float32(1e-20), np.float32(1.0 / np.pi)
_BEFORE_FLAT, _GOLDEN, _DISC = np.float32(0.98), np.float32(0.618034), np.float32(0.5 * np.sqrt(np.pi))
_MOST_WEIGHT = np.float32(8.0)
"""The most that a point counts, over the mean of all."""
_FIRST_ASKED = np.uint32(13)


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
    _, noise = pixel_noise(memory.pixels[0, k], memory.pixels[1, k], CHOICE)
    first, _ = pixel_noise(memory.pixels[0, k], memory.pixels[1, k], _FIRST_ASKED)
    # Those that are asked are evenly apart among the numbers that have chosen.
    count = int(gloss[rec.LAMP_RAY_COUNT + k])
    j = (int(first * np.float32(LAMP_RAYS)) + i * LAMP_RAYS // count) % LAMP_RAYS
    at = LANES * j + k
    ball, v = int(gloss[rec.PICKED + at]), noise + np.float32(j) * _GOLDEN
    solid = _aim_at_ball(lamps, ball, k, gloss[rec.PICKED_U + at], v - np.floor(v), memory)
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
        through = pane_transmittance(surfaces, lamps.part[ball], _facing(lamps.balls, ball, k, lanes))
        for channel in range(3):
            lanes[ln.LI_R + LANES * channel + k] *= through


@inlined
def _facing(balls: NDArray[np.float32], i: int, k: int, lanes: NDArray[np.float32]) -> np.float32:
    """Return the cosine between TO_LIGHT of lane k and row i, something flat, from its front."""
    to = lanes[ln.TO_LIGHT_X + k], lanes[ln.TO_LIGHT_Y + k], lanes[ln.TO_LIGHT_Z + k]
    facing: np.float32 = max(-dot(to, (balls[i, 4], balls[i, 5], balls[i, 6])), _ZERO) / np.sqrt(max(dot(to, to), _TINY))
    return facing


@inlined
def _aim_at_ball(lamps: Lamps, i: int, k: int, u: np.float32, v: np.float32, memory: ShadeScratch) -> np.float32:
    """Fill TO_LIGHT of lane k: to a point of ball i, chosen by (u, v) near the mirrored ray, as far as the lobe is wide.

    Where there is a coat, a half of the points is chosen by its lobe (multiple importance sampling, the balance heuristic).  Return the
    solid angle that stands for the point: one over the density of such directions.
    """
    lanes, gloss = memory.trace.lanes, memory.gloss
    (cx, cy, cz), first, second, reach = _shape(lamps.balls, i, k, lanes)
    middle, wo = to_local((cx, cy, cz), k, lanes), (lanes[ln.WO_X + k], lanes[ln.WO_Y + k], lanes[ln.WO_Z + k])
    along, aside = to_local(first, k, lanes), to_local(second, k, lanes)
    way = mirrored_reach(middle, wo, along, aside)
    near_s, near_t = nearest_place(middle, wo, way, along), nearest_place(middle, wo, way, aside)
    nearest = (
        middle[0] + near_s * along[0] + near_t * aside[0],
        middle[1] + near_s * along[1] + near_t * aside[1],
        middle[2] + near_s * along[2] + near_t * aside[2],
    )
    under, over = lobe_width(k, gloss), coat_width(k, gloss)
    coated = over != under
    by_coat = coated & (u >= _HALF)
    u = (_TWO * u - _ONE if by_coat else _TWO * u) if coated else u
    s, t = choose_places(nearest, near_s, near_t, along, aside, over if by_coat else under, u, v)
    density = places_density(nearest, near_s, near_t, along, aside, under, s, t)
    if coated:
        density = _HALF * (density + places_density(nearest, near_s, near_t, along, aside, over, s, t))
    x, y, z = cx + s * first[0] + t * second[0], cy + s * first[1] + t * second[1], cz + s * first[2] + t * second[2]
    lanes[ln.TO_LIGHT_X + k], lanes[ln.TO_LIGHT_Y + k], lanes[ln.TO_LIGHT_Z + k] = reach * x, reach * y, reach * z
    squared = max(x * x + y * y + z * z, _TINY)
    solid: np.float32 = abs(dot((x, y, z), cross(first, second))) / (density * squared * np.sqrt(squared))
    return solid


@inlined
def _shape(balls: NDArray[np.float32], i: int, k: int, lanes: NDArray[np.float32]) -> tuple[Vector, Vector, Vector, np.float32]:
    """Return the way from lane k's hit to the middle of what points of ball i lie on, half its sides, metres, and what ends before it.

    Of what is flat it is its rectangle, so that they never lie in a wall or bar; of others a square across the ball, of which shadow rays
    end before the ball.
    """
    offset = from_hit(balls, i, k, lanes)
    if balls[i, 7] > _ZERO:
        return offset, (balls[i, 8], balls[i, 9], balls[i, 10]), (balls[i, 11], balls[i, 12], balls[i, 13]), _BEFORE_FLAT
    distance = np.sqrt(max(dot(offset, offset), _TINY))
    side = _DISC * np.sqrt(shown_radius_squared(balls, i, offset, distance * distance))
    ux, uy, uz, vx, vy, vz = coordinate_system(offset[0] / distance, offset[1] / distance, offset[2] / distance)
    reach = max((distance - balls[i, 3]) / distance, _HALF)
    return offset, (side * ux, side * uy, side * uz), (side * vx, side * vy, side * vz), reach


@inlined
def _reflected_along(k: int, lanes: NDArray[np.float32], gloss: NDArray[np.float32]) -> np.float32:
    """Return what the lobes of lane k reflect of light that comes along TO_LIGHT, r + g + b, a steradian."""
    x, y, z = lanes[ln.TO_LIGHT_X + k], lanes[ln.TO_LIGHT_Y + k], lanes[ln.TO_LIGHT_Z + k]
    facet, _ = aim_facets((x, y, z), np.sqrt(max(x * x + y * y + z * z, _TINY)), k, lanes, gloss)
    cosine, height, schlick = ball_cosine(k, lanes, gloss), lanes[ln.WO_Z + k], schlick_weight(gloss[rec.BALL_HALF + k])
    alpha, under_alpha = gloss[rec.LOBE_ALPHA + k], gloss[rec.LOBE_UNDER_ALPHA + k]
    over = ggx_reflected(facet, cosine, height, alpha) if alpha >= SHARP else _ZERO
    under = ggx_reflected(facet, cosine, height, under_alpha) if under_alpha < _ONE else _ZERO
    red, green, blue = outer_fresnel(schlick, k, lanes, gloss)
    base_r, base_g, base_b = base_fresnel(schlick, k, lanes)
    return _INVERSE_PI * (over * (red + green + blue) + under * (base_r + base_g + base_b))
