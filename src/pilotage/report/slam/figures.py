"""Figures of a mapped recording: the map, before and after, how it grew, and how sure its path is."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure
from numpy.typing import NDArray

from pilotage.core.types import FloatArray
from pilotage.maps.occupancy_grid import OccupancyArray
from pilotage.records.slam_folder import SlamFolder
from pilotage.report.style import (
    BLUE,
    FAINT,
    GREEN,
    INK,
    MUTED,
    ORANGE,
    SHADE,
    VERMILLION,
    WIDTH_PT,
    Illustration,
    Key,
    nice_limit,
    render,
    series,
    stacked_axes,
    time_limits,
)

STAGES = 4
MOST_POINTS = 12_000
"""Dots in a panel: more than the page can show apart."""
MOST_CELLS = 2500
"""Cells of the map along its longer side, likewise."""


def map_figure(data: SlamFolder) -> Illustration:
    """Draw the map with the path and the loops that were closed."""
    grid = data.grid
    width, height = grid.size_m
    figure, axes = _square_axes(width, height)
    x0, y0 = grid.origin.x_m, grid.origin.y_m
    step = -(-max(grid.cells.shape) // MOST_CELLS)
    shades = _shades(grid.cells, step)
    tall_m, wide_m = (size * step * grid.resolution_m for size in shades.shape[:2])
    axes.imshow(
        shades,
        extent=(x0, x0 + wide_m, y0 + height - tall_m, y0 + height),
        interpolation="none",
        zorder=0,
    )
    axes.plot(data.poses[:, 0], data.poses[:, 1], color=BLUE, linewidth=0.9, zorder=3, gid="layer-path")
    lines = _closure_lines(data, True)
    axes.add_collection(LineCollection(lines, colors=GREEN, linewidths=0.8, zorder=4), autolim=False)
    axes.collections[-1].set_gid("layer-loops")
    axes.set_xlim(x0, x0 + width)
    axes.set_ylim(y0, y0 + height)
    alt = "Occupancy grid with the path and the closed loops"
    count = data.metrics["closures_accepted"]
    caption = (
        f"White is free, dark is wall, grey was never seen; cells of {grid.resolution_m:g} m. The path is "
        "that of the scanner after the last optimization"
        + (
            f"; each of the {count} green lines joins the middles of two stretches of the path that were "
            "found to see the same walls."
            if count
            else "."
        )
    )
    loops = (Key("closed loops", GREEN, "line", "loops"),) if count else ()
    keys = (Key("path", BLUE, "line", "path"), *loops)
    return Illustration("map", "The map", alt, caption, render(figure, "map", alt), keys)


def before_after_figure(data: SlamFolder) -> Illustration:
    """Draw the keyframes' points at the poses of the front end alone, and at the last ones."""
    figure = Figure(figsize=(WIDTH_PT / 72.0, 0.5 * WIDTH_PT / 72.0))
    both = (
        ("before: matching alone", data.before, data.keyframes.before),
        ("after", data.poses, data.keyframe_poses),
    )
    for index, (title, poses, keyframe_poses) in enumerate(both):
        axes = figure.add_axes((0.05 + 0.49 * index, 0.07, 0.44, 0.85))
        axes.set_title(title)
        _dots(axes, _cloud(data, keyframe_poses, len(data.keyframes)))
        axes.plot(poses[:, 0], poses[:, 1], color=ORANGE if index == 0 else BLUE, linewidth=0.8)
        axes.set_aspect("equal", adjustable="datalim")
    end = data.poses[-1, :2] - data.before[-1, :2]
    caption = (
        "What the scans show, put where the front end alone had it and where the closed graph has it. The "
        "end "
        f"of the path moved by {float(np.hypot(*end)):.2f} m; walls drawn twice on the left are one "
        "on the right."
    )
    alt = "Points of all keyframes before and after the loops were closed"
    return Illustration("before", "Before and after", alt, caption, render(figure, "before", alt))


