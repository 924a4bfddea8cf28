"""What mirrors and glass show, with known answers or by paths."""

import numpy as np
import pytest
from box_room import DARK, box, joined, pose, quad, scene
from cached_rooms import CACHED, look_up
from single_surfaces import AHEAD, NARROW, seen

from renderer import CameraConfig, Renderer
from renderer.cached_frames.mirrored import limit_seen
from renderer.cached_frames.records import EVEN, KIND, LEFT, RAY_ALPHA, SEEN, SHARP, make_shade_scratch
from renderer.core.kernel import from_python
from renderer.path.records import make_scratch
from renderer.scene.flat_scene import Sky


def test_a_mirror_shows_what_stands_opposite():
    mirror = quad((-1, 2, -1), (2, 0, 0), (0, 0, 2), color=(0.9, 0.8, 0.7), metallic=1.0, roughness=0.0)
    lamp = quad((3, -3, -3), (-6, 0, 0), (0, 0, 6), emission=(40, 40, 40), color=(0, 0, 0))
    np.testing.assert_allclose(seen(mirror, lamp).mean(axis=(0, 1)), 40 * np.array([0.9, 0.8, 0.7]), rtol=0.02)


def test_a_mirror_shows_a_wall_as_bright_as_it_is():
    mirror = quad((-3, 2, -3), (6, 0, 0), (0, 0, 6), color=(1, 1, 1), metallic=1.0, roughness=0.0)
    room = box((-4, -4, -4), (4, 4, 4), inside=True, glow_cd_m2=10.0, color=(1, 1, 1), object_id=0)
    np.testing.assert_allclose(seen(mirror, room), 10 / 0.97, rtol=0.03)


@pytest.mark.parametrize(("color", "roughness"), [((0.8, 0.8, 0.8), 1.0), ((0.4, 0.1, 0.04), 0.9), ((0.4, 0.1, 0.04), 0.7)])
def test_a_mirror_shows_a_wall_with_its_shadows_as_it_is_seen_itself(color, roughness):
    """The camera sees the same piece of wall ahead, in a mirror, and behind itself, three times as near."""
    wall = quad((-2, -2, -2), (0, 0, 4), (4, 0, 0), color=color, roughness=roughness, ior=1.5 if roughness < 1.0 else 1.0)
    shelf = box((-0.15, -2, 0.05), (0.15, -1.9, 0.07), color=(0.5, 0.5, 0.5), roughness=1.0)
    lamp = quad((-0.1, -1.4, 1.5), (0, 0.2, 0), (0.2, 0, 0), emission=(500, 500, 500), color=(0, 0, 0))
    room = box((-4, -4, -4), (4, 4, 4), inside=True, color=(0.5, 0.5, 0.5), roughness=1.0, object_id=0)
    mirror = quad((-1, 2, -1), (2, 0, 0), (0, 0, 2), color=(0.9, 0.9, 0.9), metallic=1.0, roughness=0.0)
    flat, near = (
        scene(wall, shelf, lamp, room, mirror, sky=DARK),
        CameraConfig(width=32, height=24, horizontal_fov_rad=2 * np.arctan(3 * np.tan(0.05))),
    )
    shown = look_up(flat, AHEAD, camera=NARROW).radiance
    itself = 0.9 * look_up(flat, pose((0, 0, 0), (0, -1, 0)), camera=near).radiance[:, ::-1]
    assert itself[..., 0].min() < 0.4 * itself[..., 0].max()
    np.testing.assert_allclose(shown.mean(axis=(0, 1)), itself.mean(axis=(0, 1)), rtol=0.04)
    assert (abs(shown - itself).max(axis=2) < 0.1 * itself.max(axis=2)).mean() > 0.93


