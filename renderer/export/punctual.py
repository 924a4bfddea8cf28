"""The lamps of a scene as lights without size: points, and spots with the cone of KHR_lights_punctual.

In the extension's words a spot sends, at an angle t from its axis, the intensity I max(0, min(1, (cos t - cos outer) / (cos inner - cos
outer)))^2; its ``intensity`` is the I on the axis, in candela.
"""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

import kernel_cache.elementary as el
from renderer.core.color import LUMINANCE
from renderer.geometry.mesh import Mesh
from renderer.scene.flat_scene import FlatScene
from renderer.scene.spot_lights import STEPS, intensity_profile
from scene_description import Light, Luminaire, SceneDescription
from scene_description.products import matmul

_ANGLES = np.linspace(0.0, math.pi, STEPS)
_STEPS = np.linspace(-1.0, 1.0, 41)
_FINEST_RAD, _LEAST_FALL = 1e-4, 1e-3

Vector = tuple[float, float, float]


class Cone(NamedTuple):
    """A spot's half angles, radians: full intensity up to ``inner``, none from ``outer`` on; forward: 1 along the profile's axis, or -1."""

    inner_rad: float
    outer_rad: float
    forward: int


class PunctualLight(NamedTuple):
    """A lamp that is on.

    object, part: what shines, 0 and ``luminaire_<n>`` where no object holds it; position_m: world; direction: unit, where a spot points;
    color: linear RGB, the brightest channel 1; intensity_cd: on the axis, of each channel times ``color``; cone: None for a point.
    """

    object: int
    part: str
    position_m: Vector
    direction: Vector
    color: Vector
    intensity_cd: float
    cone: Cone | None
    flux_lm: float
    color_temperature_k: float


def punctual_lights(scene: SceneDescription, flat: FlatScene, meshes: Sequence[Mesh]) -> list[PunctualLight]:
    """Return every lamp of a scene that is on, with its whole flux.

    Lamps of objects are points in the middle of the surface that shines.  Luminaires are points, or spots whose cone is the nearest to
    their profile.  ``meshes`` are those of the parts, in the world.
    """
    rows = {name: row for row, name in enumerate(flat.part_names)}
    found = []
    for light in scene.lights:
        if light.on and light.flux_lm > 0.0:
            place = _middle(meshes[rows[f"{light.object}/{light.part}"]])
            found.append(_light(light, light.object, light.part, place, (0.0, 0.0, -1.0), None))
    for index, luminaire in enumerate(scene.luminaires):
        if luminaire.on and luminaire.flux_lm > 0.0 and any(luminaire.color):
            cone = fit_cone(intensity_profile(luminaire))
            turned = 1.0 if cone is None else float(cone.forward)
            x, y, z = (turned * item / math.hypot(*luminaire.direction) for item in luminaire.direction)
            found.append(_light(luminaire, 0, f"luminaire_{index}", luminaire.position_m, (x, y, z), cone))
    return found


def _light(lamp: Light | Luminaire, owner: int, part: str, place: Vector, direction: Vector, cone: Cone | None) -> PunctualLight:
    r, g, b = (float(item) / max(lamp.color) for item in lamp.color)
    candela = lamp.flux_lm / cone_solid_angle(cone) / float(matmul(np.array((r, g, b)), LUMINANCE))
    return PunctualLight(owner, part, place, direction, (r, g, b), candela, cone, lamp.flux_lm, lamp.color_temperature_k)


def _middle(mesh: Mesh) -> Vector:
    """Return the mean over the area of a surface."""
    corners = mesh.vertices[mesh.faces].astype(np.float64)
    area = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    x, y, z = ((corners.mean(axis=1) * area[:, None]).sum(axis=0) / area.sum()).tolist()
    return x, y, z


def cone_solid_angle(cone: Cone | None) -> float:
    """Return flux over the intensity on the axis, steradian: the integral of the falloff, 4 pi for a point."""
    if cone is None:
        return 4.0 * math.pi
    inner, outer = math.cos(cone.inner_rad), math.cos(cone.outer_rad)
    return 2.0 * math.pi * (1.0 - inner + (inner - outer) / 3.0)


def fit_cone(profile: NDArray[np.float64]) -> Cone | None:
    """Return the cone that is nearest to a profile of intensity, both at the same flux, or None where a point is nearer.

    Nearest in the mean square over all directions.  A cone ends at a right angle at most.

    ``profile`` (STEPS,): intensity at even angles from the direction to its opposite.
    """
    even = np.ones((1, STEPS))
    best, least = None, float(_misfit(profile, even)[0])
    for forward in (1, -1):
        middle, reach = (0.25 * math.pi, 0.25 * math.pi), 0.25 * math.pi
        while reach > _FINEST_RAD:
            inner, outer = (np.clip(at + reach * _STEPS, 0.0, 0.5 * math.pi) for at in middle)
            inner, outer = (grid.ravel() for grid in np.meshgrid(inner, outer))
            wide = el.cos(inner) - el.cos(outer) >= _LEAST_FALL
            inner, outer = inner[wide], outer[wide]
            misfit = _misfit(profile[::forward], _falloff(inner, outer))
            chosen = int(misfit.argmin())
            middle, reach = (float(inner[chosen]), float(outer[chosen])), reach * 2.0 * float(_STEPS[1] - _STEPS[0])
            if misfit[chosen] < least:
                best, least = Cone(*middle, forward), float(misfit[chosen])
    return best


def _falloff(inner: NDArray[np.float64], outer: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the intensities (k, STEPS) of cones with these half angles (k,), over those on their axes."""
    low, high = el.cos(outer)[:, None], el.cos(inner)[:, None]
    return np.asarray(np.clip((el.cos(_ANGLES) - low) / (high - low), 0.0, 1.0) ** 2)


def _misfit(profile: NDArray[np.float64], others: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the squared difference (k,) of intensities (k, STEPS) from a profile (STEPS,), all at a flux of 1."""
    weight = el.sin(_ANGLES)
    one, many = profile / matmul(profile, weight), others / matmul(others, weight)[:, None]
    return np.asarray(matmul((many - one) ** 2, weight))
