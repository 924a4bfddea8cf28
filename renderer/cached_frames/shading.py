"""Frames by the irradiance cache: hits that are known, shaded with light that is known.

A tile of 4 x 4 pixels goes through these stages; between them its hits lie in the lanes, what is known of its pixels in ``primary``.

    restore    the recorded hits become surfaces and BSDFs again
    diffuse    what matt lobes send on of the light that the nodes around know                          lane by lane
    strays     packets with hits about which no node knows wait until light is computed for these, and begin again
    classify   what mirrors: by the first order of the light around, or by a ray of its own             lane by lane
    lamps      some of the lamps and panes that rough gloss shows, as balls                             lane by lane, then shadow rays
    sun        sampled where the nodes around have any
    behind     what sheets let through: matt light and sun again, from their other side; what shows through holes has a ray
    gloss      mirrored rays and those through glass (:mod:`renderer.cached_frames.mirrored`)
    store      into the picture
"""

import numpy as np
from numpy.typing import NDArray

from renderer.bsdf.bsdf import evaluate_bsdf
from renderer.bsdf.microfacet import fresnel_dielectric, fresnel_thin_dielectric
from renderer.bsdf.reflectance import coat_albedo, diffuse_albedo, specular_albedo
from renderer.cached_frames import records as rec
from renderer.cached_frames.curvature import widened
from renderer.cached_frames.edges import EdgeSamples, add_samples, load_samples
from renderer.cached_frames.gloss_rays import aim_gloss, aim_more_gloss, base_fresnel, pixel_noise
from renderer.cached_frames.incident import Incident, around_share, lamps_share, light_of_stray, read_light
from renderer.cached_frames.lamp_points import add_lamps
from renderer.cached_frames.lamps import choose_lamps
from renderer.cached_frames.mirrored import add_gloss
from renderer.cached_frames.reconstruction import Picture
from renderer.cached_frames.records import (
    MIRROR,
    ROUGH,
    SHARP,
    UNSEEN,
    CachedView,
    ShadeScratch,
    Tables,
    looks_under,
    takes_from_others,
)
from renderer.cached_frames.strays import Strays, add_stray, expect_none, has_strays
from renderer.camera.camera_rays import CENTRE, TILE
from renderer.camera.shutter import aim_exposed_tile
from renderer.core import lanes as ln
from renderer.core import ray_packet as ray
from renderer.core.color import Rgb
from renderer.core.kernel import entry, inlined, kernel
from renderer.core.ray_packet import LANES
from renderer.ground_truth.surface_images import restore_hits
from renderer.irradiance_cache.specular import pass_glass
from renderer.path.direct_light import wi_to_lights
from renderer.path.light_sampling import sample_sun
from renderer.path.records import LitScene, Scratch
from renderer.path.scattering import build_bsdfs
from renderer.path.sheets import any_sheet, take_from_behind
from renderer.path.surfaces import evaluate_surfaces, lift_height

_ZERO, _HALF, _ONE, _TWO = np.float32(0.0), np.float32(0.5), np.float32(1.0), np.float32(2.0)
_INVERSE_PI = np.float32(1.0 / np.pi)
_INFINITE = np.float32(np.inf)
_STEEPEST = np.float32(2.5)
_NEVER = np.float32(0.75)
"""Roughness from which on no lobe sends a ray: it shows light from nearly everywhere."""
_SUN_RAYS = 4
_WHOLE = np.float32(np.sqrt(2.0))
"""Width of a pixel's cone by which textures are averaged over all of the pixel: paths, which are many, see them twice as sharply."""
_OF_MANY = np.float32(np.sqrt(2.0 / 7.0))
"""The same of one of several points of a pixel."""
_LEAST_ALPHA = np.float32(1e-4)
_LEAST_COAT = np.float32(0.033)
"""Roughness of coats, at least, whose rays neighbours share."""


