"""Camera paths: stamps, limits of motion and distance in rooms of every kind, views worth having."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from shapely.geometry import Point, Polygon

from grammar.camera.camera_path import CameraSpace, CameraTimes, sample_camera_path
from grammar.camera.path_config import CameraPathConfig, read_camera_path_config
from grammar.camera.sights import Sights
from grammar.camera.view_ring import Views
from grammar.geometry.boxes import NO_BOXES
from grammar.spec.rules import GrammarError
from scene_description import CameraPose
from scene_description.poses import rotation_from_quaternion
from scene_description.share import config_path

CONFIG = read_camera_path_config(config_path("camera.yaml"))
RECTANGLE = ((0.0, 0.0), (4.2, 0.0), (4.2, 3.6), (0.0, 3.6))
L_SHAPE = ((-1.0, -2.0), (3.0, -2.0), (3.0, 0.0), (1.0, 0.0), (1.0, 2.5), (-1.0, 2.5))
HEIGHT_M = 2.6


def solid(x: float, y: float, depth: float, width: float, height: float, yaw: float = 0.0, low: float = 0.0) -> list[float]:
    return [x, y, low, low + height, depth / 2, width / 2, math.cos(yaw), math.sin(yaw)]


BEDROOM = np.array(
    [
        solid(1.1, 1.8, 2.1, 1.6, 0.6), solid(0.25, 0.75, 0.45, 0.45, 0.5), solid(0.25, 2.85, 0.45, 0.45, 0.5),
        solid(3.85, 1.0, 0.6, 1.8, 2.0), solid(2.5, 3.3, 0.6, 1.2, 0.75, -math.pi / 2), solid(2.5, 2.75, 0.5, 0.5, 0.9, 1.2),
        solid(2.0, 1.8, 0.4, 0.4, 0.3, low=2.3),
    ]
)  # fmt: skip
L_FURNITURE = np.array([solid(0.0, 1.9, 1.0, 0.8, 0.7), solid(2.6, -1.0, 0.5, 1.5, 2.1), solid(0.6, -1.2, 0.5, 0.6, 0.9, 0.7)])


def sphere_gap_m(boxes: NDArray[np.float64], p: Sequence[float]) -> float:
    """Distance of a point to the nearest box, in three dimensions."""
    gaps = [math.inf]
    for x, y, low, high, u, v, c, s in boxes:
        forward, left = (p[0] - x) * c + (p[1] - y) * s, (p[1] - y) * c - (p[0] - x) * s
        gaps.append(math.hypot(max(abs(forward) - u, 0.0), max(abs(left) - v, 0.0), max(low - p[2], p[2] - high, 0.0)))
    return min(gaps)


def best_value(views: Views, station_m: NDArray[np.float64]) -> float:
    return float(views.values(views.ring(station_m)).max())


def sample(
    seed: int,
    polygon: Sequence[tuple[float, float]] = RECTANGLE,
    boxes: NDArray[np.float64] = BEDROOM,
    frames: int = 8,
    rate_hz: float = 5.0,
    config: CameraPathConfig = CONFIG,
    height_m: float = HEIGHT_M,
) -> tuple[CameraPose, ...]:
    return sample_camera_path(
        np.random.default_rng(seed), config, CameraSpace(polygon, height_m, boxes), CameraTimes(frames=frames, start_ns=10, rate_hz=rate_hz)
    )


def forward_of(path: Sequence[CameraPose]) -> NDArray[np.float64]:
    return np.array([rotation_from_quaternion(pose.orientation)[:, 2] for pose in path])


def check_motion(path: Sequence[CameraPose], config: CameraPathConfig, step_m: float) -> None:
    position = np.array([pose.position_m for pose in path])
    assert np.linalg.norm(np.diff(position[:, :2], axis=0), axis=1).max(initial=0.0) <= step_m + 1e-9
    turn = np.arccos(np.clip(np.einsum("ni,ni->n", forward_of(path)[1:], forward_of(path)[:-1]), -1.0, 1.0))
    assert turn.max(initial=0.0) <= config.max_turn_rad * step_m / config.max_step_m + 1e-6
    for pose in path:
        right, down, _ = rotation_from_quaternion(pose.orientation).T
        assert abs(right[2]) < 1e-9, "level horizon"
        assert down[2] < 0.0, "upright"


ROOMS = {"bed": (RECTANGLE, BEDROOM), "L": (L_SHAPE, L_FURNITURE), "empty": (RECTANGLE, np.zeros((0, 8)))}


@pytest.mark.parametrize("seed", range(8))
@pytest.mark.parametrize(("polygon", "boxes"), ROOMS.values(), ids=ROOMS)
def test_camera_keeps_its_distance_and_its_limits(seed: int, polygon: tuple[tuple[float, float], ...], boxes: NDArray[np.float64]) -> None:
    path = sample(seed, polygon, boxes)
    assert len(path) == 8
    room = Polygon(polygon)
    for pose in path:
        at = Point(pose.position_m[:2])
        assert room.contains(at)
        assert room.exterior.distance(at) >= CONFIG.clearance_m - 1e-9
        assert sphere_gap_m(boxes, pose.position_m) >= CONFIG.clearance_m - 1e-9
        on_floor = (pose.position_m[0], pose.position_m[1], 0.01)
        assert sphere_gap_m(boxes[boxes[:, 2] < 1.0], on_floor) >= CONFIG.body_radius_m - 1e-9, "the carrier's feet"
    check_motion(path, CONFIG, CONFIG.max_step_m)


@pytest.mark.parametrize("seed", range(6))
def test_a_mount_sets_height_and_pitch(seed: int) -> None:
    path = sample(seed)
    mount = [m for m in CONFIG.mounts.values() if all(m.height_m[0] - 0.02 <= pose.position_m[2] <= m.height_m[1] + 0.02 for pose in path)]
    pitch = np.arcsin(forward_of(path)[:, 2])
    assert any(m.pitch_rad[0] - 1e-9 <= pitch.min() and pitch.max() <= m.pitch_rad[1] + 1e-9 for m in mount)


def test_both_mounts_come_up_as_often_as_they_should() -> None:
    config = replace(CONFIG, viewpoint_trials=2, path_trials=1)
    high = [sample(seed, frames=2, config=config)[0].position_m[2] > 1.3 for seed in range(300)]
    assert np.mean(high) == pytest.approx(CONFIG.mounts["person"].probability, abs=4 * math.sqrt(0.25 / 300))


def test_few_frames_still_cross_part_of_the_room() -> None:
    travels = []
    for seed in range(10):
        position = np.array([pose.position_m for pose in sample(seed)])
        travels.append(np.linalg.norm(position - position[0], axis=1).max())
    assert np.median(travels) > 0.7
    assert min(travels) > 0.3


def test_views_are_deep_and_show_furniture() -> None:
    for seed in range(10):
        for pose in sample(seed):
            forward = rotation_from_quaternion(pose.orientation)[:, 2]
            probe = np.array(pose.position_m) + 0.6 * forward
            assert 0.0 < probe[0] < 4.2, "does not stare at a wall"
            assert 0.0 < probe[1] < 3.6, "does not stare at a wall"
            to_boxes = BEDROOM[:, :2] - np.array(pose.position_m[:2])
            cosine = to_boxes @ forward[:2] / np.linalg.norm(to_boxes, axis=1) / np.linalg.norm(forward[:2])
            assert (cosine > math.cos(0.6)).sum() >= 2, "several things in view"


def test_a_lone_frame_looks_at_the_best_there_is() -> None:
    """Things stand along one side of a room: a single picture shows three and more of them, and so does the first of a path."""
    boxes = np.array([solid(0.4, y, 0.5, 0.4, 0.8) for y in (0.5, 1.1, 1.7, 2.3, 2.9)])
    for seed in range(10):
        for frames in (1, 8):
            first = sample(seed, boxes=boxes, frames=frames)[0]
            to_boxes = boxes[:, :2] - np.array(first.position_m[:2])
            forward = rotation_from_quaternion(first.orientation)[:2, 2]
            cosine = to_boxes @ forward / np.linalg.norm(to_boxes, axis=1) / np.linalg.norm(forward)
            assert (cosine > math.cos(0.5 * CONFIG.field_of_view_rad + 0.05)).sum() >= 3, (seed, frames)


def test_a_lone_frame_stands_back_and_looks_along_the_longest_line_of_a_narrow_room() -> None:
    """In a corridor of 6 m by 1.2 m it stands before an end, with no door right beside it in the picture, and looks along."""
    corridor = ((0.0, 0.0), (6.0, 0.0), (6.0, 1.2), (0.0, 1.2))
    doors = np.array([solid(x, y, 0.8, 0.02, 2.0) for x in (1.5, 3.0, 4.5) for y in (0.0, 1.2)])
    for seed in range(6):
        space = CameraSpace(corridor, HEIGHT_M, NO_BOXES, sights=Sights(doors=doors))
        (pose,) = sample_camera_path(np.random.default_rng(seed), CONFIG, space, CameraTimes(frames=1, start_ns=0, rate_hz=10.0))
        x, ahead = pose.position_m[0], rotation_from_quaternion(pose.orientation)[0, 2]
        assert min(x, 6.0 - x) < 1.5 and ahead * (3.0 - x) > 0.0 and abs(ahead) > 0.8, (x, ahead)


def test_doors_stand_for_things_that_are_missing() -> None:
    doors = Sights(doors=np.array([solid(4.2, 1.8, 0.02, 0.9, 2.0)]))
    without, counted = (CameraSpace(RECTANGLE, HEIGHT_M, NO_BOXES, sights=sights).views(CONFIG, 1.4) for sights in (Sights(), doors))
    assert (without.things, counted.things, len(counted.bright)) == (0, 1, 0)
    station = np.array([1.0, 1.8])
    more = counted.values(counted.ring(station))[0] - without.values(without.ring(station))[0]
    assert more >= 0.95 * CONFIG.missing_weight
    all_there = [CameraSpace(RECTANGLE, HEIGHT_M, BEDROOM, sights=sights).views(CONFIG, 1.4) for sights in (Sights(), doors)]
    plain, asked = (float(views.values(views.ring(np.array([2.9, 1.7])))[36]) for views in all_there)
    assert asked == plain, "towards the bed: none is missing, and no door in view"


def test_tall_is_what_reaches_above_the_lens_but_for_windows() -> None:
    boxes = np.array([solid(1.0, 1.0, 0.3, 0.3, 2.0), solid(3.0, 1.0, 0.3, 0.3, 0.8)])
    slab = np.array([solid(4.2, 1.8, 0.02, 0.9, 2.0)])
    space = CameraSpace(RECTANGLE, HEIGHT_M, boxes, sights=Sights(windows=slab, bright=np.array([False, False, True]), doors=slab))
    assert space.views(CONFIG, 1.4).tall.tolist() == [True, False, False, True]


def test_many_frames_walk_on_at_walking_speed() -> None:
    path = sample(3, frames=900, rate_hz=30.0)
    check_motion(path, CONFIG, max(CONFIG.speed_m_s / 30.0, CONFIG.path_length_m / 899))
    position = np.array([pose.position_m for pose in path])
    length = np.linalg.norm(np.diff(position[:, :2], axis=0), axis=1).sum()
    assert 0.7 * 15.0 < length <= 15.0
    assert min(sphere_gap_m(BEDROOM, p) for p in position) >= CONFIG.clearance_m - 1e-9
    yaw = np.unwrap(np.arctan2(*forward_of(path)[:, 1::-1].T))
    assert np.ptp(yaw) > 1.5, "looks round"


@pytest.mark.parametrize(("start_ns", "rate_hz", "first"), [(0, 5.0, 0), (1_000, 30.0, 8), (1_700_000_000_000_000_000, 29.97, 123_456)])
def test_stamps_count_frames_of_the_whole_run(start_ns: int, rate_hz: float, first: int) -> None:
    path = sample_camera_path(
        np.random.default_rng(0),
        CONFIG,
        CameraSpace(RECTANGLE, HEIGHT_M, BEDROOM),
        CameraTimes(frames=5, start_ns=start_ns, rate_hz=rate_hz, first_index=first),
    )
    assert [pose.stamp_ns for pose in path] == [start_ns + round(k * 1e9 / rate_hz) for k in range(first, first + 5)]


def test_stamps_at_30_hz_are_exact() -> None:
    path = sample_camera_path(
        np.random.default_rng(0), CONFIG, CameraSpace(RECTANGLE, HEIGHT_M, BEDROOM), CameraTimes(frames=4, start_ns=0, rate_hz=30.0)
    )
    assert [pose.stamp_ns for pose in path] == [0, 33_333_333, 66_666_667, 100_000_000]


def test_one_frame_is_enough() -> None:
    assert len(sample(4, frames=1)) == 1


def test_a_single_view_is_about_the_best_that_the_room_has() -> None:
    places = [(x, y) for x in np.arange(0.5, 4.0, 0.25) for y in np.arange(0.5, 3.4, 0.25)]
    free = [place for place in places if min(sphere_gap_m(BEDROOM, (*place, h)) for h in (0.3, 0.7, 1.4)) > CONFIG.body_radius_m]
    still, space = CONFIG.for_still(4.2 * 3.6), CameraSpace(RECTANGLE, HEIGHT_M, BEDROOM)

    def worth(place: NDArray[np.float64], lens_m: float) -> float:
        return max(best_value(space.views(still, lens_m)._replace(pitch_rad=pitch), place) for pitch in still.still.pitches_rad)

    best = max(worth(np.array(place), 1.4) for place in free)
    poses = [sample(seed, frames=1)[0].position_m for seed in range(12)]
    assert np.mean([worth(np.array([x, y]), z) for x, y, z in poses]) > 0.97 * best


def test_the_seed_decides() -> None:
    assert sample(5) == sample(5)
    assert sample(5) != sample(6)


def test_a_crowded_floor_lowers_the_distances_but_not_into_things() -> None:
    left, right = solid(1.0, 1.8, 2.0, 3.6, 2.5), solid(3.3, 1.8, 1.8, 3.6, 2.5)
    for seed in range(3):
        path = sample(seed, boxes=np.array([left, right]))
        assert all(2.0 < pose.position_m[0] < 2.4 for pose in path)
        assert min(sphere_gap_m(np.array([left, right]), pose.position_m) for pose in path) > 0.05


def test_a_floor_without_room_is_seen_from_above() -> None:
    bed = np.array([solid(2.1, 1.8, 4.2, 3.6, 0.5)])
    for seed in range(3):
        path = sample(seed, boxes=bed)
        assert min(sphere_gap_m(bed, pose.position_m) for pose in path) >= CONFIG.clearance_m


def test_without_any_way_the_camera_turns_on_the_spot() -> None:
    sides = ((1.0, 1.8, 2.0, 3.6), (3.3, 1.8, 1.8, 3.6), (2.2, 0.8, 0.4, 1.6), (2.2, 2.9, 0.4, 1.4))
    shaft = np.array([solid(*side, 2.6) for side in sides])
    path = sample(0, boxes=shaft, frames=30)
    assert len({pose.position_m[:2] for pose in path}) == 1
    assert sphere_gap_m(shaft, path[0].position_m) > 0.1
    check_motion(path, CONFIG, CONFIG.max_step_m)
    assert math.acos(min(float(forward_of(path)[0] @ forward_of(path)[-1]), 1.0)) > 0.5


def test_a_low_ceiling_keeps_the_camera_below_it() -> None:
    for seed in range(5):
        path = sample(seed, height_m=1.5, boxes=BEDROOM[:3])
        assert all(pose.position_m[2] <= 1.5 - CONFIG.clearance_m + 1e-9 for pose in path)


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("path_length_m: 3.0", "path_length_m: far", "path_length_m: expected a number in [0.0, 100.0] m, got 'far'"),
        ("probability: 0.65", "probability: 0.7", "mounts: expected probabilities that sum to 1, got 1.05"),
        ("[1.35, 1.65]", "[1.65, 1.35]", "mounts.person.height_m: expected low <= high, got [1.65, 1.35]"),
        ("mount: person", "mount: bird", "still.mount: expected one of person, robot, got bird"),
        ("speed_m_s: 0.5", "speed: 0.5", "speed: expected one of bare_weight, body_radius_m"),
    ],
)
def test_refuses_settings_that_do_not_fit(tmp_path: Path, old: str, new: str, message: str) -> None:
    text = config_path("camera.yaml").read_text(encoding="utf-8")
    assert old in text
    file = tmp_path / "camera.yaml"
    file.write_text(text.replace(old, new), encoding="utf-8")
    with pytest.raises(GrammarError) as refused:
        read_camera_path_config(file)
    assert str(refused.value).startswith(f"{file}: {message}")
