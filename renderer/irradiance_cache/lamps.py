"""Lamps as balls, by which rough gloss shows them without noise."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from renderer.bsdf.microfacet import ggx_g1_root
from renderer.core import lanes as ln
from renderer.core.kernel import inlined
from renderer.core.sampling import Vector
from renderer.irradiance_cache import records as rec
from renderer.irradiance_cache.records import SHARP, WIDE, Lamps
from renderer.path import surface_tables as st
from renderer.path.emission import surface_le
from renderer.path.surface_tables import Surfaces
from renderer.scene.flat_scene import FlatScene
from scene_description.products import matmul, norm

_ZERO, _HALF, _ONE, _TWO, _TINY = np.float32(0.0), np.float32(0.5), np.float32(1.0), np.float32(2.0), np.float32(1e-20)
_LEAST_COSINE = np.float32(0.05)


def build_lamps(flat: FlatScene) -> Lamps:
    """Return a ball for each part that shines, and one for the panes that lie in one plane."""
    corners = flat.mesh.vertices.astype(np.float64)[flat.mesh.faces]
    cross = 0.5 * np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    groups = [[int(part)] for part in np.flatnonzero((flat.parts.emission > 0.0).any(axis=1) & ~flat.parts.portal)]
    planes: dict[tuple[float, ...], list[int]] = {}
    for pane in np.flatnonzero(flat.parts.portal).tolist():
        faces = np.flatnonzero(flat.face_part == pane)
        normal = cross[faces].sum(axis=0) / max(norm(cross[faces].sum(axis=0)), 1e-12)
        planes.setdefault((*normal.round(2), round(float(matmul(normal, corners[faces].mean(axis=(0, 1)))), 1)), []).append(pane)
    groups += planes.values()
    rows = []
    for parts in groups:
        faces = np.flatnonzero(np.isin(flat.face_part, parts))
        area = np.linalg.norm(cross[faces], axis=1)
        center = np.average(corners[faces].mean(axis=1), axis=0, weights=np.maximum(area, 1e-12))
        normal = cross[faces].sum(axis=0)
        level = norm(normal) > 0.5 * area.sum()
        shown_m2 = max(np.maximum(sign * cross[faces][:, axis], 0.0).sum() for axis in range(3) for sign in (-1.0, 1.0))
        if flat.parts.portal[parts[0]]:
            shown_m2 = norm(normal)
        normal /= max(norm(normal), 1e-12)
        rows.append([*center, np.sqrt(shown_m2 / np.pi), *normal, float(level)])
    return Lamps(np.array(rows, np.float32).reshape(-1, 8), np.array([parts[0] for parts in groups], np.int32))


@inlined
def mirrored_share(
    facet: np.float32, half: np.float32, cosine: np.float32, height: np.float32, alpha: np.float32, spread: np.float32
) -> np.float32:
    """Return what GGX reflects of even light from a ball, over its luminance and the Fresnel term.

    ``facet``: cosine of the microfacets that mirror the ball's centre; ``half``: that of the view to them; ``spread``: the ball's solid
    angle over pi.  The slopes of microfacets have the density alpha^2 / (pi (alpha^2 + m^2)^2) (Walter et al., "Microfacet Models for
    Refraction through Rough Surfaces", 2007).  By stereographic projection that is the uniform one of a sphere, so a disc of slopes has
    the share of a spherical cap.
    """
    square, inverse = alpha * alpha, _ONE / facet
    radius = spread * inverse * inverse * inverse * np.float32(0.25) / half
    away = (inverse * inverse - _ONE) + square - radius
    root = np.sqrt(away * away + np.float32(4.0) * square * radius)
    share = _TWO * square * radius / (root * (root + away)) if away > _ZERO else _HALF * (root - away) / root
    value: np.float32 = _TWO * share * half * inverse * cosine
    return value / (cosine * ggx_g1_root(height, alpha) + height * ggx_g1_root(cosine, alpha))


@inlined
def _schlick(cosine: np.float32) -> np.float32:
    """Return Fresnel's term of dielectrics by Schlick's approximation, for an index of 1.5."""
    rest = max(_ONE - cosine, _ZERO)
    value: np.float32 = np.float32(0.04) + np.float32(0.96) * rest * rest * rest * rest * rest
    return value


@inlined
def choose_lamp(surfaces: Surfaces, lamps: Lamps, k: int, primary: NDArray[np.float32], lanes: NDArray[np.float32]) -> int:
    """Fill TO_LIGHT and LI, what it adds to the pixel, of the lamp that lane k mirrors most, and LIGHT_PDF; return 1 if there is one.

    Whether it is seen is asked of the point of the ball that is nearest to the mirrored ray, as in Karis, "Real Shading in Unreal Engine 4"
    (2013).  One that adds less than a hundredth of the pixel's light is left out.
    """
    balls = lamps.balls
    px, py, pz = lanes[ln.P_X + k], lanes[ln.P_Y + k], lanes[ln.P_Z + k]
    nx, ny, nz = lanes[ln.NS_X + k], lanes[ln.NS_Y + k], lanes[ln.NS_Z + k]
    wo_x = lanes[ln.WO_X + k] * lanes[ln.TANGENT_X + k] + lanes[ln.WO_Y + k] * lanes[ln.BITANGENT_X + k] + lanes[ln.WO_Z + k] * nx
    wo_y = lanes[ln.WO_X + k] * lanes[ln.TANGENT_Y + k] + lanes[ln.WO_Y + k] * lanes[ln.BITANGENT_Y + k] + lanes[ln.WO_Z + k] * ny
    wo_z = lanes[ln.WO_X + k] * lanes[ln.TANGENT_Z + k] + lanes[ln.WO_Y + k] * lanes[ln.BITANGENT_Z + k] + lanes[ln.WO_Z + k] * nz
    height = lanes[ln.WO_Z + k]
    mx, my, mz = _TWO * height * nx - wo_x, _TWO * height * ny - wo_y, _TWO * height * nz - wo_z
    best = (primary[rec.LIGHT, k] + primary[rec.LIGHT + 1, k] + primary[rec.LIGHT + 2, k]) * np.float32(0.01)
    chosen = 0
    for i in range(len(balls)):
        cx, cy, cz, radius = balls[i, 0] - px, balls[i, 1] - py, balls[i, 2] - pz, balls[i, 3]
        squared = cx * cx + cy * cy + cz * cz
        distance = np.sqrt(max(squared, _TINY))
        lx, ly, lz = cx / distance, cy / distance, cz / distance
        cosine = lx * nx + ly * ny + lz * nz
        is_flat = balls[i, 7] > _ZERO
        if cosine <= _ZERO or (distance <= radius and not is_flat):
            continue
        # The microfacets that mirror the ball's centre.
        hx, hy, hz = lx + wo_x, ly + wo_y, lz + wo_z
        scale = _ONE / np.sqrt(max(hx * hx + hy * hy + hz * hz, _TINY))
        facet = max((hx * nx + hy * ny + hz * nz) * scale, _LEAST_COSINE)
        half = max((hx * lx + hy * ly + hz * lz) * scale, _LEAST_COSINE)
        # What is flat is a disc: one may stand closer to it than its radius.
        spread, facing = radius * radius / (squared + radius * radius if is_flat else squared), _ONE
        if is_flat:
            facing = max(-(lx * balls[i, 4] + ly * balls[i, 5] + lz * balls[i, 6]), _ZERO)
            spread *= facing
        # Narrower lobes see lamps, and panes, by their rays; under the coat panes are part of the light around.
        part, alpha = lamps.part[i], primary[rec.ALPHA, k]
        pane = surfaces.materials[part * st.ROW_SIZE + st.PORTAL] > _ZERO
        over = mirrored_share(facet, half, cosine, height, alpha, spread) if alpha >= (WIDE if pane else SHARP) else _ZERO
        under = _ZERO if pane else mirrored_share(facet, half, cosine, height, primary[rec.UNDER_ALPHA, k], spread)
        if over + under == _ZERO or facing == _ZERO:
            continue
        if lanes[ln.METALLIC + k] < _HALF:
            # The share is that of the mirrored direction: Fresnel's term is less where microfacets are seen less aslant.
            over *= _schlick(half) / _schlick(height)
            under *= _schlick(half) / _schlick(height)
        r, g, b = surface_le(surfaces, part, lx, ly, lz, facing)
        r = (over * primary[rec.SHARE, k] + under * primary[rec.UNDER, k]) * r
        g = (over * primary[rec.SHARE + 1, k] + under * primary[rec.UNDER + 1, k]) * g
        b = (over * primary[rec.SHARE + 2, k] + under * primary[rec.UNDER + 2, k]) * b
        if r + g + b > best:
            best, chosen = r + g + b, 1
            lanes[ln.LI_R + k], lanes[ln.LI_G + k], lanes[ln.LI_B + k] = r, g, b
            tx, ty, tz = _nearest_point(cx, cy, cz, radius, mx, my, mz)
            if is_flat:
                # Of what is flat it is one in its plane.
                off = (tx - cx) * balls[i, 4] + (ty - cy) * balls[i, 5] + (tz - cz) * balls[i, 6]
                tx, ty, tz = tx - off * balls[i, 4], ty - off * balls[i, 5], tz - off * balls[i, 6]
            reach = np.float32(0.98) if is_flat else (distance - radius) / distance
            reach = max(reach, _HALF)
            lanes[ln.TO_LIGHT_X + k], lanes[ln.TO_LIGHT_Y + k], lanes[ln.TO_LIGHT_Z + k] = reach * tx, reach * ty, reach * tz
            lanes[ln.LIGHT_PDF + k], lanes[ln.LIGHT_END + k] = _ONE, _ONE
    return chosen


@inlined
def _nearest_point(
    cx: np.float32, cy: np.float32, cz: np.float32, radius: np.float32, mx: np.float32, my: np.float32, mz: np.float32
) -> Vector:
    """Return about the point of a ball around (cx, cy, cz) that is nearest to the ray from the origin along the unit (mx, my, mz)."""
    along = cx * mx + cy * my + cz * mz
    ax, ay, az = along * mx - cx, along * my - cy, along * mz - cz
    aside = np.sqrt(max(ax * ax + ay * ay + az * az, _TINY))
    pull = min(radius / aside, _ONE) * np.float32(0.9)
    return cx + pull * ax, cy + pull * ay, cz + pull * az
