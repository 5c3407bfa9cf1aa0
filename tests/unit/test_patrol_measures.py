"""What counts as a visit and as seen on patrol: a body that stands there is no guard."""

from __future__ import annotations

from typing import Any

import pytest

from pilotage.experiments.build.build import build
from pilotage.experiments.loop import run_loop
from pilotage.experiments.mission import mission_of, read_mission

FAILS_S, END_S = 2.0, 6.0


@pytest.mark.parametrize("mended", [False, True])
def test_who_failed_neither_visits_nor_sees_until_it_is_mended(*, mended: bool) -> None:
    """The place under its body was never idle, and the floor around it covered for good."""
    values = read_mission("museum-patrol")
    walls = [[0, 0, 6, 0], [6, 0, 6, 5], [6, 5, 0, 5], [0, 5, 0, 0]]
    values["world"] = {"map": {"map": "a room", "bounds_m": [0, 0, 6, 5], "walls_m": walls}}
    values["task"] = {"name": "patrol", "duration_s": END_S}
    failure = {"robot": 0, "at_s": FAILS_S} | ({"for_s": 3.0} if mended else {})
    values["team"] = {"size": 1, "strategy": "cyclic", "failures": [failure]}
    experiment = build(mission_of(values, seed=0))
    assert experiment.task.judge(run_loop(experiment).finished).metrics["robots_failed"] == (not mended)
    task: Any = experiment.task
    for last_s in (task._visits.last_s, task._floor.seen_s):
        assert last_s.max() == pytest.approx(END_S if mended else FAILS_S, abs=0.41)
    # Who is there at the end and failed long ago has not stayed.
    worst_s = task._visits.idleness(END_S, 0.0)[0].vertex_worst_s
    assert mended or worst_s.min() >= END_S - FAILS_S - 0.41
