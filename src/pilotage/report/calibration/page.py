"""The page itself: estimates, offset, figures, parameter file."""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from pilotage.core.whole_file import write_whole
from pilotage.records.calibration import CalibrationData, read_calibration
from pilotage.report import quantities
from pilotage.report.calibration.drive_figures import drive_figures
from pilotage.report.calibration.heading_figures import heading_figures
from pilotage.report.calibration.odometry_figures import odometry_figures
from pilotage.report.calibration.range_figures import range_figures
from pilotage.report.markup import (
    REPORT_FILE,
    ROW,
    VALUE,
    Html,
    Section,
    escape,
    figure_sections,
    page,
    section,
    table,
)
from pilotage.report.quantities import counted, scientific
from pilotage.report.style import drawing_style

_FIGURES = {
    "odometry": odometry_figures,
    "range": range_figures,
    "heading": heading_figures,
    "commands": drive_figures,
}
_TITLES = {
    "odometry": "Odometry calibration",
    "range": "Calibration of the range sensors",
    "heading": "Calibration of gyroscope and magnetometer",
    "commands": "Calibration of drive commands and camera",
}
_UNITS = (
    ("_rad_sqrt_s", "rad/√s"),
    ("_m2_per_m", "m²/m"),
    ("_per_rad_s", "s/rad"),
    ("_m2_per_rad", "m²/rad"),
    ("_rad2_per_rad", "rad²/rad"),
    ("_rad2_per_m", "rad²/m"),
    ("_rad2_per_s", "rad²/s"),
    ("_rad_per_m", "rad/m"),
    ("_m_per_step", "m a step"),
    ("_rad_per_step", "rad a step"),
    ("_cov_m_rad", "m rad"),
    ("_rad_s", "rad/s"),
    ("_per_step_m2", "m² a step"),
    ("_per_step_rad2", "rad² a step"),
    ("_m2", "m²"),
    ("_rad2", "rad²"),
    ("_rad", "rad"),
    ("_m", "m"),
    ("_s", "s"),
)
_MEANINGS = {
    "distance_var_per_step_m2": "Variance of the distance error of one step of the logs.",
    "angle_var_per_step_rad2": "Variance of the heading error of one step of the logs.",
    "distance_var_m2_per_m": "Distance variance that grows with the path driven.",
    "distance_var_m2_per_rad": "Distance variance that grows with the angle turned.",
    "angle_var_rad2_per_rad": "Heading variance that grows with the angle turned.",
    "angle_var_rad2_per_m": "Heading variance that grows with the path driven.",
    "cross_cov_m_rad": "Covariance of distance and heading error of the same step.",
    "distance_scale": "Claimed over true distance: 1 is ideal.",
    "angle_scale": "Claimed over true turn: 1 is ideal.",
    "wheel_base_ratio": "True wheel base over the one that the odometry was told.",
    "wheel_base_m": "True wheel base.",
    "curvature_rad_per_m": "Heading error that comes with every metre: wheels of unequal size.",
    "heading_offset_rad": "Angle between the heading and the direction of travel.",
    "distance_offset_m_per_step": "Distance error of a step however short.",
    "angle_offset_rad_per_step": "Heading error of a step however small.",
    "gyro_bias_rad_s": "What the gyroscope reads at rest about the turning axis.",
    "gyro_angle_random_walk_rad_sqrt_s": "White noise: how the integrated angle's error grows.",
    "gyro_angle_var_rad2_per_s": "The same as a variance per second.",
    "delay_s": "How late a command acts.",
    "speed_gain": "True over commanded speed on a straight.",
    "speed_loss_per_rad_s": "What that gain loses with each rad/s of commanded turn, up to 0.45 rad/s.",
    "turn_gain": "True over commanded turn rate.",
    "bend_rad_per_m": "Turn that comes with every metre.",
    "range_scale": "Reading over true range, straight ahead.",
    "depth_power": "The reading falls with cos(bearing) to this power: 0 a range, 1 the depth of a camera.",
    "gyro_bias_instability_rad_s": "How far the bias wanders; an upper bound in short logs.",
}


def write_calibration_report(folder: Path) -> Path:
    """Write ``report.html`` into a calibration folder and return its path."""
    path, data = folder / REPORT_FILE, read_calibration(folder)
    write_whole(path, calibration_page(data))
    return path


def calibration_page(data: CalibrationData) -> str:
    """Return the page as HTML."""
    with drawing_style():
        figures = _FIGURES[data.kind](data)
    source = "simulated calibration runs" if data.answer.get("simulated") else "recorded logs"
    return page(
        [_estimates(data), _offset(data), *figure_sections(figures), _parameters(data)],
        figures,
        title=f"{_TITLES[data.kind]}: {data.folder.name}",
        heading=_TITLES[data.kind],
        eyebrow=f"pilotage calibration · {source}",
        headline=_headline(data.answer),
        tiles=_tiles(data.answer),
        footer=f"Made by pilotage from {data.folder.name}; intervals hold the truth 95 times in 100.",
    )


