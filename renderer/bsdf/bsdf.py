"""What surfaces do with light from each direction, and how directions are drawn, 16 hits at a time.

Thin panes reflect; what they let through leaves the scene, and the light that enters by them counts as sent by them.  Refraction does not
scale luminance by the square of the index: the factors cancel for lights and cameras in air.

All directions are in the local frame of :mod:`renderer.bsdf.microfacet`; the viewer is above, WO_Z > 0.  The model's numbers are those of
:mod:`renderer.bsdf.closure`.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from renderer.bsdf.closure import ANY_COAT, ANY_GLASS, ANY_GLOSS, COAT_F0, look_up
from renderer.bsdf.microfacet import distribution, draw_visible_normal, fifth_power, fresnel, fresnel_pane, masking_term
from renderer.core.embree import LANES
from renderer.core.kernel import inlined, kernel
from renderer.core.lanes import (
    ALPHA,
    BASE_B,
    BASE_G,
    BASE_R,
    BY_COAT,
    BY_GLASS,
    BY_GLOSS,
    BY_MATT,
    CLEAR,
    COAT,
    COAT_ALPHA,
    DENSITY,
    DRAW_LOBE,
    DRAW_WAY_U,
    DRAW_WAY_V,
    ETA,
    GLOSS_B,
    GLOSS_G,
    GLOSS_R,
    GLOSSY,
    GRAZING,
    MATT_B,
    MATT_F0,
    MATT_F90,
    MATT_G,
    MATT_R,
    OUT_B,
    OUT_G,
    OUT_R,
    SHIFT_B,
    SHIFT_G,
    SHIFT_R,
    SHINE,
    THERE_FIFTH,
    THERE_WHOLE,
    THIN,
    WAY_X,
    WAY_Y,
    WAY_Z,
    WO_X,
    WO_Y,
    WO_Z,
    lane_count,
)
from renderer.core.sampling import draw_cosine

_ZERO, _ONE, _TWO, _HALF, _TINY = np.float32(0.0), np.float32(1.0), np.float32(2.0), np.float32(0.5), np.float32(1e-30)
_INVERSE_PI = np.float32(1.0 / np.pi)


@kernel
def evaluate(lanes: NDArray[np.float32], kinds: int, reflected: NDArray[np.float32]) -> None:
    """Fill OUT and DENSITY: what light from WAY adds towards the viewer, and the density of :func:`draw_directions` there.

    ``reflected``: albedo table of microfacets (:mod:`renderer.bsdf.albedo`).
    """
    if kinds & ANY_GLOSS:
        _look_up_there(lanes, reflected)
        _add_matt(lanes)
        _add_gloss(lanes)
        if kinds & ANY_COAT:
            _add_coat(lanes)
        if kinds & ANY_GLASS:
            for k in range(LANES):
                if lanes[BY_GLASS + k] > _ZERO:
                    _add_glass(lanes, k)
        return
    for k in range(lane_count(lanes)):
        z = lanes[WAY_Z + k]
        flat = (z if z > _ZERO else _ZERO) * _INVERSE_PI
        lanes[OUT_R + k], lanes[OUT_G + k], lanes[OUT_B + k] = flat * lanes[MATT_R + k], flat * lanes[MATT_G + k], flat * lanes[MATT_B + k]
        lanes[DENSITY + k] = lanes[BY_MATT + k] * flat


@kernel
def _look_up_there(lanes: NDArray[np.float32], reflected: NDArray[np.float32]) -> None:
    for k in range(LANES):
        lanes[THERE_WHOLE + k] = lanes[THERE_FIFTH + k] = _ZERO
        if lanes[GLOSSY + k] * lanes[BY_MATT + k] > _ZERO and lanes[WAY_Z + k] > _ZERO:
            row = np.sqrt(lanes[ALPHA + k])
            lanes[THERE_WHOLE + k], lanes[THERE_FIFTH + k] = look_up(reflected, row, lanes[WAY_Z + k])


@kernel
def _add_matt(lanes: NDArray[np.float32]) -> None:
    """Begin OUT and DENSITY with the diffuse base, and the multiple scattering of metal."""
    for k in range(LANES):
        z = lanes[WAY_Z + k]
        flat = (z if z > _ZERO else _ZERO) * _INVERSE_PI
        whole, fifth = lanes[THERE_WHOLE + k], lanes[THERE_FIFTH + k]
        enters = flat * (_ONE - (lanes[MATT_F0 + k] * (whole - fifth) + lanes[MATT_F90 + k] * fifth))
        lost = flat * (_ONE - whole)
        lanes[OUT_R + k] = lanes[MATT_R + k] * enters + lanes[SHIFT_R + k] * lost
        lanes[OUT_G + k] = lanes[MATT_G + k] * enters + lanes[SHIFT_G + k] * lost
        lanes[OUT_B + k] = lanes[MATT_B + k] * enters + lanes[SHIFT_B + k] * lost
        lanes[DENSITY + k] = lanes[BY_MATT + k] * flat


@inlined
def _half_vector(lanes: NDArray[np.float32], k: int) -> tuple[np.float32, np.float32, np.float32, np.float32]:
    """Return the unit vector between viewer and light, and its cosine to either."""
    hx, hy, hz = lanes[WO_X + k] + lanes[WAY_X + k], lanes[WO_Y + k] + lanes[WAY_Y + k], lanes[WO_Z + k] + lanes[WAY_Z + k]
    scale = _ONE / np.sqrt(hx * hx + hy * hy + hz * hz)
    hx, hy, hz = hx * scale, hy * scale, hz * scale
    return hx, hy, hz, lanes[WO_X + k] * hx + lanes[WO_Y + k] * hy + lanes[WO_Z + k] * hz


@inlined
def _facets(
    lanes: NDArray[np.float32], k: int, alpha: np.float32, hx: np.float32, hy: np.float32, hz: np.float32
) -> tuple[np.float32, np.float32]:
    """Return what microfacets that reflect all scatter, times the cosine at the light, and the density of drawing it."""
    z, wo_z = lanes[WAY_Z + k], lanes[WO_Z + k]
    term, facets = masking_term(wo_z, alpha), _HALF * distribution(hx, hy, hz, alpha)
    return facets * z / (z * term + wo_z * masking_term(z, alpha)), facets / (wo_z + term)


@kernel
def _add_gloss(lanes: NDArray[np.float32]) -> None:
    """Add the microfacets of metal and opaque dielectrics, and sheen."""
    for k in range(LANES):
        hx, hy, hz, across = _half_vector(lanes, k)
        fifth = fifth_power(across)
        gain, chance = _facets(lanes, k, lanes[ALPHA + k], hx, hy, hz)
        r, g, b, f90 = lanes[GLOSS_R + k], lanes[GLOSS_G + k], lanes[GLOSS_B + k], lanes[GRAZING + k]
        sheen = lanes[SHINE + k] * fifth * lanes[WAY_Z + k]
        r, g, b = gain * (r + (f90 - r) * fifth) + sheen, gain * (g + (f90 - g) * fifth) + sheen, gain * (b + (f90 - b) * fifth) + sheen
        chance *= lanes[BY_GLOSS + k]
        shines = (lanes[WAY_Z + k] > _ZERO) & (lanes[GLOSSY + k] > _ZERO)
        lanes[OUT_R + k] += r if shines else _ZERO
        lanes[OUT_G + k] += g if shines else _ZERO
        lanes[OUT_B + k] += b if shines else _ZERO
        lanes[DENSITY + k] += chance if shines else _ZERO


@kernel
def _add_coat(lanes: NDArray[np.float32]) -> None:
    """Add the clear coat."""
    for k in range(LANES):
        hx, hy, hz, across = _half_vector(lanes, k)
        gain, chance = _facets(lanes, k, lanes[COAT_ALPHA + k], hx, hy, hz)
        gain *= lanes[COAT + k] * (COAT_F0 + (_ONE - COAT_F0) * fifth_power(across))
        chance *= lanes[BY_COAT + k]
        shines = (lanes[WAY_Z + k] > _ZERO) & (lanes[BY_COAT + k] > _ZERO)
        gain, chance = gain if shines else _ZERO, chance if shines else _ZERO
        lanes[OUT_R + k] += gain
        lanes[OUT_G + k] += gain
        lanes[OUT_B + k] += gain
        lanes[DENSITY + k] += chance


@kernel
def _add_glass(lanes: NDArray[np.float32], k: int) -> None:
    """Add what glass or a pane reflects or, from below, lets through."""
    if lanes[WAY_Z + k] > _ZERO:
        hx, hy, hz, across = _half_vector(lanes, k)
        gain, chance = _facets(lanes, k, lanes[ALPHA + k], hx, hy, hz)
        thin = lanes[THIN + k] > _ZERO
        share = fresnel_pane(across, lanes[ETA + k]) if thin else fresnel(across, lanes[ETA + k])
        gain *= lanes[CLEAR + k] * share
        for channel in range(0, 3 * LANES, LANES):
            lanes[OUT_R + channel + k] += gain
        lanes[DENSITY + k] += chance * lanes[BY_GLASS + k] * (_ONE if thin else share)
    elif lanes[WAY_Z + k] < _ZERO and lanes[THIN + k] == _ZERO:
        _refract(lanes, k)


@kernel
def _refract(lanes: NDArray[np.float32], k: int) -> None:
    """Set OUT and DENSITY for light from below: Walter et al., "Microfacet Models for Refraction through Rough Surfaces" (2007)."""
    x, y, z, wo_x, wo_y, wo_z = lanes[WAY_X + k], lanes[WAY_Y + k], lanes[WAY_Z + k], lanes[WO_X + k], lanes[WO_Y + k], lanes[WO_Z + k]
    eta, alpha = lanes[ETA + k], lanes[ALPHA + k]
    hx, hy, hz = wo_x + eta * x, wo_y + eta * y, wo_z + eta * z
    scale = _ONE / max(np.sqrt(hx * hx + hy * hy + hz * hz), _TINY)
    scale = -scale if hz < _ZERO else scale
    hx, hy, hz = hx * scale, hy * scale, hz * scale
    before, beyond = wo_x * hx + wo_y * hy + wo_z * hz, x * hx + y * hy + z * hz
    if before <= _ZERO or beyond >= _ZERO:
        return
    whole = before + eta * beyond
    visible = _ONE / (wo_z + masking_term(wo_z, alpha))
    spread = eta * eta * -beyond * before / max(whole * whole, _TINY)
    density = _TWO * visible * distribution(hx, hy, hz, alpha) * spread * (_ONE - fresnel(before, eta))
    masked = lanes[CLEAR + k] * density * _TWO * -z / (masking_term(z, alpha) - z)
    # The colour acts by its square root, as light passes two boundaries of a thing.
    lanes[OUT_R + k], lanes[OUT_G + k] = masked * np.sqrt(lanes[BASE_R + k]), masked * np.sqrt(lanes[BASE_G + k])
    lanes[OUT_B + k] = masked * np.sqrt(lanes[BASE_B + k])
    lanes[DENSITY + k] = density * lanes[BY_GLASS + k]


@kernel
def draw_directions(lanes: NDArray[np.float32], kinds: int) -> None:
    """Fill WAY with directions drawn from the lobes by DRAW_LOBE and DRAW_WAY; z = 0 where the draw fails."""
    if kinds & ANY_GLOSS:
        _draw_reflected(lanes)
    else:
        for k in range(lane_count(lanes)):
            lanes[WAY_X + k], lanes[WAY_Y + k], lanes[WAY_Z + k] = draw_cosine(lanes[DRAW_WAY_U + k], lanes[DRAW_WAY_V + k])
    if kinds & ANY_GLASS:
        for k in range(LANES):
            lobe = lanes[DRAW_LOBE + k] - lanes[BY_MATT + k] - lanes[BY_GLOSS + k]
            if _ZERO <= lobe < lanes[BY_GLASS + k] and lanes[THIN + k] == _ZERO:
                _draw_refracted(lanes, k, lobe)


@kernel
def _draw_reflected(lanes: NDArray[np.float32]) -> None:
    """Fill WAY with directions that stay on the viewer's side."""
    for k in range(LANES):
        matt_x, matt_y, matt_z = draw_cosine(lanes[DRAW_WAY_U + k], lanes[DRAW_WAY_V + k])
        lobe = lanes[DRAW_LOBE + k] - lanes[BY_MATT + k]
        base_alpha, coat_alpha = lanes[ALPHA + k], lanes[COAT_ALPHA + k]
        alpha = coat_alpha if lobe >= lanes[BY_GLOSS + k] + lanes[BY_GLASS + k] else base_alpha
        wo_x, wo_y, wo_z = lanes[WO_X + k], lanes[WO_Y + k], lanes[WO_Z + k]
        hx, hy, hz = draw_visible_normal(wo_x, wo_y, wo_z, alpha, lanes[DRAW_WAY_U + k], lanes[DRAW_WAY_V + k])
        twice = _TWO * (wo_x * hx + wo_y * hy + wo_z * hz)
        x, y, z = twice * hx - wo_x, twice * hy - wo_y, twice * hz - wo_z
        z = z if z > _ZERO else _ZERO
        glossy = lobe >= _ZERO
        lanes[WAY_X + k] = x if glossy else matt_x
        lanes[WAY_Y + k] = y if glossy else matt_y
        lanes[WAY_Z + k] = z if glossy else matt_z


@kernel
def _draw_refracted(lanes: NDArray[np.float32], k: int, lobe: np.float32) -> None:
    """Replace the direction of a lane that glass lets through; ``lobe`` in [0, BY_GLASS)."""
    wo_x, wo_y, wo_z, eta = lanes[WO_X + k], lanes[WO_Y + k], lanes[WO_Z + k], lanes[ETA + k]
    hx, hy, hz = draw_visible_normal(wo_x, wo_y, wo_z, lanes[ALPHA + k], lanes[DRAW_WAY_U + k], lanes[DRAW_WAY_V + k])
    across = wo_x * hx + wo_y * hy + wo_z * hz
    if lobe < lanes[BY_GLASS + k] * fresnel(across, eta):
        return
    inverse = _ONE / eta
    beyond = np.sqrt(max(_ONE - (_ONE - across * across) * inverse * inverse, _ZERO))
    lift = across * inverse - beyond
    x, y, z = hx * lift - wo_x * inverse, hy * lift - wo_y * inverse, hz * lift - wo_z * inverse
    lanes[WAY_X + k], lanes[WAY_Y + k], lanes[WAY_Z + k] = x, y, z if z < _ZERO else _ZERO
