"""Motions of bodies: rest, what excites an estimator, limits of a base that touches nothing, the user's own path."""

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import yaml
from shapely.affinity import rotate as turned
from shapely.geometry import LineString, Point, Polygon, box
from shapely.ops import unary_union

from grammar import SceneRequest
from grammar.camera.camera_path import CameraSpace, CameraTimes
from grammar.camera.motion_config import MotionConfig
from grammar.camera.motions import sample_motion
from grammar.camera.path_config import read_camera_path_config
from grammar.geometry.solids import object_solids
from grammar.spec.rules import GrammarError
from grammar.synthesize import SceneSynthesizer
from scene_description import CameraPose, FieldError
from scene_description.kinematics import Kinematics, camera_kinematics, kinematics, rotate
from scene_description.motion import Motion
from scene_description.motion_of_poses import motion_of_poses
from scene_description.share import config_path
from scene_description.tum_trajectory import trajectory_to_tum
from scene_description.types import SKIRTING_DEPTH_M

CONFIG = read_camera_path_config(config_path("camera.yaml"))
RECTANGLE = ((0.0, 0.0), (4.2, 0.0), (4.2, 3.6), (0.0, 3.6))
BEDROOM = np.array(
    [
        [1.1, 1.8, 0.0, 0.6, 1.05, 0.8, 1.0, 0.0],
        [0.25, 0.75, 0.0, 0.5, 0.225, 0.225, 1.0, 0.0],
        [3.85, 1.0, 0.0, 2.0, 0.3, 0.9, 1.0, 0.0],
        [2.5, 3.3, 0.0, 0.75, 0.3, 0.6, 0.0, -1.0],
        [2.5, 2.75, 0.0, 0.9, 0.25, 0.25, math.cos(1.2), math.sin(1.2)],
        [2.0, 1.8, 2.3, 2.6, 0.2, 0.2, 1.0, 0.0],
    ]
)
"""Rows of x, y, low, high, half depth, half width, cosine and sine of the yaw."""
SPACE = CameraSpace(RECTANGLE, 2.6, BEDROOM)
TIMES = CameraTimes(frames=301, start_ns=7 * 10**9, rate_hz=15.0)


def sampled(seed: int = 1, space: CameraSpace = SPACE, times: CameraTimes = TIMES, **settings) -> tuple[tuple[CameraPose, ...], Motion]:
    poses, motion = sample_motion(np.random.default_rng(seed), MotionConfig(**settings), CONFIG, space, times)
    assert motion is not None
    return poses, motion


def along(motion: Motion, step_s: float = 0.005) -> Kinematics:
    return kinematics(motion, np.arange(0.0, motion.duration_s, step_s))


def sizes(vectors: np.ndarray) -> np.ndarray:
    return np.linalg.norm(vectors, axis=1)


@pytest.mark.parametrize("kind", ["handheld", "flight", "base", "turntable", "still", "spin"])
def test_the_camera_is_on_the_body_at_every_frame_and_the_same_seed_is_the_same_motion(kind: str) -> None:
    poses, motion = sampled(kind=kind, camera_m=(0.1, 0.02, 0.6))
    assert (poses, motion) == sampled(kind=kind, camera_m=(0.1, 0.02, 0.6))
    at = camera_kinematics(motion, [(pose.stamp_ns - TIMES.start_ns) * 1e-9 for pose in poses])
    np.testing.assert_allclose(at.position_m, [pose.position_m for pose in poses], atol=1e-8)
    np.testing.assert_allclose(at.quaternion, [pose.orientation for pose in poses], atol=1e-8)
    body = kinematics(motion, 0.0 + np.zeros(1))
    np.testing.assert_allclose(at.position_m[0] - body.position_m[0], rotate(body.quaternion, np.array([motion.camera_m]))[0], atol=1e-12)
    assert motion.duration_s >= 20.0
    still = along(motion).acceleration_m_s2[:400], along(motion).rate_rad_s[:400]  # two seconds
    assert all(sizes(values).max() < 1e-12 for values in still)


