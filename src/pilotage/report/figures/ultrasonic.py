"""What the ultrasonic sensors read, and what the robot did about it."""

from __future__ import annotations

import numpy as np

from pilotage.records.run_data import RunData
from pilotage.report.modes import AVOID, ESCAPE, LATERAL, mode_spans
from pilotage.report.style import (
    BLACK,
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

SLUG = "ultrasonic"
TITLE = "Ultrasonic distances"
MOST_PANELS = 8
_SHADE_ALPHA = 0.25


def ultrasonic_figure(run: RunData) -> Illustration:
    """Draw the range of each ultrasonic sensor, a gap where it saturates, with the reactive modes shaded."""
    trace, t_s = run.trace, run.trace.t_s
    ranges = trace.ultrasonics()
    if not ranges:
        return Illustration(SLUG, TITLE, "", "The robot carried no ultrasonic sensors.")
    if not trace.steps:
        return Illustration(SLUG, TITLE, "", "The run ended before its first step.")
    shown = dict(list(ranges.items())[:MOST_PANELS])
    figure, panels = stacked_axes([f"{name.replace('_', ' ')} [m]" for name in shown], [75.0] * len(shown))
    time_limits(panels, t_s)
    together = np.concatenate([*shown.values()])
    limit = nice_limit(peak(together))
    modes = (LATERAL, AVOID, ESCAPE)
    stretches = {mode: mode_spans(trace, mode) for mode in modes}
    for axes, values in zip(panels, shown.values(), strict=True):
        if not bool(np.isfinite(values).any()):
            note(axes, "nothing within reach during the whole run")
        axes.set_ylim(0.0, limit)
        for mode in modes:
            shade(axes, stretches[mode], mode.colour, alpha=_SHADE_ALPHA)
        series(axes, t_s, values, BLACK, linewidth=0.9)
    hidden = len(ranges) - len(shown)
    caption = (
        "The nearest return in each sensor's cone. A gap means saturated: nothing within reach, "
        "which is no wall at the greatest range."
        + (f" {hidden} more sensors are in the trace only." if hidden > 0 else "")
    )
    used = [mode for mode in modes if len(stretches[mode])]
    keys = (
        Key("distance", BLACK),
        *(Key(mode.name, mode.colour, "band", opacity=_SHADE_ALPHA) for mode in used),
    )
    alt = "Distances read by the ultrasonic sensors over time, the reactive modes shaded"
    return Illustration(SLUG, TITLE, alt, caption, render(figure, SLUG, alt), keys)
