"""A patrol on paper: idleness over time, on the map, how old the view of the floor is, who was where."""

from __future__ import annotations

import math

import numpy as np
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.colors import Normalize

from pilotage.records.numbers import number
from pilotage.records.patrol import PatrolRecord
from pilotage.records.run_data import RunData
from pilotage.report.figures import layers
from pilotage.report.figures.grid import draw_grid
from pilotage.report.figures.map_view import map_axes, view_limits
from pilotage.report.style import (
    BLUE,
    GREEN,
    INK,
    MUTED,
    VERMILLION,
    Illustration,
    Key,
    nice_limit,
    peak,
    render,
    series,
    stacked_axes,
    time_limits,
)
from pilotage.report.team import colour_of

MOST_POINTS = 1500
"""Of a curve; an hour of seconds would weigh more than it shows."""
SCALE = "viridis_r"


def patrol_figures(run: RunData) -> list[Illustration]:
    """All figures of a patrol; none of a run that is none."""
    patrol = run.patrol
    if patrol is None:
        return []
    return [
        _idleness_figure(run, patrol),
        _idleness_map(run, patrol),
        _age_map(run, patrol),
        _visits_figure(run, patrol),
    ]


def _idleness_figure(run: RunData, patrol: PatrolRecord) -> Illustration:
    slug, title = "idleness", "Idleness over time"
    table = patrol.series[:: max(1, math.ceil(len(patrol.series) / MOST_POINTS))]
    if not len(table):
        return Illustration(slug, title, "", "The run recorded no idleness.")
    figure, panels = stacked_axes(
        ["Idleness of the places [s]", "Age of the floor's view [s]"], [150.0, 110.0]
    )
    time_limits(panels, table[:, 0])
    for axes, (mean, worst) in zip(panels, ((1, 2), (4, 5)), strict=True):
        series(axes, table[:, 0], table[:, worst], VERMILLION, linewidth=1.0)
        series(axes, table[:, 0], table[:, mean], BLUE, linewidth=1.6)
        axes.set_ylim(0.0, nice_limit(peak(table[:, worst])))
    bound_s = number(run.metrics.get("idleness_bound_s"))
    keys = [Key("mean", BLUE), Key("worst", VERMILLION)]
    told = ""
    if math.isfinite(bound_s):
        panels[0].axhline(bound_s, color=GREEN, linewidth=1.2, linestyle=(0, (5, 3)))
        keys.append(Key("cyclic reference", GREEN, "dash"))
        told = f" The cyclic reference, {bound_s:.0f} s: the best closed tour over the team's summed speed."
    caption = f"All places count as visited, and the floor as seen, when the patrol begins.{told}"
    alt = "Mean and worst idleness of the places and age of the view of the floor over time"
    return Illustration(slug, title, alt, caption, render(figure, slug, alt), tuple(keys))


def _map(run: RunData) -> Axes | None:
    """The map with its walls; None without any."""
    limits = view_limits(run)
    if limits is None:
        return None
    _, axes, _ = map_axes(limits)
    if run.grid is None:
        layers.draw_walls(axes, run.world)
    else:
        draw_grid(axes, run.grid)
    return axes


def _scale(most_s: float) -> tuple[Normalize, str]:
    """A colour scale from 0 to ``most_s``, and in words."""
    most_s = max(most_s, 1.0)
    return Normalize(0.0, most_s), f"yellow is 0 s, dark blue {most_s:.0f} s"


def _idleness_map(run: RunData, patrol: PatrolRecord) -> Illustration:
    slug, title = "idleness-map", "Where it was idle"
    axes = _map(run)
    if axes is None:
        return Illustration(slug, title, "", "The run recorded no map.")
    places = patrol.vertices_xy_m
    edges = LineCollection(list(places[patrol.edges]), colors=MUTED, linewidths=0.7, zorder=3)
    edges.set_gid("edges")
    axes.add_collection(edges)
    tour = places[np.append(patrol.tour, patrol.tour[:1])]
    layers.line(axes, tour, "tour", color=BLUE, linewidth=2.0, alpha=0.45, zorder=4)
    norm, scale = _scale(float(np.nanmax(patrol.idleness_s, initial=0.0)))
    colours = colormaps[SCALE](norm(patrol.idleness_s))
    axes.scatter(places[:, 0], places[:, 1], s=70.0, c=colours, edgecolors=INK, linewidths=0.8, zorder=6)
    for k, (x, y) in enumerate(places):
        axes.annotate(
            str(k), (x, y), (5.0, 5.0), textcoords="offset points", fontsize=6.5, color=INK, zorder=7
        )
    keys = (Key("best closed tour", BLUE, "band", "tour"), Key("edges", MUTED, "line", "edges"))
    caption = (
        f"Mean time since each place's last visit ({scale}), and the tour of the cyclic reference; lines "
        "tell what is joined, the paths lead around walls."
    )
    alt = f"Map of {len(places)} places with their mean idleness"
    return Illustration(slug, title, alt, caption, render(axes.figure, slug, alt), keys)  # type: ignore[arg-type]


def _age_map(run: RunData, patrol: PatrolRecord) -> Illustration:
    slug, title = "age-map", "How old the view of the floor is"
    axes = _map(run) if len(patrol.cells_xy_m) else None
    if axes is None:
        return Illustration(slug, title, "", "The run recorded no view of the floor.")
    norm, scale = _scale(float(np.nanquantile(patrol.age_s, 0.99)))
    corners = 0.5 * patrol.cell_m * np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])
    cells = patrol.cells_xy_m[:, None] + corners
    colours = colormaps[SCALE](norm(patrol.age_s))
    tiles = PolyCollection(list(cells), facecolors=colours, linewidths=0.0, zorder=1, rasterized=True)
    axes.add_collection(tiles)
    caption = f"Mean time since each cell of the floor was truly in view of some robot's laser: {scale}."
    alt = f"Map of the floor's {len(cells)} cells with the mean age of their view"
    return Illustration(slug, title, alt, caption, render(axes.figure, slug, alt))  # type: ignore[arg-type]


def _visits_figure(run: RunData, patrol: PatrolRecord) -> Illustration:
    slug, title = "visits", "Who was where"
    if not len(patrol.visits):
        return Illustration(slug, title, "", "Nobody visited anything.")
    count = len(patrol.vertices_xy_m)
    figure, panels = stacked_axes(["Place"], [max(120.0, min(7.0 * count, 420.0))])
    axes = panels[0]
    times = patrol.series[:, 0] if len(patrol.series) else patrol.visits[:, 2]
    time_limits(panels, times)
    robots = patrol.visits[:, 0].astype(np.int64)
    names = run.robots or ("robot",)
    keys = []
    for robot in range(len(names)):
        own = patrol.visits[robots == robot]
        layer = f"visits-{robot}"
        drawn = axes.scatter(own[:, 2], own[:, 1], s=7.0, color=colour_of(robot), linewidths=0.0, zorder=3)
        drawn.set_gid(layer)
        keys.append(Key(names[robot], colour_of(robot), "spot", layer))
    axes.set_ylim(-0.8, count - 0.2)
    caption = "Every arrival at a place, in the colour of the robot: strips show whose share a place is."
    alt = f"Visits to {count} places over time by {len(names)} robots"
    return Illustration(slug, title, alt, caption, render(figure, slug, alt), tuple(keys))
