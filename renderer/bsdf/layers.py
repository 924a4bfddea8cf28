"""The layered BSDF of 16 hits at a time for a known wo: all that evaluation and sampling need.

From the top: a clear coat (GGX, index 1.5) and a sheen; below them, by shares, metal (GGX, Schlick's Fresnel term with the base colour at
normal incidence), opaque dielectric (GGX over a diffuse base) and glass (GGX reflection and refraction).  What a layer reflects is missing
below it: coat and sheen scale what is under them by 1 - albedo for wo; the diffuse base, and the multiple scattering that GGX leaves out
for metals, take exactly what microfacets leave, symmetrically in both directions (Kulla and Conty 2017).  Glass is scaled by its
own albedo (Turquin 2019).  So with a base colour of 1 every surface returns all light, from all sides.

The diffuse base of a thin sheet sends a share of what it scatters to its other side (cloth, leaves).  A hit is taken from one side at a
time (:mod:`renderer.path.sheets`): from behind it has that share of the base and nothing else.

Loops over lanes have no branches but selections, and touch no memory but lanes, so that LLVM vectorises them; tables are read in loops of
their own before.
"""

import numpy as np
from numpy.typing import NDArray

from renderer.bsdf.albedo import MIN_ALPHA, STEPS, Albedos
from renderer.bsdf.microfacet import fresnel_thin_dielectric, schlick_albedo
from renderer.core import lanes as ln
from renderer.core.color import LUMINANCE
from renderer.core.kernel import inlined, kernel
from renderer.core.lanes import lane_count
from renderer.core.ray_packet import LANES

ANY_GLOSSY, ANY_COAT, ANY_GLASS = 1, 2, 4
"""Bits of a packet's *kinds*: what at least one of its lanes has."""

_ZERO, _ONE, _TINY = np.float32(0.0), np.float32(1.0), np.float32(1e-30)
_RED, _GREEN, _BLUE = (np.float32(weight) for weight in LUMINANCE)
_MIN_ROUGHNESS = np.float32(np.sqrt(MIN_ALPHA))
_MIN_ETA = np.float32(1.0005)
_STEEP = np.float32(50.0)
_SCHLICK_MEAN = np.float32(1.0 / 21.0)
_LAST_CELL = np.float32(STEPS - 1)
COAT_F0 = np.float32(0.04)


@inlined
def look_up_albedo(table: NDArray[np.float32], row: np.float32, cosine: np.float32) -> tuple[np.float32, np.float32]:
    """Return the albedo of microfacets at reflectance 1, and Schlick's part of it; ``row``: square root of alpha."""
    y, x = row * _LAST_CELL, np.sqrt(cosine if cosine > _ZERO else _ZERO) * _LAST_CELL
    i, j = min(int(y), STEPS - 2), min(int(x), STEPS - 2)
    v, u = y - np.float32(i), x - np.float32(j)
    a, b, c, d = (_ONE - v) * (_ONE - u), (_ONE - v) * u, v * (_ONE - u), v * u
    e_wo = a * table[i, j, 0] + b * table[i, j + 1, 0] + c * table[i + 1, j, 0] + d * table[i + 1, j + 1, 0]
    return e_wo, a * table[i, j, 1] + b * table[i, j + 1, 1] + c * table[i + 1, j, 1] + d * table[i + 1, j + 1, 1]


@inlined
def boundary_reflectance(ior: np.float32) -> tuple[np.float32, np.float32]:
    """Return what the boundary of an opaque dielectric reflects at normal and at grazing incidence, for Schlick's formula."""
    f0 = (ior - _ONE) / (ior + _ONE)
    f0 *= f0
    f90 = _STEEP * f0
    return f0, f90 if f90 < _ONE else _ONE


@inlined
def look_up_mean(table: NDArray[np.float32], row: np.float32) -> tuple[np.float32, np.float32]:
    """Return the hemisphere's means of :func:`look_up_albedo`."""
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
def _multiscatter_reflectance(color: np.float32, mean: np.float32) -> np.float32:
    """Return the reflectance of light scattered more than once by metal of this colour (Kulla and Conty 2017, with Schlick's mean)."""
    average = color + (_ONE - color) * _SCHLICK_MEAN
    return average * average * mean / (_ONE - average * (_ONE - mean))


