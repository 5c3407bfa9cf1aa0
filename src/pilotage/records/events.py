"""``events.jsonl``: what happened, one JSON object a line."""

from __future__ import annotations

import json
import math
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from pilotage.core.errors import InputError
from pilotage.core.files import read_json_lines
from pilotage.core.misfit import told
from pilotage.core.types import Event
from pilotage.records.numbers import number
from pilotage.records.reading import clean_text, is_there
from pilotage.records.trace import TRACE_FILE, Trace

EVENTS_FILE = "events.jsonl"
MOST_EVENTS = 20_000
"""Each is a row of the page; hours of a team leave some hundreds."""
LATEST_S = 2**31 - 1
"""What a stamp of ROS holds, 1 and 2."""


def write_events(folder: Path, events: Iterable[Event]) -> None:
    """Write the events in their order; a time that is not known as null."""
    lines = [
        json.dumps({"t_s": None if math.isnan(e.t_s) else float(e.t_s), "kind": e.kind, "text": e.text})
        + "\n"
        for e in events
    ]
    (folder / EVENTS_FILE).write_text("".join(lines), encoding="utf-8")


def read_events(folder: Path) -> tuple[Event, ...]:
    """Read the events; none where there is no such file.

    Raises
    ------
    InputError
        One line, where a line is no object with t_s, kind and text, or there are more than ``MOST_EVENTS``.
    """
    path = folder / EVENTS_FILE
    if not is_there(path):
        return ()
    entries = read_json_lines(path, "a run's events", MOST_EVENTS)
    return tuple(_event(entry, path) for entry in entries)


def _event(entry: Mapping[str, Any], path: Path) -> Event:
    if not {"t_s", "kind", "text"} <= set(entry):
        found = ", ".join(str(key) for key in entry) or "nothing in it"
        raise InputError(f"{path}: expected objects with t_s, kind and text, found one with {found}")
    kind, text = (_word(entry, name, path) for name in ("kind", "text"))
    t_s = number(entry["t_s"])
    if entry["t_s"] is not None and not math.isfinite(t_s):
        raise InputError(f"{path}: expected the time of an event in seconds, found something else")
    return Event(t_s, kind, text)


def require_times(events: Iterable[Event], trace: Trace, folder: Path) -> None:
    """Refuse events and rows without a time that a recording can hold, which a page shows.

    Raises
    ------
    InputError
        Where an event's time is not finite, or before the begin, or any is beyond 32 bits of seconds.
    """
    if not all(0.0 <= event.t_s <= LATEST_S for event in events):
        raise InputError(
            f"{folder / EVENTS_FILE}: expected the time of every event in seconds, 0 to {LATEST_S}, "
            "found one without"
        )
    # Of a robot with one row its own time is told, whatever it is.
    if (np.abs(trace["t_s"]) > LATEST_S).any():
        raise InputError(f"{folder / TRACE_FILE}: t_s: expected seconds within {LATEST_S}, found more")


def _word(entry: Mapping[str, Any], name: str, path: Path) -> str:
    value = entry[name]
    if not isinstance(value, str):
        raise InputError(f"{path}: {name}: expected a text, found {told(value)}")
    return clean_text(value)
