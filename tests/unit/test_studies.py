"""Studies: definitions, the database, workers, kills, replays and pages."""

from __future__ import annotations

import json
import os
import random
import shutil
import signal
import sqlite3
import time
from contextlib import suppress
from dataclasses import replace
from pathlib import Path

import pytest

from pilotage.cli.main import main
from pilotage.cli.study import _print_cells
from pilotage.cli.study_page import write_study_report
from pilotage.core.errors import InputError
from pilotage.evaluation.metrics import METRICS
from pilotage.experiments.run import run_mission
from pilotage.experiments.studies import dask_workers
from pilotage.experiments.studies.attribution import attribution_of, attribution_study
from pilotage.experiments.studies.database import DATABASE
from pilotage.experiments.studies.engine import run_study
from pilotage.experiments.studies.findings import study_object
from pilotage.experiments.studies.options import StudyOptions
from pilotage.experiments.studies.replay import mission_from
from pilotage.experiments.studies.rows import read_rows
from pilotage.experiments.studies.store import Store
from pilotage.experiments.studies.study import load_study, shipped_studies
from pilotage.experiments.studies.sweep import parse_vary, sweep_study
from pilotage.experiments.studies.table import read_study
from pilotage.experiments.studies.trial import Outcome
from pilotage.records.metrics import clean
from support.small_study import run_small, small
from support.warm_commands import start

ONE = StudyOptions(workers=1)


def numbers(folder: Path) -> list[tuple[int, int, int, str, str]]:
    """What a study's rows are, clock times apart."""
    rows, trouble = read_rows(folder / DATABASE)
    assert not trouble
    return [
        (row["row"], row["cell"], row["seed"], row["status"], json.dumps(row["metrics"], sort_keys=True))
        for row in rows
    ]


@pytest.fixture(scope="module")
def undisturbed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The small study, run by one worker."""
    folder = tmp_path_factory.mktemp("studies") / "small"
    counts = run_study(small(), folder, ONE)
    assert (counts.total, counts.done, counts.failed) == (12, 12, 0)
    return folder


def test_where_no_page_can_stand_no_trial_is_run_again(
    undisturbed: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The worst and the median trial were, and their folders stayed behind."""
    folder = tmp_path / "small"
    shutil.copytree(undisturbed, folder)
    (folder / "report.html").unlink(missing_ok=True)
    (folder / "report.html").mkdir()
    before = sorted(path.name for path in folder.iterdir())
    assert main(["report", str(folder)]) == 2
    place = folder / "report.html"
    assert capsys.readouterr().err == f"pilotage: {place}: expected a place for a file, found a folder\n"
    assert sorted(path.name for path in folder.iterdir()) == before


def test_every_shipped_study_can_be_loaded() -> None:
    names = shipped_studies()
    assert {"museum-planner", "museum-noise", "museum-missions", "gale-estimation", "romi-ablation"} <= set(
        names
    )
    assert len(load_study("museum-planner").cells) == 31
    for name in names:
        study = load_study(name)
        assert study.rows == len(study.cells) * study.definition.trials


def test_cells_share_their_seeds(undisturbed: Path) -> None:
    table = read_study(undisturbed)
    for cell in range(3):
        assert sorted(table.seed[table.cell == cell].tolist()) == [0, 1, 2, 3]


def test_two_workers_give_the_rows_of_one(undisturbed: Path, tmp_path: Path) -> None:
    run_study(small(), tmp_path / "two", StudyOptions(workers=2))
    assert numbers(tmp_path / "two") == numbers(undisturbed)


