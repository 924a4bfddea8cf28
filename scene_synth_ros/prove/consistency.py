"""Checks of stamps, frames and what messages say of each other."""

from collections.abc import Iterator

import numpy as np
from scipy.spatial.transform import Rotation

from scene_synth_ros.dataset.camera import read_camera
from scene_synth_ros.dataset.part import find_cameras
from scene_synth_ros.messages import streams as roles
from scene_synth_ros.prove.decode import PoseRows, clock_ticks
from scene_synth_ros.prove.evidence import HEADED, NS, Evidence, Room
from scene_synth_ros.prove.stack import read_table
from scene_synth_ros.prove.verdict import Verdict, at_most

_EVEN = (
    roles.SCAN, roles.SCAN_IDEAL, roles.LIDAR_POINTS, roles.LIDAR_IDEAL, roles.IMU_DATA, roles.IMU_IDEAL, roles.ODOM, roles.JOINT_STATES,
)  # fmt: skip
_ROUNDING_NS = 1000
_STAMPED = 12
"""Bytes of a message with its stamp."""


def stamps(evidence: Evidence, room: Room) -> Iterator[Verdict]:
    """Yield whether stamps are log times, ascend, come at an even rate, and are the same for all that a frame has."""
    for topic, stream in evidence.streams(*HEADED).items():
        logged, found = room.heads(topic)
        if not len(logged):
            continue
        told = found.stamps
        yield at_most("stamps", topic, "time between stamp and log time", np.abs(logged - told) * NS, 1e-9, "s", told)
        spacing = np.diff(told)
        yield at_most("stamps", topic, "stamps that do not ascend", (spacing <= 0).astype(float), 0.0, "", told[1:])
        if stream.role in _EVEN and len(spacing) > 2:
            off = np.abs(spacing - np.median(spacing)) * NS
            yield at_most("stamps", topic, "time by which a message is late or early", off, _ROUNDING_NS * NS, "s", told[1:])
    for topics in find_cameras(evidence.types).values():
        if not topics.pose:
            continue
        whole = room.heads(topics.pose)[1].stamps
        for topic in (*topics.images.values(), *topics.infos.values()):
            lost = np.setxor1d(whole, room.heads(topic)[1].stamps)
            yield at_most("stamps", topic, "frames without a pose of their stamp, or poses without it", [len(lost)], 0.0, "", lost[:1])


def frames(evidence: Evidence, room: Room) -> Iterator[Verdict]:
    """Yield whether headers name frames of the tree, each has one parent, and the tree puts the camera where its pose says."""
    fixed, moving = evidence.transforms(roles.TF_STATIC), evidence.transforms(roles.TF)
    tables = [table for table in (fixed, moving) if table is not None]
    if not tables:
        return
    pairs = {(str(child), str(parent)) for table in tables for child, parent in zip(table.children, table.frames, strict=True)}
    known, children = {name for pair in pairs for name in pair}, [child for child, _ in pairs]
    yield at_most("frames", "/tf", "frames with more than one parent", [len(children) - len(set(children))], 0.0)
    yield at_most("frames", "/tf", "frames without a parent, but for one", [len(known - set(children)) - 1], 0.0)
    for topic in evidence.streams(*HEADED):
        named = set(np.unique(room.heads(topic)[1].frames).tolist()) - {""}
        yield at_most(
            "frames", topic, f"frames in headers that the tree does not know ({', '.join(sorted(named))[:80]})", [len(named - known)], 0.0
        )
        yield at_most("frames", topic, "frames in the headers of a topic, beyond one", [max(len(named) - 1, 0)], 0.0)
    yield from _cameras_in_tree(evidence, room)
    if moving is not None:
        yield from _told_twice(evidence, room, moving)


