"""Layers of the hit record against analytic rooms, other layers, and the neighbouring frames."""

from dataclasses import replace

import numpy as np
import pytest
from box_room import VIEW, box, furnished_room, pose, quad, scene
from sample_scene import sample_scene

from renderer import GEOMETRIC_LAYERS, CameraConfig, RenderConfig, Renderer
from renderer.camera.cameras import project
from renderer.film.layers import HIT_LAYERS, LAYERS
from renderer.ground_truth.motion import HIDDEN, OUTSIDE, UNKNOWN, VISIBLE
from renderer.scene.flatten import flatten
from scene_description.labels import material_labels, part_ids, part_labels
from scene_description.poses import rotation_from_quaternion

CAMERA = CameraConfig(width=321, height=242)
LENSES = (
    CAMERA,
    CameraConfig(model="brown_conrady", width=203, height=151, distortion=(-0.2, 0.03, 0.001, -0.002)),
    CameraConfig(model="equirectangular", width=256, height=128),
)
AHEAD = pose((0.0, 0.0, 0.0), (1.0, 0.0, 0.0))
PATH = (
    replace(VIEW, stamp_ns=100),
    replace(pose((3.45, 0.42, 1.62), (1.35, 3.2, 0.8)), stamp_ns=200),
    replace(pose((3.5, 0.6, 1.6), (1.3, 3.1, 0.85)), stamp_ns=300),
)


def layers(flat, view, *names, camera=CAMERA, threads=2, path=()):
    with Renderer(flat, camera, RenderConfig(threads=threads), 0) as renderer:
        return renderer.render(view, 0, (*GEOMETRIC_LAYERS, *names), path=path).layers


@pytest.mark.parametrize("camera", LENSES, ids=lambda camera: camera.model)
def test_points_lie_where_their_pixels_look_at_their_range(camera):
    seen = layers(furnished_room(), VIEW, "position", "position_camera", camera=camera)
    places = project(camera, VIEW, seen["position"].reshape(-1, 3).astype(np.float64)).reshape(camera.height, camera.width, 3)
    v, u = np.mgrid[: camera.height, : camera.width] + 0.5
    assert np.nanmax(np.abs(places[..., 0] - u)) < 0.01 and np.nanmax(np.abs(places[..., 1] - v)) < 0.01
    np.testing.assert_allclose(places[..., 2], seen["depth"], atol=1e-4)
    away = seen["position"] - np.float32(VIEW.position_m)
    np.testing.assert_allclose(np.linalg.norm(away, axis=-1), seen["range"], atol=1e-4)
    np.testing.assert_allclose(seen["position_camera"], away @ rotation_from_quaternion(VIEW.orientation), atol=1e-5)


def test_nothing_hit_is_told_as_the_table_says():
    seen = layers(scene(quad((2.0, -0.5, -0.5), (0, 0, 1), (0, 1, 0))), AHEAD, *HIT_LAYERS)
    missed = np.isinf(seen["depth"])
    assert 0.5 < missed.mean() < 0.99
    for name in HIT_LAYERS:
        if LAYERS[name].no_hit is not None:
            np.testing.assert_array_equal(seen[name][missed], LAYERS[name].no_hit, name)


def test_a_layer_is_the_same_whatever_else_is_asked_for():
    with Renderer(furnished_room(), CAMERA, RenderConfig(threads=2), 0) as renderer:
        together = renderer.render(PATH[1], 0, HIT_LAYERS, path=PATH).layers
        for name in HIT_LAYERS:
            alone = renderer.render(PATH[1], 0, (name,), path=PATH).layers
            assert list(alone) == [name] and alone[name].flags.c_contiguous
            LAYERS[name].check(alone[name])
            np.testing.assert_array_equal(alone[name], together[name], name)


