"""What studies are told wrongly is one line; what they were told rightly can be run again anywhere."""

from __future__ import annotations

import json
import shutil
from pathlib import Path
from typing import Any

import pytest
import yaml

from pilotage.cli.main import main
from pilotage.core.errors import InputError
from pilotage.evaluation.metrics import METRICS
from pilotage.experiments.studies.database import DATABASE
from pilotage.experiments.studies.definition import StudyDefinition
from pilotage.experiments.studies.engine import _write
from pilotage.experiments.studies.files import digests
from pilotage.experiments.studies.rows import read_rows
from pilotage.experiments.studies.store import Store
from pilotage.experiments.studies.study import (
    MISSION_FILE,
    Study,
    load_study,
    make_study,
    mission_yaml,
    study_yaml,
)
from pilotage.experiments.studies.sweep import sweep_study
from pilotage.experiments.studies.trial import TrialRunner
from pilotage.records.folder import STUDY_FILE

RADIUS = "stack.planner.turning_radius_m"


def refused(capsys: pytest.CaptureFixture[str], *arguments: str) -> str:
    """The one line that a command is refused with."""
    assert main(list(arguments)) == 2
    out, err = capsys.readouterr()
    assert out == ""
    (line,) = err.splitlines()
    assert line.startswith("pilotage: ")
    assert not line.startswith("pilotage: :")
    assert len(line) < 700
    return line


