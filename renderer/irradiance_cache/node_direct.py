"""Direct light at nodes: lamps and the sky in panes, group by group, and the sun."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from renderer.bsdf.reflectance import Reflector, reflected_share
from renderer.core import lanes as ln
from renderer.core.color import LUMINANCE
from renderer.core.kernel import entry, inlined
from renderer.core.lanes import count_chosen
from renderer.core.ray_packet import LANES
from renderer.irradiance_cache.nodes import NodeLight, arriving, reflector_of, scatterer_of, stand_on, turned, unit_hash
from renderer.irradiance_cache.outside import UnderSky, outside_light
from renderer.irradiance_cache.specular import pass_glass
from renderer.irradiance_cache.view_factors import sample_view, view_factor
from renderer.path.direct_light import weigh_lights
from renderer.path.light_nodes import Atlas
from renderer.path.light_sampling import sample_groups, sample_sun, show_emitters
from renderer.path.lights import BY_SKY, EMITTER_LE, EMITTER_SIZE, EVENLY, LightGroups
from renderer.path.records import LitScene, Scratch

_ZERO, _HALF, _ONE, _TINY = np.float32(0.0), np.float32(0.5), np.float32(1.0), np.float32(1e-20)
_PI = np.float32(np.pi)
_RED, _GREEN, _BLUE = (np.float32(weight) for weight in LUMINANCE)
_STEP_U, _STEP_V = np.float32(0.7548777), np.float32(0.5698403)
_FREE_SAMPLES, _SCREENED_PACKETS = 128, 4
"""Points that tell how much there would be, and 16 times how many a run has of light that is hidden in part nearly everywhere, at most."""
_LEAST_SAMPLES = np.float32(2.0)
_NEAR = np.float32(3.0)
"""In radii of a group of lights: from less far away it is sampled by what it fills of the view, and how much that is is computed."""


@entry
def light_nodes(
    scene: LitScene,
    atlas: Atlas,
    key: np.uint32,
    budget: int,
    pattern: NDArray[np.float32],
    nodes: NDArray[np.int64],
    sky: UnderSky,
    screened: NDArray[np.bool_],
    coarse: bool,
    scratch: Scratch,
    light: NodeLight,
) -> None:
    """Fill ``direct``, ``sun`` and ``sky`` of some nodes, and begin ``indirect`` and ``toward``.

    ``sky``: what nodes outside see of it, or NOT_OUTSIDE.
    ``budget``: about how many points on lights are sampled, shared among groups of lights by importance; ``pattern``: (s, 2) float32, s a
    multiple of 16, points of the unit square by which the sun's disc is sampled; ``screened``: groups of lights, (g,), that are asked for
    more points, as most places see a part of them; ``coarse``: whether light counts for all that the surface
    scatters, or for its diffuse base, and photons bring that of the sun.
    """
    lanes, has_sun = scratch.lanes, len(scene.lights.infinite.part) > 0
    for i in range(len(nodes)):
        node = nodes[i]
        reflector = scatterer_of(scene.surfaces, atlas.face[node]) if coarse else reflector_of(scene.surfaces, atlas.face[node], False)
        stand_on(atlas, node, scratch)
        weigh_lights(scene.lights, scratch)
        shift_u, shift_v = unit_hash(node, key)
        for channel in range(3):
            light.indirect[node, channel] = light.direct[node, channel] = light.toward[node, channel] = light.sun[node, channel] = _ZERO
        light.sun[node, 3] = light.sky[node] = _ZERO
        share = sky.share[node] if len(sky.share) > 0 else _ZERO
        if share > _ZERO:
            x, y, z = sky.way[node, 0], sky.way[node, 1], sky.way[node, 2]
            scale = _ONE / np.sqrt(max(x * x + y * y + z * z, _TINY))
            r, g, b = outside_light(scene.surfaces.sky, scale * x, scale * y, scale * z)
            light.indirect[node, 0], light.indirect[node, 1], light.indirect[node, 2] = share * _PI * r, share * _PI * g, share * _PI * b
            for k in range(LANES):
                lanes[ln.OUTSIDE + k] = _ONE
            if has_sun:
                _add_sun(scene, pattern, reflector, node, shift_u, shift_v, scratch, light)
        elif lanes[ln.IMPORTANCE] > _ZERO:
            _add_groups(scene, np.float32(budget) / lanes[ln.IMPORTANCE], screened, reflector, node, key, scratch, light)
            # Photons bring what coarse nodes have of it.
            if has_sun and not coarse:
                _add_sun(scene, pattern, reflector, node, shift_u, shift_v, scratch, light)


@inlined
def _add_groups(
    scene: LitScene,
    samples: np.float32,
    screened: NDArray[np.bool_],
    reflector: Reflector,
    node: int,
    key: np.uint32,
    scratch: Scratch,
    light: NodeLight,
) -> None:
    """Add the light of lamps to ``direct`` of a node, that of the sky in panes to ``indirect``, and both to ``toward``.

    ``samples``: for each unit of importance.
    """
    lanes, lights = scratch.lanes, scene.lights
    r = g = b = x = y = z = sky_r = sky_g = sky_b = _ZERO
    for k in range(LANES):
        lanes[ln.IMPORTANCE + k] = lanes[ln.GROUP_IMPORTANCE + k] = _ONE
    for group in range(len(lights.groups.area)):
        budget = scratch.importances[group * LANES] * samples
        if budget > _ZERO:
            red, green, blue, dx, dy, dz = _light_of_group(
                scene, group, budget, _SCREENED_PACKETS if screened[group] else 1, reflector, node, key, scratch
            )
            x, y, z = x + dx, y + dy, z + dz
            if lights.varies[lights.groups.start[group]] == BY_SKY:
                sky_r, sky_g, sky_b = sky_r + red, sky_g + green, sky_b + blue
            else:
                r, g, b = r + red, g + green, b + blue
    # Samples that are off by chance may ask for less than nothing.
    light.indirect[node, 0], light.indirect[node, 1], light.indirect[node, 2] = max(sky_r, _ZERO), max(sky_g, _ZERO), max(sky_b, _ZERO)
    light.direct[node, 0], light.direct[node, 1], light.direct[node, 2] = max(r, _ZERO), max(g, _ZERO), max(b, _ZERO)
    light.toward[node, 0], light.toward[node, 1], light.toward[node, 2] = x, y, z
    light.sky[node] = _RED * light.indirect[node, 0] + _GREEN * light.indirect[node, 1] + _BLUE * light.indirect[node, 2]


@inlined
def _add_sun(
    scene: LitScene,
    pattern: NDArray[np.float32],
    reflector: Reflector,
    node: int,
    shift_u: np.float32,
    shift_v: np.float32,
    scratch: Scratch,
    light: NodeLight,
) -> None:
    """Write the sun's light at a node, and which share of it arrives."""
    lanes = scratch.lanes
    for k in range(LANES):
        lanes[ln.HIT + k] = _ONE
    r = g = b = arrived = _ZERO
    for begin in range(0, len(pattern), LANES):
        for k in range(LANES):
            lanes[ln.U_INFINITE_0 + k] = turned(pattern[begin + k, 0], shift_u)
            lanes[ln.U_INFINITE_1 + k] = turned(pattern[begin + k, 1], shift_v)
        sample_sun(scene.surfaces, scene.lights, scratch)
        # No portal lies in that direction for most nodes: they need no shadow rays.
        if count_chosen(lanes, ln.LIGHT_PDF) == 0:
            continue
        pass_glass(scene, scratch)
        for k in range(LANES):
            if lanes[ln.LIGHT_PDF + k] > _ZERO:
                gain, _, _, _, cosine = arriving(lanes, k)
                gain *= cosine * reflected_share(reflector, cosine, scene.surfaces.albedos.reflected)
                r, g, b = r + gain * lanes[ln.LI_R + k], g + gain * lanes[ln.LI_G + k], b + gain * lanes[ln.LI_B + k]
                arrived += _ONE
    scale = _ONE / np.float32(len(pattern))
    light.sun[node, 0], light.sun[node, 1], light.sun[node, 2] = r * scale, g * scale, b * scale
    light.sun[node, 3] = arrived * scale


