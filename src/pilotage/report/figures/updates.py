"""Updates explained: the scan by its clusters, the lines, the walls they met, and what became of each."""

from __future__ import annotations

import math

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.path import Path as Outline

from pilotage.core.scan_update import LineVerdict
from pilotage.core.types import FloatArray, Pose2
from pilotage.records.run_data import RunData
from pilotage.records.updates import RecordedUpdate
from pilotage.report.figures import layers
from pilotage.report.figures.badge import badge
from pilotage.report.figures.placing import LabelPlacer, along
from pilotage.report.light_axes import LightAxes
from pilotage.report.style import (
    BLACK,
    BLUE,
    FAINT,
    GREEN,
    INK,
    MUTED,
    ORANGE,
    PURPLE,
    SKY,
    VERMILLION,
    WIDTH_PT,
    Illustration,
    Key,
    one_shape,
    render,
)

SLUG = "updates"
TITLE = "Updates explained"
COLUMNS = 2
_LEFT_PT, _RIGHT_PT, _TOP_PT, _GAP_PT = 22.0, 4.0, 20.0, 26.0
_MAP_PT, _ROW_PT, _ROWS_TOP_PT, _PANEL_GAP_PT = 230.0, 11.0, 20.0, 30.0
_DOT_PT, _THIN_PT = 1.9, 1.3
CLUSTER_COLOURS = (BLUE, ORANGE, PURPLE, "#7a5400", "#5b4b9a")
"""In turn; neighbours differ."""
VERDICT_COLOURS = {
    LineVerdict.ACCEPTED: GREEN,
    LineVerdict.AMBIGUOUS: "#9a6700",
    LineVerdict.GATED: VERMILLION,
    LineVerdict.NO_WALL: VERMILLION,
    LineVerdict.AT_ODDS: VERMILLION,
}


def updates_figure(run: RunData) -> Illustration:
    """Draw a panel for each recorded update, with a list of its lines below."""
    updates = run.updates
    if not updates:
        return Illustration(SLUG, TITLE, "", "The run recorded no updates that could be explained.")
    rows = [updates[k : k + COLUMNS] for k in range(0, len(updates), COLUMNS)]
    heights = [
        _TOP_PT + _MAP_PT + _ROWS_TOP_PT + _ROW_PT * max(len(update.verdicts) for update in row)
        for row in rows
    ]
    total = sum(heights) + _PANEL_GAP_PT * (len(rows) - 1) + 4.0
    width = (WIDTH_PT - _LEFT_PT - _RIGHT_PT - (COLUMNS - 1) * _GAP_PT) / COLUMNS
    figure = Figure(figsize=(WIDTH_PT / 72.0, total / 72.0))
    top = total
    for row, height in zip(rows, heights, strict=True):
        for column, update in enumerate(row):
            left = _LEFT_PT + column * (width + _GAP_PT)
            bottom = top - _TOP_PT - _MAP_PT
            axes = figure.add_axes(
                (left / WIDTH_PT, bottom / total, width / WIDTH_PT, _MAP_PT / total), axes_class=LightAxes
            )
            _panel(axes, run, update, width)
            _list(figure, update, left, bottom - _ROWS_TOP_PT, total)
        top -= height + _PANEL_GAP_PT
    caption = (
        "Scans where the robot believed itself to be just before the update, in metres like the map: what "
        "does not lie on a wall yet is what the update mends. Points are coloured by cluster, those of none "
        "(small clusters, no return) grey; a numbered line runs along the points that it was fitted to, and "
        "the wall that it was matched to is green. The list gives each line's squared Mahalanobis distance "
        "from its wall (chi-square, two degrees of freedom) against the gate, and what became of it. Blue "
        "is the robot before, its outline after. Shown are the first update, those with most lines left "
        "out, the farthest line that was still accepted, and some on the way."
    )
    candidates = (
        (True, Key("wall of the map", INK)),
        (True, Key("matched wall", GREEN, "band")),
        (True, Key("points by cluster", BLUE, "spot")),
        (True, Key("fitted line", BLACK)),
        (run.world.has_obstacles, Key("unexpected obstacle", ORANGE, "band", opacity=1.0)),
    )
    keys = tuple(key for there, key in candidates if there)
    alt = "Scans with their clusters, fitted lines and matched walls: " + "; ".join(
        f"{update.why} at {update.t_s:.1f} s" for update in updates
    )
    return Illustration(SLUG, TITLE, alt, caption, render(figure, SLUG, alt), keys)


