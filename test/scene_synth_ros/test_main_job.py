"""The main job through real processes over DDS: the bag is whole, holds what was promised, and its pixels can be made again."""

import hashlib
import json
import subprocess
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest
from nav2_map import read_nav2_map
from rclpy.serialization import deserialize_message
from rosbags.highlevel import AnyReader
from scene_synth_ros_suite import SMALL, environment, run_suite

from grammar.synthesize import CameraTimes, SceneSynthesizer
from renderer import CameraConfig, RenderConfig, Renderer
from renderer.exposure import exposed, meter
from renderer.scene.flatten import flatten
from renderer.scene.scene_key import scene_key
from scene_description import SceneDescription, scene_from_json
from scene_description.poses import rotation_from_quaternion
from scene_description.tum_trajectory import trajectory_from_tum
from scene_synth_ros.bags.bag_inspect import inspect_bag
from scene_synth_ros.bags.bag_reader import BagReader
from scene_synth_ros.cli.parameters.run_parameters import RunWords, run_parameters
from scene_synth_ros.messages.canonical_cdr import canonical_cdr
from scene_synth_ros.messages.message_definitions import message_class
from scene_synth_ros.offline.offline_bag import OfflineBag
from scene_synth_ros.offline.settings import read_settings
from scene_synth_ros.synthesize.room_schedule import RoomSchedule
from scene_synth_ros.verify.bag_verify import verify_bag

ROOMS, FRAMES, SEED = 2, 3, 11
HALLWAY = "grammar_node.scene.room_type:=hallway"
LAYERS = ("color", "depth", "normals", "semantic", "instance")
IMAGES = [f"/synth/camera/{layer}/image_raw" for layer in LAYERS]
COMPANIONS = [f"/synth/camera/{layer}/image_color" for layer in ("normals", "semantic", "instance")]
INFOS = [f"/synth/camera/{layer}/camera_info" for layer in LAYERS]
LABELS = [f"/synth/camera/{layer}/labels" for layer in ("semantic", "instance")]
LABEL_INFOS = [f"/synth/camera/{layer}/label_info" for layer in ("semantic", "instance")]
PER_FRAME = [*IMAGES, *COMPANIONS, *INFOS, *LABELS, *LABEL_INFOS, "/synth/camera/pose", "/synth/renderer_node/settings", "/clock", "/tf"]
PER_ROOM = ["/synth/scene", "/synth/scene/markers", "/synth/scene/map"]


class Recorded(NamedTuple):
    """A run: what it printed, and topic -> list of (log time, message) as an independent reader sees its bag."""

    process: subprocess.CompletedProcess[str]
    bag: Path
    messages: dict[str, list[tuple[int, object]]]
    sheet: Path
    page: Path

    def scenes(self) -> list[SceneDescription]:
        return [scene_from_json(message.data) for _, message in self.messages["/synth/scene"]]


def read(bag: Path) -> dict[str, list[tuple[int, object]]]:
    messages: dict[str, list[tuple[int, object]]] = {}
    with AnyReader([bag]) as reader:
        for connection, log_ns, data in reader.messages():
            messages.setdefault(connection.topic, []).append((log_ns, reader.deserialize(data, connection.msgtype)))
    return messages


@pytest.fixture(scope="module")
def recorded(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Recorded]:
    folder = tmp_path_factory.mktemp("main_job")
    bag, sheet, page = folder / "bag", folder / "sheet.png", folder / "page.html"
    words = ("--rooms", ROOMS, "--frames", FRAMES, "--seed", SEED, "-p", HALLWAY, "--contact-sheet", sheet, "--show", page, "--truth")
    process = run_suite(bag, *words, env=environment(), timeout_s=600)
    assert process.returncode == 0, process.stderr + process.stdout
    yield Recorded(process, bag, read(bag), sheet, page)


def stamp(message: object) -> int:
    return message.header.stamp.sec * 10**9 + message.header.stamp.nanosec


def test_every_topic_has_every_message(recorded: Recorded) -> None:
    counts = {topic: len(messages) for topic, messages in recorded.messages.items() if topic != "/diagnostics"}
    assert counts == {**dict.fromkeys(PER_FRAME, ROOMS * FRAMES), **dict.fromkeys(PER_ROOM, ROOMS), "/tf_static": 1}


