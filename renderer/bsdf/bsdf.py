"""The BSDF: its value for pairs of directions, its sampling and their pdf, 16 hits at a time.

Thin panes reflect, and let light go straight through where something stands behind them; the sky that shows through them counts as sent by
them.  Refraction does not scale luminance by the square of the index: the factors cancel for lights and cameras in air.

All directions are in the local frame of :mod:`renderer.bsdf.microfacet`; the viewer is above, WO_Z > 0.  The lobes and their weights are
those of :mod:`renderer.bsdf.layers`.
"""

import numpy as np
from numpy.typing import NDArray

from renderer.bsdf.layers import ANY_COAT, ANY_GLASS, ANY_GLOSSY, COAT_F0, look_up_albedo
from renderer.bsdf.microfacet import (
    fresnel_dielectric,
    fresnel_thin_dielectric,
    ggx_d,
    ggx_g1_root,
    sample_ggx_wm,
    schlick_albedo,
    schlick_weight,
)
from renderer.core import lanes as ln
from renderer.core.kernel import inlined, kernel
from renderer.core.lanes import lane_count
from renderer.core.ray_packet import LANES
from renderer.core.sampling import sample_cosine_hemisphere

_ZERO, _ONE, _TWO, _HALF, _TINY = np.float32(0.0), np.float32(1.0), np.float32(2.0), np.float32(0.5), np.float32(1e-30)
_INVERSE_PI = np.float32(1.0 / np.pi)
_STRAIGHT = np.float32(1e8)
"""Density per steradian that stands for that of a single direction."""


@kernel
def evaluate_bsdf(lanes: NDArray[np.float32], kinds: int, reflected: NDArray[np.float32]) -> None:
    """Fill F_COS and PDF: the BSDF for WO and WI times the cosine of WI, and the pdf with which :func:`sample_bsdf` gives WI.

    ``reflected``: albedo table of microfacets (:mod:`renderer.bsdf.albedo`).
    """
    if kinds & ANY_GLOSSY:
        _look_up_e_wi(lanes, reflected)
        _add_diffuse(lanes)
        _add_specular(lanes)
        if kinds & ANY_COAT:
            _add_coat(lanes)
        if kinds & ANY_GLASS:
            for k in range(LANES):
                if lanes[ln.PR_GLASS + k] + lanes[ln.PR_PASS + k] > _ZERO:
                    _add_glass(lanes, k)
        return
    for k in range(lane_count(lanes)):
        z = lanes[ln.WI_Z + k]
        cos_over_pi = (z if z > _ZERO else _ZERO) * _INVERSE_PI
        lanes[ln.F_COS_R + k] = cos_over_pi * lanes[ln.DIFFUSE_R + k]
        lanes[ln.F_COS_G + k] = cos_over_pi * lanes[ln.DIFFUSE_G + k]
        lanes[ln.F_COS_B + k] = cos_over_pi * lanes[ln.DIFFUSE_B + k]
        lanes[ln.PDF + k] = lanes[ln.PR_DIFFUSE + k] * cos_over_pi


@kernel
def _look_up_e_wi(lanes: NDArray[np.float32], reflected: NDArray[np.float32]) -> None:
    """Fill E_WI of the lanes whose diffuse base or metal needs it."""
    for k in range(LANES):
        lanes[ln.E_WI + k] = lanes[ln.E_WI_SCHLICK + k] = _ZERO
        if lanes[ln.GLOSSY + k] * lanes[ln.PR_DIFFUSE + k] > _ZERO and lanes[ln.WI_Z + k] > _ZERO:
            row = np.sqrt(lanes[ln.ALPHA + k])
            lanes[ln.E_WI + k], lanes[ln.E_WI_SCHLICK + k] = look_up_albedo(reflected, row, lanes[ln.WI_Z + k])


@kernel
def _add_diffuse(lanes: NDArray[np.float32]) -> None:
    """Begin F_COS and PDF with the diffuse base, and the multiple scattering of metal."""
    for k in range(LANES):
        z = lanes[ln.WI_Z + k]
        cos_over_pi = (z if z > _ZERO else _ZERO) * _INVERSE_PI
        e_wi, e_schlick = lanes[ln.E_WI + k], lanes[ln.E_WI_SCHLICK + k]
        enters = cos_over_pi * (_ONE - schlick_albedo(lanes[ln.BASE_F0 + k], lanes[ln.BASE_F90 + k], e_wi, e_schlick))
        lost = cos_over_pi * (_ONE - e_wi)
        lanes[ln.F_COS_R + k] = lanes[ln.DIFFUSE_R + k] * enters + lanes[ln.MULTISCATTER_R + k] * lost
        lanes[ln.F_COS_G + k] = lanes[ln.DIFFUSE_G + k] * enters + lanes[ln.MULTISCATTER_G + k] * lost
        lanes[ln.F_COS_B + k] = lanes[ln.DIFFUSE_B + k] * enters + lanes[ln.MULTISCATTER_B + k] * lost
        lanes[ln.PDF + k] = lanes[ln.PR_DIFFUSE + k] * cos_over_pi