class _Run(NamedTuple):
    """Sums over a run of samples: illuminance (r, g, b), that if nothing stood between, free, and how many samples were taken."""

    r: np.float32
    g: np.float32
    b: np.float32
    free: np.float32
    taken: int


@inlined
def _light_of_group(
    scene: LitScene, group: int, budget: np.float32, packets: int, reflector: Reflector, node: int, key: np.uint32, scratch: Scratch
) -> tuple[np.float32, np.float32, np.float32, np.float32, np.float32, np.float32]:
    """Return illuminance (r, g, b) by one group of lights, and luminance times direction.

    Few samples tell which share of the light is blocked, many, without rays, how much there would be: where nothing stands between, no
    noise is left.  There are two runs of samples, and the share that one has seen is that of what the other lacks (a control variate): the
    share of its own, wrong together with it, would make light too dark in the mean where faint parts of a lamp are hidden.  What counts
    of it for the ``reflector`` is the mean over what arrives.
    """
    lanes, lights = scratch.lanes, scene.lights
    start, near, view = lights.groups.start[group], _is_near(lights.groups, group, lanes), _ZERO
    if near:
        point, normal = (lanes[ln.P_X], lanes[ln.P_Y], lanes[ln.P_Z]), (lanes[ln.NS_X], lanes[ln.NS_Y], lanes[ln.NS_Z])
        view = view_factor(lights.emitters, start, lights.groups.start[group + 1], point, normal)
        if view <= _ZERO:
            return _ZERO, _ZERO, _ZERO, _ZERO, _ZERO, _ZERO
    samples = min(int(np.ceil(_HALF * max(budget, _LEAST_SAMPLES))), packets * LANES)
    vx = vy = vz = counted = _ZERO
    first, second = _Run(_ZERO, _ZERO, _ZERO, _ZERO, 0), _Run(_ZERO, _ZERO, _ZERO, _ZERO, 0)
    # A few samples of each run, by turns, with shadow rays.
    for packet in range(2 * packets):
        if min(first.taken, second.taken) == samples:
            break
        number_runs(LANES * packet, node, key, lanes)
        sample_group(scene, group, view, scratch)
        # Points from which nothing could come need no ray: the first that could are taken.  What fills the view hardly has any.
        for k in range(LANES):
            count = second.taken if k & 1 else first.taken
            lanes[ln.U_LOBE + k] = _ZERO
            if count == samples or (lanes[ln.LIGHT_PDF + k] <= _ZERO and not near):
                lanes[ln.LIGHT_PDF + k] = _ZERO
                continue
            free = _ZERO
            if lanes[ln.LIGHT_PDF + k] > _ZERO:
                gain, _, _, _, cosine = arriving(lanes, k)
                lanes[ln.U_LOBE + k] = gain
                free = gain * cosine * _shown(lanes, k)
            if k & 1:
                second = _Run(second.r, second.g, second.b, second.free + free, count + 1)
            else:
                first = _Run(first.r, first.g, first.b, first.free + free, count + 1)
        pass_glass(scene, scratch)
        for k in range(LANES):
            if lanes[ln.LIGHT_PDF + k] > _ZERO:
                _, dx, dy, dz, cosine = arriving(lanes, k)
                gain = lanes[ln.U_LOBE + k]
                weight = gain * cosine
                r, g, b = weight * lanes[ln.LI_R + k], weight * lanes[ln.LI_G + k], weight * lanes[ln.LI_B + k]
                if k & 1:
                    second = _Run(second.r + r, second.g + g, second.b + b, second.free, second.taken)
                else:
                    first = _Run(first.r + r, first.g + g, first.b + b, first.free, first.taken)
                weight = gain * _shown(lanes, k)
                counted += weight * cosine * reflected_share(reflector, cosine, scene.surfaces.albedos.reflected)
                vx, vy, vz = vx + weight * dx, vy + weight * dy, vz + weight * dz
    sampled = _RED * (first.r + second.r) + _GREEN * (first.g + second.g) + _BLUE * (first.b + second.b)
    if sampled <= _ZERO:
        return _ZERO, _ZERO, _ZERO, _ZERO, _ZERO, _ZERO
    whole, able = _unblocked(scene, group, near, view, scratch)
    r = _HALF * (_controlled(first, first.r, second, second.r, whole, able) + _controlled(second, second.r, first, first.r, whole, able))
    g = _HALF * (_controlled(first, first.g, second, second.g, whole, able) + _controlled(second, second.g, first, first.g, whole, able))
    b = _HALF * (_controlled(first, first.b, second, second.b, whole, able) + _controlled(second, second.b, first, first.b, whole, able))
    share = counted / sampled
    scale = share * max(_RED * r + _GREEN * g + _BLUE * b, _ZERO) / sampled
    return share * r, share * g, share * b, scale * vx, scale * vy, scale * vz


