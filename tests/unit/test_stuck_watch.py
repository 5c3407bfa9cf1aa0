"""Who does not get on is told, who shakes on a border too; who waits or makes short rounds is not."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pytest

from pilotage.core.types import FloatArray
from pilotage.evaluation.stuck_watch import StuckWatch

PLACES = np.array([[0.0, 0.0], [0.8, 0.0], [1.6, 0.0], [9.0, 0.0]])
"""The first three share borders: a visit is counted to the nearest within a metre."""


def stuck(
    path: Callable[[int], tuple[float, float]],
    *,
    waits: bool = False,
    visit_m: float = 1.0,
    places: FloatArray = PLACES,
    bound: Callable[[int], int] = lambda _: -1,
) -> bool:
    watch = StuckWatch(places, 1, 60.0, visit_m)
    for t in range(180):
        xy = path(t)
        away = np.hypot(*(places - xy).T)
        place = int(np.argmin(away)) if away.min() <= visit_m else -1
        watch.look(0, float(t), xy, place, waits=waits, bound=bound(t))
    return 0 in watch.since_s


@pytest.mark.parametrize("at", [0.0, 0.4, 1.2, 2.6, 9.0, 10.0])
@pytest.mark.parametrize("shakes_m", [0.0, 0.01, 0.1])
def test_who_stays_is_told_even_if_it_shakes_on_a_border(at: float, shakes_m: float) -> None:
    assert stuck(lambda t: (at + shakes_m * (-1) ** t, 0.0))
    assert not stuck(lambda t: (at + shakes_m * (-1) ** t, 0.0), waits=True)


def test_who_drives_or_makes_short_rounds_is_not() -> None:
    assert not stuck(lambda t: (0.1 * t, 0.0))
    assert not stuck(lambda t: (0.4 + 0.4 * math.cos(0.1 * t), 0.0))
    # 0.6 m of the 1.6 between two places: half a metre before each it turns.
    apart = np.delete(PLACES, 1, axis=0)
    assert not stuck(lambda t: (0.8 + 0.3 * math.cos(0.3 * t), 0.0), places=apart)
    assert stuck(lambda t: (0.8 + 0.15 * math.cos(0.3 * t), 0.0), places=apart)
    # 1.8 m of the 2.4 between two: all of it within a metre of the middle, where it began.
    wide = np.array([[0.0, 0.0], [2.4, 0.0]])
    assert not stuck(lambda t: (1.2 + 0.9 * math.sin(0.3 * t), 0.0), places=wide)
    assert stuck(lambda t: (1.2 + 0.15 * math.sin(0.3 * t), 0.0), places=wide)
    # 1.1 m of 3 m, each end within a metre of its place.
    far = np.array([[0.0, 0.0], [3.0, 0.0]])
    assert not stuck(lambda t: (1.5 + 0.55 * math.sin(0.3 * t), 0.0), places=far)
    assert stuck(lambda t: (1.5 + 0.45 * math.sin(0.3 * t), 0.0), places=far)


def test_what_is_told_is_when_it_came_to_a_stop() -> None:
    watch = StuckWatch(PLACES, 2, 60.0, 1.0)
    told = [
        (t, robot)
        for t in range(200)
        for robot, xy in enumerate([(3.0 + 0.5 * min(t, 40), 0.0), (5.0 + 0.5 * t, 5.0)])
        if watch.look(robot, float(t), xy, -1, waits=False)
    ]
    assert [robot for _, robot in told] == [0]
    assert 38.0 <= watch.since_s[0] <= 40.0


def test_who_serves_two_places_almost_from_one_spot_gets_on_and_who_gives_one_up_does_not() -> None:
    def circle(t: int) -> tuple[float, float]:
        return 0.4 + 0.12 * math.cos(0.9 * t), 0.12 * math.sin(0.9 * t)

    def turns(*places: int) -> Callable[[int], int]:
        return lambda t: places[t // 4 % len(places)]

    assert stuck(circle)
    assert not stuck(circle, bound=turns(0, 1))
    # One of them alone, one that it never is at, and both beside one that it gives up each time.
    assert stuck(circle, bound=turns(0))
    assert stuck(circle, bound=turns(0, 3))
    assert stuck(circle, bound=turns(0, 1, 3))
    # A charging station is numbered after the places.
    assert stuck(circle, bound=turns(0, len(PLACES)))