@pytest.mark.parametrize("roughness", [0.0, 0.1, 0.3])
def test_metal_shows_the_light_on_itself_where_all_that_it_mirrors_lies_beside_black_nodes(roughness):
    """Nodes within gaps are black, and the rays that end between them and the gap's end tell nothing."""
    metal = quad((-1, 2, -1), (2, 0, 0), (0, 0, 2), color=(0.8, 0.8, 0.8), metallic=1.0, roughness=roughness)
    room = box((-4, -4, -4), (4, 4, 4), inside=True, color=(0.5, 0.5, 0.5), object_id=0)
    lamp = quad((-2, -1, 1.5), (0, 4, 0), (4, 0, 0), emission=(100, 100, 100), color=(0, 0, 0))
    with Renderer(scene(metal, room, lamp, sky=DARK), NARROW, CACHED, 5) as renderer:
        lit = renderer.render(AHEAD, 0, ("radiance",)).radiance[..., 1].mean()
        tables = renderer.cached()._tables
        for table in (tables.rows, tables.sun, tables.even, tables.around, tables.leaving):
            table[:] = 0.0
        assert 0.3 * lit < renderer.render(AHEAD, 0, ("radiance",)).radiance[..., 1].mean() < 3.0 * lit


@pytest.mark.parametrize("transmission", [0.5, 0.8, 1.0])
def test_glass_in_a_mirror_scatters_and_mirrors_what_falls_on_it(transmission):
    mirror = quad((-3, 2, -3), (6, 0, 0), (0, 0, 6), color=(1, 1, 1), metallic=1.0, roughness=0.0)
    glass = box((-3, -1.02, -3), (3, -1, 3), color=(0.7, 0.7, 0.7), transmission=transmission, ior=1.5, roughness=0.0)
    room = box((-4, -4, -4), (4, 4, 4), inside=True, glow_cd_m2=10.0, color=(0.5, 0.5, 0.5), object_id=0)
    traced = seen(mirror, glass, room, integrator="path", samples_per_pixel=128, threads=2).mean()
    assert seen(mirror, glass, room).mean() == pytest.approx(traced, rel=0.12)


def test_a_pane_shows_the_sky_through_it_and_the_lamp_in_it_as_the_path_tracer_does():
    sky = Sky(*(np.full(3, 100, np.float32) for _ in range(3)))
    pane = quad((-1, 2, -1), (2, 0, 0), (0, 0, 2), portal=True, transmission=0.9, ior=1.5, roughness=0.0)
    lamp = quad((3, -3, -3), (-6, 0, 0), (0, 0, 6), emission=(5000, 5000, 5000), color=(0, 0, 0))
    traced = seen(pane, lamp, sky=sky, integrator="path", samples_per_pixel=256, threads=2).mean()
    assert seen(pane, lamp, sky=sky).mean() == pytest.approx(traced, rel=0.02)


def test_clear_glass_shows_what_stands_behind_it():
    plate = box((-1, 2, -1), (1, 2.01, 1), color=(0.81, 0.49, 0.25), transmission=1.0, ior=1.5, roughness=0.0)
    lamp = quad((-3, 4, -3), (6, 0, 0), (0, 0, 6), emission=(100, 100, 100), color=(0, 0, 0))
    np.testing.assert_allclose(seen(plate, lamp).mean(axis=(0, 1)), 100 * np.array([0.81, 0.49, 0.25]) * 0.96**2, rtol=0.02)


def test_brushed_metal_shows_no_blocks():
    """A steel wall mirrors a stripe that glows: neighbours differ as much within blocks of 2 x 2 pixels as between them."""
    wall = quad((-1, 2, -1), (2, 0, 0), (0, 0, 2), color=(0.6, 0.6, 0.6), metallic=1.0, roughness=0.35)
    stripe = quad((0.25, -1, -2), (-0.5, 0, 0), (0, 0, 4), glow_cd_m2=100.0, color=(1, 1, 1))
    image = look_up(scene(wall, stripe), AHEAD, camera=CameraConfig(width=64, height=48, horizontal_fov_rad=0.5)).radiance[..., 1]
    steps = np.abs(np.diff(image.astype(float), axis=1)).mean(axis=0)
    within, between = steps[::2].mean(), steps[1::2].mean()
    assert image.std() > 1.0 and between == pytest.approx(within, rel=0.25)


def test_milky_glass_lets_through_what_is_clear_of_it():
    plate = box((-1, 2, -1), (1, 2.01, 1), color=(1, 1, 1), transmission=0.8, ior=1.5, roughness=0.0)
    wall = quad((-1, 3, -1), (2, 0, 0), (0, 0, 2), glow_cd_m2=100.0, color=(1, 1, 1))
    traced = seen(plate, wall, integrator="path", samples_per_pixel=256, threads=2).mean()
    assert traced < 75.0 and seen(plate, wall).mean() == pytest.approx(traced, rel=0.12)


