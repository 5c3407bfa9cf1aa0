"""The path over the ground and over the hazards, and what the search looked at."""

from __future__ import annotations

import math

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patheffects import Normal, Stroke
from matplotlib.transforms import Affine2D
from numpy.typing import NDArray

from pilotage.core.types import FloatArray
from pilotage.records.numbers import number
from pilotage.records.run_data import RunData
from pilotage.records.terrain import Picture, TerrainPictures
from pilotage.report import quantities
from pilotage.report.figures.map_view import room_at_left_pt
from pilotage.report.figures.terrain_estimate import (
    POSITION_COVARIANCE,
    estimate_layers,
    region_name,
    regions_told,
    thinned,
)
from pilotage.report.style import BLUE, GREEN, ORANGE, SKY, VERMILLION, WIDTH_PT, Illustration, Key, render

_LEFT_PT, _RIGHT_PT, _TOP_PT, _BOTTOM_PT = 44.0, 8.0, 8.0, 32.0
_MOST_HEIGHT_PT = 900.0
MARGIN = 0.06
"""Around the path seen from near, as a share of its extent."""
_NOTHING = "The run left no picture of its ground."

Rgb = NDArray[np.uint8]


def terrain_map_figure(run: RunData) -> Illustration:
    """Draw the path over the shaded ground, hazards tinted."""
    slug, title = "terrain", "The path over the ground"
    pictures = run.terrain
    if pictures is None:
        return Illustration(slug, title, "", _NOTHING)
    if pictures.ground is None:
        return Illustration(slug, title, "", "The ground was given as hazards only; see below.")
    figure, axes = ground_axes(pictures)
    show_ground(axes, pictures, tinted(pictures.ground, pictures.hazards, ORANGE, 0.45))
    drawn = _path(axes, run, pictures, SKY)
    limit = pictures.slope_limit_deg
    steep = f"steeper than {limit:g}°" if math.isfinite(limit) else "hazards"
    alt = "Shaded map of the ground with the path"
    keys = (*drawn, Key(steep, ORANGE, "band"))
    caption = f"The ground lit from the north-west, what is {steep} tinted. {_told(run)}"
    return Illustration(slug, title, alt, caption, render(figure, slug, alt), keys)


def close_up_figure(run: RunData) -> Illustration:
    """Draw the path and its estimate, hazards tinted, as large as the page allows."""
    slug, title = "close-up", "The path from near"
    pictures = run.terrain
    if pictures is None or not run.trace.has("true_x_m", "est_x_m"):
        return Illustration(slug, title, "", "The mission has no estimator.")
    unit = unit_of(pictures)
    shown = np.column_stack([run.trace[name] for name in ("true_x_m", "true_y_m")]) / unit
    estimate = np.column_stack([run.trace[name] for name in ("est_x_m", "est_y_m")]) / unit
    both = np.vstack([shown, estimate])
    both = both[np.isfinite(both).all(axis=1)]
    if not len(both):
        return Illustration(slug, title, "", "No pose of the run is known.")
    margin = MARGIN * max(float(np.ptp(both, axis=0).max()), 1.0 / unit)
    low, high = both.min(axis=0) - margin, both.max(axis=0) + margin
    figure, axes = ground_axes(pictures, low, high)
    ground = pictures.hazards if pictures.ground is None else pictures.ground
    show_ground(axes, pictures, tinted(ground, pictures.hazards, ORANGE, 0.45))
    keys = _path(axes, run, pictures, SKY)
    alt = "The path, its estimate and the regions that it may be in, from near"
    caption = f"The {region_name(run)}s stand at equal distances along the path. {regions_told(run)}".rstrip()
    return Illustration(slug, title, alt, caption, render(figure, slug, alt), tuple(keys))


