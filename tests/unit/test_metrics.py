"""The table of metrics: every shipped mission's numbers are in it, and others can be declared beside them."""

from __future__ import annotations

import math
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from pilotage.core.errors import InputError
from pilotage.evaluation.consistency import nis_metrics
from pilotage.evaluation.metric import UNITS, Aspect, Clock, Direction, Metric, words_and_unit
from pilotage.evaluation.metrics import METRICS, computed
from pilotage.evaluation.metrics.registry import Metrics
from pilotage.evaluation.metrics.table import DECISIVE, shipped_metrics
from pilotage.evaluation.pose_errors import pose_errors
from pilotage.experiments.given import has
from pilotage.experiments.mission import load_mission, shipped_missions
from pilotage.report.quantities import measured


def fresh() -> Metrics:
    return Metrics(shipped_metrics(), DECISIVE)


def test_what_judges_a_task_is_declared_and_has_a_direction() -> None:
    for task in DECISIVE:
        costs = METRICS.costs_of(task, METRICS.given_by(task))
        assert [metric.key for metric in costs] == list(DECISIVE[task])
        assert all(metric.less_is_better is not None for metric in costs)


@pytest.mark.parametrize("name", shipped_missions())
def test_every_shipped_mission_is_judged_by_something(name: str) -> None:
    mission = load_mission(name)
    costs = METRICS.costs_of(mission.task.name, METRICS.given_by(mission.task.name, has(mission)))
    assert len(costs) >= 3


def test_a_mission_without_an_estimate_gives_no_errors() -> None:
    given = METRICS.given_by("plan", frozenset({"planner", "ground"}))
    assert "expansions" in given
    assert not {"position_rmse_m", "coverage_visited", "planned_clearance_m", "replans"} & given


def test_a_plugin_declares_a_metric_and_a_task() -> None:
    metrics = fresh()
    comfort = Metric("jerk_rms", "jerk", "", "Of the path.", Direction.LESS, Aspect.EFFORT)
    metrics.computed_by(comfort)(lambda trace, _: float(np.ptp(trace["t_s"])))
    metrics.add(Metric("rounds", "rounds", "count", "Driven.", Direction.MORE, tasks=frozenset({"guard"})))
    metrics.judge_task("guard", ["rounds", "jerk_rms"])
    assert metrics.computed("guard", {"t_s": np.array([1.0, 4.0])}, {}) == {"jerk_rms": 3.0}
    assert [m.key for m in metrics.costs_of("guard", ["jerk_rms", "rounds", "seed"])] == [
        "rounds",
        "jerk_rms",
    ]
    assert "rounds" not in metrics.given_by("reach")
    assert "rounds" not in METRICS


def test_a_run_without_the_columns_of_a_metric_does_without_it() -> None:
    """It ended the run with a plugin's KeyError; one for anything else still does."""
    metrics = Metrics([], {})
    metrics.computed_by(Metric("far", "far", "", ""))(lambda trace, _: float(trace["us_front_m"].max()))
    assert metrics.computed("reach", {"t_s": np.zeros(2)}, {}) == {}
    assert metrics.computed("reach", {"us_front_m": np.arange(3.0)}, {}) == {"far": 2.0}
    wrong: Any = lambda _, known: known["nothing"]  # noqa: E731
    metrics.computed_by(Metric("wrong", "wrong", "", ""))(wrong)
    with pytest.raises(KeyError, match="nothing"):
        metrics.computed("reach", {}, {})


def test_a_team_has_its_worst_robots_number_and_each_robot_its_own(monkeypatch: pytest.MonkeyPatch) -> None:
    """What a plugin computes was the first robot's alone, told as the team's."""
    metrics = Metrics([], {})
    for key, direction in (("less", Direction.LESS), ("more", Direction.MORE), ("even", Direction.NONE)):
        metrics.computed_by(Metric(key, key, "", "", direction))(lambda trace, _: float(trace["t_s"][-1]))
    hit: Any = lambda _, known: float(known["hits"] + known["seed"])  # noqa: E731
    metrics.computed_by(Metric("hit", "hit", "", ""))(hit)
    monkeypatch.setattr(computed, "METRICS", metrics)
    robots = [
        SimpleNamespace(name=name, trace={"t_s": np.array([t])}) for name, t in (("a", 1.0), ("b", 4.0))
    ]
    run: Any = SimpleNamespace(mission=SimpleNamespace(task=SimpleNamespace(name="reach")), robots=robots)
    known: dict[str, Any] = {"hits": 3, "seed": 5, "robots": {"a": {"hits": 1}, "b": {"hits": 2}}}
    computed.add_computed(known, run)
    assert {key: known[key] for key in ("less", "more", "even", "hit")} == {
        "less": 4.0,
        "more": 1.0,
        "even": 2.5,
        "hit": 6.5,
    }
    assert known["robots"] == {
        "a": {"hits": 1, "less": 1.0, "more": 1.0, "even": 1.0, "hit": 6.0},
        "b": {"hits": 2, "less": 4.0, "more": 4.0, "even": 4.0, "hit": 7.0},
    }


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda m: m.add(Metric("duration_s", "x", "s", "")), "declared already"),
        (lambda m: m.judge_task("guard", ["duration"]), "did you mean 'duration_s'"),
        (lambda _: Metric("Nice Metric", "x", "", ""), "a key of a-z"),
        (lambda _: Metric("jerk", "x", "m/s^2", ""), "unknown unit 'm/s\\^2'; did you mean 'm/s²'"),
        (lambda _: Metric("depth", "x", "six feet", ""), "at most 12 letters and signs without spaces"),
    ],
)
def test_what_cannot_be_declared_is_said(change: object, message: str) -> None:
    with pytest.raises(InputError, match=message):
        change(fresh())  # type: ignore[operator]


