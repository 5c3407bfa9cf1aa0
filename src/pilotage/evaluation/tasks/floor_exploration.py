"""Exploring a floor: everything that can be reached on the map, its walls where they are, and back again."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import ClassVar

from pilotage.core.errors import InputError
from pilotage.evaluation.driving import driving_metrics, header, poses
from pilotage.evaluation.finished import FinishedRun, RobotRun, Verdict
from pilotage.evaluation.floor_map import floor_map_metrics
from pilotage.evaluation.tasks.task import Attempt, TaskSetting
from pilotage.evaluation.tasks.watched import WatchedTask
from pilotage.maps.occupancy_grid import OccupancyGrid


class FloorExploration(WatchedTask):
    """Looks at robots that explore a floor.

    Over at the first collision, or when nobody explores any more; a success where the robot says that it is
    done, stands where it began, and has enough of what can be reached on its map.
    """

    WANTS: ClassVar[frozenset[str]] = frozenset({"grid"})

    def __init__(self, least_mapped: float, return_m: float, spare_m: float, setting: TaskSetting) -> None:
        if setting.chart.open_ground or setting.chart.walls.segments_m.shape[0] == 0:
            raise InputError(
                "task 'explore': expected a sheet with cells or a floor with walls as world.map, "
                f"found '{setting.chart.name}'"
            )
        super().__init__()
        self._least_mapped, self._return_m, self._spare_m = least_mapped, return_m, spare_m

    def progress(self, attempts: Sequence[Attempt]) -> tuple[tuple[str, str], ...]:
        """How far the robots drove."""
        return (("driven", f"{sum(attempt.body.driven_m for attempt in attempts):>6.1f} m"),)

    def judge_robot(self, run: FinishedRun, robot: RobotRun) -> Verdict:
        """Outcome, what of the floor is mapped and how well, pose errors."""
        grid = robot.results.get("grid")
        driven, nees = driving_metrics(run, robot)
        metrics = header(run, robot) | driven
        metrics["real_time_factor"] = run.duration_s / run.loop_s
        if isinstance(grid, OccupancyGrid):
            radius_m = robot.footprint.radius_m
            metrics |= floor_map_metrics(grid, run.chart, radius_m, robot.start, self._spare_m)
        mapped = metrics.get("floor_mapped", 0.0)
        truth = poses(robot.trace, "true")
        back_m = math.inf
        if len(truth):
            back_m = math.hypot(truth[-1, 0] - robot.start.x_m, truth[-1, 1] - robot.start.y_m)
            metrics["return_error_m"] = back_m
        assert isinstance(mapped, float)
        done = robot.arrived and not run.ending and robot.collisions == 0
        metrics["success"] = done and back_m <= self._return_m and mapped >= self._least_mapped
        if done and back_m > self._return_m:
            metrics["reason"] = f"the robot says it is back, but stands {back_m:.2f} m from its start"
        elif done and mapped < self._least_mapped:
            metrics["reason"] = f"{mapped:.1%} of the floor that can be reached are on the map"
        return Verdict(metrics, ({"nees": nees},), {})
