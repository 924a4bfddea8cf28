"""Checks of wheels and of the odometry that is made of them."""

from collections.abc import Iterator
from xml.etree import ElementTree

import numpy as np
from scipy.spatial.transform import Rotation
from scipy.special import chdtri

from scene_synth_ros.messages import streams as roles
from scene_synth_ros.messages.cdr import read_text
from scene_synth_ros.prove.decode import JointRows, OdometryRows, cut, joint_rows, odometry_rows
from scene_synth_ros.prove.evidence import NS, Evidence, Room
from scene_synth_ros.prove.verdict import Verdict, at_most

_PLANE = [0, 1, 5]
_SURE = 1e-7
"""Chance by which a covariance that covers is taken for one that does not."""
_WAY_M = 0.3
"""Way from which on there is an error to be covered."""
_ENCODER = np.diag([1e-8, 1e-8, 1e-8])
"""Square of what steps of encoders hide: a tenth of a millimetre."""


def odometry(evidence: Evidence, room: Room) -> Iterator[Verdict]:
    """Yield whether the covariance of ``odom`` covers its error: its normalised square is chi-squared with three degrees (NEES)."""
    topic = evidence.first(roles.ODOM)
    rows: OdometryRows | None = room.table(topic, odometry_rows, OdometryRows)
    if rows is None or room.curve is None:
        return
    rows = cut(rows, room.curve.covers(rows.stamps))
    place, turn = room.curve.at(int(rows.stamps[0]), (rows.stamps - rows.stamps[0]) * NS)
    heading = turn.inv() * Rotation.from_quat(rows.quaternion)
    error = np.column_stack([(rows.place - place)[:, :2], heading.as_rotvec()[:, 2]])
    covariance = rows.covariance.reshape(-1, 6, 6)[:, _PLANE][:, :, _PLANE] + _ENCODER
    square = np.einsum("ni,ni->n", error, np.linalg.solve(covariance, error[..., None])[..., 0])
    yield at_most("odometry", topic, "normalised error squared", square, float(chdtri(3, _SURE)), "", rows.stamps)
    if np.linalg.norm(np.diff(place, axis=0), axis=1).sum() > _WAY_M:
        small = float(chdtri(3, 1.0 - 1e-4))
        yield at_most(
            "odometry", topic, "over its greatest, what an error is squared at least", [small / max(float(square.max()), 1e-12)], 1.0
        )
    yield at_most("odometry", topic, "least of a covariance's numbers, negative", -np.linalg.eigvalsh(covariance)[:, 0], 0.0)


def wheels(evidence: Evidence, room: Room) -> Iterator[Verdict]:
    """Yield whether the angles of the wheels, with radius and track of the robot's description, add up to ``odom``."""
    topic = evidence.first(roles.JOINT_STATES)
    joints: JointRows | None = room.table(topic, joint_rows, JointRows)
    told: OdometryRows | None = room.table(roles.ODOM, odometry_rows, OdometryRows)
    size = _wheels_of(evidence, room)
    if joints is None or told is None or size is None or joints.position.ndim != 2:
        return
    _, mine, its = np.intersect1d(joints.stamps, told.stamps, return_indices=True)
    yield at_most("wheels", topic, "share of readings without odometry", [1.0 - len(mine) / len(joints.stamps)], 0.05)
    radius, track = size
    order = np.argsort(["right" in name for name in joints.names[0]], kind="stable")
    left, right = radius * np.diff(joints.position[mine][:, order], axis=0).T
    first = Rotation.from_quat(told.quaternion[its[:1]]).as_rotvec()[0, 2]
    heading = first + np.concatenate([[0.0], np.cumsum((right - left) / track)])
    middle = 0.5 * (heading[1:] + heading[:-1])
    chord = 0.5 * (left + right) * np.sinc((right - left) / track / (2.0 * np.pi))
    place = told.place[its[0], :2] + np.concatenate(
        [np.zeros((1, 2)), np.cumsum(chord[:, None] * np.column_stack([np.cos(middle), np.sin(middle)]), axis=0)]
    )
    slack = 1e-3 * np.concatenate([[0.0], np.cumsum(np.abs(left) + np.abs(right))])
    away = np.linalg.norm(place - told.place[its, :2], axis=1) - slack
    yield at_most("wheels", topic, "way of the wheels off odom, beyond a thousandth of it", away, 0.002, "m", told.stamps[its])


def _wheels_of(evidence: Evidence, room: Room) -> tuple[float, float] | None:
    """Return radius and track of the wheels by the robot's description; None where it tells none."""
    for topic in evidence.streams(roles.ROBOT_DESCRIPTION):
        for _, data in room.each(topic):
            robot = ElementTree.fromstring(read_text(data))
            turning = {joint.find("child").get("link"): joint for joint in robot.iter("joint") if joint.get("type") == "continuous"}  # type: ignore[union-attr]
            sides = [_second(joint) for joint in turning.values()]
            radii = [
                float(cylinder.get("radius", "nan"))
                for link in robot.iter("link")
                if link.get("name") in turning
                for cylinder in link.iter("cylinder")
            ]
            if len(sides) == 2 and radii:
                return radii[0], abs(sides[0] - sides[1])
    return None


def _second(joint: ElementTree.Element) -> float:
    origin = joint.find("origin")
    return float((origin.get("xyz", "0 0 0") if origin is not None else "0 0 0").split()[1])