def test_a_hand_excites_all_axes_after_its_rest() -> None:
    _, motion = sampled(kind="handheld")
    moved = along(motion)
    assert np.median(sizes(moved.acceleration_m_s2[700:])) > 0.5  # m/s2; a walk has 0.2
    assert (moved.acceleration_m_s2[700:].std(axis=0) > 0.2).all()
    assert (moved.rate_rad_s[700:].std(axis=0) > 0.08).all()
    spectrum = np.abs(np.fft.rfft(moved.acceleration_m_s2[1000:4000, 2] * np.hanning(3000))) ** 2
    hertz = np.fft.rfftfreq(3000, 0.005)
    assert spectrum[(hertz > 7.0) & (hertz < 9.0)].sum() > 20.0 * spectrum[(hertz > 10.0) & (hertz < 50.0)].sum()
    trembling = along(motion).position_m - along(sampled(kind="handheld", tremor_m=0.0, tremor_rad=0.0)[1]).position_m
    np.testing.assert_allclose(trembling[1000:].std(axis=0), 1e-4, rtol=0.15)


def test_a_drone_tilts_as_it_must_to_accelerate() -> None:
    _, motion = sampled(kind="flight", sway_m=0.08, tremor_m=0.0, tremor_rad=0.0)
    moved = along(motion)
    thrust = rotate(moved.quaternion, np.tile([0.0, 0.0, 1.0], (len(moved.quaternion), 1)))
    wanted = moved.acceleration_m_s2 + np.array([0.0, 0.0, 9.80665])
    angle = np.arccos(np.clip((thrust * wanted).sum(axis=1) / sizes(wanted), -1.0, 1.0))
    assert sizes(moved.acceleration_m_s2).max() > 1.0
    assert np.quantile(angle, 0.95) < 0.03  # the tilt alone reaches 0.2 rad