def _found(answer: Mapping[str, Any]) -> list[tuple[str, Mapping[str, float]]]:
    """The estimates that were found, in the answer's order."""
    return [
        (key, value)
        for key, value in answer.items()
        if isinstance(value, Mapping) and {"value", "low", "high"} <= set(value)
    ]


def _unit(key: str) -> str:
    return next((unit for ending, unit in _UNITS if key.endswith(ending)), "")


def _name(key: str) -> str:
    """The key in words, without its unit."""
    ending = next((ending for ending, _ in _UNITS if key.endswith(ending)), "")
    words = key.removesuffix(ending.replace("_cov", "")).split("_")
    return " ".join({"var": "variance", "cov": "covariance"}.get(word, word) for word in words)


def _value(key: str, found: Mapping[str, float], which: str = "value") -> str:
    """The number with its unit, enough digits to tell ratios from 1 and the interval's ends apart."""
    low, high = found["low"], found["high"]
    apart = max(abs(low), abs(high)) / (high - low) if high > low else 1.0
    digits = max(4 if _unit(key) else 5, min(8, math.ceil(math.log10(max(apart, 1.0))) + 2))
    return f"{scientific(found[which], digits)} {_unit(key)}".strip()


def _estimates(data: CalibrationData) -> Section:
    rows = []
    for key, value in _found(data.answer):
        low, high = (escape(_value(key, value, end)) for end in ("low", "high"))
        band = f'<span class="range">95 %: {low} to {high}.</span>'
        meaning = Html(f"{escape(_MEANINGS.get(key, ''))} {band}")
        rows.append((_name(key), _value(key, value), meaning))
    missing = [
        f"{_name(key)}{f' in {_unit(key)}' if _unit(key) else ''}"
        for key, value in data.answer.items()
        if value is None
    ]
    told = [f"Not told by these logs: {', '.join(missing)}"] if missing else []
    for line in data.answer.get("warnings", ()):
        words = str(line)
        for key, _ in _found(data.answer):
            words = words.replace(key, _name(key))
        told.append(words)
    columns = (("what", ROW), ("value", VALUE), ("what it means", ""))
    notes = (f'<p class="absent">{escape(text)}.</p>' for text in told)
    return section("estimates", "Estimates", table(columns, rows, "metrics") if rows else "", *notes)


def _offset(data: CalibrationData) -> Section:
    slug, title, offset = "offset", "The shape of the offset", data.answer.get("offset")
    if not isinstance(offset, Mapping):
        return section(slug, title)
    rows = [
        (
            str(model["shape"]),
            str(model["free_parameters"]),
            f"{1e3 * model['rms_m']:.3f} mm",
            f"{model['delta_bic']:.1f}",
        )
        for model in offset["models"]
    ]
    columns = (
        ("shape", ROW),
        ("free parameters", VALUE),
        ("error left a step", VALUE),
        ("BIC above the best (6 is strong, 10 decisive)", ""),
    )
    told = f"<p><b>{escape(str(offset['shape']))}</b>: {escape(str(offset['explanation']))}.</p>"
    return section(slug, title, told, table(columns, rows, box="wide"))


def _parameters(data: CalibrationData) -> Section:
    slug, title = "parameters", "Parameter file"
    if not data.parameters:
        return section(slug, title)
    use = (
        "Lay it over another recording: <code>pilotage localize LOG --format mrclam --robot N"
        if data.kind == "commands"
        else "Lay it over any mission: <code>pilotage run MISSION"
    )
    lines = f"<p>{use} --set @parameters.yaml</code>.</p><pre>{escape(data.parameters)}</pre>"
    return section(slug, title, lines)


def _headline(answer: Mapping[str, Any]) -> str:
    kind = answer["calibration"]
    if kind == "odometry":
        logs = answer["logs"]
        used = sum(bool(log["used"]) for log in logs)
        shape = (answer.get("offset") or {}).get("shape", "none")
        left_out = f", {used} of them used" if used < len(logs) else ""
        return f"{counted(len(logs), 'log')}{left_out}; offset: {shape}."
    if kind == "commands":
        numbers = ((len(answer["logs"]), "recording"), (answer["windows"], "window"))
        told = [counted(count, noun) for count, noun in (*numbers, (answer["readings"], "reading"))]
        return f"{', '.join(told)}."
    if kind == "range":
        count = len(answer["sensors"])
        what = "1 quantity" if count == 1 else f"{count} quantities"
        return f"{what} of sensors that look at the same thing all the time."
    axes, turned = len(answer["gyroscope"]), len(answer["magnetometer"])
    turns = [
        f" About {entry['axis']} the gyroscope of {entry['log']} tells a turn of "
        f"{quantities.angle(entry['turn_rad'])}."
        for entry in answer["gyroscope"]
        if "turn_rad" in entry
    ]
    return (
        f"{axes} gyroscope {'axis' if axes == 1 else 'axes'}, {turned} "
        f"magnetometer{'' if turned == 1 else 's'} turned.{''.join(turns)}"
    )


def _tiles(answer: Mapping[str, Any]) -> list[tuple[str, str]]:
    return [(_name(key), _value(key, value)) for key, value in _found(answer)[:4]]
