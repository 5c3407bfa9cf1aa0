"""Which figures and which replay a run gets: those that what it holds allows."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from pilotage.evaluation.metrics import METRICS
from pilotage.records.run_data import RunData, read_run, read_team
from pilotage.records.trace import Trace
from pilotage.report.figures.clearance import clearance_figure
from pilotage.report.figures.close_ups import close_ups_figure
from pilotage.report.figures.consistency import consistency_figure
from pilotage.report.figures.control import control_figure
from pilotage.report.figures.covariance import covariance_figure
from pilotage.report.figures.gauss_markov import gauss_markov_figure
from pilotage.report.figures.map import map_figure
from pilotage.report.figures.own_map import own_map_figure
from pilotage.report.figures.patrol import patrol_figures
from pilotage.report.figures.plan import plan_figure
from pilotage.report.figures.pose_error import pose_error_figure
from pilotage.report.figures.team import team_map_figure
from pilotage.report.figures.terrain_curve import curve_figure
from pilotage.report.figures.terrain_estimate import drive_figure, rover_error_figure, uncertainty_figure
from pilotage.report.figures.terrain_map import (
    close_up_figure,
    hazard_map_figure,
    looked_at_figure,
    terrain_map_figure,
)
from pilotage.report.figures.terrain_profile import hazard_distance_figure, terrain_profile_figure
from pilotage.report.figures.timeline import timeline_figure
from pilotage.report.figures.ultrasonic import ultrasonic_figure
from pilotage.report.figures.updates import updates_figure
from pilotage.report.replay.floor import floor_scene
from pilotage.report.replay.scene import ReplayScene
from pilotage.report.replay.terrain import terrain_scene
from pilotage.report.sheet.maps import accuracy_figure, printed_figure
from pilotage.report.sheet.path import coverage_figure, path_figure
from pilotage.report.sheet.replay import sheet_scene
from pilotage.report.style import Illustration, drawing_style

Draw = Callable[[RunData], Illustration]

ON_TERRAIN: tuple[Draw, ...] = (
    terrain_map_figure,
    close_up_figure,
    hazard_map_figure,
    curve_figure,
    looked_at_figure,
    drive_figure,
    rover_error_figure,
    uncertainty_figure,
    terrain_profile_figure,
    hazard_distance_figure,
)
ON_A_SHEET: tuple[Draw, ...] = (
    path_figure,
    coverage_figure,
    accuracy_figure,
    printed_figure,
)
ON_A_MAP: tuple[Draw, ...] = (map_figure, own_map_figure, plan_figure, close_ups_figure, timeline_figure)
OF_THE_DRIVE: tuple[Draw, ...] = (
    pose_error_figure,
    covariance_figure,
    consistency_figure,
    gauss_markov_figure,
    control_figure,
    ultrasonic_figure,
    clearance_figure,
)


def figures_of(run: RunData) -> list[Illustration]:
    """Draw what there is to draw; without anything the map alone is left, which says so."""
    if run.terrain is not None:
        draws, run = ON_TERRAIN, without_given_pose(run)
    elif run.sheet is not None:
        draws = ON_A_SHEET + OF_THE_DRIVE
    else:
        draws = ON_A_MAP + OF_THE_DRIVE
    figures = [draw(run) for draw in (*draws, *((updates_figure,) if run.updates else ()))]
    figures[1:1] = patrol_figures(run)
    return [figure for figure in figures if figure.svg] or figures[:1]


def pose_given(run: RunData) -> bool:
    """Whether the robot was told its true pose: nothing was estimated, and all errors are 0."""
    trace = run.trace
    if not trace.has("est_x_m", "true_x_m"):
        return False
    told = (trace["est_x_m"] == trace["true_x_m"]) & (trace["est_y_m"] == trace["true_y_m"])
    return bool(told.all())


def told_metrics(run: RunData) -> Mapping[str, Any]:
    """The metrics without those of an estimate where the pose was given."""
    if not pose_given(run):
        return run.metrics
    own = {m.key for m in METRICS if m.group in ("Localization", "Consistency")} | {"final_error"}
    return {key: value for key, value in run.metrics.items() if key not in own}


def without_given_pose(run: RunData) -> RunData:
    """The run without its estimate where that is the truth by definition."""
    if not pose_given(run):
        return run
    believed = ("est_", "cov_", "nees", "region_", "root_determinant")
    columns = {name: v for name, v in run.trace.columns.items() if not name.startswith(believed)}
    return replace(run, trace=Trace(columns, run.trace.steps))


def map_of(team: Sequence[RunData]) -> Illustration:
    """Draw the one figure that shows where a run's robots went."""
    if len(team) > 1:
        return team_map_figure(team)
    run = team[0]
    if run.terrain is not None:
        return terrain_map_figure(run) if run.terrain.ground is not None else hazard_map_figure(run)
    return map_figure(run) if run.sheet is None else path_figure(run)


def picture_of(folder: Path) -> Illustration:
    """Draw that figure of a run's folder."""
    with drawing_style():
        return map_of(read_team(folder, read_run(folder)))


def scene_of(run: RunData) -> ReplayScene | None:
    """What there is to replay; None where nothing moved."""
    if run.terrain is not None:
        return terrain_scene(without_given_pose(run))
    return floor_scene(run) if run.sheet is None else sheet_scene(run)
