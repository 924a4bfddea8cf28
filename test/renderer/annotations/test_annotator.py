"""What is told of objects: against the instance image, and against boxes whose image is known."""

import math

import numpy as np
import pytest
from box_room import pose
from box_scene import annotated, crate, crates_scene
from sample_scene import sample_scene

from renderer import CameraConfig, RenderConfig, Renderer
from renderer.annotations import Annotator
from renderer.annotations.projection import Projection, field_edge
from renderer.camera.cameras import pose_camera, project
from renderer.camera.rig import mounted_path
from renderer.scene.flatten import flatten
from scene_description import CameraPose, FieldError, Support
from scene_description.annotations import annotations_from_json, annotations_to_json
from scene_description.labels import instance_labels
from scene_description.poses import look_at, rotation_from_quaternion

LEVEL = pose((-3.0, 0.0, 1.0), (0.0, 0.0, 1.0))
"""Looks along +x; the image's right is -y, its left +y."""
SQUARE = CameraConfig(width=400, height=400, horizontal_fov_rad=math.pi / 2)
"""200 px to the unit of slope."""


def sides(box):
    return np.array([box.x, box.y, box.x + box.width, box.y + box.height])


def box_iou(a, b):
    a, b = sides(a), sides(b)
    common = np.prod(np.maximum(np.minimum(a[2:], b[2:]) - np.maximum(a[:2], b[:2]), 0.0))
    return common / (np.prod(a[2:] - a[:2]) + np.prod(b[2:] - b[:2]) - common)


def hull(points):
    """Convex hull of points (n, 2), in order, by Andrew's monotone chain."""
    points = sorted(map(tuple, points))

    def half(row):
        chain = []
        for p in row:
            while len(chain) > 1 and side(chain[-2], chain[-1], p) <= 0:
                chain.pop()
            chain.append(p)
        return chain[:-1]

    return np.array(half(points) + half(points[::-1]))


def side(a, b, p):
    """How far p lies to one side of the line from a to b, times their distance."""
    return (b[0] - a[0]) * (p[1] - a[1]) - (b[1] - a[1]) * (p[0] - a[0])


def filled(corners, height, width):
    """Pixels whose centres lie in the convex hull of corners."""
    v, u = np.mgrid[:height, :width] + 0.5
    inside = np.ones((height, width), bool)
    outline = hull(corners)
    for a, b in zip(outline, np.roll(outline, -1, axis=0), strict=True):
        inside &= side(a, b, (u, v)) >= 0
    return inside


def mask_box(mask):
    rows, columns = np.flatnonzero(mask.any(axis=1)), np.flatnonzero(mask.any(axis=0))
    return columns[0], rows[0], columns[-1] + 1 - columns[0], rows[-1] + 1 - rows[0]


APART = [
    crate(3, (0.5, 0.9, 0.0), (0.6, 0.8, 1.1), 0.4),
    crate(5, (1.0, -1.2, 0.0), (0.5, 1.4, 0.7), -0.9),
    crate(8, (2.5, 0.0, 1.6), (0.9, 0.4, 0.5), 1.1),
]
LENSES = [
    CameraConfig(width=640, height=480),
    CameraConfig(model="brown_conrady", width=640, height=480, distortion=(-0.2, 0.03, 0.001, -0.002)),
    CameraConfig(model="kannala_brandt", width=480, height=480, horizontal_fov_rad=3.0, distortion=(0.02, -0.01)),
    CameraConfig(model="equirectangular", width=1024, height=512),
]


@pytest.mark.parametrize("camera", LENSES, ids=lambda camera: camera.model)
def test_boxes_and_counts_are_those_of_the_pixels(camera):
    frame = annotated(APART, LEVEL, camera)
    ids, counts = np.unique(frame.layers["instance"], return_counts=True)
    found = frame.annotations
    assert (found.width, found.height, found.scene, found.stamp_ns) == (camera.width, camera.height, "sample-1", LEVEL.stamp_ns)
    assert [item.id for item in found.objects] == [3, 5, 8] == list(ids[ids > 0])
    for item in found.objects:
        mask = frame.layers["instance"] == item.id
        assert item.visible_pixels == item.full_pixels == counts[list(ids).index(item.id)]
        own = item.visible_box
        assert (own.x, own.y, own.width, own.height) == mask_box(mask)
        assert (item.full_box, item.visible_fraction, item.truncation) == (own, 1.0, 0.0)