@pytest.mark.parametrize("roughness", [0.25, 0.4])
def test_a_polished_floor_seen_aslant_mirrors_as_much_as_the_path_tracer_says(roughness):
    """Most of the microfacets that are seen lean to the viewer, and reflect less than those of the mirrored direction."""
    floor = quad((-3, 0, 0), (6, 0, 0), (0, 9, 0), color=(0, 0, 0), roughness=roughness, ior=1.5)
    wall = quad((-6, 9, 0), (12, 0, 0), (0, 0, 6), glow_cd_m2=100.0, color=(1, 1, 1))
    view = pose((0, 0, 0.8), (0, 4, 0))
    traced = seen(floor, wall, view=view, integrator="path", samples_per_pixel=256, threads=2).mean()
    assert traced > 1.0 and seen(floor, wall, view=view).mean() == pytest.approx(traced, rel=0.08)


def test_both_faces_of_a_plate_of_glass_mirror_what_stands_before_it():
    plate = box((-1, 2, -1), (1, 2.004, 1), color=(1, 1, 1), transmission=1.0, ior=1.5, roughness=0.0)
    lit = quad((1, -1, -1), (-2, 0, 0), (0, 0, 2), glow_cd_m2=100.0, color=(1, 1, 1))
    traced = seen(plate, lit, integrator="path", samples_per_pixel=64, threads=2).mean()
    assert traced > 7.0 and seen(plate, lit).mean() == pytest.approx(traced, rel=0.05)


@pytest.mark.parametrize(("roughness", "error"), [(0.35, 0.1), (0.15, 0.2)])
def test_metal_shows_a_polished_dark_floor_without_the_lamp_that_it_mirrors_elsewhere(roughness, error):
    """The lamp hangs above the floor: what of its light the floor's gloss mirrors goes up, not to the metal."""
    floor = quad((-3, -1, 0), (6, 0, 0), (0, 3, 0), color=(0.05, 0.05, 0.05), roughness=0.3, ior=1.5)
    metal = quad((-1, 2, 0), (2, 0, 0), (0, 0, 1), color=(0.6, 0.6, 0.6), metallic=1.0, roughness=roughness)
    lamp = quad((-0.3, 0.7, 3), (0, 0.6, 0), (0.6, 0, 0), emission=(1000,) * 3, color=(0, 0, 0))
    view = pose((0, 0, 0.8), (0, 2, 0.3))
    traced = seen(floor, metal, lamp, view=view, integrator="path", samples_per_pixel=256, threads=2).mean()
    assert traced > 0.1 and seen(floor, metal, lamp, view=view).mean() == pytest.approx(traced, rel=error)


@pytest.mark.parametrize("roughness", [0.1, 0.35])
def test_metal_shows_the_light_that_a_sheet_lets_through(roughness):
    """A lamp stands behind a sheet: on the side that the metal faces nothing else falls on it."""
    sheet = quad((2, -1, -1), (-4, 0, 0), (0, 0, 3), color=(0.8, 0.8, 0.8), diffuse_transmission=0.6)
    lamp = quad((1.5, -2.5, -0.5), (-3, 0, 0), (0, 0, 2), emission=(300,) * 3, color=(0, 0, 0))
    metal = quad((-1, 2, 0), (2, 0, 0), (0, 0, 1), color=(0.6, 0.6, 0.6), metallic=1.0, roughness=roughness)
    view = pose((0, 0, 0.5), (0, 2, 0.5))
    traced = seen(sheet, metal, lamp, view=view, integrator="path", samples_per_pixel=256, threads=2).mean()
    assert traced > 1.0 and seen(sheet, metal, lamp, view=view).mean() == pytest.approx(traced, rel=0.08)


