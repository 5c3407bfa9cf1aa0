"""``pilotage attribute`` for every mission: what is compared, how it is ranked, what is said."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from pilotage.cli.main import main
from pilotage.cli.study_page import write_study_report
from pilotage.core.errors import InputError
from pilotage.evaluation.metrics import METRICS
from pilotage.experiments.given import has
from pilotage.experiments.mission import load_mission, shipped_missions
from pilotage.experiments.run import run_mission
from pilotage.experiments.studies import attribution
from pilotage.experiments.studies.asked import Asked
from pilotage.experiments.studies.attribution import attribution_of, attribution_study, is_attribution
from pilotage.experiments.studies.engine import run_study
from pilotage.experiments.studies.options import StudyOptions
from pilotage.experiments.studies.rows import flat
from pilotage.experiments.studies.sweep import sweep_study
from pilotage.missions.mission import Mission
from pilotage.report.study.ranking import module_words, ranking_answer, ranking_table

SMALL = """
size_m: [1.0, 0.8]
cells: [10, 8]
start_pose: [0.3, 0.3, 0.0]
obstacles: [[0.62, 0.45, 0.8, 0.6]]
lines: [[[0.2, 0.6], [0.45, 0.6]]]
"""


@pytest.fixture
def planned(tmp_path: Path) -> Path:
    """A mission that plans round a wall of pixels with a gap on top."""
    pixels = np.zeros((40, 60), np.uint8)
    pixels[3:, 30] = 255
    Image.fromarray(pixels).save(tmp_path / "obstacles.png")
    path = tmp_path / "round-a-wall.yaml"
    path.write_text(
        "mission: round-a-wall\n"
        "world:\n"
        f"  map: {{name: images, obstacles: {tmp_path / 'obstacles.png'}}}\n"
        "  start: {x_m: 55, y_m: 45}\n"
        "  goal: {x_m: 545, y_m: 45}\n"
        "robot: {footprint: {radius_m: 1.5}}\n"
        "task: plan\n"
        "stack: {navigator: {name: curve, spline: null}, planner: {name: astar}}\n"
    )
    return path


def costs(mission: Mission) -> list[str]:
    """What judges a mission, as far as it has what that needs."""
    given = METRICS.given_by(mission.task.name, has(mission))
    return [metric.key for metric in METRICS.costs_of(mission.task.name, given)]


@pytest.mark.parametrize("name", sorted({*shipped_missions()} - {"gale-pose"}))
def test_every_shipped_mission_can_be_attributed(name: str) -> None:
    """Or has modules, at least, that an oracle can replace; gale-pose is given what it has."""
    made = attribution_study(name, (), 2)
    assert is_attribution(made)
    assert len(made.cells) > 1
    mission = load_mission(name)
    assert made.definition.metrics == tuple(costs(mission))


@pytest.mark.parametrize("name", ["gale-astar", "gale-pose", "romi-baseline", "museum-plan", "museum-1"])
def test_what_is_compared_is_what_the_mission_gives(name: str) -> None:
    mission = load_mission(name, ["run.time_limit_s=20"])
    metrics = run_mission(mission, save=False).metrics
    assert set(costs(mission)) <= set(metrics)
    assert flat(metrics).keys() <= METRICS.given_by(mission.task.name, has(mission))


@pytest.mark.parametrize(
    ("name", "limit_s"),
    [("museum-lost", 20), ("museum-route", 5), ("gale-astar-ekf", 20000), ("romi-explore", 9)],
)
def test_every_number_of_a_run_can_be_asked_for(name: str, limit_s: float) -> None:
    """A study refuses names that its task does not give, so the table has to know all that it gives."""
    mission = load_mission(name, [f"run.time_limit_s={limit_s}"])
    metrics = run_mission(mission, save=False).metrics
    assert flat(metrics).keys() <= METRICS.given_by(mission.task.name, has(mission))


def test_a_sheet(tmp_path: Path) -> None:
    """The random walk falls off the sheet: what a knowing explorer gains in success and coverage leads."""
    (tmp_path / "small.yaml").write_text(SMALL)
    made = attribution_study("romi-baseline", [f"world.map={tmp_path / 'small.yaml'}"], 8)
    run_study(made, tmp_path / "study", StudyOptions(workers=1))
    answer = attribution_of(tmp_path / "study")
    first = answer["modules"][0]
    assert first["module"] == "explorer"
    assert first["changes"]["coverage_reachable"]["mean"] > 0.3
    assert answer["baseline"]["success"] == 0.0
    # No run of the baseline came to its end: its time is not held against that of one that did.
    assert "duration_s" not in first["changes"]
    by_name = {entry["module"]: entry["changes"] for entry in answer["modules"]}
    assert by_name["localizer"]["position_rmse_m"]["mean"] == pytest.approx(
        -answer["baseline"]["position_rmse_m"], abs=1e-6
    )
    page = write_study_report(tmp_path / "study", examples=False).read_text(encoding="utf-8")
    assert '<section id="ranking">' in page
    assert page.index("What each module costs") < page.index("Settings side by side")


def test_terrain_from_the_command_line(
    planned: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Nothing is drawn where a path is planned on a known map: two trials are as good as a hundred."""
    monkeypatch.chdir(tmp_path)
    assert main(["attribute", str(planned), "--trials", "2", "--workers", "1", "--json"]) == 0
    (only,) = json.loads(capsys.readouterr().out)["modules"]
    assert only["module"] == "planner"
    assert "any angle" in only["oracle"]
    change = only["changes"]["planned_length_m"]
    assert change["sure"]
    assert change["mean"] == change["low"] == change["high"] < 0.0
    assert any(text.startswith("planned_length_m -") and "every trial" in text for text in only["told"])
    # People read names and units, and which module it is.
    assert main(["attribute", str(planned), "--trials", "2", "--workers", "1"]) == 0
    text = capsys.readouterr().out
    assert "planned_length_m" not in text
    assert "What costs most is 'planner': with an oracle for it" in text


