"""The navigator that drives to its goal by what the laser shows: no map, no plan."""

from __future__ import annotations

import math

import numpy as np
from pydantic import Field

from pilotage.core.config import Config
from pilotage.core.errors import InputError
from pilotage.core.types import STOP, FloatArray, Pose2, Twist
from pilotage.kernels.geometry.motion import exact_arc
from pilotage.maps.world_map import WorldMap
from pilotage.models.footprint import Footprint
from pilotage.sensors.lidar import LidarConfig
from pilotage.sensors.readings import LidarScan, OdometryIncrement, Readings
from pilotage.sensors.sensor import NonNegative, Positive
from pilotage.sensors.wheel_odometry import WheelOdometryConfig
from pilotage.stack.control.local.role import LocalLimits, LocalView
from pilotage.stack.interface import NAVIGATORS, Belief, StackStatus
from pilotage.stack.journal import Journal
from pilotage.stack.knowledge import RobotKnowledge, TaskKnowledge
from pilotage.stack.localization.dead_reckoning import DeadReckoningConfig, DeadReckoningLocalizer
from pilotage.stack.localization.localizer import Localizer
from pilotage.stack.navigator.navigator import Parts

DISC_CORNERS = 16
"""Of the polygon around a disc."""


class LocalConfig(Config):
    """What no data sheet says of the robot, and when it is there."""

    reverse_m_s: NonNegative = 0.5
    """Fastest backwards, never above the forward speed; 0 for a robot that does not see behind it."""
    arrival_m: float | None = Field(default=None, gt=0.0)
    """How near it has to believe to be; None: the goal's tolerance."""
    shift_m: Positive = 0.1
    """The goal is placed anew in the odometry's frame where the localizer's correction moves it farther."""


