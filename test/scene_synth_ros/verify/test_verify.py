"""A bag is rendered again from itself: the same bytes, and the first change of a pixel is named."""

import io
import json
import subprocess
from pathlib import Path

import numpy as np
import pytest
import yaml
from PIL import Image as Picture
from rclpy.serialization import deserialize_message, serialize_message
from rosbags.highlevel import AnyReader
from sample_scene import sample_scene
from scene_synth_ros_suite import command, environment, run_suite
from sensor_msgs.msg import CompressedImage, Image
from std_msgs.msg import String

from renderer import CameraConfig, RenderConfig, Renderer
from renderer.scene.flatten import flatten
from renderer.scene.scene_key import scene_key
from renderer.scene.semantic_classes import with_classes
from scene_description import SceneSynthError, scene_to_json
from scene_description.annotations import annotations_from_json
from scene_synth_ros.bags.bag_inspect import inspect_bag
from scene_synth_ros.bags.bag_reader import BagReader
from scene_synth_ros.bags.bag_writer import BagWriter
from scene_synth_ros.cli.parameters.run_profile import load_profile
from scene_synth_ros.cli.pictures.contact_sheet import write_contact_sheet
from scene_synth_ros.messages.frame_messages import FrameMessages, StreamConfig
from scene_synth_ros.messages.frame_settings import FrameSettings, settings_to_json
from scene_synth_ros.verify.bag_verify import verify_bag

ROOMS, FRAMES = 2, 3
COLOR = "/synth/camera/color/image_raw"


