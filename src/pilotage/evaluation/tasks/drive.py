"""The task of carrying out a command to its end, as calibration runs need it."""

from __future__ import annotations

from pilotage.core.config import Config
from pilotage.evaluation.driving import driving_metrics, header
from pilotage.evaluation.finished import FinishedRun, RobotRun, Verdict
from pilotage.evaluation.tasks.task import TASKS, TaskSetting
from pilotage.evaluation.tasks.watched import WatchedTask


class DriveConfig(Config):
    """Nothing to say: the navigator says what is driven."""


@TASKS.add("drive", DriveConfig)
class DriveTask(WatchedTask):
    """Done when every robot has carried out what it was told; a success if nothing was touched."""

    def __init__(self, config: DriveConfig, setting: TaskSetting) -> None:
        del config, setting
        super().__init__()

    def judge_robot(self, run: FinishedRun, robot: RobotRun) -> Verdict:
        """Position errors, consistency, clearance."""
        driven, nees = driving_metrics(run, robot)
        metrics = header(run, robot) | driven | {"success": robot.arrived and robot.collisions == 0}
        return Verdict(metrics, ({"nees": nees},), {})
