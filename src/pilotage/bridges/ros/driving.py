"""Our stack on somebody's robot: readings from live ROS 2 topics, commands to them."""

from __future__ import annotations

import math
import time
from typing import Any

import numpy as np

from pilotage.bridges.ros import messages as ros
from pilotage.bridges.ros.node import FLUSH_S, ros_node
from pilotage.core.angles import wrap_to_pi
from pilotage.core.errors import InputError
from pilotage.core.files.arrays import quiet
from pilotage.core.types import STOP, FloatArray, Pose2, Twist
from pilotage.experiments.build.build import build
from pilotage.logs.bags import heading_of
from pilotage.logs.laser_log import are_beams
from pilotage.logs.scanner_mount import LARGEST
from pilotage.missions.mission import Mission
from pilotage.sensors.lidar import LidarConfig
from pilotage.sensors.readings import LidarScan, OdometryIncrement, Reading, Readings
from pilotage.sensors.wheel_odometry import WheelOdometryConfig
from pilotage.stack.interface import StackStatus

SILENT_S, FIRST_S = 10.0, 60.0
"""So long nothing may be heard, in wall time, until the drive is given up; and before the first word."""
WAIT_S = 0.05
"""So long a step waits for the scan of its odometry."""


class LiveReadings:
    """Readings of one robot, step by step, from ``/odom`` and ``/scan``.

    A step is due when odometry has gone on by the mission's ``dt_s``; the times are those of the messages.

    Attributes
    ----------
    refused
        Messages by topic that say nothing: a pose that is none, or not later than the last; beams that no
        scanner has, or of the same time as the last. A robot that drove by them would be nowhere for good.
    """

    def __init__(self, node: Any, lidar: tuple[str, LidarConfig] | None, odometry: str, dt_s: float) -> None:
        self._node, self._lidar, self._odometry, self._dt_s = node, lidar, odometry, dt_s
        self._pose: tuple[float, Pose2] | None = None
        self._scan: tuple[float, Any] | None = None
        self._used: tuple[float, Pose2] | None = None
        self._heard_scan_s = self._began_s = -math.inf
        self._patience_s = time.perf_counter() + FIRST_S
        self.refused = {"/odom": 0} | ({} if lidar is None else {"/scan": 0})
        node.listens("/odom", ros.ODOMETRY, self._hear_odometry)
        if lidar is not None:
            node.listens("/scan", ros.SCAN, self._hear_scan)

    def _hear_odometry(self, message: Any) -> None:
        at, t_s = message.pose.pose.position, _seconds(message)
        theta = heading_of(message.pose.pose.orientation)
        later = self._pose is None or t_s > self._pose[0]
        if not (later and abs(at.x) <= LARGEST and abs(at.y) <= LARGEST and math.isfinite(theta)):
            self.refused["/odom"] += 1
            return
        self._pose = t_s, Pose2(at.x, at.y, theta)
        self._patience_s = time.perf_counter() + SILENT_S

    def _hear_scan(self, message: Any) -> None:
        t_s, beams = _seconds(message), (message.angle_min, message.angle_increment, len(message.ranges))
        if t_s != self._heard_scan_s and are_beams(*beams):
            self._scan, self._heard_scan_s = (t_s, message), t_s
        else:
            self.refused["/scan"] += 1

    def next(self) -> Readings | None:
        """The readings of the next step; None where nothing is heard any more."""
        heard = time.perf_counter()
        while time.perf_counter() < self._patience_s:
            self._node.spin_until(time.perf_counter() + 0.002)
            if self._pose is None:
                continue
            if self._used is None:
                self._used, self._began_s = self._pose, self._pose[0]
            if self._pose[0] < self._used[0] + self._dt_s - 1e-6:
                heard = time.perf_counter()
                continue
            fresh = self._scan is not None and self._scan[0] >= self._pose[0] - 1e-6
            if self._lidar is None or fresh or time.perf_counter() - heard > WAIT_S:
                return self._take(self._used, self._pose)
        return None

    def _take(self, before: tuple[float, Pose2], now: tuple[float, Pose2]) -> Readings:
        said: dict[str, Reading] = {self._odometry: _increment(before[1], now[1])}
        if self._lidar is not None and self._scan is not None:
            name, sheet = self._lidar
            said[name] = LidarScan(_ranges(self._scan[1], sheet))
            # Each is used once, whatever its clock says: one far ahead is no fault of those that follow.
            self._scan = None
        self._used = now
        return Readings(now[0] - self._began_s, said)


