"""The task of planning alone: nobody drives."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import ClassVar

from pilotage.core.config import Config
from pilotage.core.errors import InputError
from pilotage.core.types import Event, FloatArray
from pilotage.evaluation.cell_plans import route_columns, route_metrics, route_of
from pilotage.evaluation.driving import header, planning_metrics, shortest_for
from pilotage.evaluation.finished import FinishedRun, RobotRun, Verdict
from pilotage.evaluation.tasks.task import TASKS, Attempt, TaskSetting
from pilotage.evaluation.tasks.team import verdict
from pilotage.missions.places import GoalConfig


class PlanConfig(Config):
    """Nothing to say: world, robot and planner say it all."""


@TASKS.add("plan", PlanConfig)
class PlanTask:
    """Done before the first step; a success if there is a plan."""

    columns: Mapping[str, str]
    goals: tuple[GoalConfig, ...]
    drives: ClassVar[bool] = False

    def __init__(self, config: PlanConfig, setting: TaskSetting) -> None:
        del config
        mission = setting.mission
        if any(mission.goal_of(robot) is None for robot in mission.members):
            raise InputError("task 'plan': expected world.goal, found none")
        self.columns, self.goals = {}, ()
        self.events: list[Event] = []

    def step(self, t_s: float, attempts: Sequence[Attempt]) -> str | None:  # noqa: ARG002
        """There is nothing to wait for."""
        return ""

    def row(self, index: int) -> tuple[float, ...]:  # noqa: ARG002
        """Nothing."""
        return ()

    def progress(self, attempts: Sequence[Attempt]) -> tuple[tuple[str, str], ...]:  # noqa: ARG002
        """Nothing."""
        return ()

    def judge(self, run: FinishedRun) -> Verdict:
        """Length, quality and times of the plan."""
        return verdict([self._judged(run, robot) for robot in run.robots], run)

    def _judged(self, run: FinishedRun, robot: RobotRun) -> Verdict:
        shortest = shortest_for(run, robot)
        extras = {} if shortest is None else {f"{robot.name}/shortest_path": shortest.points_xy_m}
        metrics = header(run, robot)
        route = route_of(robot)
        columns: dict[str, FloatArray] = {}
        if route is None:
            metrics |= planning_metrics(run, robot, shortest)
        else:
            metrics |= route_metrics(run, robot, route)
            columns = route_columns(run, robot, route)
        metrics["success"] = robot.arrived
        return Verdict(metrics, (columns,), extras)
