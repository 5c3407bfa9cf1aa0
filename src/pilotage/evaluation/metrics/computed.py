"""Metrics that declared functions give, for a run of one robot or of several."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np

from pilotage.core.types import FloatArray
from pilotage.evaluation.finished import FinishedRun
from pilotage.evaluation.metric import Direction
from pilotage.evaluation.metrics import METRICS

_OF_TEAM: Mapping[Direction, Callable[[FloatArray], float]] = {
    Direction.LESS: np.max,
    Direction.MORE: np.min,
    Direction.NONE: np.mean,
}
"""A team's number from its robots': that of the worst, the mean where neither way is better."""


def add_computed(metrics: dict[str, object], run: FinishedRun) -> dict[str, str]:
    """Add to a run's metrics what is computed from traces; of several robots to each one's own as well.

    Returns
    -------
    By the keys of those that no robot's trace gives, for it has not such a column, that column.

    Raises
    ------
    InputError
        Where a function gives something else than a finite number or None.
    """
    task, robots = run.mission.task.name, metrics.get("robots")
    lacking: dict[str, str] = {}
    if len(run.robots) == 1:
        metrics.update(METRICS.computed(task, run.robots[0].trace, metrics, lacking))
        return lacking
    of_each: dict[str, list[object]] = {}
    for robot in run.robots:
        own = robots.get(robot.name) if isinstance(robots, Mapping) else None
        own = own if isinstance(own, dict) else {}
        found = METRICS.computed(task, robot.trace, {**metrics, **own}, lacking)
        own.update(found)
        for key, value in found.items():
            of_each.setdefault(key, []).append(value)
    for key, values in of_each.items():
        of_team = _OF_TEAM[METRICS.find(key).direction]
        metrics[key] = float(of_team(np.array(values, dtype=np.float64)))
    return {key: column for key, column in lacking.items() if key not in of_each}
