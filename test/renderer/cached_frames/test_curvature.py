"""Lobes of pixels across which a surface bends: by how much, and that a thin shiny rod does not break up."""

from itertools import pairwise

import numpy as np
import pytest
from box_room import box, pose, quad, scene
from cached_rooms import CACHED
from numpy.testing import assert_allclose

from renderer import CameraConfig, RenderConfig, Renderer
from renderer.cached_frames import curvature as cv
from renderer.cached_frames.curvature import bend_of_faces
from renderer.core.kernel import from_python

RADIUS_M, SIDES = 0.02, 24
widened = from_python(cv.widened)


def rod(flat, object_id):
    """The same scene, in which the boxes of an object are shaded like a round rod along y."""
    normals = flat.mesh.normals.copy()
    faces = flat.mesh.faces[flat.parts.object_id[flat.face_part] == object_id]
    for vertex in np.unique(faces):
        x, _, z = flat.mesh.vertices[vertex] - (0.0, 0.0, 1.0)
        normals[vertex] = np.array([x, 0.0, z]) / np.hypot(x, z)
    return flat._replace(mesh=flat.mesh._replace(normals=normals))


def strips(**material):
    """Faces of a prism of many sides about the line x = 0, z = 1."""
    turns = np.linspace(0.0, 2.0 * np.pi, SIDES + 1)
    ring = RADIUS_M * np.stack([np.cos(turns), np.zeros(SIDES + 1), np.sin(turns)], axis=1) + (0.0, 0.0, 1.0)
    return [quad(a - (0, 0.5, 0), (0, 1.0, 0), b - a, object_id=3, name="3/rod", **material) for a, b in pairwise(ring)]


def test_a_rod_bends_as_its_radius_says_and_what_is_flat_does_not() -> None:
    flat = rod(scene(box((-2, -2, 0), (2, 2, 2.5), inside=True, object_id=0), *strips()), 3)
    bend, round_ = bend_of_faces(flat), flat.parts.object_id[flat.face_part] == 3
    assert_allclose(bend[round_], 1.0 / RADIUS_M, rtol=0.02)
    assert_allclose(bend[~round_], 0.0)


def test_slopes_within_a_pixel_add_to_those_of_the_microfacets() -> None:
    rng, width_m = np.random.default_rng(3), 0.004
    turn = width_m / np.sqrt(2.0) / RADIUS_M * rng.uniform(-0.5, 0.5, 100_000)
    # Of slopes along one axis, alpha^2 = 2 sigma^2 in the mean of both axes.
    assert widened(np.float32(0.05), np.float32(1.0 / RADIUS_M), np.float32(width_m)) == pytest.approx(
        np.sqrt(0.05**2 + turn.var()), rel=0.02
    )
    assert widened(np.float32(0.2), np.float32(0.0), np.float32(width_m)) == pytest.approx(0.2)


def test_a_thin_shiny_rod_is_even_along_its_length() -> None:
    """A lamp shows as one line along it, less than a pixel wide, which few rays of pixels meet."""
    lamp = quad((-0.1, -1, 2.4), (0, 2, 0), (0.2, 0, 0), emission=(3e3,) * 3, object_id=2)
    flat = rod(scene(box((-2, -2, 0), (2, 2, 2.5), inside=True, object_id=0), lamp, *strips(color=(0.02,) * 3, roughness=0.05, ior=1.5)), 3)
    camera, view, found = CameraConfig(width=64, height=48), pose((1.7, 0.1, 1.3), (0, 0, 1.0)), []
    for config in (CACHED, RenderConfig(samples_per_pixel=256, threads=2)):
        with Renderer(flat, camera, config, 5) as renderer:
            frame = renderer.render(view, 0, ("radiance", "instance"))
        found.append(np.where(frame.layers["instance"] == 3, frame.radiance.sum(axis=-1), 0.0).sum(axis=0)[22:42])
    cached, traced = found
    assert traced.min() > 0.0 and cached.mean() == pytest.approx(traced.mean(), rel=0.25)
    assert (cached / traced).std() < 0.2
