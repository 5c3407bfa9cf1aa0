"""The planned path of cells under the smooth curve along it (rover report, figure 12)."""

from __future__ import annotations

import numpy as np
import scipy

from pilotage.core.types import FloatArray
from pilotage.records.run_data import RunData
from pilotage.report import quantities
from pilotage.report.figures.terrain_estimate import thinned
from pilotage.report.figures.terrain_map import corners, ground_axes, show_ground, tinted, unit_of
from pilotage.report.style import GREEN, ORANGE, YELLOW, Illustration, Key, render

WINDOW_M = 600.0
"""Side of what is shown: the two cannot be told apart on the whole map."""


def curve_figure(run: RunData) -> Illustration:
    """Draw path and curve where they are farthest apart."""
    slug, title = "curve", "The planned path under the curve"
    pictures = run.terrain
    nothing = Illustration(slug, title, "", "No curve was laid along a planned path.")
    if pictures is None or not run.trace.has("ref_x_m", "ref_y_m"):
        return nothing
    route = pictures.route[np.isfinite(pictures.route).all(axis=1)]
    curve = np.column_stack([run.trace["ref_x_m"], run.trace["ref_y_m"]])
    curve = curve[np.isfinite(curve).all(axis=1)]
    if len(curve) < 2 or not len(route):
        return nothing
    apart = _distances(curve, route)
    worst = curve[int(apart.argmax())]
    unit = unit_of(pictures)
    half = 0.5 * WINDOW_M / unit
    rim = corners(pictures)
    low, high = rim.min(axis=0), rim.max(axis=0)
    centre = np.clip(worst / unit, low, high)
    figure, axes = ground_axes(pictures, np.maximum(centre - half, low), np.minimum(centre + half, high))
    ground = pictures.hazards if pictures.ground is None else pictures.ground
    show_ground(axes, pictures, tinted(ground, pictures.hazards, ORANGE, 0.45))
    near = np.abs(route - worst).max(axis=1) < WINDOW_M
    axes.plot(*(route[near] / unit).T, color=YELLOW, linewidth=3.0, zorder=5)
    close = np.abs(curve - worst).max(axis=1) < WINDOW_M
    axes.plot(*(thinned(curve[close]) / unit).T, color=GREEN, linewidth=1.6, zorder=6)
    alt = "Part of the planned path of cells with the smooth curve along it"
    length = quantities.length(float(np.hypot(*np.diff(route, axis=0).T).sum()))
    caption = (
        f"Where the two are farthest apart, {quantities.length(float(apart.max()))}; on average they are "
        f"{quantities.length(float(apart.mean()))} apart. The path over cells is {length} long."
    )
    keys = (Key("path over cells", YELLOW), Key("curve", GREEN))
    return Illustration(slug, title, alt, caption, render(figure, slug, alt), keys)


def _distances(curve: FloatArray, route: FloatArray) -> FloatArray:
    """(N,) of the curve's points from the path, whose pieces are as short as a cell."""
    steps = np.hypot(*np.diff(route, axis=0).T)
    along = np.concatenate([[0.0], np.cumsum(steps)])
    fine = np.linspace(0.0, along[-1], min(200_000, 10 * len(route)))
    points = np.column_stack([np.interp(fine, along, route[:, i]) for i in range(2)])
    return np.asarray(scipy.spatial.cKDTree(points).query(curve)[0], dtype=np.float64)