@pytest.mark.parametrize("camera", LENSES[:2], ids=lambda camera: camera.model)
def test_the_corners_of_a_cuboid_bound_its_mask(camera):
    frame = annotated(APART, LEVEL, camera)
    for item in frame.annotations.objects:
        mask = frame.layers["instance"] == item.id
        corners = [(corner.u_px, corner.v_px) for corner in item.corners]
        shape = filled(corners, *mask.shape)
        assert (shape & mask).sum() / (shape | mask).sum() > 0.99
        assert all(corner.in_image and not corner.behind for corner in item.corners)
        hidden = [corner.occluded for corner in item.corners]
        assert 1 <= sum(hidden) <= 4  # those at its back, behind itself


def test_corners_are_the_box_s_own_in_both_frames():
    found = annotated(APART, LEVEL).annotations
    for item, thing in zip(found.objects, APART, strict=True):
        assert item.world_box.size_m == item.camera_box.size_m == thing.size_m
        center = np.add(thing.position_m, (0.0, 0.0, 0.5 * thing.size_m[2]))
        np.testing.assert_allclose(item.world_box.center_m, center, atol=1e-6)
        turn = rotation_from_quaternion(LEVEL.orientation)
        np.testing.assert_allclose(turn @ item.camera_box.center_m + LEVEL.position_m, center, atol=2e-6)
        both = turn @ rotation_from_quaternion(item.camera_box.orientation)
        np.testing.assert_allclose(both, rotation_from_quaternion(item.world_box.orientation), atol=1e-8)
        lower = [(-1, -1, -1), (1, -1, -1), (1, 1, -1), (-1, 1, -1)]
        signs = np.array(lower + [(x, y, 1) for x, y, _ in lower])
        corners = signs * 0.5 * np.array(thing.size_m) @ rotation_from_quaternion(item.world_box.orientation).T + center
        told = [(corner.u_px, corner.v_px, corner.depth_m) for corner in item.corners]
        np.testing.assert_allclose(told, project(CameraConfig(width=640, height=480), LEVEL, corners), atol=1e-3)


def test_the_visible_fraction_of_a_half_hidden_box_is_known():
    """A face of 2 x 1 m at 4 m covers 100 x 50 px; one at 2 m hides its left half."""
    far, near = crate(2, (1.5, 0.0, 0.5), (1.0, 2.0, 1.0)), crate(1, (-0.5, 1.0, 0.0), (1.0, 2.0, 2.0))
    (first, second) = annotated([far, near], LEVEL, SQUARE).annotations.objects
    assert (first.visible_fraction, first.truncation) == (1.0, 0.0)
    assert (second.visible_pixels, second.full_pixels, second.visible_fraction) == (2500, 5000, 0.5)
    assert tuple(sides(second.visible_box)) == (200, 175, 250, 225) and tuple(sides(second.full_box)) == (150, 175, 250, 225)
    assert [corner.occluded for corner in second.corners] == [False, True, True, True] * 2


def test_truncation_is_the_share_of_the_full_box_outside_the_image():
    """A plate of 2 x 1 m at 2 m has 200 x 100 px, columns 300 to 500: half of them outside."""
    item = annotated([crate(1, (-0.9995, -2.0, 0.5), (0.001, 2.0, 1.0))], LEVEL, SQUARE).annotations.objects[0]
    np.testing.assert_allclose(sides(item.full_box), (300, 150, 500, 250), atol=0.1)
    assert abs(item.truncation - 0.5) < 0.001
    assert tuple(sides(item.visible_box)) == (300, 150, 400, 250)
    assert item.visible_fraction == 1.0
    outside = [corner for corner in item.corners if not corner.in_image]
    assert len(outside) == 4 and all(corner.u_px > 400 and not corner.behind for corner in outside)