def test_a_cluster_gives_the_same_rows(
    undisturbed: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    distributed = pytest.importorskip("distributed", reason="needs the extra cluster")
    dask = pytest.importorskip("dask")
    monkeypatch.setattr(dask_workers, "CONNECT_S", 600)  # a slow machine's processes answer late
    settings = {f"distributed.comm.timeouts.{name}": "600s" for name in ("connect", "tcp")}
    # From the server of these tests' own workers, which has imported what a trial needs.
    settings["distributed.worker.multiprocessing-method"] = "forkserver"
    with (
        dask.config.set(settings),
        distributed.LocalCluster(
            n_workers=2, threads_per_worker=1, dashboard_address=":0", processes=True
        ) as cluster,
    ):
        run_study(small(), tmp_path / "cluster", StudyOptions(dask=cluster.scheduler_address))
    assert numbers(tmp_path / "cluster") == numbers(undisturbed)


def test_a_row_can_be_run_again_bit_equal(undisturbed: Path) -> None:
    rows, _ = read_rows(undisturbed / DATABASE)
    metrics = clean(dict(run_mission(mission_from(f"{undisturbed}:7"), save=False).metrics))
    again = {key: value for key, value in metrics.items() if not METRICS.is_wall_clock(key)}
    assert again == rows[7]["metrics"]


def test_killed_again_and_again_it_ends_as_if_nothing_had_been(undisturbed: Path, tmp_path: Path) -> None:
    """SIGKILL to parent and workers while rows come in; the last process is left to finish."""
    folder, rng = tmp_path / "killed", random.Random(6)

    def done() -> int:
        if not (folder / DATABASE).is_file():
            return 0
        return sum(row[3] == "done" for row in numbers(folder))

    before = 0
    for kill in range(2):
        process = start(tmp_path / f"{kill}", run_small, folder, kill > 0, folder=tmp_path)
        while done() < before + 2 and not process.over:
            time.sleep(0.03)
        time.sleep(rng.uniform(0.0, 0.1))
        with suppress(ProcessLookupError):  # where this test is slow it has ended by itself
            if kill == 1:
                os.kill(process.pid, signal.SIGKILL)  # the parent alone: its workers follow
            else:
                os.killpg(process.pid, signal.SIGKILL)
        process.ended()
        assert done() > before
        before = done()
    run_study(small(), folder, StudyOptions(workers=2, resume=True))
    assert numbers(folder) == numbers(undisturbed)
    assert {row["attempts"] for row in read_rows(folder / DATABASE)[0]} == {1}


def test_two_processes_share_a_study(undisturbed: Path, tmp_path: Path) -> None:
    folder = tmp_path / "shared"
    first, second = Store(folder, small()), Store(folder, small())
    rows = [task.row for store in (first, second, first) for task in store.claim(4)]
    assert sorted(rows) == list(range(12))
    assert first.claim(1) == []
    second.close()  # gives back what it had
    assert len(first.claim(12)) == 4
    first.close()
    run_study(small(), folder, StudyOptions(workers=1, resume=True))
    assert numbers(folder) == numbers(undisturbed)


def test_a_trial_that_the_machine_broke_is_tried_once_more(tmp_path: Path) -> None:
    store = Store(tmp_path / "study", small())
    for attempt in range(2):
        (task,) = store.claim(1)
        assert task.row == 0
        store.finish(Outcome(0, {}, {}, f"its worker died, try {attempt}", retry=True))
    (next_task,) = store.claim(1)
    assert next_task.row == 1
    store.finish(Outcome(1, {}, {}, "ZeroDivisionError: a bug", retry=False))
    counts = store.counts()
    store.close()
    assert (counts.done, counts.failed) == (0, 2)
    rows, _ = read_rows(tmp_path / "study" / DATABASE)
    assert rows[0]["reason"] == "its worker died, try 1"
    assert rows[0]["attempts"] == 2


def test_a_trial_that_crashes_does_not_take_the_study_with_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    study = small(factors=[{"key": "world.goal.x_m", "values": [20.0, -5.0]}], trials=2)
    with pytest.raises(InputError, match=r"cell 'x_m=-5': world\.goal: expected a place on the map"):
        run_study(study, tmp_path / "study", ONE)
    assert not (tmp_path / "study").exists()
    # As where only some seeds cannot be built.
    monkeypatch.setattr("pilotage.experiments.studies.engine.check_worlds", lambda _: None)
    counts = run_study(study, tmp_path / "study", ONE)
    assert (counts.done, counts.failed) == (2, 2)
    table = read_study(tmp_path / "study")
    assert all("world.goal" in entry.reason for entry in table.broken)


def test_another_definition_is_refused_with_what_changed(undisturbed: Path) -> None:
    with pytest.raises(InputError, match="trials: 4 -> 5"):
        run_study(small(trials=5), undisturbed, StudyOptions(resume=True))


def test_a_begun_study_asks_for_resume(tmp_path: Path) -> None:
    store = Store(tmp_path / "study", small())
    (task,) = store.claim(1)
    store.finish(Outcome(task.row, {"planned_length_m": 1.0}, {}))
    store.close()
    with pytest.raises(InputError, match="--resume"):
        run_study(small(), tmp_path / "study", ONE)


def test_a_metric_that_no_trial_gives_is_refused_with_the_nearest(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="did you mean 'planned_length_m'"):
        run_study(small(metrics=["planed_length_m"], primary=None, trials=1), tmp_path / "study", ONE)
    assert not (tmp_path / "study").exists()


def test_a_corrupt_database_is_said_and_salvaged(undisturbed: Path, tmp_path: Path) -> None:
    import shutil

    folder = tmp_path / "corrupt"
    shutil.copytree(undisturbed, folder)
    database = sqlite3.connect(folder / DATABASE)
    database.execute("pragma wal_checkpoint(truncate)")
    database.close()
    content = bytearray((folder / DATABASE).read_bytes())
    content[len(content) // 2 :] = b"\xff" * (len(content) - len(content) // 2)
    (folder / DATABASE).write_bytes(bytes(content))
    with pytest.raises(InputError, match="corrupt database"):
        read_study(folder)
    assert (folder / "trials-salvaged.csv").is_file()


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("stack.planner.turning_radius_m=0:1:0", "not zero"),
        ("stack.planner.turning_radius_m=1:0:0.1", "empty range"),
        ("stack.planner.turning_radius_m", "expected KEY"),
        ("stack.planner.turning_radius_m=", "expected KEY"),
        ("stack.planner.turning_radius_m=1:2", "A:B:STEP"),
    ],
)
def test_what_cannot_be_varied_is_one_line(text: str, message: str) -> None:
    with pytest.raises(InputError, match=message):
        parse_vary(text)


