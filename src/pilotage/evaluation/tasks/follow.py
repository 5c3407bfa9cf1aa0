"""The task of following a route: every point of it in order, and how far from its lines the robot was."""

from __future__ import annotations

import math
from typing import ClassVar

import numpy as np
from pydantic import Field

from pilotage.core.config import MapConfig
from pilotage.core.errors import InputError
from pilotage.core.types import FloatArray
from pilotage.evaluation.driving import driving_metrics, header, poses
from pilotage.evaluation.finished import FinishedRun, RobotRun, Verdict
from pilotage.evaluation.tasks.task import TASKS, TaskSetting
from pilotage.evaluation.tasks.watched import WatchedTask
from pilotage.evaluation.visits import visited_in_order
from pilotage.missions.places import GoalConfig, Point
from pilotage.sensors.sensor import Positive


class FollowConfig(MapConfig):
    """The route's corners after the start, to be passed in this order within the tolerance."""

    points_m: tuple[Point, ...] = Field(min_length=1)
    tolerance_m: Positive = 0.3


@TASKS.add("follow", FollowConfig)
class FollowTask(WatchedTask):
    """Done when every robot says that it is at the route's end; a success if it truly passed every point.

    The points are the robot's goals, one after the other; how it drives between them is its stack's affair,
    and its distance from the straight lines between them is told.
    """

    gives_places: ClassVar[bool] = True

    def __init__(self, config: FollowConfig, setting: TaskSetting) -> None:
        for x, y in config.points_m:
            if not setting.chart.contains(x, y):
                raise InputError(
                    f"task 'follow': expected points on the map '{setting.chart.name}', found ({x:g}, {y:g})"
                )
        if any(setting.mission.goal_of(robot) is not None for robot in setting.mission.members):
            raise InputError(
                "task 'follow': expected no world.goal, since the route's last point is the goal, found one; "
                "take it off with world.goal: null"
            )
        super().__init__(
            tuple(GoalConfig(x_m=x, y_m=y, tolerance_m=config.tolerance_m) for x, y in config.points_m)
        )
        self._points_m, self._tolerance_m = np.array(config.points_m), config.tolerance_m

    def judge_robot(self, run: FinishedRun, robot: RobotRun) -> Verdict:
        """Errors, consistency and clearance; points passed, distance from the route's lines."""
        metrics = header(run, robot)
        driven, nees = driving_metrics(run, robot)
        metrics |= driven
        passed = 0
        if robot.trace["t_s"].shape[0]:
            truth_xy_m = poses(robot.trace, "true")[:, :2]
            tolerances_m = [self._tolerance_m] * len(self._points_m)
            passed = len(visited_in_order(truth_xy_m, self._points_m, tolerances_m))
            corners = np.vstack([[robot.start.x_m, robot.start.y_m], self._points_m])
            away_m = _cross_track_m(truth_xy_m, corners)
            metrics["route_error_rmse_m"] = math.sqrt(float(np.mean(away_m**2)))
            metrics["route_error_max_m"] = float(away_m.max())
        metrics["route_points_passed"] = passed
        missed = len(self._points_m) - passed
        metrics["success"] = robot.arrived and robot.collisions == 0 and not missed
        if robot.arrived and missed:
            x, y = self._points_m[passed]
            metrics["reason"] = (
                f"the robot says it arrived, but came not within {self._tolerance_m:g} m of ({x:g}, {y:g})"
            )
        return Verdict(metrics, ({"nees": nees},), {})


def _cross_track_m(xy_m: FloatArray, corners_m: FloatArray) -> FloatArray:
    """(N,) distance of positions (N, 2) from the polyline through the corners (C, 2)."""
    along = np.diff(corners_m, axis=0)
    length2 = np.maximum((along**2).sum(axis=1), 1e-12)
    from_begin = xy_m[:, None, :] - corners_m[None, :-1, :]
    share = np.clip((from_begin * along).sum(axis=2) / length2, 0.0, 1.0)
    away = from_begin - share[:, :, None] * along
    return np.asarray(np.sqrt((away**2).sum(axis=2)).min(axis=1), dtype=np.float64)
