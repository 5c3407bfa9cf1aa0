"""Exploring a sheet: every cell that can be reached, and a map of what stands there."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import ClassVar

from pilotage.core.types import Event
from pilotage.evaluation.driving import header
from pilotage.evaluation.finished import FinishedRun, RobotRun, Verdict
from pilotage.evaluation.sheet_metrics import sheet_metrics
from pilotage.evaluation.sheet_visits import VisitedCells, reachable_cells
from pilotage.evaluation.tasks.contacts import contact_words
from pilotage.evaluation.tasks.task import Attempt, TaskSetting, all_ended
from pilotage.evaluation.tasks.team import verdict
from pilotage.maps.cell_map import CellMap
from pilotage.maps.markings import FloorMarkings
from pilotage.sim.contacts import OBSTACLE, WALL


class SheetExploration:
    """Looks at robots that explore a sheet's cells.

    Over when nobody explores any more, or a robot is blocked or off the sheet; a success where the robot
    says that it is done and touched nothing.
    """

    WANTS: ClassVar[frozenset[str]] = frozenset({"cells", "visited", "left"})

    def __init__(self, blocked_s: float, markings: FloorMarkings, setting: TaskSetting) -> None:
        assert markings.source is not None, "looked at by the task"
        self.columns: Mapping[str, str] = {"overhang_m": "m", "visited_cells": "1"}
        self.events: list[Event] = []
        self._markings, self._sheet = markings, markings.source
        self._dt_s, self._blocked_s = setting.mission.run.dt_s, blocked_s
        count = len(setting.footprints)
        self._radii = [footprint.radius_m for footprint in setting.footprints]
        self._visits = [VisitedCells(markings.size_m, markings.cells) for _ in range(count)]
        self._contacts, self._held = [0] * count, [0] * count
        self._touched: list[dict[str, None]] = [{} for _ in range(count)]
        self._rows = [(0.0, 0.0)] * count

    def step(self, t_s: float, attempts: Sequence[Attempt]) -> str | None:
        """Over when nobody explores any more, or a robot is blocked or off the sheet."""
        for index, attempt in enumerate(attempts):
            body, visits = attempt.body, self._visits[index]
            pose = body.pose
            whose = f"{body.name}: " if len(attempts) > 1 else ""
            visits.add(pose.x_m, pose.y_m, t_s)
            overhang_m = self._markings.overhang_m(pose.x_m, pose.y_m, self._radii[index])
            self._rows[index] = overhang_m, float(visits.count)
            if body.collisions > self._contacts[index]:
                self._contacts[index] = body.collisions
                self._touched[index] |= dict.fromkeys(_as_box(what) for what in body.touched)
                words = contact_words(_as_box(what) for what in body.touched)
                self.events.append(Event(t_s, "collision", f"{whose}{words}"))
            if not self._markings.holds(pose.x_m, pose.y_m):
                self.events.append(Event(t_s, "failed", f"{whose}the robot's centre left the sheet"))
                return "left the sheet"
            self._held[index] = self._held[index] + 1 if body.touching else 0
            if self._held[index] * self._dt_s > self._blocked_s:
                self.events.append(
                    Event(t_s, "failed", f"{whose}a box held the robot for {self._blocked_s:g} s")
                )
                return "blocked by an obstacle"
        return "" if all_ended(attempts) else None

    def row(self, index: int) -> tuple[float, ...]:
        """How far the body reaches over the edge, and how many cells it was in."""
        return self._rows[index]

    def progress(self, attempts: Sequence[Attempt]) -> tuple[tuple[str, str], ...]:  # noqa: ARG002
        """The share of all cells that were visited."""
        columns, rows = self._markings.cells
        share = 100.0 * max(visits.count for visits in self._visits) / (columns * rows)
        return (("visited", f"{share:>5.1f} %"),)

    def judge(self, run: FinishedRun) -> Verdict:
        """Outcome, coverage, mapping accuracy, pose errors."""
        return verdict([self._judged(run, robot, i) for i, robot in enumerate(run.robots)], run)

    def _judged(self, run: FinishedRun, robot: RobotRun, index: int) -> Verdict:
        visits = self._visits[index]
        cells, own_visited, left = (robot.results[name] for name in ("cells", "visited", "left"))
        assert isinstance(cells, CellMap)
        done = robot.arrived and not run.ending
        metrics = header(run, robot)
        if done and robot.collisions:
            # Done, and yet no success: it says why.
            times = "once" if robot.collisions == 1 else f"{robot.collisions} times"
            what = " and ".join(self._touched[index]) or "a box"
            metrics["reason"] = f"{metrics['reason']}; touched {what} {times}"
        metrics |= {
            "success": done and robot.collisions == 0,
            "real_time_factor": run.duration_s / run.loop_s,
            "path_length_m": robot.driven_m,
            "collisions": robot.collisions,
            "cells_left": len(left),  # type: ignore[arg-type]
        }
        metrics |= sheet_metrics(
            self._sheet,
            self._radii[index],
            robot.trace,
            visits.visited,
            visits.first_s,
            cells,
            own_visited,  # type: ignore[arg-type]
        )
        extras = {
            f"{robot.name}/visited": visits.visited.astype(float),
            f"{robot.name}/first_visit_s": visits.first_s,
            f"{robot.name}/reachable": reachable_cells(self._sheet, self._radii[index]).astype(float),
        }
        return Verdict(metrics, ({},), extras)


def _as_box(touched: str) -> str:
    """What stands on a sheet is a box."""
    return "a box" if touched in (WALL, OBSTACLE) else touched