def test_an_object_that_reaches_behind_the_camera_is_cut_before_it():
    """A board of 8 m beside the camera: in the plane 5 cm before it, its near face lies at slope 20."""
    item = annotated([crate(1, (-1.0, -1.5, 0.5), (8.0, 1.0, 1.0))], LEVEL, SQUARE).annotations.objects[0]
    assert sum(corner.behind for corner in item.corners) == 4
    assert all((corner.u_px is None) == corner.behind for corner in item.corners)
    x, y, right, bottom = sides(item.full_box)
    assert (x, y, bottom) == pytest.approx((200 + 200 * 1 / 6, 200 - 200 * 0.5 / 0.05, 200 + 200 * 0.5 / 0.05), abs=1.5)
    assert right == pytest.approx(200 + 200 * 2.0 / 0.05, abs=0.1)
    assert 0.99 < item.truncation < 1.0


def test_a_rolling_shutter_shows_objects_where_their_rows_were_taken():
    camera = CameraConfig(width=320, height=240, row_time_s=2e-4)
    eye, step = LEVEL.position_m, 40_000_000
    path = [
        CameraPose(stamp_ns=k * step, position_m=(eye[0], 0.1 * k, eye[2]), orientation=look_at(eye, (0.0, 0.5 - 0.25 * k, 1.0)))
        for k in range(4)
    ]
    frame = annotated(APART, path[1], camera, path=path)
    still = annotated(APART, path[1], camera)
    for item, other in zip(frame.annotations.objects, still.annotations.objects, strict=True):
        mask = frame.layers["instance"] == item.id
        shape = filled([(corner.u_px, corner.v_px) for corner in item.corners], *mask.shape)
        assert (shape & mask).sum() / (shape | mask).sum() > 0.97
        assert item.full_pixels == item.visible_pixels == mask.sum()
        assert abs(item.corners[0].u_px - other.corners[0].u_px) > 2.0


@pytest.mark.parametrize(
    "camera",
    [
        CameraConfig(width=320, height=240, row_time_s=2e-4),
        CameraConfig(model="brown_conrady", width=320, height=240, horizontal_fov_rad=1.5, distortion=(-0.25, 0.05, 0.001, -0.002)),
        CameraConfig(model="kannala_brandt", width=240, height=240, horizontal_fov_rad=3.1),
        CameraConfig(model="equirectangular", width=256, height=128),
    ],
    ids=("rolling", "brown_conrady", "kannala_brandt", "equirectangular"),
)
def test_an_object_s_full_pixels_are_those_of_a_picture_of_it_alone(camera):
    scene = sample_scene()
    flat, view = flatten(scene), scene.camera_path[0]
    owner = flat.parts.object_id[flat.face_part]
    with Renderer(flat, camera, RenderConfig(threads=2), 0) as renderer, Annotator(flat, scene, camera) as annotator:
        found = renderer.render(view, 0, (), path=scene.camera_path, annotator=annotator).annotations
    assert {3, 4, 5} <= {item.id for item in found.objects} and any(item.visible_fraction < 0.9 for item in found.objects)
    for item in found.objects:
        own = owner == item.id
        alone = flat._replace(mesh=flat.mesh._replace(faces=flat.mesh.faces[own]), face_part=flat.face_part[own])
        with Renderer(alone, camera, RenderConfig(threads=1), 0) as renderer:
            mask = renderer.render(view, 0, ("instance",), path=scene.camera_path).layers["instance"] == item.id
        assert item.full_pixels == mask.sum()
        if item.truncation == 0.0:
            box = item.full_box
            assert (box.x, box.y, box.width, box.height) == mask_box(mask)


@pytest.mark.parametrize("camera", LENSES[1:3], ids=lambda camera: camera.model)
def test_beyond_the_image_places_go_straight_on(camera):
    """What leaves the field is placed ever further out, however the polynomial bends there."""
    view = pose_camera(camera, LEVEL)
    projection, edge = Projection(camera, LEVEL, view), field_edge(camera)
    slants = edge * np.array([0.5, 0.999, 1.0, 1.001, 1.2, 1.4])
    ends = (slants, np.ones(6)) if projection.is_planar else (np.sin(slants), np.cos(slants))
    points = np.column_stack([ends[0], np.zeros(6), ends[1]])
    places = projection.place(points)
    identity = CameraPose(stamp_ns=0, position_m=(0.0, 0.0, 0.0), orientation=(0.0, 0.0, 0.0, 1.0))
    np.testing.assert_allclose(places[:3], project(camera, identity, points[:3])[:, :2], atol=1e-6)
    steps = np.diff(places[:, 0]) / np.diff(slants)
    assert (steps > 0).all() and steps[2:] == pytest.approx(steps[3], rel=0.01)
    behind = projection.place(np.array([[0.5, 0.0, -1.0]]))
    assert np.isnan(behind).all() == projection.is_planar


