"""The task of knowing where one is, however one gets about."""

from __future__ import annotations

import numpy as np

from pilotage.core.angles import wrap_array_to_pi
from pilotage.core.config import Config
from pilotage.evaluation.driving import WRONG_M, WRONG_RAD, claimed_at, driving_metrics, header, poses
from pilotage.evaluation.finished import FinishedRun, RobotRun, Verdict
from pilotage.evaluation.tasks.task import TASKS, TaskSetting
from pilotage.evaluation.tasks.watched import WatchedTask
from pilotage.sensors.sensor import Positive


class LocalizeConfig(Config):
    """How near to the truth a pose is right."""

    tolerance_m: Positive = WRONG_M
    tolerance_rad: Positive = WRONG_RAD


@TASKS.add("localize", LocalizeConfig)
class LocalizeTask(WatchedTask):
    """Done when every robot is through with its drive, or time is up; a success if it knows then where it is.

    Where it has got to does not count, and one that holds itself for lost at the end has not succeeded.
    """

    def __init__(self, config: LocalizeConfig, setting: TaskSetting) -> None:
        del setting
        super().__init__()
        self._config = config

    def judge_robot(self, run: FinishedRun, robot: RobotRun) -> Verdict:
        """Errors and consistency; since when the pose has been right."""
        metrics = header(run, robot)
        driven, nees = driving_metrics(run, robot)
        metrics |= driven
        trace = robot.trace
        right = np.zeros(len(trace["t_s"]), dtype=np.bool_)
        if right.size:
            error = poses(trace, "est") - poses(trace, "true")
            right = np.hypot(error[:, 0], error[:, 1]) <= self._config.tolerance_m
            right &= np.abs(wrap_array_to_pi(error[:, 2])) <= self._config.tolerance_rad
            right &= claimed_at(trace)
        since = len(right) - int(np.argmin(right[::-1])) if not right.all() else 0
        knows = bool(right.size and right[-1])
        if knows:
            metrics["localized_after_s"] = float(trace["t_s"][since]) if since else 0.0
        metrics["success"] = knows and robot.collisions == 0
        if not knows and not robot.collisions:
            metrics["reason"] = "the robot does not know where it is at the end"
        return Verdict(metrics, ({"nees": nees},), {})
