"""Recordings of a robot among landmarks, as bags hold them."""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from pilotage.bridges.ros import messages as ros
from pilotage.bridges.ros.run_messages import RunMessages, Stamped
from pilotage.core.types import Pose2

PLACES = {1: (4.0, 0.0), 2: (0.0, 4.0), 3: (-4.0, -1.0), 4: (1.0, -4.0)}
MOUNT = Pose2(0.2, 0.0, 0.0)
POSE_IN = "geometry_msgs/PoseWithCovariance pose\n"
DETECTIONS: dict[str, tuple[str, dict[str, str]]] = {
    "vision": (
        "vision_msgs/msg/Detection3DArray",
        {
            "vision_msgs/msg/ObjectHypothesis": "string class_id\nfloat64 score\n",
            "vision_msgs/msg/ObjectHypothesisWithPose": "vision_msgs/ObjectHypothesis hypothesis\n" + POSE_IN,
            "vision_msgs/msg/Detection3D": "std_msgs/Header header\n"
            "vision_msgs/ObjectHypothesisWithPose[] results\nstring id\n",
            "vision_msgs/msg/Detection3DArray": "std_msgs/Header header\n"
            "vision_msgs/Detection3D[] detections\n",
        },
    ),
    "apriltag": (
        "apriltag_ros/msg/AprilTagDetectionArray",
        {
            "apriltag_ros/msg/AprilTagDetection": "int32[] id\n"
            "geometry_msgs/PoseWithCovarianceStamped pose\n",
            "apriltag_ros/msg/AprilTagDetectionArray": "std_msgs/Header header\n"
            "apriltag_ros/AprilTagDetection[] detections\n",
        },
    ),
    "aruco": (
        "aruco_msgs/msg/MarkerArray",
        {
            "aruco_msgs/msg/Marker": "std_msgs/Header header\nuint32 id\n" + POSE_IN,
            "aruco_msgs/msg/MarkerArray": "std_msgs/Header header\naruco_msgs/Marker[] markers\n",
        },
    ),
    "ros2-aruco": (
        "ros2_aruco_interfaces/msg/ArucoMarkers",
        {
            "ros2_aruco_interfaces/msg/ArucoMarkers": "std_msgs/Header header\nint64[] marker_ids\n"
            "geometry_msgs/Pose[] poses\n"
        },
    ),
    "fiducial": (
        "fiducial_msgs/msg/FiducialTransformArray",
        {
            "fiducial_msgs/msg/FiducialTransform": "int32 fiducial_id\ngeometry_msgs/Transform transform\n",
            "fiducial_msgs/msg/FiducialTransformArray": "std_msgs/Header header\n"
            "fiducial_msgs/FiducialTransform[] transforms\n",
        },
    ),
}


def detected(form: str, header: Any, seen: Mapping[int, tuple[float, float]]) -> dict[str, Any]:
    """One message: identities and places in the camera's frame."""
    poses = {i: ros.pose(Pose2(x, y, 0.0)) for i, (x, y) in seen.items()}
    if form == "vision":
        many = [
            {"results": [{"hypothesis": {"class_id": str(i), "score": 1.0}, "pose": {"pose": p}}]}
            for i, p in poses.items()
        ]
        return {"header": header, "detections": many}
    if form == "apriltag":
        tags = [{"id": [i], "pose": {"header": header, "pose": {"pose": p}}} for i, p in poses.items()]
        return {"header": header, "detections": tags}
    if form == "aruco":
        return {"header": header, "markers": [{"id": i, "pose": {"pose": p}} for i, p in poses.items()]}
    if form == "ros2-aruco":
        return {"header": header, "marker_ids": list(poses), "poses": list(poses.values())}
    shifts = [
        {"fiducial_id": i, "transform": {"translation": p["position"], "rotation": p["orientation"]}}
        for i, p in poses.items()
    ]
    return {"header": header, "transforms": shifts}


def truth_at(t_s: float) -> Pose2:
    """A circle of 1 m at 0.3 m/s."""
    angle = 0.3 * t_s
    return Pose2(math.sin(angle), 1.0 - math.cos(angle), math.remainder(angle, math.tau))