@inlined
def _half_vector(lanes: NDArray[np.float32], k: int) -> tuple[np.float32, np.float32, np.float32, np.float32]:
    """Return wm, the unit vector half-way of wo and wi, and its cosine to either."""
    wo_x, wo_y, wo_z = lanes[ln.WO_X + k], lanes[ln.WO_Y + k], lanes[ln.WO_Z + k]
    x, y, z = wo_x + lanes[ln.WI_X + k], wo_y + lanes[ln.WI_Y + k], wo_z + lanes[ln.WI_Z + k]
    scale = _ONE / np.sqrt(x * x + y * y + z * z)
    wm_x, wm_y, wm_z = x * scale, y * scale, z * scale
    return wm_x, wm_y, wm_z, wo_x * wm_x + wo_y * wm_y + wo_z * wm_z


@inlined
def _reflect_ggx(
    lanes: NDArray[np.float32], k: int, alpha: np.float32, wm_x: np.float32, wm_y: np.float32, wm_z: np.float32
) -> tuple[np.float32, np.float32]:
    """Return f_cos of GGX microfacets that reflect all light, and the pdf of sampling their reflection."""
    z, wo_z = lanes[ln.WI_Z + k], lanes[ln.WO_Z + k]
    term, facets = ggx_g1_root(wo_z, alpha), _HALF * ggx_d(wm_x, wm_y, wm_z, alpha)
    return facets * z / (z * term + wo_z * ggx_g1_root(z, alpha)), facets / (wo_z + term)


@kernel
def _add_specular(lanes: NDArray[np.float32]) -> None:
    """Add the microfacets of metal and opaque dielectrics, and sheen."""
    for k in range(LANES):
        wm_x, wm_y, wm_z, wo_dot_wm = _half_vector(lanes, k)
        schlick = schlick_weight(wo_dot_wm)
        f_cos, pdf = _reflect_ggx(lanes, k, lanes[ln.ALPHA + k], wm_x, wm_y, wm_z)
        r, g, b, f90 = lanes[ln.SPECULAR_R + k], lanes[ln.SPECULAR_G + k], lanes[ln.SPECULAR_B + k], lanes[ln.SPECULAR_F90 + k]
        sheen = lanes[ln.SHEEN_WEIGHT + k] * schlick * lanes[ln.WI_Z + k]
        r = f_cos * (r + (f90 - r) * schlick) + sheen
        g = f_cos * (g + (f90 - g) * schlick) + sheen
        b = f_cos * (b + (f90 - b) * schlick) + sheen
        pdf *= lanes[ln.PR_SPECULAR + k]
        reflects = (lanes[ln.WI_Z + k] > _ZERO) & (lanes[ln.GLOSSY + k] > _ZERO)
        lanes[ln.F_COS_R + k] += r if reflects else _ZERO
        lanes[ln.F_COS_G + k] += g if reflects else _ZERO
        lanes[ln.F_COS_B + k] += b if reflects else _ZERO
        lanes[ln.PDF + k] += pdf if reflects else _ZERO


@kernel
def _add_coat(lanes: NDArray[np.float32]) -> None:
    """Add the clear coat."""
    for k in range(LANES):
        wm_x, wm_y, wm_z, wo_dot_wm = _half_vector(lanes, k)
        f_cos, pdf = _reflect_ggx(lanes, k, lanes[ln.COAT_ALPHA + k], wm_x, wm_y, wm_z)
        f_cos *= lanes[ln.COAT + k] * (COAT_F0 + (_ONE - COAT_F0) * schlick_weight(wo_dot_wm))
        pdf *= lanes[ln.PR_COAT + k]
        reflects = (lanes[ln.WI_Z + k] > _ZERO) & (lanes[ln.PR_COAT + k] > _ZERO)
        f_cos, pdf = f_cos if reflects else _ZERO, pdf if reflects else _ZERO
        lanes[ln.F_COS_R + k] += f_cos
        lanes[ln.F_COS_G + k] += f_cos
        lanes[ln.F_COS_B + k] += f_cos
        lanes[ln.PDF + k] += pdf