def test_a_strangers_task_is_attributed_by_what_its_runs_give(monkeypatch: pytest.MonkeyPatch) -> None:
    """All that any task may give was asked for, and the study refused after its last trial."""
    monkeypatch.setattr(attribution, "is_from_outside", lambda _: True)
    definition = attribution_study("museum-1", (), 2).definition
    assert (definition.metrics, definition.primary) == ((), None)
    judging = METRICS.costs_of("somebodys", METRICS.given_by("reach"))
    assert "position_rmse_m" in {metric.key for metric in judging}
    assert not any(METRICS.is_wall_clock(metric.key) for metric in judging)


def test_another_study_has_no_ranking(planned: Path) -> None:
    vary = ["stack.planner.name=astar,theta-star"]
    made = sweep_study(str(planned), vary, (), 1, ["planned_length_m"])
    assert not is_attribution(made)


def entry(module: str, **changes: tuple[float, float, float, bool]) -> dict[str, Any]:
    """A module as ``attribution_of`` gives it; less of everything but success is better."""
    return {
        "module": module,
        "oracle": "knows <all>",
        "changes": {
            name: {"n": 9, "mean": mean, "low": low, "high": high, "sure": sure}
            | {"better": mean > 0.0 if name == "success" else mean < 0.0}
            for name, (mean, low, high, sure) in changes.items()
        },
    }


class TestWords:
    def test_the_first_sure_cost_answers(self) -> None:
        modules = [
            entry("mapper", duration_s=(-9.0, -12.0, 2.0, False)),
            entry("planner", duration_s=(-5.0, -6.0, -4.0, True), path_length_m=(0.0, 0.0, 0.0, False)),
        ]
        assert "'planner'" in ranking_answer(modules)
        assert "way" not in ranking_answer(modules)

    def test_few_trials_say_so(self) -> None:
        likely = [entry("planner", duration_s=(-5.0, -6.0, -4.0, False))]
        assert "too few" in ranking_answer(likely)
        assert ranking_answer([entry("planner", duration_s=(-5.0, -9.0, 4.0, False))]).endswith(
            "from chance."
        )

    def test_what_an_oracle_makes_worse_is_no_cost_of_its_module(self) -> None:
        worse = entry("localizer", position_rmse_m=(0.002, 0.001, 0.003, True))
        likely = entry("planner", duration_s=(-5.0, -6.0, -4.0, False))
        sure = entry("mapper", duration_s=(-5.0, -6.0, -4.0, True))
        assert "is 'mapper'" in ranking_answer([worse, likely, sure])
        assert "is likely 'planner'" in ranking_answer([worse, likely])
        alone = ranking_answer([worse])
        assert "costs most" not in alone
        assert "worse: with one for 'localizer'" in alone

    def test_a_cost_is_told_with_what_its_oracle_makes_worse(self) -> None:
        both = entry(
            "mapper", position_rmse_m=(0.002, 0.001, 0.003, True), duration_s=(-5.0, -6.0, -4.0, True)
        )
        assert (
            "duration changes by −5.0\u00a0s (−6.0 to −4.0); for the worse, position error"
            in ranking_answer([both])
        )
        first, second = module_words(both)
        assert first.startswith("duration −5.0")
        assert second.startswith("worse: position error")

    def test_nothing_is_gained_where_success_falls(self) -> None:
        falls = entry("explorer", success=(-0.5, -0.8, -0.2, True), duration_s=(-9.0, -9.0, -9.0, True))
        assert "costs most" not in ranking_answer([falls])

    def test_the_table(self) -> None:
        table = ranking_table(
            [
                entry("planner", duration_s=(-5.0, -6.0, -4.0, True), collisions=(0.0, 0.0, 0.0, False)),
                entry("mapper", duration_s=(-5.0, -5.0, -5.0, False)),
            ]
        ).html
        assert "<b>−5.0</b>" in table
        assert "in every trial" in table
        assert "knows &lt;all&gt;" in table
        assert "collisions" not in table  # nobody changes them
        assert ranking_table([entry("mapper", duration_s=(0.0, 0.0, 0.0, False))]).html == ""


def test_runs_within_the_start_phase_are_refused_before_the_first_trial() -> None:
    """All of them ran, and gave no errors to compare."""
    with pytest.raises(InputError, match=r"expected a run\.time_limit_s above run\.settle_s \(1 s\)"):
        attribution_study("museum-1", ["run.time_limit_s=1"], 2)
    sweep = sweep_study(
        "museum-1", ["stack.localizer.gate=0.9,0.99"], ["run.time_limit_s=1"], 1, ("nees_mean",)
    )
    with pytest.raises(InputError, match=r"metric 'nees_mean': .* runs that end within it"):
        Asked(sweep).check_tasks()
