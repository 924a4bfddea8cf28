"""The path tracer: it works through an image in waves of 256 paths, which stay in the cache.

A *wave* is one sample of 16 x 16 pixels: up to 256 paths that advance together, one segment at a time.  Between segments their state is
in a *queue* without gaps (:mod:`renderer.path.queues`).  16 neighbours of it at a time are a *packet*: their rays are traced together, and
what is known of them lies in the *lanes* (:mod:`renderer.core.lanes`).  Paths that go on are appended to the next queue.

    generate_camera_rays -> queue -> intersect_closest -> evaluate_surfaces -> add_emission -> sample_lights -> shadow rays -> light
                              ^                                                                     |
                              +----------------------------- spawn_rays <---------------------------+

Words are those of Pharr, Jakob and Humphreys, "Physically Based Rendering" (4th edition, 2023), where they have one:

    p               the point that a ray hits                   beta        throughput: product of f_cos / pdf along the path
    ng, ns          geometric and shading normal there          u           uniform random number in [0, 1)
    wo, wi          unit directions to the viewer and light     pdf         probability density, of directions per steradian
    wm              microfacet normal: half-way of wo and wi    light_pdf   the same for sampling a light
    f_cos           BSDF times |cosine| between wi and ns       mis weight  share of a sample, by the balance heuristic
    le              luminance that a surface emits, cd/m2       roulette    Russian roulette: random end of dim paths
    li              luminance that arrives, cd/m2               aov         arbitrary output variable: what is not colour
    alpha           width of GGX: roughness squared             portal      window pane, through which the outside shines
    eta             relative index of refraction                infinite    of a light infinitely far away: sun, bright environment
    diffuse, specular, multiscatter, coat, sheen, glass         lobes of the BSDF (:mod:`renderer.bsdf.layers`)
    importance      bound of the light that a group of emitters can bring to a point (:mod:`renderer.path.lights`)
    ray cone        width and spread of a ray, by which textures are filtered (Akenine-Moeller et al., JCGT 10(1), 2021)

At every hit one point on a light and one direction from the BSDF are sampled; light that either finds is weighed by the balance heuristic.
At the last hit a ray is spawned only near lights and on glossy surfaces; elsewhere the sampled light counts in full, as sampling lights
alone is good enough there.  So ``max_depth`` segments give the Neumann series cut there, in the mean exactly.

Specular surfaces that are lit by way of diffuse ones make caustics, which paths from the camera find by rare strokes of luck.  *Caustic
blur* roughens, for that light only, what a ray hits by how far the surfaces before have scattered it, so that sampled lights find such
paths too; energy is kept, caustics lose their edges (path space regularization, Kaplanyan and Dachsbacher 2013).  At 0 transport is exact.

Where the sun comes in, hits look for its patches too (:mod:`renderer.path.sun_patches`), by one pdf with the BSDF's.
With a *guide* matt hits also look where it expects light by way of other surfaces, by one pdf with both, and paths end by what they are
still expected to find (:mod:`renderer.path.guide`).
Where light is known on surfaces, matt lobes that scattered rays hit send on what is known there (:mod:`renderer.path.final_gathering`).

Cloth and leaves scatter light to both sides; a hit on them is taken from one (:mod:`renderer.path.sheets`).

*Clamp* limits what a single stroke of indirect light brings to its own pixel; what is beyond is shared (:mod:`renderer.path.film_sums`).

*Direct* light has been scattered once at most on its way from the emitter to the camera: what lights send themselves, and what a surface, a
mirror or a pane of glass like any other, makes of light that comes straight from one.  All other light is indirect.

What a wave computes depends on its tile and sample only, and each random number on its key: bytes depend on neither threads nor order.
"""

import numpy as np

from renderer.camera.cameras import PosedCamera
from renderer.core.kernel import entry
from renderer.core.ray_packet import LANES
from renderer.path.direct_light import flush_shadow_rays, sample_lights, weigh_lights
from renderer.path.emission import add_emission
from renderer.path.film_sums import update_aovs, update_film
from renderer.path.final_gathering import end_gathered_paths, gather_known_light
from renderer.path.generation import generate_camera_rays, generate_ray_samples, intersect_closest, seed_pixels
from renderer.path.guide import look_up_guide
from renderer.path.queues import WAVE_EDGE
from renderer.path.records import Film, LitScene, Scratch, Transport, Work
from renderer.path.scattering import build_bsdfs, regularize, spawn_rays
from renderer.path.sheets import choose_sides
from renderer.path.sun_patches import weigh_patches
from renderer.path.surfaces import evaluate_surfaces

_INFINITE = np.float32(np.inf)
_ROULETTE_FROM = 2
"""The depth, counted from 0 at the camera ray's hit, from which on dim paths end at random."""
_DEEP = 10
"""The depth from which on guided paths do so too where no cell tells what they may find."""


@entry
def trace_paths(scene: LitScene, camera: PosedCamera, transport: Transport, work: Work, scratch: Scratch, film: Film) -> None:
    """Add a piece's samples to ``film``."""
    surfaces, lights, guided, gathers = scene.surfaces, scene.lights, len(scene.guide.light) > 0, len(scene.known.light) > 0
    tiles_across = (camera.width + WAVE_EDGE - 1) // WAVE_EDGE
    for tile in range(work.first_tile, work.end_tile):
        column, row = WAVE_EDGE * (tile % tiles_across), WAVE_EDGE * (tile // tiles_across)
        seed_pixels(camera, column, row, transport.frame_key, scratch)
        for index in range(work.first_sample, work.end_sample):
            sample = np.uint32(index)
            count = generate_camera_rays(camera, column, row, sample, scratch)
            here, ahead, waiting = scratch.here, scratch.ahead, 0
            for depth in range(transport.max_depth):
                at_lights, at_hits = transport.clamp if depth > 0 else _INFINITE, transport.clamp if depth > 1 else _INFINITE
                roulette = depth >= _ROULETTE_FROM
                queued = 0
                for first in range(0, count, LANES):
                    intersect_closest(scene.tree, here, first, count, depth == 0, scratch)
                    evaluate_surfaces(scene, depth == 0, False, transport.widest, scratch)
                    update_aovs(film, column, row, depth, scratch)
                    if depth > 0:
                        regularize(transport.caustic_blur, scratch)
                    add_emission(at_hits, depth < 2 and film.direct.shape[0] > 0, scratch)
                    if depth + 1 == transport.max_depth:
                        continue
                    choose_sides(depth, sample, scratch)
                    weigh_lights(lights, scratch)
                    kinds = build_bsdfs(surfaces, depth + 2 < transport.max_depth, scratch)
                    generate_ray_samples(lights, depth, sample, kinds > 0 or roulette or guided, guided, scratch)
                    if gathers and depth > 0 and gather_known_light(scene.known, kinds, at_lights, scratch) == 0:
                        continue
                    if len(lights.patches) > 0:
                        weigh_patches(lights.patches, scratch)
                    if guided:
                        look_up_guide(scene.guide, scratch.lanes)
                    waiting = sample_lights(scene, kinds, depth, at_lights, waiting, (column, row), scratch, film)
                    if gathers and depth > 0 and kinds > 0:
                        end_gathered_paths(scratch.lanes)
                    queued = spawn_rays(scene, kinds, roulette, depth >= _DEEP, queued, ahead, scratch)
                scratch.traced[0] += count
                count = queued
                if count == 0:
                    break
                here, ahead = ahead, here
            flush_shadow_rays(scene.tree, waiting, scratch)
            update_film(camera, column, row, scratch.light, film)