def drive(mission: Mission, duration_s: float | None = None) -> dict[str, Any]:
    """Run a mission's stack against live topics until it says that it is done.

    It hears ``/odom`` and ``/scan`` and speaks ``/cmd_vel``; other sensors of the mission stay silent. The
    robot has to stand at the mission's start, within what ``stack.initial`` says. Nobody knows the truth
    here: the answer is what the robot believes.

    Parameters
    ----------
    duration_s
        Of the robot's clock; None: the mission's time limit.

    Raises
    ------
    InputError
        Where ROS 2 is not installed, or the mission has several robots or no wheel odometry.
    """
    if mission.robots:
        raise InputError(f"drive: expected a mission with one robot, found {len(mission.robots)}")
    member = build(mission).team[0]
    sensors, stack = member.known.sensors, member.stack
    wheels = [name for name, sheet in sensors.items() if isinstance(sheet, WheelOdometryConfig)]
    if not wheels:
        raise InputError("drive: expected a robot with wheel-odometry, found none in the mission")
    lasers = [(name, sheet) for name, sheet in sensors.items() if isinstance(sheet, LidarConfig)]
    limit_s = mission.run.time_limit_s if duration_s is None else duration_s
    steps, t_s, reason = 0, 0.0, ""
    with ros_node("pilotage_drive") as node:
        node.publishes("/cmd_vel", ros.TWIST)
        source = LiveReadings(node, lasers[0] if lasers else None, wheels[0], mission.run.dt_s)
        try:
            while stack.status[0] is StackStatus.RUNNING and t_s < limit_s:
                readings = source.next()
                if readings is None:
                    reason = f"nothing is heard of /odom any more (for {SILENT_S:g} s)"
                    break
                command = stack.step(readings)
                if not isinstance(command, Twist):
                    raise InputError("drive: expected a motion that follows twists, found wheel speeds")
                node.publish("/cmd_vel", ros.twist(command.v_m_s, command.w_rad_s, command.lateral_m_s))
                steps, t_s = steps + 1, readings.t_s
        finally:
            node.publish("/cmd_vel", ros.twist(STOP.v_m_s, STOP.w_rad_s))
            node.spin_until(time.perf_counter() + FLUSH_S)
        status, why = stack.status
        if status is StackStatus.RUNNING and not reason:
            reason = f"time limit of {limit_s:g} s reached"
        pose = stack.belief.pose
        return {
            "mission": mission.mission,
            "success": status is StackStatus.ARRIVED,
            "reason": reason or why,
            "steps": steps,
            "duration_s": t_s,
            "sent": node.sent,
            "received": node.received,
            "refused": source.refused,
            "believed": {"x_m": pose.x_m, "y_m": pose.y_m, "theta_rad": pose.theta_rad},
        }


def _seconds(message: Any) -> float:
    return float(message.header.stamp.sec + 1e-9 * message.header.stamp.nanosec)


def _increment(before: Pose2, now: Pose2) -> OdometryIncrement:
    """The arc, and what was driven sideways besides, from one pose of the odometry to the next."""
    step = before.inverse().compose(now)
    half = 0.5 * wrap_to_pi(step.theta_rad)
    share = math.sin(half) / half if abs(half) > 1e-9 else 1.0
    c, s = math.cos(half) / share, math.sin(half) / share
    return OdometryIncrement(c * step.x_m + s * step.y_m, 2.0 * half, c * step.y_m - s * step.x_m)


def _ranges(message: Any, sheet: LidarConfig) -> FloatArray:
    """The message's ranges along the data sheet's beams, each from the nearest of its own, after REP 117.

    Minus infinity, and less than the least range, is something too near to be measured, and reads as the
    least range. Infinity and more than the greatest is nothing within reach, as far as the scanner's own
    reach says so for the data sheet's. NaN, and the zero that many drivers write for it, is no measurement,
    as are directions that no beam looks to: the ground there is not known to be free.
    """
    told = quiet(np.asarray(message.ranges)).astype(np.float64)
    least = max(message.range_min, 0.0)
    farthest = message.range_max if message.range_max > least else np.inf  # some drivers leave it at zero
    too_near = np.isneginf(told) | ((told > 0.0) & (told < least))
    nothing = np.inf if farthest >= sheet.sure_range_m else np.nan
    ranges = np.where(
        too_near, least, np.where(told > farthest, nothing, np.where(told == 0.0, np.nan, told))
    )
    return sheet.along_own_beams(ranges, message.angle_min, message.angle_increment)
