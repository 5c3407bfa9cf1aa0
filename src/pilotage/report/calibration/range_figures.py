"""Fitted normals over the histograms of a sensor at rest (night-watch report, figures 10 and 11)."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from pilotage.records.calibration import CalibrationData
from pilotage.report.calibration.plots import histogram, panels_in_a_row
from pilotage.report.quantities import scientific
from pilotage.report.style import BLUE, SKY, VERMILLION, Illustration, Key, render, series

MOST_FIGURES = 24
"""A log may have a thousand columns; nobody looks at so many pictures, and a page of them opens nowhere."""


def range_figures(data: CalibrationData) -> list[Illustration]:
    """Draw every quantity of every sensor, the first ones where there are many."""
    entries = data.answer["sensors"]
    left_out = max(0, len(entries) - MOST_FIGURES)
    more = f" {left_out} more quantities stand in the table alone." if left_out else ""
    return [
        _figure(data, i, entry, more if i == MOST_FIGURES - 1 else "")
        for i, entry in enumerate(entries[:MOST_FIGURES])
    ]


def _figure(data: CalibrationData, index: int, entry: Mapping[str, Any], more: str) -> Illustration:
    values = data.arrays[str(index)]
    unit = "m" if "mean_m" in entry else "rad"
    expected = entry.get(f"expected_{unit}")
    name = f"{entry['sensor']}, {entry['quantity']}"
    figure, (readings, spread) = panels_in_a_row(
        [f"{entry['quantity']} [{unit}]", "its distribution"], ["reading", f"{entry['quantity']} [{unit}]"]
    )
    series(readings, np.arange(1.0, len(values) + 1.0), values, BLUE, linewidth=0.7)
    if expected is not None:
        readings.axhline(expected, color=BLUE, linewidth=1.0, linestyle=(0, (4, 3)))
    if float(np.ptp(values)) == 0.0:
        half = 0.05 * max(abs(float(values[0])), 0.1)
        readings.set_ylim(values[0] - half, values[0] + half)
    histogram(spread, values, expected)
    slug = f"sensor-{index + 1}"
    alt = f"{len(values)} readings of {name} and their histogram with the fitted normal"
    has_spread = entry[f"var_{unit}2"]["value"] > 0.0
    candidates = (
        (True, Key("readings", BLUE)),
        (expected is not None, Key("expected", BLUE, "dash")),
        (has_spread, Key("share of the readings", SKY, "band", opacity=1.0)),
        (has_spread, Key("fitted normal", VERMILLION)),
    )
    keys = tuple(key for there, key in candidates if there)
    return Illustration(slug, name, alt, _caption(entry, unit) + more, render(figure, slug, alt), keys)


def _caption(entry: Mapping[str, Any], unit: str) -> str:
    mean, var = entry[f"mean_{unit}"], entry[f"var_{unit}2"]
    parts = [
        f"{entry['readings']} readings: mean {scientific(mean['value'], 6)} {unit} "
        f"({scientific(mean['low'], 6)} to {scientific(mean['high'], 6)}), "
        f"variance {scientific(var['value'])} {unit}² "
        f"({scientific(var['low'])} to {scientific(var['high'])})."
    ]
    if entry.get(f"expected_{unit}") is not None:
        parts.append(f"Expected: {entry[f'expected_{unit}']:.6g} {unit}.")
    if entry.get(f"given_var_{unit}2") is not None:
        verdict = "inside" if entry["recovered"] else "outside"
        parts.append(
            f"The sensor was given {scientific(entry[f'given_var_{unit}2'])} {unit}²: {verdict} the interval."
        )
    if entry.get("normality_p") is not None:
        parts.append(f"{entry['normality_test']}: p = {scientific(entry['normality_p'], 2)}.")
    return " ".join(parts)