@NAVIGATORS.add("local", LocalConfig)
class LocalNavigator:
    """Hands laser, odometry and goal to the local controller, and its command on.

    The controller sees poses that are integrated from the odometry alone, which drift but do not jump.
    Without a localizer the belief is dead reckoned; with one the goal stays where the localizer has it.
    Between two scans the last command stands. Fails where the robot cannot turn on the spot: the
    controllers reckon with it.
    """

    def __init__(
        self,
        config: LocalConfig,
        robot: RobotKnowledge,
        chart: WorldMap,
        task: TaskKnowledge,
        parts: Parts,
        journal: Journal,
    ) -> None:
        if task.goal is None:
            raise InputError("navigator 'local': expected world.goal, found none")
        if parts.local_controller is None:
            raise InputError("navigator 'local': expected stack.local_controller, found none")
        self._controller, self._journal = parts.local_controller, journal
        self._lidar, self._scanner = robot.one_sensor(LidarConfig, "navigator 'local'")
        self._odometry, _ = robot.one_sensor(WheelOdometryConfig, "navigator 'local'")
        self._localizer: Localizer = parts.localizer or DeadReckoningLocalizer(
            DeadReckoningConfig(), robot, chart, task.initial, journal
        )
        self._limits = limits_of(robot, config)
        self._outline = outline_of(robot.footprint)
        self._angles = self._scanner.beam_angles_rad()
        mount = self._scanner.mount
        self._mount = Pose2(mount.x_m, mount.y_m, mount.theta_rad)
        self._goal_xy_m, self._shift_m = (task.goal.x_m, task.goal.y_m), config.shift_m
        self._tolerance_m = min(config.arrival_m or math.inf, task.goal_tolerance_m)
        # In its own frame of the odometry it begins where it believes to be: the goal is there as on the map.
        self._pose, self._goal_there = task.initial.pose, self._goal_xy_m
        self._twist, self._command, self._moved_s = STOP, STOP, 0.0
        self._status, self._reason, self._word = StackStatus.RUNNING, "", ""
        self._channel = journal.channel({"distance_to_go_m": "m"}, first=True)

    @property
    def belief(self) -> Belief:
        """The localizer's belief."""
        return self._localizer.belief

    @property
    def status(self) -> tuple[StackStatus, str]:
        """Arrived where the controller says so."""
        return self._status, self._reason

    def step(self, readings: Readings) -> Twist:
        """Localize, move the odometry's pose on, and ask the controller where there is a scan."""
        belief = self._localizer.step(readings).pose
        odometry = readings.by_sensor.get(self._odometry)
        if isinstance(odometry, OdometryIncrement):
            self._move(readings.t_s, odometry)
        self._channel.tell(math.hypot(self._goal_xy_m[0] - belief.x_m, self._goal_xy_m[1] - belief.y_m))
        if self._status is not StackStatus.RUNNING:
            return STOP
        scan = readings.by_sensor.get(self._lidar)
        if isinstance(scan, LidarScan):
            self._follow(belief)
            self._command = self._controller.step(self._view(readings.t_s, scan.ranges_m))
            self._tell(readings.t_s)
        return self._command

    def _move(self, t_s: float, odometry: OdometryIncrement) -> None:
        """Integrate an increment, and take the speeds from it."""
        elapsed_s = t_s - self._moved_s
        if elapsed_s > 0.0:
            self._twist = Twist(odometry.distance_m / elapsed_s, odometry.angle_rad / elapsed_s)
        self._moved_s = t_s
        pose = self._pose
        self._pose = Pose2(
            *exact_arc(pose.x_m, pose.y_m, pose.theta_rad, odometry.distance_m, odometry.angle_rad)
        )

    def _follow(self, belief: Pose2) -> None:
        """Place the goal in the odometry's frame as it lies from where the robot believes to be."""
        dx, dy = self._goal_xy_m[0] - belief.x_m, self._goal_xy_m[1] - belief.y_m
        turn = self._pose.theta_rad - belief.theta_rad
        c, s = math.cos(turn), math.sin(turn)
        there = self._pose.x_m + c * dx - s * dy, self._pose.y_m + s * dx + c * dy
        if math.hypot(there[0] - self._goal_there[0], there[1] - self._goal_there[1]) > self._shift_m:
            self._goal_there = there

    def _view(self, t_s: float, ranges_m: FloatArray) -> LocalView:
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
            goal_tolerance_m=self._tolerance_m,
        )

    def _tell(self, t_s: float) -> None:
        word = self._controller.status
        if word == "arrived":
            self._status, self._reason = StackStatus.ARRIVED, f"within {self._tolerance_m:g} m of the goal"
            self._command = STOP
            self._journal.say(t_s, "arrived", self._reason)
        elif word == "closed" and word != self._word:
            self._journal.count("closed")
        self._word = word


def limits_of(robot: RobotKnowledge, config: LocalConfig) -> LocalLimits:
    """A controller's limits from a motion's data sheet; what changes at once does so within a step.

    Raises
    ------
    InputError
        Where the robot cannot turn on the spot.
    """
    motion = robot.motion
    if motion.least_turning_radius_m > 0.0:
        raise InputError(
            "navigator 'local': expected a robot that turns on the spot, found a turning radius of "
            f"{motion.least_turning_radius_m:.2f} m; take robot.motion.name: differential-drive"
        )
    speed, rate = motion.top_speed_m_s, motion.top_turn_rate_rad_s
    acceleration = min(motion.braking_m_s2, speed / robot.dt_s)
    return LocalLimits(
        speed_m_s=speed,
        reverse_m_s=min(config.reverse_m_s, speed),
        acceleration_m_s2=acceleration,
        deceleration_m_s2=acceleration,
        turn_rate_rad_s=rate,
        turn_acceleration_rad_s2=min(motion.turn_acceleration_rad_s2, rate / robot.dt_s),
        delay_s=motion.delay_s,
    )


def outline_of(footprint: Footprint) -> FloatArray:
    """(K, 2) corners of the outline; of a disc those of a polygon around it."""
    if not footprint.is_disc:
        return footprint.points_m
    angles = 2.0 * np.pi * np.arange(DISC_CORNERS) / DISC_CORNERS
    radius = footprint.radius_m / math.cos(math.pi / DISC_CORNERS)
    return radius * np.column_stack([np.cos(angles), np.sin(angles)])
