"""``events.jsonl``: what happened, one JSON object a line."""

from __future__ import annotations

import json
from collections.abc import Iterable
from pathlib import Path

from pilotage.core.errors import InputError
from pilotage.core.types import Event
from pilotage.records.numbers import number
from pilotage.records.reading import clean_text, parse_json, read_text

EVENTS_FILE = "events.jsonl"


def write_events(folder: Path, events: Iterable[Event]) -> None:
    """Write the events in their order."""
    lines = [json.dumps({"t_s": e.t_s, "kind": e.kind, "text": e.text}) + "\n" for e in events]
    (folder / EVENTS_FILE).write_text("".join(lines), encoding="utf-8")


def read_events(folder: Path) -> tuple[Event, ...]:
    """Read the events; none where there is no such file.

    Raises
    ------
    InputError
        One line, where a line is no object with t_s, kind and text.
    """
    path = folder / EVENTS_FILE
    events = []
    for index, line in enumerate(read_text(path).splitlines(), start=1):
        if not line.strip():
            continue
        try:
            entry = parse_json(line)
            events.append(Event(number(entry["t_s"]), str(entry["kind"]), str(entry["text"])))
        except (ValueError, KeyError, TypeError, IndexError):
            raise InputError(
                f"{path}: line {index}: expected an object with t_s, kind and text, "
                f"found {clean_text(line[:60])}"
            ) from None
    return tuple(events)
