"""Direct light at nodes: form factors, the sun, what blocks them, and glass that tints them."""

import numpy as np
import pytest
from box_room import DARK, Piece, box, pierced, quad, scene
from cached_rooms import filled, nodes_of, solved

from renderer.core.kernel import from_python
from renderer.irradiance_cache import node_direct
from renderer.irradiance_cache.cache_geometry import CacheConfig

controlled = from_python(node_direct._controlled)
FINE = CacheConfig(spacing_m=0.1, coarse_spacing_m=0.5, gather_rays=16, light_samples=64)
FLOOR = quad((-1, -1, 0), (2, 0, 0), (0, 2, 0), color=(0.5, 0.5, 0.5))
BLACK = (0.0, 0.0, 0.0)
SUN_LUX = np.array([90_000.0, 80_000.0, 60_000.0])


def rectangle(low, high, height, luminance=(100, 50, 10)):
    """A lamp that looks down."""
    return quad((*low, height), (0, high[1] - low[1], 0), (high[0] - low[0], 0, 0), emission=luminance, color=BLACK)


def from_rectangle(points, low, high, height):
    """Illuminance of a horizontal plane by a parallel rectangle of unit luminance (view factors of corner pieces, summed with signs)."""

    def corner(x, y):
        p, q = np.hypot(1.0, x), np.hypot(1.0, y)
        return 0.5 * (x / p * np.arctan(y / p) + y / q * np.arctan(x / q))

    x, y = (points[:, 0, None] - [low[0], high[0]]) / height, (points[:, 1, None] - [low[1], high[1]]) / height
    return corner(x[:, 0], y[:, 0]) - corner(x[:, 1], y[:, 0]) - corner(x[:, 0], y[:, 1]) + corner(x[:, 1], y[:, 1])


def disc(radius, height, sides=64):
    """A round lamp about the z axis that looks down."""
    turn = np.linspace(0, 2 * np.pi, sides + 1)[:-1]
    rim = np.column_stack([radius * np.cos(turn), -radius * np.sin(turn), np.full(sides, height)])
    faces = np.array([(sides, i, (i + 1) % sides) for i in range(sides)])
    return Piece(np.vstack([rim, (0, 0, height)]), faces, emission=(100, 50, 10), color=BLACK)


def lit(flat, config=FINE):
    """Places and light of the nodes on the front of the first part."""
    cache = filled(flat, config)
    nodes = nodes_of(cache, 0, flat)
    return cache.atlas.position[nodes].astype(float), *(image[nodes].astype(float) for image in cache.light)


@pytest.mark.parametrize(("half", "height", "error"), [(0.05, 1.0, 0.01), (0.4, 1.5, 0.03), (2.0, 1.0, 0.002), (2.0, 0.05, 0.002)])
def test_a_floor_under_a_square_lamp_is_lit_by_its_view_factor(half, height, error):
    low, high = (-half, -half), (half, half)
    points, _, direct, _, toward, *_ = lit(scene(FLOOR, rectangle(low, high, height)))
    expected = from_rectangle(points, low, high, height)
    np.testing.assert_allclose(direct.mean(axis=0), expected.mean() * np.array([100, 50, 10]), rtol=0.005)
    np.testing.assert_allclose(direct[:, 0], 100 * expected, rtol=error)
    np.testing.assert_allclose(direct[:, 1:] / direct[:, :1], np.tile([0.5, 0.1], (len(points), 1)), rtol=1e-4)
    assert (toward[:, 2] > 0).all()


def test_on_the_axis_of_a_disc_light_falls_as_radius_over_distance():
    points, _, direct, _, toward, *_ = lit(scene(FLOOR, disc(0.5, 1.5)))
    middle = np.hypot(*points[:, :2].T) < 0.06
    assert middle.any()
    np.testing.assert_allclose(direct[middle, 0], 100 * np.pi * 0.25 / (0.25 + 2.25), rtol=0.02)
    # Over a small light, luminance times direction over illuminance is the unit direction over its cosine: 1 along the normal.
    np.testing.assert_allclose(toward[middle][:, 2], 1.0, atol=0.06)


def test_a_floor_beside_a_wall_that_shines_is_lit_by_the_view_factor_of_what_stands_above_it():
    """Half of it lies beneath the floor's plane; next to it the floor has half the light that it would have if all it saw shone."""
    wall = quad((1.0, -40.0, -40.0), (0, 80, 0), (0, 0, 80), emission=(100, 50, 10), color=BLACK)
    points, _, direct, *_ = lit(scene(FLOOR, wall._replace(faces=wall.faces[:, ::-1])))
    beside = np.hypot(1.0 - points[:, 0], 40.0)
    expected = 100 * (np.arctan(40.0 / (1.0 - points[:, 0])) - (1.0 - points[:, 0]) / beside * np.arctan(40.0 / beside))
    np.testing.assert_allclose(direct[:, 0], expected, rtol=2e-3)