@pytest.mark.parametrize("before", ["dark", "bright"])
def test_what_lies_under_a_smooth_coat_mirrors_what_is_before_it_and_not_the_light_around(before):
    """A dark lacquered floor between a glowing wall and a dark one: its rough lobe shows the one ahead, as its coat does."""
    floor = quad((-3, 0, 0), (6, 0, 0), (0, 6, 0), color=(0.02, 0.02, 0.02), roughness=0.3, ior=1.5, clearcoat=0.9, clearcoat_roughness=0.1)
    glow = 100.0 if before == "bright" else 2.0
    ahead = quad((-6, 6, 0), (12, 0, 0), (0, 0, 4), glow_cd_m2=glow, color=(1, 1, 1))
    behind = quad((6, -1, 0), (-12, 0, 0), (0, 0, 4), glow_cd_m2=102.0 - glow, color=(1, 1, 1))
    view = pose((0, 0, 1.2), (0, 2.4, 0))
    traced = seen(floor, ahead, behind, view=view, integrator="path", samples_per_pixel=256, threads=2).mean()
    assert traced > 0.1 and seen(floor, ahead, behind, view=view).mean() == pytest.approx(traced, rel=0.08)


@pytest.mark.parametrize(("roughness", "within"), [(0.05, 0.02), (0.2, 0.15)])
def test_a_floor_mirrors_what_stands_outside_a_window_and_the_sky_above_it(roughness, within):
    """A dark floor before a window, outside which a bright fence hides the lower half of the sky."""
    floor = quad((-2, -2, 0), (4, 0, 0), (0, 3.5, 0), color=(0.02, 0.02, 0.02), roughness=roughness, ior=1.5)
    pane = quad((-2, 1.5, 0.0), (4, 0, 0), (0, 0, 2), portal=True, transmission=0.9)
    fence = quad((-9, 6.0, 0.0), (18, 0, 0), (0, 0, 2.0), glow_cd_m2=300.0, color=(1, 1, 1))
    sky, view = Sky(*np.full((3, 3), 100.0, np.float32)), pose((0.0, -1.5, 0.9), (0.0, 0.7, 0.0))
    camera, flat = CameraConfig(width=32, height=24, horizontal_fov_rad=0.25), scene(floor, pane, fence, sky=sky)
    cached = look_up(flat, view, camera=camera).radiance[..., 1]
    traced = look_up(flat, view, camera=camera, integrator="path", samples_per_pixel=256, threads=2).radiance[..., 1]
    assert cached.mean() == pytest.approx(traced.mean(), rel=within)


def test_a_bowl_of_brushed_metal_shows_its_sides_as_they_mirror():
    """A sink below a bright ceiling in a dark room, seen aslant: its far side mirrors the wall above it, not all that falls on it."""
    steel = {"metallic": 1.0, "roughness": 0.3, "color": (0.55, 0.55, 0.55)}
    bowl = box((-0.2, 0.8, -0.2), (0.2, 1.2, 0.0), inside=True, **steel)
    bowl = bowl._replace(faces=bowl.faces[np.abs(bowl.vertices[bowl.faces][..., 2]).max(axis=1) > 1e-6])
    ceiling = quad((-2, -2, 2.2), (0, 4, 0), (4, 0, 0), glow_cd_m2=100.0, color=(1, 1, 1))
    wall = quad((-2, 1.6, -1), (4, 0, 0), (0, 0, 3), color=(0.05, 0.05, 0.05), roughness=1.0)
    view = pose((0.0, 0.0, 0.8), (0.0, 1.0, -0.2))
    camera = CameraConfig(width=32, height=24, horizontal_fov_rad=0.25)
    flat = scene(bowl, ceiling, wall)
    cached = look_up(flat, view, camera=camera).radiance[..., 1].mean()
    traced = look_up(flat, view, camera=camera, integrator="path", samples_per_pixel=256, threads=2).radiance[..., 1].mean()
    assert cached == pytest.approx(traced, rel=0.12)


@pytest.mark.parametrize(("alpha", "expected"), [(0.2, 8.0 * (3.0 + 5.0) / 4.0), (0.5 * float(SHARP), 1000.0)], ids=["rough", "sharp"])
def test_one_ray_of_a_rough_lobe_is_not_much_brighter_than_its_neighbours(alpha, expected):
    """Of four rays three see 1 and one, whose surface has 5 around it, sees 1000; what a smooth mirror shows stays as bright as it is."""
    primary = make_shade_scratch(make_scratch(0)).primary
    primary[KIND, :4], primary[RAY_ALPHA, :4], primary[SEEN : SEEN + 3, :4] = 1.0, alpha, 1.0
    primary[SEEN : SEEN + 3, 2], primary[EVEN : EVEN + 3, 2] = 1000.0, 5.0
    from_python(limit_seen)(primary)
    np.testing.assert_allclose(primary[SEEN, :4], [1.0, 1.0, expected, 1.0], rtol=1e-6)


