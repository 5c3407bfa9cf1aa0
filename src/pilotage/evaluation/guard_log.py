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


class GuardLog:
    """Looks at the robots' alarms as they are raised."""

    def __init__(self, robots: int) -> None:
        self._last_s = [math.nan] * robots
        self._came_s = self._detected_s = math.nan
        self._false = 0

    def step(self, t_s: float, attempts: Sequence[Attempt]) -> None:
        """Who is there, and who says so."""
        people = _people(attempts[0])
        if not math.isfinite(self._came_s) and len(people):
            self._came_s = t_s
        for index, attempt in enumerate(attempts):
            raised_s, x, y = _alarm(attempt)
            if not math.isfinite(raised_s) or raised_s == self._last_s[index]:
                continue
            self._last_s[index] = raised_s
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


def _alarm(attempt: Attempt) -> tuple[float, float, float]:
    """When and where a robot raised its last alarm; NaN for one that cannot."""
    journal = attempt.journal
    if ALARM[0] not in journal.units:
        return math.nan, math.nan, math.nan
    first = list(journal.units).index(ALARM[0])
    t_s, x, y = journal.row[first : first + 3]
    return t_s, x, y
