"""Several robots in one figure: their paths on the map, their errors and clearances over time."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes

from pilotage.records.run_data import RunData
from pilotage.report.figures import layers, map_marks
from pilotage.report.figures.grid import OCCUPIED_COLOUR, UNKNOWN_COLOUR, draw_grid, has_unknown
from pilotage.report.figures.map_view import map_axes, view_limits
from pilotage.report.figures.patrol import patrol_figures
from pilotage.report.figures.placing import LabelPlacer
from pilotage.report.style import (
    GREEN,
    INK,
    MUTED,
    ORANGE,
    VERMILLION,
    Illustration,
    Key,
    logarithmic,
    nice_limit,
    peak,
    render,
    series,
    stacked_axes,
    time_limits,
)
from pilotage.report.team import colour_of, robot_of, together

MOST_KEYS = 24
"""Of more robots the legend names no single one; their names stand at their starts."""


def team_figures(team: Sequence[RunData]) -> list[Illustration]:
    """Draw what there is to draw of a team."""
    figures = [team_map_figure(team), *patrol_figures(team[0]), team_series_figure(team)]
    return [figure for figure in figures if figure.svg] or figures[:1]


def team_map_figure(team: Sequence[RunData]) -> Illustration:
    """Draw all robots on their map: plans as bands, true paths as lines, bodies at start, end and goal."""
    slug, title = "map", "The map"
    first, every = team[0], together(team)
    limits = view_limits(every)
    if limits is None:
        return Illustration(slug, title, "", "The run recorded neither a map nor a path.")
    figure, axes, points_per_m = map_axes(limits)
    placer = map_marks.label_placer(every, axes, points_per_m)
    layers.draw_obstacles(axes, first.world)
    if first.grid is None:
        layers.draw_walls(axes, first.world)
    else:
        draw_grid(axes, first.grid)
    for run in team:
        _draw_robot(axes, run, placer, points_per_m)
    whose = [robot_of(event, first.robots) for event in first.events]
    for run in team:
        own = {index for index, robot in enumerate(whose) if robot == run.robot}
        map_marks.draw_events(axes, run, placer, points_per_m, own)
    map_marks.draw_beacons(axes, first, placer, points_per_m)
    names = [run.outline.name or first.robots[k] for k, run in enumerate(team)]
    shown = enumerate(names if len(names) <= MOST_KEYS else [])
    world = first.world
    candidates = (
        (any(run.plans for run in team), Key("first plans", MUTED, "band", "plan")),
        (first.trace.has("est_x_m"), Key("estimated paths", INK, "dash", "estimated")),
        (world.has_obstacles, Key("unexpected obstacles", ORANGE, "band", "obstacles", 1.0)),
        (bool(world.landmarks), Key("beacons", GREEN, "spot", "beacons")),
        (first.grid is None and len(world.segments_m) > 0, Key("walls", INK, "line", "walls")),
        (first.grid is not None, Key("grid: occupied", OCCUPIED_COLOUR, "band", "grid", 1.0)),
        (has_unknown(first.grid), Key("grid: unknown", UNKNOWN_COLOUR, "band", opacity=1.0)),
    )
    keys = [Key(name, colour_of(k), "line", f"robot-{k}") for k, name in shown]
    keys += [key for there, key in candidates if there]
    plans = " its first plan as a band," if any(run.plans for run in team) else ""
    goals = ", its goal as a cross" if any(len(run.outline.goals) for run in team) else ""
    caption = (
        f"Each robot has its colour: its true path,{plans} its body to scale at the start (open) and the end "
        f"(filled){goals}. Numbers are those of the event list."
    )
    alt = f"Map of the run {first.name} with the paths of {len(team)} robots"
    return Illustration(slug, title, alt, caption, render(figure, slug, alt), tuple(keys))


def _draw_robot(axes: Axes, run: RunData, placer: LabelPlacer, points_per_m: float) -> None:
    colour, layer, outline = colour_of(run.robot), f"robot-{run.robot}", run.outline
    radius, polygon = outline.radius_m or 0.0, outline.polygon_m
    for plan in run.plans[:1]:
        layers.line(axes, plan.path[:, :2], "plan", color=colour, linewidth=4.0, alpha=0.25, zorder=2)
    path = layers.true_path(run)
    layers.line(axes, path, layer, color=colour, linewidth=2.0, zorder=7)
    dashes = {"linestyle": (0, (3.0, 4.0)), "linewidth": 0.6}
    # Under the true ones: after many rounds the dashes of all robots hid whose path was whose.
    layers.line(axes, layers.estimated_path(run), "estimated", color=INK, **dashes, zorder=6.5)
    for x, y, theta in outline.goals:
        axes.plot([x], [y], marker="X", color=colour, markersize=8.0, markeredgecolor="white", zorder=9.5)
        if theta is not None and len(polygon):
            look = {"facecolor": "none", "linewidth": 1.2, "linestyle": (0, (3, 2)), "zorder": 9.3}
            layers.draw_body(axes, x, y, theta, radius, colour, polygon_m=polygon, look=look)
    known = np.flatnonzero(np.isfinite(path).all(axis=1))
    if len(known):
        x, y = (float(value) for value in path[known[-1]])
        theta = float(run.trace["true_theta_rad"][known[-1]])
        layers.draw_body(axes, x, y, theta, radius, colour, polygon_m=polygon)
    if outline.start is None:
        return
    x, y, theta = outline.start
    layers.draw_body(axes, x, y, theta, radius, colour, filled=False, polygon_m=polygon)
    gap = radius * points_per_m + 3.0 + np.array([0.0, 5.0, 12.0, 22.0])
    at = placer.place(x * points_per_m, y * points_per_m, 3.0 * max(len(outline.name), 2), 5.5, gap)
    axes.text(
        at[0] / points_per_m,
        at[1] / points_per_m,
        outline.name,
        ha="center",
        va="center_baseline",
        fontweight="bold",
        color=colour,
        zorder=22,
    )


def team_series_figure(team: Sequence[RunData]) -> Illustration:
    """Draw each robot's position error, clearance and distance to go over time, in its colour."""
    slug, title = "robots-over-time", "The robots over time"
    errors = {run.robot: np.hypot(*(layers.estimated_path(run) - layers.true_path(run)).T) for run in team}
    panels_of = {
        "Position error [m]": errors,
        "Clearance of the body [m]": {run.robot: run.trace["clearance_m"] for run in team},
        "Distance to go [m]": {run.robot: run.trace["distance_to_go_m"] for run in team},
    }
    known = {
        name: lines
        for name, lines in panels_of.items()
        if any(bool(np.isfinite(values).any()) for values in lines.values())
    }
    if not known:
        return Illustration(slug, title, "", "The robots recorded neither errors nor clearances.")
    figure, panels = stacked_axes(list(known), [110.0] * len(known))
    longest = max((run.trace.t_s for run in team), key=len)
    time_limits(panels, longest)
    for axes, (name, lines) in zip(panels, known.items(), strict=True):
        for run in team:
            series(axes, run.trace.t_s, lines[run.robot], colour_of(run.robot), linewidth=1.0)
        together_m = np.concatenate(list(lines.values()))
        positive = together_m[np.isfinite(together_m) & (together_m > 0.0)]
        if name.startswith("Position") and positive.size:
            logarithmic(axes, max(float(np.quantile(positive, 0.01)), 1e-4), 1.3 * float(positive.max()))
        else:
            least = float(np.nanmin(together_m))
            axes.set_ylim(min(0.0, 1.2 * least), nice_limit(peak(together_m)))
        if name.startswith("Clearance"):
            axes.axhline(0.0, color=VERMILLION, linewidth=1.2)
    names = [run.outline.name for run in team]
    keys = tuple(Key(name, colour_of(k)) for k, name in enumerate(names if len(names) <= MOST_KEYS else []))
    worst = [(float(np.nanmax(v)), k) for k, v in errors.items() if bool(np.isfinite(v).any())]
    most = max(worst, default=(math.nan, 0))
    told = f" The largest position error is {names[most[1]]}'s." if worst else ""
    caption = f"Errors are those of the true position against each robot's own estimate.{told}"
    alt = "Position error, clearance and distance to go of each robot over time"
    return Illustration(slug, title, alt, caption, render(figure, slug, alt), keys)