@entry
def shade_hits(
    shown: CachedView, samples: EdgeSamples, strays: Strays, memory: ShadeScratch, picture: Picture, first: int, step: int
) -> None:
    """Fill the rows of tiles ``first``, ``first + step``, ... of a picture; or, if there are ``samples``, add their shares of pixels.

    Packets that have ``strays`` are left out until their light is known, then all others are.
    """
    view, apart, again = shown.traced, len(samples.counts) > 0, len(strays.light.valid) > 0
    for row in range(first, len(strays.counts), step):
        if not again:
            strays.counts[row] = 0
        for begin in range(0, samples.counts[row] if apart else LANES * -(-view.camera.width // TILE), LANES):
            if again and not has_strays(strays, row, begin):
                continue
            x, y = begin // TILE, row * TILE
            if apart:
                load_samples(samples, row, begin, memory)
            else:
                aim_exposed_tile(view.camera, x, y, CENTRE, memory.trace.rays)
                restore_hits(view, x, y, memory.trace.rays)
                for k in range(LANES):
                    memory.pixels[0, k], memory.pixels[1, k] = x + (k & 3), y + (k >> 2)
            if not again:
                expect_none(strays, row, begin)
            if not _shade_packet(shown, apart, strays, row, begin, memory):
                continue
            if apart:
                add_samples(samples, row, begin, memory.primary, picture.light)
            else:
                _store(x, y, memory, picture)


@inlined
def _shade_packet(shown: CachedView, alone: bool, strays: Strays, row: int, begin: int, memory: ShadeScratch) -> bool:
    """Shade 16 hits, which lie in the packet; return False if light is to be computed for some first.

    ``alone``: whether each sends mirrored rays of its own; ``row``, ``begin``: the place of the packet's strays.
    """
    scene, tables, frame_key, lanes = shown.scene, shown.tables, shown.frame_key, memory.trace.lanes
    spread = (_OF_MANY if alone else _WHOLE) / shown.traced.camera.focal_px
    kinds = _build_surfaces(scene, spread, memory.trace)
    sunny = asking = traced = 0
    again, met = len(strays.light.valid) > 0, False
    for k in range(LANES):
        _begin_pixel(lanes, memory, k)
        if lanes[ln.HIT + k] == _ZERO:
            continue
        stray = again and strays.server[row, begin + k] >= 0
        incident = light_of_stray(strays, row, begin + k) if stray else read_light(tables, k, memory)
        if not incident.known:
            add_stray(memory.trace, k, row, begin, tables.spacing_m, strays)
            met = True
        elif not met:
            more = _shade_lane(scene, tables, incident, kinds, alone, k, memory)
            sunny, asking, traced = sunny + more[0], asking + more[1], traced + more[2]
    if met:
        return False
    if asking > 0:
        add_lamps(scene, tables.lamps, choose_lamps(scene.surfaces, tables.lamps, alone, memory), alone, memory)
    if len(scene.lights.infinite.part) > 0 and sunny > 0:
        _add_sun(scene, kinds, frame_key, memory)
    if any_sheet(lanes):
        _add_from_behind(scene, tables, frame_key, memory)
    if traced > 0:
        add_gloss(scene, tables, shown.is_read, spread, memory)
    return True


@inlined
def _shade_lane(
    scene: LitScene, tables: Tables, incident: Incident, kinds: int, alone: bool, k: int, memory: ShadeScratch
) -> tuple[int, int, int]:
    """Add matt light to the pixel of lane k, and prepare what it mirrors; return 1 or 0 for the sun, lamps, a ray of its own."""
    lanes, primary, x, y = memory.trace.lanes, memory.primary, memory.pixels[0, k], memory.pixels[1, k]
    along = incident.x * lanes[ln.NS_X + k] + incident.y * lanes[ln.NS_Y + k] + incident.z * lanes[ln.NS_Z + k] + incident.rest
    sunny, asking = _add_diffuse(incident, along, kinds, lanes, primary, k), 0
    glossy, glass, around = _classify(tables, incident, along, kinds, k, memory)
    if not glossy:
        return sunny, 0, 0
    if primary[rec.SHOWN_ALPHA, k] >= SHARP or primary[rec.UNDER_ALPHA, k] < _ONE:
        memory.gloss[rec.ASKS + k], asking = _ONE, 1
    primary[rec.RAY_ALPHA, k] = primary[rec.SHOWN_ALPHA, k]
    if not alone and looks_under(x, y, primary, k):
        primary[rec.RAY_ALPHA, k] = primary[rec.UNDER_ALPHA, k]
    elif not (glass or alone) and takes_from_others(x, y, lanes[ln.METALLIC + k] >= _HALF, primary, k):
        _guess_mirrored(incident, around, primary, k)
        return sunny, asking, 0
    primary[rec.MORE, k] = _ONE if alone and lanes[ln.METALLIC + k] >= _HALF and primary[rec.RAY_ALPHA, k] >= SHARP else _ZERO
    _send_ray(incident, glass, k, memory)
    return sunny, asking, 1


@inlined
def _build_surfaces(scene: LitScene, spread: np.float32, scratch: Scratch) -> int:
    """Fill the lanes with the surfaces of the packet's hits; return the kinds of their BSDFs.  ``spread``: of a pixel's cone."""
    lanes = scratch.lanes
    for k in range(LANES):
        lanes[ln.WIDTH + k], lanes[ln.SPREAD + k] = _ZERO, spread
        lanes[ln.RAY_PDF + k], lanes[ln.OUTSIDE + k] = _INFINITE, _ZERO
    evaluate_surfaces(scene, True, True, _INFINITE, scratch)
    return build_bsdfs(scene.surfaces, True, scratch)


@inlined
def _begin_pixel(lanes: NDArray[np.float32], memory: ShadeScratch, k: int) -> None:
    """Let the pixel of lane k have what its surface emits, and nothing mirrored."""
    primary = memory.primary
    lanes[ln.IMPORTANCE + k] = memory.gloss[rec.ASKS + k] = memory.gloss[rec.LAMPLIGHT + k] = _ZERO
    primary[rec.KIND, k] = primary[rec.ALPHA, k] = primary[rec.SHOWN_ALPHA, k] = primary[rec.MORE, k] = _ZERO
    primary[rec.UNDER_ALPHA, k] = _ONE
    primary[rec.LAMPS, k] = primary[rec.LAMPS + 1, k] = primary[rec.LAMPS + 2, k] = _ZERO
    primary[rec.SEEN, k] = primary[rec.SEEN + 1, k] = primary[rec.SEEN + 2, k] = _ZERO
    primary[rec.LIGHT, k], primary[rec.LIGHT + 1, k], primary[rec.LIGHT + 2, k] = lanes[ln.LE_R + k], lanes[ln.LE_G + k], lanes[ln.LE_B + k]


@inlined
def _add_light(primary: NDArray[np.float32], k: int, r: np.float32, g: np.float32, b: np.float32) -> None:
    primary[rec.LIGHT, k] += r
    primary[rec.LIGHT + 1, k] += g
    primary[rec.LIGHT + 2, k] += b


@inlined
def _add_diffuse(
    incident: Incident, along: np.float32, kinds: int, lanes: NDArray[np.float32], primary: NDArray[np.float32], k: int
) -> int:
    """Add what matt lobes send on; return 1, and mark the lane by IMPORTANCE, where the sun is to be sampled.

    ``along``: cosine between the light's direction and the normal, by which relief is lit.
    """
    directed = incident.x * incident.x + incident.y * incident.y + incident.z * incident.z > _ZERO
    bend = (min(max(along, _ZERO), _STEEPEST) if directed else _ONE) * _INVERSE_PI
    r, g, b = diffuse_albedo(lanes, kinds, k)
    _add_light(primary, k, bend * r * incident.r, bend * g * incident.g, bend * b * incident.b)
    if incident.sun > _ZERO:
        lanes[ln.IMPORTANCE + k] = _ONE
        return 1
    return 0


@inlined
def _classify(
    tables: Tables, incident: Incident, along: np.float32, kinds: int, k: int, memory: ShadeScratch
) -> tuple[bool, bool, np.float32]:
    """Fill SHARE, ALPHA, SHOWN_ALPHA and UNDER, what lane k mirrors and how wide, where a ray asks for it; else add the light around.

    Return whether one does, whether light goes straight through, and the share of the illuminance that is mirrored by its first order.
    """
    lanes, primary = memory.trace.lanes, memory.primary
    r, g, b, roughness, glass = _boundary(lanes, kinds, k)
    around = around_share(incident, along, roughness * roughness, memory.trace.rays, lanes, k)
    coat = coat_albedo(lanes, kinds, k)
    matt_r, matt_g, matt_b = diffuse_albedo(lanes, kinds, k)
    # What mirrors much beside what it scatters has a ray though it is rough.
    roughest = _NEVER if max(r, g, b) > _HALF * max(matt_r, matt_g, matt_b) else tables.roughest
    primary[rec.UNDER, k] = primary[rec.UNDER + 1, k] = primary[rec.UNDER + 2, k] = _ZERO
    coat_roughness = lanes[ln.COAT_ROUGHNESS + k]
    if coat > _ZERO and coat_roughness * coat_roughness > ROUGH and roughness < roughest:
        # Coat and what lies under it are about as rough: one ray for both.
        under = (r + g + b) * np.float32(1.0 / 3.0)
        roughness = (coat * coat_roughness + under * roughness) / (coat + under)
        r, g, b = r + coat, g + coat, b + coat
    elif coat > _ZERO:
        # The coat and the rougher lobe under it share the rays of neighbours, half of them each.
        if (coat > tables.least_share) & (roughness < roughest):
            primary[rec.UNDER, k], primary[rec.UNDER + 1, k], primary[rec.UNDER + 2, k] = r, g, b
            primary[rec.UNDER_ALPHA, k] = max(roughness * roughness, SHARP)
            coat_roughness = max(coat_roughness, _LEAST_COAT)
        else:
            _add_wide(incident, along, around, (r, g, b), roughness * roughness, k, memory)
            primary[rec.UNDER_ALPHA, k] = UNSEEN
        r = g = b = coat
        roughness = coat_roughness
    most = max(r, g, b)
    if not ((most > tables.least_share) & (roughness < roughest) or glass):
        if coat > _ZERO:
            _add_light(primary, k, around * r * incident.r, around * g * incident.g, around * b * incident.b)
        else:
            _add_wide(incident, along, around, (r, g, b), roughness * roughness, k, memory)
        return False, glass, around
    primary[rec.SHARE, k], primary[rec.SHARE + 1, k], primary[rec.SHARE + 2, k] = r, g, b
    alpha = max(roughness * roughness, _LEAST_ALPHA)
    bend = tables.bend[memory.trace.rays.integer[ray.PRIM_ID + k]]
    primary[rec.ALPHA, k], primary[rec.SHOWN_ALPHA, k] = alpha, widened(alpha, bend, lanes[ln.WIDTH + k])
    return True, glass, around * (_ONE - incident.lamps)


@inlined
def _add_wide(
    incident: Incident, along: np.float32, around: np.float32, mirrored: Rgb, alpha: np.float32, k: int, memory: ShadeScratch
) -> None:
    """Add what a lobe that sends no ray mirrors, ``mirrored`` of even light: of lamps by their direction, of the rest the light around."""
    if mirrored[0] + mirrored[1] + mirrored[2] == _ZERO:
        return
    lanes = memory.trace.lanes
    share, schlick = lamps_share(incident, along, alpha, memory.trace.rays, lanes, k)
    red, green, blue = base_fresnel(schlick, k, lanes)
    share, rest = incident.lamps * share, (_ONE - incident.lamps) * around
    r, g, b = share * red + rest * mirrored[0], share * green + rest * mirrored[1], share * blue + rest * mirrored[2]
    _add_light(memory.primary, k, r * incident.r, g * incident.g, b * incident.b)


@inlined
def _boundary(lanes: NDArray[np.float32], kinds: int, k: int) -> tuple[np.float32, np.float32, np.float32, np.float32, bool]:
    """Return what the surface of lane k mirrors (r, g, b) under its coat, how rough it is, and whether light goes straight through."""
    r, g, b = specular_albedo(lanes, kinds, k)
    roughness = lanes[ln.ROUGHNESS + k]
    glass = (lanes[ln.TRANSMISSION + k] > _HALF) & (lanes[ln.THIN + k] == _ZERO)
    if lanes[ln.OPENNESS + k] > _ZERO:
        return r, g, b, _ZERO, True
    if lanes[ln.THIN + k] > _ZERO:
        r = g = b = fresnel_thin_dielectric(lanes[ln.WO_Z + k], lanes[ln.IOR + k])
        roughness = _ZERO
        glass = lanes[ln.OPEN + k] == _ZERO
    elif glass:
        r = g = b = fresnel_dielectric(lanes[ln.WO_Z + k], lanes[ln.ETA + k])
    return r, g, b, roughness, glass


@inlined
def _guess_mirrored(incident: Incident, around: np.float32, primary: NDArray[np.float32], k: int) -> None:
    """Let the rays of neighbours serve lane k: ALPHA becomes negative, and SEEN the light around in case that there are none."""
    primary[rec.ALPHA, k] = -primary[rec.ALPHA, k]
    primary[rec.SEEN, k], primary[rec.SEEN + 1, k], primary[rec.SEEN + 2, k] = around * incident.r, around * incident.g, around * incident.b


@inlined
def _send_ray(incident: Incident, glass: bool, k: int, memory: ShadeScratch) -> None:
    """Let lane k send a mirrored ray, and one straight through if it is of glass."""
    lanes, primary, real = memory.trace.lanes, memory.primary, memory.trace.rays.real
    primary[rec.KIND, k] = _TWO if glass else _ONE
    primary[rec.PANE, k] = lanes[ln.THIN + k]
    primary[rec.EVEN, k] = _INVERSE_PI * incident.r
    primary[rec.EVEN + 1, k] = _INVERSE_PI * incident.g
    primary[rec.EVEN + 2, k] = _INVERSE_PI * incident.b
    holes = lanes[ln.OPENNESS + k]
    beyond = _TWO * lift_height(lanes[ln.P_X + k], lanes[ln.P_Y + k], lanes[ln.P_Z + k])
    for channel in range(3):
        base = lanes[ln.BASE_R + LANES * channel + k]
        tint = _ONE if lanes[ln.THIN + k] > _ZERO else np.sqrt(base)
        primary[rec.BASE + channel, k] = holes * base if holes > _ZERO else tint * lanes[ln.TRANSMISSION + k]
        primary[rec.POINT + channel, k] = lanes[ln.P_X + LANES * channel + k]
        behind = lanes[ln.P_X + LANES * channel + k] - beyond * lanes[ln.NG_X + LANES * channel + k]
        primary[rec.EYE + channel, k] = behind if holes > _ZERO else real[ray.ORG_X + LANES * channel + k]
        primary[rec.WAY + channel, k] = real[ray.DIR_X + LANES * channel + k]
    if primary[rec.MORE, k] > _ZERO:
        aim_more_gloss(memory.pixels[0, k], memory.pixels[1, k], k, primary, lanes)
    else:
        aim_gloss(memory.pixels[0, k], memory.pixels[1, k], k, primary, lanes)


@inlined
def _add_from_behind(scene: LitScene, tables: Tables, frame_key: np.uint32, memory: ShadeScratch) -> None:
    """Add what sheets let through of the light that the nodes on their other side know; the lanes are taken from there."""
    lanes, sunny = memory.trace.lanes, 0
    for k in range(LANES):
        lanes[ln.IMPORTANCE + k] = _ZERO
        if lanes[ln.HIT + k] * lanes[ln.DIFFUSE_TRANSMISSION + k] > _ZERO:
            lanes[ln.DIFFUSE_TRANSMISSION + k] -= lanes[ln.OPENNESS + k]
            take_from_behind(lanes, k)
    kinds = build_bsdfs(scene.surfaces, True, memory.trace)
    for k in range(LANES):
        if lanes[ln.BEHIND + k] > _ZERO:
            incident = read_light(tables, k, memory)
            if incident.known:
                sunny += _add_diffuse(incident, _ONE, kinds, lanes, memory.primary, k)
                _add_mirrored_net(incident, tables.pane_ior, lanes, memory.primary, k)
    if len(scene.lights.infinite.part) > 0 and sunny > 0:
        _add_sun(scene, kinds, frame_key, memory)


@inlined
def _add_mirrored_net(incident: Incident, pane_ior: np.float32, lanes: NDArray[np.float32], primary: NDArray[np.float32], k: int) -> None:
    """Add what is seen through the holes of a net of its own other side, in the window pane behind it.  ``incident``: on that side."""
    holes = lanes[ln.OPENNESS + k]
    share = holes * fresnel_thin_dielectric(abs(lanes[ln.COS_FRONT + k]), pane_ior) * _INVERSE_PI
    share *= max(_ONE - holes - lanes[ln.DIFFUSE_TRANSMISSION + k], _ZERO)
    r, g, b = lanes[ln.BASE_R + k], lanes[ln.BASE_G + k], lanes[ln.BASE_B + k]
    _add_light(primary, k, share * r * r * incident.r, share * g * g * incident.g, share * b * b * incident.b)


@kernel
def _add_sun(scene: LitScene, kinds: int, key: np.uint32, memory: ShadeScratch) -> None:
    """Add the sun's light, sampled some times, where the nodes around have any."""
    scratch, lanes, primary = memory.trace, memory.trace.lanes, memory.primary
    for sample in range(_SUN_RAYS):
        for k in range(LANES):
            u, v = pixel_noise(memory.pixels[0, k], memory.pixels[1, k], np.uint32(key + np.uint32(7)))
            v += np.float32(sample) / np.float32(_SUN_RAYS)
            lanes[ln.U_INFINITE_0 + k], lanes[ln.U_INFINITE_1 + k] = u, v - np.floor(v)
        sample_sun(scene.surfaces, scene.lights, scratch)
        pass_glass(scene, scratch)
        wi_to_lights(lanes)
        evaluate_bsdf(lanes, kinds, scene.surfaces.albedos.reflected)
        for k in range(LANES):
            if lanes[ln.LIGHT_PDF + k] > _ZERO:
                gain = _ONE / (np.float32(_SUN_RAYS) * lanes[ln.LIGHT_PDF + k])
                for channel in range(0, 3 * LANES, LANES):
                    primary[rec.LIGHT + channel // LANES, k] += gain * lanes[ln.LI_R + channel + k] * lanes[ln.F_COS_R + channel + k]


@inlined
def _store(column: int, row: int, memory: ShadeScratch, picture: Picture) -> None:
    """Write the pixels of a tile that lie in the picture."""
    primary, (height, width, _) = memory.primary, picture.light.shape
    for k in range(LANES):
        x, y = column + (k & 3), row + (k >> 2)
        if x < width and y < height:
            alpha, coated = primary[rec.ALPHA, k], primary[rec.UNDER_ALPHA, k] < _ONE
            under = _ONE if coated and looks_under(x, y, primary, k) else _ZERO
            sent = _ONE - under if alpha > MIRROR else _ZERO
            lamplight, asked = memory.gloss[rec.LAMPLIGHT + k], memory.gloss[rec.LAMP_RAY_COUNT + k] > _ZERO
            picture.alpha[y, x], picture.lamplight[y, x] = alpha, lamplight
            picture.gloss[y, x, 3], picture.gloss[y, x, 7], picture.gloss[y, x, 11] = sent, lamplight if asked else _ZERO, under
            for channel in range(3):
                picture.light[y, x, channel] = primary[rec.LIGHT + channel, k]
                picture.gloss[y, x, channel] = sent * primary[rec.SEEN + channel, k]
                picture.gloss[y, x, 4 + channel] = primary[rec.LAMPS + channel, k]
                picture.gloss[y, x, 8 + channel] = under * primary[rec.SEEN + channel, k]
                picture.under[y, x, channel] = primary[rec.UNDER + channel, k] if coated else _ZERO
            if alpha != _ZERO:
                for channel in range(3):
                    picture.guess[y, x, channel] = primary[rec.SEEN + channel, k]
                    picture.share[y, x, channel] = primary[rec.SHARE + channel, k]
