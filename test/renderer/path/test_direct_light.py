"""Drawing lights: directions follow the density that is stated for them, over many lights of all shapes, and where rays find them too."""

import numpy as np
import pytest
from box_room import box, emitter_column, quad, scene
from numba import njit

from renderer.core import lanes as ln
from renderer.core.kernel import from_python
from renderer.core.ray_packet import LANES
from renderer.path import lights as light_kernels
from renderer.path import lights as lt
from renderer.path.direct_light import weigh_lights
from renderer.path.light_sampling import sample_emitters
from renderer.path.lights import build_lights
from renderer.path.records import make_scratch
from renderer.path.surface_tables import build_surfaces
from renderer.scene.flat_scene import Sky
from renderer.scene.spot_lights import intensity_profile, luminaire_emission, luminaire_mesh, profile_row
from scene_description import Luminaire

importance = from_python(light_kernels.importance)
load_bounds = from_python(light_kernels.load_bounds)

DAY = Sky(*(np.full(3, level, np.float32) for level in (3000, 2000, 500)))


def lights_all_around():
    """Two lamps of quite different size and power, a tilted one, a box of light and two panes, none before another from the origin."""
    return scene(
        quad((-0.6, -0.5, 2.0), (0, 1.0, 0), (1.2, 0, 0), emission=(40, 40, 40)),
        quad((1.2, 1.2, 1.5), (0, 0.1, 0), (0.1, 0, 0), emission=(3000, 3000, 3000)),
        quad((-1.5, -0.2, 0.3), (0, 0.5, 0), (0.4, 0, 0.8), emission=(100, 100, 100)),
        box((1.0, -1.4, 0.4), (1.4, -1.0, 0.9), emission=(200, 150, 100)),
        quad((-1.2, 2.5, 0.2), (0.9, 0, 0), (0, 0, 1.0), portal=True, transmission=0.8, ior=1.5),
        quad((0.2, 2.5, 0.2), (0.9, 0, 0), (0, 0, 1.0), portal=True, transmission=0.8, ior=1.5),
        sky=DAY,
    )


@njit
def draw(surfaces, lights, scratch, numbers):
    """Rows (x, y, z, light_pdf) of samples in lane 0."""
    rows = np.zeros((len(numbers), 4), np.float32)
    weigh_lights(lights, scratch)
    lanes = scratch.lanes
    for i in range(len(numbers)):
        lanes[ln.U_LIGHT_0], lanes[ln.U_LIGHT_1] = numbers[i, 0], numbers[i, 1]
        sample_emitters(surfaces, lights, scratch)
        rows[i, 0], rows[i, 1], rows[i, 2] = lanes[ln.TO_LIGHT_X], lanes[ln.TO_LIGHT_Y], lanes[ln.TO_LIGHT_Z]
        rows[i, 3] = lanes[ln.LIGHT_PDF]
    return rows


def stated_density(lights, normal, ways):
    """Density per steradian of drawing each unit direction (n, 3) from the origin, by intersecting every emitter."""
    groups, origin = lights.groups, np.zeros(3, np.float32)
    importances = np.array([importance(load_bounds(groups, g), *origin, *normal) for g in range(len(groups.area))])
    importances = importances / importances.sum()
    columns = (lt.EMITTER_EDGE_1, lt.EMITTER_EDGE_2, lt.EMITTER_CORNER, lt.EMITTER_NORMAL)
    tables = [emitter_column(lights, column).astype(np.float64) for column in columns]
    density = np.zeros(len(ways))
    for e in range(len(lights.part)):
        group = np.searchsorted(lights.groups.start, e, side="right") - 1
        a, b, corner, n = (table[e] for table in tables)
        facing = ways @ n
        distance = (corner @ n) / np.where(facing < 0, facing, -1.0)
        points = ways * distance[:, None] - corner
        weights = np.linalg.lstsq(np.column_stack([a, b]), points.T, rcond=None)[0]
        hit = (facing < 0) & (distance > 0) & (weights >= 0).all(axis=0) & (weights.sum(axis=0) <= 1)
        density += np.where(hit, importances[group] * distance**2 / (lights.groups.area[group] * -facing), 0.0)
    return np.where(ways @ normal > 0, density, 0.0)