def hazard_map_figure(run: RunData) -> Illustration:
    """Draw the path over the hazards, white on black as obstacle maps are."""
    slug, title = "hazards", "The path between the hazards"
    pictures = run.terrain
    if pictures is None:
        return Illustration(slug, title, "", _NOTHING)
    if not pictures.hazards.any():
        return Illustration(slug, title, "", "The ground has no hazards.")
    figure, axes = ground_axes(pictures)
    show_ground(axes, pictures, np.repeat(pictures.hazards[..., None], 3, axis=2))
    drawn = _path(axes, run, pictures, SKY if run.trace.has("est_x_m") else VERMILLION)
    alt = "Map of the hazards, white, with the path"
    share = quantities.share(float(pictures.hazards.mean()) / 255.0)
    caption = f"Hazards are white, as in the obstacle map of the report; they cover {share} of the map."
    return Illustration(slug, title, alt, caption, render(figure, slug, alt), tuple(drawn))


def looked_at_figure(run: RunData) -> Illustration:
    """Draw where the search went."""
    slug, title = "looked-at", "What the search looked at"
    pictures = run.terrain
    if pictures is None or pictures.looked_at is None:
        return Illustration(slug, title, "", "The planner does not tell what it looked at.")
    figure, axes = ground_axes(pictures)
    grey = (255 - (pictures.hazards.astype(np.uint16) * 90) // 255).astype(np.uint8)
    show_ground(axes, pictures, tinted(grey, _spread(pictures.looked_at), BLUE, 1.0))
    _path(axes, run, pictures)
    expansions = quantities.count(number(run.metrics.get("expansions")))
    alt = "Map of the cells that the search queued"
    caption = (
        f"Cells that the search put into its queue, blue; hazards grey. It opened {expansions} cells. A "
        "search by jump points passes over all between them unqueued, so that only corners and turns show."
    )
    keys = (Key("planned path", VERMILLION), Key("queued", BLUE, "band"))
    return Illustration(slug, title, alt, caption, render(figure, slug, alt), keys)


def _told(run: RunData) -> str:
    """Length and effort in a sentence."""
    driven = number(run.metrics.get("path_length_m"))
    if math.isfinite(driven):
        return f"The path is {quantities.length(driven)} long. {regions_told(run)}".rstrip()
    planned = number(run.metrics.get("planned_length_m"))
    if not math.isfinite(planned):
        return "No path was found."
    nodes = quantities.count(number(run.metrics.get("path_nodes")))
    return f"The path is {quantities.length(planned)} long and has {nodes} nodes."


def ground_axes(
    pictures: TerrainPictures, low: FloatArray | None = None, high: FloatArray | None = None
) -> tuple[Figure, Axes]:
    """Axes to scale around a part of the map or all of it, in kilometres where it is large."""
    if low is None or high is None:
        rim = corners(pictures)
        low, high = rim.min(axis=0), rim.max(axis=0)
    unit = "km" if unit_of(pictures) > 1.0 else "m"
    figure, axes = _axes_beside(low, high, _LEFT_PT, unit)
    left_pt = room_at_left_pt(axes)
    return (figure, axes) if left_pt <= _LEFT_PT else _axes_beside(low, high, left_pt, unit)


def _axes_beside(low: FloatArray, high: FloatArray, left_pt: float, unit: str) -> tuple[Figure, Axes]:
    width = WIDTH_PT - left_pt - _RIGHT_PT
    height = min(_MOST_HEIGHT_PT, width * (high[1] - low[1]) / (high[0] - low[0]))
    total = height + _TOP_PT + _BOTTOM_PT
    figure = Figure(figsize=(WIDTH_PT / 72.0, total / 72.0))
    axes = figure.add_axes((left_pt / WIDTH_PT, _BOTTOM_PT / total, width / WIDTH_PT, height / total))
    axes.set_aspect("equal")
    axes.set_xlim(low[0], high[0])
    axes.set_ylim(low[1], high[1])
    axes.grid(visible=False)
    axes.set_xlabel(f"x [{unit}]", labelpad=2.0)
    axes.set_ylabel(f"y [{unit}]", labelpad=2.0)
    return figure, axes


def unit_of(pictures: TerrainPictures) -> float:
    """Metres of the axes' unit."""
    return 1000.0 if pictures.size_m.max() >= 5000.0 else 1.0


def corners(pictures: TerrainPictures) -> FloatArray:
    """(4, 2) corners of the map in the axes' unit."""
    width, height = pictures.size_m
    own = np.array([[0.0, 0.0], [width, 0.0], [width, height], [0.0, height]])
    return np.asarray(_to_map(pictures).transform(own))


def _to_map(pictures: TerrainPictures) -> Affine2D:
    x, y, turned = pictures.origin
    unit = unit_of(pictures)
    return Affine2D().rotate(turned).translate(x, y).scale(1.0 / unit)


def show_ground(axes: Axes, pictures: TerrainPictures, rgb: Rgb) -> None:
    width, height = pictures.size_m
    limits = axes.get_xlim(), axes.get_ylim()
    axes.imshow(
        rgb,
        extent=(0.0, width, 0.0, height),
        # Without resampling the picture goes into the page as it is.
        interpolation="none",
        transform=_to_map(pictures) + axes.transData,
        zorder=0.1,
    )
    axes.set_xlim(limits[0])
    axes.set_ylim(limits[1])


def _path(axes: Axes, run: RunData, pictures: TerrainPictures, colour: str = VERMILLION) -> list[Key]:
    """Draw the path, planned or true, with its estimate where there is one; return what was drawn."""
    unit = unit_of(pictures)
    dark = [Stroke(linewidth=3.4, foreground="#12212f"), Normal()]
    driven = run.trace.has("true_x_m", "true_y_m")
    names = ("true_x_m", "true_y_m") if driven else ("path_x_m", "path_y_m")
    points = thinned(np.column_stack([run.trace[name] for name in names])) / unit
    keys = [Key("true path" if driven else "planned path", colour)]
    if len(points) > 1:
        axes.plot(*points.T, color=colour, linewidth=1.8, path_effects=dark, zorder=5)
    if run.trace.has("est_x_m", "distance_m", *POSITION_COVARIANCE):
        keys += estimate_layers(axes, run, pictures.landmarks, unit)
    for name, place, dot in _places(run, pictures):
        x, y = place / unit
        axes.plot([x], [y], "o", color=dot, markersize=8.0, markeredgecolor="white", zorder=6)
        axes.annotate(
            name,
            (x, y),
            xytext=(0.0, 9.0),
            textcoords="offset points",
            ha="center",
            color="white",
            fontsize=9.5,
            fontweight="bold",
            path_effects=[Stroke(linewidth=2.6, foreground="#12212f"), Normal()],
            zorder=7,
        )
    return keys


def _places(run: RunData, pictures: TerrainPictures) -> list[tuple[str, FloatArray, str]]:
    """The start, and every goal in order."""
    told = run.world.robots[0].goals if run.world.robots else ()
    goals = [("goal", pictures.goal, VERMILLION)]
    if len(told) > 1:
        goals = [(f"goal {n}", np.array(goal[:2]), VERMILLION) for n, goal in enumerate(told, start=1)]
    return [("start", pictures.start, GREEN), *goals]


def tinted(grey: Picture, share: Picture, colour: str, strength: float) -> Rgb:
    """A grey picture mixed with a colour by the share of marked cells."""
    tint = np.array([int(colour[i : i + 2], 16) for i in (1, 3, 5)], dtype=np.float32)
    part = share.astype(np.float32)[..., None] * np.float32(strength / 255.0)
    return np.asarray(grey[..., None] * (1.0 - part) + tint * part, dtype=np.uint8)


def _spread(share: Picture) -> Picture:
    """Make single queued cells visible: one of sixteen in a block is shown in full."""
    return np.asarray(np.minimum(255, share.astype(np.uint16) * 16), dtype=np.uint8)
