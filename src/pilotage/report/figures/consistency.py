"""Does the filter know how well it knows? NEES, NIS and the beacons they come from."""

from __future__ import annotations

import numpy as np
import scipy
from matplotlib.axes import Axes
from matplotlib.ticker import MaxNLocator

from pilotage.core.types import FloatArray
from pilotage.records.run_data import RunData
from pilotage.report import quantities
from pilotage.report.series import running_mean
from pilotage.report.style import (
    BLUE,
    GREEN,
    INK,
    SKY,
    Illustration,
    Key,
    logarithmic,
    render,
    series,
    stacked_axes,
    time_limits,
)

SLUG = "consistency"
TITLE = "Consistency: NEES, NIS and what was seen"
PROBABILITY = 0.95
POSE_DOF = 3
WINDOW_S = 10.0
_BAND_BUCKET_S = 1.0
_PERCENT = f"{100.0 * PROBABILITY:g}\u00a0%"


def chi_square_band(
    dof: FloatArray | float, probability: float = PROBABILITY
) -> tuple[FloatArray, FloatArray]:
    """Return the two-sided band that a chi-square variable of ``dof`` degrees keeps with a probability.

    The quantile is that of the gamma distribution, 2 P^-1(dof / 2, p) with P the regularised incomplete
    gamma function.
    """
    half = np.asarray(dof, dtype=np.float64) / 2.0
    tail = (1.0 - probability) / 2.0
    low, high = (
        np.asarray(2.0 * scipy.special.gammaincinv(half, p), dtype=np.float64) for p in (tail, 1.0 - tail)
    )
    return low, high


def consistency_figure(run: RunData) -> Illustration:
    """Draw NEES and NIS per degree of freedom with their chi-square bands, and the beacons behind them."""
    trace, t_s = run.trace, run.trace.t_s
    what = measured(run)
    if not any(trace.has(name) for name in ("nees", "nis", f"{what}_seen")):
        return Illustration(
            SLUG, TITLE, "", "The run recorded neither NEES nor NIS: nothing was estimated against a truth."
        )
    dof = np.where(trace["nis_dof"] > 0.0, trace["nis_dof"], np.nan)
    nis = trace["nis"] / dof
    known = {
        "NEES (3 is ideal)": (trace.has("nees"), 115.0),
        "NIS per degree of freedom (1 is ideal)": (bool(np.isfinite(nis).any()), 115.0),
        f"{what.capitalize()} seen and accepted": (trace.has(f"{what}_seen"), 70.0),
    }
    shown = {title: height for title, (there, height) in known.items() if there}
    if not shown:
        return Illustration(SLUG, TITLE, "", "The run recorded no NIS with its degrees of freedom.")
    figure, drawn = stacked_axes(list(shown), list(shown.values()))
    time_limits(drawn, t_s)
    panels = iter(drawn)
    window = _steps(t_s, WINDOW_S)
    low, high = chi_square_band(float(POSE_DOF))
    shares = []
    nees = trace["nees"]
    if trace.has("nees"):
        _statistic(next(panels), t_s, nees, np.full_like(t_s, low), np.full_like(t_s, high), POSE_DOF, window)
        shares.append(_inside("NEES", nees, np.full_like(t_s, low), np.full_like(t_s, high), run))
    if bool(np.isfinite(nis).any()):
        nis_low, nis_high = (edge / dof for edge in chi_square_band(dof))
        smooth_low, smooth_high = (edge / _typical(dof, t_s) for edge in chi_square_band(_typical(dof, t_s)))
        _statistic(next(panels), t_s, nis, smooth_low, smooth_high, 1.0, window)
        shares.append(_inside("NIS", nis, nis_low, nis_high, run))
    if trace.has(f"{what}_seen"):
        _measurements(next(panels), run)
    seen, accepted = np.nansum(trace[f"{what}_seen"]), np.nansum(trace[f"{what}_accepted"])
    refused = (
        f" The gate let {quantities.count(accepted)} of {quantities.count(seen)} {what} through."
        if seen > 0
        else ""
    )
    innovations, freedom = " on a logarithmic axis", ""
    if bool(np.isfinite(nis).any()):
        innovations = ", NIS each innovation with its own; both axes are logarithmic"
        freedom = f"; for NIS two a {what[:-1]}, the band of the usual number in each second"
    caption = (
        f"NEES weighs the true error with the filter's covariance{innovations}. The band holds a single "
        f"step's value with {_PERCENT} probability (chi-square, {POSE_DOF} degrees of freedom for the "
        f"pose{freedom}). "
        + ("Inside the band: " + ", ".join(text for text in shares if text) + ". " if any(shares) else "")
        + f"The dark line is the mean of the last {WINDOW_S:g} s. Above the band the filter is too sure of "
        f"itself, below it too modest. Neighbouring steps are correlated: one run alone "
        f"proves little.{refused}"
    )
    statistics = (
        Key("each step", SKY),
        Key(f"mean of {WINDOW_S:g} s", INK),
        Key("ideal", GREEN, "dash"),
        Key(f"{_PERCENT} band", GREEN, "band", opacity=0.2),
    )
    counts = (Key(f"{what} seen", SKY, "band"), Key("accepted", BLUE)) if trace.has(f"{what}_seen") else ()
    keys = (*statistics, *counts)
    alt = f"NEES and NIS over time with their 95 % bands, and the number of {what} seen and accepted"
    return Illustration(SLUG, TITLE, alt, caption, render(figure, SLUG, alt), keys)