def test_a_unit_of_ones_own_stands_behind_the_number() -> None:
    """Energy, say: it was refused."""
    assert measured(1.5, Metric("energy", "energy", "Wh", "").unit) == "1.50 Wh"


def test_an_unknown_task_is_judged_by_what_has_a_direction() -> None:
    costs = METRICS.costs_of("juggle", ["collisions", "nees_mean", "seed", "duration_s"])
    assert [metric.key for metric in costs] == ["duration_s", "collisions"]


def test_wall_clock_metrics_are_told_apart() -> None:
    wall = {metric.key for metric in METRICS if metric.clock is Clock.WALL}
    assert {"wall_time_s", "steps_per_s", "planning_time_s", "real_time_factor"} <= wall
    assert "duration_s" not in wall
    assert not METRICS.is_wall_clock("nobody_knows_s")


@pytest.mark.parametrize(
    ("key", "words", "unit"),
    [
        ("robot.sensors.odometer.angle_var_rad2_per_rad", "angle var", "rad²/rad"),
        ("distance_var_m2_per_m", "distance var", "m²/m"),
        ("rho_gain_per_s", "rho gain", "1/s"),
        ("drift_m_s_per_s", "drift", "m/s²"),
        ("turning_radius_m", "turning radius", "m"),
        ("gate", "gate", ""),
        ("s", "s", ""),
    ],
)
def test_names_stay_whole_and_units_too(key: str, words: str, unit: str) -> None:
    assert words_and_unit(key) == (words, unit)


@given(st.text(min_size=1, max_size=30))
def test_any_key_has_words_and_any_unit_is_written(key: str) -> None:
    metric = METRICS.find(key)
    assert metric.less_is_better is None or key in METRICS
    assert all(isinstance(measured(1.5, unit), str) for unit in {*UNITS, metric.unit})
    assert measured(math.nan, metric.unit) == measured(math.nan, "m")


POSES = arrays(np.float64, (7, 3), elements=st.floats(-50.0, 50.0))


@given(POSES, POSES)
def test_pose_errors_by_their_definition_and_nothing_is_changed(
    truth: np.ndarray, estimate: np.ndarray
) -> None:
    before = truth.copy(), estimate.copy()
    counted = np.array([False, True, True, False, True, True, False])
    found = pose_errors(truth, estimate, counted).metrics()
    distance = np.linalg.norm((estimate - truth)[counted, :2], axis=1)
    assert found["position_rmse_m"] == pytest.approx(math.sqrt(float(np.mean(distance**2))))
    assert found["position_max_m"] == pytest.approx(distance.max())
    turned = np.angle(np.exp(1j * (estimate - truth)[counted, 2]))
    assert found["heading_rmse_rad"] == pytest.approx(math.sqrt(float(np.mean(turned**2))), abs=1e-9)
    assert np.array_equal(truth, before[0])
    assert np.array_equal(estimate, before[1])


def test_where_no_step_counts_only_the_end_is_told() -> None:
    poses = np.zeros((2, 3))
    assert pose_errors(poses, poses, np.zeros(2, dtype=np.bool_)).metrics().keys() == {"final_error"}


def test_nis_of_one_expectation_is_that_of_a_column_of_it() -> None:
    nis = np.append(np.random.default_rng(0).chisquare(2, 50), math.nan)
    one, column = nis_metrics(nis, 1.8), nis_metrics(nis, np.full(51, 1.8))
    assert one == pytest.approx(column)
    assert nis_metrics(np.full(3, math.nan), 2.0) == {}
    assert nis_metrics(np.ones(3), np.zeros(3)) == {}
