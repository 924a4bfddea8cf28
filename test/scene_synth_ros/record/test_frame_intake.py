"""What leaves at the end: whole frames, and messages of unknown senders at the time of the bag."""

from geometry_msgs.msg import PointStamped
from rclpy.serialization import serialize_message

from scene_synth_ros.messages.stamps import NANOSECONDS
from scene_synth_ros.record.frame_intake import FrameIntake
from scene_synth_ros.record.senders import Origin

POINT = "geometry_msgs/msg/PointStamped"


def point(seconds: int) -> bytes:
    message = PointStamped()
    message.header.stamp.sec = seconds
    return bytes(serialize_message(message))


def test_at_the_end_of_a_run_too_short_to_know_a_sender_its_messages_are_logged_at_the_time_of_the_bag() -> None:
    intake = FrameIntake(lambda line: None)
    for topic in ("/synth/a", "/synth/b"):
        intake.add_topic(topic, POINT, False, Origin.SUITE)
    intake.add_topic("/synth/stranger", POINT, False, Origin.UNKNOWN)
    intake.expect({"/synth/a", "/synth/b"}, {})
    released = [*intake.add("/synth/a", point(5)), *intake.add("/synth/b", point(5))]
    released += intake.add("/synth/stranger", point(1_700_000_000))
    released += intake.add("/synth/a", point(6))  # its frame stays incomplete, and who sent it may be gone by then
    intake.set_origin("/synth/a", Origin.UNKNOWN)
    assert [(message.topic, message.log_ns) for message in released] == [("/synth/a", 5 * NANOSECONDS), ("/synth/b", 5 * NANOSECONDS)]
    assert [(message.topic, message.log_ns) for message in intake.finish()] == [("/synth/stranger", 5 * NANOSECONDS)]


def test_scans_follow_frames_and_are_taken_once_but_lead_where_there_are_no_frames() -> None:
    intake = FrameIntake(lambda line: None)
    intake.add_topic("/synth/scan", POINT, False, Origin.SUITE)
    intake.add_topic("/synth/a", POINT, False, Origin.SUITE)
    intake.add("/synth/scan", point(1))
    assert [(message.topic, message.stamp_ns) for message in intake.flush()] == [("/synth/scan", NANOSECONDS)]
    intake.expect({"/synth/a"}, {})
    assert len(intake.add("/synth/a", point(2)) or []) == 1
    assert intake.add("/synth/scan", point(3)) == []
    assert intake.add("/synth/scan", point(3)) is None
    intake.wait_for(4 * NANOSECONDS, {"/synth/scan": 3 * NANOSECONDS, "/synth/not_recorded": 9})
    assert intake.add("/synth/a", point(4)) == []
    assert intake.held
    released = intake.reach("/synth/scan", point(3))
    assert [(message.topic, message.log_ns) for message in released] == [("/synth/scan", 3 * NANOSECONDS), ("/synth/a", 4 * NANOSECONDS)]


def test_a_room_that_another_renderer_does_more_slowly_is_waited_for() -> None:
    intake = FrameIntake(lambda line: None)
    for topic in ("/synth/scene/room", "/synth/a", "/synth/one/settings", "/synth/two/settings"):
        intake.add_topic(topic, POINT, topic == "/synth/scene/room", Origin.SUITE)
    intake.expect({"/synth/a", "/synth/one/settings", "/synth/two/settings"}, {"/synth/two/settings": "/synth/one/settings"})
    arrivals = [("scene/room", 1), ("scene/room", 2), ("two/settings", 2), ("a", 2), ("one/settings", 1), ("a", 1)]
    released = [message for name, at in arrivals for message in intake.add(f"/synth/{name}", point(at)) or ()]
    assert [message.log_ns // NANOSECONDS for message in released] == [1, 1, 1, 2, 2, 2]
    assert intake.late == 0