def test_an_unknown_key_to_vary_is_answered_with_the_nearest() -> None:
    with pytest.raises(InputError, match=r"did you mean 'stack\.planner\.turning_radius_m'"):
        sweep_study("museum-plan", ["stack.planner.turning_radius=0.1,0.2"], (), 2, ())


def test_a_sweep_of_nothing_runs_the_mission_over_its_seeds() -> None:
    study = sweep_study("museum-plan", (), ["stack.planner.turning_radius_m=0.3"], 3, ())
    assert [cell.name for cell in study.cells] == ["mission"]
    assert study.definition.trials == 3
    assert study.cells[0].overrides == ("stack.planner.turning_radius_m=0.3",)


def test_ranges_hold_both_ends() -> None:
    study = sweep_study("museum-plan", ["stack.planner.turning_radius_m=0.1:0.5:0.1"], (), 1, ())
    assert [cell.values["turning_radius_m"] for cell in study.cells] == [0.1, 0.2, 0.3, 0.4, 0.5]
    study = sweep_study("museum-plan", ["stack.planner.turning_radius_m=0.1:0.4:3:log"], (), 1, ())
    assert [cell.values["turning_radius_m"] for cell in study.cells] == [0.1, 0.2, 0.4]


def test_the_page_shows_cells_and_examples(undisturbed: Path) -> None:
    page = write_study_report(undisturbed).read_text(encoding="utf-8")
    assert "Over turning radius" in page
    assert "The worst trial" in page
    assert "pilotage run --from" in page
    assert (undisturbed / "trials").is_dir()


def test_attribution_ranks_the_modules(tmp_path: Path) -> None:
    made = attribution_study("museum-1", ["run.time_limit_s=4"], 3)
    assert made.cells[0].name == "as it is"
    run_study(made, tmp_path / "attribution", ONE)
    answer = attribution_of(tmp_path / "attribution")
    assert {entry["module"] for entry in answer["modules"]} == {
        "sensors",
        "initial",
        "localizer",
        "mapper",
        "planner",
        "controller",
    }
    by_name = {entry["module"]: entry["changes"] for entry in answer["modules"]}
    assert by_name["localizer"]["position_rmse_m"]["mean"] < 0.0


def test_the_terminal_cuts_no_number(
    undisturbed: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """What has no room is left out, and said; without a choice, what counts in such a mission leads."""
    monkeypatch.setenv("COLUMNS", "80")
    table = replace(read_study(undisturbed), study=small(metrics=[], primary=None))
    answer = study_object(table)
    assert answer["primary"] == "planned_length_m"
    _print_cells(answer)
    text = capsys.readouterr().out
    assert "…" not in text
    assert "planned path" in text
    assert "position error" not in text  # of a plan that nobody drove
    assert all(cell["name"] in text for cell in answer["cells"])
    assert "more metrics" in text
    assert max(map(len, text.splitlines())) <= 80


@pytest.fixture
def in_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_the_commands_end_to_end(in_folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    arguments = ["sweep", "museum-plan", "--vary", "stack.planner.turning_radius_m=0.3,0.6", "--trials", "2"]
    arguments += ["--metrics", "planned_length_m", "--set", "stack.planner.stop=first", "--workers", "1"]
    assert main([*arguments, "--name", "mine", "--json"]) == 0
    answer = json.loads(capsys.readouterr().out)
    assert answer["trials"] == 4
    assert answer["failed"] == 0
    assert set(answer["cells"][0]["metrics"]["planned_length_m"]) >= {"n", "mean", "median", "low", "high"}
    assert (in_folder / "studies" / "mine" / "trials.parquet").is_file()
    assert main(["run", "--from", "mine:3", "--json", "--no-report"]) == 0
    assert json.loads(capsys.readouterr().out)["seed"] == 1
    assert main(["run", "--from", "mine:99", "--json"]) == 2
    assert "from 0 to 3" in capsys.readouterr().err
    assert main(["run"]) == 2
    capsys.readouterr()
    assert main(["study", "museum-planer"]) == 2
    assert "did you mean 'museum-planner'" in capsys.readouterr().err
