"""The vocabulary of a recording: every row in both directions, names that are refused, and what a new row alone is enough for."""

import pytest
from hypothesis import given
from hypothesis import strategies as st
from sample_scene import sample_scene
from sensor_msgs.msg import Temperature

from renderer import LAYERS, CameraConfig, Frame
from scene_description import CameraPose
from scene_synth_ros.bags.whole_frames import cameras
from scene_synth_ros.messages import frame_messages
from scene_synth_ros.messages.frame_messages import CameraRole, FrameMessages, StreamConfig
from scene_synth_ros.messages.message_definitions import message_definition
from scene_synth_ros.messages.senses import NO_SENSES
from scene_synth_ros.messages.streams import (
    IMAGE_TYPE,
    RAW,
    ROLES,
    Role,
    Stream,
    derived_streams,
    find_images,
    find_streams,
    parse,
    source_topic,
    untransported,
)
from scene_synth_ros.record.frame_topics import frame_topics, with_derived
from scene_synth_ros.render.stream_topics import stream_topics

parts = st.from_regex(r"[A-Za-z0-9_]{1,9}", fullmatch=True)
bases = st.lists(parts, max_size=3).flatmap(lambda names: st.sampled_from(["/" + "/".join(names), "/".join(names)]))


@given(bases, st.sampled_from(list(ROLES.values())), parts)
def test_what_is_made_of_a_row_is_read_as_that_row(base, role, layer):
    stream = Stream(base, role, layer if role.of == "layer" else "")
    if role.of == "layer" or stream.topic.count("/") >= role.name.count("/"):
        read = parse(stream.topic, role.type_name)
        assert read == stream == parse(stream.topic)
        assert parse(stream.topic, "other_msgs/msg/Other") is None


@pytest.mark.parametrize("role", ROLES.values(), ids=ROLES)
def test_every_row_has_a_type_whose_definition_bags_can_hold(role):
    assert message_definition(role.type_name).text
    assert role.made_of in ("", *ROLES) and (not role.summary or role.switch)


@pytest.mark.parametrize(
    "name",
    [
        "", "/", "//pose", "/eye//pose", "/eye/../pose", "/e ye/pose", "/eye\n/pose", "/élan/pose", "/eye/pose/", "/eye/a-b/image_raw",
        "image_raw",
    ],
)  # fmt: skip
def test_other_characters_and_empty_parts_are_refused(name):
    assert parse(name) is None and find_streams({name: "geometry_msgs/msg/PoseStamped"}, *ROLES.values()) == {}


def test_the_first_form_of_an_image_counts_and_its_name_says_where_it_is():
    types = {f"/synth/eye/depth/image_raw{end}": kind for end, kind in (("/compressedDepth", "sensor_msgs/msg/CompressedImage"),)}
    assert find_images(types) == {Stream("/synth/eye", RAW, "depth"): "/synth/eye/depth/image_raw/compressedDepth"}
    assert find_images({**types, "/synth/eye/depth/image_raw": IMAGE_TYPE}) == {
        Stream("/synth/eye", RAW, "depth"): "/synth/eye/depth/image_raw"
    }
    (stream,) = find_images(types)
    assert (stream.camera, stream.frame_id("robot1/")) == ("eye", "robot1/eye_optical_frame")
    assert stream.is_of("eye") and stream.is_of("/synth/eye") and not stream.is_of("synth")
    assert untransported(next(iter(types))) == stream.topic and untransported(stream.topic) == ""


def test_what_a_recording_makes_has_a_source():
    for topic in ("/synth/eye/semantic/labels", "/synth/eye/annotations"):
        made = derived_streams(topic)
        assert made and {source_topic(stream.topic) for stream in made} == {topic}
    assert derived_streams("/synth/eye/pose") == [] and source_topic("/synth/eye/pose") == ""


def test_a_stream_is_a_row_and_the_function_that_fills_it(monkeypatch):
    """Publishers, frames, what recorders wait for, and readers follow from these two."""
    warmth = Role(name="warmth", type_name="sensor_msgs/msg/Temperature", of="camera", switch="annotations")
    monkeypatch.setitem(ROLES, warmth.name, warmth)
    filled = CameraRole(lambda config, role: ("color",), lambda maker, frame, pose, role: Temperature(temperature=float(len(frame.layers))))
    monkeypatch.setitem(frame_messages.CAMERA_ROLES, warmth, filled)
    parse.cache_clear()
    config, camera = StreamConfig(annotations=True), CameraConfig(width=4, height=3)
    topics = stream_topics(config, camera, NO_SENSES)
    assert (topics["camera/warmth"].message_type, topics["camera/warmth"].layers) == (Temperature, {"color"})
    assert "camera/warmth" not in stream_topics(StreamConfig(), camera, NO_SENSES)
    maker = FrameMessages(config, camera)
    maker.begin_room(sample_scene())
    pose = CameraPose(stamp_ns=7, position_m=(0.0, 0.0, 1.0), orientation=(0.0, 0.0, 0.0, 1.0))
    assert dict(maker.of_frame(Frame({}, None), pose, lambda topic: topic.endswith("warmth")))["camera/warmth"] == Temperature()
    types = {f"/synth/eye/{layer}/image_raw": IMAGE_TYPE for layer in LAYERS} | {"/synth/eye/warmth": warmth.type_name}
    assert "/synth/eye/warmth" in cameras(types)["/synth/eye"] and "/synth/eye/warmth" in with_derived(frame_topics(types))
    parse.cache_clear()