@kernel
def build_lobes(lanes: NDArray[np.float32], albedos: Albedos) -> int:
    """Fill the BSDF fields, GLOSSY to PR_COAT, of all lanes with a hit, from their materials and WO_Z; return the packet's kinds."""
    if not _mark_glossy(lanes):
        _build_diffuse(lanes)
        return 0
    kinds = _look_up_albedos(lanes, albedos)
    _mix_layers(lanes)
    for k in range(LANES):
        if lanes[ln.BEHIND + k] > _ZERO:
            _drop_boundary(lanes, k)
    if kinds & ANY_GLASS:
        for k in range(LANES):
            if lanes[ln.HIT + k] > _ZERO and lanes[ln.TRANSMISSION + k] + lanes[ln.THIN + k] > _ZERO:
                _complete_glass(lanes, k, albedos)
    _normalize_probabilities(lanes)
    return kinds


@kernel
def _mark_glossy(lanes: NDArray[np.float32]) -> bool:
    """Fill GLOSSY; return whether any lane is.  Those with an index of 1 and no layers are diffuse, after Lambert."""
    found = _ZERO
    for k in range(lane_count(lanes)):
        layers = lanes[ln.METALLIC + k] + lanes[ln.TRANSMISSION + k] + lanes[ln.THIN + k] + lanes[ln.COAT + k] + lanes[ln.SHEEN + k]
        glossy = (lanes[ln.HIT + k] > _ZERO) & ((lanes[ln.IOR + k] > _ONE) | (layers > _ZERO))
        lanes[ln.GLOSSY + k] = _ONE if glossy else _ZERO
    for k in range(LANES):
        found += lanes[ln.GLOSSY + k]
    return bool(found > _ZERO)


@kernel
def _build_diffuse(lanes: NDArray[np.float32]) -> None:
    """Fill what a packet needs whose lanes are all diffuse."""
    for k in range(lane_count(lanes)):
        side = _share_of_side(lanes, k)
        r, g, b = side * lanes[ln.BASE_R + k], side * lanes[ln.BASE_G + k], side * lanes[ln.BASE_B + k]
        lanes[ln.DIFFUSE_R + k], lanes[ln.DIFFUSE_G + k], lanes[ln.DIFFUSE_B + k] = r, g, b
        lanes[ln.PR_DIFFUSE + k] = _ONE if r + g + b > _ZERO else _ZERO


@inlined
def _share_of_side(lanes: NDArray[np.float32], k: int) -> np.float32:
    """Return the share of what lane k's diffuse base scatters that leaves on the side from which it is taken."""
    through, behind = lanes[ln.DIFFUSE_TRANSMISSION + k], lanes[ln.BEHIND + k]
    share: np.float32 = behind * through + (_ONE - behind) * (_ONE - through)
    return share


@kernel
def _look_up_albedos(lanes: NDArray[np.float32], albedos: Albedos) -> int:
    """Fill E_WO to E_COAT_SCHLICK and return the packet's kinds; diffuse lanes need no tables."""
    table, kinds = albedos.reflected, ANY_GLOSSY
    for k in range(LANES):
        for field in range(ln.E_WO, ln.E_COAT_SCHLICK + LANES, LANES):
            lanes[field + k] = _ZERO
        lanes[ln.E_WO + k] = lanes[ln.E_MEAN + k] = _ONE
        if lanes[ln.GLOSSY + k] == _ZERO:
            continue
        coat, sheen, clear = lanes[ln.COAT + k], lanes[ln.SHEEN + k], lanes[ln.TRANSMISSION + k] + lanes[ln.THIN + k]
        row, cosine = max(lanes[ln.ROUGHNESS + k], _MIN_ROUGHNESS), lanes[ln.WO_Z + k]
        lanes[ln.E_WO + k], lanes[ln.E_WO_SCHLICK + k] = look_up_albedo(table, row, cosine)
        lanes[ln.E_MEAN + k], lanes[ln.E_MEAN_SCHLICK + k] = look_up_mean(table, row)
        if clear > _ZERO:
            kinds |= ANY_GLASS
        if sheen > _ZERO:
            lanes[ln.E_SHEEN + k] = _sheen_albedo(table, cosine)
        if coat > _ZERO:
            kinds |= ANY_COAT
            row = max(lanes[ln.COAT_ROUGHNESS + k], _MIN_ROUGHNESS)
            lanes[ln.E_COAT + k], lanes[ln.E_COAT_SCHLICK + k] = look_up_albedo(table, row, cosine)
    return kinds