def test_what_is_seen_is_told_by_part_and_material():
    flat = furnished_room()
    flat = flat._replace(part_id=np.arange(1, len(flat.part_names) + 1, dtype=np.uint16) * 7)
    seen = layers(flat, VIEW, "part", "material", "base_color", "roughness", "metallic", "emission", "glass", "mirror")
    rows = {int(number): row for row, number in enumerate(flat.parts.object_id)}
    row = np.vectorize(rows.get)(seen["instance"])
    np.testing.assert_array_equal(seen["part"], 7 * (row + 1))
    np.testing.assert_array_equal(seen["material"], flat.parts.material[row] + 1)
    lit = flat.parts.emission.any(axis=1) | flat.parts.portal
    plain = ~lit[row]
    np.testing.assert_allclose(seen["base_color"][plain], flat.materials.base_color[row][plain], rtol=1e-6)
    assert (seen["roughness"][plain] == np.float32(0.8)).all() and not seen["metallic"].any() and not seen["mirror"].any()
    assert not seen["emission"][plain].any()
    pane = seen["emission"][row == 1]
    assert (pane >= np.float32(0.8) * flat.sky.ground * 0.99).all() and (pane <= np.float32(0.8) * flat.sky.horizon * 1.01).all()
    np.testing.assert_array_equal(seen["glass"], np.where(row == 1, 255, 0))


def test_a_lamp_emits_what_its_part_says_and_smooth_metal_is_a_mirror():
    flat = scene(
        quad((2.0, -1.0, -1.0), (0, 0, 2), (0, 1, 0), object_id=1, emission=(9000, 7000, 4500)),
        quad((2.0, 0.0, -1.0), (0, 0, 2), (0, 1, 0), object_id=2, metallic=1.0, roughness=0.05, color=(0.9, 0.8, 0.7)),
    )
    seen = layers(flat, AHEAD, "emission", "mirror", "metallic", "roughness")
    lamp, metal = seen["instance"] == 1, seen["instance"] == 2
    assert lamp.any() and metal.any()
    np.testing.assert_allclose(seen["emission"][lamp], np.broadcast_to([9000, 7000, 4500], (lamp.sum(), 3)), rtol=1e-6)
    np.testing.assert_array_equal(seen["mirror"], np.where(metal, 255, 0))
    assert (seen["metallic"][metal] == 1).all() and (seen["roughness"][metal] == np.float32(0.05)).all()


def test_normals_are_told_in_both_frames_and_smooth_surfaces_have_their_own():
    flat = furnished_room()
    point = flat.mesh.vertices - np.float32([2.0, 1.5, 1.0])
    smooth = (point / np.linalg.norm(point, axis=1, keepdims=True)).astype(np.float32)
    names = ("normals_world", "shading_normals", "shading_normals_world", "position")
    seen = layers(flat, VIEW, *names)
    rotation = rotation_from_quaternion(VIEW.orientation)
    np.testing.assert_allclose(seen["normals_world"], seen["normals"] @ rotation.T, atol=1e-6)
    np.testing.assert_allclose(seen["shading_normals_world"], seen["normals_world"], atol=1e-5)
    bent = layers(flat._replace(mesh=flat.mesh._replace(normals=smooth)), VIEW, *names)
    np.testing.assert_allclose(bent["shading_normals"], bent["shading_normals_world"] @ rotation, atol=1e-5)
    bed = (seen["instance"] == 3) & (seen["position"][..., 2] > 0.499)
    assert bed.any() and np.abs(bent["shading_normals_world"] - bent["normals_world"])[bed].max() > 0.1
    np.testing.assert_array_equal(bent["normals_world"], seen["normals_world"])


def test_incidence_on_a_wall_ahead_is_the_angle_to_the_optical_axis():
    seen = layers(scene(quad((2.0, -3, -3), (0, 0, 6), (0, 6, 0))), AHEAD, "incidence")
    v, u = np.mgrid[: CAMERA.height, : CAMERA.width] + 0.5
    away = np.hypot(u - CAMERA.width / 2, v - CAMERA.height / 2)
    np.testing.assert_allclose(seen["incidence"], np.arctan(away / CAMERA.focal_length_px), atol=2e-3)


def test_incidence_is_the_arc_cosine_of_normal_and_way():
    seen = layers(furnished_room(), VIEW, "incidence", "normals_world", "position")
    way = np.array(VIEW.position_m) - seen["position"]
    expected = np.arccos((way * seen["normals_world"]).sum(axis=-1) / np.linalg.norm(way, axis=-1))
    oblique = expected > 0.2  # the cosine of less has too few digits for the angle
    assert expected.max() > 1.3 and oblique.mean() > 0.9
    np.testing.assert_allclose(seen["incidence"][oblique], expected[oblique], atol=2e-6)


