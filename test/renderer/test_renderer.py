"""The facade: same bytes whatever the threads and pieces, cancelling, odd scenes and sizes, faulty input."""

import math
import threading

import numpy as np
import pytest
from box_room import VIEW, box, furnished_room, pose, quad, scene

from renderer import GEOMETRIC_LAYERS, LAYERS, CameraConfig, RenderCancelled, RenderConfig, Renderer, RenderError, standpoint, warm_up
from renderer.film.tone import Exposure, to_display
from renderer.path import sun_patches
from renderer.path.ground_truth import trace_geometry
from renderer.path.integrator import trace_paths

SMALL = CameraConfig(width=101, height=75)
QUICK = RenderConfig(samples_per_pixel=4, threads=2)


def render(flat, layers=tuple(LAYERS), *, camera=SMALL, config=QUICK, key=5, frame=3, view=VIEW, **options):
    with Renderer(flat, camera, config, key, **options) as renderer:
        return renderer.render(view, frame, layers)


def all_bytes(frame):
    return {name: image.tobytes() for name, image in frame.layers.items()} | {"radiance": frame.radiance.tobytes()}


@pytest.mark.parametrize("options", [{"paths_per_piece": 1}, {"paths_per_piece": 16 * 3}, {"paths_per_piece": 2000}])
def test_pieces_change_no_byte(options):
    camera = CameraConfig(width=30, height=22)
    expected = all_bytes(render(furnished_room(), camera=camera))
    assert all_bytes(render(furnished_room(), camera=camera, **options)) == expected


@pytest.mark.parametrize("threads", [2, 3])
def test_threads_change_no_byte(threads):
    one = render(furnished_room(), config=RenderConfig(samples_per_pixel=4, threads=1), paths_per_piece=500)
    many = render(furnished_room(), config=RenderConfig(samples_per_pixel=4, threads=threads), paths_per_piece=500)
    assert all_bytes(one) == all_bytes(many)


def test_frames_do_not_depend_on_what_was_rendered_before():
    with Renderer(furnished_room(), SMALL, QUICK, 5) as renderer:
        renderer.render(pose((2, 2, 2), (3, 3, 0)), 0, tuple(LAYERS))
        again = renderer.render(VIEW, 3, tuple(LAYERS))
    assert all_bytes(again) == all_bytes(render(furnished_room()))


def test_noise_is_keyed_by_scene_and_frame_and_geometry_is_not():
    base, frame, key = render(furnished_room()), render(furnished_room(), frame=4), render(furnished_room(), key=6)
    for other in (frame, key):
        assert not np.array_equal(base.radiance, other.radiance)
        np.testing.assert_allclose(base.radiance.mean(), other.radiance.mean(), rtol=0.05)
        assert all(np.array_equal(base.layers[name], other.layers[name]) for name in GEOMETRIC_LAYERS)


def test_warming_up_leaves_nothing_to_compile():
    """Also in a room that the sun shines into, where its patches are looked for."""
    kernels = (trace_paths, trace_geometry, sun_patches._trace_beams, standpoint._look_around)
    warm_up()
    compiled = [len(kernel.signatures) for kernel in kernels]
    room, sun = furnished_room(), np.array([0.0, 0.8, 0.6, 1e-5, 1e5, 1e5, 1e5], np.float32)
    sunny = room._replace(sky=room.sky._replace(sun=sun))
    with Renderer(sunny, SMALL, QUICK, 5) as renderer:
        renderer.render(VIEW, 3, tuple(LAYERS))
        standpoint.seen_around(renderer.tree, sunny, VIEW.position_m)
    assert [len(kernel.signatures) for kernel in kernels] == compiled == [1, 1, 1, 1]


def test_only_what_is_asked_for():
    frame = render(furnished_room(), ("depth", "semantic"))
    assert list(frame.layers) == ["depth", "semantic"] and frame.radiance is None
    frame = render(furnished_room(), ("color",))
    assert list(frame.layers) == ["color"] and frame.radiance.dtype == np.float32
    for name, image in render(furnished_room()).layers.items():
        assert image.dtype == np.dtype(LAYERS[name].dtype) and image.flags.c_contiguous
        assert image.shape == (75, 101) + ((LAYERS[name].channels,) if LAYERS[name].channels > 1 else ())


def test_where_rays_hit_nothing_every_layer_has_the_value_that_the_table_says():
    wall = quad((0, -9, 0), (0, 18, 0), (0, 0, 9), color=(0.5, 0.5, 0.5))
    layers = render(scene(wall), view=pose((2.0, 0.0, 0.0), (0.0, 0.0, 0.0))).layers
    for name, row in LAYERS.items():
        assert row.no_hit is None or np.array_equal(layers[name][45:], np.full_like(layers[name][45:], row.no_hit), equal_nan=True), name
    assert (layers["depth"][:30] == 2.0).all(), "the wall is seen above"