def test_relations_join_what_the_frame_shows():
    table = crate(1, (0.0, 0.0, 0.0), (0.8, 0.8, 0.7))
    lamp = crate(2, (0.0, 0.2, 0.7), (0.2, 0.2, 0.3), support=Support(kind="object", id=1), group=1)
    picture = crate(3, (4.9, 1.0, 1.2), (0.05, 0.8, 0.6), support=Support(kind="wall", wall=1))
    lost = crate(4, (-4.0, 0.0, 0.0), (0.3, 0.3, 0.3), support=Support(kind="object", id=1))
    board = crate(5, (3.0, 0.0, 3.2), (0.5, 0.5, 0.8), support=Support(kind="ceiling"), group=4)
    found = annotated([table, lamp, picture, lost, board], LEVEL).annotations
    assert [item.id for item in found.objects] == [1, 2, 3, 5]
    told = [(relation.subject, relation.kind, relation.object, relation.wall) for relation in found.relations]
    assert told[:3] == [(1, "on_floor", None, None), (2, "on", 1, None), (2, "in_group", 1, None)]
    assert told[3:] == [(3, "on_wall", None, 1), (5, "on_ceiling", None, None)]


def test_neither_threads_nor_what_else_is_asked_for_change_a_byte():
    first, second = (annotated(APART, LEVEL, threads=threads).annotations for threads in (1, 2))
    text = annotations_to_json(first)
    assert text == annotations_to_json(second) and annotations_from_json(text) == first
    description, flat = crates_scene(APART)
    camera = CameraConfig(width=640, height=480)
    with Renderer(flat, camera, RenderConfig(threads=1), 0) as renderer, Annotator(flat, description, camera) as annotator:
        frame = renderer.render(LEVEL, 0, ("depth",), annotator=annotator)
        assert annotations_to_json(frame.annotations) == text and set(frame.layers) == {"depth"}
        assert renderer.render(LEVEL, 0, ("depth",)).annotations is None


def test_a_furnished_room_tells_every_id_of_its_images_and_no_other():
    scene = sample_scene()
    flat, camera = flatten(scene), CameraConfig(width=640, height=480)
    labels = instance_labels(scene)
    with Renderer(flat, camera, RenderConfig(threads=2), 0) as renderer, Annotator(flat, scene, camera) as annotator:
        for view in mounted_path(camera, scene.camera_path):
            frame = renderer.render(view, 0, ("instance",), annotator=annotator)
            found = frame.annotations
            assert {item.id for item in found.objects} == set(np.unique(frame.layers["instance"])) - {0} <= set(labels)
            for item in found.objects:
                assert (item.category, item.label) == (labels[item.id]["name"], labels[item.id]["class"])
                free = item.visible_fraction == 1.0 and item.truncation == 0.0
                if free and min(item.full_box.width, item.full_box.height) > 40:
                    assert box_iou(item.full_box, item.visible_box) > 0.99
                assert box_iou(item.full_box, item.visible_box) <= 1.0 and item.full_pixels >= item.visible_pixels > 0
                corners = np.array([(corner.u_px, corner.v_px) for corner in item.corners if corner.u_px is not None])
                own = sides(item.full_box)
                if len(corners) == 8:  # the oriented box holds the object
                    assert (corners.min(axis=0) <= own[:2] + 2.0).all() and (corners.max(axis=0) >= own[2:] - 2.0).all()
            kinds = {(relation.subject, relation.kind) for relation in found.relations}
            assert (5, "on") in kinds and (4, "in_group") in kinds


@pytest.mark.parametrize(
    ("text", "where"),
    [("no json", "annotations: expected JSON"), ("[]", "annotations: expected a mapping"), ('{"schema":"x"}', "annotations.schema")],
)
def test_what_is_no_annotations_is_refused_in_one_line(text, where):
    with pytest.raises(FieldError, match=where):
        annotations_from_json(text)
