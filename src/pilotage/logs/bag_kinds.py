"""Kinds of messages in bags, and the rows of numbers that one message of each says.

Landmarks are read from any list of detections that names what was seen and says where it is: those of
``vision_msgs``, ``apriltag_ros``, ``aruco_msgs``, ``ros2_aruco_interfaces`` and ``fiducial_msgs``.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from typing import Any, TypeAlias

import numpy as np

from pilotage.logs.bag_topics import Kind
from pilotage.logs.bags import ODOMETRY, ODOMETRY_TYPE, USUAL_TRUTH

GAUSS_PER_TESLA = 1e4
Rows: TypeAlias = Iterator[tuple[Any, tuple[float, ...]]]
"""Header, or None for the time of receipt, and one row of numbers."""

POSES = Kind(
    "poses",
    (
        ODOMETRY_TYPE,
        "geometry_msgs/msg/PoseStamped",
        "geometry_msgs/msg/PoseWithCovarianceStamped",
        "geometry_msgs/msg/TransformStamped",
        "nav_msgs/msg/Path",
    ),
    ("/pose", "/amcl_pose", "/odom"),
    never=USUAL_TRUTH,
)
"""x, y, z in metres and the quaternion x, y, z, w."""
TRUTH = Kind("true poses", POSES.types, USUAL_TRUTH, by_name_only=True)
TWISTS = Kind(
    "velocities",
    (
        "geometry_msgs/msg/TwistStamped",
        "geometry_msgs/msg/TwistWithCovarianceStamped",
        "geometry_msgs/msg/Twist",
    ),
    ("/cmd_vel",),
)
"""Forward in m/s, turn rate in rad/s, to the left in m/s."""
RATES = Kind("turn rates", ("sensor_msgs/msg/Imu",), ("/imu", "/imu/data"))
"""About x, y, z in rad/s."""
FIELDS = Kind("magnetic fields", ("sensor_msgs/msg/MagneticField",), ("/imu/mag", "/mag"))
"""Along x, y, z in gauss."""
RANGES = Kind("ranges", ("sensor_msgs/msg/Range",))
"""Metres."""
LANDMARKS = Kind(
    "landmarks",
    (
        "vision_msgs/msg/Detection3DArray",
        "apriltag_ros/msg/AprilTagDetectionArray",
        "aruco_msgs/msg/MarkerArray",
        "ros2_aruco_interfaces/msg/ArucoMarkers",
        "fiducial_msgs/msg/FiducialTransformArray",
    ),
)
"""Identity, and x, y, z in metres in the sensor's frame."""


def _pose_rows(message: Any) -> Rows:
    for one in getattr(message, "poses", (message,)):
        header = message.header if _unstamped(one) else one.header
        if hasattr(one, "transform"):
            place, turn = one.transform.translation, one.transform.rotation
        else:
            pose = one.pose.pose if hasattr(one.pose, "pose") else one.pose
            place, turn = pose.position, pose.orientation
        numbers = tuple(float(v) for v in (place.x, place.y, place.z, turn.x, turn.y, turn.z, turn.w))
        size = math.hypot(*numbers[3:])
        yield header, numbers if size > 1e-6 else (math.nan,) * 7


def _unstamped(message: Any) -> bool:
    return bool(message.header.stamp.sec == 0 and message.header.stamp.nanosec == 0)


def _twist_rows(message: Any) -> Rows:
    twist = message
    while hasattr(twist, "twist"):
        twist = twist.twist
    yield (
        getattr(message, "header", None),
        (float(twist.linear.x), float(twist.angular.z), float(twist.linear.y)),
    )


def _rate_rows(message: Any) -> Rows:
    rate = message.angular_velocity
    yield message.header, (float(rate.x), float(rate.y), float(rate.z))


def _field_rows(message: Any) -> Rows:
    field = message.magnetic_field
    yield message.header, tuple(GAUSS_PER_TESLA * float(v) for v in (field.x, field.y, field.z))


def _range_rows(message: Any) -> Rows:
    yield message.header, (float(message.range),)


def _landmark_rows(message: Any) -> Rows:
    """Identity and place of whatever a list of detections calls them."""
    if hasattr(message, "marker_ids"):
        seen = [(i, pose.position) for i, pose in zip(message.marker_ids, message.poses, strict=True)]
    elif hasattr(message, "transforms"):
        seen = [(one.fiducial_id, one.transform.translation) for one in message.transforms]
    elif hasattr(message, "markers"):
        seen = [(one.id, one.pose.pose.position) for one in message.markers]
    else:
        seen = [_detected(one) for one in message.detections]
    for identity, place in seen:
        yield message.header, (float(identity), float(place.x), float(place.y), float(place.z))


def _detected(one: Any) -> tuple[Any, Any]:
    """A detection of ``apriltag_ros``, or of ``vision_msgs`` by its likeliest hypothesis."""
    if not hasattr(one, "results"):
        return np.atleast_1d(one.id)[0], one.pose.pose.pose.position
    best = one.results[0]
    hypothesis = getattr(best, "hypothesis", best)
    named = getattr(hypothesis, "class_id", getattr(hypothesis, "id", "")) or one.id
    return named, best.pose.pose.position


ROWS: dict[str, Callable[[Any], Rows]] = {
    POSES.what: _pose_rows,
    TRUTH.what: _pose_rows,
    ODOMETRY.what: _pose_rows,
    TWISTS.what: _twist_rows,
    RATES.what: _rate_rows,
    FIELDS.what: _field_rows,
    RANGES.what: _range_rows,
    LANDMARKS.what: _landmark_rows,
}
"""What reads a message, by what its kind says."""
