"""The task of carrying out a command to its end, as calibration runs need it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import ClassVar

from pilotage.core.config import Config
from pilotage.core.types import Event
from pilotage.evaluation.driving import driving_metrics, header
from pilotage.evaluation.finished import FinishedRun, RobotRun, Verdict
from pilotage.evaluation.tasks.collisions import CollisionWatch
from pilotage.evaluation.tasks.task import TASKS, Attempt, TaskSetting, all_ended
from pilotage.evaluation.tasks.team import verdict
from pilotage.missions.places import GoalConfig


class DriveConfig(Config):
    """Nothing to say: the navigator says what is driven."""


@TASKS.add("drive", DriveConfig)
class DriveTask:
    """Done when every robot has carried out what it was told; a success if nothing was touched."""

    columns: Mapping[str, str]
    goals: tuple[GoalConfig, ...]
    drives: ClassVar[bool] = True

    def __init__(self, config: DriveConfig, setting: TaskSetting) -> None:
        del config, setting
        self.columns, self.goals = {}, ()
        self.events: list[Event] = []
        self._watch = CollisionWatch(self.events)

    def step(self, t_s: float, attempts: Sequence[Attempt]) -> str | None:
        """Over at the first collision, or when nobody is under way any more."""
        collision = self._watch.step(t_s, attempts)
        if collision is not None:
            return collision
        return "" if all_ended(attempts) else None

    def row(self, index: int) -> tuple[float, ...]:  # noqa: ARG002
        """Nothing beyond what every trace has."""
        return ()

    def progress(self, attempts: Sequence[Attempt]) -> tuple[tuple[str, str], ...]:  # noqa: ARG002
        """Nothing beyond what every progress line has."""
        return ()

    def judge(self, run: FinishedRun) -> Verdict:
        """Position errors, consistency, clearance."""
        return verdict([self._judged(run, robot) for robot in run.robots], run)

    def _judged(self, run: FinishedRun, robot: RobotRun) -> Verdict:
        metrics = header(run, robot)
        driven, nees = driving_metrics(run, robot)
        metrics |= driven | {"success": robot.arrived and robot.collisions == 0}
        return Verdict(metrics, ({"nees": nees},), {})
