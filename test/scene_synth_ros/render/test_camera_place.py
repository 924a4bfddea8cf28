"""A camera that leaves the room's air is told once a room."""

from dataclasses import replace

from sample_scene import sample_scene

from scene_synth_ros.render.frame_report import IN_THE_ROOM, CameraPlace

SCENE = sample_scene()
POSE = replace(SCENE.camera_path[0], position_m=(1.0, 2.0, 0.5))


class Log:
    def __init__(self) -> None:
        self.lines: list[str] = []

    def warning(self, line: str) -> None:
        self.lines.append(line)


def test_a_line_is_logged_once_a_room_and_the_state_follows_every_frame() -> None:
    log = Log()
    place = CameraPlace(log)
    for said in ("", "inside object 3 (bed)", "outside the room"):
        place.take(SCENE, POSE, lambda pose, said=said: said)
        assert place.now == (said or IN_THE_ROOM)
    assert log.lines == ["room 0: the camera at (1.00, 2.00, 0.50) m is inside object 3 (bed); frames show what is seen from there"]
    place.begin_room()
    assert place.now == IN_THE_ROOM
    place.take(replace(SCENE, index=1), POSE, lambda pose: "outside the room")
    assert len(log.lines) == 2 and log.lines[1].startswith("room 1: ")
