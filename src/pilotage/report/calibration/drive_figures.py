"""What commanded velocities did and what a camera's ranges were: the fits over their windows and readings."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from matplotlib.axes import Axes

from pilotage.calibration.drive_windows import LOSS_UP_TO_RAD_S
from pilotage.core.types import FloatArray
from pilotage.records.calibration import CalibrationData
from pilotage.report.calibration.plots import histogram, panels_in_a_row
from pilotage.report.style import BLUE, MUTED, SKY, VERMILLION, Illustration, Key, nice_limit, render

MOST_POINTS = 1500
SLOWEST_M_S = 0.03
"""A ratio of speeds says nothing where hardly any was commanded."""
_DRIVE = ("speed_gain", "speed_loss_per_rad_s", "turn_gain")
_REST = ("bend_rad_per_m", "range_scale", "depth_power")
_LABELS = {
    "speed_gain": "speed gain",
    "speed_loss_per_rad_s": "speed loss [s/rad]",
    "turn_gain": "turn gain",
    "bend_rad_per_m": "bend [rad/m]",
    "range_scale": "range scale",
    "depth_power": "depth power",
}


def drive_figures(data: CalibrationData) -> list[Illustration]:
    """Draw the drive, the camera, and each recording alone beside all together."""
    camera = [_camera(data)] if "range_scale" in data.answer else []
    return [_drive(data), *camera, *_recordings(data)]


def _drive(data: CalibrationData) -> Illustration:
    slug, title = "drive", "From commands to motion"
    alt = "Speed ratio over commanded turn rate, true over commanded turn rate, and what each delay leaves"
    figure, (ratio, turn, delay) = panels_in_a_row(
        ["true over commanded speed", "true turn rate [rad/s]", "left turn rate [rad/s]"],
        ["commanded turn rate [rad/s]", "commanded turn rate [rad/s]", "delay [s]"],
        210.0,
    )
    v_c, w_c, _, v, w = _joined(data, "windows").T
    a = data.answer
    moving = np.abs(v_c) > SLOWEST_M_S
    most = max(float(np.abs(w_c).max(initial=0.0)), 0.1)
    _points(ratio, np.abs(w_c[moving]), v[moving] / v_c[moving])
    rates = np.linspace(0.0, most, 121)
    kept = a["speed_gain"]["value"] - a["speed_loss_per_rad_s"]["value"] * np.minimum(rates, LOSS_UP_TO_RAD_S)
    ratio.plot(rates, kept, color=VERMILLION, linewidth=1.6)
    ratio.set_ylim(-0.1, 1.6)
    _points(turn, w_c, w)
    ends = np.array([-most, most])
    turn.plot(ends, a["turn_gain"]["value"] * ends, color=VERMILLION, linewidth=1.6)
    left = np.sqrt(data.arrays["delay_cost"] / max(len(a["logs"]), 1))
    delay.plot(data.arrays["delays_s"], left, color=BLUE, marker="o", markersize=3.0)
    delay.axvline(a["delay_s"]["value"], color=VERMILLION, linewidth=1.0, linestyle=(0, (4, 3)))
    delay.set_ylim(0.0, nice_limit(float(left.max())))
    caption = (
        f"{a['windows']} windows of 2 s. On a straight the robot goes at "
        f"{a['speed_gain']['value']:.3f} of the commanded speed; each rad/s of turn takes "
        f"{a['speed_loss_per_rad_s']['value']:.3f} of it away, up to {LOSS_UP_TO_RAD_S} rad/s. "
        f"It turns at {a['turn_gain']['value']:.3f} of the commanded rate, and commands act "
        f"{a['delay_s']['value']:.2f} s late."
    )
    keys = (Key("windows", SKY, "spot"), Key("fit", VERMILLION), Key("left at each delay", BLUE))
    return Illustration(slug, title, alt, caption, render(figure, slug, alt), keys)


def _camera(data: CalibrationData) -> Illustration:
    slug, title = "camera", "The camera's ranges"
    alt = "Reading over true range against the cosine of the bearing, and the distribution of what is left"
    figure, (over, spread) = panels_in_a_row(
        ["reading over true range", "left of the reading [%]"], ["cosine of the bearing", "left [%]"], 210.0
    )
    log_ratio, log_cosine = _joined(data, "log_ratio"), _joined(data, "log_cosine")
    a = data.answer
    scale, power = a["range_scale"]["value"], a["depth_power"]["value"]
    middle = float(np.exp(np.median(log_ratio)))
    cosine = np.exp(log_cosine)
    _points(over, cosine, np.exp(log_ratio))
    x = np.linspace(float(cosine.min()), 1.0, 61)
    over.plot(x, scale * x**power, color=VERMILLION, linewidth=1.6)
    over.set_ylim(0.8 * middle, 1.2 * middle)
    left = log_ratio - np.log(scale) - power * log_cosine
    near = np.abs(left) < 0.1
    near |= not near.any()  # where the fit is that far off, all of it is shown
    histogram(spread, 100.0 * left[near])
    caption = (
        f"{a['readings']} readings: straight ahead {scale:.4f} of the true range "
        f"({a['range_scale']['low']:.4f} to {a['range_scale']['high']:.4f}), falling with cos(bearing) "
        f"to the power {power:.3f} ({a['depth_power']['low']:.3f} to {a['depth_power']['high']:.3f}): "
        "0 would be a range, 1 the depth. "
        f"What is left has a standard deviation of {100.0 * float(left[near].std()):.2f} %."
    )
    keys = (Key("readings", SKY, "spot"), Key("fit, fitted normal", VERMILLION))
    return Illustration(slug, title, alt, caption, render(figure, slug, alt), keys)


def _recordings(data: CalibrationData) -> list[Illustration]:
    """Each recording alone: whether one robot tells of another."""
    logs = [log for log in data.answer["logs"] if log.get("alone")]
    if len(logs) < 2:
        return []
    rest = tuple(name for name in _REST if name in data.answer)
    return [
        _alone(data, logs, "drive-by-recording", "The drive by recording", _DRIVE),
        _alone(data, logs, "rest-by-recording", "Bend and camera by recording", rest),
    ]


def _alone(
    data: CalibrationData, logs: list[Mapping[str, Any]], slug: str, title: str, names: tuple[str, ...]
) -> Illustration:
    alt = (
        f"{', '.join(_LABELS[name] for name in names)} of each recording alone with its interval, and of all"
    )
    figure, panels = panels_in_a_row(
        [_LABELS[n] for n in names], ["robot" if "robot" in logs[0] else "recording"] * len(names), 150.0
    )
    at = np.arange(1.0, len(logs) + 1.0)
    for axes, name in zip(panels, names, strict=True):
        pooled = data.answer[name]
        axes.axhspan(pooled["low"], pooled["high"], color=SKY, alpha=0.3, linewidth=0.0)
        axes.axhline(pooled["value"], color=VERMILLION, linewidth=1.2)
        one = [log["alone"][name] for log in logs]
        value, low, high = (np.array([entry[key] for entry in one]) for key in ("value", "low", "high"))
        axes.errorbar(
            at,
            value,
            np.vstack([value - low, high - value]),
            color=BLUE,
            fmt="o",
            markersize=3.5,
            capsize=3.0,
        )
        axes.set_xlim(0.5, len(logs) + 0.5)
        axes.set_xticks(at, [str(log.get("robot", k)) for k, log in enumerate(logs, start=1)])
        axes.locator_params(axis="y", nbins=6)
    caption = (
        "Dots: fitted to one recording alone, with its 95 % interval over minutes. Line and band: all "
        "recordings together. Where dots lie farther apart than their intervals, robots differ."
    )
    keys = (
        Key("one recording", BLUE, "spot"),
        Key("all together", VERMILLION),
        Key("its interval", SKY, "band", opacity=0.3),
    )
    return Illustration(slug, title, alt, caption, render(figure, slug, alt), keys)


def _joined(data: CalibrationData, name: str) -> FloatArray:
    return np.concatenate([data.arrays[f"{i}/{name}"] for i in range(len(data.answer["logs"]))])


def _points(axes: Axes, x: FloatArray, y: FloatArray) -> None:
    """A cloud, thinned to what can be seen."""
    every = max(1, -(-x.shape[0] // MOST_POINTS))
    axes.plot(x[::every], y[::every], color=SKY, linestyle="none", marker=".", markersize=2.5)
    axes.axhline(0.0, color=MUTED, linewidth=0.5)