def test_albedo_is_the_base_colour_and_one_for_glass_and_lamps():
    wall = quad((0, -1, -1), (0, 1, 0), (0, 0, 2), color=(0.2, 0.4, 0.6))
    lamp = quad((0, 0, -1), (0, 1, 0), (0, 0, 2), color=(0.1, 0.1, 0.1), emission=(5, 5, 5))
    view = pose((2.0, 0.0, 0.0), (0.0, 0.0, 0.0))
    config = RenderConfig(samples_per_pixel=3, threads=1)
    both = render(scene(wall, lamp), ("color", "albedo"), config=config, view=view).layers
    albedo = both["albedo"]
    assert {tuple(color) for color in albedo[35:40, :48].reshape(-1, 3).round(6)} | {
        tuple(color) for color in albedo[35:40, 53:].reshape(-1, 3).round(6)
    } >= {tuple(np.array((0.2, 0.4, 0.6), np.float32).round(6)), (1.0, 1.0, 1.0)}
    alone = render(scene(wall, lamp), ("albedo",), config=config, view=view)
    assert alone.radiance is None and np.array_equal(alone.layers["albedo"], albedo)


@pytest.mark.parametrize("threads", [1, 2])
def test_rays_are_counted(threads):
    wall = quad((0, -9, -9), (0, 18, 0), (0, 0, 18), color=(0.5, 0.5, 0.5))
    lamp = quad((5, -1, -1), (0, 0, 2), (0, 2, 0), color=(0.0, 0.0, 0.0), emission=(5, 5, 5))
    view, pixels = pose((2.0, 0.0, 0.0), (0.0, 0.0, 0.0)), 75 * 101

    def count(parts, layers, max_depth):
        config = RenderConfig(samples_per_pixel=3, threads=threads, max_depth=max_depth)
        return render(scene(*parts), layers, config=config, view=view).rays

    assert count([wall], ("depth", "semantic"), 3) == pixels
    assert count([wall], ("color",), 1) == 3 * pixels
    assert count([wall], ("color", "depth"), 1) == 3 * pixels + pixels
    assert count([wall], ("color",), 3) == 2 * 3 * pixels, "each wall point sends one ray on, which finds nothing"
    assert count([wall, lamp], ("color",), 3) == 3 * 3 * pixels, "and one to the lamp"


def test_undenoised_colour_is_the_noisy_one():
    layers = render(furnished_room(), ("color", "color_noisy")).layers
    assert np.array_equal(layers["color"], layers["color_noisy"])


def test_a_noise_target_ends_sampling_at_a_power_of_two_with_the_bytes_of_that_many_samples():
    loose = render(furnished_room(), ("color",), config=RenderConfig(samples_per_pixel=64, threads=2, noise_target=0.5))
    assert loose.samples in (4, 8, 16, 32)
    fixed = render(furnished_room(), ("color",), config=RenderConfig(samples_per_pixel=loose.samples, threads=1))
    assert loose.radiance.tobytes() == fixed.radiance.tobytes() and fixed.samples == loose.samples


def test_a_spent_time_budget_still_gives_one_sample():
    frame = render(furnished_room(), ("color",), config=RenderConfig(samples_per_pixel=4096, threads=2, time_budget_s=1e-6))
    fixed = render(furnished_room(), ("color",), config=RenderConfig(samples_per_pixel=1, threads=2))
    assert frame.samples == 1 and np.array_equal(frame.radiance, fixed.radiance)


def test_exposure_can_be_replaced():
    with Renderer(furnished_room(), SMALL, QUICK, 5) as renderer:
        configured = renderer.render(VIEW, 0, ("color",))
        darker = renderer.render(VIEW, 0, ("color",), exposure=Exposure(9.0))
    assert np.array_equal(configured.layers["color"], to_display(configured.radiance, Exposure(QUICK.exposure_ev100), "camera"))
    assert np.array_equal(darker.layers["color"], to_display(configured.radiance, Exposure(9.0), "camera"))


def test_a_cancelled_render_stops_and_the_renderer_lives_on():
    camera = CameraConfig(width=320, height=240)
    asked_by = set()

    def cancelled():
        asked_by.add(threading.get_ident())
        return True

    with Renderer(furnished_room(), camera, RenderConfig(samples_per_pixel=4096, threads=2), 5) as renderer:
        with pytest.raises(RenderCancelled):
            renderer.render(VIEW, 0, ("color",), cancelled=cancelled)
        assert np.isfinite(renderer.render(VIEW, 0, ("depth",)).layers["depth"]).all()
    assert asked_by == {threading.get_ident()}


