"""The report's baseline: random wandering with one front sensor and the line sensors."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from pilotage.core.config import Config
from pilotage.core.types import BoolArray, Event, WheelSpeeds
from pilotage.maps.cell_map import CellMap
from pilotage.sensors.infrared import InfraredConfig
from pilotage.sensors.line_sensor import LineSensorConfig
from pilotage.sensors.readings import InfraredReading, Readings
from pilotage.sensors.sensor import Positive
from pilotage.stack.control.wheel_pursuit import turn, wheel_speeds
from pilotage.stack.exploration.explorer import EXPLORERS, LeftCell
from pilotage.stack.interface import Belief, StackStatus
from pilotage.stack.knowledge import SheetKnowledge
from pilotage.stack.localization.wheel_pose import WheelPose
from pilotage.stack.mapping.cell_marks import CellMarks


class RandomWalkConfig(Config):
    """How near something in front must be, and how far a straight stretch goes at most."""

    trigger_m: Positive = 0.10
    turn_rad: tuple[float, float] = (0.5 * math.pi, 1.5 * math.pi)
    """Turns are drawn from this range; left or right with equal chance."""
    stretch_s: Positive = 6.0
    """Straight stretches last this long on the mean (exponential), unless something comes before."""


@EXPLORERS.add("random-walk", RandomWalkConfig)
class RandomWalk:
    """Drives straight, turns by chance and before what its one front sensor sees; maps as it goes.

    It knows no sheet and no edge: what ends it is a box that the sensor's narrow beam passes by, or the
    edge. One front sensor and both line sensors are used, as in the report.
    """

    def __init__(self, config: RandomWalkConfig, knowledge: SheetKnowledge) -> None:
        self._config = config
        self._drive = knowledge.drive
        self._dt_s = knowledge.dt_s
        infrared = knowledge.sensors_of(InfraredConfig)
        self._front = min(infrared, key=lambda name: abs(infrared[name].mount.theta_rad), default=None)
        used = {self._front, *knowledge.sensors_of(LineSensorConfig)}
        self._used = frozenset(name for name in used if name is not None)
        self._rng = knowledge.streams.stream("explorer")
        self._pose = WheelPose(knowledge)
        self._marks = CellMarks(knowledge)
        self._turn_left_rad = 0.0
        self._stretch_s = 0.0
        self._events: list[Event] = []

    @property
    def belief(self) -> Belief:
        """From the encoders."""
        return self._pose.belief

    @property
    def status(self) -> tuple[StackStatus, str]:
        """It never ends by itself."""
        return StackStatus.RUNNING, ""

    @property
    def cells(self) -> CellMap:
        """What it mapped on its way."""
        return self._marks.cells

    @property
    def visited(self) -> BoolArray:
        """Where it believes to have been."""
        return self._marks.visited

    @property
    def left(self) -> tuple[LeftCell, ...]:
        """It gives nothing up, because it plans nothing."""
        return ()

    def step(self, readings: Readings) -> WheelSpeeds:
        """Drive on, or turn."""
        before = self._pose.belief.pose.theta_rad
        pose = self._pose.step(readings).pose
        seen = Readings(
            readings.t_s, {name: r for name, r in readings.by_sensor.items() if name in self._used}
        )
        if seen.by_sensor:
            self._marks.step(seen, pose)
        if not self._pose.aligned:
            return wheel_speeds(0.0, 0.0, self._drive)
        if self._turn_left_rad != 0.0:
            turned = math.remainder(pose.theta_rad - before, 2.0 * math.pi)
            rest = self._turn_left_rad - turned
            self._turn_left_rad = 0.0 if rest * self._turn_left_rad <= 0.0 else rest
            if self._turn_left_rad != 0.0:
                return turn(math.copysign(1.0, self._turn_left_rad), self._drive)
        self._stretch_s -= self._dt_s
        if self._blocked(seen):
            self._begin_turn()
        elif self._stretch_s <= 0.0:
            self._stretch_s = float(self._rng.exponential(self._config.stretch_s))
            self._begin_turn()
        fastest = self._drive.max_wheel_speed_rad_s * self._drive.wheel_radius_m
        return wheel_speeds(fastest, 0.0, self._drive)

    def telemetry(self) -> Mapping[str, float]:
        """What is left of a turn."""
        return {"turn_left_rad": self._turn_left_rad}

    def drain_events(self) -> list[Event]:
        """Nothing happens that would be worth a word."""
        events, self._events = self._events, []
        return events

    def _blocked(self, readings: Readings) -> bool:
        """Something near in front. Lines are mapped and driven over."""
        if self._front is None:
            return False
        reading = readings.by_sensor.get(self._front)
        near = isinstance(reading, InfraredReading) and not reading.saturated
        return near and isinstance(reading, InfraredReading) and reading.range_m < self._config.trigger_m

    def _begin_turn(self) -> None:
        angle = float(self._rng.uniform(*self._config.turn_rad))
        self._turn_left_rad = float(np.copysign(angle, self._rng.random() - 0.5))
