"""The principled model of 16 hits at a time, seen from where their rays came: all that evaluation and sampling need.

From the top: a clear coat (GGX, index 1.5) and a sheen; below them, by shares, metal (GGX, Schlick's Fresnel term with the base colour at
normal incidence), opaque dielectric (GGX over a diffuse base) and glass (GGX reflection and refraction).  What a layer reflects is missing
below it: coat and sheen scale what is under them by 1 - albedo towards the viewer; the diffuse base, and the multiple scattering that GGX
leaves out for metals, take exactly what microfacets leave, symmetrically in both directions (Kulla and Conty 2017).  Glass is scaled by its
own albedo (Turquin 2019).  So with a base colour of 1 every surface returns all light, from all sides.

Loops over lanes have no branches but selections, and touch no memory but lanes, so that LLVM vectorises them; tables are read in loops of
their own before.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from renderer.bsdf.albedo import MIN_ALPHA, STEPS, Albedos
from renderer.bsdf.microfacet import fresnel_pane
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
    COAT_FIFTH,
    COAT_ROUGHNESS,
    COAT_WHOLE,
    COSINE,
    ETA,
    FIFTH,
    GLASS,
    GLOSS_B,
    GLOSS_G,
    GLOSS_R,
    GLOSSY,
    GRAZING,
    IOR,
    MATT_B,
    MATT_F0,
    MATT_F90,
    MATT_G,
    MATT_R,
    MEAN,
    MEAN_FIFTH,
    METALLIC,
    REFLECTS,
    ROUGHNESS,
    SHEEN,
    SHEEN_ALBEDO,
    SHIFT_B,
    SHIFT_G,
    SHIFT_R,
    SHINE,
    THIN,
    TRANSMISSION,
    WHOLE,
    WO_Z,
    lane_count,
)

ANY_GLOSS, ANY_COAT, ANY_GLASS = 1, 2, 4
"""Bits of a packet's *kinds*: what at least one of its lanes has."""

_ZERO, _ONE, _TINY = np.float32(0.0), np.float32(1.0), np.float32(1e-30)
_RED, _GREEN, _BLUE = np.float32(0.2126), np.float32(0.7152), np.float32(0.0722)
_MIN_ROUGHNESS = np.float32(np.sqrt(MIN_ALPHA))
_MIN_ETA = np.float32(1.0005)
_STEEP = np.float32(50.0)
_SCHLICK_MEAN = np.float32(1.0 / 21.0)
_LAST_CELL = np.float32(STEPS - 1)
COAT_F0 = np.float32(0.04)


@inlined
def look_up(table: NDArray[np.float32], row: np.float32, cosine: np.float32) -> tuple[np.float32, np.float32]:
    """Return the albedo of microfacets at reflectance 1, and Schlick's part of it; ``row``: square root of alpha."""
    y, x = row * _LAST_CELL, np.sqrt(cosine if cosine > _ZERO else _ZERO) * _LAST_CELL
    i, j = min(int(y), STEPS - 2), min(int(x), STEPS - 2)
    v, u = y - np.float32(i), x - np.float32(j)
    a, b, c, d = (_ONE - v) * (_ONE - u), (_ONE - v) * u, v * (_ONE - u), v * u
    whole = a * table[i, j, 0] + b * table[i, j + 1, 0] + c * table[i + 1, j, 0] + d * table[i + 1, j + 1, 0]
    return whole, a * table[i, j, 1] + b * table[i, j + 1, 1] + c * table[i + 1, j, 1] + d * table[i + 1, j + 1, 1]


@inlined
def _mean_albedo(table: NDArray[np.float32], row: np.float32) -> tuple[np.float32, np.float32]:
    """Return the hemisphere's means of :func:`look_up`."""
    y = row * _LAST_CELL
    i = min(int(y), STEPS - 2)
    v = y - np.float32(i)
    return (_ONE - v) * table[i, STEPS, 0] + v * table[i + 1, STEPS, 0], (_ONE - v) * table[i, STEPS, 1] + v * table[i + 1, STEPS, 1]


@inlined
def _sheen_albedo(table: NDArray[np.float32], cosine: np.float32) -> np.float32:
    x = np.sqrt(cosine if cosine > _ZERO else _ZERO) * _LAST_CELL
    j = min(int(x), STEPS - 2)
    u = x - np.float32(j)
    albedo: np.float32 = (_ONE - u) * table[0, j, 2] + u * table[0, j + 1, 2]
    return albedo


@inlined
def _luminance(r: np.float32, g: np.float32, b: np.float32) -> np.float32:
    """Return the luminance of linear RGB with Rec. 709 primaries."""
    return _RED * r + _GREEN * g + _BLUE * b


@inlined
def _multiple(color: np.float32, mean: np.float32) -> np.float32:
    """Return the reflectance of light scattered more than once by metal of this colour (Kulla and Conty 2017, with Schlick's mean)."""
    average = color + (_ONE - color) * _SCHLICK_MEAN
    return average * average * mean / (_ONE - average * (_ONE - mean))


