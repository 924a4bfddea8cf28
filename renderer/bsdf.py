"""The principled scattering model: what a surface does with light from each direction, and how directions are drawn.

From the top: a clear coat (GGX, index 1.5) and a sheen; below them, by shares, metal (GGX, Schlick's Fresnel term with the base colour at
normal incidence), opaque dielectric (GGX over a diffuse base) and glass (GGX reflection and refraction).  What a layer reflects is missing
below it: coat and sheen scale what is under them by 1 - albedo towards the viewer; the diffuse base, and the multiple scattering that GGX
leaves out for metals, take exactly what microfacets leave, symmetrically in both directions (Kulla and Conty 2017).  Glass is scaled by its
own albedo (Turquin 2019).  So with a base colour of 1 every surface returns all light, from all sides.

Thin panes reflect; what they let through leaves the scene, and the light that enters by them counts as sent by them.  Refraction does not
scale luminance by the square of the index: the factors cancel for lights and cameras in air.

All directions are in the local frame of :mod:`renderer.microfacet`; the viewer is above, wo_z > 0.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from renderer.albedo import MIN_ALPHA, STEPS
from renderer.kernel import inlined, kernel
from renderer.microfacet import (
    Vector,
    distribution,
    draw_cosine,
    draw_visible_normal,
    fifth_power,
    fresnel,
    fresnel_pane,
    masking_term,
)
from renderer.records import (
    BASE_B,
    BASE_G,
    BASE_R,
    COAT,
    COAT_ROUGHNESS,
    COSINE,
    GLASS,
    IOR,
    METALLIC,
    ROUGHNESS,
    SHEEN,
    THIN,
    TRANSMISSION,
    Surfaces,
)

_ZERO, _ONE, _TWO, _HALF, _TINY = np.float32(0.0), np.float32(1.0), np.float32(2.0), np.float32(0.5), np.float32(1e-30)
_INVERSE_PI = np.float32(1.0 / np.pi)
_RED, _GREEN, _BLUE = np.float32(0.2126), np.float32(0.7152), np.float32(0.0722)
_MIN_ALPHA, _MIN_ROUGHNESS = np.float32(MIN_ALPHA), np.float32(np.sqrt(MIN_ALPHA))
_COAT_F0 = np.float32(0.04)
_MIN_ETA = np.float32(1.0005)
_GRAZING = np.float32(50.0)
_SCHLICK_MEAN = np.float32(1.0 / 21.0)
_LAST_CELL = np.float32(STEPS - 1)


class Closure(NamedTuple):
    """The model at one hit, seen from one direction: all that evaluation and sampling need, float32.

    wo_*: towards the viewer.  matt_*: diffuse base times the share that enters, shift_*: the same for multiple scattering in metal, both
    without the factor of the other direction.  f0_*, f90: specular reflectance at normal and grazing incidence, weighted by share.
    glass: weight of glass or pane.  by_*: probabilities of the lobes.
    """

    wo_x: np.float32
    wo_y: np.float32
    wo_z: np.float32
    alpha: np.float32
    coat_alpha: np.float32
    matt_r: np.float32
    matt_g: np.float32
    matt_b: np.float32
    matt_f0: np.float32
    matt_f90: np.float32
    shift_r: np.float32
    shift_g: np.float32
    shift_b: np.float32
    f0_r: np.float32
    f0_g: np.float32
    f0_b: np.float32
    f90: np.float32
    glass: np.float32
    tint_r: np.float32
    tint_g: np.float32
    tint_b: np.float32
    eta: np.float32
    thin: np.float32
    coat: np.float32
    sheen: np.float32
    row: np.float32
    by_matt: np.float32
    by_gloss: np.float32
    by_glass: np.float32
    by_coat: np.float32


@inlined
def look_up(table: NDArray[np.float32], row: np.float32, cosine: np.float32) -> tuple[np.float32, np.float32, np.float32]:
    """Return the albedo of microfacets at reflectance 1, Schlick's part of it and sheen's; ``row``: square root of alpha."""
    y, x = row * _LAST_CELL, np.sqrt(cosine if cosine > _ZERO else _ZERO) * _LAST_CELL
    i, j = min(int(y), STEPS - 2), min(int(x), STEPS - 2)
    v, u = y - np.float32(i), x - np.float32(j)
    a, b, c, d = (_ONE - v) * (_ONE - u), (_ONE - v) * u, v * (_ONE - u), v * u
    all_of_it = a * table[i, j, 0] + b * table[i, j + 1, 0] + c * table[i + 1, j, 0] + d * table[i + 1, j + 1, 0]
    fifth = a * table[i, j, 1] + b * table[i, j + 1, 1] + c * table[i + 1, j, 1] + d * table[i + 1, j + 1, 1]
    return all_of_it, fifth, (_ONE - u) * table[i, j, 2] + u * table[i, j + 1, 2]


@inlined
def _mean_albedo(table: NDArray[np.float32], row: np.float32) -> tuple[np.float32, np.float32]:
    """Return the hemisphere's means of the first two of :func:`look_up`."""
    y = row * _LAST_CELL
    i = min(int(y), STEPS - 2)
    v = y - np.float32(i)
    return (_ONE - v) * table[i, STEPS, 0] + v * table[i + 1, STEPS, 0], (_ONE - v) * table[i, STEPS, 1] + v * table[i + 1, STEPS, 1]