@kernel
def _mix_layers(lanes: NDArray[np.float32]) -> None:
    """Fill ALPHA to ETA, and PR_DIFFUSE to PR_COAT with what the lobes reflect."""
    for k in range(LANES):
        # Roughness; the shares of metal, glass and opaque dielectric.
        r, g, b = lanes[ln.BASE_R + k], lanes[ln.BASE_G + k], lanes[ln.BASE_B + k]
        row, coat_row = lanes[ln.ROUGHNESS + k], lanes[ln.COAT_ROUGHNESS + k]
        row = row if row > _MIN_ROUGHNESS else _MIN_ROUGHNESS
        coat_row = coat_row if coat_row > _MIN_ROUGHNESS else _MIN_ROUGHNESS
        metal, ior = lanes[ln.METALLIC + k], lanes[ln.IOR + k]
        through = (_ONE - metal) * lanes[ln.TRANSMISSION + k]
        opaque = _ONE - metal - through
        # Reflectance of the dielectric's boundary.
        base_f0, base_f90 = boundary_reflectance(ior)
        # What coat and sheen leave.
        e_wo, e_wo_schlick = lanes[ln.E_WO + k], lanes[ln.E_WO_SCHLICK + k]
        mean, e_mean_schlick = lanes[ln.E_MEAN + k], lanes[ln.E_MEAN_SCHLICK + k]
        coat_albedo = lanes[ln.COAT + k] * schlick_albedo(COAT_F0, _ONE, lanes[ln.E_COAT + k], lanes[ln.E_COAT_SCHLICK + k])
        sheen = lanes[ln.SHEEN + k] * (_ONE - coat_albedo)
        under = (_ONE - coat_albedo) * (_ONE - lanes[ln.SHEEN + k] * lanes[ln.E_SHEEN + k])
        # The diffuse base takes what the boundary lets through, multiple scattering what the microfacets lose.
        enters = _ONE - schlick_albedo(base_f0, base_f90, e_wo, e_wo_schlick)
        enters_mean = _ONE - schlick_albedo(base_f0, base_f90, mean, e_mean_schlick)
        diffuse = under * opaque * enters / enters_mean * _share_of_side(lanes, k)
        lost = _ONE - mean
        thick = _ONE - lanes[ln.THIN + k]
        opaque, metal, diffuse = opaque * thick, metal * thick, diffuse * thick
        multiscatter = under * metal * (_ONE - e_wo) / (lost if lost > _TINY else _TINY)
        multi_r = multiscatter * _multiscatter_reflectance(r, mean)
        multi_g = multiscatter * _multiscatter_reflectance(g, mean)
        multi_b = multiscatter * _multiscatter_reflectance(b, mean)
        # The specular lobe of metal and dielectric together.
        dielectric_f0, metal = under * opaque * base_f0, under * metal
        specular_r, specular_g, specular_b = dielectric_f0 + metal * r, dielectric_f0 + metal * g, dielectric_f0 + metal * b
        specular_f90 = under * opaque * base_f90 + metal
        # Weights of the lobes.
        lanes[ln.ALPHA + k], lanes[ln.COAT_ALPHA + k] = row * row, coat_row * coat_row
        lanes[ln.DIFFUSE_R + k], lanes[ln.DIFFUSE_G + k], lanes[ln.DIFFUSE_B + k] = diffuse * r, diffuse * g, diffuse * b
        lanes[ln.BASE_F0 + k], lanes[ln.BASE_F90 + k] = base_f0, base_f90
        lanes[ln.MULTISCATTER_R + k], lanes[ln.MULTISCATTER_G + k], lanes[ln.MULTISCATTER_B + k] = multi_r, multi_g, multi_b
        lanes[ln.SPECULAR_R + k], lanes[ln.SPECULAR_G + k], lanes[ln.SPECULAR_B + k] = specular_r, specular_g, specular_b
        lanes[ln.SPECULAR_F90 + k] = specular_f90
        lanes[ln.SHEEN_WEIGHT + k], lanes[ln.GLASS_WEIGHT + k], lanes[ln.ETA + k] = sheen, under, _ONE
        # What each lobe reflects towards wo, by luminance.
        e_sheen = sheen * lanes[ln.E_SHEEN + k]
        lanes[ln.PR_DIFFUSE + k] = _luminance(r, g, b) * diffuse * enters_mean + _luminance(multi_r, multi_g, multi_b) * lost + e_sheen
        specular_f0 = _luminance(specular_r, specular_g, specular_b)
        lanes[ln.PR_SPECULAR + k] = schlick_albedo(specular_f0, specular_f90, e_wo, e_wo_schlick)
        lanes[ln.PR_GLASS + k] = lanes[ln.PR_PASS + k] = _ZERO
        lanes[ln.PR_COAT + k] = coat_albedo


