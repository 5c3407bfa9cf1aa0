"""What guards said of strangers, held against who was there."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from pilotage.core.types import FloatArray
from pilotage.evaluation.tasks.task import Attempt
from pilotage.sim.worlds.traffic import NOWHERE_M

THERE_M = 1.0
"""An alarm is a true one where somebody is this near to the place that it names."""
ALARM = ("alarm_t_s", "alarm_x_m", "alarm_y_m")
"""Columns of the telemetry, one after the other."""


class GuardLog:
    """Looks at the robots' alarms as they are raised."""

    def __init__(self, robots: int) -> None:
        self._last_s = [math.nan] * robots
        self._columns: list[int] | None = None
        self._came_s = self._detected_s = math.nan
        self._false = 0

    def step(self, t_s: float, attempts: Sequence[Attempt]) -> None:
        """Who is there, and who says so."""
        if self._columns is None:
            self._columns = [_column(attempt) for attempt in attempts]
        traffic = attempts[0].body.world.traffic
        if len(traffic.circles_m) > traffic.first_person and not math.isfinite(self._came_s):
            self._came_s = t_s if len(_people(attempts[0])) else math.nan
        for index, (attempt, column) in enumerate(zip(attempts, self._columns, strict=True)):
            if column < 0:
                continue
            raised_s = attempt.journal.row[column]
            if not math.isfinite(raised_s) or raised_s == self._last_s[index]:
                continue
            self._last_s[index] = raised_s
            if attempt.body.stopped:  # it tells nobody
                continue
            people, (x, y) = _people(attempts[0]), attempt.journal.row[column + 1 : column + 3]
            near = np.hypot(*(people - [x, y]).T).min(initial=math.inf)
            if near > THERE_M:
                self._false += 1
            elif not math.isfinite(self._detected_s):
                self._detected_s = t_s

    def metrics(self, *, somebody: bool) -> dict[str, object]:
        """Alarms with nobody there; whether and how soon ``somebody`` was detected, None without anybody."""
        found = math.isfinite(self._detected_s)
        return {
            "false_alarms": self._false,
            "detected": found if somebody else None,
            "detection_time_s": self._detected_s - self._came_s if found else None,
        }


def _people(attempt: Attempt) -> FloatArray:
    """(P, 2) of those who are there now."""
    traffic = attempt.body.world.traffic
    places = traffic.circles_m[traffic.first_person :, :2]
    return np.asarray(places[places[:, 0] < 0.5 * NOWHERE_M])


def _column(attempt: Attempt) -> int:
    """Where a robot tells of its alarms in its telemetry; -1 for one that cannot."""
    units = attempt.journal.units
    return list(units).index(ALARM[0]) if ALARM[0] in units else -1