def growth_figure(data: SlamFolder) -> Illustration:
    """Draw the map after each quarter of the recording."""
    figure = Figure(figsize=(WIDTH_PT / 72.0, 0.27 * WIDTH_PT / 72.0))
    everything = _cloud(data, data.keyframe_poses, len(data.keyframes))
    low, high = everything.min(axis=0), everything.max(axis=0)
    high = np.maximum(high, low + data.grid.resolution_m)  # of scans that saw one point, or nothing
    for stage in range(1, STAGES + 1):
        axes = figure.add_axes((0.01 + 0.247 * (stage - 1), 0.02, 0.235, 0.84))
        until = data.keyframes.since + max(1, (len(data.keyframes) - data.keyframes.since) * stage // STAGES)
        scan = int(data.keyframes.scans[until - 1])
        axes.set_title(f"after {data.t_s[scan] - data.t_s[0]:.0f} s")
        _dots(axes, _cloud(data, data.keyframe_poses, until))
        axes.plot(data.poses[:scan, 0], data.poses[:scan, 1], color=BLUE, linewidth=0.6)
        axes.plot(*data.poses[scan, :2], marker="o", markersize=3.5, color=VERMILLION)
        axes.set_xlim(low[0], high[0])
        axes.set_ylim(low[1], high[1])
        axes.set_aspect("equal", adjustable="box", anchor="C")
        axes.set_axis_off()
    alt = "The map after each quarter of the recording"
    known = " The walls of the earlier map are there from the start." if data.keyframes.since else ""
    caption = f"The map as it grew, with the path so far and where the robot was.{known}"
    return Illustration("growth", "How the map grew", alt, caption, render(figure, "growth", alt))


def uncertainty_figure(data: SlamFolder) -> Illustration:
    """Draw the standard deviations of position and heading along the path, with the loops' times."""
    figure, (position, heading) = stacked_axes(
        ["standard deviation of the position [m]", "standard deviation of the heading [deg]"], [120.0, 90.0]
    )
    t_s = data.t_s - data.t_s[0]
    largest = np.sqrt(np.linalg.eigvalsh(data.covariances[:, :2, :2])[:, -1])
    angle = np.degrees(np.sqrt(data.covariances[:, 2, 2]))
    series(position, t_s, largest, BLUE)
    series(heading, t_s, angle, BLUE)
    ticks = [c.later_t_s - data.t_s[0] for c in data.closures if c.accepted]
    for axes, values in ((position, largest), (heading, angle)):
        axes.set_ylim(0.0, nice_limit(float(values.max())))
        axes.plot(ticks, np.zeros(len(ticks)), "|", color=GREEN, markersize=7.0, clip_on=False)
    time_limits([position, heading], t_s)
    caption = (
        "How unsure the path is, seen from its first scan: the larger axis of the position's ellipse, and "
        "the heading."
        + (" Green ticks are the later ends of closed loops, where the graph learns most." if ticks else "")
    )
    loops = (Key("a loop was closed", GREEN, "spot"),) if ticks else ()
    keys = (Key("standard deviation", BLUE), *loops)
    alt = "Standard deviations along the path"
    return Illustration(
        "uncertainty", "Uncertainty along the path", alt, caption, render(figure, "uncertainty", alt), keys
    )


def _shades(cells: OccupancyArray, step: int) -> NDArray[np.uint8]:
    """Colours (rows, columns, 3) of squares of ``step`` cells: of the greatest of each, wall before free.

    Ready colours: through a table of them matplotlib would make 30 bytes of each.
    """
    for axis in (0, 1):
        cells = np.maximum.reduceat(cells, np.arange(0, cells.shape[axis], step), axis=axis)
    colours = np.rint(255.0 * np.array([to_rgb(colour) for colour in (SHADE, "#ffffff", INK)]))
    out = np.empty((*cells.shape, 3), np.uint8)
    for shown, row in zip(out, cells, strict=True):
        shown[:] = colours[np.digitize(row, (0, 51))]
    return out


def _square_axes(width_m: float, height_m: float) -> tuple[Figure, Axes]:
    """One panel to scale, as wide as the page."""
    drawn_pt = WIDTH_PT - 50.0
    tall_pt = min(drawn_pt * height_m / width_m, 900.0)
    total = tall_pt + 40.0
    figure = Figure(figsize=(WIDTH_PT / 72.0, total / 72.0))
    axes = figure.add_axes((40.0 / WIDTH_PT, 28.0 / total, drawn_pt / WIDTH_PT, tall_pt / total))
    axes.set_aspect("equal", adjustable="box", anchor="C")
    axes.grid(visible=False)
    axes.set_xlabel("x [m]", labelpad=3.0)
    axes.tick_params(colors=FAINT, labelcolor=MUTED)
    return figure, axes


def _closure_lines(data: SlamFolder, accepted: bool) -> list[FloatArray]:
    chosen = [c for c in data.closures if c.accepted is accepted]
    return [
        np.array([data.reference(c.earlier_submap)[:2], data.reference(c.later_submap)[:2]]) for c in chosen
    ]


def _cloud(data: SlamFolder, poses: FloatArray, until: int) -> FloatArray:
    """Points (K, 2) of the first keyframes at given poses of theirs, thinned evenly."""
    chosen = np.arange(
        0, int(data.keyframes.starts[until]), max(1, int(data.keyframes.starts[until]) // MOST_POINTS)
    )
    if not chosen.size:
        return np.zeros((1, 2))
    pose = poses[np.searchsorted(data.keyframes.starts, chosen, side="right") - 1]
    c, s = np.cos(pose[:, 2]), np.sin(pose[:, 2])
    x, y = data.keyframes.points_xy_m[chosen].astype(np.float64).T
    return np.column_stack([pose[:, 0] + c * x - s * y, pose[:, 1] + s * x + c * y])


def _dots(axes: Axes, points: FloatArray) -> None:
    """Dots as an image within the drawing: as elements they would be most of the page."""
    axes.plot(points[:, 0], points[:, 1], ",", color=INK, alpha=0.5, rasterized=True)
