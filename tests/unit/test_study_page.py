"""The page of a study and its judgement, on made-up studies whose answer is known."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

import numpy as np
import pytest

from pilotage.evaluation.judge import judge, paired_columns
from pilotage.report.study.answer import answer
from pilotage.report.study.examples import Example, describe, rows_to_show
from pilotage.report.study.page import judge_view, study_page
from pilotage.report.study.view import Cell, Failure, Group, StudyView

TRIALS = 20


def all_of(cells: Sequence[Cell], baseline: int | None, name: str = "") -> Group:
    """A group of these cells, held against one of them."""
    held = tuple(None if cell.index == baseline else baseline for cell in cells)
    return Group(name, tuple(cell.index for cell in cells), held)


def made_up(
    cells: list[Cell],
    metrics: tuple[str, ...],
    value: Callable[[Cell, int, str], float],
    baseline: int | None,
) -> StudyView:
    """A study of these cells with these values."""
    places = [(cell.index, trial) for cell in cells for trial in range(TRIALS)]
    values = {m: np.array([value(cells[c], t, m) for c, t in places]) for m in metrics}
    values["success"] = np.ones(len(places))
    trial = np.array([t for _, t in places])
    return StudyView(
        name="made-up",
        question="Does it matter?",
        mission="museum-1",
        cells=tuple(cells),
        factors=tuple(dict.fromkeys(factor for cell in cells for factor in cell.values)),
        metrics=metrics,
        primary=metrics[0],
        lower_is_better=True,
        groups=(all_of(cells, baseline),),
        reference={},
        trials_per_cell=TRIALS,
        first_seed=0,
        row=np.arange(len(places)),
        cell=np.array([c for c, _ in places]),
        trial=trial,
        seed=trial,
        values=values,
        failures=(),
        waiting=0,
        definition="study: made-up\n",
    )


def two_settings(shift_m: float) -> StudyView:
    noise = np.random.default_rng(0).normal(0.0, 0.02, (2, TRIALS))
    seeds = np.random.default_rng(1).normal(10.0, 3.0, TRIALS)

    def value(cell: Cell, trial: int, _: str) -> float:
        return float(seeds[trial] + shift_m * cell.index + noise[cell.index, trial])

    cells = [Cell(0, "plain", {"configuration": "plain"}, {}), Cell(1, "new", {"configuration": "new"}, {})]
    return made_up(cells, ("path_length_m",), value, baseline=0)


def test_a_better_setting_is_named_with_its_gain() -> None:
    view = two_settings(-0.5)
    text = answer(view, judge_view(view)).replace("\u00a0", " ")
    assert re.match(
        r"Way driven is 10\.\d+ m \([\d.]+ to [\d.]+\) with plain; lowest with new, 9\.\d+ m, ", text
    )
    assert re.search(r"a change by −0\.49\d* m \(−0\.50\d* to −0\.48\d*\) on the same 20 seeds", text)
    assert text.endswith("p < 0.001 after correction.")


def test_a_difference_that_is_none_is_called_chance() -> None:
    view = two_settings(-0.008)
    assert "not told from chance" in answer(view, judge_view(view))


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
        failures=(Failure(3, 1, 3, "the worker <died> twice"),),
    )
    page = study_page(half)
    assert "still to run" in page
    assert "the worker &lt;died&gt; twice" in page


@pytest.mark.parametrize("metric", ["path_length_m", "a_metric_that_nobody_knows"])
def test_numbers_over_a_factor_are_drawn_and_the_best_is_bold(metric: str) -> None:
    key = "stack.planner.turning_radius_m"
    cells = [
        Cell(i, f"turning radius {radius:g} m", {key: radius}, {metric: 30.0})
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
    assert 'href="trials/5/report.html"' in page
    assert "pilotage run --from x:5" in page


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
    assert "No trial gave way driven" in study_page(empty)
    assert math.isnan(judge_view(empty).rates[0].low)