def circle(form: str = "vision", parts: str = "odometry landmarks truth") -> RunMessages:
    """A minute on the circle; odometry and velocities turn 2 % too much, the rest is exact."""
    out: list[Stamped] = []
    msgtype, types = DETECTIONS[form]
    claimed = Pose2(0.0, 0.0, 0.0)
    start = 1000.0
    tree = {"transforms": [ros.transform(start, "base_link", "camera", MOUNT)]}
    out.append(Stamped("/tf_static", ros.nanoseconds(start), ros.TRANSFORMS, tree, kept=True))
    for k in range(601):
        t_s = start + 0.1 * k
        at, now = truth_at(0.1 * k), ros.nanoseconds(t_s)
        if k:
            step = truth_at(0.1 * (k - 1)).inverse().compose(at)
            claimed = claimed.compose(Pose2(step.x_m, step.y_m, 1.02 * step.theta_rad))
        if "odometry" in parts:
            fields = ros.odometry(t_s, "odom", "base_link", claimed, ros.twist(0.3, 0.3))
            out.append(Stamped("/odom", now, ros.ODOMETRY, fields))
        if "truth" in parts:
            fields = ros.odometry(t_s, "map", "base_link", at, ros.twist(0.3, 0.3))
            out.append(Stamped("/ground_truth", now, ros.ODOMETRY, fields))
        if "twist" in parts:
            out.append(Stamped("/cmd_vel", now, ros.TWIST, ros.twist(0.3, 0.306)))
        if "imu" in parts:
            rate = {"x": 0.0, "y": 0.0, "z": 0.3}
            imu = {"header": ros.header(t_s, "imu"), "angular_velocity": rate}
            out.append(Stamped("/imu", now, "sensor_msgs/msg/Imu", imu))
        if "landmarks" in parts and k % 5 == 0:
            camera = at.compose(MOUNT).inverse()
            seen = {i: camera.compose(Pose2(x, y, 0.0)) for i, (x, y) in PLACES.items()}
            where = {i: (p.x_m, p.y_m) for i, p in seen.items()}
            out.append(Stamped("/tags", now, msgtype, detected(form, ros.header(t_s, "camera"), where)))
    return RunMessages(out, types)


def noisy(rng: np.random.Generator, axis: str = "z", scale: float = 1.0) -> RunMessages:
    """A winding drive of 80 s: odometry of a poor base, a gyroscope with a bias, landmarks half the time."""
    _, types = DETECTIONS["vision"]
    start, at, claimed = 1000.0, Pose2(0.0, 0.0, 0.0), Pose2(0.0, 0.0, 0.0)
    out: list[Stamped] = []
    tree = {"transforms": [ros.transform(start, "base_link", "camera", MOUNT)]}
    out.append(Stamped("/tf_static", ros.nanoseconds(start), ros.TRANSFORMS, tree, kept=True))
    for k in range(801):
        t_s, now, turn = start + 0.1 * k, ros.nanoseconds(start + 0.1 * k), 0.0
        if k > 30:  # it stands at first
            turn = 0.03 + 0.04 * math.sin(0.02 * k)
            at = at.compose(Pose2(0.03, 0.0, turn))
            wrong = math.sqrt(5e-3 * 0.03 + 0.01 * abs(turn)) * rng.standard_normal()
            claimed = claimed.compose(Pose2(0.03, 0.0, turn + wrong))
        for topic, frame, pose in (("/odom", "odom", claimed), ("/ground_truth", "map", at)):
            fields = ros.odometry(t_s, frame, "base_link", pose, ros.twist(0.3, 0.3))
            out.append(Stamped(topic, now, ros.ODOMETRY, fields))
        rate = dict.fromkeys("xyz", 0.0)
        rate[axis[-1]] = scale * (turn / 0.1 + 0.015 + 0.005 * rng.standard_normal())
        imu = {"header": ros.header(t_s - 0.05, "imu"), "angular_velocity": rate}
        out.append(Stamped("/imu", ros.nanoseconds(t_s - 0.05), "sensor_msgs/msg/Imu", imu))
        if k % 5 == 0 and k % 400 < 100:
            camera = at.compose(MOUNT).inverse()
            seen = {i: camera.compose(Pose2(x, y, 0.0)) for i, (x, y) in PLACES.items()}
            where = {i: (p.x_m + 0.05 * rng.standard_normal(), p.y_m) for i, p in seen.items()}
            message = detected("vision", ros.header(t_s, "camera"), where)
            out.append(Stamped("/tags", now, DETECTIONS["vision"][0], message))
    return RunMessages(out, types)


def steady(parts: str) -> RunMessages:
    """Two minutes at rest."""
    rng = np.random.default_rng(3)
    out = []
    for k in range(1200):
        t_s = 10.0 + 0.1 * k
        now, header = ros.nanoseconds(t_s), ros.header(t_s, "sensor")
        if "imu" in parts:
            rate = {"x": 0.0, "y": 0.0, "z": 0.02 + rng.normal(0.0, 0.01)}
            out.append(
                Stamped("/imu", now, "sensor_msgs/msg/Imu", {"header": header, "angular_velocity": rate})
            )
        if "range" in parts:
            fields = {"header": header, "range": 2.0 + rng.normal(0.0, 0.03)}
            out.append(Stamped("/sonar", now, "sensor_msgs/msg/Range", fields))
        if "scan" in parts:
            angles, ranges = np.linspace(-1.0, 1.0, 21), 3.0 + rng.normal(0.0, 0.03, 21)
            ranges[0] = np.inf if k % 2 else 3.0
            scan = ros.laser_scan(t_s, "laser", angles, ranges, 30.0)
            out.append(Stamped("/scan", now, ros.SCAN, scan))
    return RunMessages(out, {})


def write_table(path: Path) -> Path:
    """Where the landmarks are, as ``localize`` reads it."""
    path.write_text("id,x_m,y_m\n" + "".join(f"{i},{x},{y}\n" for i, (x, y) in PLACES.items()))
    return path
