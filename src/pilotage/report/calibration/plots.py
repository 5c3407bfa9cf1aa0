"""Panels that calibration pages share: side by side axes, a histogram with its fitted normal."""

from __future__ import annotations

import math

import numpy as np
import scipy
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from pilotage.core.types import FloatArray
from pilotage.report.light_axes import LightAxes
from pilotage.report.style import BLUE, SKY, VERMILLION, WIDTH_PT, note

_LEFT_PT, _RIGHT_PT, _TOP_PT, _BOTTOM_PT, _GAP_PT = 50.0, 10.0, 22.0, 36.0, 52.0
NO_SCATTER, MOST_BINS = 1e-12, 200


def panels_in_a_row(
    titles: list[str], labels: list[str], height_pt: float = 170.0
) -> tuple[Figure, list[Axes]]:
    """Return a figure of panels beside each other, each with its title and the label of its x axis."""
    total = _TOP_PT + height_pt + _BOTTOM_PT
    figure = Figure(figsize=(WIDTH_PT / 72.0, total / 72.0))
    count = len(titles)
    width = (WIDTH_PT - _LEFT_PT - _RIGHT_PT - _GAP_PT * (count - 1)) / count
    panels = []
    for i, (title, label) in enumerate(zip(titles, labels, strict=True)):
        left = _LEFT_PT + i * (width + _GAP_PT)
        axes = figure.add_axes(
            (left / WIDTH_PT, _BOTTOM_PT / total, width / WIDTH_PT, height_pt / total), axes_class=LightAxes
        )
        axes.set_title(title)
        axes.set_xlabel(label, labelpad=3.0)
        panels.append(axes)
    return figure, panels


def histogram(axes: Axes, values: FloatArray, expected: float | None = None) -> None:
    """Draw the density of values (N,), the normal with their mean and variance, and what was expected."""
    std = float(values.std(ddof=1)) if values.shape[0] > 1 else 0.0
    if std < NO_SCATTER:
        note(axes, f"all readings are {values[0]:.6g}")
        axes.set_xticks([])
        return
    mean = float(values.mean())
    # Freedman and Diaconis 1981, with a bound: where nearly all values are equal and a few are not, the bars
    # would fill the memory.
    width = 2.0 * float(scipy.stats.iqr(values)) / np.cbrt(values.size)
    bins = min(MOST_BINS, math.ceil(min(np.ptp(values) / max(width, NO_SCATTER), MOST_BINS)))
    axes.hist(values, bins=bins, density=True, color=SKY, edgecolor="white", linewidth=0.4)
    x = np.linspace(mean - 4.0 * std, mean + 4.0 * std, 121)
    axes.plot(x, scipy.stats.norm.pdf(x, mean, std), color=VERMILLION, linewidth=1.6)
    if expected is not None:
        axes.axvline(expected, color=BLUE, linewidth=1.0, linestyle=(0, (4, 3)))
    axes.set_xlim(mean - 4.2 * std, mean + 4.2 * std)
    axes.set_yticks([])
    axes.locator_params(axis="x", nbins=5)
