"""Frames as messages: topics, encodings and parameters of every row of the layer table."""

import dataclasses
import json

import numpy as np
import pytest
from sample_scene import sample_scene
from sensor_msgs.msg import Image

from renderer import LAYERS, CameraConfig, DepthSensorConfig, Frame, RenderConfig
from renderer.film.layers import ROWS
from scene_description import CameraPose
from scene_description.annotations import FrameAnnotations, annotations_from_json
from scene_description.strict import field_types, split_annotation
from scene_synth_ros.messages.conversions import layer_encoding
from scene_synth_ros.messages.frame_messages import FrameMessages, StreamConfig, enabled_layers, has_companion
from scene_synth_ros.messages.frame_settings import FrameSettings, settings_from_json, settings_to_json

CAMERA = CameraConfig(width=9, height=6)
POSE = CameraPose(stamp_ns=7, position_m=(0.0, 0.0, 1.0), orientation=(0.0, 0.0, 0.0, 1.0))
FRAME = Frame({name: np.ones(row.shape(6, 9), row.dtype) for name, row in LAYERS.items()}, None)


def messages(config: StreamConfig, frame: Frame = FRAME, wanted=lambda _: True) -> dict[str, object]:
    maker = FrameMessages(config, CAMERA)
    maker.begin_room(sample_scene())
    return dict(maker.of_frame(frame._replace(layers={name: frame.layers[name] for name in maker.layers}), POSE, wanted))


def test_a_parameter_for_each_layer_stands_between_the_names_and_the_rest() -> None:
    fields = [field.name for field in dataclasses.fields(StreamConfig)]
    assert fields[: 3 + len(ROWS)] == ["camera", "world_frame", *(row.name for row in ROWS), "color_companions"]
    plain = StreamConfig()
    assert plain.color and plain.depth and plain.normals and plain.semantic and plain.instance
    assert not (plain.range or plain.color_noisy or plain.albedo or plain.radiance or plain.variance or plain.samples or plain.depth_sensed)
    annotation, limits = split_annotation(field_types(StreamConfig)["normals"])
    assert (annotation, limits.description, limits.fixed) == (bool, "Publish surface normals", "publishers are made at the start")
    assert StreamConfig(albedo=True) != StreamConfig() == dataclasses.replace(StreamConfig(albedo=True), albedo=False)


ENCODINGS = {
    "color": "rgb8", "depth": "32FC1", "range": "32FC1", "normals": "32FC3", "semantic": "mono8", "instance": "16UC1",
    "depth_sensed": "32FC1",
    "color_noisy": "rgb8", "color_sensed": "rgb8", "albedo": "32FC3", "radiance": "32FC3", "variance": "32FC3", "samples": "16UC1",
    "direct": "32FC3", "indirect": "32FC3", "shadow": "32FC1",
}  # fmt: skip


def test_encodings_come_from_dtype_and_channels() -> None:
    assert {name: layer_encoding(LAYERS[name]) for name in ENCODINGS} == ENCODINGS
    made = messages(StreamConfig(**dict.fromkeys(LAYERS, True)))
    for name, row in LAYERS.items():
        assert made[f"camera/{name}/image_raw"].encoding == layer_encoding(row)
        assert made[f"camera/{name}/camera_info"].header == made[f"camera/{name}/image_raw"].header


def test_ids_and_what_viewers_cannot_show_have_a_picture_beside_them() -> None:
    pictured = {name for name in ENCODINGS if has_companion(LAYERS[name])}
    assert pictured == {"normals", "semantic", "instance", "albedo", "radiance", "variance", "direct", "indirect"}
    made = messages(StreamConfig(**dict.fromkeys(LAYERS, True)))
    pictures = {topic.split("/")[1]: message for topic, message in made.items() if topic.endswith("/image_color")}
    assert set(pictures) & set(ENCODINGS) == pictured
    assert all((m.encoding, m.width, m.height, len(m.data)) == ("rgb8", 9, 6, 162) for m in pictures.values())
    assert {"camera/semantic/labels", "camera/instance/labels"} <= set(made) and "camera/depth/labels" not in made
    for config, wanted in ((StreamConfig(color_companions=False), lambda _: True), (StreamConfig(), lambda _: False)):
        assert not [topic for topic in messages(config, wanted=wanted) if topic.endswith("/image_color")]


def test_depth_in_millimetres_is_a_matter_of_one_parameter() -> None:
    made = messages(StreamConfig(depth_encoding="16UC1", range=True))
    assert (made["camera/depth/image_raw"].encoding, made["camera/range/image_raw"].encoding) == ("16UC1", "32FC1")


@pytest.mark.parametrize(("config", "layers"), [({}, ("color", "range", "normals", "semantic", "instance")), ({"depth": False}, None)])
def test_a_panorama_publishes_range_in_place_of_depth(config, layers) -> None:
    maker = FrameMessages(StreamConfig(**config), CameraConfig(model="equirectangular", width=16, height=8))
    assert maker.layers == (layers or ("color", "normals", "semantic", "instance"))


def test_what_needs_no_pixels_comes_without_them_where_it_is_wanted() -> None:
    maker = FrameMessages(StreamConfig(), CAMERA)
    maker.begin_room(sample_scene())
    frame = Frame({"color": FRAME.layers["color"]}, None)
    wanted = {"camera/depth/camera_info", "camera/semantic/labels", "camera/normals/image_raw"}
    made = dict(maker.of_frame(frame, POSE, wanted.__contains__))
    whole = messages(StreamConfig())
    of_color = {topic for topic in whole if topic.startswith("camera/color/")}
    assert set(made) == {"camera/pose", "camera/depth/camera_info", "camera/semantic/labels", *of_color}
    assert all(made[topic] == whole[topic] for topic in made)


