"""One row a step and robot: truth, belief, command and telemetry, side by side for the first time."""

from __future__ import annotations

import math
from array import array
from collections import Counter

import numpy as np

from pilotage.core.errors import InputError
from pilotage.core.types import Command, FloatArray, Twist, WheelSpeeds
from pilotage.evaluation.tasks.task import Task
from pilotage.experiments.build.team import Member
from pilotage.experiments.odometry_since import OdometrySince
from pilotage.models.motion.wheel_drive import WheelDriveConfig
from pilotage.records.trace import ROBOT_COLUMN
from pilotage.sensors.readings import OdometryIncrement, Readings, UltrasonicReading
from pilotage.sensors.ultrasonic import UltrasonicConfig
from pilotage.sensors.wheel_odometry import WheelOdometryConfig
from pilotage.sim.bodies.body import Body

TRUTH_COLUMNS = ("t_s", "true_x_m", "true_y_m", "true_theta_rad")
BELIEF_COLUMNS = (
    "est_x_m",
    "est_y_m",
    "est_theta_rad",
    "cov_xx_m2",
    "cov_xy_m2",
    "cov_yy_m2",
    "cov_xt_m_rad",
    "cov_yt_m_rad",
    "cov_tt_rad2",
)
TWIST_COLUMNS = ("v_cmd_m_s", "w_cmd_rad_s")
WHEEL_COLUMNS = ("left_cmd_rad_s", "right_cmd_rad_s")
BODY_COLUMNS = ("v_true_m_s", "w_true_rad_s", "clearance_m", "collisions")
ODOMETRY_COLUMNS = ("odom_distance_m", "odom_angle_rad")
"""The wheel odometry's readings since the row before; nan where there were none."""
LATERAL_COLUMNS = ("odom_lateral_m",)
"""Of readings that are told as one, of wheels that speed up apart, and of a base that drives sideways."""
SIDEWAYS_COLUMNS = ("lateral_cmd_m_s",)


class Recorder:
    """Collects one robot's rows as plain numbers; columns are made once at the end.

    Where rows are ``thinned`` the steps between two of them are passed over, and a row tells the odometry of
    all of them.

    Raises
    ------
    InputError
        Where the task or a component's telemetry has a column of a name that the trace has already.
    """

    def __init__(self, member: Member, body: Body, task: Task, index: int, thinned: bool) -> None:
        self._stack, self._journal, self._body = member.stack, member.journal, body
        self._task, self._index = task, index
        sensors = member.known.sensors
        self._sonars = [name for name, config in sensors.items() if isinstance(config, UltrasonicConfig)]
        wheels = [name for name, config in sensors.items() if isinstance(config, WheelOdometryConfig)]
        self._odometer = wheels[0] if wheels else None
        self._driven = OdometrySince()
        self._by_wheels = isinstance(member.known.motion, WheelDriveConfig)
        self._sideways = member.known.motion.drives_sideways
        tells_aside = thinned or self._by_wheels  # steps that add up to no arc
        self._lateral = self._sideways or (tells_aside and self._odometer is not None)
        self._rows = array("d")
        self.names = (
            *TRUTH_COLUMNS,
            *BELIEF_COLUMNS,
            *(WHEEL_COLUMNS if self._by_wheels else TWIST_COLUMNS),
            *BODY_COLUMNS,
            *ODOMETRY_COLUMNS,
            *(SIDEWAYS_COLUMNS if self._sideways else ()),
            *(LATERAL_COLUMNS if self._lateral else ()),
            *(f"us_{name}_m" for name in self._sonars),
            *task.columns,
            *member.journal.units,
        )
        twice = [name for name, count in Counter((ROBOT_COLUMN, *self.names)).items() if count > 1]
        if twice:
            raise InputError(
                f"the trace: expected new names of the task's columns and the components' telemetry, found "
                f"'{twice[0]}', which it has already"
            )

    def pass_over(self, readings: Readings) -> None:
        """Take note of a step that gets no row."""
        if self._odometer is not None:
            reading = readings.by_sensor.get(self._odometer)
            if isinstance(reading, OdometryIncrement):
                self._driven.add(reading)

    def record(self, readings: Readings, command: Command) -> None:
        """Record the step that has just been taken."""
        self.pass_over(readings)
        distance_m, angle_rad, lateral_m = self._driven.take()
        body, belief = self._body, self._stack.belief
        truth, pose, cov, twist = body.pose, belief.pose, belief.cov, body.twist
        self._rows.extend(
            (
                readings.t_s,
                truth.x_m,
                truth.y_m,
                truth.theta_rad,
                pose.x_m,
                pose.y_m,
                pose.theta_rad,
                cov[0, 0],
                cov[0, 1],
                cov[1, 1],
                cov[0, 2],
                cov[1, 2],
                cov[2, 2],
                *self._commanded(command),
                twist.v_m_s,
                twist.w_rad_s,
                body.clearance_m,
                body.collisions,
                distance_m,
                angle_rad,
                *(_lateral(command) if self._sideways else ()),
                *((lateral_m,) if self._lateral else ()),
                *[_sonar_m(readings, name) for name in self._sonars],
                *self._task.row(self._index),
            )
        )
        self._rows.extend(self._journal.row)

    def _commanded(self, command: Command) -> tuple[float, float]:
        """The two numbers of a command; nan where it is not of the recorded form."""
        if self._by_wheels:
            if isinstance(command, WheelSpeeds):
                return command.left_rad_s, command.right_rad_s
            return math.nan, math.nan
        if isinstance(command, Twist):
            return command.v_m_s, command.w_rad_s
        return math.nan, math.nan

    def trace(self) -> dict[str, FloatArray]:
        """Columns by name, each (rows,)."""
        table = np.frombuffer(self._rows, dtype=np.float64).reshape(-1, len(self.names))
        return {name: np.ascontiguousarray(table[:, i]) for i, name in enumerate(self.names)}


def _lateral(command: Command) -> tuple[float]:
    """Speed to the left that was asked for."""
    return (command.lateral_m_s if isinstance(command, Twist) else math.nan,)


def _sonar_m(readings: Readings, name: str) -> float:
    """An ultrasonic distance; nan where there is none or it is saturated."""
    reading = readings.by_sensor.get(name)
    if isinstance(reading, UltrasonicReading) and not reading.saturated:
        return reading.range_m
    return math.nan
