"""The task of exploring: a sheet cell by cell, or a floor that is seen from afar."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import ClassVar

from pydantic import Field

from pilotage.core.config import Config
from pilotage.core.types import Event
from pilotage.evaluation.finished import FinishedRun, Verdict
from pilotage.evaluation.tasks.floor_exploration import FloorExploration
from pilotage.evaluation.tasks.sheet_exploration import SheetExploration
from pilotage.evaluation.tasks.task import TASKS, Attempt, TaskSetting
from pilotage.missions.places import GoalConfig


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
