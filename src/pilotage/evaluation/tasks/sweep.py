"""The cleaning robot's task: all of the floor that it can reach swept, and not much twice."""

from __future__ import annotations

from collections.abc import Sequence
from typing import ClassVar

import numpy as np
from pydantic import Field

from pilotage.core.config import Config
from pilotage.core.errors import InputError
from pilotage.core.types import BoolArray
from pilotage.evaluation.driving import driving_metrics, header
from pilotage.evaluation.finished import FinishedRun, RobotRun, Verdict
from pilotage.evaluation.narrow_passages import cut_off
from pilotage.evaluation.tasks.task import TASKS, Attempt, TaskSetting
from pilotage.evaluation.tasks.watched import WatchedTask
from pilotage.kernels.patrol.swept import mark_swept
from pilotage.maps.floor import Floor, check_pass_width, pass_cell_m, sweepable
from pilotage.missions.choice import ComponentChoice
from pilotage.missions.places import GoalConfig
from pilotage.sensors.sensor import NonNegative, Positive
from pilotage.stack.planning.planner import PLANNERS

BACK_M = 0.5


class SweepConfig(Config):
    """How wide a pass sweeps, and how much of the floor it takes."""

    width_m: Positive | None = None
    """None: as wide as the body."""
    least: float = Field(default=0.9999, gt=0.0, le=1.0)
    """Share of the floor where the robot's centre can be that has to be swept for a success: plans are of
    cells too, and miss a few of these by millimetres."""
    spare_m: NonNegative = 0.02
    """What only passages lead to that leave the body less than this on either side is not asked for."""


@TASKS.add("sweep-floor", SweepConfig)
class SweepTask(WatchedTask):
    """Done when the robot says that it is: back at its start, or at the goal.

    A success if it truly swept the floor: cells, twelve to a pass, whose middles came within half a width of
    the centre's true path. Asked for are all cells where the centre can be and that no robot has to squeeze
    itself to; what the pass reaches beyond, the rim along walls, is told besides. A second robot would have
    nothing left to do.
    """

    gives_places: ClassVar[bool] = True

    def __init__(self, config: SweepConfig, setting: TaskSetting) -> None:
        mission = setting.mission
        if len(mission.members) != 1:
            raise InputError(f"task 'sweep-floor': expected one robot, found {len(mission.members)}")
        robot, radius_m = mission.members[0], setting.footprints[0].radius_m
        start = mission.start_of(robot)
        assert start is not None, "settled by the build"
        back = GoalConfig(x_m=start.x_m, y_m=start.y_m, tolerance_m=BACK_M)
        super().__init__((back,) if mission.goal_of(robot) is None else ())
        self._config, self._width_m = config, config.width_m or 2.0 * radius_m
        check_pass_width(setting.chart.bounds_m, self._width_m, "task 'sweep-floor'")
        _check_planned(mission.stack_of(robot).planner, self._width_m)
        cell_m = pass_cell_m(self._width_m, radius_m)
        place = start.x_m, start.y_m
        floor = Floor.of(setting.chart, radius_m, cell_m, place, exact=True)
        self.events += cut_off(floor)
        self._apart_fraction = self._asked_for(floor, place).apart_fraction
        self._whole = floor.alone(setting.chart.field, cell_m, place)
        self._floor = self._asked_for(self._whole, place)
        self._swept: BoolArray = np.zeros_like(self._floor.reachable)
        self._last = np.array([start.x_m, start.y_m])

    def _asked_for(self, floor: Floor, start_xy_m: tuple[float, float]) -> Floor:
        # By two cells less than a pass reaches: cells tell where a passage becomes narrow no better.
        return floor.roomy(self._config.spare_m, 0.5 * self._width_m - 2.0 * floor.cell_m, start_xy_m)

    def step(self, t_s: float, attempts: Sequence[Attempt]) -> str | None:
        """Sweep on."""
        here = attempts[0].body.state[:2].copy()
        line = np.array([self._last, here])
        mark_swept(line, 0.5 * self._width_m, *self._floor.origin_xy_m, self._floor.cell_m, self._swept)
        self._last = here
        return super().step(t_s, attempts)

    def progress(self, attempts: Sequence[Attempt]) -> tuple[tuple[str, str], ...]:  # noqa: ARG002
        """How much is swept."""
        return (("swept", f"{100.0 * self._share(self._floor.reachable):.1f} %"),)

    def _share(self, cells: BoolArray) -> float:
        return int(np.count_nonzero(cells & self._swept)) / max(int(np.count_nonzero(cells)), 1)

    def judge_robot(self, run: FinishedRun, robot: RobotRun) -> Verdict:
        """Swept shares, and the path's length over area by width."""
        metrics = header(run, robot)
        driven, nees = driving_metrics(run, robot)
        metrics |= driven
        floor, swept = self._floor, self._share(self._floor.reachable)
        within_reach = sweepable(floor, self._width_m)
        # Who squeezes to more than is asked for needs a path for that, too.
        taken = within_reach | (sweepable(self._whole, self._width_m) & self._swept)
        area_m2 = np.count_nonzero(taken) * floor.cell_m**2
        metrics |= {
            "floor_apart_fraction": self._apart_fraction,
            "swept_fraction": swept,
            "swept_rim_fraction": self._share(within_reach & ~floor.reachable),
            "sweep_ratio": float(robot.driven_m * self._width_m / area_m2),
        }
        metrics["success"] = robot.arrived and robot.collisions == 0 and swept >= self._config.least
        if robot.arrived and swept < self._config.least:
            metrics["reason"] = _too_little(swept, self._config.least)
        return Verdict(metrics, ({"nees": nees},), {})


def _too_little(swept: float, least: float) -> str:
    """Both shares, with as many digits as tell one from the other."""
    wanted = f"{100.0 * least:g}"
    for digits in range(2, 12):
        told = f"{100.0 * swept:.{digits}f}"
        if float(told) < float(wanted):
            break
    return f"swept {told} % of the floor, not {wanted} %"


def _check_planned(choice: ComponentChoice | None, width_m: float) -> None:
    """Refuse a planner that lays passes, ``width_m`` of its parameters apart, with unswept floor between."""
    if choice is None:
        return
    planned_m = getattr(PLANNERS.configure(choice.name, choice.parameters, "stack.planner"), "width_m", None)
    if planned_m is not None and planned_m > width_m:
        raise InputError(
            f"stack.planner.width_m: expected at most {width_m:g} m, what a pass sweeps (task.width_m, or "
            f"the body's width), found {planned_m:g}; set both"
        )
