"""Light groups: bounds that never cut light off, draws that follow the densities."""

import numpy as np
import pytest
from box_room import DARK, box, emitter_column, furnished_room, quad, scene

from renderer.core.kernel import from_python
from renderer.path import infinite_light
from renderer.path import lights as light_kernels
from renderer.path import lights as lt
from renderer.path.lights import build_lights
from renderer.scene.flat_scene import Sky

sky_le = from_python(infinite_light.sky_le)

choose_emitter = from_python(light_kernels.choose_emitter)
importance = from_python(light_kernels.importance)
load_bounds = from_python(light_kernels.load_bounds)
sample_triangle = from_python(light_kernels.sample_triangle)


def test_groups_are_the_flat_sides_of_each_lamp():
    lights = build_lights(furnished_room())
    area, power = lights.groups.area, lights.groups.bounds[:, 10]
    lamp_side, lamp_face, pane = 0.2 * 0.1, 0.2 * 0.2, 1.6 * 1.2
    np.testing.assert_allclose(np.sort(area), sorted([pane, lamp_side, lamp_side, lamp_side, lamp_side, lamp_face, lamp_face]), rtol=1e-5)
    weights = [0.2126, 0.7152, 0.0722]
    day = 0.8 * 0.5 * (np.dot(weights, 0.5 * np.add([2500, 3500, 6000], [6000, 6500, 7500])) + np.dot(weights, [900, 850, 700]))
    assert power[area.argmax()] == pytest.approx(pane * day, rel=1e-5)
    assert power.sum() - power.max() == pytest.approx(0.16 * np.dot(weights, (9000, 7000, 4500)), rel=1e-5)
    assert (lights.face_group >= 0).sum() == 14 and len(lights.part) == 14


def test_no_light_is_cut_off():
    """Wherever a triangle's front and a surface see each other, the group has an importance; it is a mere bound times power."""
    rng = np.random.default_rng(8)
    flat = scene(*(box(low, low + rng.uniform(0.05, 1, 3), emission=(1, 1, 1)) for low in rng.uniform(-2, 2, (6, 3))))
    flat.mesh.vertices[:] += rng.normal(0, 0.05, flat.mesh.vertices.shape).astype(np.float32)
    lights = build_lights(flat)
    corner, edge_1, edge_2, normals = (
        emitter_column(lights, c) for c in (lt.EMITTER_CORNER, lt.EMITTER_EDGE_1, lt.EMITTER_EDGE_2, lt.EMITTER_NORMAL)
    )
    seen, important_without_light = 0, 0
    for _ in range(4000):
        point, normal = rng.uniform(-3, 3, 3).astype(np.float32), rng.normal(size=3)
        normal = (normal / np.linalg.norm(normal)).astype(np.float32)
        group = rng.integers(len(lights.groups.area))
        members = range(lights.groups.start[group], lights.groups.start[group + 1])
        a, b = np.sort(rng.random((2, 50, 1)), axis=0)
        lit = False
        for e in members:
            way = corner[e] + a * edge_1[e] + (1 - b) * edge_2[e] - point
            lit |= bool(((way @ normal > 0) & (way @ normals[e] < 0)).any())
        value = importance(load_bounds(lights.groups, group), *point, *normal)
        assert np.isfinite(value) and value >= 0
        assert value > 0 or not lit
        seen += lit
        important_without_light += value > 0 and not lit
    assert seen > 500
    assert important_without_light < 600  # the bounds are useful too


def test_draws_are_even_over_a_group():
    flat = scene(box((0, 0, 0), (1, 2, 3), emission=(1, 1, 1)), quad((0, 0, 5), (2, 0, 0), (0, 1, 0), emission=(3, 3, 3)))
    lights = build_lights(flat)
    corner, edge_1, edge_2 = (emitter_column(lights, c) for c in (lt.EMITTER_CORNER, lt.EMITTER_EDGE_1, lt.EMITTER_EDGE_2))
    n = 100
    for group, area in enumerate(lights.groups.area):
        points = []
        for u, v in (np.stack(np.meshgrid(*2 * [(np.arange(n) + 0.5) / n]), -1).reshape(-1, 2)).astype(np.float32):
            e, within = choose_emitter(lights, group, u)
            assert lights.groups.start[group] <= e < lights.groups.start[group + 1]
            s, t = sample_triangle(within, v)
            assert s >= 0 and t >= 0 and s + t <= 1 + 1e-6
            points.append(corner[e] + s * edge_1[e] + t * edge_2[e])
        points = np.array(points)
        low, size = points.min(axis=0), np.ptp(points, axis=0)
        u, v = np.flatnonzero(size > 0.01)
        assert size[u] * size[v] == pytest.approx(area, rel=0.02)
        counts = np.histogram2d(points[:, u], points[:, v], bins=5, range=[[low[u], low[u] + size[u]], [low[v], low[v] + size[v]]])[0]
        np.testing.assert_allclose(counts / n**2, 1 / 25, rtol=0.1)


def test_unequal_triangles_are_drawn_by_area():
    flat = scene(quad((0, 0, 0), (1, 0, 0), (0, 1, 0), emission=(1, 1, 1)))
    flat.mesh.vertices[3] = (0, 9, 0)
    lights = build_lights(flat)
    counts = np.bincount([choose_emitter(lights, 0, np.float32(u))[0] for u in (np.arange(1000) + 0.5) / 1000])
    np.testing.assert_allclose(counts, [1000 * 0.5 / 5.0, 1000 * 4.5 / 5.0], atol=1)


def test_what_does_not_shine_is_left_out():
    dark_pane = quad((0, 0, 0), (1, 0, 0), (0, 1, 0), portal=True, transmission=0.0)
    sliver = quad((0, 0, 0), (1, 0, 0), (2, 0, 0), emission=(5, 5, 5))
    lights = build_lights(scene(dark_pane, sliver, box((0, 0, 0), (1, 1, 1))))
    assert len(lights.part) == 0 and len(lights.groups.area) == 0 and lights.groups.start.tolist() == [0]
    assert (lights.face_group == -1).all()


def test_the_sky_is_linear_in_the_sine_of_elevation():
    sky = Sky(*(np.full(3, level, np.float32) for level in (100, 40, 10)))
    values = [sky_le(sky, np.float32(0), np.float32(1), np.float32(z))[1] for z in (1.0, 0.5, 0.0, -0.01, -1.0)]
    np.testing.assert_allclose(values, [100, 70, 40, 10, 10])
    assert sky_le(DARK, np.float32(0), np.float32(1), np.float32(0.3)) == (0, 0, 0)
