"""What a damaged answer of a calibration holds instead is named with its file and place, not drawn."""

from __future__ import annotations

import json
import warnings
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from pilotage.cli.main import main
from pilotage.core.types import FloatArray
from pilotage.records.calibration import write_calibration

Values = dict[str, Any]
ONE: Values = {"value": 1.0, "low": 0.9, "high": 1.1}
STEPS, TURNS = 30, np.linspace(0.0, 6.0, 40)


def odometry() -> Values:
    test = {"normality_test": "Shapiro-Wilk", "normality_p": 0.4}
    log: Values = {"log": "x", "steps": STEPS, "used": True, "wrong_axis": False}
    log |= {"distance_error": {"mean_m": 0.0, "var_m2": 1e-5, **test}}
    log |= {"angle_error": {"mean_rad": 0.0, "var_rad2": 0.0}}
    model = {"shape": "none", "free_parameters": 0, "rms_m": 0.004, "delta_bic": 0.0}
    offset = {"shape": "none", "explanation": "no offset", "models": [model]}
    return {"calibration": "odometry", "distance_scale": ONE, "logs": [log], "offset": offset, "warnings": []}


def commands() -> Values:
    drive = ("speed_gain", "speed_loss_per_rad_s", "turn_gain", "bend_rad_per_m")
    each = dict.fromkeys((*drive, "range_scale", "depth_power"), ONE)
    logs = [{"recording": f"r{i}", "robot": i, "alone": each} for i in (1, 2)]
    return {"calibration": "commands", **each, "delay_s": ONE, "windows": 9, "readings": 9, "logs": logs}


def ranges() -> Values:
    sensor = {"sensor": "beacons", "quantity": "range", "readings": STEPS, "mean_m": ONE, "var_m2": ONE}
    sensor |= {"expected_m": 1.0, "given_var_m2": 1.0, "recovered": True, "normality_p": None}
    return {"calibration": "range", "beacons_range_var_m2": ONE, "sensors": [sensor]}


def heading() -> Values:
    still: Values = {"log": "a", "axis": "z", "angle_random_walk_rad_sqrt_s": ONE}
    still |= {"allan_tau_s": [0.1, 1.0], "allan_deviation_rad_s": [0.02, 0.01]}
    turned: Values = {"log": "b", "axes": "xy", "offset_gauss": {"x": ONE, "y": ONE}, "axis_ratio": ONE}
    turned |= {"radius_gauss": 0.4, "residual_gauss": 0.01, "tilt_rad": 0.0, "soft_iron": [[1, 0], [0, 1]]}
    drive = {"log": "c", "bias_rad_s": ONE, "scale": ONE, "bias_with_scale_rad_s": ONE}
    both = [still, {"log": "b", "axis": "z", "turn_rad": 6.3}]
    return {
        "calibration": "heading",
        "gyroscope": both,
        "magnetometer": [turned],
        "gyroscope_while_driving": [drive],
    }


WHOLE = {"odometry": odometry, "commands": commands, "range": ranges, "heading": heading}


def arrays_of(kind: str) -> dict[str, FloatArray]:
    noise = np.random.default_rng(0).normal(0.0, 0.01, (STEPS, 5))
    line = np.arange(float(STEPS))
    if kind == "odometry":
        poses = {"0/truth": noise[:, :3], "0/claimed": noise[:, :3]}
        return {"0/t_s": line, **poses, "0/distance_error_m": noise[:, 0], "0/angle_error_rad": 0.0 * line}
    if kind == "commands":
        logs = {f"{i}/windows": 1.0 + noise for i in (0, 1)}
        logs |= {f"{i}/{name}": -abs(noise[:, 0]) for i in (0, 1) for name in ("log_ratio", "log_cosine")}
        return {"delays_s": line, "delay_cost": line, **logs}
    if kind == "range":
        return {"0": noise[:, 0]}
    circle = np.column_stack([np.cos(TURNS), np.sin(TURNS), 0.0 * TURNS])
    return {"1/magnetometer/values": circle, "drive-0/t_s": line, "drive-0/drift_rad": noise[:, 0]}


def told(
    folder: Path, answer: Mapping[str, Any], arrays: Mapping[str, FloatArray], capsys: Any
) -> tuple[int, str]:
    _, made = write_calibration(folder, answer, arrays, {})
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        code = main(["report", str(made)])
    said = capsys.readouterr().err
    assert said.count("\n") == (code == 2)
    return code, said.replace(str(made), "FOLDER")


