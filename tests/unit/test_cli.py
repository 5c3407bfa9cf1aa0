"""The command line: exit codes, one-line errors, JSON purity, the nearest right name, Ctrl-C."""

from __future__ import annotations

import errno
import json
import math
import os
import signal
import sys
import types
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from pilotage import __version__
from pilotage.cli.app import COMMANDS
from pilotage.cli.main import main
from pilotage.core.errors import InputError
from pilotage.experiments.progress import Progress


@dataclass
class Lab:
    """Stands in for the rooms that the command line calls; remembers what it was asked."""

    metrics: dict[str, Any] = field(default_factory=lambda: {"mission": "museum-1", "nees_mean": math.nan})
    success: bool = True
    error: BaseException | None = None
    asked: dict[str, Any] = field(default_factory=dict)
    run_dir: Path = Path("runs/museum-1-0-abc")

    def load_mission(self, name: str, overrides: Sequence[str] = (), seed: int | None = None) -> str:
        self.asked |= {"name": name, "overrides": list(overrides), "seed": seed}
        return name

    def run_mission(
        self, mission: str, *, out: Path | None = None, on_progress: Callable[[Any], None] | None = None
    ) -> types.SimpleNamespace:
        self.asked |= {"mission": mission, "out": out, "shows_progress": on_progress is not None}
        sys.stdout.write("a library talks\n")
        if on_progress is not None:
            on_progress(Progress(0.1, (("to go", "66.0 m"),)))
        if self.error is not None:
            raise self.error
        return types.SimpleNamespace(metrics=self.metrics, success=self.success, run_dir=self.run_dir)

    def write_report(self, run_dir: Path, on_damage: object = None) -> Path:  # noqa: ARG002
        self.asked["reported"] = run_dir
        sys.stdout.write("a library talks\n")
        return run_dir / "report.html"

    def plan(self, *query: Any, **options: Any) -> SimpleNamespace:
        self.asked["query"] = (*query, options)
        answer = {
            "success": self.success,
            "planned_length_m": 24.5,
            "first_solution_s": math.nan,
            "path": [[1]],
        }
        return SimpleNamespace(answer=answer)


@pytest.fixture
def lab(monkeypatch: pytest.MonkeyPatch) -> Lab:
    """Put a stand-in behind the commands."""
    lab = Lab()

    def module(name: str, **functions: Any) -> None:
        stand_in = types.ModuleType(name)
        vars(stand_in).update(functions)
        monkeypatch.setitem(sys.modules, name, stand_in)

    module("pilotage.experiments.mission", load_mission=lab.load_mission)
    module("pilotage.experiments.run", run_mission=lab.run_mission)
    module("pilotage.face.planning", plan=lab.plan)
    module(
        "pilotage.experiments.catalogue",
        missions=lambda: [("museum-1", "the night watch"), ("museum-hall", "a corridor")],
        components=lambda name: [("gate", "float", "0.99")] if name else [("planner", "a-star", "a grid")],
        roles=lambda: ["planner"],
        mission_schema=lambda: {"title": "Mission"},
    )
    module("pilotage.report", write_report=lab.write_report, summary_table=lambda metrics: str(metrics))
    return lab


@dataclass
class Answer:
    code: int
    out: str
    err: str


@pytest.fixture
def pilotage(capsys: pytest.CaptureFixture[str]) -> Callable[..., Answer]:
    """Call the command line in this process."""

    def call(*words: str) -> Answer:
        code = main(words)
        return Answer(code, *capsys.readouterr())

    return call


Call = Callable[..., Answer]

DOCS = Path(__file__).parents[2] / "docs"


# run


def test_a_run_prints_its_summary_and_names_its_report(lab: Lab, pilotage: Call) -> None:
    answer = pilotage("run", "museum-1")
    assert answer.code == 0
    assert "museum-1" in answer.out
    assert answer.out.splitlines()[-1] == "report: runs/museum-1-0-abc/report.html"
    assert lab.asked["seed"] is None
    assert lab.asked["out"] == Path("runs")


