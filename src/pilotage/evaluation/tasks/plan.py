"""The task of planning alone: nobody drives."""

from __future__ import annotations

from collections.abc import Sequence

from pilotage.core.config import Config
from pilotage.core.errors import InputError
from pilotage.core.types import FloatArray
from pilotage.evaluation.cell_plans import route_columns, route_metrics, route_of
from pilotage.evaluation.driving import header, planning_metrics, shortest_for
from pilotage.evaluation.finished import FinishedRun, RobotRun, Verdict
from pilotage.evaluation.tasks.task import TASKS, Attempt, TaskSetting
from pilotage.evaluation.tasks.watched import WatchedTask

OF_A_DRIVE = frozenset({"duration_s", "steps", "steps_per_s"})
"""Of a run's first numbers, those that one without a step has not."""


class PlanConfig(Config):
    """Nothing to say: world, robot and planner say it all."""


@TASKS.add("plan", PlanConfig)
class PlanTask(WatchedTask):
    """Done before the first step; a success if there is a plan."""

    drives = False

    def __init__(self, config: PlanConfig, setting: TaskSetting) -> None:
        del config
        mission = setting.mission
        if any(mission.goal_of(robot) is None for robot in mission.members):
            raise InputError("task 'plan': expected world.goal, found none")
        super().__init__()

    def step(self, t_s: float, attempts: Sequence[Attempt]) -> str | None:  # noqa: ARG002
        """There is nothing to wait for."""
        return ""

    def judge_robot(self, run: FinishedRun, robot: RobotRun) -> Verdict:
        """Length, quality and times of the plan."""
        shortest = shortest_for(run, robot)
        extras = {} if shortest is None else {f"{robot.name}/shortest_path": shortest.points_xy_m}
        metrics = {key: value for key, value in header(run, robot).items() if key not in OF_A_DRIVE}
        route = route_of(robot)
        columns: dict[str, FloatArray] = {}
        if route is None:
            metrics |= planning_metrics(run, robot, shortest)
        else:
            metrics |= route_metrics(run, robot, route)
            columns = route_columns(run, robot, route)
        metrics["success"] = robot.arrived
        return Verdict(metrics, (columns,), extras)