def _statistic(
    axes: Axes,
    t_s: FloatArray,
    values: FloatArray,
    low: FloatArray,
    high: FloatArray,
    ideal: float,
    window: int,
) -> None:
    """Draw one statistic with its band, its ideal and its running mean on a logarithmic axis."""
    smooth = running_mean(values, window)
    # What is typical is on the axis, also of a filter that is far too modest.
    known = smooth[smooth > 0.0]
    floor = float(np.clip(0.5 * known.min() if known.size else ideal, 1e-4 * ideal, ideal / 60.0))
    # Beyond a thousand times the ideal the filter is lost, and how lost is not read off this panel.
    ceiling = float(np.clip(1.3 * np.nanmax(values), 4.0 * ideal, 1e3 * ideal))
    logarithmic(axes, floor, ceiling)
    bucket = max(1, _steps(t_s, _BAND_BUCKET_S))
    edges = np.append(np.arange(0, len(t_s), bucket), len(t_s) - 1)
    axes.fill_between(
        t_s[edges], low[edges], high[edges], color=GREEN, alpha=0.14, linewidth=0.0, step="post"
    )
    axes.axhline(ideal, color=GREEN, linewidth=0.9, linestyle=(0, (5, 3)))
    series(axes, t_s, np.clip(values, floor, None), SKY, linewidth=0.5)
    series(axes, t_s, smooth, INK, linewidth=1.2)


def measured(run: RunData) -> str:
    """What the localizer counts: beacons, or lines of a scan."""
    return "lines" if run.trace.has("lines_seen") else "beacons"


def _measurements(axes: Axes, run: RunData) -> None:
    trace, t_s, what = run.trace, run.trace.t_s, measured(run)
    seen = trace[f"{what}_seen"]
    axes.set_ylim(0.0, float(np.nanmax(seen)) + 1.0)
    axes.yaxis.set_major_locator(MaxNLocator(4, integer=True))
    bucket = max(1, len(t_s) // 1000)
    axes.fill_between(t_s[::bucket], 0.0, seen[::bucket], color=SKY, alpha=0.35, linewidth=0.0, step="mid")
    series(axes, t_s, trace[f"{what}_accepted"], BLUE, linewidth=0.7, drawstyle="steps-mid")


def _steps(t_s: FloatArray, duration_s: float) -> int:
    """How many steps a duration has."""
    if len(t_s) < 2:
        return 1
    return max(1, round(duration_s / max(float(np.median(np.diff(t_s))), 1e-6)))


def _typical(dof: FloatArray, t_s: FloatArray) -> FloatArray:
    """The median degrees of freedom of each second: a band that follows every step would be a smear."""
    bucket = _steps(t_s, _BAND_BUCKET_S)
    typical = np.full_like(dof, np.nan)
    for first in range(0, len(dof), bucket):
        part = dof[first : first + bucket]
        part = part[np.isfinite(part)]
        if part.size:
            typical[first : first + bucket] = np.median(part)
    return typical


def _inside(name: str, values: FloatArray, low: FloatArray, high: FloatArray, run: RunData) -> str:
    known = run.settled() & np.isfinite(values) & np.isfinite(low)
    if not bool(known.any()):
        return ""
    within = (values[known] >= low[known]) & (values[known] <= high[known])
    return f"{name} {quantities.share(float(np.mean(within)))} of the steps"