def _cameras_in_tree(evidence: Evidence, room: Room) -> Iterator[Verdict]:
    """Yield whether poses of cameras on a body are those that the tree gives."""
    if room.curve is None or room.body is None:
        return
    for topics in find_cameras(evidence.types).values():
        poses = room.poses(topics.pose) if topics.pose else None
        optical = next((str(name) for topic in topics.images.values() for name in room.heads(topic)[1].frames[:1]), "")
        mount = evidence.mount(optical)
        if poses is None or mount is None:
            continue
        inside = room.curve.covers(poses.stamps)
        place, turn = mount.on(*room.curve.at(int(poses.stamps[0]), (poses.stamps[inside] - poses.stamps[0]) * NS))
        away = np.linalg.norm(place - poses.place[inside], axis=1)
        turned = np.degrees((turn.inv() * Rotation.from_quat(poses.quaternion[inside])).magnitude())
        yield at_most(
            "frames", topics.pose, "distance of the camera from where the tree of frames has it", away, 1e-4, "m", poses.stamps[inside]
        )
        yield at_most(
            "frames", topics.pose, "turn of the camera from how the tree of frames has it", turned, 0.01, "deg", poses.stamps[inside]
        )


def _told_twice(evidence: Evidence, room: Room, moving: PoseRows) -> Iterator[Verdict]:
    """Yield whether ``/tf`` says of base and scanner what their own topics say, at the same stamps."""
    scanners = [topic for topic, stream in evidence.streams(roles.POSE).items() if stream.camera == roles.LASER]
    for topic in (evidence.first(roles.ODOM_IDEAL), *scanners):
        rows = room.body if topic not in scanners else room.poses(topic)
        if rows is None:
            continue
        child = moving.children == evidence.base if topic not in scanners else np.char.endswith(moving.children, roles.LASER)
        chosen = child & (moving.stamps >= room.start_ns) & (moving.stamps < room.end_ns)
        _, mine, its = np.intersect1d(moving.stamps[chosen], rows.stamps, return_indices=True)
        away = np.linalg.norm(moving.place[chosen][mine] - rows.place[its], axis=1)
        turned = np.abs(np.abs((moving.quaternion[chosen][mine] * rows.quaternion[its]).sum(axis=1)) - 1.0)
        yield at_most("frames", "/tf", f"distance from what {topic} says", away, 1e-9, "m", moving.stamps[chosen][mine])
        yield at_most("frames", "/tf", f"one less the product of quaternions with what {topic} says", turned, 1e-9, "", rows.stamps[its])
        yield at_most("frames", "/tf", f"stamps of {topic} that it lacks", [len(np.unique(rows.stamps)) - len(its)], 0.0)


def camera_info(evidence: Evidence, room: Room) -> Iterator[Verdict]:
    """Yield whether all of a camera's CameraInfo say the same, and the size of its images."""
    for name, topics in find_cameras(evidence.types).items():
        told = [(topic, data) for topic in topics.infos.values() for _, data in room.each(topic)]
        for topic, first in told[:1]:
            camera = read_camera(name, first)
            others = [on for on, data in told if data[_STAMPED:] != first[_STAMPED:] and not _same(camera, read_camera(name, data))]
            yield at_most("camera_info", (*others, topic)[0], "messages that differ from the camera's first", [len(others)], 0.0)
            for layer, image in topics.images.items():
                _, of = room.heads(image)
                wrong = (of.height > 0) & ((of.height != camera.height) | (of.width != camera.width))
                yield at_most("camera_info", image, f"images of {layer} of another size than the CameraInfo's", [wrong.sum()], 0.0)


def _same(one: object, other: object) -> bool:
    return all(
        np.array_equal(getattr(one, name), getattr(other, name)) for name in ("K", "D", "R", "P", "width", "height", "model", "frame_id")
    )


def clock(evidence: Evidence, room: Room) -> Iterator[Verdict]:
    """Yield whether ``/clock`` never goes back, and has ticked at every frame."""
    topic = evidence.first(roles.CLOCK)
    if not topic:
        return
    messages = [data for _, data in room.each(topic)]
    ticks = read_table(messages, clock_ticks, np.asarray) if messages else np.zeros(0, np.int64)
    if len(ticks):
        yield at_most("clock", topic, "seconds that the clock goes back", -np.diff(ticks) * NS, 0.0, "s", ticks[1:])
    for topics in find_cameras(evidence.types).values():
        if topics.pose and len(ticks):
            missing = np.setdiff1d(room.heads(topics.pose)[1].stamps, ticks)
            yield at_most("clock", topic, "frames at whose stamp it has not ticked", [len(missing)], 0.0, "", missing[:1])
