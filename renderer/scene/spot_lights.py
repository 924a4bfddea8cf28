"""Lights that no object holds: bare bulbs and spots, each a small ball whose luminance depends on direction only.

From afar such a ball is a point source of intensity I(angle to its axis); near by it has a size, so shadows have soft edges and mirrors
show it.  The flux is the integral of the intensity over all directions; a ball of surface area A shows A / 4 to every side.
"""

import math

import numpy as np
from numpy.typing import NDArray

import kernel_cache.elementary as el
from renderer.core.color import LUMINANCE
from renderer.core.kernel import kernel
from renderer.geometry.mesh import UNMAPPED, Mesh, surface_area
from scene_description.products import dot, matmul, norm
from scene_description.types import Luminaire

STEPS = 181
"""Samples of a profile, from the axis to its opposite: one a degree."""

_ONE = np.float32(1.0)
_PER_RADIAN = np.float32((STEPS - 1) / math.pi)


def intensity_profile(luminaire: Luminaire) -> NDArray[np.float64]:
    """Return intensity (STEPS,) over its greatest, at even angles from the axis to its opposite.

    A point is even all around; a spot is full to ``beam_rad``, falls smoothly (3 s^2 - 2 s^3) and ends at ``field_rad``; a table is what
    its numbers say, linear between them.
    """
    angles = np.linspace(0.0, math.pi, STEPS)
    if luminaire.intensities:
        table = np.asarray(luminaire.intensities, np.float64)
        profile = np.interp(angles, np.linspace(0.0, math.pi, len(table)), table)
    elif luminaire.kind == "point":
        profile = np.ones(STEPS)
    else:
        width = max(luminaire.field_rad - luminaire.beam_rad, 1e-6)
        s = np.clip((luminaire.field_rad - angles) / width, 0.0, 1.0)
        profile = s * s * (3.0 - 2.0 * s)
    return np.asarray(profile / profile.max())


def profile_integral(profile: NDArray[np.float64]) -> float:
    """Return the integral over all directions, in steradian, of a profile that is linear between its samples."""
    angles = np.linspace(0.0, math.pi, STEPS)
    fine = np.linspace(0.0, math.pi, 16 * (STEPS - 1) + 1)
    values = np.interp(fine, angles, profile) * el.sin(fine)
    return float(2.0 * math.pi * np.sum(0.5 * (values[1:] + values[:-1])) * (fine[1] - fine[0]))


def luminaire_mesh(luminaire: Luminaire) -> Mesh:
    """Return the ball, flat faces of two subdivisions of an icosahedron."""
    golden = 0.5 * (1.0 + math.sqrt(5.0))
    corners = [(s * 1.0, t * golden, 0.0) for s in (-1, 1) for t in (-1, 1)]
    points = np.array([p[-k:] + p[:-k] if k else p for k in range(3) for p in corners])
    distance = np.linalg.norm(points[:, None] - points[None], axis=2)
    near = np.abs(distance - 2.0) < 1e-9
    faces = np.array([(a, b, c) for a in range(12) for b in range(a) for c in range(b) if near[a, b] and near[b, c] and near[a, c]])
    triangles = points[faces]
    for _ in range(2):
        a, b, c = (triangles[:, i] for i in range(3))
        d, e, f = a + b, b + c, c + a
        triangles = np.concatenate([np.stack(corner, axis=1) for corner in ((a, d, f), (d, b, e), (f, e, c), (d, e, f))])
        triangles /= np.linalg.norm(triangles, axis=2, keepdims=True)
    inward = dot(np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0]), triangles[:, 0]) < 0.0
    triangles[inward] = triangles[inward][:, ::-1]
    triangles /= np.linalg.norm(triangles, axis=2, keepdims=True)
    vertices = triangles.reshape(-1, 3)
    where = np.asarray(luminaire.position_m) + luminaire.radius_m * vertices
    return Mesh(where.astype(np.float32), vertices.astype(np.float32), np.arange(len(vertices), dtype=np.uint32).reshape(-1, 3), UNMAPPED)


def luminaire_emission(luminaire: Luminaire, mesh: Mesh, profile: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the greatest luminance RGB (3,) in cd/m2 of the ball."""
    color = np.asarray(luminaire.color, np.float64)
    if not luminaire.on or not float(matmul(color, LUMINANCE)) > 0.0:
        return np.zeros(3)
    return np.asarray(
        color * (luminaire.flux_lm / (0.25 * surface_area(mesh) * profile_integral(profile)) / float(matmul(color, LUMINANCE)))
    )


def profile_row(luminaire: Luminaire, profile: NDArray[np.float64]) -> NDArray[np.float32]:
    """Return unit axis and profile, (3 + STEPS,)."""
    axis = np.asarray(luminaire.direction, np.float64)
    return np.concatenate([axis / norm(axis), profile]).astype(np.float32)


def brightest_seen(rows: NDArray[np.float32], normals: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the most of a profile that faces (m,) send to any side, within 90 degrees of their normals (m, 3).

    ``rows``: (m, 3 + STEPS), axis and profile of each face's light; ``normals``: (m, 3), unit.
    """
    angles = np.linspace(0.0, math.pi, STEPS)
    off = el.arccos(np.clip(dot(rows[:, :3].astype(np.float64), normals), -1.0, 1.0))
    slack = 0.5 * math.pi + math.pi / (STEPS - 1)
    seen = np.abs(angles[None] - off[:, None]) <= slack
    return np.asarray(np.where(seen, rows[:, 3:], 0.0).max(axis=1))


@kernel
def profile_toward(profiles: NDArray[np.float32], row: int, x: np.float32, y: np.float32, z: np.float32) -> np.float32:
    """Return the share of its greatest luminance that a light sends along a unit direction."""
    cosine = profiles[row, 0] * x + profiles[row, 1] * y + profiles[row, 2] * z
    place = np.arccos(min(max(cosine, -_ONE), _ONE)) * _PER_RADIAN
    i = min(int(place), STEPS - 2)
    s = place - np.float32(i)
    value: np.float32 = profiles[row, 3 + i] + s * (profiles[row, 4 + i] - profiles[row, 3 + i])
    return value
