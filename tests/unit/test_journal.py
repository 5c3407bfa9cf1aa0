"""The journal: columns in their order, numbers in their places, everything said kept."""

from __future__ import annotations

import math

import pytest

from pilotage.stack.journal import Journal


def test_a_stacks_own_columns_stand_before_those_of_its_parts() -> None:
    journal = Journal()
    part = journal.channel({"a": "m", "b": "1"})
    stack = journal.channel({"c": "s"}, first=True)
    other = journal.channel({"d": "rad"})
    assert all(math.isnan(value) for value in journal.row)
    part.tell(1.0, 2.0)
    stack.tell(3.0)
    other.tell(4.0)
    assert list(journal.units.items()) == [("c", "s"), ("a", "m"), ("b", "1"), ("d", "rad")]
    assert list(journal.row) == [3.0, 1.0, 2.0, 4.0]
    part.tell(5.0, 6.0)
    assert list(journal.row) == [3.0, 5.0, 6.0, 4.0]


def test_misuse_is_told() -> None:
    journal = Journal()
    channel = journal.channel({"a": "m"})
    with pytest.raises(ValueError, match="declared twice"):
        journal.channel({"a": "s"})
    with pytest.raises(ValueError, match="expected 1 numbers, found 2"):
        channel.tell(1.0, 2.0)


def test_events_counts_and_results_are_kept() -> None:
    journal = Journal()
    journal.say(0.5, "plan", "there is one")
    assert journal.count("replans") == 1
    assert journal.count("replans") == 2
    found = [1]
    journal.result("found", lambda: list(found))
    found.append(2)
    assert journal.results() == {"found": [1, 2]}
    assert [(event.t_s, event.kind) for event in journal.events] == [(0.5, "plan")]
