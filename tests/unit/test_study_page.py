"""The page of a study and its judgement, on made-up studies whose answer is known."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Mapping
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from matplotlib.figure import Figure

from pilotage.evaluation.judge import judge, paired_columns
from pilotage.evaluation.metrics import METRICS
from pilotage.evaluation.paired import difference
from pilotage.experiments.studies.cells import Cell
from pilotage.experiments.studies.definition import (
    CONFIGURATION,
    Configuration,
    Contrast,
    Group,
    StudyDefinition,
)
from pilotage.experiments.studies.factors import Factor
from pilotage.experiments.studies.study import Study
from pilotage.experiments.studies.table import Broken, StudyTable
from pilotage.report.study.answer import answer, answers
from pilotage.report.study.comparisons import verdict
from pilotage.report.study.examples import Example, describe, rows_to_show
from pilotage.report.study.factor_figures import _Places, lines_over
from pilotage.report.study.page import study_page

TRIALS = 20


def cell_of(
    index: int, name: str, values: Mapping[str, Any], published: Mapping[str, float], label: str = ""
) -> Cell:
    return Cell(index, name, values, (), published, label)


def changed(table: StudyTable, **definition: Any) -> StudyTable:
    """The same trials of a study that is defined otherwise."""
    study = replace(table.study, definition=table.study.definition.model_copy(update=definition))
    return replace(table, study=study)


def made_up(
    cells: list[Cell],
    metrics: tuple[str, ...],
    value: Callable[[Cell, int, str], float],
    baseline: int | None,
) -> StudyTable:
    """A study of these cells with these values; every factor's values are told with its name alone."""
    places = [(cell.index, trial) for cell in cells for trial in range(TRIALS)]
    values = {m: np.array([value(cells[c], t, m) for c, t in places]) for m in metrics}
    values["success"] = np.ones(len(places))
    trial = np.array([t for _, t in places])
    names = dict.fromkeys(factor for cell in cells for factor in cell.values if factor != CONFIGURATION)
    named = any(CONFIGURATION in cell.values for cell in cells)
    base = None if baseline is None else cells[baseline].name
    definition = StudyDefinition.model_construct(
        study="made-up",
        question="Does it matter?",
        mission="museum-1",
        configurations=(Configuration(name="one"),) if named else (),
        factors=tuple(Factor(key=name, name=name, values=(0,)) for name in names),
        trials=TRIALS,
        metrics=metrics,
        primary=metrics[0],
        lower_is_better=True,
        groups=(Group(name="all", cells=("*",), baseline=base),),
    )
    study = Study(definition, {"mission": "museum-1"}, tuple(cells), {})
    return StudyTable(
        study,
        Path("made-up"),
        np.arange(len(places)),
        np.array([c for c, _ in places]),
        trial,
        trial,
        values,
        (),
        0,
    )


def two_settings(shift_m: float) -> StudyTable:
    noise = np.random.default_rng(0).normal(0.0, 0.02, (2, TRIALS))
    seeds = np.random.default_rng(1).normal(10.0, 3.0, TRIALS)

    def value(cell: Cell, trial: int, _: str) -> float:
        return float(seeds[trial] + shift_m * cell.index + noise[cell.index, trial])

    cells = [
        cell_of(0, "plain", {"configuration": "plain"}, {}),
        cell_of(1, "new", {"configuration": "new"}, {}),
    ]
    return made_up(cells, ("path_length_m",), value, baseline=0)


def test_the_page_counts_why_trials_ended_by_setting() -> None:
    view = two_settings(0.0)
    assert 'id="endings"' not in study_page(view)
    ended = tuple(
        "stuck" if c == 1 and t < 7 else "complete" for c, t in zip(view.cell, view.trial, strict=True)
    )
    page = study_page(replace(view, ended=ended))
    table = page[page.index('<section id="endings">') :].split("</section>")[0]
    rows = re.findall(r'<th scope="row">(\w+)</th><td[^>]*>(\d*)</td><td[^>]*>(\d*)</td>', table)
    assert rows == [("plain", "20", ""), ("new", "13", "7")]


def test_a_better_setting_is_named_with_its_gain() -> None:
    view = two_settings(-0.5)
    text = answer(view, view.judged()).replace("\u00a0", " ")
    assert re.match(
        r"Path driven is 10\.\d+ m \([\d.]+ to [\d.]+\) with plain; lowest with new, 9\.\d+ m, ", text
    )
    assert re.search(r"a change by −0\.49\d* m \(−0\.50\d* to −0\.48\d*\) on the same 20 seeds", text)
    assert text.endswith("p < 0.001 after correction.")


def test_a_difference_that_is_none_is_called_chance() -> None:
    view = two_settings(-0.008)
    assert "not told from chance" in answer(view, view.judged())


