"""Frames hold what independent readers of bags find, whatever the order in which they are asked for."""

import hashlib
import pickle
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest
from bag_readers import read_mcap
from dataset_bags import OURS
from rclpy.serialization import serialize_message
from room_bag import CAMERA, START_NS, RoomBag, write_room_bag

from scene_description import scene_to_json
from scene_description.labels import instance_labels
from scene_synth_ros.bags.bag_writer import BagWriter
from scene_synth_ros.dataset import DatasetError, open_dataset
from scene_synth_ros.messages.conversions import image_to_msg
from scene_synth_ros.messages.image_codec import compress, compressed_topic
from scene_synth_ros.messages.streams import COMPRESSED_TYPE, IMAGE_TYPE

SMALL_CHUNKS = {"chunk_size": 9000}
"""Bytes: an image or two of 48x64 pixels."""


@pytest.fixture(scope="module", params=[OURS, {}], ids=["logged at stamps", "read through"])
def bag(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> RoomBag:
    return write_room_bag(tmp_path_factory.mktemp("frames") / "bag", records=request.param, **SMALL_CHUNKS)


def test_frames_are_what_another_decoder_reads(bag: RoomBag) -> None:
    data = open_dataset(bag.path, layers=None)
    assert data.layers == ("color", "depth", "instance", "normals", "semantic") and len(data) == 6 and data.notes == []
    own = {(frame.stamp_ns, layer): frame[layer].tobytes() for frame in data for layer in data.layers}
    _, _, _, messages = read_mcap(next(bag.path.glob("*.mcap")), topics=[f"{CAMERA}/{layer}/image_raw" for layer in data.layers])
    others = {}
    for message in messages:
        stamp = message.decoded_message.header.stamp
        layer = message.channel.topic.split("/")[-2]
        others[stamp.sec * 10**9 + stamp.nanosec, layer] = bytes(message.decoded_message.data)
    assert own == others


def test_pixels_are_the_callers_own_arrays(bag: RoomBag) -> None:
    frame = open_dataset(bag.path)[4]
    truth = bag.images[frame.stamp_ns]
    for layer, pixels in frame.items():
        np.testing.assert_array_equal(pixels, truth[layer])
        assert pixels.dtype == truth[layer].dtype and pixels.flags.writeable and pixels.flags.aligned and pixels.flags.c_contiguous
    assert list(frame) == ["color", "depth", "semantic"] and "normals" in frame and frame["normals"].shape == (48, 64, 3)
    frame["color"][:] = 0
    np.testing.assert_array_equal(open_dataset(bag.path)[4]["color"], truth["color"])


def test_what_is_beside_the_pixels(bag: RoomBag) -> None:
    frame = open_dataset(bag.path)[4]
    scene = bag.scenes[1]
    pose = scene.camera_path[1]
    assert (frame.index, frame.number, frame.room, frame.stamp_ns) == (4, 1, 1, START_NS + 4 * 200_000_000)
    assert (frame.room_type, frame.seed, frame.info.scene_id) == (scene.category, scene.seed, scene.id)
    assert scene_to_json(frame.scene) == scene_to_json(scene)
    assert tuple(frame.pose.position_m) == pose.position_m and tuple(frame.pose.quaternion_xyzw) == pose.orientation
    np.testing.assert_array_equal(frame.matrix[:3, 3], pose.position_m)
    camera = frame.camera
    assert (camera.name, camera.width, camera.height, camera.frame_id, camera.model) == (CAMERA, 64, 48, "eye", "plumb_bob")
    assert camera.K[0, 0] == camera.P[0, 0] == camera.fx > 0.0 and (camera.cx, camera.cy) == (31.5, 23.5) and not camera.D.any()
    assert camera is open_dataset(bag.path)[0].camera
    assert frame.labels("instance") == instance_labels(scene)
    assert frame.detections is None


def test_any_order_any_thread_and_any_process_read_the_same(bag: RoomBag) -> None:
    data = open_dataset(bag.path)
    truth = [bag.images[frame.stamp_ns]["depth"].tobytes() for frame in data]
    order = [5, 0, 3, 1, 4, 2] * 4
    with ThreadPoolExecutor(4) as pool:
        assert list(pool.map(lambda index: data[index]["depth"].tobytes(), order)) == [truth[index] for index in order]
    frame = data[-2]
    frame["color"]
    again = pickle.loads(pickle.dumps(frame))
    assert again["depth"].tobytes() == truth[4] and again["color"].tobytes() == frame["color"].tobytes() and again.room == frame.room


def test_another_process_reads_a_pickled_dataset_without_ros(bag: RoomBag, tmp_path: Path) -> None:
    data = open_dataset(bag.path)[2:]
    (tmp_path / "data").write_bytes(pickle.dumps(data))
    say = (
        "import hashlib, pickle, sys; from pathlib import Path; data = pickle.loads(Path(sys.argv[1]).read_bytes());"
        "depth = b''.join(frame['depth'].tobytes() for frame in data);"
        "print(len(data), hashlib.sha256(depth).hexdigest(), {'rclpy', 'numba'} & sys.modules.keys())"
    )
    told = subprocess.run([sys.executable, "-c", say, str(tmp_path / "data")], check=True, capture_output=True, text=True).stdout
    depth = b"".join(images["depth"].tobytes() for stamp, images in sorted(bag.images.items()) if stamp >= data[0].stamp_ns)
    assert told == f"4 {hashlib.sha256(depth).hexdigest()} set()\n"


def test_slices_and_chosen_frames_are_datasets(bag: RoomBag) -> None:
    data = open_dataset(bag.path, transform=lambda frame: frame.stamp_ns)
    stamps = sorted(bag.images)
    assert list(data) == stamps and list(data[1:5][1:]) == stamps[2:5] and list(data.frames_at([5, 0])) == [stamps[5], stamps[0]]
    assert [room.frames for room in data.rooms] == [3, 3]
    assert list(data.frames_of(1)) == [3, 4, 5] and list(data[2:5].frames_of(1)) == [1, 2]
    with pytest.raises(IndexError, match="expected the index of one of 6 frames, got 6"):
        data[6]


def test_compressed_images_and_millimetres_are_read(tmp_path: Path) -> None:
    color = np.arange(48, dtype=np.uint8).reshape(4, 4, 3)
    depth = np.array([[0, 1500], [65535, 2]], np.uint16)
    with BagWriter(tmp_path / "bag") as writer:
        for layer, pixels, encoding in (("color", color, "rgb8"), ("depth", depth, "16UC1")):
            topic = f"{CAMERA}/{layer}/image_raw"
            message = bytes(serialize_message(image_to_msg(pixels, encoding, START_NS, "eye")))
            kind = IMAGE_TYPE
            if layer == "color":
                topic, kind, message = compressed_topic(topic), COMPRESSED_TYPE, compress(message, topic, "png", 90)
            writer.add_topic(topic, kind)
            writer.write(topic, message, START_NS, START_NS)
    frame = open_dataset(tmp_path / "bag", layers=None)[0]
    np.testing.assert_array_equal(frame["color"], color)
    np.testing.assert_array_equal(frame["depth"], np.array([[np.nan, 1.5], [65.535, 0.002]], np.float32))
    for name, line in (("scene", "a scene description on a topic that ends in /scene"), ("camera", "a camera_info beside its images")):
        with pytest.raises(DatasetError, match=rf"frame 0 .*: expected {line}, got none"):
            getattr(frame, name)
