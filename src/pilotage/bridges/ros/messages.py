"""Messages of the usual ROS types as nested mappings, which bags and live topics alike are filled from.

What a mapping leaves out is the type's zero. Frames are those of REP 105, ranges those of REP 117.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any, TypeAlias

import numpy as np

from pilotage.core.types import FloatArray, Pose2
from pilotage.maps.occupancy_grid import OccupancyGrid

Fields: TypeAlias = Mapping[str, Any]

NANOSECONDS = 1_000_000_000
SCAN, ODOMETRY, TWIST = "sensor_msgs/msg/LaserScan", "nav_msgs/msg/Odometry", "geometry_msgs/msg/Twist"
TRANSFORMS, CLOCK = "tf2_msgs/msg/TFMessage", "rosgraph_msgs/msg/Clock"
GRID, PATH = "nav_msgs/msg/OccupancyGrid", "nav_msgs/msg/Path"
POSE, MARKERS = "geometry_msgs/msg/PoseWithCovarianceStamped", "visualization_msgs/msg/MarkerArray"
LINE_LIST, SPHERE_LIST = 5, 7
"""Kinds of ``visualization_msgs/msg/Marker``."""
XYT = (0, 1, 5)
"""Where x, y and the heading stand in a covariance of six."""


def nanoseconds(t_s: float) -> int:
    """A time as bags count it."""
    return round(t_s * NANOSECONDS)


def stamp(t_s: float) -> Fields:
    """``builtin_interfaces/msg/Time``."""
    seconds, rest = divmod(nanoseconds(t_s), NANOSECONDS)
    return {"sec": seconds, "nanosec": rest}


def header(t_s: float, frame: str) -> Fields:
    """``std_msgs/msg/Header``."""
    return {"stamp": stamp(t_s), "frame_id": frame}


def point(x_m: float, y_m: float) -> Fields:
    """A place on the floor; also a vector in it."""
    return {"x": float(x_m), "y": float(y_m), "z": 0.0}


def turn(theta_rad: float) -> Fields:
    """A heading as a quaternion."""
    return {"x": 0.0, "y": 0.0, "z": math.sin(0.5 * theta_rad), "w": math.cos(0.5 * theta_rad)}


def pose(at: Pose2) -> Fields:
    """``geometry_msgs/msg/Pose``."""
    return {"position": point(at.x_m, at.y_m), "orientation": turn(at.theta_rad)}


def twist(v_m_s: float, w_rad_s: float, lateral_m_s: float = 0.0) -> Fields:
    """``geometry_msgs/msg/Twist``."""
    return {"linear": point(v_m_s, lateral_m_s), "angular": {"x": 0.0, "y": 0.0, "z": float(w_rad_s)}}


def pose_with_covariance(t_s: float, frame: str, at: Pose2, cov: FloatArray) -> Fields:
    """A belief: ``cov`` (3, 3) of x, y, theta."""
    whole = np.zeros((6, 6))
    whole[np.ix_(XYT, XYT)] = cov
    return {"header": header(t_s, frame), "pose": {"pose": pose(at), "covariance": whole.ravel()}}


def odometry(t_s: float, frame: str, child: str, at: Pose2, velocity: Fields) -> Fields:
    """``nav_msgs/msg/Odometry``."""
    return {
        "header": header(t_s, frame),
        "child_frame_id": child,
        "pose": {"pose": pose(at)},
        "twist": {"twist": velocity},
    }


def transform(t_s: float, frame: str, child: str, at: Pose2) -> Fields:
    """``geometry_msgs/msg/TransformStamped``: where ``child`` stands in ``frame``."""
    return {
        "header": header(t_s, frame),
        "child_frame_id": child,
        "transform": {"translation": point(at.x_m, at.y_m), "rotation": turn(at.theta_rad)},
    }


def laser_scan(
    t_s: float, frame: str, angles_rad: FloatArray, ranges_m: FloatArray, max_range_m: float
) -> Fields:
    """Ranges (B,) along angles (B,), evenly apart; infinite where nothing was within reach."""
    step = float(angles_rad[-1] - angles_rad[0]) / (len(angles_rad) - 1) if len(angles_rad) > 1 else 0.0
    with np.errstate(invalid="ignore"):
        within = np.where(ranges_m < max_range_m, ranges_m, np.inf)
    return {
        "header": header(t_s, frame),
        "angle_min": float(angles_rad[0]),
        "angle_max": float(angles_rad[-1]),
        "angle_increment": step,
        "range_min": 0.0,
        "range_max": float(max_range_m),
        "ranges": within,
    }


def path(t_s: float, frame: str, states: FloatArray) -> Fields:
    """``nav_msgs/msg/Path`` of (N, 3) or (N, 2) states."""
    headings = states[:, 2] if states.shape[1] > 2 else np.zeros(len(states))
    places = [Pose2(float(x), float(y), float(a)) for (x, y), a in zip(states[:, :2], headings, strict=True)]
    head = header(t_s, frame)
    return {"header": head, "poses": [{"header": head, "pose": pose(place)} for place in places]}


def grid(t_s: float, frame: str, cells: OccupancyGrid) -> Fields:
    """``nav_msgs/msg/OccupancyGrid``, whose first row is the lowest."""
    rows, columns = cells.cells.shape
    return {
        "header": header(t_s, frame),
        "info": {
            "map_load_time": stamp(t_s),
            "resolution": cells.resolution_m,
            "width": columns,
            "height": rows,
            "origin": pose(cells.origin),
        },
        "data": cells.cells[::-1].ravel(),
    }


def marker(
    number: int,
    name: str,
    frame: str,
    kind: int,
    points_m: Sequence[Sequence[float]] | FloatArray,
    width_m: float,
    colour: Sequence[float],
) -> Fields:
    """``visualization_msgs/msg/Marker`` of points (N, 2); of a list of lines two each."""
    red, green, blue = colour
    return {
        "header": header(0.0, frame),
        "ns": name,
        "id": number,
        "type": kind,
        "pose": pose(Pose2(0.0, 0.0, 0.0)),
        "scale": {"x": width_m, "y": width_m, "z": width_m},
        "color": {"r": red, "g": green, "b": blue, "a": 1.0},
        "frame_locked": True,
        "points": [point(x, y) for x, y in points_m],
    }