def test_pairs_are_matched_by_their_trial_not_by_their_place() -> None:
    cell = np.array([0, 0, 0, 1, 1, 1])
    trial = np.array([2, 0, 1, 1, 2, 5])
    column = np.array([20.0, 0.0, 10.0, 11.0, 21.0, 51.0])
    first, other = paired_columns(cell, trial, column, 0, 1)
    assert first.tolist() == [10.0, 20.0]
    assert other.tolist() == [11.0, 21.0]


def test_all_comparisons_of_a_study_are_corrected_together() -> None:
    rng = np.random.default_rng(2)
    cell = np.repeat(np.arange(11), TRIALS)
    trial = np.tile(np.arange(TRIALS), 11)
    values: Mapping[str, np.ndarray] = {"path_length_m": rng.normal(size=cell.size)}
    found = [
        entry for entry in judge(cell, trial, values, [None, *[0] * 10]).differences["path_length_m"] if entry
    ]
    assert len(found) == 10
    assert all(entry.p_corrected >= entry.p_value for entry in found)


def test_a_cell_without_a_finished_trial_does_not_break_the_page() -> None:
    view = two_settings(-0.5)
    keep = view.cell == 0
    half = replace(
        view,
        row=view.row[keep],
        cell=view.cell[keep],
        trial=view.trial[keep],
        seed=view.seed[keep],
        values={name: column[keep] for name, column in view.values.items()},
        waiting=TRIALS,
        broken=(Broken(3, 1, 3, "the worker <died> twice"),),
    )
    page = study_page(half)
    assert "still to run" in page
    assert "the worker &lt;died&gt; twice" in page


@pytest.mark.parametrize("metric", ["path_length_m", "a_metric_that_nobody_knows"])
def test_numbers_over_a_factor_are_drawn_and_the_best_is_bold(metric: str) -> None:
    key = "stack.planner.turning_radius_m"
    cells = [
        cell_of(i, f"turning radius {radius:g} m", {key: radius}, {metric: 30.0})
        for i, radius in enumerate([0.1, 0.2, 0.5, 1.0])
    ]

    def value(cell: Cell, trial: int, _: str) -> float:
        radius = cell.values[key]
        assert isinstance(radius, float)
        return 20.0 + radius + 0.01 * trial

    page = study_page(made_up(cells, (metric,), value, baseline=None))
    assert 'id="factor-stack-planner-turning-radius-m"' in page
    assert "turning radius [m]" in page
    assert "published" in page
    assert "<b>20.195</b>" in page
    assert "http://" not in page.replace("http://www.w3.org", "")


def test_the_worst_and_the_median_trial_are_chosen_and_a_failure_is_worst() -> None:
    view = two_settings(-0.5)
    column = view.values["path_length_m"]
    (worst_title, worst), (median_title, median) = rows_to_show(view)
    assert (worst_title, median_title) == ("The worst trial", "The median trial")
    assert column[worst] == column.max()
    assert column[median] == pytest.approx(np.median(column), abs=0.6)
    success = view.values["success"].copy()
    success[5] = 0.0
    failed = replace(view, values={**view.values, "success": success})
    assert rows_to_show(failed)[0][1] == 5
    assert "it failed" in describe(failed, 5)


def test_examples_link_to_their_replay() -> None:
    shown = Example(
        "The worst trial", 5, "plain, seed 5", "trials/5/report.html", "pilotage run --from x:5", "<svg/>"
    )
    page = study_page(two_settings(-0.5), (shown,))
    assert 'href="trials/5/report.html#replay">Replay it</a>' in page
    assert 'href="trials/5/report.html">Its report</a>' in page
    still = study_page(two_settings(-0.5), (replace(shown, replay=False),))
    assert "Replay it" not in still
    assert "pilotage run --from x:5" in page


def with_groups(view: StudyTable, *groups: Group) -> StudyTable:
    return changed(view, groups=groups)


BEACONS = Group(name="on beacons", cells=("beacons, *",), baseline="beacons, plain")
WALLS = Group(name="on walls", cells=("walls, *",), baseline="walls, plain")


def four_settings(metrics: tuple[str, ...] = ("position_rmse_m", "nees_mean")) -> StudyTable:
    """Two filters, each plain and with a gate: 10 and 12 mm, 1 and 40 mm; NEES 3, 6, 3, 1."""
    rng = np.random.default_rng(4)
    centre = {"position_rmse_m": (0.010, 0.012, 0.001, 0.040), "nees_mean": (3.0, 6.0, 3.0, 1.0)}
    names = ("beacons, plain", "beacons, gate", "walls, plain", "walls, gate")
    cells = [
        cell_of(i, name, {"configuration": name}, {}, name.partition(", ")[2]) for i, name in enumerate(names)
    ]

    def value(cell: Cell, trial: int, metric: str) -> float:  # noqa: ARG001
        middle = centre.get(metric, centre["position_rmse_m"])[cell.index]
        return float(middle * (1.0 + 0.01 * rng.normal()))

    view = made_up(cells, metrics, value, baseline=None)
    return with_groups(view, BEACONS, WALLS)