def test_a_ray_that_has_come_to_the_sky_keeps_what_it_sees():
    """Few of many do between slats."""
    primary = make_shade_scratch(make_scratch(0)).primary
    primary[KIND, :4], primary[RAY_ALPHA, :4], primary[SEEN : SEEN + 3, :4] = 1.0, 0.2, 1.0
    primary[SEEN : SEEN + 3, 2], primary[LEFT, 2] = 1000.0, 1.0
    from_python(limit_seen)(primary)
    assert primary[SEEN, 2] == 1000.0


def test_a_ray_that_alone_sees_light_keeps_it():
    """Its own surface has none but the sun's, which is not of EVEN."""
    primary = make_shade_scratch(make_scratch(0)).primary
    primary[KIND, 0], primary[RAY_ALPHA, 0], primary[SEEN : SEEN + 3, 0] = 1.0, 0.2, 7.0
    from_python(limit_seen)(primary)
    assert primary[SEEN, 0] == 7.0


@pytest.mark.parametrize("metallic", [0.0, 1.0])
def test_gloss_of_many_triangles_seen_aslant_is_not_speckled(metallic):
    """Its pixels are farther apart than light is lent over, so each sees more points: what these mirror is mixed among neighbours, too."""
    look = {"color": (0.4 - 0.39 * (1.0 - metallic),) * 3, "metallic": metallic, "roughness": 0.4, "ior": 1.5}
    door = joined([quad((0.5, 1.0 + 0.05 * i, -1.0), (0, 0, 2), (0, 0.05, 0), **look) for i in range(100)])
    boards = [quad((-1.0, 1.0 + 0.1 * i, -1.0), (0, 0.05, 0), (0, 0, 2), glow_cd_m2=100.0, color=(1, 1, 1)) for i in range(80)]
    camera = CameraConfig(width=48, height=36, horizontal_fov_rad=0.3)
    image = look_up(scene(door, *boards, sky=DARK), pose((0.1, 0, 0), (0.5, 2.5, 0)), camera=camera).radiance[..., 1]
    shown = image[2:-2, 14:-2]
    around = np.mean([image[2 + v : 34 + v, 14 + u : 46 + u] for v in (-1, 0, 1) for u in (-1, 0, 1)], axis=0)
    assert shown.min() > 0.0 and np.sqrt(np.mean((shown / around - 1.0) ** 2)) < 0.06


@pytest.mark.parametrize("roughness", [0.1, 0.2])
@pytest.mark.parametrize("kind", ["lamp", "pane"])
def test_a_rough_floor_shows_the_image_of_a_lamp_in_a_mirror(kind, roughness):
    """It stands behind the camera, so the floor's lobe shows nothing of it but by the mirror ahead."""
    floor = quad((-3, 0, 0), (6, 0, 0), (0, 5, 0), color=(0.02, 0.02, 0.02), roughness=roughness, ior=1.5)
    mirror = quad((-3, 5, 0), (6, 0, 0), (0, 0, 6), color=(0.9, 0.9, 0.9), metallic=1.0, roughness=0.0)
    pane = {"portal": True, "transmission": 0.9, "ior": 1.5, "roughness": 0.0}
    look = {"emission": (200, 200, 200), "color": (0, 0, 0)} if kind == "lamp" else pane
    source = quad((-3, -1, 3), (6, 0, 0), (0, 0, 3), **look)
    pieces = floor, mirror, source._replace(faces=source.faces[:, ::-1])
    view, sky = pose((0, 0.2, 1.5), (0, 3.0, 0)), DARK if kind == "lamp" else Sky(*np.full((3, 3), 200.0, np.float32))
    traced = seen(*pieces, view=view, sky=sky, integrator="path", samples_per_pixel=256, threads=2).mean()
    assert traced > 5.0 and seen(*pieces, view=view, sky=sky).mean() == pytest.approx(traced, rel=0.05)