def test_a_run_passes_on_what_it_was_told(lab: Lab, pilotage: Call) -> None:
    words = ["--seed", "7", "--set", "a.b=1", "--set", "c=2", "--out", "else where"]
    assert pilotage("run", "x.yaml", *words).code == 0
    assert lab.asked["name"] == lab.asked["mission"] == "x.yaml"
    assert lab.asked["overrides"] == ["a.b=1", "c=2"]
    assert lab.asked["seed"] == 7
    assert lab.asked["out"] == Path("else where")


@pytest.mark.usefixtures("lab")
def test_json_is_one_object_alone_on_standard_output(pilotage: Call) -> None:
    answer = pilotage("run", "museum-1", "--json")
    assert answer.code == 0
    assert json.loads(answer.out) == {"mission": "museum-1", "nees_mean": None}
    assert answer.out.count("\n") == 1
    assert "a library talks" in answer.err


@pytest.mark.parametrize("options", [(), ("--json",), ("--quiet",)])
def test_a_failure_in_the_field_is_exit_code_1(lab: Lab, pilotage: Call, options: tuple[str, ...]) -> None:
    lab.success = False
    assert pilotage("run", "museum-1", *options).code == 1


def test_without_a_report_the_run_folder_is_named(lab: Lab, pilotage: Call) -> None:
    answer = pilotage("run", "museum-1", "--no-report")
    assert answer.out.splitlines()[-1] == "run: runs/museum-1-0-abc"
    assert "reported" not in lab.asked


def test_quiet_shows_no_summary_and_no_progress(lab: Lab, pilotage: Call) -> None:
    answer = pilotage("run", "museum-1", "--quiet")
    assert answer.out.replace("a library talks\n", "") == ""
    assert not lab.asked["shows_progress"]


# What goes wrong


@pytest.mark.parametrize("options", [(), ("--json",)])
@pytest.mark.parametrize(
    ("error", "code", "line"),
    [
        (InputError("unknown mission 'x';\n did you mean 'y'?"), 2, "unknown mission 'x'; did you mean 'y'?"),
        (PermissionError(errno.EACCES, "Permission denied", "runs/a"), 2, "runs/a: Permission denied"),
        (OSError(errno.ENOSPC, "No space left on device"), 2, "No space left on device"),
        (OSError("odd"), 2, "odd"),
        (KeyboardInterrupt(), 130, "interrupted"),
    ],
)
def test_what_the_user_can_mend_is_one_line(
    lab: Lab, pilotage: Call, error: BaseException, code: int, line: str, options: tuple[str, ...]
) -> None:
    lab.error = error
    answer = pilotage("run", "museum-1", *options)
    assert answer.code == code
    assert answer.err.replace("a library talks\n", "") == f"pilotage: {line}\n"
    assert answer.out.replace("a library talks\n", "") == ""


def test_a_bug_keeps_its_traceback_and_is_no_failure_in_the_field(lab: Lab, pilotage: Call) -> None:
    lab.error = ZeroDivisionError("float division by zero")
    answer = pilotage("run", "museum-1", "--json")
    assert answer.code == 70
    assert "Traceback" in answer.err
    assert "bug in pilotage" in answer.err.splitlines()[-1]
    assert answer.out == ""


