"""The room that is made ahead: the same frames as made when it comes, taken only if it is the one, and no fault of it is lost."""

import threading
from collections.abc import Iterator
from concurrent.futures import wait
from dataclasses import replace

import pytest
from sample_scene import sample_scene

from renderer import CameraConfig, DepthSensorConfig, RenderCancelled, RenderConfig, RenderError, SensorConfig
from scene_description import SceneDescription, scene_to_json
from scene_synth_ros.render import room as room_module
from scene_synth_ros.render.next_room import NextRoom
from scene_synth_ros.render.room import RenderedRoom, RoomSettings, is_same_room
from scene_synth_ros.suite.faults import Faults

PRESENT = sample_scene()
SCENE = replace(PRESENT, id="the-next", index=PRESENT.index + 1)
SETTINGS = RoomSettings(
    camera=CameraConfig(width=24, height=18),
    render=RenderConfig(integrator="cached", cache_spacing_m=0.2, cache_rays=16, threads=2, auto_exposure=True),
    sensor=SensorConfig(),
    depth_sensor=DepthSensorConfig(),
    semantic_classes="nyu40",
    annotation_masks=False,
    catalog_dir=None,
)
LAYERS = ("color", "depth")


def at_other_times(scene: SceneDescription) -> SceneDescription:
    return replace(scene, camera_path=tuple(replace(pose, stamp_ns=pose.stamp_ns + 7) for pose in scene.camera_path))


@pytest.fixture
def lines() -> list[str]:
    return []


@pytest.fixture
def ahead(lines: list[str]) -> Iterator[NextRoom]:
    next_room = NextRoom(Faults(lines.append))
    yield next_room
    next_room.drop()


def begin(ahead: NextRoom, scene: SceneDescription = SCENE) -> None:
    ahead.begin(scene_to_json(scene), RenderedRoom(PRESENT, SETTINGS), SETTINGS, LAYERS)


def test_a_room_made_ahead_shows_the_same_bytes_at_whatever_time(ahead: NextRoom) -> None:
    begin(ahead)
    came = at_other_times(SCENE)
    made = ahead.take(came, SETTINGS, lambda: False)
    assert made is not None and made.scene is came
    fresh = RenderedRoom(came, SETTINGS)
    frames = []
    for room in (made, fresh):
        with_exposure = room.renderer.render(came.camera_path[-1], 1, LAYERS, exposure=room.metered)
        frames.append((room.metered, *(with_exposure.layers[name].tobytes() for name in LAYERS)))
        room.close()
    assert frames[0] == frames[1]
    assert ahead.take(came, SETTINGS, lambda: False) is None


def test_light_is_there_before_the_first_frame(ahead: NextRoom) -> None:
    begin(ahead)
    assert ahead._jobs.job is not None
    wait([ahead._jobs.job])
    room = ahead.take(SCENE, SETTINGS, lambda: False)
    assert room is not None
    assert room.renderer.prepare(SCENE.camera_path[0]) == 0
    room.close()
    fresh = RenderedRoom(SCENE, SETTINGS)
    assert fresh.renderer.prepare(SCENE.camera_path[0]) > 0
    fresh.close()


@pytest.mark.parametrize(
    ("scene", "settings"),
    [
        (replace(SCENE, id="another"), SETTINGS),
        (replace(SCENE, camera_path=SCENE.camera_path[:1]), SETTINGS),
        (SCENE, replace(SETTINGS, camera=CameraConfig(width=48, height=36))),
    ],
)
def test_another_room_is_not_taken(ahead: NextRoom, scene: SceneDescription, settings: RoomSettings) -> None:
    begin(ahead)
    assert ahead.take(scene, settings, lambda: False) is None


def test_the_room_at_work_is_not_made_again(ahead: NextRoom, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(room_module, "flatten", lambda *_: pytest.fail("made again"))
    begin(ahead, at_other_times(PRESENT))
    assert ahead.take(PRESENT, SETTINGS, lambda: False) is None


@pytest.mark.parametrize(("error", "told"), [(ValueError("a mistake"), 1), (RenderError("no such model"), 0)])
def test_a_fault_is_told_and_what_users_cause_is_left_to_who_makes_it_again(
    ahead: NextRoom, lines: list[str], monkeypatch: pytest.MonkeyPatch, error: Exception, told: int
) -> None:
    def fail(*_: object) -> None:
        raise error

    monkeypatch.setattr(room_module, "flatten", fail)
    begin(ahead)
    assert ahead.take(SCENE, SETTINGS, lambda: False) is None
    assert len(lines) == told and all("a mistake" in line for line in lines)


def test_who_waits_can_leave_and_a_dropped_room_is_closed(ahead: NextRoom, monkeypatch: pytest.MonkeyPatch) -> None:
    going_on, closed = threading.Event(), threading.Event()
    right = room_module.flatten
    monkeypatch.setattr(room_module, "flatten", lambda *words: right(*words) if going_on.wait(30) else None)
    monkeypatch.setattr(RenderedRoom, "close", lambda self: closed.set())
    begin(ahead)
    with pytest.raises(RenderCancelled):
        ahead.take(SCENE, SETTINGS, lambda: True)
    ahead.drop()
    going_on.set()
    assert closed.wait(30)


def test_rooms_are_the_same_whenever_they_are_seen() -> None:
    assert is_same_room(SCENE, at_other_times(SCENE))
    assert not is_same_room(SCENE, PRESENT)
