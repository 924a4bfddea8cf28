"""What a body senses of itself as messages, and the names of their topics.  No node here.

Covariances are of what a message is wrong by.  Zero would mean that they are unknown, so what is exact has the variance ``EXACT``; -1 first
means that there is no such quantity (sensor_msgs/Imu).
"""

import math
from functools import lru_cache

import numpy as np
from geometry_msgs.msg import Point, Quaternion, TransformStamped, Vector3
from nav_msgs.msg import Odometry
from numpy.typing import NDArray
from sensor_msgs.msg import Imu, JointState

from renderer.body.config import ImuConfig
from renderer.body.imu import ImuReadings, noise_variances
from renderer.body.wheels import WheelReadings
from scene_description.kinematics import Kinematics, conjugate, rotate
from scene_synth_ros.messages import streams
from scene_synth_ros.messages.conversions import header
from scene_synth_ros.messages.senses import Senses
from scene_synth_ros.messages.streams import Stream

IMU_DATA, IMU_IDEAL = Stream("", streams.IMU_DATA).topic, Stream("", streams.IMU_IDEAL).topic
ODOM, ODOM_IDEAL = Stream("", streams.ODOM).topic, Stream("", streams.ODOM_IDEAL).topic
JOINT_STATES, ROBOT_DESCRIPTION = Stream("", streams.JOINT_STATES).topic, Stream("", streams.ROBOT_DESCRIPTION).topic
WHEEL_JOINTS = ("wheel_left_joint", "wheel_right_joint")
EXACT = 1e-12


def body_streams(senses: Senses) -> tuple[Stream, ...]:
    """Return what is published of a body, below the namespace."""
    if not senses.tells_body:
        return ()
    roles = [streams.ODOM_IDEAL, streams.ROBOT_DESCRIPTION]
    roles += [streams.IMU_DATA, streams.IMU_IDEAL] if senses.imu.enabled else []
    roles += [streams.ODOM, streams.JOINT_STATES] if senses.wheels.enabled else []
    roles += [streams.LIDAR_POINTS, streams.LIDAR_IDEAL] if senses.lidar.enabled else []
    return tuple(Stream("", role) for role in roles)


def imu_to_msg(readings: ImuReadings, index: int, stamp_ns: int, config: ImuConfig, frame_id: str) -> Imu:
    """Return what the device reads, with a stamp by its own clock; it knows no orientation."""
    message = Imu(header=header(stamp_ns, frame_id))
    message.angular_velocity = _vector(readings.rate_rad_s[index])
    message.linear_acceleration = _vector(readings.force_m_s2[index])
    rate, force = noise_variances(config)
    message.orientation_covariance[0] = -1.0
    message.angular_velocity_covariance = _diagonal(max(rate, EXACT))
    message.linear_acceleration_covariance = _diagonal(max(force, EXACT))
    return message


def ideal_imu_to_msg(readings: ImuReadings, index: int, frame_id: str) -> Imu:
    """Return what is true of the device: its orientation in the map, its rate and the specific force."""
    message = Imu(header=header(int(readings.stamps_ns[index]), frame_id))
    x, y, z, w = readings.quaternion[index].tolist()
    message.orientation = Quaternion(x=x, y=y, z=z, w=w)
    message.angular_velocity = _vector(readings.true_rate_rad_s[index])
    message.linear_acceleration = _vector(readings.true_force_m_s2[index])
    message.orientation_covariance = message.angular_velocity_covariance = message.linear_acceleration_covariance = _diagonal(EXACT)
    return message


def ideal_odometry_to_msg(body: Kinematics, index: int, stamp_ns: int, odom: str, base: str) -> Odometry:
    """Return where the body is in the frame ``odom``, and its velocity in its own frame ``base``."""
    message = Odometry(header=header(stamp_ns, odom), child_frame_id=base)
    x, y, z, w = body.quaternion[index].tolist()
    message.pose.pose.position = Point(**dict(zip("xyz", body.position_m[index].tolist(), strict=True)))
    message.pose.pose.orientation = Quaternion(x=x, y=y, z=z, w=w)
    turned = rotate(conjugate(body.quaternion[index : index + 1]), body.velocity_m_s[index : index + 1])
    message.twist.twist.linear = _vector(turned[0])
    message.twist.twist.angular = _vector(body.rate_rad_s[index])
    message.pose.covariance[::7] = message.twist.covariance[::7] = np.full(6, EXACT)
    return message


def odometry_to_msg(readings: WheelReadings, index: int, odom: str, base: str) -> Odometry:
    """Return what odometry makes of the wheels; a base stays on the floor, upright, and never moves aside."""
    message = Odometry(header=header(int(readings.stamps_ns[index]), odom), child_frame_id=base)
    x, y, heading = readings.pose[index].tolist()
    message.pose.pose.position = Point(x=x, y=y, z=0.0)
    message.pose.pose.orientation = Quaternion(z=math.sin(0.5 * heading), w=math.cos(0.5 * heading))
    message.twist.twist.linear.x, message.twist.twist.angular.z = readings.twist[index].tolist()
    pose, twist = EXACT * np.eye(6), EXACT * np.eye(6)
    pose[np.ix_([0, 1, 5], [0, 1, 5])] = readings.pose_covariance[index]
    twist[0, 0], twist[5, 5] = readings.twist_variance[index]
    message.pose.covariance, message.twist.covariance = pose.ravel(), twist.ravel()
    return message


def joint_states_to_msg(readings: WheelReadings, index: int, prefix: str) -> JointState:
    """Return the angles of the wheels, as the encoders say."""
    message = JointState(header=header(int(readings.stamps_ns[index]), ""), name=[f"{prefix}{name}" for name in WHEEL_JOINTS])
    message.position, message.velocity = readings.angle_rad[index].tolist(), readings.rate_rad_s[index].tolist()
    return message


def odometry_transform(message: Odometry) -> TransformStamped:
    """Return what an odometry says as a transform."""
    transform = TransformStamped(header=message.header, child_frame_id=message.child_frame_id)
    place = message.pose.pose.position
    transform.transform.translation = Vector3(x=place.x, y=place.y, z=place.z)
    transform.transform.rotation = message.pose.pose.orientation
    return transform


def _vector(values: NDArray[np.float64]) -> Vector3:
    x, y, z = values.tolist()
    return Vector3(x=x, y=y, z=z)


@lru_cache(maxsize=8)
def _diagonal(variance: float) -> NDArray[np.float64]:
    """Return the covariance of three independent numbers; of a list rclpy would look at every number in each message."""
    covariance = variance * np.eye(3).ravel()
    covariance.setflags(write=False)
    return covariance
