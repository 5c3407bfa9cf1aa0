"""The task of reaching a goal, or several in order."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import ClassVar, Literal

import numpy as np

from pilotage.core.angles import wrap_to_pi
from pilotage.core.config import Config
from pilotage.core.errors import InputError
from pilotage.core.types import FloatArray, Pose2
from pilotage.evaluation.cell_plans import route_metrics, route_of
from pilotage.evaluation.driving import driving_metrics, header, planning_metrics, poses, shortest_for
from pilotage.evaluation.finished import FinishedRun, RobotRun, Verdict
from pilotage.evaluation.halls import hall_offset_m
from pilotage.evaluation.least_time import least_drive_metrics
from pilotage.evaluation.rounds import rounds_metrics, visited_steps
from pilotage.evaluation.tasks.task import TASKS, Attempt, TaskSetting
from pilotage.evaluation.tasks.watched import WatchedTask
from pilotage.evaluation.terrain import terrain_columns, terrain_metrics, why_on_hazard
from pilotage.missions.places import GoalConfig


class ReachConfig(Config):
    """Further goals after ``world.goal``, to be reached in this order or in the best one.

    In the best order the robot begins with any of ``goals`` and ends at ``world.goal``, if there is one: at
    its start, where it is to come back. The order is the robot's own, by its map (``stack.planning.rounds``).
    """

    goals: tuple[GoalConfig, ...] = ()
    order: Literal["given", "best"] = "given"
    ends_there: bool = False
    """Over as soon as every robot truly is at its last goal, as a referee sees it; else when they say so."""


THERE = "the goal is reached"


@TASKS.add("reach", ReachConfig)
class ReachTask(WatchedTask):
    """Done when every robot says that it has arrived; a success if it truly has, and nothing was touched."""

    gives_places: ClassVar[bool] = True

    def __init__(self, config: ReachConfig, setting: TaskSetting) -> None:
        mission = setting.mission
        for robot in mission.members:
            if mission.goal_of(robot) is None and not config.goals:
                raise InputError(
                    "task 'reach': expected world.goal, found none; give one, or have it drawn "
                    "(world.random_goal: {})"
                )
        if config.order == "best" and config.ends_there:
            raise InputError(
                "task.ends_there: expected task.order 'given', found 'best', in which robots choose the last"
            )
        super().__init__(config.goals)
        self.any_order = config.order == "best"
        self._ends_there = config.ends_there
        self._last = [
            config.goals[-1] if config.goals else mission.goal_of(robot) for robot in mission.members
        ]

    def step(self, t_s: float, attempts: Sequence[Attempt]) -> str | None:
        """Over at the first collision, when nobody is under way any more, or where all are there."""
        over = super().step(t_s, attempts)
        if (
            not over
            and self._ends_there
            and all(
                goal is not None and _is_there(goal, attempt.body.pose)
                for goal, attempt in zip(self._last, attempts, strict=True)
            )
        ):
            return THERE
        return over

    def judge_robot(self, run: FinishedRun, robot: RobotRun) -> Verdict:
        """Position errors, consistency, path quality, clearance, and whether the goal was reached."""
        shortest = shortest_for(run, robot)
        route = route_of(robot)
        metrics = header(run, robot)
        metrics |= (
            planning_metrics(run, robot, shortest) if route is None else route_metrics(run, robot, route)
        )
        driven, nees = driving_metrics(run, robot)
        metrics |= least_drive_metrics(run, robot)
        extras = {} if shortest is None else {f"{robot.name}/shortest_path": shortest.points_xy_m}
        metrics |= driven
        columns = {"nees": nees}
        if run.chart.open_ground and robot.trace["t_s"].shape[0]:
            columns |= terrain_columns(run, robot)
            metrics |= terrain_metrics(run, robot, columns)
        if robot.trace["t_s"].shape[0]:
            metrics |= self._arrival(run, robot, metrics)
        return Verdict(metrics, (columns,), extras)

    def _arrival(self, run: FinishedRun, robot: RobotRun, so_far: Mapping[str, object]) -> dict[str, object]:
        """Where it stands at the end, and whether that is where it should."""
        metrics: dict[str, object] = {}
        truth = poses(robot.trace, "true")
        if not run.chart.open_ground:
            metrics["hall_offset_m"] = hall_offset_m(truth, run.chart.walls)
        if run.trap_pockets_m:
            entered = sum(_comes_into(truth, pocket) for pocket in run.trap_pockets_m)
            metrics |= {"traps_entered": entered, "traps_avoided": len(run.trap_pockets_m) - entered}
        last = robot.goals[-1]
        away_m = math.hypot(truth[-1, 0] - last.x_m, truth[-1, 1] - last.y_m)
        metrics["goal_error_m"] = away_m
        reached, off = away_m <= last.tolerance_m, f"{away_m:.2f} m from its goal"
        if last.theta_rad is not None:
            turned = wrap_to_pi(truth[-1, 2] - last.theta_rad)
            metrics["goal_error_rad"] = turned
            if reached and abs(turned) > last.tolerance_rad:
                reached, off = False, f"{math.degrees(abs(turned)):.0f} degrees off its goal's heading"
        missed: GoalConfig | None = None
        if len(robot.goals) > 1:
            metrics |= rounds_metrics(robot)
            visited = len(visited_steps(robot))
            missed = robot.goals[visited] if visited < len(robot.goals) else None
        contacts = so_far.get("hazard_contacts", 0)
        done = robot.arrived or (self._ends_there and run.ending == THERE)
        metrics["success"] = done and robot.collisions == 0 and reached and missed is None and not contacts
        if robot.arrived and not reached:
            metrics["reason"] = f"the robot says it arrived, but stands {off}"
        elif robot.arrived and missed is not None:
            metrics["reason"] = (
                f"the robot says it arrived, but came not within {missed.tolerance_m:g} m of "
                f"({missed.x_m:g}, {missed.y_m:g})"
            )
        elif contacts:
            metrics["reason"] = why_on_hazard(robot, run.chart)
        return metrics


def _is_there(goal: GoalConfig, pose: Pose2) -> bool:
    """Whether a true pose is at a goal."""
    turned = 0.0 if goal.theta_rad is None else abs(wrap_to_pi(pose.theta_rad - goal.theta_rad))
    return (
        math.hypot(pose.x_m - goal.x_m, pose.y_m - goal.y_m) <= goal.tolerance_m
        and turned <= goal.tolerance_rad
    )


def _comes_into(truth: FloatArray, pocket: FloatArray) -> bool:
    """Whether any of (N, 3) true poses lies in a convex outline (K, 2)."""
    sides = np.roll(pocket, -1, axis=0) - pocket
    away = truth[:, None, :2] - pocket
    turns = sides[:, 0] * away[:, :, 1] - sides[:, 1] * away[:, :, 0]
    return bool(((turns >= 0.0).all(axis=1) | (turns <= 0.0).all(axis=1)).any())