@kernel
def _add_glass(lanes: NDArray[np.float32], k: int) -> None:
    """Add what glass or a pane reflects or, for light from below, lets through."""
    if lanes[ln.WI_Z + k] > _ZERO:
        wm_x, wm_y, wm_z, wo_dot_wm = _half_vector(lanes, k)
        f_cos, pdf = _reflect_ggx(lanes, k, lanes[ln.ALPHA + k], wm_x, wm_y, wm_z)
        thin = lanes[ln.THIN + k] > _ZERO
        share = fresnel_thin_dielectric(wo_dot_wm, lanes[ln.ETA + k]) if thin else fresnel_dielectric(wo_dot_wm, lanes[ln.ETA + k])
        f_cos *= lanes[ln.GLASS_WEIGHT + k] * share
        for channel in range(0, 3 * LANES, LANES):
            lanes[ln.F_COS_R + channel + k] += f_cos
        lanes[ln.PDF + k] += pdf * lanes[ln.PR_GLASS + k] * (_ONE if thin else share)
    elif lanes[ln.WI_Z + k] < _ZERO:
        if lanes[ln.THIN + k] == _ZERO:
            _refract(lanes, k)
        else:
            for channel in range(0, 3 * LANES, LANES):
                lanes[ln.F_COS_R + channel + k] = _STRAIGHT * lanes[ln.PASS_WEIGHT + k]
            lanes[ln.PDF + k] = _STRAIGHT * lanes[ln.PR_PASS + k]


@kernel
def _refract(lanes: NDArray[np.float32], k: int) -> None:
    """Set F_COS and PDF for light from below: Walter et al., "Microfacet Models for Refraction through Rough Surfaces" (2007)."""
    x, y, z = lanes[ln.WI_X + k], lanes[ln.WI_Y + k], lanes[ln.WI_Z + k]
    wo_x, wo_y, wo_z = lanes[ln.WO_X + k], lanes[ln.WO_Y + k], lanes[ln.WO_Z + k]
    eta, alpha = lanes[ln.ETA + k], lanes[ln.ALPHA + k]
    wm_x, wm_y, wm_z = wo_x + eta * x, wo_y + eta * y, wo_z + eta * z
    scale = _ONE / max(np.sqrt(wm_x * wm_x + wm_y * wm_y + wm_z * wm_z), _TINY)
    scale = -scale if wm_z < _ZERO else scale
    wm_x, wm_y, wm_z = wm_x * scale, wm_y * scale, wm_z * scale
    # wm is the normal that refracts wo to wi; none does if they lie on one side of it.
    wo_dot_wm, wi_dot_wm = wo_x * wm_x + wo_y * wm_y + wo_z * wm_z, x * wm_x + y * wm_y + z * wm_z
    if wo_dot_wm <= _ZERO or wi_dot_wm >= _ZERO:
        return
    # The density of wm that are visible from wo, times that of wi per wm.
    sum_ = wo_dot_wm + eta * wi_dot_wm
    visible = _ONE / (wo_z + ggx_g1_root(wo_z, alpha))
    jacobian = eta * eta * -wi_dot_wm * wo_dot_wm / max(sum_ * sum_, _TINY)
    pdf = _TWO * visible * ggx_d(wm_x, wm_y, wm_z, alpha) * jacobian * (_ONE - fresnel_dielectric(wo_dot_wm, eta))
    masked = lanes[ln.GLASS_WEIGHT + k] * pdf * _TWO * -z / (ggx_g1_root(z, alpha) - z)
    # The colour acts by its square root, as light passes two boundaries of a thing.
    lanes[ln.F_COS_R + k] = masked * np.sqrt(lanes[ln.BASE_R + k])
    lanes[ln.F_COS_G + k] = masked * np.sqrt(lanes[ln.BASE_G + k])
    lanes[ln.F_COS_B + k] = masked * np.sqrt(lanes[ln.BASE_B + k])
    lanes[ln.PDF + k] = pdf * lanes[ln.PR_GLASS + k]


