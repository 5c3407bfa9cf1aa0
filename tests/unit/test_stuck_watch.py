"""Who does not get on is told, who shakes on a border too; who waits or makes short rounds is not."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pytest

from pilotage.evaluation.stuck_watch import StuckWatch

PLACES = np.array([[0.0, 0.0], [0.8, 0.0], [1.6, 0.0], [9.0, 0.0]])
"""The first three share borders: a visit is counted to the nearest within a metre."""


def stuck(path: Callable[[int], tuple[float, float]], *, waits: bool = False, visit_m: float = 1.0) -> bool:
    watch = StuckWatch(PLACES, 1, 60.0)
    for t in range(180):
        xy = path(t)
        away = np.hypot(*(PLACES - xy).T)
        place = int(np.argmin(away)) if away.min() <= visit_m else -1
        watch.look(0, float(t), xy, place, waits=waits)
    return 0 in watch.since_s


@pytest.mark.parametrize("at", [0.0, 0.4, 1.2, 2.6, 9.0, 10.0])
@pytest.mark.parametrize("shakes_m", [0.0, 0.01, 0.1])
def test_who_stays_is_told_even_if_it_shakes_on_a_border(at: float, shakes_m: float) -> None:
    assert stuck(lambda t: (at + shakes_m * (-1) ** t, 0.0))
    assert not stuck(lambda t: (at + shakes_m * (-1) ** t, 0.0), waits=True)


def test_who_drives_or_makes_short_rounds_is_not() -> None:
    assert not stuck(lambda t: (0.1 * t, 0.0))
    assert not stuck(lambda t: (0.4 + 0.4 * math.cos(0.1 * t), 0.0))


def test_what_is_told_is_when_it_came_to_a_stop() -> None:
    watch = StuckWatch(PLACES, 2, 60.0)
    told = [
        (t, robot)
        for t in range(200)
        for robot, xy in enumerate([(3.0 + 0.5 * min(t, 40), 0.0), (5.0 + 0.5 * t, 5.0)])
        if watch.look(robot, float(t), xy, -1, waits=False)
    ]
    assert [robot for _, robot in told] == [0]
    assert 38.0 <= watch.since_s[0] <= 40.0
