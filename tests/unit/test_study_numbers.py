"""Numbers on a study's page: one unit a column, digits worth their interval, never powers of ten."""

from __future__ import annotations

import math
import re

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pilotage.evaluation.metric import words_and_unit
from pilotage.experiments.studies.factors import show
from pilotage.experiments.studies.rows import flat
from pilotage.report.study.scales import Scale, p_value, scale_of, told


@pytest.mark.parametrize(
    ("metric", "values", "unit"),
    [
        ("position_rmse_m", [0.0065, 0.018], "mm"),
        ("position_rmse_m", [0.0065, 0.002, 1.8], "mm"),
        ("position_rmse_m", [0.0065, 0.9, 1.8], "m"),
        ("position_rmse_m", [], "m"),
        ("path_length_m", [31_000.0], "km"),
        ("planning_time_s", [0.05], "ms"),
        ("duration_s", [86.0, math.nan], "s"),
        ("duration_s", [338_190.0], "h"),
        ("heading_rmse_rad", [0.001], "°"),
        ("coverage_visited", [0.3], "%"),
        ("success", [1.0], "%"),
        ("nees_mean", [3.0], ""),
        ("a_speed_m_s", [2.0], "m/s"),
    ],
)
def test_a_column_has_the_unit_of_its_middle_value(metric: str, values: list[float], unit: str) -> None:
    assert scale_of(metric, values).unit == unit


def test_numbers_beyond_anything_that_is_measured_are_none() -> None:
    """Their sums and squares were none either, and a page of them a warning or a traceback."""
    given = {"far": 1e308, "less": -2e30, "whole": 10**400, "success": True, "b": {"x_m": 1e30}}
    assert flat(given) == {"success": 1.0, "b_x_m": 1e30}


def test_digits_end_where_the_interval_begins() -> None:
    assert told("planned_length_m", 24.5204, 24.5072, 24.5349) == "24.520\u00a0m (24.507 to 24.535)"
    assert told("final_position_error_m", 1100.2, 972.1, 1259.0) == "1\u00a0100\u00a0m (972 to 1\u00a0259)"
    assert told("position_rmse_m", 0.00641, 0.00630, 0.00651) == "6.41\u00a0mm (6.30 to 6.51)"
    assert told("nees_mean", -1e-9, -0.02, 0.02, signed=True) == "+0.000 (−0.020 to +0.020)"
    assert told("nees_mean", math.nan, math.nan, math.nan) == "–"


@given(st.floats(-1e9, 1e9), st.floats(1e-12, 1e6))
def test_no_number_is_written_in_powers_of_ten(value: float, half: float) -> None:
    for metric in ("position_rmse_m", "nees_mean", "planning_time_s"):
        text = told(metric, value, value - half, value + half, signed=True)
        assert not re.search(r"\d[eE][+-]?\d", text)
    assert "e" not in Scale(1000.0, "ms").write_variance(half)


def test_a_variance_is_in_the_square_of_its_columns_unit() -> None:
    times_s = np.array([0.050, 0.052, 0.054])
    scale = scale_of("planning_time_s", times_s)
    assert scale.square == " [ms²]"
    assert scale.write_variance(float(times_s.var(ddof=1))) == "4.00"


def test_small_p_values_are_not_told_apart() -> None:
    assert p_value(3e-17) == "< 0.001"
    assert p_value(0.0123, "p ") == "p = 0.012"
    assert p_value(3e-17, "p ") == "p < 0.001"


def test_a_keys_unit_is_its_ending() -> None:
    assert words_and_unit("stack.planner.turning_radius_m") == ("turning radius", "m")
    assert words_and_unit("stack.local_planner.speed_m_s") == ("speed", "m/s")
    assert words_and_unit("stack.localizer.gate") == ("gate", "")


def test_small_variances_are_short_and_rounding_is_none() -> None:
    scale = Scale()
    # Of four equal trials the interval's ends differ by rounding: they were told as 5.200000 s.
    assert scale.decimals(5.2, 5.2 - 1e-15, 5.2 + 1e-15) == scale.decimals(5.2, 5.2, 5.2) == 3
    assert scale.write_variance(1.234e-11, 1e-3) == "1.23 · 10⁻¹¹"
    assert scale.write_variance(4.7e-5, 0.08) == "4.70 · 10⁻⁵"
    assert scale.write_variance(1.08e-23, 1.0) == "0"
    assert scale.write_variance(0.0, 0.0) == "0"


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (None, "null"),
        (True, "true"),
        (0.1 + 0.2, "0.3"),
        (1, "1"),
        ("off", "off"),
        ({"name": "slam", "known": False}, "{name: slam, known: false}"),
        ([0.5, None], "[0.5, null]"),
    ],
)
def test_a_value_is_called_what_a_mission_file_calls_it(value: object, text: str) -> None:
    """Cells were called ``mapper=None`` and ``known=True``, which no mission file understands."""
    assert show(value) == text
