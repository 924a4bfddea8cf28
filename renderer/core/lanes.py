"""The lanes of a packet: what is known of 16 paths while they are shaded, field by field.

Stages of the path tracer hand their results on in these fields; each group below says which stage writes it and which ones read it.  The
stages are the functions that the loop in :mod:`renderer.path.integrator` calls.  Use: ``from renderer.core import lanes as ln``, then
``lanes[ln.NG_X + k]`` in lane k.  Directions of the local frame have the shading normal along z.
"""

import numpy as np
from numpy.typing import NDArray

from renderer.core.kernel import kernel
from renderer.core.layout import Layout
from renderer.core.ray_packet import LANES

_LANES = Layout(LANES)
_field, _vector = _LANES.field, _LANES.vector

# The path so far.  Written by spawn_rays of the hit before, through the queue; read by all stages up to spawn_rays.
BETA_R, BETA_G, BETA_B = _vector()  # throughput: product of all f_cos / pdf so far
RAY_PDF = _field()  # density per steradian with which the ray was sampled; infinite where lights could not have been sampled instead
PREV_IMPORTANCE = _field()  # IMPORTANCE at the ray's origin
PREV_NS_X, PREV_NS_Y, PREV_NS_Z = _vector()  # shading normal at the ray's origin
SPREAD = _field()  # growth of the ray cone's width per metre; spawn_rays adds what the scattering spreads
FIRST_EXPECTED = _field()  # EXPECTED at the path's first hit that the guide knows, 0 before
OUTSIDE = _field()  # 1 where the path has left by a pane, so that what it hits is lit by all of the sky
CARRIED = _LANES.size // LANES
"""How many fields, the first ones, pass from queue to lanes as they are."""
WIDTH = _field()  # of the ray cone, metres: at the origin, from evaluate_surfaces on at the hit

# The hit.  Written by evaluate_surfaces; read by all later stages.
P_X, P_Y, P_Z = _vector()  # the point, lifted off its surface towards the viewer, metres; spawn_rays makes it the next ray's origin
NG_X, NG_Y, NG_Z = _vector()  # unit geometric normal on the viewer's side
NS_X, NS_Y, NS_Z = _vector()  # unit shading normal, on the viewer's side too
COS_FRONT = _field()  # cosine between wo and the front of the triangle; negative on its back
HIT = _field()  # 1 where the ray hit a surface, else 0

# The material there, as in ``Material``.  Written by evaluate_surfaces, changed by regularize; read by update_aovs and build_bsdfs.
BASE_R, BASE_G, BASE_B = _vector()
ROUGHNESS = _field()
METALLIC = _field()
TRANSMISSION = _field()
DIFFUSE_TRANSMISSION = _field()  # share of what the diffuse base scatters that leaves on the other side, what passes its holes included
OPENNESS = _field()  # share of it that goes straight through holes for those who look at the sheet
IOR = _field()
COAT = _field()
COAT_ROUGHNESS = _field()
SHEEN = _field()
THIN = _field()  # 1 for window panes: light goes straight through them
GLASS = _field()  # row of the albedo tables of glass, or -1
SPECIAL = _field()  # above 0 where more than the row of the part must be looked up, above 1 where it sends light of its own

BEHIND = _field()  # 1 where the hit is taken from the other side of a thin sheet; 0 from evaluate_surfaces on, chosen by choose_sides
OPEN = _field()  # 1 where nothing stands behind the pane that the ray hit from inside, so that it shows the sky

# Emission.  Written by evaluate_surfaces; read by update_aovs and add_emission.
LE_R, LE_G, LE_B = _vector()  # luminance that the surface itself sends along wo, cd/m2
LE_PDF = _field()  # density per steradian with which sampling lights at the ray's origin finds this point

# Lights at the hit.  Written by weigh_lights; read by build_bsdfs, sample_lights and spawn_rays.
IMPORTANCE = _field()  # of all groups of lights together
NEAR = _field()  # how many groups are near

# The shading frame, with NS as third axis, and wo.  Written by build_bsdfs; read by sample_lights and spawn_rays.
TANGENT_X, TANGENT_Y, TANGENT_Z = _vector()  # unit vectors of the world
BITANGENT_X, BITANGENT_Y, BITANGENT_Z = _vector()
WO_X, WO_Y, WO_Z = _vector()  # unit, towards the viewer, in the local frame; WO_Z > 0
CONTINUES = _field()  # 1 where the path may go on, so that the BSDF is sampled beside lights

# The guide's cell at the hit.  Written by look_up_guide where there is a guide; read by sample_lights and spawn_rays.
CELL = _field()  # row of the cell, -1 where there is none
EXPECTED = _field()  # luminance that the path is expected to find once it leaves the cell, -1 where there is none
SHARE = _field()  # share of rays that are sampled from its bins

