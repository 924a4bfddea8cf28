"""Frames by the irradiance cache beside those of the path tracer: mean light, same bytes, a moving camera, walls that keep light out."""

from itertools import pairwise

import numpy as np
import pytest
from box_room import BLACK, VIEW, box, furnished_room, l_shaped_room, pierced, pose, quad, scene
from cached_rooms import CACHED, SMALL, look_up

from renderer import LAYERS, CameraConfig, RenderConfig, Renderer, RenderError
from renderer.film.layers import PICTURES
from renderer.film.tone import Exposure, to_display
from scene_description.types import CameraPose

ELSEWHERE = pose((0.8, 4.2, 1.4), (3.0, 1.0, 0.4))


def all_bytes(frame):
    return {name: image.tobytes() for name, image in frame.layers.items()} | {"radiance": frame.radiance.tobytes()}


def test_mean_light_is_that_of_the_path_tracer():
    camera, images = CameraConfig(width=128, height=96), []
    for config in (CACHED, RenderConfig(samples_per_pixel=64, threads=2)):
        with Renderer(furnished_room(), camera, config, 5) as renderer:
            images.append(renderer.render(VIEW, 0, ("radiance",)).radiance)
    np.testing.assert_allclose(*(image.mean(axis=(0, 1)) for image in images), rtol=0.03)
    np.testing.assert_allclose(*(image.reshape(4, 24, 4, 32, 3).mean(axis=(1, 3)) for image in images), rtol=0.15)


def test_a_room_lit_from_the_end_of_an_arm_past_a_blind_is_as_bright_as_by_paths_at_every_key():
    """All light comes by way of what stands closest to the pane: slats, recess and the end of the arm."""
    flat, view, camera = l_shaped_room(), pose((3.6, 0.4, 1.6), (1.0, 3.0, 1.0)), CameraConfig(width=64, height=48)
    with Renderer(flat, camera, RenderConfig(samples_per_pixel=256, max_depth=64, threads=2), 3) as renderer:
        expected = renderer.render(view, 0, ("radiance",)).radiance[..., 1].mean()
    shown = np.array([look_up(flat, view, camera=camera, key=key, cache_spacing_m=0.06).radiance[..., 1].mean() for key in range(1, 7)])
    np.testing.assert_allclose(shown, expected, rtol=0.04)
    assert shown.mean() == pytest.approx(expected, rel=0.02)


@pytest.mark.parametrize("threads", [2, 4])
def test_threads_change_no_byte(threads):
    layers = ("color", "radiance", "depth", "albedo", "instance")
    assert all_bytes(look_up(furnished_room(), VIEW, layers=layers, threads=threads)) == all_bytes(
        look_up(furnished_room(), VIEW, layers=layers)
    )


def test_a_frame_alone_is_that_of_a_stream_in_any_order():
    views = {0: VIEW, 1: ELSEWHERE, 2: pose((3.4, 0.5, 1.6), (1.3, 3.2, 0.8))}
    streams = []
    for order in ((0, 1, 2), (2, 0, 1)):
        with Renderer(furnished_room(), SMALL, CACHED, 5) as renderer:
            streams.append({k: all_bytes(renderer.render(views[k], k, ("color", "color_sensed"))) for k in order})
    assert streams[0] == streams[1]
    assert {k: all_bytes(look_up(furnished_room(), views[k], layers=("color", "color_sensed"), frame=k)) for k in views} == streams[0]


def test_matt_light_stays_the_same_from_frame_to_frame_and_key_to_key_differs():
    flat = scene(
        box((0, 0, 0), (4, 3, 2.5), inside=True, object_id=0, roughness=1.0), quad((1, 1, 2.4), (0, 1, 0), (1, 0, 0), emission=(5e3,) * 3)
    )
    view = pose((3.5, 0.4, 1.5), (0.5, 2.5, 0.5))
    frames = [look_up(flat, view, frame=frame, key=key).radiance for frame, key in ((0, 5), (9, 5), (0, 6))]
    np.testing.assert_allclose(frames[0], frames[1], rtol=0.03)
    assert not np.array_equal(frames[0], frames[2])
    np.testing.assert_allclose(frames[0].mean(), frames[2].mean(), rtol=0.02)


