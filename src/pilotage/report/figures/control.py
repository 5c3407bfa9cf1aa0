"""What the controller did: the error it saw, the turn rate it made of it, and the speed."""

from __future__ import annotations

import numpy as np

from pilotage.records.run_data import RunData
from pilotage.report.style import (
    BLACK,
    BLUE,
    GREEN,
    MUTED,
    ORANGE,
    SKY,
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

SLUG = "control"
TITLE = "Path following"

_PARTS = (
    # Column, name, colour, panel.
    ("path_error_m", "error", BLACK, 0),
    ("w_proportional_rad_s", "proportional", BLUE, 1),
    ("w_integral_rad_s", "integral", ORANGE, 1),
    ("w_feedforward_rad_s", "feed-forward", GREEN, 2),
    ("w_reactive_rad_s", "reactive", VERMILLION, 2),
    ("v_true_m_s", "true speed", SKY, 3),
    ("v_cmd_m_s", "commanded speed", BLACK, 3),
)


def control_figure(run: RunData) -> Illustration:
    """Draw path error, the parts of the commanded turn rate, and commanded and true speed."""
    trace, t_s = run.trace, run.trace.t_s
    if not any(trace.has(column) for column, *_ in _PARTS):
        return Illustration(SLUG, TITLE, "", "The run recorded no controller.")
    factor, unit = (1.0, "m") if peak(trace["path_error_m"]) > 0.5 else (1000.0, "mm")
    titles = (
        f"Lateral error to the path [{unit}]",
        "Turn rate from the PI controller [rad/s]",
        "Turn rate, feed-forward and reactive [rad/s]",
        "Speed [m/s]",
    )
    shown = [k for k in range(4) if any(panel == k and trace.has(column) for column, _, _, panel in _PARTS)]
    figure, panels = stacked_axes([titles[k] for k in shown], [(85.0, 85.0, 85.0, 65.0)[k] for k in shown])
    time_limits(panels, t_s)
    for index, axes in zip(shown, panels, strict=True):
        parts = [part for part in _PARTS if part[3] == index and trace.has(part[0])]
        scale = factor if index == 0 else 1.0
        values = np.concatenate([trace[column] for column, *_ in parts]) * scale
        if index < 3:
            limit = nice_limit(peak(values))
            axes.set_ylim(-limit, limit)
            axes.axhline(0.0, color=MUTED, linewidth=0.6)
        else:
            axes.set_ylim(min(0.0, 1.1 * float(np.nanmin(values))), nice_limit(float(np.nanmax(values))))
        for column, name, colour, _ in parts:
            width = 2.2 if name == "true speed" else 0.9
            series(axes, t_s, trace[column] * scale, colour, linewidth=width)
    caption = (
        "The lateral error is what the controller sees: how far its own estimate is from the reference. "
        "While it follows the path the commanded turn rate is the sum of four parts: feed-forward along the "
        "path, proportional and integral on the error, and the reactive part that keeps off walls."
        if trace.has("path_error_m")
        else "The speed that was commanded, and the one that came of it."
        if trace.has("v_cmd_m_s", "v_true_m_s")
        else "How fast the robot truly drove; negative is backwards."
    )
    keys = tuple(
        Key(f"{name} part" if panel in (1, 2) else name, colour)
        for column, name, colour, panel in _PARTS
        if trace.has(column)
    )
    alt = "Path error, the parts of the turn rate, and commanded and true speed over time"
    title = TITLE if shown != [3] else "Speed"
    return Illustration(SLUG, title, alt, caption, render(figure, SLUG, alt), keys)