def test_a_light_shines_to_its_front_and_a_board_blocks_it():
    lamp = rectangle((-0.4, -0.4), (0.4, 0.4), 1.5)
    assert lit(scene(FLOOR, lamp._replace(faces=lamp.faces[:, ::-1])))[2].max() == 0.0
    board = box((-1, -1, 0.8), (1, 1, 0.81))
    assert lit(scene(FLOOR, lamp, box((-3, -3, 0.8), (3, 3, 0.81))))[2].max() == 0.0
    points, _, direct, *_ = lit(scene(FLOOR, lamp, board._replace(vertices=board.vertices + np.array([1.2, 0, 0]))))
    whole = 100 * from_rectangle(points, (-0.4, -0.4), (0.4, 0.4), 1.5)
    # The board's edge is at x = 0.2, 0.8 m up: what it blocks of the lamp moves with 0.7 / 1.5 of the way.
    # (0.4 + 0.2) * 1.5 / 0.7 - 0.4 m is where the last of it is gone.
    free, dark = points[:, 0] < -0.06, points[:, 0] > 0.89
    np.testing.assert_allclose(direct[free, 0], whole[free], rtol=0.05)
    assert dark.any() and direct[dark].max() == 0.0


def test_places_beside_a_large_lamp_that_is_hidden_in_part_are_lit_by_the_rest():
    """A board 2 cm up, from x = 0 on, below a lamp 5 cm up: at x < 0 the lamp is seen as far as 1.5 times as far on the other side."""
    low, high, height = (-2, -2), (2, 2), 0.05
    board = quad((0, -3, 0.02), (3, 0, 0), (0, 6, 0))
    points, _, direct, *_ = lit(scene(FLOOR, rectangle(low, high, height), board))
    aside = (points[:, 0] < -0.01) & (points[:, 0] > -0.5)
    seen = [from_rectangle(point[None], low, (-1.5 * point[0], 2), height)[0] for point in points[aside]]
    np.testing.assert_allclose(direct[aside, 0].mean(), 100 * np.mean(seen), rtol=0.02)
    np.testing.assert_allclose(direct[aside, 0], 100 * np.array(seen), rtol=0.15)


@pytest.mark.parametrize(("samples", "error"), [(2, 0.1), (4, 0.03), (16, 0.03)])
def test_few_samples_of_a_lamp_that_is_hidden_where_it_is_faint_are_right_in_the_mean(samples, error):
    """A long lamp, of which a low wall hides the far end, from which least arrives: the visible end's view factor."""
    floor = quad((-0.1, -0.1, 0), (0.2, 0, 0), (0, 0.2, 0))
    flat = scene(floor, rectangle((-0.5, -0.3), (3.5, 0.3), 1.0), box((0.35, -3, 0), (0.36, 3, 0.5)))
    points, _, direct, *_ = lit(flat, CacheConfig(spacing_m=0.01, coarse_spacing_m=0.5, gather_rays=16, light_samples=samples))
    ends = 0.7 - points[:, 0]
    seen = [from_rectangle(point[None], (-0.5, -0.3), (end, 0.3), 1.0)[0] for point, end in zip(points, ends, strict=True)]
    np.testing.assert_allclose(direct[:, 0].mean(), 100 * np.mean(seen), rtol=error)


def test_a_run_whose_samples_are_all_too_faint_to_count_tells_nothing():
    """Points that are seen at right angles bring nothing, hidden or not; the other run's share stands for both."""
    nothing, half = node_direct._Run(*np.zeros(4, np.float32), 2), node_direct._Run(*np.array([3, 3, 3, 6], np.float32), 2)
    ten, one = np.float32(10.0), np.float32(1.0)
    assert controlled(nothing, np.float32(0.0), half, np.float32(3.0), ten, one) == pytest.approx(5.0)
    assert controlled(half, np.float32(3.0), nothing, np.float32(0.0), ten, one) == pytest.approx(1.5 + 0.5 * (10.0 - 3.0))


def test_clear_glass_tints_what_passes():
    lamp = rectangle((-0.4, -0.4), (0.4, 0.4), 1.5, (100, 100, 100))
    plate = box((-3, -3, 0.8), (3, 3, 0.81), color=(0.81, 0.49, 0.25), transmission=1.0, ior=1.5, roughness=0.0)
    free, tinted = lit(scene(FLOOR, lamp))[2], lit(scene(FLOOR, lamp, plate))[2]
    # Two faces, each with the square root of the colour and 0.96 of what it does not reflect.
    np.testing.assert_allclose(tinted / free, np.tile(np.array([0.81, 0.49, 0.25]) * 0.96**2, (len(free), 1)), rtol=1e-3)


