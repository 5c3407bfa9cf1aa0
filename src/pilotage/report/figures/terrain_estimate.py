"""How a rover's path is estimated: with its regions on the map, errors and covariance over time."""

from __future__ import annotations

import math

import numpy as np
from matplotlib.axes import Axes
from matplotlib.path import Path as Outline

from pilotage.core.types import FloatArray
from pilotage.evaluation.position_region import bent_regions, outlines
from pilotage.records.numbers import number
from pilotage.records.run_data import RunData
from pilotage.report import quantities
from pilotage.report.style import (
    BLUE,
    GREEN,
    MUTED,
    ORANGE,
    PURPLE,
    SHADE,
    VERMILLION,
    YELLOW,
    Illustration,
    Key,
    logarithmic,
    one_shape,
    peak,
    render,
    series,
    shade,
    stacked_axes,
)

ELLIPSES = 24
"""So many along the path, at equal distances."""
MOST_POINTS = 4000
POSITION_COVARIANCE = ("cov_xx_m2", "cov_xy_m2", "cov_yy_m2")
HOURS_S = 3600.0


def thinned(points: FloatArray) -> FloatArray:
    """Points that still show the path: the last one always among them."""
    step = max(1, math.ceil(len(points) / MOST_POINTS))
    return points if step == 1 else np.vstack([points[::step], points[-1:]])


def estimate_layers(axes: Axes, run: RunData, landmarks: FloatArray, unit: float) -> list[Key]:
    """Draw the estimated path, the regions along it and the landmarks; return their keys."""
    trace = run.trace
    estimate = np.column_stack([trace["est_x_m"], trace["est_y_m"]]) / unit
    axes.plot(*thinned(estimate).T, color=YELLOW, linewidth=1.1, zorder=5.4)
    chosen = _along(trace["distance_m"])
    bent = bent_regions(trace.columns)
    xx, xy, yy = (trace[name][chosen] for name in POSITION_COVARIANCE)
    covs = np.array([[xx, xy], [xy, yy]]).transpose(2, 0, 1)
    about = outlines(covs, None if bent is None else bent[chosen], _probability(run))
    shapes = [Outline(shape, closed=True) for shape in estimate[chosen, None] + about / unit]
    one_shape(axes, shapes, facecolor="none", edgecolor=VERMILLION, linewidth=1.0, zorder=5.6)
    keys = [Key("estimated path", YELLOW), Key(f"{region_name(run)}s", VERMILLION)]
    inside = landmarks / unit
    if len(inside):
        axes.plot(
            *inside.T,
            linestyle="none",
            marker="^",
            color=GREEN,
            markersize=3.6,
            markeredgecolor="white",
            markeredgewidth=0.4,
            zorder=4.5,
        )
        keys.append(Key("landmark", GREEN, "spot"))
    return keys


def regions_told(run: RunData) -> str:
    """How often the truth lies inside the regions."""
    share = number(run.metrics.get("ellipse_coverage"))
    if not math.isfinite(share):
        return ""
    return (
        f"In {quantities.share(share)} of the steps of this run the truth is inside the {region_name(run)}."
    )


def drive_figure(run: RunData) -> Illustration:
    """Speed, heading and turn rate over time (report figure 2)."""
    slug, title = "drive", "Speed, heading and turn rate"
    trace = run.trace
    if not trace.has("v_true_m_s", "w_true_rad_s", "true_theta_rad") or trace.steps < 2:
        return Illustration(slug, title, "", "The mission plans only: nothing is driven.")
    hours = trace.t_s / HOURS_S
    names = ["Speed [cm/s]", "Heading [rad]", "Turn rate [mrad/s]", "Steering angle of a bicycle [°]"]
    figure, panels = stacked_axes(names, (90.0, 90.0, 90.0, 90.0))
    series(panels[0], hours, 100.0 * trace["v_true_m_s"], BLUE, linewidth=1.4)
    series(panels[1], hours, np.unwrap(trace["true_theta_rad"]), GREEN, linewidth=1.4)
    series(panels[2], hours, 1e3 * trace["w_true_rad_s"], ORANGE, linewidth=1.2)
    series(panels[3], hours, np.rad2deg(trace["steering_rad"]), PURPLE, linewidth=1.2)
    panels[0].set_ylim(0.0, 1.15 * float(np.fmax(100.0 * peak(trace["v_true_m_s"]), 1e-6)))
    _over_hours(panels, hours)
    alt = "Speed, heading, turn rate and steering angle over time"
    caption = "The speed is at its limit until the goal is near, and ends in an exponential approach."
    if bool((trace["v_true_m_s"] == trace["v_true_m_s"][0]).all()):
        caption = "Along a planned curve the speed is constant; the turn rate follows the curvature."
    return Illustration(slug, title, alt, caption, render(figure, slug, alt))