def _panel(axes: Axes, run: RunData, update: RecordedUpdate, width_pt: float) -> None:
    """The scan on the map."""
    limits = _limits(update, width_pt / _MAP_PT)
    scale = width_pt / (limits[2] - limits[0])  # points a metre
    axes.set_xlim(limits[0], limits[2])
    axes.set_ylim(limits[1], limits[3])
    axes.set_autoscale_on(False)
    axes.tick_params(length=0.0)
    axes.locator_params(nbins=6)
    axes.set_title(f"{update.t_s:.1f} s: {update.why}", fontsize=9.0)
    accepted = update.walls_m[np.isfinite(update.walls_m).all(axis=1)]
    layers.segments(axes, accepted, "matched", color="#b4e3d5", linewidth=7.5, zorder=4)
    layers.segments(axes, run.world.segments_m, "walls", color=INK, linewidth=1.0, zorder=5)
    layers.circles(axes, run.world.circles_m, "walls", facecolor="#c5ccd3", edgecolor=INK, zorder=5)
    layers.draw_obstacles(axes, run.world)
    labels = np.unique(update.clusters)
    for label in labels:
        colour = FAINT if label < 0 else CLUSTER_COLOURS[int(label) % len(CLUSTER_COLOURS)]
        _dots(axes, update.points_m[update.clusters == label], scale, colour, 6.0 if label < 0 else 6.1)
    layers.segments(axes, update.ends_m, "lines", color=BLACK, linewidth=0.8, zorder=7)
    radius, polygon_m = run.outline.radius_m or 0.3, run.outline.polygon_m
    to_base = Pose2.from_array(run.sightings.mount).inverse()
    for sensor, colour, filled in ((update.sensor_pose, SKY, True), (update.sensor_pose_after, INK, False)):
        base = Pose2.from_array(sensor).compose(to_base)
        layers.draw_body(
            axes, base.x_m, base.y_m, base.theta_rad, radius, colour, filled, 0.6, polygon_m=polygon_m
        )
    _badges(axes, update, limits, scale)
    # Walls go on beyond the panel: drawn there, they would cross its neighbours.
    for artist in axes.get_children():
        artist.set_clip_on(True)


def _badges(
    axes: Axes, update: RecordedUpdate, limits: tuple[float, float, float, float], scale: float
) -> None:
    """A number beside each line, off the points and off each other."""
    x0, y0, x1, y1 = limits
    to_pt = np.array([x0, y0])
    spots = np.vstack([along((update.points_m - to_pt) * scale, 4.0, 0.3), [[-99.0, -99.0, 0.0]]])
    placer = LabelPlacer(spots, (0.0, 0.0, (x1 - x0) * scale, (y1 - y0) * scale))
    for k, (line, verdict) in enumerate(zip(update.ends_m, update.verdicts, strict=True)):
        middle = (0.5 * (line[:2] + line[2:]) - to_pt) * scale
        middle = np.clip(middle, 0.0, [(x1 - x0) * scale, (y1 - y0) * scale])
        x, y = placer.place(float(middle[0]), float(middle[1]), 6.0, 6.0, np.array([3.0, 8.0, 14.0]))
        badge(axes, x0 + x / scale, y0 + y / scale, str(k + 1), VERDICT_COLOURS[verdict])


def _list(figure: Figure, update: RecordedUpdate, left_pt: float, top_pt: float, total_pt: float) -> None:
    """One row a line: number, chi-square value against the gate, verdict."""
    for k, (distance, verdict) in enumerate(zip(update.distances, update.verdicts, strict=True)):
        y = (top_pt - _ROW_PT * (k + 1)) / total_pt
        colour = VERDICT_COLOURS[verdict]
        said = MUTED if verdict is LineVerdict.ACCEPTED else colour
        for x, text, shade, weight in (
            (2.0, f"{k + 1:2d}", colour, "bold"),
            (16.0, _against(float(distance), update.gate), INK, "normal"),
            (104.0, str(verdict), said, "normal"),
        ):
            figure.text((left_pt + x) / WIDTH_PT, y, text, fontsize=7.5, color=shade, fontweight=weight)


def _against(distance: float, gate: float) -> str:
    """A chi-square value beside the gate's."""
    if not math.isfinite(distance):
        return "no wall to measure to"
    shown = (
        f"{distance:.2f}" if distance < 100.0 else f"{distance:.0f}" if distance < 1e5 else f"{distance:.0e}"
    )
    return f"χ² {shown} {'≤' if distance <= gate else '>'} {gate:.2f}"


def _dots(axes: Axes, points: FloatArray, scale: float, colour: str, zorder: float) -> None:
    """Small marks as one shape, thinned to what can be told apart on the page."""
    points = points[np.isfinite(points).all(axis=1)]
    if not len(points):
        return
    _, kept = np.unique(np.floor(points * scale / _THIN_PT).astype(np.int64), axis=0, return_index=True)
    half = _DOT_PT / scale
    corners = half * np.array([[-1.0, 0.0], [0.0, -1.0], [1.0, 0.0], [0.0, 1.0], [-1.0, 0.0]])
    marks = [Outline(point + corners, closed=True) for point in points[np.sort(kept)]]
    one_shape(axes, marks, facecolor=colour, zorder=zorder, gid="layer-points")


def _limits(update: RecordedUpdate, ratio: float) -> tuple[float, float, float, float]:
    """What a panel shows: the clustered points, the lines and the robot, with its width over height."""
    parts = [
        update.points_m[update.clusters >= 0],
        update.ends_m.reshape(-1, 2),
        update.sensor_pose[None, :2],
    ]
    points = np.concatenate(parts)
    points = points[np.isfinite(points).all(axis=1)]
    low, high = points.min(axis=0), points.max(axis=0)
    size = np.maximum(1.12 * (high - low), 2.0)
    size = np.maximum(size, np.array([size[1] * ratio, size[0] / ratio]))
    middle = 0.5 * (low + high)
    x0, y0 = middle - 0.5 * size
    x1, y1 = middle + 0.5 * size
    return float(x0), float(y0), float(x1), float(y1)