@pytest.mark.parametrize("normal", [(0.0, 0.0, 1.0), (0.6, 0.48, 0.64), (-0.8, 0.6, 0.0)])
def test_draws_of_lights_follow_their_density(normal):
    """Chi-square over cells of the sphere, equal in height and angle; and the light_pdf of each sample is that density."""
    flat = lights_all_around()
    lights, surfaces = build_lights(flat), build_surfaces(flat)
    normal = np.array(normal, np.float32)
    scratch = make_scratch(len(lights.groups.area))
    scratch.lanes[ln.HIT] = 1.0
    for axis in range(3):
        scratch.lanes[ln.NS_X + LANES * axis] = scratch.lanes[ln.NG_X + LANES * axis] = normal[axis]
    count, heights, turns, fine = 40000, 24, 36, 14
    rows = draw(surfaces, lights, scratch, np.random.default_rng(3).random((count, 2), dtype=np.float32)).astype(np.float64)
    sampled = rows[rows[:, 3] > 0]
    ways = sampled[:, :3] / np.linalg.norm(sampled[:, :3], axis=1, keepdims=True)
    stated = stated_density(lights, normal.astype(np.float64), ways)
    inside = stated > 0  # a draw on the very edge of a triangle may be off it by a rounding
    assert inside.mean() > 0.998
    np.testing.assert_allclose(sampled[inside, 3], stated[inside], rtol=2e-3)
    counts = np.histogram2d(ways[:, 2], np.arctan2(ways[:, 1], ways[:, 0]), bins=[heights, turns], range=[[-1, 1], [-np.pi, np.pi]])[0]
    z = -1 + 2 * (np.arange(heights * fine) + 0.5) / (heights * fine)
    turn = -np.pi + 2 * np.pi * (np.arange(turns * fine) + 0.5) / (turns * fine)
    zz, tt = np.meshgrid(z, turn, indexing="ij")
    flat_part = np.sqrt(1 - zz**2)
    grid = np.stack([flat_part * np.cos(tt), flat_part * np.sin(tt), zz], axis=-1).reshape(-1, 3)
    cells = stated_density(lights, normal.astype(np.float64), grid).reshape(heights, fine, turns, fine)
    expected = cells.mean(axis=(1, 3)) * (4 * np.pi / (heights * turns)) * count
    # What the grid misses of the edges of lights: the standard error of a cell's mean over its own points.
    blur = cells.std(axis=(1, 3)) / fine**1.5 * (4 * np.pi / (heights * turns)) * count
    big = expected > 8
    assert big.sum() > 15
    chi = ((counts[big] - expected[big]) ** 2 / (expected[big] + blur[big] ** 2)).sum()
    assert chi < big.sum() + 5 * np.sqrt(2 * big.sum())
    assert abs(counts.sum() - expected.sum()) < 5 * np.sqrt(count * 0.25 + (blur**2).sum())


@pytest.mark.parametrize("kind", ["point", "spot"])
def test_light_pdfs_of_a_near_ball_integrate_to_its_solid_angle(kind):
    """The mean of 1 / density over draws is the solid angle of what shines, that of direction / density the integral of directions.

    Both are known of a cone: 2 pi (1 - cos a) and pi sin^2 a; the ball of 320 triangles fills 1.5 % less.
    """
    center, radius = np.array([0.2, 0.1, 0.25]), 0.12
    shape = {"beam_rad": 0.9, "field_rad": 1.4} if kind == "spot" else {}
    white = {"flux_lm": 500.0, "color_temperature_k": 3000.0, "color": (1.0, 1.0, 1.0)}
    ball = Luminaire(kind=kind, position_m=tuple(center), radius_m=radius, **white, **shape)
    mesh, profile = luminaire_mesh(ball), intensity_profile(ball)
    shine = tuple(luminaire_emission(ball, mesh, profile))
    lit = scene(box((0, 0, 0), (1, 1, 1))._replace(vertices=mesh.vertices, faces=mesh.faces.astype(np.int64), emission=shine))
    lit = lit._replace(absorbs=np.array([True]), part_profile=np.zeros(1, np.int32), profiles=profile_row(ball, profile)[None])
    lights, surfaces = build_lights(lit), build_surfaces(lit)
    scratch = make_scratch(len(lights.groups.area))
    scratch.lanes[ln.HIT] = 1.0
    scratch.lanes[ln.NS_Z] = scratch.lanes[ln.NG_Z] = 1.0
    rows = draw(surfaces, lights, scratch, np.random.default_rng(5).random((60_000, 2), dtype=np.float32)).astype(np.float64)
    weight = np.divide(1.0, rows[:, 3], where=rows[:, 3] > 0, out=np.zeros(len(rows)))
    ways = rows[:, :3] / np.linalg.norm(rows[:, :3], axis=1, keepdims=True)
    distance = np.linalg.norm(center)
    sine = radius / distance
    assert weight.mean() == pytest.approx(2 * np.pi * (1 - np.sqrt(1 - sine**2)), rel=0.025)
    np.testing.assert_allclose((weight[:, None] * ways).mean(axis=0), np.pi * sine**2 * center / distance, rtol=0.04)