def test_a_slow_camera_sees_no_flicker():
    """What a frame shows, warped by the true flow into the next, differs by less than a code: the light is fixed to the surfaces."""
    flat = scene(
        box((0, 0, 0), (4, 3, 2.5), inside=True, object_id=0, color=(0.7, 0.6, 0.5), roughness=1.0),
        box((1, 1, 0), (1.6, 1.8, 0.8), color=(0.3, 0.5, 0.6), roughness=1.0),
        quad((1.5, 1, 2.4), (0, 1, 0), (1, 0, 0), emission=(2e3,) * 3, color=(0, 0, 0)),
    )
    camera = CameraConfig(width=96, height=72)
    path = [
        CameraPose(stamp_ns=k * 10**8, position_m=at.position_m, orientation=at.orientation)
        for k, at in enumerate(pose((3.4 - 0.01 * k, 0.4, 1.5), (0.9 - 0.01 * k, 2.2, 0.5)) for k in range(4))
    ]
    exposure = Exposure(6.0)
    with Renderer(flat, camera, CACHED, 5) as renderer:
        frames = [renderer.render(at, k, ("color", "flow", "instance", "depth"), path=path, exposure=exposure) for k, at in enumerate(path)]
    v, u = np.mgrid[:72, :96].astype(float)
    for one, two in pairwise(frames):
        x, y = u + one.layers["flow"][..., 0], v + one.layers["flow"][..., 1]
        inside = (x > 1) & (x < 94) & (y > 1) & (y < 70)
        i, j = np.clip(y.astype(int), 0, 70), np.clip(x.astype(int), 0, 94)
        s, t = (x - j)[..., None], (y - i)[..., None]
        light = two.radiance.astype(float)
        warped = (1 - t) * ((1 - s) * light[i, j] + s * light[i, j + 1]) + t * ((1 - s) * light[i + 1, j] + s * light[i + 1, j + 1])
        near = np.stack([two.layers["instance"][i + a, j + b] for a in (0, 1) for b in (0, 1)])
        same = inside & (near == one.layers["instance"]).all(axis=0) & (np.linalg.norm(two.radiance[i, j] - light[i, j + 1], axis=-1) < 20)
        shown, expected = (to_display(image.astype(np.float32), exposure, "filmic").astype(int) for image in (warped, one.radiance))
        assert same.mean() > 0.7
        assert np.abs(shown - expected)[same].mean() < 1.0


LIT, SHADED = pose((0.3, 0.3, 1.5), (1.9, 2.0, 0.5)), pose((3.7, 0.3, 1.5), (2.1, 2.0, 0.5))
SHELL = box((0, 0, 0), (4, 3, 2.5), inside=True, name="0/shell", object_id=0, color=(0.7, 0.7, 0.7))
LAMP = quad((0.8, 1.2, 2.4), (0, 0.5, 0), (0.5, 0, 0), name="2/lamp", object_id=2, emission=(9000,) * 3, color=(0, 0, 0))


def test_a_wall_keeps_light_out():
    flat = scene(SHELL, LAMP, box((2, 0, 0), (2.2, 3, 2.5)))
    lit, dark = look_up(flat, LIT).radiance, look_up(flat, SHADED).radiance
    assert lit.mean() > 50.0 and np.median(dark) < 1e-4 * lit.mean() and dark.mean() < 1e-3 * lit.mean()


@pytest.mark.parametrize(("holes", "thickness_m"), [(0.0, 0.0), (0.4, 0.0), (0.0, 0.003)])
def test_cloth_that_parts_a_room_lets_as_much_light_through_as_paths_find(holes, thickness_m):
    """The cloth itself is seen from its dark side, too; sun and lamp light it from the other.  A net shows what stands there.

    Shades of lamps are bodies with two faces of cloth, between which light goes to and fro.
    """
    look = {"color": (0.8, 0.7, 0.6), "ior": 1.5, "transmission": holes, "diffuse_transmission": 0.5}
    sheet, body = quad((2.03, 0, 0), (0, 3, 0), (0, 0, 2.5), **look), box((2.03, 0.001, 0.001), (2.03 + thickness_m, 2.999, 2.499), **look)
    flat = scene(SHELL, LAMP, body if thickness_m > 0.0 else sheet)
    camera = CameraConfig(width=96, height=72)
    for view in (LIT, SHADED, pose((3.7, 1.5, 1.2), (2.0, 1.5, 1.2))):
        images = []
        for config in (CACHED, RenderConfig(samples_per_pixel=64, threads=2)):
            with Renderer(flat, camera, config, 5) as renderer:
                images.append(renderer.render(view, 0, ("radiance",)).radiance.mean(axis=(0, 1)))
        np.testing.assert_allclose(*images, rtol=0.04)
        assert images[0].min() > 1.0