@inlined
def _unblocked(scene: LitScene, group: int, near: bool, view: np.float32, scratch: Scratch) -> tuple[np.float32, np.float32]:
    """Return how much light of a group there would be if nothing stood between (luminance), and at what share of points a light."""
    lanes, lights = scratch.lanes, scene.lights
    start, filled, whole, able = lights.groups.start[group], _ZERO, _ZERO, _ZERO
    if near and lights.varies[start] == EVENLY:
        row = EMITTER_SIZE * start + EMITTER_LE
        filled, whole = _ONE, _RED * lights.emitters[row] + _GREEN * lights.emitters[row + 1] + _BLUE * lights.emitters[row + 2]
    else:
        for packet in range(_FREE_SAMPLES // LANES):
            _number_evenly(LANES * packet, lanes)
            sample_group(scene, group, view, scratch)
            for k in range(LANES):
                if lanes[ln.LIGHT_PDF + k] > _ZERO:
                    gain, _, _, _, cosine = arriving(lanes, k)
                    filled += gain * cosine
                    whole += gain * cosine * _shown(lanes, k)
                    able += _ONE
    if near:
        return whole / max(filled, _TINY) * _PI * view, _ONE
    return whole / np.float32(_FREE_SAMPLES), able / np.float32(_FREE_SAMPLES)


@inlined
def _is_near(groups: LightGroups, group: int, lanes: NDArray[np.float32]) -> bool:
    """Return whether a group is so near to the point of all lanes that what it fills of the view is computed, not sampled."""
    squared, reach_m = _ZERO, _NEAR * groups.bounds[group, 3]
    for axis in range(3):
        between = groups.bounds[group, axis] - lanes[ln.P_X + LANES * axis]
        squared += between * between
    return bool(squared < reach_m * reach_m)


@inlined
def _controlled(run: _Run, value: np.float32, other: _Run, of_other: np.float32, whole: np.float32, able: np.float32) -> np.float32:
    """Return a channel's illuminance by the mean of a run, where what its samples lack of all light counts by the other run's share.

    ``value``, ``of_other``: the channel's sums; ``whole``: luminance of all light; ``able``: by what means over samples are multiplied.
    """
    if run.taken == 0:
        return whole * of_other / other.free
    mean = able / np.float32(run.taken)
    share = of_other / other.free if other.free > _ZERO else value / max(run.free, _TINY)
    return mean * value + share * (whole - mean * run.free)


@inlined
def _shown(lanes: NDArray[np.float32], k: int) -> np.float32:
    """Return the luminance of LI."""
    shown: np.float32 = _RED * lanes[ln.LI_R + k] + _GREEN * lanes[ln.LI_G + k] + _BLUE * lanes[ln.LI_B + k]
    return shown


@inlined
def number_runs(begin: int, node: int, key: np.uint32, lanes: NDArray[np.float32]) -> None:
    """Fill the random numbers for points on a group of lights, of a run in even lanes and of another in odd ones."""
    shift_u, shift_v = unit_hash(node, key)
    other_u, other_v = unit_hash(node, np.uint32(key + np.uint32(1)))
    for k in range(LANES):
        number = np.float32((begin + k) >> 1)
        lanes[ln.U_REMAPPED + k] = _fraction(number * _STEP_U + (other_u if k & 1 else shift_u))
        lanes[ln.U_LIGHT_1 + k] = _fraction(number * _STEP_V + (other_v if k & 1 else shift_v))


@inlined
def _number_evenly(begin: int, lanes: NDArray[np.float32]) -> None:
    """Fill them with numbers that are the same for all nodes."""
    for k in range(LANES):
        number = np.float32(begin + k)
        lanes[ln.U_REMAPPED + k] = _fraction(number * _STEP_U + _HALF)
        lanes[ln.U_LIGHT_1 + k] = _fraction(number * _STEP_V + _HALF)


@inlined
def sample_group(scene: LitScene, group: int, view: np.float32, scratch: Scratch) -> None:
    """Fill TO_LIGHT, LI and LIGHT_PDF with points on a group of lights, by what it fills of the view, ``view``, where that is known."""
    lanes, lights = scratch.lanes, scene.lights
    first = lights.groups.start[group]
    if view > _ZERO:
        sample_view(lights.emitters, first, lights.groups.start[group + 1], view, lanes, scratch.sampled)
        for k in range(LANES):
            for channel in range(3):
                lanes[ln.LI_R + channel * LANES + k] = lights.emitters[EMITTER_SIZE * first + EMITTER_LE + channel]
            lanes[ln.LIGHT_END + k] = _ONE
        show_emitters(scene.surfaces, lights, scratch)
    else:
        for k in range(LANES):
            scratch.sampled[k] = group
        sample_groups(scene.surfaces, lights, scratch)


@inlined
def _fraction(x: np.float32) -> np.float32:
    fraction: np.float32 = x - np.floor(x)
    return fraction