def test_a_render_that_is_not_cancelled_is_unchanged():
    with Renderer(furnished_room(), SMALL, RenderConfig(samples_per_pixel=64, threads=2), 5) as renderer:
        plain = renderer.render(VIEW, 0, ("color",))
        asked = renderer.render(VIEW, 0, ("color",), cancelled=lambda: False)
    assert all_bytes(plain) == all_bytes(asked)


@pytest.mark.parametrize("size", [(1, 1), (2, 3), (5, 1), (33, 18)])
def test_any_size(size):
    camera = CameraConfig(width=size[0], height=size[1])
    frame = render(furnished_room(), camera=camera)
    assert frame.radiance.shape == (size[1], size[0], 3)
    assert np.isfinite(frame.radiance).all() and frame.radiance.min() >= 0


def test_odd_scenes_give_numbers():
    rng = np.random.default_rng(4)
    soup = furnished_room()
    soup.mesh.faces[::5] = soup.mesh.faces[::5, :1]  # degenerate
    soup.mesh.normals[::3] = 0  # unusable
    soup.mesh.normals[1::3] = rng.normal(size=soup.mesh.normals[1::3].shape)
    sliver = quad((1, 1, 1), (1, 0, 0), (0, 1e-7, 0), emission=(1e6, 1e6, 1e6))
    speck = quad((2, 2, 1), (1e-6, 0, 0), (0, 1e-6, 0), emission=(1e6, 1e6, 1e6))
    far = box((900, 900, 900), (1000, 1000, 1000), emission=(10, 10, 10))
    for flat in (soup, scene(sliver, speck, far, box((0, 0, 0), (4, 5, 2.6), inside=True)), scene(far)):
        frame = render(flat)
        assert np.isfinite(frame.radiance).all() and frame.radiance.min() >= 0
        assert not np.isnan(frame.layers["depth"]).any() and np.isfinite(frame.layers["normals"]).all()


def test_a_camera_on_a_surface_or_inside_a_lamp_gives_numbers():
    for view in (pose((2.0, 1.5, 2.25), (2.1, 1.5, 2.0)), pose((1.0, 2.0, 0.5), (2.0, 3.0, 0.5)), pose((2.0, 4.995, 1.5), (2, 6, 1.5))):
        frame = render(furnished_room(), view=view)
        assert np.isfinite(frame.radiance).all() and not np.isnan(frame.layers["depth"]).any()


def change(flat, table, field, index, value):
    getattr(getattr(flat, table), field)[index] = value
    return flat


@pytest.mark.parametrize(
    ("table", "field", "index", "value", "message"),
    [
        ("mesh", "vertices", (46, 1), math.nan, "mesh.vertices: expected finite numbers, got .* at vertex 46 of part '2/lamp'"),
        ("mesh", "vertices", (76, 0), math.inf, "at vertex 76 of part '3/bed'|of part '4/wardrobe'"),
        ("mesh", "normals", (0, 0), math.nan, "mesh.normals: expected finite numbers, got .* of part '0/shell'"),
        ("mesh", "faces", (3, 2), 10**6, r"mesh.faces: expected indices in \[0, 140\), got 0 to 1000000"),
        ("parts", "material", 2, -1, r"parts.material: expected indices in \[0, 6\), got -1"),
        ("parts", "emission", (1, 1), math.nan, "parts.emission: expected finite numbers"),
        ("parts", "emission", (1, 1), -1, "parts.emission: expected finite numbers in .*, got -1"),
        ("materials", "base_color", (1, 1), 1.5, r"materials.base_color: expected finite numbers in \[0, 1\], got .* to 1.5"),
        ("sky", "zenith", 0, math.inf, "sky.zenith: expected finite"),
    ],
)
def test_faulty_scenes_are_refused(table, field, index, value, message):
    with pytest.raises(RenderError, match=message) as error:
        render(change(furnished_room(), table, field, index, value))
    assert "\n" not in str(error.value)


def test_wrong_shapes_are_refused():
    flat = furnished_room()
    with pytest.raises(RenderError, match=r"face_part: expected int32 \(68,\), got int64 \(68,\)"):
        render(flat._replace(face_part=flat.face_part.astype(np.int64)))
    with pytest.raises(RenderError, match="face_part: expected indices"):
        render(flat._replace(face_part=flat.face_part + 1))


def test_unknown_layers_and_keys_are_refused():
    with pytest.raises(RenderError, match=r"layers: expected some of color, depth, .* got fog"):
        render(furnished_room(), ("depth", "fog"))
    with pytest.raises(RenderError, match="scene_key >= 0"):
        render(furnished_room(), key=-1)
