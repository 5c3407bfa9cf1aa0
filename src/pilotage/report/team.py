"""Several robots on one page: colours, tiles, the table by robot, whose an event is."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from pilotage.core.types import Event
from pilotage.evaluation.metrics import METRICS
from pilotage.records.numbers import number
from pilotage.records.run_data import RunData
from pilotage.records.trace import Trace
from pilotage.report import quantities
from pilotage.report.headline import own_metrics, succeeded
from pilotage.report.markup import ROW, VALUE, Html, Section, escape, section, table
from pilotage.report.style import BLUE, GREEN, INK, ORANGE, PURPLE, SKY, VERMILLION

COLOURS = (
    *(BLUE, VERMILLION, GREEN, PURPLE, ORANGE, SKY, INK),
    *("#8a5a2b", "#a8123e", "#6a4fb0", "#7d8a12", "#0e7c86"),
    *("#e0408f", "#58a618", "#22308f", "#8d8d8d"),
)
"""Of the robots in their order, as many as the largest team of one description has; then over again."""
PATROL_TILES = (
    ("intruder detected after", "detection_time_s", quantities.duration),
    ("mean idleness", "idleness_mean_s", quantities.duration),
    ("worst idleness", "idleness_worst_s", quantities.duration),
    ("cyclic reference", "idleness_bound_s", quantities.duration),
    ("floor seen lately", "coverage_fraction", quantities.share),
)
"""Of a patrol, by one robot or many: what a number is called, its key, how it is written."""
SLUG, TITLE = "robots", "The robots"
COLUMNS = (
    "path_length_m",
    "goal_error_m",
    "position_rmse_m",
    "position_max_m",
    "min_clearance_m",
    "collisions",
    "replans",
)
"""Metrics that the table shows, where a robot has them."""
MOST_ROWS = 200


def colour_of(robot: int) -> str:
    """The colour of a robot by its number."""
    return COLOURS[robot % len(COLOURS)]


def robot_of(event: Event, names: Sequence[str]) -> int | None:
    """Whose an event is: its text begins with the name."""
    return next((k for k, name in enumerate(names) if event.text.startswith(f"{name}: ")), None)


def together(team: Sequence[RunData]) -> RunData:
    """All robots' paths and plans as if one had driven them all: what a map must have room for."""
    names = ("true_x_m", "true_y_m", "est_x_m", "est_y_m")
    columns = {name: np.concatenate([run.trace[name] for run in team]) for name in names}
    trace = Trace(columns, sum(run.trace.steps for run in team))
    return replace(team[0], trace=trace, plans=tuple(plan for run in team for plan in run.plans))


def team_tiles(metrics: Mapping[str, Any]) -> list[tuple[str, str]]:
    """The handful of numbers of a team."""
    good, count = succeeded(metrics)
    entries = (
        ("duration", "duration_s", quantities.duration),
        ("driven in all", "path_length_m", quantities.length),
        ("position RMSE, mean", "position_rmse_m", quantities.length),
        ("worst position error", "position_max_m", quantities.length),
        ("least clearance", "min_clearance_m", quantities.length),
        ("collisions", "collisions", quantities.count),
        *PATROL_TILES,
    )
    known = [(name, write(number(metrics.get(key)))) for name, key, write in entries]
    told = [(name, text) for name, text in known if text != quantities.NOTHING]
    return [("succeeded", f"{good} of {count}"), *told]


def team_section(metrics: Mapping[str, Any]) -> Section:
    """The table of the robots: each one's outcome and its main numbers."""
    each = own_metrics(metrics)
    keys = [
        key
        for key in COLUMNS
        if key in METRICS and any(math.isfinite(number(entry.get(key))) for entry in each.values())
    ]
    columns = [("robot", ROW), ("outcome", ""), *((METRICS.find(key).name, VALUE) for key in keys)]
    rows = [_row(k, name, entry, keys) for k, (name, entry) in enumerate(list(each.items())[:MOST_ROWS])]
    return section(SLUG, TITLE, table(columns, rows, "events robots", box="long"))


def _row(robot: int, name: str, entry: Mapping[str, Any], keys: Sequence[str]) -> list[str]:
    reason = str(entry.get("reason") or "")
    outcome = "✓ success" if entry.get("success") is True else f"✗ {reason}"
    values = (quantities.measured(number(entry.get(key)), METRICS.find(key).unit) for key in keys)
    badge = f'<span class="badge" style="border-color:{colour_of(robot)}">{robot + 1}</span>'
    named = Html(f"{badge}\u00a0{escape(name)}")
    return [named, outcome, *values]
