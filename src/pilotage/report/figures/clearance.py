"""How far the robot's body kept from everything solid."""

from __future__ import annotations

import numpy as np

from pilotage.records.run_data import RunData
from pilotage.report import quantities
from pilotage.report.style import (
    BLUE,
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

SLUG = "clearance"
TITLE = "Clearance of the body"


def clearance_figure(run: RunData) -> Illustration:
    """Draw the true distance between the body and the nearest wall or obstacle, its least value marked."""
    trace, t_s = run.trace, run.trace.t_s
    clearance = trace["clearance_m"]
    if not trace.has("clearance_m"):
        return Illustration(SLUG, TITLE, "", "The run recorded no clearance.")
    figure, (axes,) = stacked_axes(["Distance from the body's edge to the nearest thing [m]"], (140.0,))
    time_limits([axes], t_s)
    least = int(np.nanargmin(clearance))
    least_m = float(clearance[least])
    axes.set_ylim(min(0.0, 1.2 * least_m), nice_limit(peak(clearance)))
    axes.axhline(0.0, color=VERMILLION, linewidth=1.4)
    series(axes, t_s, clearance, BLUE, linewidth=1.0)
    axes.plot([t_s[least]], [least_m], "o", color=VERMILLION, markersize=5.0)
    # Said beside the title: over the curve it would hide what comes just before or after.
    text = f"● least: {quantities.length(least_m)} at {quantities.moment(t_s[least])}"
    axes.set_title(text, loc="right", color=VERMILLION, fontsize=9.0)
    caption = (
        "The true distance between the edge of the robot's body and the nearest wall or obstacle, known or "
        "not. Zero is contact."
    )
    keys = (Key("clearance", BLUE), Key("contact", VERMILLION))
    alt = f"Clearance of the body over time; the least is {quantities.length(least_m)}"
    return Illustration(SLUG, TITLE, alt, caption, render(figure, SLUG, alt), keys)