def sun_scene(*others):
    way = np.array([0.0, 0.6, 0.8])
    versine = 1.0 - np.cos(np.radians(0.533 / 2))
    sky = DARK._replace(sun=np.array([*way, versine, *(SUN_LUX / (2 * np.pi * versine))], np.float32))
    pane = quad((-2, 1.5, 0.2), (4, 0, 0), (0, 0, 1), portal=True, transmission=0.9)
    return scene(FLOOR, pane, *others, sky=sky)


def test_the_sun_falls_through_the_pane_or_not_at_all():
    points, _, direct, sun, *_ = lit(sun_scene())
    height = (1.5 - points[:, 1]) * 0.8 / 0.6
    inside, outside = (height > 0.25) & (height < 1.15), (height < 0.15) | (height > 1.25)
    assert inside.sum() > 50 and outside.sum() > 50 and direct.max() == 0.0
    assert (sun[inside, 3] == 1.0).all() and (sun[outside] == 0.0).all()
    lux = sun[inside, :3].mean(axis=0)
    np.testing.assert_allclose(lux / lux[0], SUN_LUX / SUN_LUX[0], rtol=1e-3)
    assert lux[0] == pytest.approx(0.8 * SUN_LUX[0] * 0.9, rel=1e-3)
    np.testing.assert_allclose(sun[inside, 0], lux[0], rtol=2e-3)


def test_what_stands_before_the_sun_blocks_it():
    points, _, _, sun, *_ = lit(sun_scene(box((-3, 1.0, 0.0), (0.0, 1.02, 3.0))))
    height = (1.5 - points[:, 1]) * 0.8 / 0.6
    inside = (height > 0.25) & (height < 1.15) & (points[:, 1] < 0.95)
    assert (sun[inside & (points[:, 0] < -0.05), 3] == 0.0).all() and (sun[inside & (points[:, 0] > 0.05), 3] == 1.0).all()


@pytest.mark.parametrize("albedo", [0.01, 0.8])
@pytest.mark.parametrize("place", [(0.0, 0.0), (0.13, 0.41), (0.3, 0.02)])
@pytest.mark.parametrize("height", [2.4, 1.2])
def test_all_light_of_a_lamp_arrives_and_bounces_however_near_the_ceiling(albedo, place, height):
    """Few rays meet the spot above a lamp 10 cm below: what they bring by chance is not counted twice, nor is any left out."""
    x, y = place
    room = box((-1.5, -1.5, 0), (1.5, 1.5, 2.5), inside=True, object_id=0, color=(albedo, albedo, albedo), roughness=1.0, ior=1.0)
    lamp = quad((x - 0.01, y - 0.01, height), (0.02, 0, 0), (0, 0.02, 0), emission=(1e5, 1e5, 1e5), color=BLACK, object_id=1)
    flat = scene(room, lamp)
    with solved(flat, CacheConfig()) as cache:
        on_room = flat.face_part[cache.coarse.face] == 0
        lumen = np.pi / albedo * (cache.luminance[:, 1] * cache.coarse.area)[on_room].sum()
    assert lumen == pytest.approx(np.pi * 0.0004 * 1e5 / (1.0 - albedo), rel=0.035)


def test_light_on_a_net_right_behind_window_bars_is_that_by_much_closer_nodes():
    pane = quad((-0.5, 0, 1.0), (1, 0, 0), (0, 0, 1), portal=True, transmission=1.0, ior=1.0, object_id=1)
    bars = [quad((-0.5, -0.01, z), (1, 0, 0), (0, 0, 0.06), color=BLACK, object_id=1) for z in np.linspace(1.0, 1.94, 6)]
    net = quad((-0.55, -0.03, 0.95), (1.1, 0, 0), (0, 0, 1.1), color=(0.5, 0.5, 0.5), roughness=1.0, ior=1.0, object_id=2)
    room = pierced(box((-2, -3, 0), (2, 0, 2.5), inside=True, object_id=0, color=BLACK, roughness=1.0), (-0.5, 1.0), (0.5, 2.0))
    flat = scene(room, pane, *bars, net, sky=DARK._replace(zenith=np.full(3, 1e3, np.float32), horizon=np.full(3, 1e3, np.float32)))

    def lumen(spacing_m):
        with solved(flat, CacheConfig(coarse_spacing_m=spacing_m)) as cache:
            on_net = flat.face_part[cache.coarse.face] == len(flat.parts.label) - 1
            return (cache.luminance[:, 1] * cache.coarse.area)[on_net].sum()

    assert lumen(0.1) == pytest.approx(lumen(0.02), rel=0.03)