def test_every_group_answers_for_itself_against_its_own_baseline() -> None:
    view = four_settings()
    judged = view.judged()
    headline = answer(view, judged).replace("\u00a0", " ")
    assert re.search(
        r"On beacons: least 9\.\d+ mm \(.*\) with plain, most 1[12]\.\d+ mm \(.*\) with gate; on walls: ",
        headline,
    )
    said = {name: " ".join(texts) for name, texts in answers(view, judged)}
    assert re.search(r"a change by \+(1\.9|2\.0)\d+\smm", said["on beacons"])
    assert re.search(r"a change by \+39\.\d+\smm", said["on walls"])
    assert "by NEES, plain: consistent, gate: overconfident" in said["on beacons"]
    assert "by NEES, plain: consistent, gate: underconfident" in said["on walls"]
    page = study_page(view)
    assert "on walls, against plain" in page
    assert page.count('<table class="cells">') >= 6
    assert not re.search(r"<td[^>]*>[^<]*\d[eE][+-]?\d", page)


def test_settings_of_another_group_are_called_by_their_own_name() -> None:
    view = four_settings()
    pairs = {"walls, plain": "beacons, plain", "walls, gate": "beacons, gate"}
    view = with_groups(view, BEACONS, WALLS.model_copy(update={"baseline": pairs}))
    text = answers(view, view.judged())
    assert "against beacons, plain" in dict(text)["on walls"][0]
    assert "against beacons, gate" in dict(text)["on walls"][0]


def test_metrics_of_the_same_trials_are_held_against_each_other() -> None:
    view = four_settings(("position_rmse_m", "other_m"))
    other = view.values["position_rmse_m"] + 0.002
    contrast = Contrast(metric="other_m", against="position_rmse_m")
    view = changed(replace(view, values={**view.values, "other_m": other}), contrasts=(contrast,))
    judged = view.judged()
    found = judged.contrasts["other_m", "position_rmse_m"]
    assert [round(entry.mean, 9) for entry in found] == [0.002] * 4
    assert "within each trial" in study_page(view)
    assert "+2.000\u00a0mm" in " ".join(answers(view, judged)[0][1])


def test_a_test_that_is_sure_of_ranks_alone_says_so() -> None:
    # Most pairs shrink a little, a few grow a lot: the mean is not told from zero.
    change = np.array([-1.0] * 27 + [9.0] * 3)
    found = difference(np.zeros(30), change + 1e-3 * np.arange(30))
    assert found.p_value < 0.05
    assert found.low < 0.0 < found.high
    assert verdict(found) == "lower in most trials, not surely in the mean"
    assert verdict(difference(np.zeros(30), np.full(30, 2.0) + 0.01 * np.arange(30))) == "higher"
    assert verdict(difference(np.ones(30), np.ones(30))) == "no trial differs"


def test_what_ended_early_is_not_called_quick() -> None:
    cells = [cell_of(i, name, {"configuration": name}, {}) for i, name in enumerate(("falls", "arrives"))]
    view = made_up(cells, ("coverage_visited", "duration_s"), lambda c, t, _: 10.0 + 5 * c.index + 0.1 * t, 0)
    view = changed(view, lower_is_better=False)
    assert "<b>10.95" in study_page(view)  # all succeed: the shorter duration is the better one
    failing = replace(view, values={**view.values, "success": np.where(view.cell == 0, 0.0, 1.0)})
    page = study_page(failing)
    assert "<b>10.95" not in page
    assert "<summary>success [percentage points]" in page


@pytest.mark.parametrize(
    ("metric", "lower"),
    [
        ("position_rmse_narrow_m", True),
        ("min_clearance_m", False),
        ("planned_clearance_m", False),
        ("visited_accuracy", False),
        ("final_error_x_m", None),
        ("nees_mean", None),
        ("a_metric_that_nobody_knows", None),
    ],
)
def test_which_way_a_metric_is_better_is_declared_with_it(metric: str, lower: bool | None) -> None:
    assert METRICS.find(metric).less_is_better is lower


def test_consistency_is_judged_only_where_it_is_reported() -> None:
    view = four_settings()
    assert 'id="consistency"' in study_page(view)
    assert 'id="consistency"' not in study_page(changed(view, metrics=("position_rmse_m",)))


