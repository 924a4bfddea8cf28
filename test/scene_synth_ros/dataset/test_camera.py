"""Cameras of datasets, read from serialised messages."""

from rclpy.serialization import serialize_message
from sensor_msgs.msg import CameraInfo

from scene_synth_ros.dataset.camera import read_camera


def test_messages_that_differ_in_stamp_and_padding_tell_the_same_camera() -> None:
    message = CameraInfo(width=64, height=48, distortion_model="plumb_bob", d=[0.1, 0.0], k=[30.0] * 9, r=[1.0] * 9, p=[2.0] * 12)
    message.header.frame_id = "eye"
    data = bytearray(serialize_message(message))
    camera = read_camera("/synth/camera", bytes(data))
    # the model's name and its end are ten bytes, and the number that follows begins at a multiple of four
    padding = data.index(b"plumb_bob\x00") + 10
    data[padding : padding + 2] = b"\x5a\xa5"
    message.header.stamp.sec = 7
    data[4:12] = serialize_message(message)[4:12]
    again = read_camera("/synth/camera", bytes(data))
    assert again is camera
    assert (camera.width, camera.height, camera.D.tolist(), camera.K.tolist()) == (64, 48, [0.1, 0.0], [[30.0] * 3] * 3)
    assert not camera.K.flags.writeable and not camera.P.flags.writeable