@kernel
def make_closures(lanes: NDArray[np.float32], albedos: Albedos) -> int:
    """Fill GLOSSY to BY_COAT for all lanes that reflect, from their looks and WO_Z; return the packet's kinds."""
    if not _mark_glossy(lanes):
        _take_matt(lanes)
        return 0
    kinds = _look_up_albedos(lanes, albedos)
    _mix_layers(lanes)
    if kinds & ANY_GLASS:
        for k in range(LANES):
            if lanes[REFLECTS + k] > _ZERO and lanes[TRANSMISSION + k] + lanes[THIN + k] > _ZERO:
                _make_clear(lanes, k, albedos)
    _share_draws(lanes)
    return kinds


@kernel
def _mark_glossy(lanes: NDArray[np.float32]) -> bool:
    """Fill GLOSSY; return whether any lane is.  Those with an index of 1 and no layers are matt, after Lambert."""
    found = _ZERO
    for k in range(lane_count(lanes)):
        layers = lanes[METALLIC + k] + lanes[TRANSMISSION + k] + lanes[THIN + k] + lanes[COAT + k] + lanes[SHEEN + k]
        glossy = (lanes[REFLECTS + k] > _ZERO) & ((lanes[IOR + k] > _ONE) | (layers > _ZERO))
        lanes[GLOSSY + k] = _ONE if glossy else _ZERO
    for k in range(LANES):
        found += lanes[GLOSSY + k]
    return bool(found > _ZERO)


@kernel
def _take_matt(lanes: NDArray[np.float32]) -> None:
    """Fill what a packet needs whose lanes are all matt."""
    for k in range(lane_count(lanes)):
        r, g, b = lanes[BASE_R + k], lanes[BASE_G + k], lanes[BASE_B + k]
        lanes[MATT_R + k], lanes[MATT_G + k], lanes[MATT_B + k] = r, g, b
        lanes[BY_MATT + k] = _ONE if r + g + b > _ZERO else _ZERO


@kernel
def _look_up_albedos(lanes: NDArray[np.float32], albedos: Albedos) -> int:
    """Fill WHOLE to COAT_FIFTH and return the packet's kinds; matt lanes need no tables."""
    table, kinds = albedos.reflected, ANY_GLOSS
    for k in range(LANES):
        for field in range(WHOLE, COAT_FIFTH + LANES, LANES):
            lanes[field + k] = _ZERO
        lanes[WHOLE + k] = lanes[MEAN + k] = _ONE
        if lanes[GLOSSY + k] == _ZERO:
            continue
        coat, sheen, clear = lanes[COAT + k], lanes[SHEEN + k], lanes[TRANSMISSION + k] + lanes[THIN + k]
        row, cosine = max(lanes[ROUGHNESS + k], _MIN_ROUGHNESS), lanes[WO_Z + k]
        lanes[WHOLE + k], lanes[FIFTH + k] = look_up(table, row, cosine)
        lanes[MEAN + k], lanes[MEAN_FIFTH + k] = _mean_albedo(table, row)
        if clear > _ZERO:
            kinds |= ANY_GLASS
        if sheen > _ZERO:
            lanes[SHEEN_ALBEDO + k] = _sheen_albedo(table, cosine)
        if coat > _ZERO:
            kinds |= ANY_COAT
            lanes[COAT_WHOLE + k], lanes[COAT_FIFTH + k] = look_up(table, max(lanes[COAT_ROUGHNESS + k], _MIN_ROUGHNESS), cosine)
    return kinds