def test_metrics_that_never_vary_are_left_out_unless_asked_for() -> None:
    view = four_settings()
    calm = {**view.values, "collisions": np.zeros(view.row.size)}
    with_it = changed(replace(view, values=calm), metrics=(*view.metrics, "collisions"))
    assert view.worth_showing("nees_mean", view.cells)
    assert with_it.worth_showing("collisions", view.cells)
    assert not changed(with_it, metrics=()).worth_showing("collisions", view.cells)


def test_one_setting_that_gave_something_is_not_the_lowest_and_the_highest() -> None:
    view = two_settings(-0.5)
    keep = view.cell == 0
    values = {name: column[keep] for name, column in view.values.items()}
    alone = replace(
        view,
        row=view.row[keep],
        cell=view.cell[keep],
        trial=view.trial[keep],
        seed=view.seed[keep],
        values=values,
    )
    alone = changed(alone, groups=(Group(name="all", cells=("*",)),))
    assert "the only setting that gave it" in answer_over_a_factor(alone)


def answer_over_a_factor(view: StudyTable) -> str:
    cells = tuple(replace(cell, values={"gate": 0.5 + cell.index}) for cell in view.cells)
    gate = Factor(key="gate", name="gate", values=(0,))
    view = replace(view, study=replace(view.study, cells=cells))
    view = changed(view, factors=(gate,), configurations=())
    return answer(view, view.judged())


def test_configurations_are_drawn_over_what_their_settings_amount_to() -> None:
    pairs = [(m, o) for m in (1.0, 0.1, 10.0) for o in (1.0, 10.0, 0.1)]
    cells = [
        cell_of(i, f"m {m}, o {o}", {"configuration": f"m {m}, o {o}", "measurement": m, "odometry": o}, {})
        for i, (m, o) in enumerate(pairs)
    ]
    view = made_up(cells, ("position_rmse_m",), lambda c, t, _: 1.0 + c.index + 0.1 * t, 4)
    lines = lines_over(view, view.cells, "measurement")
    assert [name for name, _ in lines] == ["odometry 0.1", "odometry 1", "odometry 10"]
    assert all(len(line) == 3 for _, line in lines)
    page = study_page(view)
    assert 'id="factor-measurement"' in page
    assert 'id="settings"' not in page


def test_a_line_over_a_factor_may_have_lists_and_mappings_beside_it() -> None:
    """A study over a parameter that is a list ended in a traceback after its last trial, with no page."""
    beside = ([1, 2], [2, 3], {"gain": 1.0}, None)
    pairs = [(gate, other) for gate in (0.9, 0.99) for other in beside]
    cells = [
        cell_of(i, f"{gate}, {other}", {"gate": gate, "pair": other}, {})
        for i, (gate, other) in enumerate(pairs)
    ]
    view = made_up(cells, ("position_rmse_m",), lambda c, t, _: 1.0 + c.index + 0.1 * t, None)
    lines = lines_over(view, view.cells, "gate")
    names = ["pair [1, 2]", "pair [2, 3]", "pair null", "pair {gain: 1}"]
    assert sorted(name for name, _ in lines) == names
    assert all(len(line) == 2 for _, line in lines)
    study_page(view)


def test_nothing_finished_yet_is_said() -> None:
    view = two_settings(0.0)
    empty = replace(
        view,
        row=view.row[:0],
        cell=view.cell[:0],
        trial=view.trial[:0],
        seed=view.seed[:0],
        values={},
        waiting=2 * TRIALS,
    )
    assert "No trial gave path driven" in study_page(empty)
    assert math.isnan(empty.judged().rates[0].low)


@pytest.mark.parametrize("values", [(1.0, 2.0, 4.0, 12.0), (1.0, 2.0, 64.0), (0.0, 0.1, 50.0)])
def test_what_stands_beside_a_value_is_nearer_to_it_than_to_any_other(values: tuple[float, ...]) -> None:
    """Of 1, 2, 4 and 12 robots the last strategy's one stood at 1.6, the first one's two at 1.4."""
    places = _Places(values)
    for low, high in pairwise(values):
        assert places.of(low, 0.0) < places.of(low, 0.45) < places.of(high, -0.45) < places.of(high, 0.0)


@pytest.mark.parametrize("values", [(0.8, 1.5), (1.0, 2.0, 4.0, 12.0), (1.0, 2.0, 64.0), (0.0, 0.1, 50.0)])
def test_an_axis_has_its_ticks_at_the_values(values: tuple[float, ...]) -> None:
    """Of 0.8 and 1.5 m/s it had them at 0.6, 0.8, 1.0, ...: lines side by side stood at speeds not driven."""
    axes = Figure().add_subplot()
    places = _Places(values)
    places.prepare(axes)
    np.testing.assert_allclose(axes.get_xticks(), [places.of(value, 0.0) for value in values])
    assert [text.get_text() for text in axes.get_xticklabels()] == [f"{value:g}" for value in values]
