"""What the benches of the irradiance cache compute from frames, scenes and pages; never how fast anything is."""

import importlib

import numpy as np
import pytest
from box_room import box, quad, scene

from benchmarks.rate_curves_bench import subdivided
from benchmarks.sampled_rooms import REST, STAGES, References, SampledRoom, camera_of, everywhere, stage_times
from benchmarks.table import write_section
from benchmarks.walk_bench import is_followed, is_matt, is_opaque, moved, pose_error, second_from_first, warped_difference
from renderer import CameraConfig, RenderConfig, Renderer
from renderer.camera.cameras import project, unproject
from renderer.film.tone import Exposure
from scene_description import CameraPose
from scene_description.poses import look_at

LAMP = quad((-0.3, -0.3, 1.9), (0, 0.6, 0), (0.6, 0, 0), name="2/lamp", object_id=2, emission=(900.0, 900.0, 900.0))
ROOM = scene(box((-2, -2, 0), (2, 2, 2), inside=True, name="0/shell", object_id=0), LAMP)


def pose(x: float, y: float, stamp_ns: int = 0) -> CameraPose:
    return CameraPose(stamp_ns=stamp_ns, position_m=(x, y, 1.0), orientation=look_at((x, y, 1.0), (1.5, 0.3 + y, 0.8)))


PATH = (pose(-1.0, 0.0), pose(-1.0, 0.1, 1))


def test_a_part_of_a_page_is_written_between_its_marks_and_no_other(tmp_path) -> None:
    page = tmp_path / "page.md"
    page.write_text("# A\n<!-- one -->\nold\n<!-- end of one -->\n<!-- two -->\nkept\n<!-- end of two -->\n")
    write_section(page, "one", r"| new \1 |")
    assert page.read_text() == "# A\n<!-- one -->\n\n| new \\1 |\n\n<!-- end of one -->\n<!-- two -->\nkept\n<!-- end of two -->\n"
    with pytest.raises(ValueError, match=r"page.md: expected the marks '<!-- three -->' and '<!-- end of three -->' once, got 0"):
        write_section(page, "three", "")


def test_a_picture_that_moves_as_its_flow_says_does_not_flicker() -> None:
    columns = np.broadcast_to(4 * np.arange(32)[None, :, None], (16, 32, 3))
    before, now = (np.ascontiguousarray(columns + shift).astype(np.uint8) for shift in (0, 6))
    flow = np.zeros((16, 32, 2), np.float32)
    flow[..., 0] = 1.5
    inside = np.zeros((16, 32), bool)
    inside[:, :30] = True
    assert warped_difference(before, now, flow, inside) == pytest.approx(0.0, abs=1e-9)
    assert warped_difference(before, now, 0.0 * flow, inside) == pytest.approx(6.0)


def test_only_what_lies_amid_four_pixels_of_its_part_is_followed() -> None:
    part = np.ones((4, 6), np.uint16)
    part[:, 3:] = 2
    flow = np.zeros((4, 6, 2), np.float32)
    flow[..., 0] = 0.5
    layers = {"part": part, "instance": part, "flow_backward": flow, "occlusion_backward": np.zeros((4, 6), np.uint8)}
    hidden = layers | {"occlusion_backward": np.pad(np.ones((1, 6), np.uint8), ((0, 3), (0, 0)))}
    # Between columns 2 and 3 there are both parts, and the last column comes from beyond the image.
    expected = np.tile([True, True, False, True, True, False], (4, 1))
    assert np.array_equal(is_followed(layers, layers), expected)
    expected[0] = False
    assert np.array_equal(is_followed(layers, hidden), expected)


def test_matt_is_what_is_rough_and_has_neither_metal_coat_nor_glass() -> None:
    looks = [{}, {"transmission": 0.9}, {"clearcoat": 0.5}]
    flat = scene(*(quad((0, 0, 0), (1, 0, 0), (0, 1, 0), **look) for look in looks))
    truth = {
        "material": np.array([[1, 2, 3, 1, 1, 1, 0]]),
        "roughness": np.array([[0.8, 0.8, 0.8, 0.2, 0.8, 0.8, 0.8]]),
        "metallic": np.array([[0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0]]),
        "depth": np.array([[1.0, 1.0, 1.0, 1.0, 1.0, np.nan, 1.0]]),
    }
    assert is_matt(flat, truth).tolist() == [[True, False, False, False, False, False, False]]
    assert is_opaque(flat, truth).tolist() == [[True, False, True, True, True, False, False]]


