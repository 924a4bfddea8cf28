"""What a surface reflects in all: the share of light from everywhere that leaves towards wo."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from renderer.bsdf.layers import ANY_COAT, ANY_GLOSSY, COAT_F0, boundary_reflectance, look_up_albedo, look_up_mean
from renderer.bsdf.microfacet import schlick_albedo
from renderer.core import lanes as ln
from renderer.core.color import Rgb
from renderer.core.kernel import inlined

_ZERO, _ONE, _LEAST_ALBEDO = np.float32(0.0), np.float32(1.0), np.float32(1e-4)
WIDE = np.float32(0.6)
"""Roughness from which on a lobe counts as matt: it shows light from all around, and no mirror image."""


@inlined
def diffuse_albedo(lanes: NDArray[np.float32], kinds: int, k: int) -> Rgb:
    """Return what the lobes without direction reflect of even light from above: diffuse base, multiple scattering, sheen."""
    r, g, b = lanes[ln.DIFFUSE_R + k], lanes[ln.DIFFUSE_G + k], lanes[ln.DIFFUSE_B + k]
    if kinds & ANY_GLOSSY:
        mean, schlick = lanes[ln.E_MEAN + k], lanes[ln.E_MEAN_SCHLICK + k]
        enters = _ONE - schlick_albedo(lanes[ln.BASE_F0 + k], lanes[ln.BASE_F90 + k], mean, schlick)
        lost, sheen = _ONE - mean, lanes[ln.SHEEN_WEIGHT + k] * lanes[ln.E_SHEEN + k]
        r = r * enters + lanes[ln.MULTISCATTER_R + k] * lost + sheen
        g = g * enters + lanes[ln.MULTISCATTER_G + k] * lost + sheen
        b = b * enters + lanes[ln.MULTISCATTER_B + k] * lost + sheen
    return r, g, b


class Reflector(NamedTuple):
    """What a surface reflects of light from one direction, for its cosine.

    f0, f90: reflectance of its boundary at normal and at grazing incidence; roughness; scattered, mirrored: what counts of the light that
    the boundary lets through, and of what it reflects; coat, coat_roughness: weight of its clear coat; per_mean: 1 over what counts of even
    light.
    """

    f0: np.float32
    f90: np.float32
    roughness: np.float32
    scattered: np.float32
    mirrored: np.float32
    coat: np.float32
    coat_roughness: np.float32
    per_mean: np.float32


@inlined
def diffuse_reflector(ior: np.float32, roughness: np.float32, reflected: NDArray[np.float32]) -> Reflector:
    """Return what the diffuse base of an opaque dielectric reflects: what its boundary lets through.

    ``reflected``: albedo table of microfacets (:mod:`renderer.bsdf.albedo`).
    """
    f0, f90 = boundary_reflectance(ior)
    mean, schlick = look_up_mean(reflected, roughness)
    return Reflector(f0, f90, roughness, _ONE, _ZERO, _ZERO, roughness, _ONE / (_ONE - schlick_albedo(f0, f90, mean, schlick)))


@inlined
def whole_reflector(
    base: np.float32, ior: np.float32, roughness: np.float32, coat: np.float32, coat_roughness: np.float32, reflected: NDArray[np.float32]
) -> Reflector:
    """Return what an opaque dielectric whose base reflects ``base`` reflects in all, with its boundary and its coat."""
    f0, f90 = boundary_reflectance(ior)
    mean, schlick = look_up_mean(reflected, roughness)
    coat_mean, coat_schlick = look_up_mean(reflected, coat_roughness)
    by_coat = coat * schlick_albedo(COAT_F0, _ONE, coat_mean, coat_schlick)
    by_boundary = schlick_albedo(f0, f90, mean, schlick)
    under = _ONE - by_coat
    whole = by_coat + under * (base * (_ONE - by_boundary) + by_boundary)
    return Reflector(f0, f90, roughness, under * base, under, coat, coat_roughness, _ONE / max(whole, _LEAST_ALBEDO))


@inlined
def reflected_share(reflector: Reflector, cosine: np.float32, reflected: NDArray[np.float32]) -> np.float32:
    """Return what counts of light from one direction, over what counts of even light: illuminance by it goes with albedos."""
    scattered, mirrored = reflected_parts(reflector, cosine, reflected)
    return scattered + mirrored


@inlined
def reflected_parts(reflector: Reflector, cosine: np.float32, reflected: NDArray[np.float32]) -> tuple[np.float32, np.float32]:
    """Return the same by parts: what the base scatters, and what boundary and coat mirror."""
    if reflector.f0 + reflector.coat == _ZERO:
        return _ONE, _ZERO
    albedo, schlick = look_up_albedo(reflected, reflector.roughness, cosine)
    by_boundary = schlick_albedo(reflector.f0, reflector.f90, albedo, schlick)
    scattered, mirrored = reflector.scattered * (_ONE - by_boundary), reflector.mirrored * by_boundary
    if reflector.coat > _ZERO:
        albedo, schlick = look_up_albedo(reflected, reflector.coat_roughness, cosine)
        mirrored += reflector.coat * schlick_albedo(COAT_F0, _ONE, albedo, schlick)
    return reflector.per_mean * scattered, reflector.per_mean * mirrored


@inlined
def passed_albedo(lanes: NDArray[np.float32], kinds: int, k: int) -> Rgb:
    """Return what a sheet sends towards wo of even light on its other side."""
    through = lanes[ln.DIFFUSE_TRANSMISSION + k]
    if through == _ZERO:
        return _ZERO, _ZERO, _ZERO
    scale = through / (_ONE - through)
    if kinds & ANY_GLOSSY:
        mean, schlick = lanes[ln.E_MEAN + k], lanes[ln.E_MEAN_SCHLICK + k]
        scale *= _ONE - schlick_albedo(lanes[ln.BASE_F0 + k], lanes[ln.BASE_F90 + k], mean, schlick)
    return scale * lanes[ln.DIFFUSE_R + k], scale * lanes[ln.DIFFUSE_G + k], scale * lanes[ln.DIFFUSE_B + k]


@inlined
def specular_albedo(lanes: NDArray[np.float32], kinds: int, k: int) -> Rgb:
    """Return what the microfacets of metal and opaque dielectrics reflect towards wo, the coat apart."""
    if kinds & ANY_GLOSSY == 0 or lanes[ln.GLOSSY + k] == _ZERO:
        return _ZERO, _ZERO, _ZERO
    schlick = lanes[ln.E_WO_SCHLICK + k]
    e_wo = lanes[ln.E_WO + k] - schlick
    most = lanes[ln.SPECULAR_F90 + k] * schlick
    return lanes[ln.SPECULAR_R + k] * e_wo + most, lanes[ln.SPECULAR_G + k] * e_wo + most, lanes[ln.SPECULAR_B + k] * e_wo + most


@inlined
def coat_albedo(lanes: NDArray[np.float32], kinds: int, k: int) -> np.float32:
    """Return what the clear coat reflects towards wo."""
    if kinds & ANY_COAT == 0:
        return _ZERO
    albedo: np.float32 = lanes[ln.COAT + k] * (
        COAT_F0 * (lanes[ln.E_COAT + k] - lanes[ln.E_COAT_SCHLICK + k]) + lanes[ln.E_COAT_SCHLICK + k]
    )
    return albedo


@inlined
def rough_shares(lanes: NDArray[np.float32], reflected: NDArray[np.float32], k: int) -> tuple[Rgb, Rgb]:
    """Return what a surface scatters, and what it mirrors, towards where it is seen from, by its material: for what is seen in a mirror.

    Opaque dielectrics and coats send back at their boundary what microfacets do at that angle (``reflected``, their albedo table), and of
    the rest, by their colour, what it lets in from everywhere; metals all by it.  What is so rough that it shows no image scatters all.
    """
    metallic, coat, roughness = lanes[ln.METALLIC + k], lanes[ln.COAT + k], lanes[ln.ROUGHNESS + k]
    cosine, boundary, kept = abs(lanes[ln.COS_FRONT + k]), _ZERO, _ZERO
    if lanes[ln.IOR + k] > _ONE:
        f0, f90 = boundary_reflectance(lanes[ln.IOR + k])
        albedo, schlick = look_up_albedo(reflected, roughness, cosine)
        boundary = (_ONE - metallic) * schlick_albedo(f0, f90, albedo, schlick)
        albedo, schlick = look_up_mean(reflected, roughness)
        kept = (_ONE - metallic) * schlick_albedo(f0, f90, albedo, schlick)
    if coat > _ZERO:
        albedo, schlick = look_up_albedo(reflected, lanes[ln.COAT_ROUGHNESS + k], cosine)
        boundary = max(boundary, coat * schlick_albedo(COAT_F0, _ONE, albedo, schlick))
        albedo, schlick = look_up_mean(reflected, lanes[ln.COAT_ROUGHNESS + k])
        kept = max(kept, coat * schlick_albedo(COAT_F0, _ONE, albedo, schlick))
    inner = _ONE - kept
    colored = metallic if roughness < WIDE else _ZERO
    plain = boundary if roughness < WIDE or coat > _ZERO else _ZERO
    r, g, b = lanes[ln.BASE_R + k] * inner, lanes[ln.BASE_G + k] * inner, lanes[ln.BASE_B + k] * inner
    matt, scattered = _ONE - colored, boundary - plain
    return (
        (matt * r + scattered, matt * g + scattered, matt * b + scattered),
        (colored * r + plain, colored * g + plain, colored * b + plain),
    )