@kernel
def _mix_layers(lanes: NDArray[np.float32]) -> None:
    """Fill ALPHA to CLEAR, and BY_MATT to BY_COAT with what the lobes reflect."""
    for k in range(LANES):
        r, g, b = lanes[BASE_R + k], lanes[BASE_G + k], lanes[BASE_B + k]
        row, coat_row = lanes[ROUGHNESS + k], lanes[COAT_ROUGHNESS + k]
        row = row if row > _MIN_ROUGHNESS else _MIN_ROUGHNESS
        coat_row = coat_row if coat_row > _MIN_ROUGHNESS else _MIN_ROUGHNESS
        metal, ior = lanes[METALLIC + k], lanes[IOR + k]
        through = (_ONE - metal) * lanes[TRANSMISSION + k]
        opaque = _ONE - metal - through
        base_f0 = (ior - _ONE) / (ior + _ONE)
        base_f0 *= base_f0
        base_f90 = _STEEP * base_f0
        base_f90 = base_f90 if base_f90 < _ONE else _ONE
        whole, fifth, mean, mean_fifth = lanes[WHOLE + k], lanes[FIFTH + k], lanes[MEAN + k], lanes[MEAN_FIFTH + k]
        coat_albedo = lanes[COAT + k] * (COAT_F0 * (lanes[COAT_WHOLE + k] - lanes[COAT_FIFTH + k]) + lanes[COAT_FIFTH + k])
        sheen = lanes[SHEEN + k] * (_ONE - coat_albedo)
        under = (_ONE - coat_albedo) * (_ONE - lanes[SHEEN + k] * lanes[SHEEN_ALBEDO + k])
        enters = _ONE - (base_f0 * (whole - fifth) + base_f90 * fifth)
        enters_mean = _ONE - (base_f0 * (mean - mean_fifth) + base_f90 * mean_fifth)
        matt = under * opaque * enters / enters_mean
        lost = _ONE - mean
        thick = _ONE - lanes[THIN + k]
        opaque, metal, matt = opaque * thick, metal * thick, matt * thick
        shift = under * metal * (_ONE - whole) / (lost if lost > _TINY else _TINY)
        shift_r, shift_g, shift_b = shift * _multiple(r, mean), shift * _multiple(g, mean), shift * _multiple(b, mean)
        plain, metal = under * opaque * base_f0, under * metal
        gloss_r, gloss_g, gloss_b, grazing = plain + metal * r, plain + metal * g, plain + metal * b, under * opaque * base_f90 + metal
        lanes[ALPHA + k], lanes[COAT_ALPHA + k] = row * row, coat_row * coat_row
        lanes[MATT_R + k], lanes[MATT_G + k], lanes[MATT_B + k] = matt * r, matt * g, matt * b
        lanes[MATT_F0 + k], lanes[MATT_F90 + k] = base_f0, base_f90
        lanes[SHIFT_R + k], lanes[SHIFT_G + k], lanes[SHIFT_B + k] = shift_r, shift_g, shift_b
        lanes[GLOSS_R + k], lanes[GLOSS_G + k], lanes[GLOSS_B + k], lanes[GRAZING + k] = gloss_r, gloss_g, gloss_b, grazing
        lanes[SHINE + k], lanes[CLEAR + k], lanes[ETA + k] = sheen, under, _ONE
        shine = sheen * lanes[SHEEN_ALBEDO + k]
        lanes[BY_MATT + k] = _luminance(r, g, b) * matt * enters_mean + _luminance(shift_r, shift_g, shift_b) * lost + shine
        lanes[BY_GLOSS + k] = _luminance(gloss_r, gloss_g, gloss_b) * (whole - fifth) + grazing * fifth
        lanes[BY_GLASS + k] = _ZERO
        lanes[BY_COAT + k] = coat_albedo


@kernel
def _make_clear(lanes: NDArray[np.float32], k: int, albedos: Albedos) -> None:
    """Complete CLEAR, ETA and BY_GLASS of a lane of glass or of a pane; CLEAR is the weight of what lies under coat and sheen."""
    under, cosine, ior = lanes[CLEAR + k], lanes[WO_Z + k], lanes[IOR + k]
    if lanes[THIN + k] > _ZERO:
        lanes[ETA + k], lanes[BY_GLASS + k] = ior, under * fresnel_pane(cosine, ior)
        return
    through = (_ONE - lanes[METALLIC + k]) * lanes[TRANSMISSION + k]
    inside = 0 if lanes[COSINE + k] > _ZERO else 1
    eta = max(ior, _MIN_ETA)
    row = max(lanes[ROUGHNESS + k], _MIN_ROUGHNESS)
    lanes[ETA + k] = _ONE / eta if inside else eta
    lanes[CLEAR + k] = under * through / _glass_albedo(albedos.glass, int(lanes[GLASS + k]), inside, row, cosine)
    lanes[BY_GLASS + k] = under * through


@kernel
def _glass_albedo(tables: NDArray[np.float32], index: int, inside: int, row: np.float32, cosine: np.float32) -> np.float32:
    y, x = row * _LAST_CELL, np.sqrt(cosine) * _LAST_CELL
    i, j = min(int(y), STEPS - 2), min(int(x), STEPS - 2)
    v, u = y - np.float32(i), x - np.float32(j)
    low = (_ONE - u) * tables[index, inside, i, j] + u * tables[index, inside, i, j + 1]
    high = (_ONE - u) * tables[index, inside, i + 1, j] + u * tables[index, inside, i + 1, j + 1]
    albedo: np.float32 = (_ONE - v) * low + v * high
    return albedo


@kernel
def _share_draws(lanes: NDArray[np.float32]) -> None:
    """Make BY_MATT to BY_COAT probabilities."""
    for k in range(LANES):
        total = lanes[BY_MATT + k] + lanes[BY_GLOSS + k] + lanes[BY_GLASS + k] + lanes[BY_COAT + k]
        scale = _ONE / (total if total > _TINY else _TINY)
        lanes[BY_MATT + k] *= scale
        lanes[BY_GLOSS + k] *= scale
        lanes[BY_GLASS + k] *= scale
        lanes[BY_COAT + k] *= scale
