"""The gyroscope's Allan deviation and the magnetometer's ellipse."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from pilotage.core.types import FloatArray
from pilotage.records.calibration import CalibrationData
from pilotage.report.calibration.plots import panels_in_a_row
from pilotage.report.style import (
    BLUE,
    GREEN,
    MUTED,
    ORANGE,
    SKY,
    VERMILLION,
    Illustration,
    Key,
    logarithmic,
    render,
)

COLOURS = {"x": ORANGE, "y": GREEN, "z": BLUE}


def heading_figures(data: CalibrationData) -> list[Illustration]:
    """Draw what there is."""
    at_rest = [entry for entry in data.answer["gyroscope"] if "allan_tau_s" in entry]
    figures = [_allan_figure(at_rest)] if at_rest else []
    points = [values for key, values in data.arrays.items() if key.endswith("/magnetometer/values")]
    turned = [values for values in points if float(values.std(axis=0).max()) > 0.02]
    for i, (entry, values) in enumerate(zip(data.answer["magnetometer"], turned, strict=False)):
        figures.append(_ellipse_figure(i, entry, values))
    drives = data.answer.get("gyroscope_while_driving") or ()
    figures += [_drift_figure(data, i, entry) for i, entry in enumerate(drives)]
    return figures


def _drift_figure(data: CalibrationData, index: int, entry: Mapping[str, Any]) -> Illustration:
    slug, title = f"drive-{index + 1}", f"Gyroscope while driving, log {entry['log']}"
    alt = "Heading by the gyroscope minus the reference heading over time, with the line of the fitted bias"
    t_s, drift = data.arrays[f"drive-{index}/t_s"], data.arrays[f"drive-{index}/drift_rad"]
    figure, (axes,) = panels_in_a_row(["claimed minus true heading [rad]"], ["time [s]"], 200.0)
    since = t_s - t_s[0]
    bias = entry["bias_rad_s"]
    axes.plot(since, drift, color=BLUE)
    axes.plot(since, bias["value"] * since, color=VERMILLION, linewidth=1.4, linestyle=(0, (5, 3)))
    axes.set_xlim(0.0, float(since[-1]))
    scale = entry["scale"]
    at_rest = entry["bias_with_scale_rad_s"]
    turns = (
        "The robot hardly turned, so its scale cannot be told."
        if scale is None
        else f"Estimated with a scale, it claims {scale['value']:.4f} ({scale['low']:.4f} to "
        f"{scale['high']:.4f}) of each true turn and {1e3 * at_rest['value']:.3f} mrad/s while not turning."
    )
    caption = (
        f"On the mean the gyroscope claims {1e3 * bias['value']:.3f} mrad/s too much "
        f"({1e3 * bias['low']:.3f} to {1e3 * bias['high']:.3f}). {turns}"
    )
    keys = (Key("error of the summed turns", BLUE), Key("fitted bias alone", VERMILLION, "dash"))
    return Illustration(slug, title, alt, caption, render(figure, slug, alt), keys)


def _allan_figure(entries: list[Mapping[str, Any]]) -> Illustration:
    slug, title = "allan", "Allan deviation of the gyroscope at rest"
    alt = "Allan deviation over averaging time on logarithmic axes, one line an axis of the sensor"
    figure, (axes,) = panels_in_a_row(["deviation [mrad/s]"], ["averaging time [s]"], 220.0)
    values = 1e3 * np.concatenate([entry["allan_deviation_rad_s"] for entry in entries])
    axes.set_xscale("log")
    logarithmic(axes, 0.8 * float(values.min()), 1.25 * float(values.max()))
    seen: dict[str, None] = {}
    for entry in entries:
        tau = np.array(entry["allan_tau_s"])
        axes.plot(tau, 1e3 * np.array(entry["allan_deviation_rad_s"]), color=COLOURS[entry["axis"]])
        seen[entry["axis"]] = None
        walk = entry.get("angle_random_walk_rad_sqrt_s")
        if walk is not None and entry["axis"] == "z":
            axes.plot(
                tau, 1e3 * walk["value"] / np.sqrt(tau), color=MUTED, linewidth=0.8, linestyle=(0, (4, 3))
            )
    axes.set_xticks([0.1, 1.0, 10.0], ["0.1", "1", "10"])
    axes.set_xticks([], minor=True)
    caption = (
        "How much means over a stretch differ from one stretch to the next. Where the line falls with the "
        "square root of the time, white noise rules: the dashed line is the fitted angle random walk of z. "
        "Where it turns flat, longer averaging does not help any more: the bias wanders."
    )
    keys = (*(Key(f"axis {axis}", COLOURS[axis]) for axis in seen), Key("white noise", MUTED, "dash"))
    return Illustration(slug, title, alt, caption, render(figure, slug, alt), keys)


def _ellipse_figure(index: int, entry: Mapping[str, Any], values: FloatArray) -> Illustration:
    slug, title = f"magnetometer-{index + 1}", f"Magnetometer turned, log {entry['log']}"
    alt = "Readings of the magnetometer in the plane it was turned in, the fitted ellipse and its centre"
    a, b = entry["axes"]
    figure, (before, after) = panels_in_a_row(
        [f"as read, {b} [gauss]", f"corrected, {b} [gauss]"], [f"{a} [gauss]", f"{a} [gauss]"], 300.0
    )
    points = values[:, ["xyz".index(a), "xyz".index(b)]]
    centre = np.array([entry["offset_gauss"][axis]["value"] for axis in (a, b)])
    soft = np.array(entry["soft_iron"])
    angle = np.linspace(0.0, 2.0 * math.pi, 181)
    circle = entry["radius_gauss"] * np.column_stack([np.cos(angle), np.sin(angle)])
    ellipse = circle @ np.linalg.inv(soft) + centre
    for axes, cloud, line, middle in (
        (before, points, ellipse, centre),
        (after, (points - centre) @ soft, circle, np.zeros(2)),
    ):
        axes.plot(cloud[:, 0], cloud[:, 1], color=SKY, linestyle="none", marker=".", markersize=1.5)
        axes.plot(line[:, 0], line[:, 1], color=VERMILLION, linewidth=1.4)
        axes.plot(*middle, color=VERMILLION, marker="+", markersize=9.0)
        axes.set_aspect("equal", adjustable="datalim")
    ratio = entry["axis_ratio"]
    offsets = ", ".join(
        f"{axis} {e['value']:.4g} gauss ({e['low']:.4g} to {e['high']:.4g})"
        for axis, e in entry["offset_gauss"].items()
    )
    caption = (
        f"Turned about an axis, the field draws an ellipse about the sensor's offset: {offsets}. "
        f"Its axes have the ratio {ratio['value']:.3f} ({ratio['low']:.3f} to {ratio['high']:.3f}). "
        f"Residual {1e3 * entry['residual_gauss']:.1f} mgauss "
        f"of a radius of {1e3 * entry['radius_gauss']:.0f}; "
        f"the turning axis was {math.degrees(entry['tilt_rad']):.1f}° off the sensor's own."
    )
    keys = (Key("readings", SKY, "dot"), Key("fitted ellipse and its centre", VERMILLION))
    return Illustration(slug, title, alt, caption, render(figure, slug, alt), keys)
