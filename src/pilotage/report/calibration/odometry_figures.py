"""One figure a log, as the night-watch report draws them: trajectory, error over time, its distribution."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from pilotage.records.calibration import CalibrationData
from pilotage.report.calibration.plots import histogram, panels_in_a_row
from pilotage.report.quantities import scientific
from pilotage.report.style import (
    BLUE,
    MUTED,
    ORANGE,
    SKY,
    VERMILLION,
    Illustration,
    Key,
    note,
    render,
    series,
)


def odometry_figures(data: CalibrationData) -> list[Illustration]:
    """Draw every log."""
    return [_log_figure(data, i, log) for i, log in enumerate(data.answer["logs"])]


def _log_figure(data: CalibrationData, index: int, log: Mapping[str, Any]) -> Illustration:
    arrays = {key: data.arrays[f"{index}/{key}"] for key in ("t_s", "truth", "claimed")}
    distance, angle = data.arrays[f"{index}/distance_error_m"], data.arrays[f"{index}/angle_error_rad"]
    turns = float(angle.std()) > 0.0 and not float(distance.std()) > 0.0
    values, unit, quantity = (1e3 * angle, "mrad", "angle") if turns else (1e3 * distance, "mm", "distance")
    told = log[f"{quantity}_error"]
    figure, (path, over_time, spread) = panels_in_a_row(
        ["heading [rad]" if turns else "trajectory, y [m]", f"{quantity} error [{unit}]", "its distribution"],
        ["time [s]" if turns else "x [m]", "time [s]", f"{quantity} error [{unit}]"],
    )
    if turns:
        series(path, arrays["t_s"], np.unwrap(arrays["truth"][:, 2]), BLUE, linewidth=1.6)
        series(path, arrays["t_s"], np.unwrap(arrays["claimed"][:, 2]), ORANGE, linestyle=(0, (4, 3)))
    else:
        path.plot(arrays["truth"][:, 0], arrays["truth"][:, 1], color=BLUE, linewidth=1.6)
        path.plot(arrays["claimed"][:, 0], arrays["claimed"][:, 1], color=ORANGE, linestyle=(0, (4, 3)))
        path.set_aspect("equal", adjustable="datalim")
    over_time.axhline(0.0, color=MUTED, linewidth=0.6)
    series(over_time, arrays["t_s"], values, BLUE, linewidth=0.7)
    if float(values.std()) > 0.0:
        histogram(spread, values)
    else:
        note(spread, "no noise in this log")
    slug, title = f"log-{index + 1}", f"Log {log['log']}"
    alt = f"Trajectory, {quantity} error over time and its histogram with the fitted normal, log {log['log']}"
    keys = (
        Key("truth, error", BLUE),
        Key("odometry", ORANGE, "dash"),
        Key("share of the steps", SKY, "band", opacity=1.0),
        Key("fitted normal", VERMILLION),
    )
    return Illustration(
        slug, title, alt, _caption(log, told, quantity, unit), render(figure, slug, alt), keys
    )


def _caption(log: Mapping[str, Any], told: Mapping[str, Any], quantity: str, unit: str) -> str:
    si = "rad" if unit == "mrad" else "m"
    parts = [
        f"{log['steps']} steps. The {quantity} error of one step has the mean "
        f"{scientific(told[f'mean_{si}'], 3)} {si} and the variance {scientific(told[f'var_{si}2'])} {si}²."
    ]
    p = told.get("normality_p")
    if p is not None:
        verdict = (
            "normal as far as these steps can tell" if p >= 0.05 else "not what a normal would look like"
        )
        parts.append(f"{told['normality_test']}: p = {scientific(p, 2)}, {verdict}.")
    if log.get("wrong_axis"):
        parts.append(
            "The odometry took each step along a wrong axis; the error is shown along that axis, "
            "and this log is left out of the parameters."
            if not log["used"]
            else "The odometry took each step along a wrong axis; the error is shown along that axis."
        )
    return " ".join(parts)
