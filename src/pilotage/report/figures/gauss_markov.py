"""What a filter found out about drive and sensor while it drove: each Gauss-Markov error with its band."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from matplotlib.axes import Axes

from pilotage.core.types import FloatArray
from pilotage.records.run_data import RunData
from pilotage.report import quantities
from pilotage.report.series import band
from pilotage.report.style import BLUE, SKY, Illustration, Key, render, series, stacked_axes, time_limits

SLUG = "gauss-markov"
TITLE = "What the filter found out about robot and sensor"

_ERRORS: tuple[tuple[str, str, str, float, Callable[[float], str]], ...] = (
    ("speed_error", "Speed, relative", "%", 100.0, quantities.share),
    ("speed_offset_m_s", "Speed, offset", "mm/s", 1e3, lambda x: f"{quantities.length(x)}/s"),
    ("turn_error", "Turn rate, relative", "%", 100.0, quantities.share),
    ("turn_offset_rad_s", "Turn rate, offset", "mrad/s", 1e3, lambda x: f"{quantities.angle(x)}/s"),
    ("course_rad", "Direction of travel less heading", "mrad", 1e3, quantities.angle),
    ("bearing_offset_rad", "Bearings, offset", "mrad", 1e3, quantities.angle),
    ("range_error", "Ranges, relative", "%", 100.0, quantities.share),
    ("range_offset_m", "Ranges, offset", "mm", 1e3, quantities.length),
    ("mount_ahead_m", "Sensor farther ahead by", "mm", 1e3, quantities.length),
    ("mount_left_m", "Sensor farther left by", "mm", 1e3, quantities.length),
    ("age_error_s", "Readings older by", "ms", 1e3, quantities.duration),
    ("axis_rad", "Optical axis, to the left", "mrad", 1e3, quantities.angle),
)
"""Column, name, unit and its factor, and how the last value is written."""


def gauss_markov_figure(run: RunData) -> Illustration:
    """Draw every Gauss-Markov error that the filter was free to estimate, one panel each."""
    trace, t_s = run.trace, run.trace.t_s
    free = [error for error in _ERRORS if _is_told(trace[error[0]], trace[f"{error[0]}_std"])]
    if not free:
        return Illustration(SLUG, TITLE, "", "The localizer estimates its pose only.")
    titles = [f"{name} [{unit}]" for _, name, unit, _, _ in free]
    figure, panels = stacked_axes(titles, (58.0,) * len(free))
    time_limits(panels, t_s)
    found = []
    for axes, (column, name, _, factor, write) in zip(panels, free, strict=True):
        value, std = factor * trace[column], factor * trace[f"{column}_std"]
        _panel(axes, t_s, value, std)
        last = np.flatnonzero(np.isfinite(value))
        if last.size:
            found.append(f"{name[0].lower()}{name[1:]} {write(float(trace[column][last[-1]]))}")
    caption = (
        "Errors that stay the same for a while and so do not average out, as believed, with two standard "
        f"deviations. At the end: {'; '.join(found)}."
    )
    alt = "Estimated Gauss-Markov errors of drive and sensor over time, with bands of two standard deviations"
    keys = (Key("estimate", BLUE), Key("±2σ", SKY, "band", opacity=0.4))
    return Illustration(SLUG, TITLE, alt, caption, render(figure, SLUG, alt), keys)


def _is_told(value: FloatArray, std: FloatArray) -> bool:
    """Whether a filter was free to estimate an error, and some value of it is there to be drawn."""
    return bool(np.any(np.nan_to_num(std) > 0.0) and np.any(np.isfinite(value)))


def _panel(axes: Axes, t_s: FloatArray, value: FloatArray, std: FloatArray) -> None:
    times, half = band(t_s, 2.0 * std)
    centre = np.interp(times, t_s[np.isfinite(value)], value[np.isfinite(value)])
    axes.fill_between(times, centre - half, centre + half, color=SKY, alpha=0.4, linewidth=0.0)
    axes.axhline(0.0, color="0.6", linewidth=0.6)
    axes.locator_params(axis="y", nbins=4)
    series(axes, t_s, value, BLUE, linewidth=0.9)