@kernel
def _drop_boundary(lanes: NDArray[np.float32], k: int) -> None:
    """Leave a lane that is taken from behind nothing but its diffuse base: what boundary and layers reflect stays on the viewer's side."""
    lanes[ln.SPECULAR_R + k] = lanes[ln.SPECULAR_G + k] = lanes[ln.SPECULAR_B + k] = lanes[ln.SPECULAR_F90 + k] = _ZERO
    lanes[ln.MULTISCATTER_R + k] = lanes[ln.MULTISCATTER_G + k] = lanes[ln.MULTISCATTER_B + k] = lanes[ln.SHEEN_WEIGHT + k] = _ZERO
    lanes[ln.PR_SPECULAR + k] = lanes[ln.PR_COAT + k] = _ZERO


@kernel
def _complete_glass(lanes: NDArray[np.float32], k: int, albedos: Albedos) -> None:
    """Complete GLASS_WEIGHT to PR_PASS of a lane of glass or of a pane; GLASS_WEIGHT is that of all under coat and sheen.

    Light goes straight through a pane, once: where the pane shows the sky, the sky's luminance counts as the pane's own.
    """
    under, cosine, ior = lanes[ln.GLASS_WEIGHT + k], lanes[ln.WO_Z + k], lanes[ln.IOR + k]
    if lanes[ln.THIN + k] > _ZERO:
        reflects = fresnel_thin_dielectric(cosine, ior)
        passes = lanes[ln.TRANSMISSION + k] * (_ONE - reflects) if lanes[ln.OPEN + k] == _ZERO else _ZERO
        lanes[ln.ETA + k], lanes[ln.PR_GLASS + k] = ior, under * reflects
        lanes[ln.PASS_WEIGHT + k] = lanes[ln.PR_PASS + k] = passes
        return
    through = (_ONE - lanes[ln.METALLIC + k]) * lanes[ln.TRANSMISSION + k]
    inside = 0 if lanes[ln.COS_FRONT + k] > _ZERO else 1
    eta = max(ior, _MIN_ETA)
    row = max(lanes[ln.ROUGHNESS + k], _MIN_ROUGHNESS)
    lanes[ln.ETA + k] = _ONE / eta if inside else eta
    lanes[ln.GLASS_WEIGHT + k] = under * through / _glass_albedo(albedos.glass, int(lanes[ln.GLASS + k]), inside, row, cosine)
    lanes[ln.PR_GLASS + k] = under * through


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
def _normalize_probabilities(lanes: NDArray[np.float32]) -> None:
    """Make the probabilities of the lobes, PR_PASS among them, sum to 1."""
    for k in range(LANES):
        total = lanes[ln.PR_DIFFUSE + k] + lanes[ln.PR_SPECULAR + k] + lanes[ln.PR_GLASS + k] + lanes[ln.PR_COAT + k]
        total += lanes[ln.PR_PASS + k]
        scale = _ONE / (total if total > _TINY else _TINY)
        lanes[ln.PR_DIFFUSE + k] *= scale
        lanes[ln.PR_SPECULAR + k] *= scale
        lanes[ln.PR_GLASS + k] *= scale
        lanes[ln.PR_COAT + k] *= scale
        lanes[ln.PR_PASS + k] *= scale