@pytest.mark.parametrize("named", ["a.pgm", "/on/the/robot/a.pgm"])
def test_a_maps_image_decides_rows_wherever_it_is_found(tmp_path: Path, named: str) -> None:
    """Of a map whose name ends in capitals, or that was moved with its image, another image passed for it."""
    (tmp_path / "a.pgm").write_bytes(b"P5 1 1 255 x")
    (tmp_path / "map.YAML").write_text(f"image: {named}\nresolution: 1\norigin: [0, 0]\n")
    before = digests({"map": str(tmp_path / "map.YAML")})
    (tmp_path / "a.pgm").write_bytes(b"P5 1 1 255 y")
    after = digests({"map": str(tmp_path / "map.YAML")})
    assert {Path(path).name for path in before if before[path] != after[path]} == {"a.pgm"}


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("", "found an empty file"),
        ("{a: [", "line 1: expected YAML"),
        ("- 1", "found a list"),
        ("mission: museum-plan", "study: missing"),
        ("study: x", "mission: missing"),
        ("{study: x, mission: museum-plan, trails: 3}", "did you mean 'trials'?"),
        ("{study: x, mission: museum-plan, trials: 0}", "greater than or equal to 1, found 0"),
        ("{study: x, mission: museum-plan, trials: many}", "found 'many'"),
        ("{study: x, mission: nowhere.yaml}", "mission file 'nowhere.yaml'"),
        ("{study: x, mission: museum-paln}", "did you mean 'museum-plan'?"),
        ("{study: x, mission: museum-plan, baseline: b}", "unknown baseline 'b'"),
        ("{study: x, mission: museum-plan, seeds: {first: 10000000000000000000}}", "seeds.first"),
        ("{study: x, mission: museum-plan, set: {world.goal.x_m: 2020-01-01}}", "found the date 2020-01-01"),
        ("{study: x, mission: museum-plan, set: {world.goal.x_m: .nan}}", "expected a finite number"),
        (
            "{study: x, mission: museum-plan, trials: 10000000, configurations: [{name: a}, {name: b}]}",
            "rows",
        ),
        (f"{{study: {'a' * 300}, mission: museum-plan}}", "200 characters"),
        (f"{{study: {'ö' * 150}, mission: museum-plan}}", "200 bytes"),
        (
            "{study: two words, mission: museum-plan}",
            "letters, digits, '-', '_' and '.', as it names a folder",
        ),
        ("{study: ../x, mission: museum-plan}", "as it names a folder, found '../x'"),
        ("{study: x, mission: museum-plan, plugins: [a.py]}", "plugins: unknown key; a mission has it"),
    ],
)
def test_a_wrong_study_file_is_one_line(
    text: str, told: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "Übung eins.yaml"
    file.write_text(text, encoding="utf-8")
    line = refused(capsys, "study", str(file), "--out", str(tmp_path / "out"))
    assert told in line
    assert "Übung eins.yaml" in line
    assert not (tmp_path / "out").exists()


def test_a_study_of_a_mission_in_another_language_has_its_name(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("größte Übung.yaml").write_text("extends: museum-plan\n", encoding="utf-8")
    assert main(["sweep", "größte Übung.yaml", "--trials", "1", "--workers", "1", "--no-report"]) == 0
    capsys.readouterr()
    (folder,) = Path("studies").iterdir()
    assert folder.name.startswith("sweep-größte-Übung-")
    assert main(["run", "--from", f"{folder.name}:0", "--no-report", "--json"]) == 0


@pytest.mark.parametrize(
    ("factors", "told"),
    [
        ([{"key": RADIUS, "values": []}], "an empty list of values"),
        ([{"key": RADIUS, "values": [0.3, 0.3]}], "0.3 stands twice"),
        ([{"key": RADIUS, "range": {"start": 1, "stop": 0, "step": 0.1}}], "an empty range"),
        ([{"key": RADIUS, "range": {"start": 0, "stop": 1, "step": 0}}], "a step other than 0"),
        ([{"key": RADIUS, "range": {"start": 0, "stop": ".inf", "step": 1}}], "stop"),
        ([{"key": RADIUS, "log_range": {"start": -1, "stop": 1, "count": 3}}], "greater than 0, found -1"),
        ([{"key": RADIUS, "random_range": {"low": -1, "high": 1, "count": 2, "log": True}}], "low above 0"),
        ([{"key": RADIUS, "random_range": {"low": 1, "high": 1, "count": 2}}], "an empty range"),
        ([{"key": RADIUS, "values": [1], "range": {"start": 0, "stop": 1, "step": 1}}], "values and range"),
        ([{"key": RADIUS, "values": [0.3]}, {"key": RADIUS, "values": [0.4]}], "stands twice"),
        (
            [{"key": RADIUS, "values": [0.3], "name": "a"}, {"key": RADIUS, "values": [0.4], "name": "b"}],
            "one of them would have no effect",
        ),
        ([{"key": [RADIUS, RADIUS], "values": [0.3]}], "stands twice"),
        ([{"key": "stack.planner.turning_radius", "values": [0.3]}], f"did you mean '{RADIUS}'?"),
        ([{"key": "world.goal", "values": [1], "multiply": True}], "a number in the mission to multiply"),
        ([{"key": "run.seed", "values": [1]}], "the trials take their seeds"),
        ([{"key": RADIUS, "values": [-1]}], "cell 'turning_radius_m=-1'"),
        ([{"name": "x", "levels": {1: {}, 2: {}}}], "expected names in quotes"),
        ({"key": RADIUS}, "factors"),
    ],
)
def test_a_wrong_factor_is_one_line(
    factors: Any, told: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "study.yml"
    file.write_text(yaml.safe_dump({"study": "x", "mission": "museum-plan", "factors": factors}))
    assert told in refused(capsys, "study", str(file), "--out", str(tmp_path / "out"))
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        ("study nope", "unknown study 'nope'"),
        ("study empty-folder", "found no study.yaml in it"),
        ("study museum-planner --out file", "file"),
        ("attribute nope", "unknown mission 'nope'"),
        (f"sweep museum-plan --vary {RADIUS}=nan", "expected a finite number"),
        (f"sweep museum-plan --vary {RADIUS}=0:inf:1", "expected finite numbers"),
        (f"sweep museum-plan --vary {RADIUS}=0:1:3:log", "expected finite numbers above 0"),
        (f"sweep museum-plan --vary {RADIUS}=0.1:1:0.3:log", "as COUNT, found '0.3'"),
        (f"sweep museum-plan --vary {RADIUS}=0.1:1:1:log", "an empty range"),
        (f"sweep museum-plan --vary {RADIUS}=0.3 --metrics a,,b", "--metrics 'a,,b'"),
        (
            f"sweep museum-plan --vary {RADIUS}=0.3 --metrics planned_lenght_m",
            "did you mean 'planned_length_m'?",
        ),
        (
            f"sweep museum-plan --vary {RADIUS}=0.3 --metrics coverage_visited",
            "no mission of the task plan",
        ),
        (f"sweep museum-plan --vary {RADIUS}=0.3 --name ../up", "study"),
        (f"sweep museum-plan --vary {RADIUS}=0.3 --set @nope.yaml", "a YAML file of parameters"),
        ("run --from nope:3", "found neither"),
        ("run --from nope", "expected STUDY:ROW"),
        ("run --from empty-folder:0", "found no study.yaml in it"),
    ],
)
def test_a_wrong_command_is_one_line(
    arguments: str,
    told: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "empty-folder").mkdir()
    (tmp_path / "file").touch()
    assert told in refused(capsys, *arguments.split())
    assert sorted(path.name for path in tmp_path.iterdir()) == ["empty-folder", "file"]


# --- one row again ----------------------------------------------------------------------------------

FLOOR = {
    "extends": "museum-1",
    "mission": "mine",
    "world": {"map": "my map.yaml"},
    "run": {"time_limit_s": 15},
}
SHEET = {
    "extends": "romi-explore",
    "mission": "mine",
    "world": {"map": "blatt.yaml"},
    "run": {"time_limit_s": 8},
}
TERRAIN: dict[str, Any] = {
    "extends": "gale-ekf",
    "mission": "mine",
    "run": {"time_limit_s": 20000},
    "world": {"map": {"columns": 4400}},
}
KINDS: dict[str, tuple[dict[str, Any], dict[str, Any]]] = {
    "floor": (
        FLOOR,
        {
            "configurations": [
                {"name": "as it is"},
                {"name": "no reflexes", "set": {"stack.reactive": None, "stack.escape": None}},
                {"name": "oracle", "set": {"run.oracles": ["localizer"]}},
            ],
            "factors": [
                {"key": "stack.localizer.gate", "random_range": {"low": 0.9, "high": 0.99, "count": 2}}
            ],
        },
    ),
    "sheet": (
        SHEET,
        {
            "seeds": {"first": 7, "pairing": "independent"},
            "factors": [
                {"name": "fusion", "levels": {"with": {}, "without": {"stack.navigator.fusion": False}}},
                {
                    "key": "world.markings.tape_width_m",
                    "log_range": {"start": 0.01, "stop": 0.02, "count": 2},
                },
            ],
        },
    ),
    "terrain": (
        TERRAIN,
        {
            "combine": "one-at-a-time",
            "factors": [
                {
                    "key": "robot.sensors.odometer.distance_var_m2_per_m",
                    "multiply": True,
                    "values": [0.1, 10],
                },
                {"key": "stack.localizer.gate", "values": [0.99]},
            ],
        },
    ),
}


def test_another_ground_is_set_with_its_own_keys(tmp_path: Path) -> None:
    """As ``run --set`` takes them."""
    (tmp_path / "obstacles.png").touch()
    changes = {
        "world.map.obstacles": str(tmp_path / "obstacles.png"),
        "world.map.resolution_m": 5.0,
        "world.map.name": "images",
    }
    study = make_study(
        StudyDefinition(study="x", mission="gale-astar", set=changes, factors=()),
    )
    assert len(study.cells) == 1
    with pytest.raises(InputError, match="columns"):  # that was the crater's
        make_study(StudyDefinition(study="x", mission="gale-astar", set={**changes, "world.map.columns": 9}))


def made(folder: Path, study: Study) -> Path:
    """A study's folder with its rows, run in this process."""
    store, runner = Store(folder, study), TrialRunner(study.base)
    for task in store.claim(study.rows):
        overrides = study.cells[task.cell].overrides
        store.finish(runner.run(type(task)(task.row, task.cell, task.seed, overrides)))
    store.close()
    _write(folder / STUDY_FILE, study_yaml(study))
    _write(folder / MISSION_FILE, mission_yaml(study))
    return folder


@pytest.fixture
def world(tmp_path: Path) -> Path:
    """A folder with a map and a sheet, its name with a space and an umlaut."""
    from pilotage.experiments.mission import SHIPPED

    place = tmp_path / "Räume, neu"
    place.mkdir()
    missions = Path(str(SHIPPED)).parent
    shutil.copyfile(missions / "maps" / "museum.yaml", place / "my map.yaml")
    shutil.copyfile(missions / "maps" / "treasure-hunt.yaml", place / "blatt.yaml")
    return place


@pytest.mark.parametrize("kind", sorted(KINDS))
def test_every_row_runs_again_bit_equal_anywhere(
    kind: str,
    world: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    """Also when the files of mission and study are gone: the folder holds all but the map."""
    mission, study = KINDS[kind]
    (world / "m.yaml").write_text(yaml.safe_dump(mission), encoding="utf-8")
    definition = {"study": kind, "mission": "m.yaml", "trials": 2, **study}
    (world / "s.yaml").write_text(yaml.safe_dump(definition, allow_unicode=True), encoding="utf-8")
    loaded = load_study(str(world / "s.yaml"))
    folder = made(tmp_path / "studies" / kind, loaded)
    (world / "m.yaml").unlink()
    (world / "s.yaml").unlink()
    rows, trouble = read_rows(folder / DATABASE)
    assert not trouble
    assert len({json.dumps(row["metrics"]) for row in rows}) >= 6
    assert load_study(str(folder)).cells == loaded.cells  # None among the overrides is kept as well
    for row in rows[:: 3 if kind == "sheet" else 2]:
        assert row["status"] == "done", row["reason"]
        elsewhere = tmp_path / f"elsewhere-{row['row']}"
        elsewhere.mkdir()
        monkeypatch.chdir(elsewhere)
        code = main(["run", "--from", f"{folder}:{row['row']}", "--json", "--no-report"])
        assert code == (0 if row["metrics"]["success"] else 1)
        again = json.loads(capsys.readouterr().out)
        again = {
            key: value for key, value in again.items() if key != "run_dir" and not METRICS.is_wall_clock(key)
        }
        assert again == row["metrics"]


def test_rows_of_a_map_that_changed_are_not_run_again(
    world: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """The map is named by the mission, and by one cell only."""
    changes: dict[str, dict[str, Any]] = {
        "mission": {"world": {"map": "my map.yaml"}},
        "cell": {},
    }
    cell = [{"name": "own", "set": {"world.map": "my map.yaml"}}, {"name": "shipped"}]
    for name, mission in changes.items():
        file = world / f"{name}.yaml"
        file.write_text(yaml.safe_dump({"extends": "museum-plan", "mission": name, **mission}))
        study = {"study": name, "mission": file.name, "trials": 1, "set": {"stack.planner.stop": "first"}}
        study |= {"configurations": cell} if name == "cell" else {}
        (world / f"s-{name}.yaml").write_text(yaml.safe_dump(study))
        made(tmp_path / "studies" / name, load_study(str(world / f"s-{name}.yaml")))
    monkeypatch.chdir(tmp_path)
    for name in changes:
        assert main(["run", "--from", f"{name}:0", "--json", "--no-report"]) in (0, 1)
    capsys.readouterr()
    with (world / "my map.yaml").open("a", encoding="utf-8") as file_:
        file_.write("\n# another\n")
    for name in changes:
        line = refused(capsys, "run", "--from", f"{name}:0", "--json")
        assert "expected the files that the study was made from" in line
        assert "my map.yaml" in line
        line = refused(capsys, "study", f"studies/{name}", "--resume", "--no-report")
        assert "another definition" in line
    (world / "my map.yaml").unlink()
    for name in changes:
        refused(capsys, "run", "--from", f"{name}:0", "--json")


def test_a_definition_edited_in_its_folder_is_refused_with_what_changed(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "s.yaml"
    file.write_text(f"{{study: s, mission: museum-plan, trials: 2, set: {{{RADIUS}: 0.5}}}}")
    folder = tmp_path / "s"
    study = load_study(str(file))
    Store(folder, study).close()
    _write(folder / MISSION_FILE, mission_yaml(study))
    _write(folder / STUDY_FILE, study_yaml(study).replace("0.5", "0.6"))
    assert "0.5 -> 0.6" in refused(capsys, "run", "--from", f"{folder}:0")
    assert "0.5 -> 0.6" in refused(capsys, "study", str(folder), "--resume")
    # What only the page says may change.
    _write(folder / STUDY_FILE, study_yaml(study).replace("metrics: []", "metrics: [smoothness]"))
    Store(folder, load_study(str(folder))).close()


def test_a_cell_of_a_file_is_named_as_the_study_names_it(world: Path) -> None:
    """Also from the study's folder, where the file is told by its absolute place."""
    definition = {
        "study": "maps",
        "mission": "museum-1",
        "trials": 1,
        "factors": [
            {"key": "world.map", "values": ["museum", "my map.yaml"]},
            {"key": "stack.localizer.gate", "values": [0.9, 0.99]},
        ],
        "baseline": "map=my map.yaml, gate=0.99",
        "published": [{"cell": {"map": "my map.yaml", "gate": 0.9}, "metrics": {}}],
    }
    (world / "s.yaml").write_text(yaml.safe_dump(definition), encoding="utf-8")
    study = load_study(str(world / "s.yaml"))
    assert study.definition.baseline in [cell.name for cell in study.cells]
    assert str(world / "my map.yaml") in str(study.definition.published[0].cell)
    (world / STUDY_FILE).write_text(study_yaml(study), encoding="utf-8")
    (world / MISSION_FILE).write_text(mission_yaml(study), encoding="utf-8")
    assert load_study(str(world)).definition.baseline == study.definition.baseline


def test_factors_are_called_by_what_tells_them_apart() -> None:
    """Two components by their names were refused as "'name' stands twice", which `sweep` cannot change."""
    vary = [
        "stack.localizer.name=ekf-landmarks,ukf-landmarks",
        "stack.planner.name=rrt-star-dubins",
        "world.goal.tolerance_m=0.3",
        "world.goal.x_m=2",
        "world.start.x_m=1",
    ]
    made = sweep_study("museum-1", vary, [], 1, [])
    assert made.cells[0].name == (
        "localizer=ekf-landmarks, planner=rrt-star-dubins, tolerance_m=0.3, goal_x_m=2, start_x_m=1"
    )
    assert made.cells[0].text == (
        "ekf-landmarks, rrt-star-dubins, tolerance 0.3\u00a0m, goal x 2\u00a0m, start x 1\u00a0m"
    )


def test_maps_of_ones_own_go_by_the_ends_of_their_paths(tmp_path: Path) -> None:
    """Cells, findings and figures called them by their whole absolute paths."""
    for name in ("a b/one.yaml", "c/one.yaml", "c/two.yaml"):
        file = tmp_path / name
        file.parent.mkdir(exist_ok=True)
        file.write_text("walls_m: [[0, 0, 9, 0], [9, 0, 9, 9], [9, 9, 0, 9], [0, 9, 0, 0]]\n")
    names = ["a b/one.yaml", "c/one.yaml", "museum"]
    values = {
        "study": "maps",
        "mission": "museum-1",
        "set": {"world.goal.y_m": 8, "world.obstacles": []},
        "factors": [{"key": "world.map", "values": names}],
        "baseline": "map=c/one.yaml",
        "published": [{"cell": {"map": "a b/one.yaml"}, "metrics": {"duration_s": 1}}],
    }
    made = make_study(StudyDefinition.model_validate(values), tmp_path)
    assert [cell.name for cell in made.cells] == [f"map={name}" for name in names]
    assert [cell.text for cell in made.cells] == names
    assert made.definition.baseline == "map=c/one.yaml"
    assert made.cells[0].published == {"duration_s": 1}
    # As its folder has it, and as folders had it that named cells by whole paths.
    again = yaml.safe_load(study_yaml(made)) | {"mission": "museum-1"}
    for baseline in ("map=c/one.yaml", f"map={tmp_path}/c/one.yaml"):
        read = make_study(StudyDefinition.model_validate(again | {"baseline": baseline}), Path("/"))
        assert (read.definition.baseline, read.digest) == ("map=c/one.yaml", made.digest)
    alone = [{"key": "world.map", "values": ["c/two.yaml"]}]
    more = {**values, "factors": alone, "baseline": None, "published": []}
    assert make_study(StudyDefinition.model_validate(more), tmp_path).cells[0].name == "map=two.yaml"