@kernel
def sample_bsdf(lanes: NDArray[np.float32], kinds: int) -> None:
    """Fill WI with directions sampled from the lobes by U_LOBE and U_BSDF; z = 0 where sampling fails."""
    if kinds & ANY_GLOSSY:
        _sample_reflection(lanes)
    else:
        for k in range(lane_count(lanes)):
            x, y, z = sample_cosine_hemisphere(lanes[ln.U_BSDF_0 + k], lanes[ln.U_BSDF_1 + k])
            lanes[ln.WI_X + k], lanes[ln.WI_Y + k], lanes[ln.WI_Z + k] = x, y, z
    if kinds & ANY_GLASS:
        for k in range(LANES):
            lobe = lanes[ln.U_LOBE + k] - lanes[ln.PR_DIFFUSE + k] - lanes[ln.PR_SPECULAR + k]
            if _ZERO <= lobe < lanes[ln.PR_GLASS + k] and lanes[ln.THIN + k] == _ZERO:
                _sample_refraction(lanes, k, lobe)
            elif _ZERO <= lobe - lanes[ln.PR_GLASS + k] < lanes[ln.PR_PASS + k]:
                wo_x, wo_y, wo_z = lanes[ln.WO_X + k], lanes[ln.WO_Y + k], lanes[ln.WO_Z + k]
                lanes[ln.WI_X + k], lanes[ln.WI_Y + k], lanes[ln.WI_Z + k] = -wo_x, -wo_y, -wo_z


@kernel
def _sample_reflection(lanes: NDArray[np.float32]) -> None:
    """Fill WI with directions on the viewer's side."""
    for k in range(LANES):
        # Both kinds of lobe are sampled, so that the loop has no branches.
        diffuse_x, diffuse_y, diffuse_z = sample_cosine_hemisphere(lanes[ln.U_BSDF_0 + k], lanes[ln.U_BSDF_1 + k])
        lobe = lanes[ln.U_LOBE + k] - lanes[ln.PR_DIFFUSE + k]
        base_alpha, coat_alpha = lanes[ln.ALPHA + k], lanes[ln.COAT_ALPHA + k]
        alpha = coat_alpha if lobe >= lanes[ln.PR_SPECULAR + k] + lanes[ln.PR_GLASS + k] else base_alpha
        wo_x, wo_y, wo_z = lanes[ln.WO_X + k], lanes[ln.WO_Y + k], lanes[ln.WO_Z + k]
        wm_x, wm_y, wm_z = sample_ggx_wm(wo_x, wo_y, wo_z, alpha, lanes[ln.U_BSDF_0 + k], lanes[ln.U_BSDF_1 + k])
        twice = _TWO * (wo_x * wm_x + wo_y * wm_y + wo_z * wm_z)
        x, y, z = twice * wm_x - wo_x, twice * wm_y - wo_y, twice * wm_z - wo_z
        z = z if z > _ZERO else _ZERO
        glossy = lobe >= _ZERO
        lanes[ln.WI_X + k] = x if glossy else diffuse_x
        lanes[ln.WI_Y + k] = y if glossy else diffuse_y
        lanes[ln.WI_Z + k] = z if glossy else diffuse_z


@kernel
def _sample_refraction(lanes: NDArray[np.float32], k: int, lobe: np.float32) -> None:
    """Replace the direction of a lane that glass lets through; ``lobe`` in [0, PR_GLASS)."""
    wo_x, wo_y, wo_z, eta = lanes[ln.WO_X + k], lanes[ln.WO_Y + k], lanes[ln.WO_Z + k], lanes[ln.ETA + k]
    wm_x, wm_y, wm_z = sample_ggx_wm(wo_x, wo_y, wo_z, lanes[ln.ALPHA + k], lanes[ln.U_BSDF_0 + k], lanes[ln.U_BSDF_1 + k])
    wo_dot_wm = wo_x * wm_x + wo_y * wm_y + wo_z * wm_z
    if lobe < lanes[ln.PR_GLASS + k] * fresnel_dielectric(wo_dot_wm, eta):
        return
    inverse = _ONE / eta
    cos_t = np.sqrt(max(_ONE - (_ONE - wo_dot_wm * wo_dot_wm) * inverse * inverse, _ZERO))
    scale = wo_dot_wm * inverse - cos_t
    x, y, z = wm_x * scale - wo_x * inverse, wm_y * scale - wo_y * inverse, wm_z * scale - wo_z * inverse
    lanes[ln.WI_X + k], lanes[ln.WI_Y + k], lanes[ln.WI_Z + k] = x, y, z if z < _ZERO else _ZERO