@pytest.mark.usefixtures("lab")
@pytest.mark.parametrize(
    ("words", "told"),
    [
        (["rum", "museum-1"], ["'rum'", "'run'"]),
        (["zzz"], ["'zzz'", "pilotage --help"]),
        (["run"], ["missing", "MISSION", "pilotage run --help"]),
        (["run", "museum-1", "--sed", "3"], ["--sed", "--seed"]),
        (["--versoin"], ["--versoin", "--version"]),
        (["run", "museum-1", "--seed", "three"], ["--seed", "whole number", "'three'"]),
        (["run", "museum-1", "--seed", "-1"], ["--seed", ">= 0", "'-1'"]),
        (["run", "museum-1", "--seed", "1.5"], ["--seed", "'1.5'"]),
        (["run", "museum-1", "--seed"], ["--seed"]),
        (["run", "museum-1", "museum-2"], ["museum-2"]),
        (["plan", "museum", "--start", "1,1"], ["missing", "--goal"]),
        (["plan", "museum", "--start", "1;1", "--goal", "2,2"], ["--start", "X,Y", "'1;1'"]),
        (["plan", "museum", "--start", "1,1", "--goal", "nan,2"], ["--goal", "X,Y", "'nan,2'"]),
    ],
)
def test_wrong_usage_is_one_line_that_names_the_right_one(
    pilotage: Call, words: list[str], told: list[str]
) -> None:
    answer = pilotage(*words)
    assert answer.code == 2
    assert answer.out == ""
    assert answer.err.startswith("pilotage: ")
    assert answer.err.count("\n") == 1
    for part in told:
        assert part in answer.err


# The other commands


def test_plan_hands_its_query_on(lab: Lab, pilotage: Call) -> None:
    place = ("--start", "1,1,0", "--goal", "-2,2.5", "--clearance", "0.5")
    answer = pilotage("plan", "museum", *place, "--set", "a=1", "--json")
    assert answer.code == 0
    assert json.loads(answer.out)["first_solution_s"] is None
    name, start, goal, options = lab.asked["query"]
    assert (name, start, goal) == ("museum", (1.0, 1.0, 0.0), (-2.0, 2.5))
    asked = {"planner": None, "slope_limit_deg": None, "seed": 0, "set": ["a=1"]}
    assert options == asked | {"clearance_m": 0.5, "footprint": None}


def test_plan_without_a_path_is_exit_code_1(lab: Lab, pilotage: Call) -> None:
    lab.success = False
    answer = pilotage("plan", "museum", "--start", "1,1", "--goal", "2,2")
    assert answer.code == 1
    assert "planned_length_m  24.5" in answer.out
    assert "first_solution_s  -" in answer.out


@pytest.mark.usefixtures("lab")
def test_the_lists_are_printed(pilotage: Call) -> None:
    assert pilotage("missions").out == "museum-1     the night watch\nmuseum-hall  a corridor\n"
    assert json.loads(pilotage("missions", "--json").out)["museum-hall"] == "a corridor"
    assert pilotage("components").out == "planner  a-star  a grid\n"
    assert pilotage("components", "ekf").out == "gate  float  0.99\n"
    assert json.loads(pilotage("schema").out) == {"title": "Mission"}


def test_report_writes_a_page_and_names_it(lab: Lab, pilotage: Call) -> None:
    answer = pilotage("report", "runs/x")
    assert answer.out.splitlines()[-1] == "runs/x/report.html"
    assert lab.asked["reported"] == Path("runs/x")


def test_version_and_help(pilotage: Call) -> None:
    assert pilotage("--version") == Answer(0, f"pilotage {__version__}\n", "")
    bare, asked = pilotage(), pilotage("--help")
    assert bare == asked
    assert asked.code == 0
    assert "Exit codes" in asked.out


@pytest.mark.parametrize("command", [function.__name__.replace("_", "-") for function in COMMANDS])
def test_every_command_has_help_and_stands_in_the_docs(pilotage: Call, command: str) -> None:
    assert f"`{command}" in (DOCS / "command-line.md").read_text()
    answer = pilotage(command, "--help")
    assert answer.code == 0
    assert f"pilotage {command}" in answer.out


# A whole run, nothing standing in


