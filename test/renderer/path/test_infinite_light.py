"""The sun and bright maps through panes: irradiance, shadows' edges, mirrors, samples against their pdf."""

import math

import numpy as np
import pytest
from box_room import DARK, box, pose, quad, scene

from renderer import CameraConfig, RenderConfig, Renderer
from renderer.core import lanes as ln
from renderer.core.kernel import from_python
from renderer.core.ray_packet import LANES
from renderer.path import infinite_light, light_sampling
from renderer.path.lights import build_lights

sample_infinite = from_python(infinite_light.sample_infinite)
infinite_le = from_python(infinite_light.infinite_le)

intersect_portals = from_python(light_sampling.intersect_portals)

RADIUS_RAD = math.radians(0.533 / 2)
VERSINE = 1.0 - math.cos(RADIUS_RAD)
SOLID_ANGLE = 2.0 * math.pi * VERSINE
LUX = np.array([90_000.0, 80_000.0, 60_000.0])


def sun(direction, lux=LUX):
    """A dark sky with a sun of this normal illuminance."""
    way = np.array(direction, float) / np.linalg.norm(direction)
    return DARK._replace(sun=np.array([*way, VERSINE, *(lux / SOLID_ANGLE)], np.float32))


def bright_map(seed=4, height=16, width=32):
    """A black map with a few bright pixels above the horizon."""
    rng = np.random.default_rng(seed)
    bright = np.zeros((height, width, 3), np.float32)
    rows, columns = rng.integers(1, height // 2, 5), rng.integers(0, width, 5)
    bright[rows, columns] = rng.uniform(1e3, 1e5, (5, 3))
    return DARK._replace(table=np.zeros((height, width, 3), np.float32), bright=bright)


def radiance(flat, view, depth=3, samples=64, fov=0.2, size=(16, 12), **settings):
    camera = CameraConfig(width=size[0], height=size[1], horizontal_fov_rad=fov)
    config = RenderConfig(samples_per_pixel=samples, max_depth=depth, threads=1, **settings)
    with Renderer(flat, camera, config, 5) as renderer:
        return renderer.render(view, 0, ("color",)).radiance.astype(np.float64)


FLOOR = quad((-5, -5, 0), (10, 0, 0), (0, 10, 0), color=(0.8, 0.4, 0.2), roughness=1.0)
PANE = quad((-1, 2, 0.5), (2, 0, 0), (0, 0, 2), portal=True, transmission=0.9)  # looks to -y, into the room
SUN = (0.1, 1.0, 1.0)


def lit_spot(height=1.5):
    """The floor point that sees the sun through the middle of the pane at this height."""
    way = np.array(SUN) / np.linalg.norm(SUN)
    return tuple(np.array([0.0, 2.0, height]) - way * (height / way[2]))


def view_of(spot):
    return pose((spot[0] + 0.2, spot[1] - 0.5, 1.0), spot)


@pytest.mark.parametrize("depth", [2, 4])
def test_a_floor_in_the_sun_is_lit_by_lambert(depth):
    flat = scene(FLOOR, PANE, sky=sun(SUN))
    seen = radiance(flat, view_of(lit_spot()), depth, samples=32, fov=0.05)
    cosine = SUN[2] / np.linalg.norm(SUN)
    expected = LUX * cosine * 0.9 * np.array([0.8, 0.4, 0.2]) / math.pi
    # The material's dielectric coat takes part of the light; ratio of channels and level within what it takes.
    level = seen.mean(axis=(0, 1)) / expected
    assert level == pytest.approx(level.mean(), rel=0.15) and 0.85 < level.mean() < 1.05


def test_beside_the_patch_there_is_no_sun_and_its_edge_is_as_wide_as_the_sun():
    flat = scene(FLOOR, PANE, sky=sun(SUN))
    way = np.array(SUN) / np.linalg.norm(SUN)
    edge = np.array([0.0, 2.0, 2.5]) - way * (2.5 / way[2])  # shadow of the pane's upper edge
    distance = 2.5 / way[2]
    width = distance * 2.0 * RADIUS_RAD / way[2]  # along the floor, of the penumbra
    levels = []
    for offset in (-1.5, -0.25, 0.0, 0.25, 1.5):
        spot = (edge[0], edge[1] + offset * width, 0.0)
        above = pose((spot[0] + 1e-4, spot[1], 1.0), spot)
        levels.append(radiance(flat, above, 2, samples=512, fov=0.002, size=(2, 2)).mean())
    levels = np.array(levels) / levels[-1]
    assert levels[0] == 0.0 and levels[-1] == 1.0
    assert levels[2] == pytest.approx(0.5, abs=0.05)
    assert 0.1 < levels[1] < 0.3 and 0.7 < levels[3] < 0.9


def test_a_blocker_casts_a_shadow():
    spot = lit_spot()
    way = np.array(SUN) / np.linalg.norm(SUN)
    middle = np.array(spot) + way
    blocker = box(tuple(middle - 0.1), tuple(middle + 0.1), color=(0, 0, 0))
    assert radiance(scene(FLOOR, PANE, blocker, sky=sun(SUN)), view_of(spot), 2, fov=0.02).max() == 0.0


def test_camera_and_mirrors_see_the_disc_with_a_darker_limb():
    flat = scene(FLOOR, PANE, sky=sun(SUN))
    spot = lit_spot()
    eye = tuple(np.array(spot) + 0.3 * np.array(SUN))
    aimed = tuple(np.array(eye) + np.array(SUN))
    disc = radiance(flat, pose(eye, aimed), 2, samples=16, fov=4 * RADIUS_RAD, size=(64, 64))[..., 0] / 0.9
    mean = LUX[0] / SOLID_ANGLE
    lit = disc > 0.25 * mean
    assert lit.mean() == pytest.approx(math.pi / 16, rel=0.05)
    assert disc[31:33, 31:33].mean() / mean == pytest.approx(1.0 / 0.8, rel=0.01)
    assert disc[lit].mean() / mean == pytest.approx(1.0, rel=0.05)
    mirror = quad((-5, -5, 0), (10, 0, 0), (0, 10, 0), color=(1, 1, 1), metallic=1.0, roughness=0.0)
    above = np.array(spot) + 0.5 * np.array([-SUN[0], -SUN[1], SUN[2]])
    seen = radiance(scene(mirror, PANE, sky=sun(SUN)), pose(tuple(above), spot), 3, samples=64, fov=12 * RADIUS_RAD, size=(32, 32))
    assert seen[..., 0].max() > 0.2 * mean


@pytest.mark.parametrize("roughness", [0.15, 0.4, 1.0])
def test_drawing_the_sun_and_finding_it_agree(roughness):
    """One bounce with a ray that may find the sun (shared) against drawn light alone (the last hit counts it in full)."""
    floor = quad((-5, -5, 0), (10, 0, 0), (0, 10, 0), color=(0.6, 0.6, 0.6), roughness=roughness, metallic=1.0)
    big = sun(SUN)
    big.sun[3] = 1.0 - math.cos(0.1)  # wide enough to be found
    big.sun[4:] = 1000.0
    flat = scene(floor, PANE, sky=big)
    spot = lit_spot()
    above = pose(tuple(np.array(spot) + 0.5 * np.array([-0.1, -1.0, 0.9])), spot)
    short, long = (radiance(flat, above, depth, samples=2048, fov=0.1, size=(8, 8)).mean() for depth in (2, 3))
    assert short > 0 and long == pytest.approx(short, rel=0.02)


@pytest.mark.parametrize("sky", [sun((0.3, 0.2, 0.8)), bright_map()])
def test_samples_follow_their_pdf(sky):
    """Draws, binned, against the integral of the stated density; and their weights integrate luminance."""
    infinite = build_lights(scene(FLOOR, PANE, sky=sky)).infinite
    n = 128
    numbers = ((np.stack(np.meshgrid(*2 * [np.arange(n)]), -1).reshape(-1, 2) + 0.5) / n).astype(np.float32)
    flux = np.zeros(3)
    for u, v in numbers:
        x, y, z = sample_infinite(infinite, u, v)
        assert x * x + y * y + z * z == pytest.approx(1.0, abs=1e-5)
        r, g, b, pdf = infinite_le(infinite, x, y, z)
        if pdf > 0:  # rounding may put a draw just beyond the rim
            flux += np.array([r, g, b]) / pdf / len(numbers)
    if len(sky.sun):
        expected = sky.sun[4:] * SOLID_ANGLE
    else:
        edges = np.sin(np.linspace(0.5 * np.pi, -0.5 * np.pi, 17))
        expected = (sky.bright * ((edges[:-1] - edges[1:]) * 2 * np.pi / 32)[:, None, None]).sum(axis=(0, 1))
    assert flux == pytest.approx(expected, rel=0.02)


def pane_ahead(infinite, origin, way):
    """Return the pane that lane 5 meets and how far it is, with its neighbours looking elsewhere."""
    lanes, sampled = np.full(ln.LANES_SIZE, np.nan, np.float32), np.zeros(LANES, np.int32)
    for axis in range(3):
        lanes[ln.P_X + LANES * axis + 5] = origin[axis]
        lanes[ln.TO_LIGHT_X + LANES * axis + 5] = way[axis]
    intersect_portals(infinite, lanes, sampled)
    assert (np.delete(sampled, 5) == -1).all()
    return sampled[5], lanes[ln.PORTAL_T + 5]


def test_rays_find_the_pane_from_inside_only():
    infinite = build_lights(scene(FLOOR, PANE, sky=sun(SUN))).infinite
    rng = np.random.default_rng(1)
    for _ in range(300):
        origin, target = rng.uniform((-2, -2, 0), (2, 1.9, 3)), rng.uniform((-2, 2, 0), (2, 2, 3))
        way = target - origin
        length = np.linalg.norm(way)
        pane, distance = pane_ahead(infinite, origin, way / length)
        within = -1 < target[0] < 1 and 0.5 < target[2] < 2.5
        assert (pane >= 0) == within
        if within:
            assert distance == pytest.approx(length, rel=1e-4)
        assert pane_ahead(infinite, target + way, -way / length)[0] == -1


def test_a_map_lights_as_its_pixels_do():
    sky = bright_map()
    flat = scene(FLOOR, quad((-4, 2, 0.01), (8, 0, 0), (0, 0, 6), portal=True, transmission=1.0), sky=sky)
    spot = np.array([0.0, 1.0, 0.0])
    seen = radiance(flat, pose((0.2, 0.5, 1.0), tuple(spot)), 2, samples=4096, fov=0.01, size=(2, 2)).mean(axis=(0, 1))
    height, width = sky.bright.shape[:2]
    fine = 24
    z = np.sin(np.pi * (0.5 - (np.arange(height * fine) + 0.5) / (height * fine)))
    yaw = np.pi - 2 * np.pi * (np.arange(width * fine) + 0.5) / (width * fine)
    level = np.sqrt(1 - z**2)[:, None]
    x, y, z = np.broadcast_arrays(level * np.cos(yaw), level * np.sin(yaw), z[:, None])
    ahead = np.where(y > 0, 1.0 / np.maximum(y, 1e-9), np.inf)
    through = (y > 0) & (np.abs(spot[0] + ahead * x) < 4) & (ahead * z > 0.01) & (ahead * z < 6.01)
    angle = np.pi / (height * fine) * 2 * np.pi / (width * fine) * level
    irradiance = (np.repeat(np.repeat(sky.bright, fine, 0), fine, 1) * (through * np.maximum(z, 0) * angle)[..., None]).sum(axis=(0, 1))
    assert seen / (irradiance * (0.8, 0.4, 0.2) / np.pi) == pytest.approx(np.ones(3), rel=0.15)