def test_texture_coordinates_are_the_meshs_own():
    seen = layers(furnished_room(), VIEW, "uv", "position")
    np.testing.assert_allclose(seen["uv"], seen["position"][..., :2], atol=1e-5)


def test_object_coordinates_parts_and_materials_follow_the_description():
    description = sample_scene()
    camera = CameraConfig(width=160, height=120)
    seen = layers(flatten(description), description.camera_path[0], "object_coordinates", "position", "part", "material", camera=camera)
    checked = 0
    for thing in description.objects:
        mask = seen["instance"] == thing.id
        if not mask.any():
            continue
        checked += 1
        x, y, z = (seen["position"][mask] - np.float32(thing.position_m)).T
        cosine, sine = np.cos(thing.yaw_rad), np.sin(thing.yaw_rad)
        local = np.stack([x * cosine + y * sine, y * cosine - x * sine, z], axis=1) / thing.size_m + (0.5, 0.5, 0.0)
        np.testing.assert_allclose(seen["object_coordinates"][mask], local, atol=1e-4)
        assert local.min() > -0.01 and local.max() < 1.01
        ids = {part_ids(description)[f"{thing.id}/{part.name}"] for part in thing.parts}
        assert set(np.unique(seen["part"][mask])) <= ids
    assert checked
    assert set(np.unique(seen["part"])) - {0} <= set(part_labels(description))
    named = material_labels(description)
    assert {named[int(number)]["name"] for number in np.unique(seen["material"])} <= {material.id for material in description.materials}


def test_flow_of_a_camera_that_moves_sideways_is_focal_length_times_way_over_depth():
    there = replace(AHEAD, stamp_ns=1, position_m=(0.0, -0.1, 0.0))
    seen = layers(scene(quad((2.0, -3, -3), (0, 0, 6), (0, 6, 0))), AHEAD, "flow", "flow_backward", path=(AHEAD, there))
    np.testing.assert_allclose(seen["flow"][..., 0], -CAMERA.focal_length_px * 0.1 / 2.0, atol=1e-3)
    np.testing.assert_allclose(seen["flow"][..., 1], 0.0, atol=1e-3)
    assert np.isnan(seen["flow_backward"]).all()


@pytest.mark.parametrize("camera", LENSES[:2], ids=lambda camera: camera.model)
@pytest.mark.parametrize(("name", "other"), [("", 2), ("_backward", 0)])
def test_what_is_not_occluded_is_found_where_flow_says(camera, name, other):
    flat, flow, state = furnished_room(), f"flow{name}", f"occlusion{name}"
    here = layers(flat, PATH[1], "position", flow, state, camera=camera, path=PATH)
    there = layers(flat, PATH[other], "position", camera=camera)
    v, u = np.mgrid[: camera.height, : camera.width] + 0.5
    places = np.stack([u, v], axis=-1) + here[flow]
    inside = ((places >= 0) & (places <= (camera.width, camera.height))).all(axis=-1)
    np.testing.assert_array_equal(here[state] == OUTSIDE, ~inside)
    column, row = (np.clip(places[..., axis].astype(int), 0, size - 1) for axis, size in ((0, camera.width), (1, camera.height)))
    exact = project(camera, PATH[other], here["position"].reshape(-1, 3).astype(np.float64)).reshape(*inside.shape, 3)
    assert np.nanmax(np.abs(exact[..., :2] - places)[inside]) < 0.05
    # The z-test: of what is seen there, the point itself is the nearest in its pixel's ray; a hidden point lies behind.
    behind = exact[..., 2] - there["depth"][row, column]
    visible, hidden = inside & (here[state] == VISIBLE), inside & (here[state] == HIDDEN)
    slope = np.abs(np.gradient(there["depth"])).max(axis=0)[row, column] + 2e-3
    assert (np.abs(behind) <= 2 * slope)[visible].mean() > 0.999
    assert hidden.any() and (behind > -2 * slope)[hidden].all() and (behind > 0.02)[hidden].mean() > 0.8
    assert not (here[state] == UNKNOWN).any()


