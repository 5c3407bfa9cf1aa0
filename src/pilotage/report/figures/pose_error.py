"""Position and heading error inside their two-sigma bands."""

from __future__ import annotations

import math

import numpy as np
from matplotlib.axes import Axes

from pilotage.core.angles import wrap_array_to_pi
from pilotage.core.types import FloatArray
from pilotage.records.run_data import RunData
from pilotage.report import quantities
from pilotage.report.series import band
from pilotage.report.style import (
    BLUE,
    MUTED,
    SHADE,
    SKY,
    Illustration,
    Key,
    nice_limit,
    note,
    peak,
    render,
    series,
    shade,
    stacked_axes,
    time_limits,
)

SLUG = "pose-error"
TITLE = "Error of the estimated pose"


def pose_error_figure(run: RunData) -> Illustration:
    """Draw x, y and heading error (estimate minus truth) inside the filter's own two-sigma bands."""
    trace, t_s = run.trace, run.trace.t_s
    rows = (
        ("x", trace["est_x_m"] - trace["true_x_m"], trace["cov_xx_m2"]),
        ("y", trace["est_y_m"] - trace["true_y_m"], trace["cov_yy_m2"]),
        (
            "heading",
            wrap_array_to_pi(trace["est_theta_rad"] - trace["true_theta_rad"]),
            trace["cov_tt_rad2"],
        ),
    )
    if not any(bool(np.isfinite(error).any()) for _, error, _ in rows):
        return Illustration(SLUG, TITLE, "", "The run recorded no true pose beside the estimated one.")
    settled = run.settled()
    position_peak = peak(np.concatenate([rows[0][1][settled], rows[1][1][settled]]))
    # Beyond half a metre millimetres are noise on the axis.
    factor, unit = (1.0, "m") if position_peak > 0.5 else (1000.0, "mm")
    figure, panels = stacked_axes(
        [f"x error [{unit}]", f"y error [{unit}]", "heading error [mrad]"], (105.0, 105.0, 105.0)
    )
    time_limits(panels, t_s)
    inside = []
    for axes, (name, error, variance), scale in zip(panels, rows, (factor, factor, 1000.0), strict=True):
        sigma2 = 2.0 * np.sqrt(np.maximum(variance, 0.0))
        if not bool(np.isfinite(error).any()):
            note(axes, "not recorded")
            continue
        limit = nice_limit(float(np.fmax(peak(error[settled]), _usual_peak(sigma2[settled]))) * scale)
        axes.set_ylim(-limit, limit)
        shade(axes, np.array([[min(float(t_s[0]), 0.0), run.settle_s]]), SHADE)
        times, half = band(t_s, sigma2 * scale)
        axes.fill_between(times, -half, half, color=SKY, alpha=0.35, linewidth=0.0)
        axes.axhline(0.0, color=MUTED, linewidth=0.6)
        series(axes, t_s, error * scale, BLUE, linewidth=0.9)
        _tell_start(axes, error[0] * scale, sigma2[0] * scale, "mrad" if name == "heading" else unit)
        known = settled & np.isfinite(error) & np.isfinite(sigma2)
        if bool(known.any()):
            within = float(np.mean(np.abs(error[known]) <= sigma2[known]))
            inside.append(f"{name} {quantities.share(within)}")
    start = (
        f"The grey start phase, {quantities.duration(run.settle_s)}, does not count: the start error is "
        "drawn from the initial covariance."
        + (" This run ended within it." if len(t_s) and t_s[-1] <= run.settle_s else "")
    )
    caption = (
        "Estimate minus truth. The shaded band is two standard deviations as the filter believes them: "
        "a filter that knows how well it knows stays inside for 95.4 % of the time"
        + (f" (here: {', '.join(inside)} of the steps)" if inside else "")
        + f".{f' {start}' if run.settle_s > 0.0 else ''} 1 mrad is 0.057°."
    )
    started = (Key("start phase", SHADE, "band", opacity=1.0),) if run.settle_s > 0.0 else ()
    keys = (Key("error", BLUE), Key("±2σ of the filter", SKY, "band"), *started)
    alt = "Error of x, y and heading over time inside the two-sigma bands of the filter"
    return Illustration(SLUG, TITLE, alt, caption, render(figure, SLUG, alt), keys)


def _usual_peak(values: FloatArray) -> float:
    """The value that all but one in two hundred stay below: a single wide step does not set the scale."""
    finite = values[np.isfinite(values)]
    return float(np.quantile(finite, 0.995)) if finite.size else math.nan


def _tell_start(axes: Axes, start_error: float, start_sigma2: float, unit: str) -> None:
    """Write the start's numbers into the panel where they are out of it."""
    limit = axes.get_ylim()[1]
    if not np.nanmax([abs(start_error), start_sigma2, 0.0]) > limit:
        return
    parts = [
        f"{name} {quantities.significant(value, 2)} {unit}"
        for name, value in (("error", start_error), ("2σ", start_sigma2))
        if math.isfinite(value)
    ]
    text = f"at the start, off this scale: {', '.join(parts)}"
    axes.set_title(text, loc="right", color=MUTED, fontsize=8.0, fontweight="normal")
