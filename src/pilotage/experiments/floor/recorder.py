"""One row a step: truth, belief, command and telemetry, side by side for the first time."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from pilotage.core.types import Event, FloatArray, Twist
from pilotage.evaluation.run_metrics import Outcome
from pilotage.experiments.floor.build import Experiment
from pilotage.experiments.floor.sightings import Sightings
from pilotage.experiments.floor.update_album import UpdateAlbum
from pilotage.missions.floor import FloorMission
from pilotage.sensors.readings import OdometryIncrement, Readings, UltrasonicReading
from pilotage.sensors.ultrasonic import UltrasonicConfig
from pilotage.sensors.wheel_odometry import WheelOdometryConfig
from pilotage.sim.simulator import Simulator
from pilotage.stack.interface import Stack
from pilotage.stack.journal import Journal

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
ODOMETRY_COLUMNS = ("odom_distance_m", "odom_angle_rad")
"""The wheel odometry's reading of the step; nan where there was none."""
MOTION_COLUMNS = ("v_cmd_m_s", "w_cmd_rad_s", "v_true_m_s", "w_true_rad_s", "clearance_m", "collisions")


@dataclass(frozen=True, slots=True)
class RunRecord:
    """A finished run in memory: its objects, its trace (columns by name), its end and its events."""

    experiment: Experiment
    trace: dict[str, FloatArray]
    outcome: Outcome
    events: list[Event]
    album: UpdateAlbum
    sightings: Sightings

    @property
    def mission(self) -> FloorMission:
        """The mission with its random places drawn."""
        return self.experiment.mission


class Recorder:
    """Collects rows as plain numbers; columns are made once at the end."""

    def __init__(
        self, simulator: Simulator, stack: Stack, journal: Journal, sensors: dict[str, object]
    ) -> None:
        self._simulator = simulator
        self._stack, self._journal = stack, journal
        self._sonars = [name for name, config in sensors.items() if isinstance(config, UltrasonicConfig)]
        wheels = [name for name, config in sensors.items() if isinstance(config, WheelOdometryConfig)]
        self._wheels = wheels[0] if wheels else None
        self._telemetry_columns = tuple(journal.units)
        self._rows: list[tuple[float, ...]] = []
        self.events: list[Event] = list(journal.events)
        self._heard = len(journal.events)
        self.album = UpdateAlbum()
        self.sightings = Sightings(sensors)

    def __len__(self) -> int:
        return len(self._rows)

    def record(self, readings: Readings, command: Twist) -> None:
        """Record the step that has just been taken."""
        body, belief = self._simulator.body, self._stack.belief
        truth, pose, cov = body.pose, belief.pose, belief.cov
        self._rows.append(
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
                command.v_m_s,
                command.w_rad_s,
                body.twist.v_m_s,
                body.twist.w_rad_s,
                body.clearance_m,
                body.collisions,
                *_odometry(readings, self._wheels),
                *[_sonar_m(readings, name) for name in self._sonars],
                *self._journal.row,
            )
        )
        self.sightings.record(readings)
        if len(self._journal.events) > self._heard:
            self.events += self._journal.events[self._heard :]
            self._heard = len(self._journal.events)
        update, self._journal.update = self._journal.update, None
        if update is not None:
            self.album.offer(readings.t_s, update)

    def note(self, kind: str, text: str) -> None:
        """Record an event that the stack cannot know of."""
        self.events.append(Event(self._simulator.t_s, kind, text))

    def trace(self) -> dict[str, FloatArray]:
        """Columns by name, each (steps,)."""
        names = (
            *TRUTH_COLUMNS,
            *BELIEF_COLUMNS,
            *MOTION_COLUMNS,
            *ODOMETRY_COLUMNS,
            *(f"us_{name}_m" for name in self._sonars),
            *self._telemetry_columns,
        )
        table = np.array(self._rows, dtype=np.float64).reshape(-1, len(names))
        return {name: np.ascontiguousarray(table[:, i]) for i, name in enumerate(names)}


def _odometry(readings: Readings, name: str | None) -> tuple[float, float]:
    """Distance and angle of the odometry increment; nan where there is none."""
    reading = None if name is None else readings.by_sensor.get(name)
    if isinstance(reading, OdometryIncrement):
        return reading.distance_m, reading.angle_rad
    return math.nan, math.nan


def _sonar_m(readings: Readings, name: str) -> float:
    """An ultrasonic distance; nan where there is none or it is saturated."""
    reading = readings.by_sensor.get(name)
    if isinstance(reading, UltrasonicReading) and not reading.saturated:
        return reading.range_m
    return math.nan
