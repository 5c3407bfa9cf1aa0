"""Installed packages of plugins: named by what needs them, told and left out where they fail."""

from __future__ import annotations

import json
from pathlib import Path as FilePath

import yaml

from pilotage.core import plugins
from support.warm_commands import pilotage

PLANNER = """
from pilotage.core.config import Config
from pilotage.evaluation.metric import Metric
from pilotage.evaluation.metrics import METRICS
from pilotage.stack.planning.plan_status import PlanStatus
from pilotage.stack.planning.planner import PLANNERS, Path, PlanResult
class Mine(Config):
    "Nothing."
@PLANNERS.add("somebodys", Mine)
class MyPlanner:
    "Straight on."
    clearance_m = 0.3
    def __init__(self, config):
        pass
    def plan(self, request):
        start, goal = request.start, request.goal
        return PlanResult(PlanStatus.FOUND, "", Path.through([(start.x_m, start.y_m), (goal.x_m, goal.y_m)]))
METRICS.computed_by(Metric("somebodys_m", "mine", "m", "What I think of it."))(lambda trace, metrics: 1.0)
"""


def install(folder: FilePath, package: str, module: str, text: str) -> None:
    """As an installer leaves it: a module, and beside it who brought it with which entry points."""
    about = folder / f"{package}-1.0.dist-info"
    about.mkdir(parents=True)
    (about / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {package}\nVersion: 1.0\n")
    (about / "entry_points.txt").write_text(f"[{plugins.GROUP}]\n{package}-entry = {module}\n")
    (folder / f"{module}.py").write_text(text)


def test_an_installed_package_is_named_by_what_needs_it(tmp_path: FilePath) -> None:
    """A run's mission named no package: without it, it was an unknown planner. Metrics were shown nowhere."""
    site, none = tmp_path / "site", tmp_path / "none"
    install(site, "some-lab", "some_lab", PLANNER)
    none.mkdir()
    shown = pilotage("components", "--json", folder=tmp_path, site=site)
    rows = [tuple(row) for row in json.loads(shown.stdout)["components"]]
    assert ("planner", "somebodys", "Straight on.") in rows
    assert ("metric", "somebodys_m", "What I think of it.") in rows
    words = ("--set", "stack.planner.name=somebodys", "--set", "stack.smoother.name=none", "--json")
    mission = ("museum-plan", "--set", "world.goal={x_m: 1.0, y_m: 3.0}", "--out", "runs")
    done = pilotage("run", *mission, *words, "--no-report", folder=tmp_path, site=site)
    assert done.returncode == 0, done.stderr
    answer = json.loads(done.stdout)
    assert answer["somebodys_m"] == 1.0
    resolved = f"{answer['run_dir']}/mission.yaml"
    assert yaml.safe_load((tmp_path / resolved).read_text())["plugins"] == ["some-lab"]
    again = pilotage("run", resolved, "--json", "--no-report", folder=tmp_path, site=site)
    assert json.loads(again.stdout)["planned_length_m"] == answer["planned_length_m"]
    without = pilotage("run", resolved, "--json", folder=tmp_path, site=none)
    assert (without.returncode, without.stdout) == (2, "")
    assert without.stderr == (
        "pilotage: plugins: expected a Python file or an installed package with plugins, found 'some-lab'; "
        "install it, or take it off the list\n"
    )


FAILING = {
    "x = 1 / 0\n": "ZeroDivisionError: division by zero",
    "raise SystemExit(3)\n": "SystemExit: 3",
    PLANNER: "planner 'somebodys': expected a new name, found it registered already by plugin ",
    PLANNER.replace("somebodys", "other").replace("def plan", "def go"): "a method 'plan', found none",
}
"""What is installed, and what is told of it."""


def test_installed_packages_that_fail_are_told_and_left_out(tmp_path: FilePath) -> None:
    """Every run ended with exit code 2 for one, or with 3 and no word where it called ``sys.exit``."""
    for letter, text in zip("abcde", [PLANNER, *FAILING], strict=True):
        install(tmp_path / "site", f"{letter}-lab", f"{letter}_lab", text)
    shown = pilotage("components", "--json", folder=tmp_path, site=tmp_path / "site")
    assert shown.returncode == 0, shown.stderr
    found = json.loads(shown.stdout)["components"]
    assert ["planner", "somebodys", "Straight on."] in found
    assert all(name != "other" for _, name, _ in found)
    lines = shown.stderr.splitlines()
    assert len(lines) == len(FAILING)
    assert all(line.startswith("pilotage: plugin '") and "-lab' (" in line for line in lines)
    for told in FAILING.values():
        assert sum(told in line for line in lines) == 1


def test_a_studys_folder_names_its_plugins(tmp_path: FilePath) -> None:
    """Given by a flag they stood nowhere: report and resume called the folder's mission unknown."""
    site = tmp_path / "a place with spaces"
    site.mkdir()
    (site / "mine.py").write_text(PLANNER)
    mission = {
        "extends": "museum-plan",
        "world": {"goal": {"x_m": 1.0, "y_m": 3.0}},
        "stack": {"planner": {"name": "somebodys"}, "smoother": {"name": "none"}},
    }
    (tmp_path / "m.yaml").write_text(yaml.safe_dump(mission))
    asked = ("--trials", "2", "--workers", "1", "--metrics", "success,somebodys_m", "--no-report", "--quiet")
    words = ("sweep", "m.yaml", *asked, "--plugin", f"{site.name}/mine.py", "--name", "mine")
    done = pilotage(*words, folder=tmp_path, site=tmp_path)
    assert done.returncode == 0, done.stderr
    kept = yaml.safe_load((tmp_path / "studies/mine/mission.yaml").read_text())
    assert kept["plugins"] == [str(site / "mine.py")]
    resumed = ("study", "studies/mine", "--resume", "--quiet", "--no-report")
    for again in (("report", "studies/mine"), resumed):
        done = pilotage(*again, folder=tmp_path, site=tmp_path)
        assert done.returncode == 0, done.stderr