# Sun patches.  Written by weigh_patches where there are any; read by sample_lights and spawn_rays.
PATCHES = _field()  # weights of all patches together
GUIDED = _field()  # share of rays that are sampled from them
TOWARD_X, TOWARD_Y, TOWARD_Z = _vector()  # WI in the world
PATCH_PDF = _field()  # density per steradian of sampling WI from the patches, times their weights

# The BSDF.  Written by build_bsdfs; read by its evaluation and sampling in sample_lights and spawn_rays.
GLOSSY = _field()  # 1 where light is reflected by more than Lambert's law, else 0
E_WO, E_WO_SCHLICK = _field(), _field()  # directional albedo of the microfacets at reflectance 1, and its part by Schlick's weight
E_MEAN, E_MEAN_SCHLICK = _field(), _field()  # the hemisphere's means of these two
E_SHEEN = _field()  # directional albedo of sheen
E_COAT, E_COAT_SCHLICK = _field(), _field()  # as E_WO, of the coat
ALPHA, COAT_ALPHA = _field(), _field()  # of the GGX distributions
DIFFUSE_R, DIFFUSE_G, DIFFUSE_B = _vector()  # diffuse base times the share that enters from wo; the factor of wi is missing
BASE_F0, BASE_F90 = _field(), _field()  # reflectance of the diffuse base's boundary at normal and grazing incidence
MULTISCATTER_R, MULTISCATTER_G, MULTISCATTER_B = _vector()  # as DIFFUSE, for multiple scattering between the microfacets of metal
SPECULAR_R, SPECULAR_G, SPECULAR_B = _vector()  # specular reflectance at normal incidence, weighted by the layers' shares
SPECULAR_F90 = _field()  # the same at grazing incidence
SHEEN_WEIGHT = _field()
GLASS_WEIGHT = _field()  # of glass or pane
ETA = _field()  # index of refraction beyond the surface over that on the viewer's side
PR_DIFFUSE, PR_SPECULAR = _field(), _field()  # probabilities of sampling the lobes
PR_GLASS, PR_COAT = _field(), _field()
PASS_WEIGHT, PR_PASS = (
    _field(),
    _field(),
)  # share of light that goes straight on through a pane, where something is behind it, and its probability

# Random numbers in [0, 1).  Written by generate_ray_samples; read by sample_lights and spawn_rays.  generate_camera_rays uses U_LIGHT.
U_LIGHT_0, U_LIGHT_1 = _field(), _field()
U_LOBE, U_ROULETTE = _field(), _field()
U_BSDF_0, U_BSDF_1 = _field(), _field()
U_INFINITE_0, U_INFINITE_1 = _field(), _field()  # filled where there is an infinite light
U_PATCH, U_GUIDE = _field(), _field()  # filled where there are sun patches or a guide

# A sampled light.  Written and read by sample_lights.
TO_LIGHT_X, TO_LIGHT_Y, TO_LIGHT_Z = _vector()  # from P to the point on the light, or towards what is infinitely far, metres, world
LIGHT_END = (
    _field()
)  # where the shadow ray ends, in lengths of TO_LIGHT: at the light, or never if it is outside; panes do not stop it then
LI_R, LI_G, LI_B = _vector()  # luminance that arrives from there, cd/m2; then what it adds to the pixel
KEPT = _field()  # share of that which stays with the pixel, the rest is clipped
LIGHT_PDF = _field()  # density per steradian of sampling that direction; 0 where no light arrives
U_REMAPPED = _field()  # what is left of the random number once it has chosen a group, then an emitter
GROUP_IMPORTANCE, GROUP_FOUND = _field(), _field()  # of the chosen group; 1 once the choice has fallen
PORTAL_T = _field()  # distance to the nearest portal in the direction of an infinite light, metres

# BSDF times cosine, and its sampling density.  Written by both sample_lights (wi to the light) and spawn_rays (wi sampled).
WI_X, WI_Y, WI_Z = _vector()  # unit, towards the light, in the local frame
E_WI, E_WI_SCHLICK = _field(), _field()  # as E_WO, for wi
F_COS_R, F_COS_G, F_COS_B = _vector()  # BSDF times the cosine at the light; in spawn_rays then the next beta
PDF = _field()  # density per steradian of sampling wi from the BSDF

# The next ray.  Written by spawn_rays, which puts it into the queue.
NEXT_X, NEXT_Y, NEXT_Z = _vector()  # unit direction, world
SPAWNED = _field()  # 1 where there is a next ray; generate_camera_rays: where a pixel has one

LANES_SIZE = _LANES.size


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
