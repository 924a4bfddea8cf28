"""Final gathering: what scattered rays see of matt surfaces is looked up where the light on these is known, and paths end there.

Where a ray has spread so widely, by the time it hits, that the distance between nodes does not matter, the light that the lobes without
direction send back is that which the nodes around know, in place of all the paths on from there (final gathering: Jensen, "Realistic Image
Synthesis Using Photon Mapping", 2001, chapter 9).  So camera rays and mirrored ones are traced as ever, and short ones, as in corners and
under things; and what no node knows is traced, too, and sheets that light shines through.

Light by the other lobes, of gloss, coats and glass, is sampled and traced as ever: as many paths go on as would have been sent to these.
"""

import numpy as np
from numpy.typing import NDArray

from renderer.bsdf.reflectance import diffuse_albedo
from renderer.core import lanes as ln
from renderer.core import ray_packet as ray
from renderer.core.kernel import inlined
from renderer.core.ray_packet import LANES
from renderer.path.emission import add_stroke
from renderer.path.light_nodes import KnownLight, find_nodes
from renderer.path.records import Scratch

_ZERO, _ONE = np.float32(0.0), np.float32(1.0)
_LEAST_WORTH = np.float32(0.5)
"""Of the nodes around a hit, by weight: elsewhere they lie within things, or nearly all is close by."""


@inlined
def gather_known_light(known: KnownLight, kinds: int, limit: np.float32, scratch: Scratch) -> int:
    """Add what nodes know of the light at a packet's hits to that of their pixels; return how many of its paths have other lobes there.

    Those that have none get a HIT of 0, the others lose their diffuse lobes.  ``kinds``: of the packet (:mod:`renderer.bsdf.layers`), whose
    U_LOBE becomes negative where it chooses one that is lost; ``limit``: the most that a channel may bring to its own pixel.
    """
    lanes, real, going = scratch.lanes, scratch.rays.real, 0
    for k in range(LANES):
        if lanes[ln.HIT + k] == _ZERO:
            continue
        spread = min(lanes[ln.SPREAD + k], _ONE) * real[ray.TFAR + k]
        matt = (lanes[ln.PR_DIFFUSE + k] > _ZERO) & (lanes[ln.DIFFUSE_TRANSMISSION + k] == _ZERO)
        if spread >= known.reach_m and matt and lanes[ln.OUTSIDE + k] == _ZERO:
            red, green, blue, worth = _light_around(known, k, scratch)
            if worth >= _LEAST_WORTH:
                r, g, b = diffuse_albedo(lanes, kinds, k)
                r, g, b = r * red * lanes[ln.BETA_R + k], g * green * lanes[ln.BETA_G + k], b * blue * lanes[ln.BETA_B + k]
                add_stroke((r, g, b), limit, False, scratch.lane_slot[k], scratch.light)
                if kinds == 0 or lanes[ln.GLOSSY + k] == _ZERO:
                    lanes[ln.HIT + k] = _ZERO
                    continue
                _leave_other_lobes(lanes, k)
        going += 1
    return going


@inlined
def _light_around(known: KnownLight, k: int, scratch: Scratch) -> tuple[np.float32, np.float32, np.float32, np.float32]:
    """Return illuminance over pi (r, g, b) at the hit of lane k, cd/m2, by the nodes around it, and what these are worth."""
    rays, nodes, weights, light = scratch.rays, scratch.nodes, scratch.weights, known.light
    face, u, v = rays.integer[ray.PRIM_ID + k], rays.real[ray.BARY_U + k], rays.real[ray.BARY_V + k]
    count = find_nodes(known.atlas, face, u, v, scratch.lanes[ln.COS_FRONT + k] > _ZERO, nodes, weights)
    r = g = b = worth = _ZERO
    for i in range(count):
        node = nodes[i]
        weight = weights[i] * light[node, 3]
        worth += weight
        r, g, b = r + weight * light[node, 0], g + weight * light[node, 1], b + weight * light[node, 2]
    scale = _ONE / worth if worth > _ZERO else _ZERO
    return scale * r, scale * g, scale * b, worth


@inlined
def _leave_other_lobes(lanes: NDArray[np.float32], k: int) -> None:
    """Take the lobes without direction from the BSDF of lane k, and from the random number that chooses one."""
    lanes[ln.U_LOBE + k] -= lanes[ln.PR_DIFFUSE + k]
    lanes[ln.PR_DIFFUSE + k] = lanes[ln.SHEEN_WEIGHT + k] = _ZERO
    for channel in range(0, 3 * LANES, LANES):
        lanes[ln.DIFFUSE_R + channel + k] = lanes[ln.MULTISCATTER_R + channel + k] = _ZERO


@inlined
def end_gathered_paths(lanes: NDArray[np.float32]) -> None:
    """Give a HIT of 0 to the paths whose random number has chosen the lobes that were taken."""
    for k in range(LANES):
        if lanes[ln.U_LOBE + k] < _ZERO:
            lanes[ln.HIT + k] = _ZERO
