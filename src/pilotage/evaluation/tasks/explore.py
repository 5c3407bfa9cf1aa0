"""The task of exploring: a sheet cell by cell, or a floor that is seen from afar."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import ClassVar

from pydantic import Field

from pilotage.core.config import Config
from pilotage.core.errors import InputError
from pilotage.core.types import Event
from pilotage.evaluation.driving import driving_metrics, header, poses
from pilotage.evaluation.finished import FinishedRun, RobotRun, Verdict
from pilotage.evaluation.floor_map import floor_map_metrics
from pilotage.evaluation.tasks.sheet_exploration import SheetExploration
from pilotage.evaluation.tasks.task import TASKS, Attempt, TaskSetting
from pilotage.evaluation.tasks.watched import WatchedTask
from pilotage.maps.occupancy_grid import OccupancyGrid
from pilotage.missions.places import GoalConfig


class FloorExploration(WatchedTask):
    """Looks at robots that explore a floor.

    Over at the first collision, or when nobody explores any more; a success where the robot says that it is
    done, stands where it began, and has enough of what can be reached on its map.
    """

    WANTS: ClassVar[frozenset[str]] = frozenset({"grid"})

    def __init__(self, least_mapped: float, return_m: float, spare_m: float, setting: TaskSetting) -> None:
        walls = setting.chart.walls
        if setting.chart.open_ground or not (len(walls.segments_m) or len(walls.circles_m)):
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


class ExploreConfig(Config):
    """When a robot is taken off a sheet, and what a floor's exploration must come to."""

    blocked_s: float = Field(default=5.0, gt=0.0)
    """On a sheet a robot that something holds for so long is blocked."""
    least_mapped: float = Field(default=0.9, ge=0.0, le=1.0)
    """Share of a floor that must be on the map,"""
    return_m: float = Field(default=0.1, gt=0.0)
    """and how near to its start the robot must be in the end."""
    spare_m: float = Field(default=0.04, ge=0.0)
    """Floor counts that the robot reaches with so much to spare all around its body."""


@TASKS.add("explore", ExploreConfig)
class ExploreTask:
    """Done when the robot says so; a success if it did and touched nothing.

    On a sheet leaving it fails, and the cells that it visited count. On a floor the map counts, and the
    robot must be back where it began.
    """

    columns: Mapping[str, str]
    goals: tuple[GoalConfig, ...]
    drives: ClassVar[bool] = True

    def __init__(self, config: ExploreConfig, setting: TaskSetting) -> None:
        markings = setting.chart.markings
        self._ground: SheetExploration | FloorExploration
        if markings is not None and markings.source is not None:
            self._ground = SheetExploration(config.blocked_s, markings, setting)
        else:
            self._ground = FloorExploration(config.least_mapped, config.return_m, config.spare_m, setting)
        self.columns, self.goals = self._ground.columns, ()
        self.wants: frozenset[str] = self._ground.WANTS
        self.events: list[Event] = self._ground.events

    def step(self, t_s: float, attempts: Sequence[Attempt]) -> str | None:
        """Over when nobody explores any more, or something went wrong."""
        return self._ground.step(t_s, attempts)

    def row(self, index: int) -> tuple[float, ...]:
        """The columns of a sheet; a floor has none."""
        return self._ground.row(index)

    def progress(self, attempts: Sequence[Attempt]) -> tuple[tuple[str, str], ...]:
        """How much was visited, or driven."""
        return self._ground.progress(attempts)

    def judge(self, run: FinishedRun) -> Verdict:
        """Outcome, coverage, mapping accuracy, pose errors."""
        return self._ground.judge(run)
