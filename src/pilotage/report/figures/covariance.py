"""What the filter believes about its own error: standard deviations over time."""

from __future__ import annotations

import numpy as np

from pilotage.records.run_data import RunData
from pilotage.report import quantities
from pilotage.report.series import merge_spans, spans
from pilotage.report.style import (
    BLUE,
    ORANGE,
    PURPLE,
    SHADE,
    Illustration,
    Key,
    logarithmic,
    note,
    peak,
    render,
    series,
    shade,
    stacked_axes,
    time_limits,
)

SLUG = "covariance"
TITLE = "Uncertainty of the estimate"
TURNING_RAD_S = 0.2


def covariance_figure(run: RunData) -> Illustration:
    """Draw the standard deviations of x, y and heading on logarithmic axes, with the turns shaded."""
    trace, t_s = run.trace, run.trace.t_s
    if not (trace.has("cov_xx_m2") or trace.has("cov_yy_m2") or trace.has("cov_tt_rad2")):
        return Illustration(SLUG, TITLE, "", "The run recorded no covariance.")
    far = peak(np.concatenate([trace["cov_xx_m2"], trace["cov_yy_m2"]])) > 1.0
    unit, factor = ("m", 1.0) if far else ("mm", 1000.0)
    sigmas = {
        name: (1000.0 if name == "heading" else factor)
        * np.sqrt(np.where(trace[column] > 0.0, trace[column], np.nan))
        for name, column in (("x", "cov_xx_m2"), ("y", "cov_yy_m2"), ("heading", "cov_tt_rad2"))
    }
    recorded = {"x": trace.has("cov_xx_m2"), "heading": trace.has("cov_tt_rad2")}
    colours = {"x": BLUE, "y": ORANGE, "heading": PURPLE}
    units = {"x": unit, "y": unit, "heading": "mrad"}
    figure, panels = stacked_axes([f"σ of x and y [{unit}]", "σ of heading [mrad]"], (130.0, 95.0))
    time_limits(panels, t_s)
    turns = merge_spans(spans(t_s, np.abs(trace["w_true_rad_s"]) > TURNING_RAD_S), 0.3)
    for axes, names in zip(panels, (("x", "y"), ("heading",)), strict=True):
        together = np.concatenate([sigmas[name] for name in names])
        together = together[np.isfinite(together)]
        if not together.size:
            note(axes, "zero throughout" if recorded[names[0]] else "not recorded")
            continue
        logarithmic(axes, float(together.min()) / 1.2, float(together.max()) * 1.2)
        shade(axes, turns, SHADE)
        for name in names:
            series(axes, t_s, sigmas[name], colours[name])
    typical = []
    for name, values in sigmas.items():
        known = values[run.settled() & np.isfinite(values)]
        if known.size:
            typical.append(f"{name} {quantities.significant(float(np.median(known)), 2)} {units[name]}")
    caption = (
        "One standard deviation on a logarithmic scale"
        + (f"; after the start the median is {', '.join(typical)}" if typical else "")
        + "."
        + (
            f" Grey where the robot turns faster than {TURNING_RAD_S:g} rad/s: turning costs certainty, "
            "and what is seen buys some of it back."
            if len(turns)
            else ""
        )
    )
    turning = (Key("turning", SHADE, "band", opacity=1.0),) if len(turns) else ()
    keys = (Key("σ of x", BLUE), Key("σ of y", ORANGE), Key("σ of heading", PURPLE), *turning)
    alt = "Standard deviations of x, y and heading over time on logarithmic axes, turns shaded"
    return Illustration(SLUG, TITLE, alt, caption, render(figure, SLUG, alt), keys)