def test_what_is_true_of_each_room_is_beside_the_bag(recorded: Recorded) -> None:
    folder = recorded.bag.with_name("bag_truth")
    assert sorted(path.name for path in folder.iterdir()) == [f"room_{k:04d}" for k in range(ROOMS)]
    assert f"truth: {folder}: {ROOMS} rooms" in recorded.process.stdout
    for room, scene, (_, grid) in zip(sorted(folder.iterdir()), recorded.scenes(), recorded.messages["/synth/scene/map"], strict=True):
        assert scene_from_json((room / "scene.json").read_text()) == scene
        floor = read_nav2_map(room / "map.yaml")
        assert np.array_equal(floor.data, grid.data) and (floor.width, floor.height) == (grid.info.width, grid.info.height)
        assert np.float32(floor.resolution) == np.float32(grid.info.resolution)
        assert floor.origin[:2] == (grid.info.origin.position.x, grid.info.origin.position.y)
        poses = trajectory_from_tum((room / "trajectory_camera.txt").read_text())
        assert poses == trajectory_from_tum((room / "trajectory.txt").read_text()) and len(poses) == FRAMES


def test_a_renderer_logs_one_line_a_room(recorded: Recorded) -> None:
    lines = [line for line in recorded.process.stderr.splitlines() if "renderer_node] room " in line]
    assert len(lines) == ROOMS and all("frames rendered in" in line for line in lines)


def test_the_run_reports_no_fault_and_draws_the_sheet(recorded: Recorded) -> None:
    assert "no faults" in recorded.process.stdout
    assert recorded.sheet.stat().st_size > 10_000


def test_the_page_knows_every_room_and_every_parameter_of_the_run(recorded: Recorded) -> None:
    data = json.loads(recorded.page.read_text(encoding="utf-8").split('type="application/json">')[1].split("</script>")[0])
    assert [(room["found"], len(room["frames"]), bool(room["plan"]), bool(room["map"])) for room in data["rooms"]] == [
        (FRAMES, FRAMES, True, True)
    ] * ROOMS
    cameras = [frame["cameras"]["/synth/camera"] for room in data["rooms"] for frame in room["frames"]]
    assert all(camera["images"].keys() == set(LAYERS) and camera["pose"] and camera["lens"] for camera in cameras)
    assert ["/synth/grammar_node", "seed", str(SEED), "1"] in data["parameters"]
    assert not [row for row in data["parameters"] if row[3] == "?"], "the page knows the default of every parameter"


def test_all_messages_of_a_frame_have_the_stamp_of_its_pose(recorded: Recorded) -> None:
    expected = [pose.stamp_ns for scene in recorded.scenes() for pose in scene.camera_path]
    assert expected == [10**9 + k * 10**8 for k in range(ROOMS * FRAMES)]
    for topic in [*IMAGES, *COMPANIONS, *INFOS, "/synth/camera/pose"]:
        assert [stamp(message) for _, message in recorded.messages[topic]] == expected, topic
        assert [log_ns for log_ns, _ in recorded.messages[topic]] == expected, topic
    for topic in LABELS:
        stamps = [json.loads(message.data)["stamp"] for _, message in recorded.messages[topic]]
        assert [s["sec"] * 10**9 + s["nanosec"] for s in stamps] == expected
    assert {message.header.frame_id for topic in [*IMAGES, *INFOS] for _, message in recorded.messages[topic]} == {"camera_optical_frame"}


def test_offline_rendering_gives_the_same_bytes_with_one_and_two_threads(recorded: Recorded) -> None:
    camera = CameraConfig(width=96, height=72)
    for threads in (1, 2):
        config = RenderConfig(samples_per_pixel=1, threads=threads)
        offline = {layer: [] for layer in LAYERS}
        for scene in recorded.scenes():
            flat, key = flatten(scene), scene_key(scene)
            exposure = exposed(config, meter(flat, camera, config, key, scene.camera_path))
            with Renderer(flat, camera, config, key) as renderer:
                for index, pose in enumerate(scene.camera_path):
                    for layer, image in renderer.render(pose, index, set(LAYERS), exposure=exposure).layers.items():
                        offline[layer].append(hashlib.sha256(image.tobytes()).hexdigest())
        for layer in LAYERS:
            live = [hashlib.sha256(bytes(message.data)).hexdigest() for _, message in recorded.messages[f"/synth/camera/{layer}/image_raw"]]
            assert live == offline[layer], f"{layer} with {threads} threads"


def said(reader: BagReader) -> dict[str, list[tuple[int, bytes]]]:
    """Return topic -> log time and content of its messages, without what stands in the gaps between their fields."""
    kinds = {topic.name: topic.type_name for topic in reader.summary.topics}
    messages: dict[str, list[tuple[int, bytes]]] = {}
    for message in reader.messages(file_order=True):
        plain = kinds[message.topic].startswith(("tf2_msgs", "vision_msgs"))  # written by the recorder, with zeros in the gaps
        content = message.data if plain else canonical_cdr(deserialize_message(message.data, message_class(kinds[message.topic])))
        messages.setdefault(message.topic, []).append((message.log_ns, bytes(content)))
    return messages