def test_messages_are_images_of_the_frame() -> None:
    image = messages(StreamConfig())["camera/instance/image_raw"]
    assert isinstance(image, Image) and np.frombuffer(image.data, np.uint16).tolist() == [1] * 54


def test_annotations_come_where_a_frame_has_them_and_they_are_wanted() -> None:
    told = FrameAnnotations(stamp_ns=7, scene="a", width=9, height=6, objects=(), relations=())
    topics = {"camera/annotations", "camera/detections_2d", "camera/detections_3d"}
    config = StreamConfig(annotations=True)
    made = messages(config, FRAME._replace(annotations=told))
    assert set(made) - set(messages(StreamConfig())) == topics and annotations_from_json(made["camera/annotations"].data) == told
    assert made["camera/detections_2d"].header == made["camera/detections_3d"].header == made["camera/color/image_raw"].header
    for topic in topics:
        assert topics & set(messages(config, FRAME._replace(annotations=told), wanted=topic.__eq__)) == {topic}


def test_settings_say_that_there_are_annotations_only_where_there_are() -> None:
    for streams in (StreamConfig(), StreamConfig(annotations=True, annotation_masks=True)):
        settings = FrameSettings(stamp_ns=1, scene="a", frame=0, exposure_ev100=1.0, camera=CAMERA, render=RenderConfig(), streams=streams)
        text = settings_to_json(settings)
        assert text.count("annotation") == 2 * streams.annotations and settings_from_json(text) == settings


def test_a_prefix_stands_before_the_frames_and_an_empty_one_leaves_no_trace() -> None:
    made = messages(StreamConfig(frame_prefix="robot1/", world_frame="robot1/map"))
    assert made["camera/depth/image_raw"].header.frame_id == made["camera/depth/camera_info"].header.frame_id
    assert made["camera/depth/image_raw"].header.frame_id == "robot1/camera_optical_frame"
    assert made["camera/pose"].header.frame_id == "robot1/map"
    assert messages(StreamConfig())["camera/depth/image_raw"].header.frame_id == "camera_optical_frame"
    for prefix in ("", "robot1/"):
        streams = StreamConfig(frame_prefix=prefix)
        settings = FrameSettings(stamp_ns=1, scene="a", frame=0, exposure_ev100=1.0, camera=CAMERA, render=RenderConfig(), streams=streams)
        text = settings_to_json(settings)
        assert ("frame_prefix" in text) == bool(prefix) and settings_from_json(text) == settings


def test_true_and_sensed_depth_are_twins_and_the_settings_name_the_sensor() -> None:
    sensed = np.full((6, 9), 1.25, np.float32)
    sensed[0, :3] = np.nan, np.inf, -np.inf
    frame = FRAME._replace(layers=FRAME.layers | {"depth_sensed": sensed})
    made = messages(StreamConfig(depth_sensed=True), frame)
    true, read = made["camera/depth/image_raw"], made["camera/depth_sensed/image_raw"]
    assert isinstance(true, Image) and isinstance(read, Image) and (read.header, read.encoding) == (true.header, "32FC1")
    assert np.array_equal(np.frombuffer(read.data, np.float32).reshape(6, 9), sensed, equal_nan=True)
    whole = messages(StreamConfig(depth_sensed=True, depth_encoding="16UC1"), frame)["camera/depth_sensed/image_raw"]
    assert isinstance(whole, Image) and np.frombuffer(whole.data, np.uint16)[:4].tolist() == [0, 0, 0, 1250]
    panorama = CameraConfig(model="equirectangular", width=8, height=4)
    assert "depth_sensed" not in enabled_layers(StreamConfig(depth_sensed=True), panorama)
    for sensor in (DepthSensorConfig(), DepthSensorConfig(model="kinect_v1", max_range_m=3.0)):
        settings = FrameSettings(
            stamp_ns=1,
            scene="a",
            frame=0,
            exposure_ev100=1.0,
            camera=CAMERA,
            render=RenderConfig(),
            streams=StreamConfig(),
            depth_sensor=sensor,
        )
        text = settings_to_json(settings)
        assert ("kinect_v1" in text) == (sensor.model == "kinect_v1") and settings_from_json(text) == settings


def test_another_standard_of_classes_tells_itself_and_has_its_own_names_and_colours() -> None:
    tv = Frame({"semantic": np.full((6, 9), 72, np.uint8), "instance": FRAME.layers["instance"]}, None)
    streams = StreamConfig(semantic_classes="coco", color=False, depth=False, normals=False)
    made = messages(streams, tv)
    told = json.loads(made["camera/semantic/labels"].data)
    assert told["standard"] == "coco" and told["labels"]["72"]["name"] == "tv" and told["labels"]["72"]["nyu40"] == [25]
    assert json.loads(made["camera/instance/labels"].data)["labels"]["3"]["class_name"] == "bed"
    assert np.frombuffer(made["camera/semantic/image_color"].data, np.uint8)[:3].tolist() == told["labels"]["72"]["color"]
    assert "standard" not in json.loads(messages(StreamConfig())["camera/semantic/labels"].data)
    settings = FrameSettings(stamp_ns=1, scene="a", frame=0, exposure_ev100=1.0, camera=CAMERA, render=RenderConfig(), streams=streams)
    assert settings_from_json(settings_to_json(settings)) == settings
    plain = dataclasses.replace(settings, streams=StreamConfig())
    assert "semantic_classes" not in settings_to_json(plain) and settings_from_json(settings_to_json(plain)) == plain
