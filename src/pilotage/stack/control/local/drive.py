"""Driving to a point by a local controller, wherever a localizer has it."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from pilotage.core.errors import InputError
from pilotage.core.types import STOP, FloatArray, Pose2, Twist
from pilotage.kernels.geometry.motion import turned_part
from pilotage.models.footprint import Footprint
from pilotage.models.odometry import increment_variances
from pilotage.sensors.lidar import LidarConfig
from pilotage.sensors.readings import LidarScan, OdometryIncrement, Readings
from pilotage.sensors.wheel_odometry import WheelOdometryConfig
from pilotage.stack.control.local.body import dense_m
from pilotage.stack.control.local.role import LocalController, LocalLimits, LocalView
from pilotage.stack.interface import Belief
from pilotage.stack.knowledge import RobotKnowledge

DISC_CORNERS = 16
"""Of the polygon around a disc."""
SURE_WITHIN_M = 1.0
"""From so far on a belief may place a goal that has to be met closely, at every step."""


class LocalDrive:
    """Hands laser, odometry and goal to a local controller; between two scans its last command stands.

    The controller sees poses that are integrated from the odometry alone, which drift but do not jump. The
    goal is placed anew in them where the localizer's correction moves it farther than ``shift_m``; one that
    has to be met more closely at every step once it is near, if the belief is as close, and else where the
    correction is more than half its tolerance. A controller that corrects its own pose by scans may
    go astray: where it says that it is there and the belief, if ``localized``, says otherwise, the goal is
    placed anew.
    """

    def __init__(
        self,
        controller: LocalController,
        robot: RobotKnowledge,
        start: Pose2,
        *,
        reverse_m_s: float,
        shift_m: float = 0.1,
        needed_by: str,
        goal_xy_m: tuple[float, float] = (math.nan, math.nan),
        localized: bool = False,
    ) -> None:
        self._controller, self._shift_m = controller, shift_m
        self._lidar, self._scanner = robot.one_sensor(LidarConfig, needed_by)
        self._odometry, self._wheels = robot.one_sensor(WheelOdometryConfig, needed_by)
        self._limits = in_sight(limits_of(robot, reverse_m_s, needed_by), robot, self._scanner, needed_by)
        self._outline = polygon_around(robot.footprint)
        self._angles = self._scanner.beam_angles_rad()
        mount = self._scanner.mount
        self._mount = mount.pose
        # In its own frame of the odometry it begins where it believes to be: a goal is there as on the map.
        self._pose, self._goal_there = start, goal_xy_m
        self._twist, self._command, self._moved_s = STOP, STOP, 0.0
        self._twist_vars = 0.0, 0.0
        self._ranges_m: FloatArray = np.zeros(0)
        self._localized, self._astray = localized, False

    @property
    def status(self) -> str:
        """What the controller does, in a word."""
        return "astray" if self._astray else self._controller.status

    def move(self, readings: Readings) -> None:
        """Integrate the odometry, and take the speeds from it; to be called at every step."""
        odometry = readings.by_sensor.get(self._odometry)
        if not isinstance(odometry, OdometryIncrement):
            return
        elapsed_s = readings.t_s - self._moved_s
        if elapsed_s > 0.0:
            self._twist = Twist(
                odometry.distance_m / elapsed_s,
                odometry.angle_rad / elapsed_s,
                odometry.lateral_m / elapsed_s,
            )
            distance_var, angle_var = increment_variances(
                odometry.distance_m, odometry.angle_rad, *self._wheels.densities
            )
            self._twist_vars = distance_var / elapsed_s**2, angle_var / elapsed_s**2
        self._moved_s = readings.t_s
        pose = self._pose
        moved = odometry.distance_m, odometry.lateral_m, odometry.angle_rad
        self._pose = Pose2(*turned_part(pose.x_m, pose.y_m, pose.theta_rad, *moved, 1.0))

    def toward(
        self,
        goal_xy_m: tuple[float, float],
        belief: Belief,
        readings: Readings,
        tolerance_m: float,
        people_about: bool = False,
    ) -> Twist:
        """The command to a goal in the map, as the robot believes to stand there."""
        scan = readings.by_sensor.get(self._lidar)
        if isinstance(scan, LidarScan):
            # Farther off the heading's error counts as well.
            away_m = math.hypot(goal_xy_m[0] - belief.pose.x_m, goal_xy_m[1] - belief.pose.y_m)
            near = away_m < SURE_WITHIN_M and tolerance_m < self._shift_m
            sure = self._astray or (near and belief.std_m < 0.5 * tolerance_m)
            off_m = min(self._shift_m, 0.5 * tolerance_m)
            self._place(goal_xy_m, belief.pose, 0.0 if sure else off_m)
            view = self._view(readings.t_s, scan.ranges_m, tolerance_m, people_about, goal_is_sure=sure)
            self._command = self._controller.step(view)
            self._ranges_m = scan.ranges_m
            arrived = self._controller.status == "arrived"
            self._astray = self._localized and arrived and away_m > tolerance_m + off_m
        return self._command

    def rolls_m(self) -> float:
        """How far it still rolls ahead, backwards less than 0, if it is told to stop now."""
        speed, limits = self._twist.v_m_s, self._limits
        return speed * limits.delay_s + math.copysign(speed * speed / (2.0 * limits.deceleration_m_s2), speed)

    def nearest_seen_m(self) -> float:
        """Distance from the axle to the nearest of what the last scan shows; nan without one."""
        if not len(self._ranges_m):
            return math.nan
        angles = self._angles + self._mount.theta_rad
        x_m = self._mount.x_m + self._ranges_m * np.cos(angles)
        y_m = self._mount.y_m + self._ranges_m * np.sin(angles)
        return float(np.fmin.reduce(np.hypot(x_m, y_m)))

    def _place(self, goal_xy_m: tuple[float, float], belief: Pose2, shift_m: float) -> None:
        """Place the goal in the odometry's frame as it lies from where the robot believes to be."""
        dx, dy = goal_xy_m[0] - belief.x_m, goal_xy_m[1] - belief.y_m
        turn = self._pose.theta_rad - belief.theta_rad
        c, s = math.cos(turn), math.sin(turn)
        there = self._pose.x_m + c * dx - s * dy, self._pose.y_m + s * dx + c * dy
        moved_m = math.hypot(there[0] - self._goal_there[0], there[1] - self._goal_there[1])
        if not moved_m <= shift_m:
            self._goal_there = there

    def _view(
        self,
        t_s: float,
        ranges_m: FloatArray,
        tolerance_m: float,
        people_about: bool,
        *,
        goal_is_sure: bool,
    ) -> LocalView:
        return LocalView(
            t_s=t_s,
            pose=self._pose,
            twist=self._twist,
            ranges_m=ranges_m,
            beam_angles_rad=self._angles,
            mount=self._mount,
            max_range_m=self._scanner.max_range_m,
            goal_xy_m=self._goal_there,
            limits=self._limits,
            footprint_xy_m=self._outline,
            goal_tolerance_m=tolerance_m,
            people_about=people_about,
            goal_is_sure=goal_is_sure,
            speed_var_m2_s2=self._twist_vars[0],
            turn_rate_var_rad2_s2=self._twist_vars[1],
        )