@kernel
def _glass_albedo(tables: NDArray[np.float32], index: int, inside: int, row: np.float32, cosine: np.float32) -> np.float32:
    y, x = row * _LAST_CELL, np.sqrt(cosine) * _LAST_CELL
    i, j = min(int(y), STEPS - 2), min(int(x), STEPS - 2)
    v, u = y - np.float32(i), x - np.float32(j)
    low = (_ONE - u) * tables[index, inside, i, j] + u * tables[index, inside, i, j + 1]
    high = (_ONE - u) * tables[index, inside, i + 1, j] + u * tables[index, inside, i + 1, j + 1]
    albedo: np.float32 = (_ONE - v) * low + v * high
    return albedo


@inlined
def luminance(r: np.float32, g: np.float32, b: np.float32) -> np.float32:
    """Return the luminance of linear RGB with Rec. 709 primaries."""
    return _RED * r + _GREEN * g + _BLUE * b


@inlined
def _multiple(color: np.float32, mean: np.float32) -> np.float32:
    """Return the reflectance of light scattered more than once by metal of this colour (Kulla and Conty 2017, with Schlick's mean)."""
    average = color + (_ONE - color) * _SCHLICK_MEAN
    return average * average * mean / (_ONE - average * (_ONE - mean))


@inlined
def make_closure(lanes: NDArray[np.float32], k: int, surfaces: Surfaces, wo_x: np.float32, wo_y: np.float32, wo_z: np.float32) -> Closure:
    """Return the model at the hit of lane k, seen from the unit direction wo."""
    r, g, b = lanes[BASE_R + k], lanes[BASE_G + k], lanes[BASE_B + k]
    row = max(lanes[ROUGHNESS + k], _MIN_ROUGHNESS)
    alpha, metal, ior, thin = max(row * row, _MIN_ALPHA), lanes[METALLIC + k], lanes[IOR + k], lanes[THIN + k]
    if ior <= _ONE and metal + thin + lanes[TRANSMISSION + k] + lanes[COAT + k] + lanes[SHEEN + k] == _ZERO:
        return _matt_closure(r, g, b, wo_x, wo_y, wo_z)
    through = (_ONE - metal) * lanes[TRANSMISSION + k]
    opaque = _ONE - metal - through
    base_f0 = (ior - _ONE) / (ior + _ONE)
    base_f0 *= base_f0
    base_f90 = min(_GRAZING * base_f0, _ONE)
    whole, fifth, sheen_albedo = look_up(surfaces.reflected, row, wo_z)
    mean, mean_fifth = _mean_albedo(surfaces.reflected, row)
    coat, sheen = lanes[COAT + k], lanes[SHEEN + k]
    coat_row, coat_albedo = _ONE, _ZERO
    if coat > _ZERO:
        coat_row = max(lanes[COAT_ROUGHNESS + k], _MIN_ROUGHNESS)
        coat_whole, coat_fifth, _ = look_up(surfaces.reflected, coat_row, wo_z)
        coat_albedo = coat * (_COAT_F0 * (coat_whole - coat_fifth) + coat_fifth)
    sheen *= _ONE - coat_albedo
    under = (_ONE - coat_albedo) * (_ONE - lanes[SHEEN + k] * sheen_albedo)
    enters = _ONE - (base_f0 * (whole - fifth) + base_f90 * fifth)
    enters_mean = _ONE - (base_f0 * (mean - mean_fifth) + base_f90 * mean_fifth)
    matt = under * opaque * enters / enters_mean
    shift = under * metal * (_ONE - whole) / max(_ONE - mean, _TINY)
    f0_r, f0_g, f0_b, f90 = opaque * base_f0, opaque * base_f0, opaque * base_f0, opaque * base_f90
    shift_r, shift_g, shift_b = _ZERO, _ZERO, _ZERO
    if metal > _ZERO:
        f0_r, f0_g, f0_b, f90 = f0_r + metal * r, f0_g + metal * g, f0_b + metal * b, f90 + metal
        shift_r, shift_g, shift_b = shift * _multiple(r, mean), shift * _multiple(g, mean), shift * _multiple(b, mean)
    glass, eta, tint_r, tint_g, tint_b = _ZERO, _ONE, _ZERO, _ZERO, _ZERO
    if thin > _ZERO:
        glass, eta = under, ior
        matt, f0_r, f0_g, f0_b, f90 = _ZERO, _ZERO, _ZERO, _ZERO, _ZERO
    elif through > _ZERO:
        inside = 0 if lanes[COSINE + k] > _ZERO else 1
        eta = max(ior, _MIN_ETA)
        eta = _ONE / eta if inside else eta
        glass = under * through / _glass_albedo(surfaces.glass, int(lanes[GLASS + k]), inside, row, wo_z)
        tint_r, tint_g, tint_b = np.sqrt(r), np.sqrt(g), np.sqrt(b)
    gloss_r, gloss_g, gloss_b, grazing = under * f0_r, under * f0_g, under * f0_b, under * f90
    by_matt = luminance(r, g, b) * matt * enters_mean + luminance(shift_r, shift_g, shift_b) * (_ONE - mean) + sheen * sheen_albedo
    by_gloss = luminance(gloss_r, gloss_g, gloss_b) * (whole - fifth) + grazing * fifth
    by_glass = under * fresnel_pane(wo_z, ior) if thin > _ZERO else under * through
    scale = _ONE / max(by_matt + by_gloss + by_glass + coat_albedo, _TINY)
    return Closure(
        wo_x,
        wo_y,
        wo_z,
        alpha,
        coat_row * coat_row,
        matt * r,
        matt * g,
        matt * b,
        base_f0,
        base_f90,
        shift_r,
        shift_g,
        shift_b,
        gloss_r,
        gloss_g,
        gloss_b,
        grazing,
        glass,
        tint_r,
        tint_g,
        tint_b,
        eta,
        thin,
        coat,
        sheen,
        row,
        by_matt * scale,
        by_gloss * scale,
        by_glass * scale,
        coat_albedo * scale,
    )


