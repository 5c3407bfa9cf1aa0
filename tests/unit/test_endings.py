"""Why runs ended, in words that can be counted."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from pilotage.evaluation.endings import ending_of
from pilotage.evaluation.out_of_time import told_why
from pilotage.experiments.build.build import build
from pilotage.experiments.loop import run_loop
from pilotage.experiments.mission import mission_of
from pilotage.stack.interface import StackStatus
from support.missions import drive


@pytest.mark.parametrize(
    ("reason", "word"),
    [
        ("got stuck", "stuck"),
        ("stuck: no plan leads out (12 tries)", "stuck"),
        ("blocked by an obstacle", "blocked"),
        ("left the sheet", "left the sheet"),
        ("time limit of 1800 s reached", "time"),
        ("time limit of 60 s reached; it was lost for 55 s of that", "time"),
        ("collision at (1.20, 3.40) after 5.3 s", "collision"),
        ("no explored cell is left to visit; touched a box 2 times", "no explored cell is left to visit"),
        ("", ""),
    ],
)
def test_reasons_lose_what_is_this_runs_alone(reason: str, word: str) -> None:
    assert ending_of({"success": False, "reason": reason}) == word


def test_a_success_is_complete_and_damaged_rows_say_nothing() -> None:
    assert ending_of({"success": True, "reason": "done: 406 cells visited"}) == "complete"
    assert ending_of({"success": 1.0}) == "complete"
    assert ending_of({"reason": 7}) == ending_of({}) == ""


@pytest.mark.parametrize(
    ("localized", "off_m", "moves", "why"),
    [
        ([1.0] * 21, 0.0, True, ""),
        ([0.0] * 21, 0.0, True, "; it never knew where it was"),
        ([1.0] * 11 + [0.0] * 10, 0.0, True, "; it was lost for 10 s of that, and at the end"),
        ([0.0] * 11 + [1.0] * 10, 0.0, True, "; it was lost for 10 s of that"),
        ([1.0] * 21, 3.0, True, "; it was 3.00 m from where it believed, sure of that to "),
        ([1.0] * 21, 0.0, False, "; it stood for the last 21 s"),
    ],
)
def test_who_ran_out_of_time_says_what_it_knows(
    localized: list[float], off_m: float, moves: bool, why: str
) -> None:
    """A robot that was lost from its first scan on failed at the time limit without another word."""
    experiment = build(mission_of(drive(), seed=0))
    finished = run_loop(experiment).finished
    robot = finished.robots[0]
    trace: dict[str, Any] = {**robot.trace, "localized": np.array(localized)[: len(robot.trace["t_s"])]}
    away = np.linspace(0.0, 2.0 if moves else 0.0, len(trace["t_s"]))
    trace |= {
        "t_s": 10.0 * trace["t_s"],
        "true_x_m": away,
        "true_y_m": 0.0 * away,
        "est_x_m": away + off_m,
        "est_y_m": 0.0 * away,
    }
    late = replace(robot, trace=trace, status=StackStatus.RUNNING)
    run = replace(finished, robots=(late,), ending="time limit of 2 s reached")
    metrics = told_why(experiment.task.judge(run), run).metrics
    assert str(metrics["reason"]).startswith(run.ending + why)
    assert bool(why) == (metrics["reason"] != run.ending)