@pytest.mark.parametrize("kind", WHOLE)
def test_what_a_calibration_writes_is_drawn(
    kind: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert told(tmp_path, WHOLE[kind](), arrays_of(kind), capsys) == (0, "")


def test_a_page_of_one_log_says_so_and_tells_tiny_chances_as_all_numbers(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    answer = odometry()
    answer["logs"][0]["distance_error"]["normality_p"] = 3.3e-7
    assert told(tmp_path, answer, arrays_of("odometry"), capsys) == (0, "")
    (file,) = tmp_path.rglob("report.html")
    page = file.read_text("utf-8")
    assert "1 log; offset: none." in page
    assert "p = 3.3 × 10⁻⁷" in page


ANSWERS = [
    ("odometry", "logs.0.distance_error", 1.5, "logs.0.distance_error: expected a mapping with keys of"),
    (
        "odometry",
        "logs.0.distance_error.var_m2",
        "x",
        "logs.0.distance_error.var_m2: input should be a valid",
    ),
    ("odometry", "logs.0.steps", None, "logs.0.steps: input should be a valid integer"),
    ("odometry", "logs", {}, "logs: input should be a valid list"),
    ("odometry", "logs", [], "logs: expected at least 1 items"),
    ("odometry", "offset.models", [3], "offset.models.0: expected a mapping with keys of"),
    ("odometry", "distance_scale.low", [], "distance_scale.low: input should be a valid number"),
    ("odometry", "distance_scale.high", 1e300, "distance_scale.high: input should be less than or equal to"),
    ("odometry", "warnings", [[1]], "warnings.0: input should be a valid string"),
    ("commands", "logs.0.alone.turn_gain.low", 2.0, "logs.0.alone.turn_gain: expected a value between low"),
    ("commands", "logs.1.alone", {"turn_gain": ONE}, "logs.1.alone: expected speed_gain, found none"),
    ("commands", "range_scale.value", -1.0, "range_scale.value: expected more than 0"),
    ("commands", "depth_power", None, "expected range_scale and depth_power or neither"),
    ("commands", "depth_power.value", 1e9, "depth_power.value: expected a number within 100"),
    ("range", "sensors.0.mean_rad", ONE, "sensors.0: expected a mean and a variance of one unit"),
    ("range", "sensors.0.recovered", None, "sensors.0: expected whether the given variance was recovered"),
    ("range", "sensors.0.mean_m.value", [1], "sensors.0.mean_m.value: input should be a valid number"),
    ("heading", "gyroscope.0.allan_tau_s", [1.0], "gyroscope.0: expected as many Allan deviations as"),
    ("heading", "gyroscope.0.allan_tau_s", [], "gyroscope.0: expected averaging times, found none"),
    ("heading", "gyroscope.0.allan_tau_s.1", 0.0, "gyroscope.0.allan_tau_s.1: input should be greater than"),
    ("heading", "gyroscope.0.axis", "w", "gyroscope.0.axis: unknown value 'w'; known: x, y, z"),
    ("heading", "magnetometer.0.soft_iron", [[1, 1], [1, 1]], "soft_iron: expected a matrix that has an"),
    ("heading", "magnetometer.0.soft_iron", [[1, 1]], "soft_iron: expected two rows of two numbers"),
    ("heading", "magnetometer.0.axes", "zx", "magnetometer.0.offset_gauss: expected axis z, found none"),
    ("heading", "gyroscope_while_driving.0.bias_with_scale_rad_s", None, "expected a bias with the scale"),
]


@pytest.mark.parametrize(("kind", "place", "value", "words"), ANSWERS)
def test_a_damaged_answer_is_told_with_its_place(
    kind: str, place: str, value: Any, words: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    answer: Any = json.loads(json.dumps(WHOLE[kind]()))
    *way, last = place.split(".")
    holder = answer
    for key in way:
        holder = holder[int(key) if isinstance(holder, list) else key]
    holder[int(last) if isinstance(holder, list) else last] = value
    code, said = told(tmp_path, answer, arrays_of(kind), capsys)
    assert code == 2
    assert said.startswith("pilotage: FOLDER/calibration.json: cannot be read, ")
    assert words in said
    assert said.endswith("; calibrate again\n")


ARRAYS = [
    ("odometry", "0/truth", np.zeros((STEPS, 2)), "0/truth: expected 30 x 3, found float64 of shape (30, 2)"),
    ("odometry", "0/t_s", np.full(STEPS, 1e300), "0/t_s: expected finite numbers within 1e+12, found 1e+300"),
    ("odometry", "0/t_s", np.array(["a"] * STEPS), "0/t_s: expected n, found <U1 of shape (30,)"),
    ("commands", "delay_cost", -np.ones(STEPS), "delay_cost: expected numbers from 0 on"),
    ("commands", "0/log_ratio", np.full(STEPS, 800.0), "0/log_ratio: expected finite numbers within 50"),
    ("range", "0", np.zeros(0), "0: expected at least one row, found none"),
    ("heading", "1/magnetometer/values", np.zeros((3, 2)), "values: expected n x 3, found float64 of shape"),
    ("heading", "drive-0/drift_rad", None, "expected an array drive-0/drift_rad, found none"),
]


@pytest.mark.parametrize(("kind", "name", "array", "words"), ARRAYS)
def test_damaged_arrays_are_told_with_their_name(
    kind: str, name: str, array: Any, words: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    arrays = arrays_of(kind) | {name: array}
    kept = {key: value for key, value in arrays.items() if value is not None}
    code, said = told(tmp_path, WHOLE[kind](), kept, capsys)
    assert code == 2
    assert said.startswith("pilotage: FOLDER/data.npz: cannot be read, ")
    assert words in said


def test_a_fit_far_from_all_readings_is_drawn(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Of what is left of the readings a histogram shows what is near; here nothing is."""
    answer = commands() | {"range_scale": {"value": 10.0, "low": 9.0, "high": 11.0}}
    assert told(tmp_path, answer, arrays_of("commands"), capsys) == (0, "")