PARTITIONS = {
    "board": box((2, 0, 0), (2.01, 3, 2.5)),
    "plate": box((2.03, 0, 0), (2.032, 3, 2.5)),
    "sheet": quad((2.03, 0, 0), (0, 3, 0), (0, 0, 2.5)),
}


@pytest.mark.parametrize("name", PARTITIONS)
def test_thin_partitions_keep_light_out(name):
    """Floor, walls and ceiling run on beneath them, and so do the grids of nodes: no node lights the other side."""
    flat = scene(SHELL, LAMP, PARTITIONS[name])
    lit, dark = look_up(flat, LIT).radiance, look_up(flat, SHADED).radiance
    assert lit.mean() > 50.0 and dark.max() < 1e-3 * lit.mean()


def test_a_sheet_that_stands_on_nodes_lets_little_light_by():
    """A node in its very plane sees both sides."""
    flat = scene(SHELL, LAMP, quad((2, 0, 0), (0, 3, 0), (0, 0, 2.5)))
    lit, dark = look_up(flat, LIT).radiance, look_up(flat, SHADED).radiance
    assert dark.mean() < 0.01 * lit.mean() and np.median(dark) < 1e-3 * lit.mean()


def test_a_lamp_in_a_cabinet_with_its_door_shut_stays_there():
    """Five boards of 2 cm and a door 2 mm before them, overlapping their fronts."""
    sides = [box((x, 1, 0), (x + 0.02, 2, 2)) for x in (0.01, 0.61)]
    levels = [box((0.03, 1, z), (0.61, 2, z + 0.02)) for z in (0, 1.98)]
    boards = [*sides, *levels, box((0.03, 1, 0.02), (0.61, 1.02, 1.98)), box((0.01, 2, 0), (0.63, 2.02, 2))]
    lamp = box((0.3, 1.5, 1.0), (0.35, 1.55, 1.05), emission=(9000,) * 3, color=(0, 0, 0))
    flat = scene(SHELL, lamp, *boards)
    assert look_up(flat, pose((3.0, 2.8, 1.5), (0.3, 1.5, 1.0))).radiance.max() < 0.05


def test_what_has_no_opening_has_no_light():
    lamp = box((0.5, 0.5, 0.5), (0.6, 0.6, 0.6), emission=(9000,) * 3, color=(0, 0, 0))
    chest = box((0.2, 0.2, 0.2), (1.0, 1.0, 1.0), name="3/chest", object_id=3)
    flat = scene(SHELL, lamp, chest)
    assert look_up(flat, SHADED).radiance.max() == 0.0


@pytest.mark.parametrize("net", [False, True])
def test_panes_keep_in_what_they_mirror(net):
    """At night it is a lamp's light, by day what a net before the window scatters back; through its holes the panes dim the sky."""
    room = pierced(SHELL._replace(color=(0.9, 0.9, 0.9)), (0.05, 0.05), (3.95, 2.45))
    glass = {"portal": True, "transmission": 0.9, "ior": 1.5, "roughness": 0.0}
    pane = quad((0.05, 3, 0.05), (3.9, 0, 0), (0, 0, 2.4), name="9/pane", object_id=9, **glass)
    cloth = quad((0, 2.9, 0), (4, 0, 0), (0, 0, 2.5), color=(0.85, 0.85, 0.85), ior=1.5, transmission=0.4, diffuse_transmission=0.35)
    flat = scene(room, pane, cloth, sky=furnished_room().sky) if net else scene(room, pane, LAMP)
    camera, images = CameraConfig(width=64, height=48), []
    for view in (pose((3.7, 0.3, 1.5), (0.3, 0.5, 0.8)), pose((2.0, 0.3, 1.2), (2.2, 2.9, 1.2))):
        for config in (CACHED, RenderConfig(samples_per_pixel=256, threads=2)):
            with Renderer(flat, camera, config, 5) as renderer:
                images.append(renderer.render(view, 0, ("radiance",)).radiance.mean(axis=(0, 1)))
    np.testing.assert_allclose(images[::2], images[1::2], rtol=0.02)


