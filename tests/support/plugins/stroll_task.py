"""A plugin: a task that is done after some metres, whatever the robot thinks of it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import ClassVar

from pilotage.core.config import Config
from pilotage.core.types import Event
from pilotage.evaluation.driving import driving_metrics, header
from pilotage.evaluation.finished import FinishedRun, Verdict
from pilotage.evaluation.tasks.task import TASKS, Attempt, TaskSetting
from pilotage.evaluation.tasks.team import verdict
from pilotage.missions.places import GoalConfig
from pilotage.sensors.sensor import Positive


class StrollConfig(Config):
    """How far."""

    distance_m: Positive = 2.0


@TASKS.add("stroll", StrollConfig)
class StrollTask:
    """Done when every robot has come so far; a success then."""

    columns: Mapping[str, str]
    goals: tuple[GoalConfig, ...]
    drives: ClassVar[bool] = True

    def __init__(self, config: StrollConfig, setting: TaskSetting) -> None:
        self._wanted_m = config.distance_m
        self._driven = [0.0] * len(setting.footprints)
        self.columns, self.goals = {"strolled_m": "m"}, ()
        self.events: list[Event] = []

    def step(self, t_s: float, attempts: Sequence[Attempt]) -> str | None:
        """Look how far everybody is."""
        self._driven = [attempt.body.driven_m for attempt in attempts]
        if min(self._driven) < self._wanted_m:
            return None
        self.events.append(Event(t_s, "strolled", f"{min(self._driven):.2f} m"))
        return ""

    def row(self, index: int) -> tuple[float, ...]:
        """How far this one is."""
        return (self._driven[index],)

    def progress(self, attempts: Sequence[Attempt]) -> tuple[tuple[str, str], ...]:
        """How far the last one is."""
        del attempts
        return (("strolled", f"{min(self._driven):.1f} m"),)

    def judge(self, run: FinishedRun) -> Verdict:
        """Success where all came so far."""
        each = []
        for robot in run.robots:
            driven, nees = driving_metrics(run, robot)
            done = robot.driven_m >= self._wanted_m
            metrics = header(run, robot) | driven | {"success": done, "reason": "strolled" if done else "no"}
            each.append(Verdict(metrics, ({"nees": nees},), {}))
        return verdict(each, run)