def test_the_drone_of_the_euroc_rig_moves_as_those_of_euroc_and_an_estimator_soon_feels_that_it_does() -> None:
    """Burri et al. 2016: 0.33 to 0.99 m/s and 0.21 to 0.66 rad/s in the mean; ORB-SLAM3 begins with 0.5 m/s2 from frame to frame."""
    rig = yaml.safe_load(config_path("rigs/euroc_stereo.yaml").read_text())
    found = []
    for seed in range(4):
        _, motion = sampled(seed, **rig["/**/grammar_node"]["ros__parameters"]["motion"])
        moved = along(motion)
        force = rotate(moved.quaternion * (-1.0, -1.0, -1.0, 1.0), moved.acceleration_m_s2 + np.array([0.0, 0.0, 9.80665]))
        change = sizes(np.diff(force[: len(force) // 10 * 10].reshape(-1, 10, 3).mean(axis=1), axis=0))
        assert 2.0 < 0.05 * int(np.argmax(change > 0.5)) < 4.0
        found.append((sizes(moved.velocity_m_s)[700:].mean(), sizes(moved.rate_rad_s)[700:].mean()))
    speed_m_s, rate_rad_s = np.array(found).T
    assert 0.33 < speed_m_s.min() and speed_m_s.max() < 0.99
    assert 0.21 < rate_rad_s.min() and rate_rad_s.max() < 0.66


def test_a_spin_stays_in_place_and_a_turntable_carries_the_camera_round() -> None:
    _, spin = sampled(kind="spin", turn_rad_s=0.8)
    moved = along(spin)
    assert np.ptp(moved.position_m, axis=0).max() < 1e-12
    assert sizes(moved.rate_rad_s)[1000:] == pytest.approx(0.8)
    poses, table = sampled(kind="turntable", camera_m=(0.15, 0.0, 0.9), turn_rad_s=0.8, turn_acceleration_rad_s2=1.0)
    places = np.array([pose.position_m for pose in poses])
    np.testing.assert_allclose(np.hypot(*(places[:, :2] - table.drive.start_m).T), 0.15, atol=1e-12)
    np.testing.assert_allclose(places[:, 2], 0.9)
    assert along(table).rate_change_rad_s2[:, 2].max() <= 1.0


def solid_shapes() -> object:
    """The furniture from above, by shapely; what hangs above the lens is left out."""
    shapes = []
    for x, y, low, _, u, v, c, s in BEDROOM:
        if low < 1.0:
            shapes.append(turned(box(x - u, y - v, x + u, y + v), math.degrees(math.atan2(s, c)), (x, y)))
    return unary_union(shapes)


@pytest.mark.parametrize("seed", range(4))
def test_a_base_touches_nothing_keeps_its_limits_and_comes_home(seed: int) -> None:
    times = CameraTimes(frames=901, start_ns=0, rate_hz=15.0)
    _, motion = sampled(seed, times=times, kind="base", loop=True, camera_m=(0.05, 0.0, 0.8))
    moved, e = along(motion, 0.01), 0.01
    track = LineString(moved.position_m[::5, :2])
    assert track.length > 3.0
    assert track.distance(solid_shapes()) >= 0.18
    assert track.distance(Polygon(RECTANGLE).exterior) >= 0.18 + SKIRTING_DEPTH_M
    assert Polygon(RECTANGLE).contains(track)
    np.testing.assert_array_equal(moved.position_m[:, 2], 0.0)
    ahead = rotate(moved.quaternion, np.tile([1.0, 0.0, 0.0], (len(moved.quaternion), 1)))
    assert np.abs(np.cross(ahead, moved.velocity_m_s)[:, 2]).max() < 1e-12  # it goes where it looks
    config = MotionConfig()
    assert sizes(moved.velocity_m_s).max() <= config.speed_m_s
    assert sizes(moved.acceleration_m_s2).max() <= config.acceleration_m_s2
    assert sizes(np.diff(moved.acceleration_m_s2, axis=0)).max() / e <= config.jerk_m_s3
    assert np.abs(moved.rate_rad_s).max() <= config.turn_rad_s
    assert np.abs(moved.rate_change_rad_s2).max() <= config.turn_acceleration_rad_s2
    np.testing.assert_allclose(moved.position_m[-1], moved.position_m[0], atol=1e-9)


@pytest.mark.parametrize("seed", range(2))
def test_a_base_that_explores_passes_over_the_floor_and_comes_home_where_one_that_does_not_leaves_more_of_it(seed: int) -> None:
    times, radius = CameraTimes(frames=9001, start_ns=0, rate_hz=15.0), 0.18
    free = Polygon(RECTANGLE).buffer(-radius).difference(solid_shapes().buffer(radius))
    reachable = max(getattr(free, "geoms", [free]), key=lambda part: part.area).buffer(radius)
    covered = {}
    for explore in (False, True):
        _, motion = sampled(seed, times=times, kind="base", loop=True, explore=explore, camera_m=(0.05, 0.0, 0.8))
        track = LineString(along(motion, 0.1).position_m[:, :2])
        assert min(track.distance(solid_shapes()), track.distance(Polygon(RECTANGLE).exterior) - SKIRTING_DEPTH_M) >= radius
        assert Point(track.coords[0]).distance(Point(track.coords[-1])) < 1e-9
        covered[explore] = track.simplify(0.001).buffer(radius).intersection(reachable).area / reachable.area
    assert covered[True] > max(0.85, covered[False])


def test_a_base_that_explores_goes_through_a_passage_little_wider_than_itself() -> None:
    """In a dining room it had passed over 38 % of the floor, as a row of chairs left it 18 mm on either side."""
    wide = 2.0 * 0.18 + 0.035
    halves = [[2.1, 0.5 * (1.8 - 0.5 * wide), 0.0, 0.8, 0.2, 0.5 * (1.8 - 0.5 * wide), 1.0, 0.0]]
    halves.append([2.1, 3.6 - halves[0][1], *halves[0][2:]])
    space = CameraSpace(RECTANGLE, 2.6, np.array(halves))
    times = CameraTimes(frames=9001, start_ns=0, rate_hz=15.0)
    _, motion = sampled(0, space, times, kind="base", loop=True, explore=True, camera_m=(0.05, 0.0, 0.8))
    across_m = along(motion, 0.1).position_m[:, 0]
    assert across_m.min() < 1.0 and across_m.max() > 3.2


def test_a_base_keeps_clear_of_skirting_boards() -> None:
    """It had passed 7 mm into those of a gym."""
    outline = ((0.0, 0.0), (4.2, 0.3), (4.0, 3.6), (2.0, 3.5), (2.1, 2.0), (0.1, 1.9))
    space = CameraSpace(outline, 2.6, BEDROOM[5:])
    times = CameraTimes(frames=9001, start_ns=0, rate_hz=15.0)
    _, motion = sampled(0, space, times, kind="base", loop=True, explore=True, camera_m=(0.05, 0.0, 0.8))
    boards = Polygon(outline).exterior.buffer(SKIRTING_DEPTH_M, join_style="mitre")
    assert LineString(along(motion, 0.1).position_m[:, :2]).distance(boards) >= 0.18


def test_no_small_thing_lies_in_the_way_of_a_base() -> None:
    """In this bathroom the scales, 3 cm high, did."""
    config = MotionConfig(kind="base", explore=True, speed_m_s=0.22, body_radius_m=0.14, camera_m=(0.05, 0.0, 0.25))
    synthesizer = replace(SceneSynthesizer.from_config(), motion=config)
    times = CameraTimes(frames=901, start_ns=0, rate_hz=1.0)
    scene = synthesizer.synthesize(SceneRequest(room_type="bathroom"), 1795807214, 0, times)
    assert scene.motion is not None
    track = LineString(along(scene.motion, 0.1).position_m[:, :2])
    for x, y, low, high, u, v, c, s in object_solids(synthesizer.categories, scene.objects)[0].tolist():
        if low < 0.25 and high > 0.025:
            assert track.distance(turned(box(x - u, y - v, x + u, y + v), math.degrees(math.atan2(s, c)), (x, y))) >= 0.14


def test_a_base_that_fits_nowhere_is_refused() -> None:
    with pytest.raises(GrammarError, match=r"motion.body_radius_m: expected a base that stands free .* got a radius of 1 m"):
        sampled(kind="base", body_radius_m=1.0)


@pytest.mark.parametrize("seed", range(1, 7))
def test_a_slow_base_that_shall_come_back_in_a_short_time_goes_as_far_as_it_can(seed: int) -> None:
    """A TurtleBot's speed, 20 s: too little for any of the places that lie far from each other."""
    times = CameraTimes(frames=300, start_ns=0, rate_hz=15.0)
    slow = {"speed_m_s": 0.22, "turn_rad_s": 1.8, "acceleration_m_s2": 0.5, "body_radius_m": 0.14}
    _, motion = sampled(seed, times=times, kind="base", loop=True, camera_m=(0.05, 0.0, 0.25), **slow)
    place = along(motion).position_m
    far = sizes(place - place[0])
    assert far.max() > 0.2
    assert far[-1] < 1e-9


@pytest.mark.parametrize("even", [True, False])
def test_the_users_own_path_is_followed(tmp_path: Path, even: bool) -> None:
    rng = np.random.default_rng(2)
    poses, _ = sampled(kind="handheld", times=CameraTimes(frames=120, start_ns=10**9, rate_hz=30.0), rest_s=0.0)
    stamps = [pose.stamp_ns if even else pose.stamp_ns + int(rng.integers(0, 8_000_000)) for pose in poses]
    path = motion_of_poses(poses)
    at = camera_kinematics(path, [(stamp - stamps[0]) * 1e-9 for stamp in stamps])
    given = [
        CameraPose(stamp_ns=stamp, position_m=tuple(place), orientation=tuple(turn))
        for stamp, place, turn in zip(stamps, at.position_m.tolist(), at.quaternion.tolist(), strict=True)
    ]
    file = tmp_path / "path.txt"
    file.write_text(trajectory_to_tum(given))
    _, motion = sampled(kind="file", file=str(file))
    found = camera_kinematics(motion, [(stamp - stamps[0]) * 1e-9 for stamp in stamps])
    np.testing.assert_allclose(found.position_m, at.position_m, atol=1e-9 if even else 2e-4)
    np.testing.assert_allclose(np.abs((found.quaternion * at.quaternion).sum(axis=1)), 1.0, atol=1e-12 if even else 1e-6)


def test_files_are_refused_with_one_line(tmp_path: Path) -> None:
    with pytest.raises(GrammarError, match=r"motion.file: .*no such file"):
        sampled(kind="file", file=str(tmp_path / "none.txt"))
    (tmp_path / "bad.txt").write_text("1 2 3\n")
    with pytest.raises(GrammarError, match=r"motion.file: .*bad.txt line 1: expected 8 numbers"):
        sampled(kind="file", file=str(tmp_path / "bad.txt"))
    with pytest.raises(FieldError, match="file: expected a file, of kind file only, got none"):
        MotionConfig(kind="file")
