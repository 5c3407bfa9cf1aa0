"""Why runs ended, in words that can be counted."""

from __future__ import annotations

import pytest

from pilotage.evaluation.endings import ending_of


@pytest.mark.parametrize(
    ("reason", "word"),
    [
        ("got stuck", "stuck"),
        ("stuck: no plan leads out (12 tries)", "stuck"),
        ("blocked by an obstacle", "blocked"),
        ("left the sheet", "left the sheet"),
        ("time limit of 1800 s reached", "time"),
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