def limits_of(robot: RobotKnowledge, reverse_m_s: float, needed_by: str) -> LocalLimits:
    """A controller's limits from a motion's data sheet; what changes at once does so within a step.

    Raises
    ------
    InputError
        Where the robot cannot turn on the spot.
    """
    motion = robot.motion
    if motion.least_turning_radius_m > 0.0:
        raise InputError(
            f"{needed_by}: expected a robot that turns on the spot, found a turning radius of "
            f"{motion.least_turning_radius_m:.2f} m; take robot.motion.name: differential-drive"
        )
    speed, rate = motion.top_speed_m_s, motion.top_turn_rate_rad_s
    acceleration = min(motion.braking_m_s2, speed / robot.dt_s)
    return LocalLimits(
        speed_m_s=speed,
        reverse_m_s=min(reverse_m_s, speed),
        acceleration_m_s2=acceleration,
        deceleration_m_s2=acceleration,
        turn_rate_rad_s=rate,
        turn_acceleration_rad_s2=min(motion.turn_acceleration_rad_s2, rate / robot.dt_s),
        delay_s=motion.delay_s,
    )


def in_sight(limits: LocalLimits, robot: RobotKnowledge, lidar: LidarConfig, needed_by: str) -> LocalLimits:
    """Limits no faster than the robot can stop on the ground that its laser surely shows.

    v r + v^2 / (2 a) <= s, with the time r from a scan until the robot brakes for it, and the way s from the
    body's front to where the laser's reach ends, or something as wide as the robot fits between two beams.

    Raises
    ------
    InputError
        Where the laser shows nothing before the body.
    """
    corners_m, mount = robot.footprint.points_m, lidar.mount
    front_m = float(corners_m[:, 0].max()) if len(corners_m) else robot.radius_m
    shown_m = mount.x_m + min(lidar.max_range_m, dense_m(robot.footprint.inner_radius_m, lidar.beam_step_rad))
    if shown_m <= front_m:
        raise InputError(
            f"{needed_by}: expected a laser that shows the ground before the body, {front_m:.2f} m ahead of "
            f"the axle, found one that does up to {shown_m:.2f} m, by a reach of {lidar.max_range_m:g} m and "
            f"{lidar.beams} beams {lidar.beam_step_rad:.2g} rad apart; take more of them, or a longer reach"
        )
    braking, reacts_s = limits.deceleration_m_s2, max(robot.dt_s, 1.0 / lidar.rate_hz) + limits.delay_s
    fastest = braking * (math.sqrt(reacts_s**2 + 2.0 * (shown_m - front_m) / braking) - reacts_s)
    return replace(limits, speed_m_s=min(limits.speed_m_s, fastest))


def polygon_around(footprint: Footprint) -> FloatArray:
    """(K, 2) corners of the outline; of a disc those of a polygon around it."""
    if not footprint.is_disc:
        return footprint.points_m
    angles = 2.0 * np.pi * np.arange(DISC_CORNERS) / DISC_CORNERS
    radius = footprint.radius_m / math.cos(math.pi / DISC_CORNERS)
    return radius * np.column_stack([np.cos(angles), np.sin(angles)])