@pytest.fixture(scope="module")
def bag(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("verify") / "bag"
    words = ["--rooms", ROOMS, "--frames", FRAMES, "--seed", 5]
    for override in ("recorder_node.images.ids:=png", "recorder_node.split.rooms:=1", "recorder_node.compression:=lz4"):
        words += ["-p", override]
    words += ["-p", "renderer_node.streams.annotations:=true", "-p", "renderer_node.streams.annotation_masks:=true"]
    words += ["-p", "renderer_node.render.auto_exposure:=true"]
    process = run_suite(folder, *words, timeout_s=900)
    assert process.returncode == 0, process.stderr + process.stdout
    return folder


def altered(bag: Path, out: Path, topic: str, number: int) -> Path:
    """Return a copy of a bag in which one pixel of the ``number``-th image of a topic is another."""
    seen = 0
    with BagReader(bag) as reader, BagWriter(out) as writer:
        for info in reader.summary.topics:
            writer.add_topic(info.name, info.type_name, info.qos)
        for message in reader.messages(file_order=True):
            data = message.data
            if message.topic == topic:
                if seen == number:
                    image = deserialize_message(data, Image)
                    image.data[100] ^= 1
                    data = bytes(serialize_message(image))
                    data += bytes(-len(data) % 4)
                seen += 1
            writer.write(message.topic, data, message.log_ns, message.publish_ns)
    return out


def test_every_message_of_every_frame_is_the_same_again(bag: Path) -> None:
    report = verify_bag(bag)
    assert report.good, report
    assert report.frames == ROOMS * FRAMES
    # pose; five layers of image and camera info; two label tables, each twice; three pictures for people; annotations, 2D, 3D
    assert report.compared == ROOMS * FRAMES * (1 + 5 * 2 + 2 * 2 + 3 + 3)
    assert report.manifests == ROOMS


def test_every_frame_tells_of_the_objects_in_its_instance_image(bag: Path) -> None:
    import io

    from PIL import Image as Picture

    names = ("instance/image_raw/compressed", "annotations", "detections_2d", "detections_3d")
    with AnyReader([bag]) as reader:
        read = {name: [] for name in names}
        for connection, log_ns, data in reader.messages():
            name = connection.topic.removeprefix("/synth/camera/")
            if name in read:
                read[name].append((log_ns, reader.deserialize(data, connection.msgtype)))
    assert [len(messages) for messages in read.values()] == [ROOMS * FRAMES] * 4
    for (log_ns, image), (_, text), (_, flat), (_, solid) in zip(*read.values(), strict=True):
        told = annotations_from_json(text.data)
        pixels = np.asarray(Picture.open(io.BytesIO(bytes(image.data))))
        assert [item.id for item in told.objects] == [key for key in np.unique(pixels) if key]
        assert all(item.visible_pixels == (pixels == item.id).sum() and item.mask is not None for item in told.objects)
        assert told.stamp_ns == log_ns
        for detections in (flat, solid):
            assert detections.header == image.header and detections.header.frame_id == "camera_optical_frame"
            assert [int(found.id) for found in detections.detections] == [item.id for item in told.objects]
            assert [int(found.results[0].hypothesis.class_id) for found in detections.detections] == [item.label for item in told.objects]


def test_a_changed_pixel_is_found_and_named(bag: Path, tmp_path: Path) -> None:
    report = verify_bag(altered(bag, tmp_path / "bag", COLOR, 4))
    assert report.different == 1 and report.first is not None
    assert report.first.topic == COLOR
    assert report.first.stamp_ns == 10**9 + 4 * 10**8
    assert (report.first.room, report.first.frame) == ("bedroom-5-1", 1)
    assert report.first.detail == "1 of 6912 pixels"


def test_a_file_that_is_not_what_its_manifest_says_is_told(bag: Path, tmp_path: Path) -> None:
    with BagReader(bag / "bag_0.mcap") as reader, BagWriter(tmp_path / "bag") as writer:
        for info in reader.summary.topics:
            writer.add_topic(info.name, info.type_name, info.qos)
        for message in reader.messages(file_order=True):
            if not message.topic.startswith("/diagnostics"):
                writer.write(message.topic, message.data, message.log_ns, message.publish_ns)
        writer._file._manifest = None  # the copy keeps the manifest of the original
        writer.set_attachment("manifest.json", dict((path.name, data) for path, data in reader.manifests())["bag_0.mcap"])
    report = verify_bag(tmp_path / "bag")
    assert report.damaged == ["bag_0.mcap: /diagnostics is not what was recorded"]
    assert not report.different and not report.good


@pytest.mark.slow
def test_the_bag_says_what_made_it_and_its_parameters_make_it_again(bag: Path, tmp_path: Path) -> None:
    with BagReader(bag) as reader:
        record, attached = reader.summary.records["scene_synth"], reader.summary.attachments["parameters.yaml"]
    assert record["seed"] == "5" and record["room_type"] == "bedroom"
    assert {"version.numpy", "version.embreex", "version.scene_synth_ros", "version.processor"} <= set(record)
    nodes = yaml.safe_load(attached)
    assert nodes["/synth/grammar_node"]["ros__parameters"]["frames_per_room"] == FRAMES
    assert nodes["/synth/renderer_node"]["ros__parameters"]["camera.width"] == 96
    (tmp_path / "parameters.yaml").write_bytes(attached)
    assert load_profile(tmp_path / "parameters.yaml")["grammar_node"]["seed"] == 5
    again = tmp_path / "again"
    process = subprocess.run(
        command("run", "--record", again, "--params", tmp_path / "parameters.yaml"),
        env=environment(),
        capture_output=True,
        text=True,
        timeout=900,
        check=False,
    )
    assert process.returncode == 0, process.stderr
    with BagReader(bag) as first, BagReader(again) as second:
        images = [[message.data for message in reader.messages([COLOR])] for reader in (first, second)]
    assert len(images[0]) == ROOMS * FRAMES and images[0] == images[1]


def test_compressed_ids_hold_the_same_pixels_and_inspect_knows_them(bag: Path) -> None:
    report = inspect_bag(bag)
    assert not report.faults, report.faults
    assert report.files == ROOMS
    with BagReader(bag) as reader:
        topics = {topic.name: topic.type_name for topic in reader.summary.topics}
        images = [
            deserialize_message(message.data, CompressedImage)
            for message in reader.messages(["/synth/camera/instance/image_raw/compressed"])
        ]
        labels = [json.loads(m.data[8:].rstrip(b"\0"))["labels"] for m in reader.messages(["/synth/camera/instance/labels"])]
    assert topics["/synth/camera/instance/image_raw/compressed"] == "sensor_msgs/msg/CompressedImage"
    assert "/synth/camera/instance/image_raw" not in topics
    assert {image.format for image in images} == {"16UC1; png compressed 16UC1"}
    for image, table in zip(images, labels[:FRAMES], strict=False):
        assert set(map(str, np.unique(np.asarray(Picture.open(io.BytesIO(image.data)))))) <= set(table)


def test_a_bag_with_the_classes_of_another_standard_is_the_same_again_and_drawn_in_its_colours(tmp_path: Path) -> None:
    scene, camera, streams = sample_scene(), CameraConfig(width=48, height=36), StreamConfig(semantic_classes="coco", color=False)
    pose, maker, render = scene.camera_path[0], FrameMessages(streams, camera), RenderConfig(threads=1)
    with Renderer(with_classes(flatten(scene), scene, "coco"), camera, render, scene_key(scene)) as renderer:
        frame = renderer.render(pose, 0, maker.layers)
    maker.begin_room(scene)
    settings = FrameSettings(
        stamp_ns=pose.stamp_ns, scene=scene.id, frame=0, exposure_ev100=8.0, camera=camera, render=render, streams=streams
    )
    told = [("scene", String(data=scene_to_json(scene))), ("renderer_node/settings", String(data=settings_to_json(settings)))]
    with BagWriter(tmp_path / "bag") as writer:
        for topic, message in [*told, *maker.of_frame(frame, pose, lambda _: True)]:
            package = type(message).__module__.split(".")[0]
            writer.add_topic(f"/synth/{topic}", f"{package}/msg/{type(message).__name__}")
            writer.write(f"/synth/{topic}", bytes(serialize_message(message)), pose.stamp_ns, pose.stamp_ns)
    report = verify_bag(tmp_path / "bag")
    assert report.good and report.frames == 1 and report.compared == 16, report
    with BagReader(tmp_path / "bag") as reader:
        (image,) = [deserialize_message(m.data, Image) for m in reader.messages(["/synth/camera/semantic/image_raw"])]
        (labels,) = [json.loads(deserialize_message(m.data, String).data) for m in reader.messages(["/synth/camera/semantic/labels"])]
    ids = np.unique(np.frombuffer(image.data, np.uint8)).tolist()
    assert max(ids) > 40 and labels["standard"] == "coco" and {str(key) for key in ids} <= set(labels["labels"])
    assert write_contact_sheet(tmp_path / "bag", tmp_path / "sheet.png") == 1
    drawn = {tuple(color) for _, color in Picture.open(tmp_path / "sheet.png").convert("RGB").getcolors(1 << 24)}
    assert {tuple(labels["labels"][str(key)]["color"]) for key in ids} <= drawn


def test_what_cannot_be_verified_says_why(tmp_path: Path) -> None:
    from bag_samples import write_bag

    write_bag(tmp_path / "bag")
    with pytest.raises(SceneSynthError, match=r"scene|settings"):
        verify_bag(tmp_path / "bag")
    process = subprocess.run(
        command("verify", tmp_path / "bag"), env=environment(), capture_output=True, text=True, timeout=300, check=False
    )
    assert process.returncode == 2 and "Traceback" not in process.stderr and process.stderr.count("\n") == 1
