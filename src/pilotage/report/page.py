"""Puts a run's report together: one page, self-contained, no outside requests."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

from pilotage.core.whole_file import write_whole
from pilotage.records.numbers import number
from pilotage.records.run_data import OnDamage, RunData, read_run, read_team
from pilotage.report import quantities
from pilotage.report.drawn import figures_of, scene_of, told_metrics
from pilotage.report.figures.team import team_figures
from pilotage.report.headline import headline, outcome
from pilotage.report.markup import (
    REPORT_FILE,
    Section,
    escape,
    events_section,
    figure_sections,
    metrics_section,
    page,
    section,
)
from pilotage.report.metrics_table import metric_rows
from pilotage.report.replay.section import replay_section, script_source, style
from pilotage.report.replay.team import team_scene
from pilotage.report.rounds import rounds_section
from pilotage.report.style import drawing_style
from pilotage.report.team import PATROL_TILES, team_section, team_tiles

OF_A_TEAM = (
    "Of the whole team: metres driven, alarms, contacts and changes of plan are sums; clearances are the "
    "least, what is called worst or longest the largest; what else each robot has of its own is their mean."
)
_LONGEST_MISSION = 100_000


def write_report(run_dir: Path, on_damage: OnDamage | None = None) -> Path:
    """Write ``report.html`` into a run folder and return its path; see ``pilotage.report``."""
    damaged: list[str] = []

    def left_out(line: str) -> None:
        # Files that the robots share are read once for each: one line for each damage is enough.
        if line in damaged:
            return
        damaged.append(line)
        if on_damage is not None:
            on_damage(line)

    told = None if on_damage is None else left_out
    run = read_run(run_dir, on_damage=told)
    team = read_team(run_dir, run, told)
    path = run_dir / REPORT_FILE
    write_whole(path, run_page(run, damaged, team))
    return path


def run_page(run: RunData, damaged: Sequence[str] = (), team: Sequence[RunData] = ()) -> str:
    """Return the report of a run as HTML.

    Parameters
    ----------
    damaged
        Lines on files that it was read without.
    team
        The views of all its robots where there are several; what is drawn shows them all.
    """
    several = len(team) > 1
    with drawing_style():
        figures = team_figures(team) if several else figures_of(run)
        scene = team_scene(team) if several else scene_of(run)
    told = run.metrics if several else told_metrics(run)
    sections: list[Section] = []
    # What was only planned has nothing to replay, and nothing is missing.
    if scene is not None or (run.trace.steps and not run.trace.has("path_x_m")):
        sections.append(replay_section(scene))
    if several:
        sections.append(team_section(run.metrics))
    slugs = [figure.slug for figure in figures]
    explained = next((slug for slug in ("timeline", "coverage") if slug in slugs), slugs[0] if slugs else "")
    for drawn in figure_sections(figures):
        sections.append(drawn)
        # What happened explains the map and the numbers; the numbers come before their curves.
        if drawn.slug == "map":
            sections.append(rounds_section(run.metrics))
        if drawn.slug == explained:
            sections += [
                events_section(run.events),
                metrics_section(metric_rows(told), OF_A_TEAM if several else ""),
            ]
    if run.mission_text:
        sections.append(_mission_section(run.mission_text))
    description = str(run.mission.get("description") or "")
    source = "recording" if run.recorded else "simulator"
    return page(
        sections,
        figures,
        title=f"{run.name}: run report",
        heading=run.name,
        eyebrow=_eyebrow(run),
        descriptions=[*([description] if description else []), *damaged],
        outcome=_outcome(run),
        headline=headline(told),
        tiles=team_tiles(told) if several else _tiles(run, told),
        rules=style(),
        script_source=script_source(),
        footer=f"Made by pilotage from the run folder {run.run_dir.name}. Angles are counter-clockwise; true "
        f"values come from the {source}, the robot never sees them.",
    )


def _eyebrow(run: RunData) -> str:
    parts = ["pilotage run report"]
    if run.metrics.get("seed") is not None:
        parts.append(f"seed {run.metrics['seed']}")
    steps = number(run.metrics.get("steps"))
    if steps > 0.0:
        parts.append(f"{quantities.count(steps)} steps")
    return " · ".join(parts)


def _outcome(run: RunData) -> str:
    success = outcome(run.metrics)
    look, text = {True: ("good", "✓ success"), False: ("bad", "✗ failed"), None: ("", "outcome not said")}[
        success
    ]
    return f'<span class="outcome {look}">{text}</span>'


def _tiles(run: RunData, told: Mapping[str, Any]) -> list[tuple[str, str]]:
    """Return the handful of numbers that most readers came for."""
    values = {key: number(value) for key, value in told.items()}
    if values.get("duration_s") == 0.0:
        del values["duration_s"]

    def value(key: str) -> float:
        return values.get(key, math.nan)

    planned, shortest = value("planned_length_m"), value("shortest_length_m")
    ratio = planned / shortest if shortest > 0.0 else math.nan
    entries: tuple[tuple[str, float, Callable[[float], str]], ...] = (
        ("duration", value("duration_s"), quantities.duration),
        ("position RMSE", value("position_rmse_m"), quantities.length),
        ("worst position error", value("position_max_m"), quantities.length),
        ("heading RMSE", value("heading_rmse_rad"), quantities.angle),
        ("floor swept", value("swept_fraction"), quantities.share),
        ("floor mapped", value("floor_mapped"), quantities.share),
        ("walls of its map, off", value("wall_rms_m"), quantities.length),
        ("found itself after", value("found_after_s"), quantities.duration),
        ("visited, of the reachable", value("coverage_reachable"), quantities.share),
        ("features right", value("feature_precision"), quantities.share),
        ("plan over shortest", ratio, lambda x: f"{x:.3f} ×"),
        ("least clearance", value("min_clearance_m"), quantities.length),
        ("NEES (ideal 3)", value("nees_mean"), lambda x: f"{x:.2f}"),
        ("collisions", value("collisions"), quantities.count),
        *((name, value(key), write) for name, key, write in PATROL_TILES),
    )
    if run.terrain is not None or not run.trace.has("true_x_m"):
        entries += (
            ("planned path", planned, quantities.length),
            ("travel time", value("travel_time_s"), quantities.duration),
            ("planning time", value("planning_time_s"), quantities.duration),
            ("cells opened", value("expansions"), quantities.count),
        )
    return [(name, write(x)) for name, x, write in entries if math.isfinite(x)]


def _mission_section(text: str) -> Section:
    shown = (
        text
        if len(text) <= _LONGEST_MISSION
        else text[:_LONGEST_MISSION] + "\n# ... the rest is in mission.yaml"
    )
    return section(
        "mission",
        "The mission as it ran",
        "<p>The run folder&#x27;s <code>mission.yaml</code> holds everything that is needed to run it again: "
        "<code>pilotage run mission.yaml</code>.</p>"
        f"<details><summary>Show it</summary><pre>{escape(shown)}</pre></details>",
    )