@pytest.mark.parametrize(("roughness", "floor"), [(0.2, 0.0), (0.35, 0.0), (0.35, 0.8)])
def test_what_light_grazes_takes_less_of_it(roughness, floor):
    """A white front below a lamp, in a black room: its boundary mirrors more of what grazes it; what a floor mirrors is that little."""
    look = {"roughness": roughness, "ior": 1.5}
    shell = box((0, 0, 0), (3, 3, 2.5), inside=True, name="0/shell", object_id=0, color=BLACK, roughness=1.0)
    ground = quad((0.02, 0.02, 0.01), (2.96, 0, 0), (0, 2.96, 0), name="2/floor", object_id=2, color=(floor,) * 3, **look)
    front = box((0.01, 0.5, 0.1), (0.6, 2.5, 0.9), name="3/front", object_id=3, color=(0.7,) * 3, **look)
    lamp = box((1.0, 1.3, 2.38), (1.25, 1.6, 2.45), name="4/lamp", object_id=4, emission=(9000,) * 3)
    flat, view, means = scene(shell, ground, front, lamp), pose((2.5, 1.5, 0.6), (0.6, 1.5, 0.5)), []
    for config in (CACHED, RenderConfig(samples_per_pixel=128, threads=2)):
        with Renderer(flat, CameraConfig(width=64, height=48), config, 5) as renderer:
            frame = renderer.render(view, 0, ("radiance", "instance"))
        means.append(frame.radiance[frame.layers["instance"] == 3].mean())
    assert means[0] == pytest.approx(means[1], rel=0.04)


def test_every_other_layer_comes_from_the_path_tracer():
    names = tuple(name for name in LAYERS if LAYERS[name].group != "sensed")
    path = (VIEW, pose((3.3, 0.4, 1.6), (1.3, 3.2, 0.8)))
    images = {}
    for integrator in ("path", "cached"):
        with Renderer(furnished_room(), SMALL, RenderConfig(integrator=integrator, samples_per_pixel=4, threads=2), 5) as renderer:
            images[integrator] = renderer.render(VIEW, 0, names, path=path).layers
    assert list(images["cached"]) == list(images["path"])
    for name, image in images["cached"].items():
        assert image.dtype == images["path"][name].dtype and image.shape == images["path"][name].shape, name
        assert np.array_equal(image, images["path"][name], equal_nan=image.dtype.kind == "f") == (name not in PICTURES), name


def test_only_pictures_open_the_cache():
    frame = look_up(furnished_room(), VIEW, layers=("albedo", "depth"))
    assert frame.radiance is None and list(frame.layers) == ["depth", "albedo"] and frame.samples == 16
    frame = look_up(furnished_room(), VIEW, layers=("color",))
    assert list(frame.layers) == ["color"] and frame.samples == 0 and frame.rays > 32 * 24


def test_faulty_requests_are_refused_as_ever():
    with Renderer(furnished_room(), SMALL, CACHED, 5) as renderer:
        with pytest.raises(RenderError, match="frame index"):
            renderer.render(VIEW, -1, ("color",))
        with pytest.raises(RenderError, match="layers"):
            renderer.render(VIEW, 0, ("colour",))


def test_odd_scenes_and_sizes():
    wall = quad((0, -9, 0), (0, 18, 0), (0, 0, 9), color=(0.5, 0.5, 0.5))
    frame = look_up(scene(wall), pose((2.0, 0.0, 0.0), (0.0, 0.0, 0.0)), layers=("color", "depth"), camera=CameraConfig(width=7, height=5))
    assert (frame.radiance == 0).all() and frame.layers["color"].shape == (5, 7, 3)
    sheet = scene(quad((0, 0, 0), (1e-5, 0, 0), (0, 1e-4, 0)), quad((5, -1, -1), (0, 0, 2), (0, 2, 0), emission=(5, 5, 5)))
    assert np.isfinite(look_up(sheet, pose((2.0, 0.0, 0.0), (5.0, 0.0, 0.0))).radiance).all()