@inlined
def _matt_closure(r: np.float32, g: np.float32, b: np.float32, wo_x: np.float32, wo_y: np.float32, wo_z: np.float32) -> Closure:
    """Return Lambert's model, which needs no albedos: an index of 1 reflects nothing above the base."""
    by_matt = _ONE if luminance(r, g, b) > _ZERO else _ZERO
    return Closure(
        wo_x,
        wo_y,
        wo_z,
        _ONE,
        _ONE,
        r,
        g,
        b,
        _ZERO,
        _ZERO,
        _ZERO,
        _ZERO,
        _ZERO,
        _ZERO,
        _ZERO,
        _ZERO,
        _ZERO,
        _ZERO,
        _ZERO,
        _ZERO,
        _ZERO,
        _ONE,
        _ZERO,
        _ZERO,
        _ZERO,
        _ONE,
        by_matt,
        _ZERO,
        _ZERO,
        _ZERO,
    )


Scattered = tuple[np.float32, np.float32, np.float32, np.float32]
"""RGB of the scattering function times the cosine at the light, and the density of drawing its direction per steradian."""


@inlined
def evaluate(closure: Closure, surfaces: Surfaces, x: np.float32, y: np.float32, z: np.float32) -> Scattered:
    """Return what light from the unit direction (x, y, z) adds towards the viewer, and the density of :func:`draw_direction` there."""
    if z > _ZERO:
        return _reflect(closure, surfaces, x, y, z)
    if z < _ZERO and closure.glass > _ZERO and closure.thin == _ZERO:
        return _refract(closure, x, y, z)
    return _ZERO, _ZERO, _ZERO, _ZERO