def test_a_run_that_fails_in_the_field_leaves_its_evidence(pilotage: Call, tmp_path: Path) -> None:
    words = ["--set", "run.time_limit_s=1", "--seed", "5", "--json", "--out", str(tmp_path / "new" / "runs")]
    answer = pilotage("run", "museum-1", *words)
    assert answer.code == 1
    told = json.loads(answer.out)
    assert told["success"] is False
    assert "time limit" in told["reason"]
    explained = (DOCS / "run-folder.md").read_text()
    assert [key for key in told if f"`{key}`" not in explained] == []
    run_dir = Path(told["run_dir"])
    assert [run_dir] == list((tmp_path / "new" / "runs").iterdir())
    assert json.loads((run_dir / "metrics.json").read_text()) == told
    assert (run_dir / "report.html").stat().st_size > 0
    again = pilotage("run", str(run_dir / "mission.yaml"), "--json", "--no-report", "--out", str(tmp_path))
    clocks = {"run_dir", "wall_time_s", "steps_per_s", "planning_time_s", "first_solution_s"}
    repeated = json.loads(again.out)
    assert {key: repeated[key] for key in told.keys() - clocks} == {
        key: told[key] for key in told.keys() - clocks
    }


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (["museum1"], "did you mean 'museum-1'?"),
        (["museum"], "did you mean 'museum-1'?"),
        (["museum-1", "--set", "stack.planner.name=rrt"], "did you mean 'rrt-star-dubins'?"),
        (["nothing.yaml"], "'nothing.yaml': expected a YAML file"),
        (["museum-1", "--set", "stack.localiser.gate=0.9"], "did you mean 'localizer'?"),
        (["museum-1", "--set", "stack.localizer.gat=0.9"], "did you mean 'gate'?"),
        (["museum-1", "--set", "stack.localizer.name=ekf-landmark"], "did you mean 'ekf-landmarks'?"),
        (["museum-1", "--set", "robot.footprint.radius_m=30 cm"], "found '30 cm'"),
        (["museum-1", "--set", "stack.initial.x_var_m2=nan"], "finite number, found nan"),
        (["museum-1", "--set", "robot.sensors.odometry.distance_var_m2_per_m=-1"], "found -1"),
        (["museum-1", "--set", "world.start.x_m=0"], "world.start: expected"),
        (["museum-1", "--set", "world.goal.x_m=100"], "world.goal: expected"),
        (["museum-1", "--set", "world.map=museun"], "did you mean 'museum'?"),
        (["museum-1", "--set", "gate"], "expected KEY=VALUE"),
    ],
)
def test_bad_input_is_one_line_and_writes_nothing(
    pilotage: Call, tmp_path: Path, words: list[str], told: str
) -> None:
    answer = pilotage("run", *words, "--out", str(tmp_path / "runs"))
    assert (answer.code, answer.out) == (2, "")
    assert answer.err.startswith("pilotage: ")
    assert answer.err.count("\n") == 1
    assert told in answer.err
    assert list(tmp_path.iterdir()) == []


def test_where_nothing_can_be_written_no_run_begins(
    lab: Lab, pilotage: Call, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    file = tmp_path / "file"
    file.touch()
    for out in (file, file / "below"):
        answer = pilotage("run", "museum-1", "--out", str(out))
        assert (answer.code, answer.out) == (2, "")
        assert answer.err == f"pilotage: --out: expected a folder, found a file: '{file}'\n"
    # Root may write anywhere, so the refusal is pretended.
    monkeypatch.setattr(os, "access", lambda *_: False)
    for words in ((), ("--out", "a/b")):
        answer = pilotage("run", "museum-1", *words)
        assert (answer.code, answer.out) == (2, "")
        assert answer.err.count("\n") == 1
        assert "read-only" in answer.err
    assert lab.asked == {}


@pytest.mark.parametrize(("number", "code", "told"), [(2, 130, "interrupted"), (15, 143, "ended by SIGTERM")])
def test_a_run_interrupted_while_it_writes_leaves_nothing(
    pilotage: Call, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, number: int, code: int, told: str
) -> None:
    def interrupt(*_: object, **__: object) -> None:
        signal.raise_signal(number)

    monkeypatch.setattr(np, "savez_compressed", interrupt)
    before = signal.getsignal(signal.SIGTERM)
    answer = pilotage("run", "museum-1", "--set", "run.time_limit_s=1", "--json", "--out", str(tmp_path))
    assert answer == Answer(code, "", f"pilotage: {told}\n")
    assert list(tmp_path.iterdir()) == []
    assert signal.getsignal(signal.SIGTERM) == before