def test_the_error_of_a_pose_is_its_way_and_its_angle() -> None:
    true = second_from_first(*PATH)
    angle = np.radians(1e-4)
    off = np.array([[np.cos(angle), -np.sin(angle), 0, 0.003], [np.sin(angle), np.cos(angle), 0, 0], [0, 0, 1, 0.004], [0, 0, 0, 1]])
    assert pose_error(true, true @ off) == pytest.approx((0.005, 1e-4), rel=1e-6)


def test_places_move_as_the_camera_projects_them() -> None:
    camera = camera_of((40, 30))
    depth = np.full((30, 40), 1.7, np.float32)
    depth[2, 3] = np.inf
    places = np.array([[5.2, 7.0], [30.0, 20.4], [3.0, 2.0]])
    points = unproject(camera, PATH[0], np.column_stack([places + 0.5, np.full(3, 1.7)]))
    expected = project(camera, PATH[1], points)[:, :2] - 0.5
    found = moved(places, depth, second_from_first(*PATH))
    assert found[:2] == pytest.approx(expected[:2], abs=1e-4)
    assert np.isnan(found[2]).all()


@pytest.mark.parametrize("count", [14, 100, 1001])
def test_cut_triangles_cover_what_they_were_and_keep_their_part(count: int) -> None:
    def areas(flat) -> np.ndarray:
        corners = flat.mesh.vertices[flat.mesh.faces].astype(np.float64)
        area = 0.5 * np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
        return np.bincount(flat.face_part, area)

    finer = subdivided(ROOM, count)
    assert count <= len(finer.mesh.faces) <= count + 2
    assert areas(finer) == pytest.approx(areas(ROOM), rel=1e-5)
    assert np.linalg.norm(finer.mesh.normals, axis=1) == pytest.approx(1.0, abs=1e-5)


def test_hits_everywhere_leave_no_place_farther_than_their_spacing() -> None:
    hits = everywhere(ROOM, 0.5)
    assert set(hits.face[0]) == set(range(len(ROOM.mesh.faces)))
    assert (hits.u >= 0).all() and (hits.v >= 0).all() and (hits.u + hits.v <= 1).all()
    a, b, c = np.moveaxis(ROOM.mesh.vertices[ROOM.mesh.faces[hits.face[0]]], 1, 0)
    points = a + hits.u[0][:, None] * (b - a) + hits.v[0][:, None] * (c - a)
    weights = np.random.default_rng(1).dirichlet((1, 1, 1), 500)
    for face in range(len(ROOM.mesh.faces)):
        there = weights @ ROOM.mesh.vertices[ROOM.mesh.faces[face]]
        nearest = np.linalg.norm(there[:, None] - points[hits.face[0] == face], axis=2).min(axis=1)
        assert nearest.max() < 0.5


def test_stages_are_what_the_renderer_calls_and_add_up() -> None:
    room = SampledRoom("box 0", ROOM, 1, PATH, Exposure(5.0))
    calls = [(importlib.import_module(module), name) for stage in STAGES.values() for module, name in stage]
    before = [getattr(module, name) for module, name in calls]
    coarse = RenderConfig(integrator="cached", cache_spacing_m=0.5, threads=1)
    with Renderer(ROOM, CameraConfig(width=64, height=48), coarse, 1) as renderer:
        taken = stage_times(renderer, room)
    assert [getattr(module, name) for module, name in calls] == before
    assert set(taken) == {*STAGES, REST}
    assert all(taken[stage] > 0.0 for stage in STAGES)


@pytest.mark.slow
def test_references_are_kept_until_the_exposure_changes(tmp_path) -> None:
    pytest.importorskip("pyoidn")
    room, references = SampledRoom("box 0", ROOM, 1, PATH, Exposure(5.0)), References(tmp_path, 1)
    first = references.view(room, 1, (24, 16))
    assert first.color.shape == first.color_noisy.shape == first.radiance.shape == (16, 24, 3)
    kept = references.view(room._replace(flat=None), 1, (24, 16))  # type: ignore[arg-type]
    assert all(np.array_equal(a, b) for a, b in zip(first, kept, strict=True))
    darker = references.view(room._replace(exposure=Exposure(7.0)), 1, (24, 16))
    assert darker.color.mean() < first.color.mean()
    assert references.path_of(room, 0, (24, 16)) != references.path_of(room, 1, (24, 16))
