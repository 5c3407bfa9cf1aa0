"""The ground along the path: height, slope, and distance from hazards."""

from __future__ import annotations

import math

import numpy as np

from pilotage.core.types import FloatArray
from pilotage.records.numbers import number
from pilotage.records.run_data import RunData
from pilotage.report import quantities
from pilotage.report.style import (
    BLUE,
    GREEN,
    ORANGE,
    VERMILLION,
    Illustration,
    Key,
    nice_limit,
    peak,
    render,
    series,
    stacked_axes,
)


def terrain_profile_figure(run: RunData) -> Illustration:
    """Draw height and slope over the distance along the path."""
    slug, title = "profile", "The ground along the path"
    trace = run.trace
    if not trace.has("elevation_m") or not _leads_on(trace["distance_m"]):
        return Illustration(slug, title, "", "No heights are known along the path.")
    unit, s = _distances(run)
    figure, (height, slope) = stacked_axes(["Height [m]", "Slope of the ground [°]"], (150.0, 110.0))
    series(height, s, trace["elevation_m"], BLUE, linewidth=1.3)
    degrees = np.rad2deg(trace["slope_rad"])
    series(slope, s, degrees, ORANGE)
    pictures = run.terrain
    limit = math.nan if pictures is None else pictures.slope_limit_deg
    keys = [Key("height", BLUE), Key("slope", ORANGE)]
    if math.isfinite(limit):
        slope.axhline(limit, color=VERMILLION, linewidth=1.2, linestyle=(0, (4.0, 2.5)))
        keys.append(Key("limit", VERMILLION, "dash"))
    slope.set_ylim(0.0, nice_limit(max(peak(degrees), limit if math.isfinite(limit) else 0.0)))
    for axes in (height, slope):
        axes.set_xlim(0.0, s[-1])
    slope.set_xlabel(f"distance along the path [{unit}]", labelpad=3.0)
    climb, descent = (number(run.metrics.get(key)) for key in ("climb_m", "descent_m"))
    alt = "Height and slope over the distance along the path"
    caption = (
        f"It climbs {quantities.length(climb)} and descends {quantities.length(descent)} in all. The slope "
        "is the ground's steepest in each cell, whatever direction the way takes over it."
    )
    return Illustration(slug, title, alt, caption, render(figure, slug, alt), tuple(keys))


def hazard_distance_figure(run: RunData) -> Illustration:
    """Draw how far the path keeps from hazards."""
    slug, title = "hazard-distance", "Distance from hazards"
    trace = run.trace
    if not trace.has("hazard_distance_m") or not _leads_on(trace["distance_m"]):
        return Illustration(slug, title, "", "There is no path to measure along.")
    if not np.isfinite(trace["hazard_distance_m"]).any():
        return Illustration(
            slug, title, "", "No hazard lies so near to the path that its distance is measured."
        )
    unit, s = _distances(run)
    figure, (axes,) = stacked_axes(["Distance from the nearest hazard's edge [m]"], (130.0,))
    away = trace["hazard_distance_m"]
    series(axes, s, away, GREEN)
    least = int(np.nanargmin(away))
    axes.set_xlim(0.0, s[-1])
    axes.set_ylim(0.0, nice_limit(peak(away)))
    axes.set_xlabel(f"distance along the path [{unit}]", labelpad=3.0)
    axes.set_title(
        f"least: {quantities.length(float(away[least]))}", loc="right", color=VERMILLION, fontsize=9.0
    )
    alt = f"Distance from hazards along the path; the least is {quantities.length(float(away[least]))}"
    caption = (
        "How far the drive truly was from what is too steep; zero is on it."
        if trace.has("true_x_m")
        else "A shortest path touches the corners that it turns around: half a cell is the least that a "
        "path over cells' centres can keep without an inflation."
    )
    return Illustration(
        slug, title, alt, caption, render(figure, slug, alt), (Key("distance from hazards", GREEN),)
    )


def _leads_on(distances: FloatArray) -> bool:
    """Whether there is a path to measure along."""
    known = bool(np.isfinite(distances).all())
    return known and len(distances) > 1 and float(distances[-1]) > 1e-9 * float(np.abs(distances).max())


def _distances(run: RunData) -> tuple[str, FloatArray]:
    """Distances along the path and their unit."""
    s = run.trace["distance_m"]
    return ("km", s / 1000.0) if s[-1] >= 5000.0 else ("m", s)