@inlined
def _reflect(c: Closure, surfaces: Surfaces, x: np.float32, y: np.float32, z: np.float32) -> Scattered:
    if c.by_matt == _ONE and c.matt_f90 + c.sheen == _ZERO:
        flat = z * _INVERSE_PI
        return flat * c.matt_r, flat * c.matt_g, flat * c.matt_b, flat
    hx, hy, hz = c.wo_x + x, c.wo_y + y, c.wo_z + z
    scale = _ONE / np.sqrt(hx * hx + hy * hy + hz * hz)
    hx, hy, hz = hx * scale, hy * scale, hz * scale
    across = c.wo_x * hx + c.wo_y * hy + c.wo_z * hz
    fifth = fifth_power(across)
    r, g, b, density = _ZERO, _ZERO, _ZERO, _ZERO
    if c.by_matt > _ZERO:
        whole, part, _ = look_up(surfaces.reflected, c.row, z)
        enters = _ONE - (c.matt_f0 * (whole - part) + c.matt_f90 * part)
        lost, sheen, flat = _ONE - whole, c.sheen * fifth * z, z * _INVERSE_PI
        r = flat * (c.matt_r * enters + c.shift_r * lost) + sheen
        g = flat * (c.matt_g * enters + c.shift_g * lost) + sheen
        b = flat * (c.matt_b * enters + c.shift_b * lost) + sheen
        density = c.by_matt * flat
    if c.by_gloss + c.by_glass > _ZERO:
        term, facets = masking_term(c.wo_z, c.alpha), distribution(hx, hy, hz, c.alpha)
        gain = _HALF * facets * z / (z * term + c.wo_z * masking_term(z, c.alpha))
        chance = _HALF * facets / (c.wo_z + term)
        share, glass = _ONE, _ZERO
        if c.glass > _ZERO:
            share = fresnel_pane(across, c.eta) if c.thin > _ZERO else fresnel(across, c.eta)
            glass = c.glass * share
            share = _ONE if c.thin > _ZERO else share
        r += gain * (c.f0_r + (c.f90 - c.f0_r) * fifth + glass)
        g += gain * (c.f0_g + (c.f90 - c.f0_g) * fifth + glass)
        b += gain * (c.f0_b + (c.f90 - c.f0_b) * fifth + glass)
        density += chance * (c.by_gloss + c.by_glass * share)
    if c.by_coat > _ZERO:
        term, facets = masking_term(c.wo_z, c.coat_alpha), distribution(hx, hy, hz, c.coat_alpha)
        gain = c.coat * (_COAT_F0 + (_ONE - _COAT_F0) * fifth) * _HALF * facets * z / (z * term + c.wo_z * masking_term(z, c.coat_alpha))
        r, g, b, density = r + gain, g + gain, b + gain, density + c.by_coat * _HALF * facets / (c.wo_z + term)
    return r, g, b, density


@kernel
def _refract(c: Closure, x: np.float32, y: np.float32, z: np.float32) -> Scattered:
    """The same for light from below: Walter et al., "Microfacet Models for Refraction through Rough Surfaces" (2007)."""
    hx, hy, hz = c.wo_x + c.eta * x, c.wo_y + c.eta * y, c.wo_z + c.eta * z
    scale = _ONE / max(np.sqrt(hx * hx + hy * hy + hz * hz), _TINY)
    scale = -scale if hz < _ZERO else scale
    hx, hy, hz = hx * scale, hy * scale, hz * scale
    before, beyond = c.wo_x * hx + c.wo_y * hy + c.wo_z * hz, x * hx + y * hy + z * hz
    if before <= _ZERO or beyond >= _ZERO:
        return _ZERO, _ZERO, _ZERO, _ZERO
    whole = before + c.eta * beyond
    visible = _ONE / (c.wo_z + masking_term(c.wo_z, c.alpha))
    spread = c.eta * c.eta * -beyond * before / max(whole * whole, _TINY)
    density = _TWO * visible * distribution(hx, hy, hz, c.alpha) * spread * (_ONE - fresnel(before, c.eta))
    masked = c.glass * density * _TWO * -z / (masking_term(z, c.alpha) - z)
    return masked * c.tint_r, masked * c.tint_g, masked * c.tint_b, density * c.by_glass


@inlined
def draw_direction(c: Closure, lobe: np.float32, u: np.float32, v: np.float32) -> Vector:
    """Return a direction drawn from the model's lobes by three random numbers in [0, 1); z = 0 where the draw fails."""
    if lobe < c.by_matt:
        return draw_cosine(u, v)
    lobe -= c.by_matt
    alpha = c.coat_alpha if lobe >= c.by_gloss + c.by_glass else c.alpha
    hx, hy, hz = draw_visible_normal(c.wo_x, c.wo_y, c.wo_z, alpha, u, v)
    across = c.wo_x * hx + c.wo_y * hy + c.wo_z * hz
    lobe -= c.by_gloss
    if _ZERO <= lobe < c.by_glass and c.thin == _ZERO and lobe >= c.by_glass * fresnel(across, c.eta):
        inverse = _ONE / c.eta
        beyond = np.sqrt(max(_ONE - (_ONE - across * across) * inverse * inverse, _ZERO))
        lift = across * inverse - beyond
        x, y, z = hx * lift - c.wo_x * inverse, hy * lift - c.wo_y * inverse, hz * lift - c.wo_z * inverse
        return x, y, z if z < _ZERO else _ZERO
    x, y, z = _TWO * across * hx - c.wo_x, _TWO * across * hy - c.wo_y, _TWO * across * hz - c.wo_z
    return x, y, z if z > _ZERO else _ZERO
