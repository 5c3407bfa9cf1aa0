"""The long run: its time is for damaged inputs, not for what is compiled before."""

from __future__ import annotations

import itertools
from pathlib import Path

import pytest

from fuzz import long
from support.fuzz_targets import TARGETS
from support.fuzzing import Healthy
from support.outcome import Outcome


def test_the_time_begins_once_all_is_compiled(monkeypatch: pytest.MonkeyPatch) -> None:
    """Each command takes a minute by this clock, the run 90 s: two cases after all the healthy ones."""
    clock, now = itertools.count(0.0, 60.0), [0.0]
    ran: list[tuple[str, ...]] = []

    def slow(words: tuple[str, ...], _: Path) -> Outcome:
        now[0] = next(clock)
        ran.append(words)
        return Outcome(0, "", "", 0.0, 0.0, ())

    def undamaged(*_: object) -> str:
        return "nothing"

    monkeypatch.setattr(long, "run", slow)
    monkeypatch.setattr(long, "damaged_case", undamaged)
    monkeypatch.setattr("time.monotonic", lambda: now[0])
    monkeypatch.setattr(Healthy, "copy", lambda *given: given[-1])
    assert long.drawn(1, 90.0, None, list(TARGETS[:5]), False) == 0
    assert len(ran) == 5 + 2