def test_the_ends_of_a_path_and_poses_beside_it_have_no_flow():
    for view, path in ((PATH[-1], PATH), (VIEW, ()), (VIEW, PATH)):
        seen = layers(furnished_room(), view, "flow", "occlusion", path=path)
        assert np.isnan(seen["flow"]).all() and (seen["occlusion"] == UNKNOWN).all()


def test_boundaries_are_where_a_box_ends_before_a_wall_and_not_where_walls_meet():
    room = box((-1, -2, -1), (4, 2, 1), inside=True, object_id=0)
    assert not layers(scene(room), AHEAD, "boundaries")["boundaries"].any()
    seen = layers(scene(room, box((1.5, -0.3, -0.4), (1.9, 0.4, 0.3), object_id=5)), AHEAD, "boundaries")
    mask = np.pad(seen["instance"] == 5, 1)
    inner = mask[1:-1, 2:] & mask[1:-1, :-2] & mask[2:, 1:-1] & mask[:-2, 1:-1]
    np.testing.assert_array_equal(seen["boundaries"] == 255, mask[1:-1, 1:-1] & ~inner)


def test_a_box_that_stands_on_the_floor_has_no_boundary_where_it_touches():
    view = pose((2.6, 0.2, 1.6), (1.0, 2.0, 0.0))
    seen = layers(furnished_room(), view, "boundaries", "position")
    touching = (seen["instance"] == 3) & (seen["position"][..., 2] < 0.01)
    assert touching.any() and (seen["boundaries"][touching] == 255).mean() < 0.1


def test_coverage_is_the_share_of_a_pixel():
    camera = CameraConfig(width=32, height=32, horizontal_fov_rad=2 * np.arctan(0.5))  # a pixel is 1/32 at a distance of 1
    flat = scene(
        quad((1.0, -2.0, -2.0), (0, 0, 4), (0, 2.0 - 0.25 / 32, 0), object_id=3), quad((1.5, -3, -3), (0, 0, 6), (0, 6, 0), object_id=4)
    )
    seen = layers(flat, AHEAD, "coverage", camera=camera)
    assert (seen["instance"][:, :16] == 4).all() and (seen["instance"][:, 16:] == 3).all()
    np.testing.assert_allclose(seen["coverage"][:, 16], 0.75)
    np.testing.assert_allclose(np.delete(seen["coverage"], 16, axis=1), 1.0)


def test_coverage_by_pixels_is_coverage_by_tiles():
    almost_plain = replace(CAMERA, model="brown_conrady", distortion=(1e-9,))
    by_pixels, by_tiles = (layers(furnished_room(), PATH[1], "coverage", camera=camera)["coverage"] for camera in (CAMERA, almost_plain))
    assert 0.0 < (by_pixels < 1.0).mean() < 0.2
    np.testing.assert_array_equal(by_pixels, by_tiles)


def test_what_lies_behind_glass_is_the_first_opaque_surface():
    wall = quad((3.0, -3, -3), (0, 0, 6), (0, 6, 0), object_id=9, label=1)
    glass = box((1.0, -0.5, -0.5), (1.2, 0.5, 0.5), object_id=5, label=7, transmission=0.95, ior=1.5)
    names = ("depth_opaque", "normals_opaque", "semantic_opaque", "instance_opaque")
    seen, bare = layers(scene(wall, glass), AHEAD, *names), layers(scene(wall), AHEAD)
    assert (seen["instance"] == 5).any()
    for name in names:
        np.testing.assert_array_equal(seen[name], bare[name.removesuffix("_opaque")], name)


@pytest.mark.parametrize("camera", [CAMERA, replace(CAMERA, row_time_s=1e-9)], ids=["global", "rolling"])
def test_bytes_depend_on_no_threads(camera):
    one, two = (layers(furnished_room(), PATH[1], *HIT_LAYERS, camera=camera, threads=n, path=PATH) for n in (1, 2))
    for name in HIT_LAYERS:
        assert one[name].tobytes() == two[name].tobytes(), name
        LAYERS[name].check(one[name])
