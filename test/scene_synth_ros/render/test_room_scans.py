"""Which scans are due at a frame, on the path and off it, and that nothing is cast for nobody."""

from __future__ import annotations

from dataclasses import replace

import pytest

from renderer.lidar.config import ScanConfig
from renderer.lidar.scan import Scan
from renderer.lidar.scanner import scanner_poses
from scene_description import CameraPose
from scene_description.poses import look_at
from scene_synth_ros.render.room_scans import RoomScans

MS = 1_000_000
PATH = tuple(
    CameraPose(stamp_ns=10**9 + i * 100 * MS, position_m=(0.1 * i, 0.0, 1.5), orientation=look_at((0, 0, 0), (1, 0, 0))) for i in range(4)
)
CONFIG = ScanConfig(rate_hz=25.0, beams=4, angle_max_rad=1.5)


class FakeScanner:
    """Notes what it is asked for."""

    def __init__(self) -> None:
        self.asked: list[tuple[int, int, tuple[CameraPose, ...]]] = []

    def scan(self, number: int, stamp_ns: int, path) -> Scan:
        self.asked.append((number, stamp_ns, tuple(path)))
        return Scan(number, stamp_ns, scanner_poses(CONFIG, path, stamp_ns), None, None, None)


def follow(scans: RoomScans, poses, wanted: bool = True) -> list[list[int]]:
    """Go along poses; return for each the stamps of the scans that were due, in ms after the start."""
    found = []
    for pose in poses:
        scans.go(pose)
        due = list(scans.due(pose.stamp_ns, lambda: wanted))
        assert all((scan is not None) == wanted for _, scan in due)
        found.append([(poses[0].stamp_ns - 10**9) // MS for poses, _ in due])
    return found


def test_scans_come_before_the_frame_that_is_not_earlier_and_end_with_the_path() -> None:
    scanner = FakeScanner()
    assert follow(RoomScans(CONFIG, PATH, lambda: scanner), PATH) == [[0], [40, 80], [120, 160, 200], [240]]  # from 280 on: not whole
    assert [number for number, _, _ in scanner.asked] == list(range(7))
    assert all(path == PATH for _, _, path in scanner.asked)


def test_nothing_is_cast_or_even_made_for_nobody_but_the_scanner_says_where_it_is() -> None:
    def refuse() -> FakeScanner:
        raise AssertionError("made for nobody")

    assert follow(RoomScans(CONFIG, PATH, refuse), PATH, wanted=False) == [[0], [40, 80], [120, 160, 200], [240]]


def test_a_driven_rig_is_scanned_where_it_went_and_beyond_the_end_of_the_path() -> None:
    driven = [PATH[0], *(replace(pose, position_m=(0.0, 0.5 * i, 1.5)) for i, pose in enumerate(PATH[1:], 1))]
    later = [replace(driven[-1], stamp_ns=PATH[-1].stamp_ns + 100 * MS)]
    scanner = FakeScanner()
    assert follow(RoomScans(CONFIG, PATH, lambda: scanner), driven + later) == [[0], [40, 80], [120, 160, 200], [240, 280], [320, 360, 400]]
    assert scanner.asked[-1][2] == tuple(driven + later)
    (first, *_, last) = scanner_poses(CONFIG, scanner.asked[2][2], scanner.asked[2][1])
    assert first.position_m[1] == pytest.approx(0.4)
    assert last.position_m[1] > 0.45


def test_frames_that_are_asked_for_by_hand_move_nothing() -> None:
    scans = RoomScans(CONFIG, PATH, FakeScanner)
    scans.go(PATH[0])
    assert len(list(scans.due(PATH[0].stamp_ns, lambda: True))) == 1
    assert list(scans.due(10**12, lambda: True)) == []
