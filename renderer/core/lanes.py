"""The lanes of a wave's packet: what is known of 16 paths while they are shaded, field by field."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from renderer.core.embree import LANES
from renderer.core.kernel import kernel

(
    POINT_X,  # the hit, lifted off its surface towards the viewer, metres: where reflected rays start
    POINT_Y,
    POINT_Z,
    SIDE_X,  # unit geometric normal towards the viewer
    SIDE_Y,
    SIDE_Z,
    SHADE_X,  # unit shading normal, on the viewer's side too
    SHADE_Y,
    SHADE_Z,
    COSINE,  # between the way back and the triangle's front; negative on its back
    REFLECTS,  # 1 where the path may go on, else 0
    BASE_R,  # the look of the surface, as in ``Material``
    BASE_G,
    BASE_B,
    ROUGHNESS,
    METALLIC,
    TRANSMISSION,
    IOR,
    COAT,
    COAT_ROUGHNESS,
    SHEEN,
    THIN,  # 1 for window panes: what enters leaves the scene
    GLASS,  # row of the glass table, or -1
    MORE,  # 1 where the look is not all in the table of parts
    GLOW_R,  # luminance that the surface sends to the viewer by itself, cd/m2
    GLOW_G,
    GLOW_B,
    GLOW_CHANCE,  # probability per steradian that drawing lights at the ray's origin finds this point
    WIDTH,  # of the ray's footprint at the hit, metres
    TOTAL,  # importance of all lights together at the hit
    NEAR,  # how many groups of lights the hit is near to
    FRAME_UX,  # with SHADE as the third axis, the local frame: unit vectors in the world
    FRAME_UY,
    FRAME_UZ,
    FRAME_VX,
    FRAME_VY,
    FRAME_VZ,
    WO_X,  # towards the viewer, in the local frame; WO_Z > 0
    WO_Y,
    WO_Z,
    GLOSSY,  # 1 where light is reflected by more than Lambert's law, else 0
    WHOLE,  # albedo of the base's microfacets at reflectance 1 towards the viewer, and its part by Schlick's fifth power
    FIFTH,
    MEAN,  # the hemisphere's means of these two
    MEAN_FIFTH,
    SHEEN_ALBEDO,
    COAT_WHOLE,
    COAT_FIFTH,
    ALPHA,  # of the microfacets
    COAT_ALPHA,
    MATT_R,  # diffuse base times the share that enters, without the factor of the other direction
    MATT_G,
    MATT_B,
    MATT_F0,  # specular reflectance of the base's boundary at normal and grazing incidence
    MATT_F90,
    SHIFT_R,  # the same as MATT for multiple scattering in metal
    SHIFT_G,
    SHIFT_B,
    GLOSS_R,  # specular reflectance at normal and grazing incidence, weighted by share
    GLOSS_G,
    GLOSS_B,
    GRAZING,
    SHINE,  # weight of sheen
    CLEAR,  # weight of glass or pane
    ETA,  # index of refraction beyond the surface over that on the viewer's side
    BY_MATT,  # probabilities of drawing from the lobes
    BY_GLOSS,
    BY_GLASS,
    BY_COAT,
    WAY_X,  # towards the light, in the local frame
    WAY_Y,
    WAY_Z,
    THERE_WHOLE,  # as WHOLE and FIFTH, towards the light
    THERE_FIFTH,
    OUT_R,  # scattering function times the cosine at the light, and the density of drawing WAY per steradian
    OUT_G,
    OUT_B,
    DENSITY,
    FOLLOWS,  # 1 where the path goes on to the next hit
    LIGHT_X,  # to the point on a light that was drawn, metres, world; its luminance, cd/m2; chance per steradian of drawing it
    LIGHT_Y,
    LIGHT_Z,
    LIGHT_R,
    LIGHT_G,
    LIGHT_B,
    LIGHT_CHANCE,
    DRAWN_LEFT,  # while a group of lights is drawn: what is left of the random number, the group's importance, 1 once it is found
    DRAWN_SHARE,
    DRAWN_FOUND,
    NEXT_X,  # unit direction of the next ray in the world; 1 where there is one
    NEXT_Y,
    NEXT_Z,
    GOES_ON,
    DRAW_LIGHT_U,  # random numbers of this hit
    DRAW_LIGHT_V,
    DRAW_LOBE,
    DRAW_END,
    DRAW_WAY_U,
    DRAW_WAY_V,
    DRAW_SUN_U,  # filled where something is drawn by direction
    DRAW_SUN_V,
    WEIGHT_R,  # throughput of the path up to the hit
    WEIGHT_G,
    WEIGHT_B,
    CHANCE,  # probability per steradian with which the ray was sampled; infinite where lights could not have been drawn instead
    IMPORTANCE,  # of all lights together at the ray's origin
    FROM_X,  # shading normal at the ray's origin
    FROM_Y,
    FROM_Z,
    SPREAD,  # growth of the footprint's width per metre
) = range(0, 110 * LANES, LANES)


LANES_SIZE = 110 * LANES


@kernel
def lane_count(lanes: NDArray[np.float32]) -> int:
    """Return LANES in a way that LLVM cannot foresee: short loops of a known length it unrolls, before it would vectorise them."""
    return len(lanes) * LANES // LANES_SIZE


@kernel
def count_chosen(lanes: NDArray[np.float32], field: int) -> int:
    """Return how many lanes have a positive ``field``."""
    count = 0
    for k in range(LANES):
        count += 1 if lanes[field + k] > np.float32(0.0) else 0
    return count
