"""What a frame of several renderers consists of."""

from scene_synth_ros.record.frame_sorter import FrameSorter
from scene_synth_ros.record.room_progress import stand_ins

IMAGES = {"/synth/camera/color/image_raw", "/synth/camera/pose"}


def test_renderers_that_share_rooms_stand_for_each_other() -> None:
    nodes = [f"/synth/renderer_node{suffix}" for suffix in ("", "_2", "_3")]
    topics = {node: IMAGES | {f"{node}/settings"} for node in nodes}
    assert stand_ins(topics) == {f"{node}/settings": "/synth/renderer_node/settings" for node in nodes}


def test_renderers_of_several_cameras_or_layers_stand_for_themselves() -> None:
    topics = {
        "/synth/renderer_node": {*IMAGES, "/synth/renderer_node/settings"},
        "/synth/renderer_node_right": {"/synth/right/color/image_raw", "/synth/renderer_node_right/settings"},
        "/synth/renderer_node_truth": {"/synth/camera/depth/image_raw", "/synth/renderer_node_truth/settings"},
    }
    assert all(topic == other for topic, other in stand_ins(topics).items())
    assert len(stand_ins(topics)) == 3


def test_a_frame_leaves_with_one_of_what_stands_for_each_other() -> None:
    sorter = FrameSorter(None)
    sorter.configure({"/a", "/b/settings", "/c/settings"}, {"/c/settings": "/b/settings"})
    assert not sorter.add("/c/settings", 1, b"")
    assert [message.topic for message in sorter.add("/a", 1, b"")] == ["/a", "/c/settings"]
    assert not sorter.add("/a", 2, b"")
    assert sorter.missing() == {2: frozenset({"/b/settings"})}
    assert [message.topic for message in sorter.add("/b/settings", 2, b"")] == ["/a", "/b/settings"]