def uncertainty_figure(run: RunData) -> Illustration:
    """Square root of the covariance's determinant over time and over distance (report figures 8, 11, 14)."""
    slug, title = "uncertainty", "How sure the rover is of its place"
    trace = run.trace
    if not trace.has("root_determinant_m2") or trace.steps < 2:
        return Illustration(slug, title, "", "The mission has no estimator.")
    hours, distance_km = trace.t_s / HOURS_S, trace["distance_m"] / 1000.0
    figure, (over_time, over_distance) = stacked_axes(
        [
            "Root of the determinant of the position's covariance [m²]",
            "The same over the distance driven [m²]",
        ],
        (130.0, 130.0),
        share_time=False,
    )
    values = np.maximum(trace["root_determinant_m2"], 1e-9)
    for axes, x, label in ((over_time, hours, "time [h]"), (over_distance, distance_km, "distance [km]")):
        series(axes, x, values, BLUE, linewidth=1.3)
        logarithmic(axes, 0.7 * float(np.nanmin(values)), 1.4 * float(np.nanmax(values)))
        blind = trace["beacons_seen"] == 0.0 if trace.has("beacons_seen") else np.zeros(len(x), bool)
        if blind.any() and not blind.all():
            edges = np.flatnonzero(np.diff(np.concatenate([[0], blind.astype(np.int8), [0]])))
            ends = np.minimum(edges, len(x) - 1)
            shade(axes, np.column_stack([x[ends[::2]], x[ends[1::2]]]), SHADE)
        axes.set_xlim(0.0, float(x[-1]) if x[-1] > 0.0 else 1.0)
        axes.set_xlabel(label, labelpad=3.0)
    alt = "Square root of the determinant of the position's covariance over time and over distance"
    blind_keys = (
        ()
        if not trace.has("beacons_seen") or not trace["beacons_seen"].any()
        else (Key("no landmark in sight", "#c3cad3", "band"),)
    )
    caption = (
        "The determinant's root is the area of the one-sigma ellipse over pi. It grows while no landmark is "
        "in sight and falls with the first one."
    )
    return Illustration(
        slug,
        title,
        alt,
        caption,
        render(figure, slug, alt),
        (Key("root of the determinant", BLUE), *blind_keys),
    )


def rover_error_figure(run: RunData) -> Illustration:
    """Error of the position beside its standard deviation, of the heading, and the NEES."""
    slug, title = "rover-error", "Errors and what the rover believes of them"
    trace = run.trace
    if not trace.has("est_x_m", "nees", "cov_tt_rad2", *POSITION_COVARIANCE) or trace.steps < 2:
        return Illustration(slug, title, "", "The mission has no estimator.")
    hours = trace.t_s / HOURS_S
    error = np.hypot(trace["est_x_m"] - trace["true_x_m"], trace["est_y_m"] - trace["true_y_m"])
    sigma = np.sqrt(np.maximum(trace["cov_xx_m2"] + trace["cov_yy_m2"], 0.0))
    turn = trace["est_theta_rad"] - trace["true_theta_rad"]
    heading = np.rad2deg(np.abs((turn + math.pi) % (2.0 * math.pi) - math.pi))
    figure, panels = stacked_axes(["Position [m]", "Heading [°]", "NEES (3 is ideal)"], (120.0, 90.0, 90.0))
    series(panels[0], hours, error, VERMILLION, linewidth=1.1)
    series(panels[0], hours, sigma, BLUE, linewidth=1.3)
    both = np.concatenate([error[error > 0.0], sigma])
    both = both[np.isfinite(both)]
    if both.size:
        logarithmic(panels[0], max(float(np.quantile(both, 0.002)), 1e-3), 1.4 * float(both.max()))
    series(panels[1], hours, heading, VERMILLION, linewidth=1.1)
    series(panels[1], hours, np.rad2deg(np.sqrt(np.maximum(trace["cov_tt_rad2"], 0.0))), BLUE, linewidth=1.3)
    series(panels[2], hours, trace["nees"], GREEN, linewidth=0.9)
    panels[2].axhline(3.0, color=MUTED, linewidth=1.0, linestyle=(0, (4.0, 3.0)))
    _over_hours(panels, hours)
    alt = "Position and heading error beside their standard deviations, and the NEES, over time"
    caption = (
        "Errors of one run are one draw: beside the standard deviation (root of the sum of both variances) "
        "they may be smaller or larger for hours. Whether they fit is a matter of many runs."
    )
    keys = (Key("error", VERMILLION), Key("standard deviation", BLUE), Key("NEES", GREEN))
    return Illustration(slug, title, alt, caption, render(figure, slug, alt), keys)


def _over_hours(panels: list[Axes], hours: FloatArray) -> None:
    for axes in panels:
        axes.set_xlim(0.0, float(hours[-1]) if hours[-1] > 0.0 else 1.0)
    panels[-1].set_xlabel("time [h]", labelpad=3.0)


def _along(distance_km: FloatArray) -> list[int]:
    """Samples at equal distances along the path, the end among them."""
    wanted = np.linspace(0.0, float(distance_km[-1]), ELLIPSES + 1)[1:]
    return sorted({min(int(k), len(distance_km) - 1) for k in np.searchsorted(distance_km, wanted)})


def region_name(run: RunData) -> str:
    """What the position is told to be in: an ellipse, or a bent region where the error is bent."""
    shape = "ellipse" if bent_regions(run.trace.columns) is None else "region"
    return f"{100.0 * _probability(run):g} % {shape}"


def _probability(run: RunData) -> float:
    settings = run.mission.get("run")
    share = number(settings.get("ellipse_probability")) if isinstance(settings, dict) else math.nan
    return share if math.isfinite(share) else 0.95