def test_the_same_rooms_written_without_dds_are_the_same_bag(recorded: Recorded, tmp_path: Path) -> None:
    """But for ``/diagnostics``, which only nodes publish; gaps between the fields of live messages hold whatever they hold."""
    words = RunWords(record=recorded.bag, rooms=ROOMS, frames=FRAMES, seed=SEED, overrides=(*SMALL, HALLWAY))
    settings, synthesizer, bag = read_settings(run_parameters(words)), SceneSynthesizer.from_config(), tmp_path / "bag"
    with OfflineBag(bag, settings, synthesizer.floor_map) as offline:
        for index in range(ROOMS):
            times = CameraTimes(frames=FRAMES, start_ns=10**9, rate_hz=10.0, first_index=index * FRAMES)
            offline.add_room(synthesizer.synthesize(settings.grammar["scene"], SEED, index, times))
    with BagReader(recorded.bag) as live_reader, BagReader(bag) as reader:
        live, made = said(live_reader), said(reader)
        assert made == {topic: messages for topic, messages in live.items() if topic != "/diagnostics"}
        assert reader.summary.attachments["parameters.yaml"] == live_reader.summary.attachments["parameters.yaml"]
        assert reader.summary.records["scene_synth"] == live_reader.summary.records["scene_synth"]
        topics = {topic.name: topic for topic in live_reader.summary.topics if topic.name != "/diagnostics"}
        assert {topic.name: topic for topic in reader.summary.topics} == topics
    assert not inspect_bag(bag).faults and verify_bag(bag).good


def test_rooms_are_valid_and_depend_only_on_seed_and_index(recorded: Recorded) -> None:
    scenes = recorded.scenes()
    assert [scene.index for scene in scenes] == list(range(ROOMS))
    assert all(scene.validity.valid and all(check.passed for check in scene.validity.checks) for scene in scenes)
    words = RunWords(record=recorded.bag, rooms=1, frames=FRAMES, seed=SEED, overrides=(HALLWAY, "grammar_node.first_index:=1"))
    settings = read_settings(run_parameters(words))
    order = RoomSchedule(settings.run, 0.0).order(0.0)
    assert order is not None
    again = SceneSynthesizer.from_config().synthesize(settings.grammar["scene"], settings.run.seed, order.index, order.times)
    assert again == scenes[1]


def test_transforms_agree_with_the_poses(recorded: Recorded) -> None:
    ((_, static),) = recorded.messages["/tf_static"]
    (link_from_optical,) = static.transforms
    assert (link_from_optical.header.frame_id, link_from_optical.child_frame_id) == ("camera_link", "camera_optical_frame")
    fixed = rotation_from_quaternion(quaternion(link_from_optical.transform.rotation))
    for (_, tf), (_, pose) in zip(recorded.messages["/tf"], recorded.messages["/synth/camera/pose"], strict=True):
        (transform,) = tf.transforms
        assert (transform.header.frame_id, transform.child_frame_id, stamp(transform)) == ("map", "camera_link", stamp(pose))
        link = rotation_from_quaternion(quaternion(transform.transform.rotation))
        # A description's numbers have twelve digits, and a turn has products of four of them.
        np.testing.assert_allclose(link @ fixed, rotation_from_quaternion(quaternion(pose.pose.orientation)), atol=4e-12)
        p, t = pose.pose.position, transform.transform.translation
        assert (p.x, p.y, p.z) == (t.x, t.y, t.z)


def quaternion(q: object) -> tuple[float, float, float, float]:
    return (q.x, q.y, q.z, q.w)


def test_every_id_in_the_pixels_is_in_the_labels(recorded: Recorded) -> None:
    for layer in ("semantic", "instance"):
        images, tables = recorded.messages[f"/synth/camera/{layer}/image_raw"], recorded.messages[f"/synth/camera/{layer}/labels"]
        seen_in_any: set[str] = set()
        for (_, image), (_, table) in zip(images, tables, strict=True):
            dtype = np.uint16 if image.encoding == "16UC1" else np.uint8
            seen = set(map(str, np.unique(np.frombuffer(image.data, dtype))))
            assert seen <= set(json.loads(table.data)["labels"])
            seen_in_any |= seen
        assert len(seen_in_any) > 3


def test_label_info_says_what_the_labels_say(recorded: Recorded) -> None:
    for labels, infos in zip(LABELS, LABEL_INFOS, strict=True):
        for (log_ns, table), (info_log_ns, info) in zip(recorded.messages[labels], recorded.messages[infos], strict=True):
            names = {str(item.class_id): item.class_name for item in info.class_map}
            assert names == {key: value["name"] for key, value in json.loads(table.data)["labels"].items()}
            assert (info_log_ns, stamp(info), info.header.frame_id) == (log_ns, log_ns, "camera_optical_frame")
