"""Components from files outside the package: a whole mission made of them, and plugins that are refused."""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Any

import pytest
import yaml

from pilotage.cli.main import main
from pilotage.core import plugins
from pilotage.core.errors import InputError
from support.missions import reach
from support.warm_commands import pilotage

FOLDER = Path(__file__).parents[1] / "support" / "plugins"
FILES = sorted(str(path) for path in FOLDER.glob("*.py"))
REGISTERED = {
    ("sensor", "position-fix"),
    ("motion", "tricycle"),
    ("planner", "straight-line"),
    ("localizer", "last-fix"),
    ("task", "stroll"),
}


def mission() -> dict[str, Any]:
    """Half the room at a stroll, on nothing but what the plugins bring."""
    values = reach(mission="a-stroll")
    values["world"]["goal"] = {"x_m": 2.0, "y_m": 6.5}
    values["robot"]["motion"] = {"name": "tricycle", "wheelbase_m": 0.5}
    values["robot"]["sensors"]["fix"] = {"name": "position-fix", "position_std_m": 0.01}
    values["stack"] |= {"localizer": {"name": "last-fix"}, "planner": {"name": "straight-line"}}
    values["task"] = {"name": "stroll", "distance_m": 1.5}
    return values


def named(files: list[str]) -> list[str]:
    return [word for file in files for word in ("--plugin", file)]


def test_a_mission_of_plugins_alone(tmp_path: Path) -> None:
    (tmp_path / "stroll.yaml").write_text(yaml.safe_dump(mission()))
    done = pilotage("run", "stroll.yaml", *named(FILES), "--json", "--out", "runs", folder=tmp_path)
    assert done.returncode == 0, done.stderr
    answer = json.loads(done.stdout)
    assert (answer["success"], answer["reason"]) == (True, "strolled")
    assert answer["path_length_m"] >= 1.5
    assert answer["position_rmse_m"] < 0.03
    assert answer["wobble_rad"] > 0.0
    # It runs again from its folder alone: the resolved mission names the plugins.
    resolved = f"{answer['run_dir']}/mission.yaml"
    again = pilotage("run", resolved, "--json", "--no-report", folder=tmp_path)
    assert again.returncode == 0, again.stderr
    assert json.loads(again.stdout)["wobble_rad"] == answer["wobble_rad"]
    # Without them it is refused in one line, with the nearest right name.
    refused = pilotage("run", "stroll.yaml", "--json", folder=tmp_path)
    assert refused.returncode == 2
    assert refused.stdout == ""
    assert refused.stderr.count("\n") == 1
    assert "unknown task 'stroll'" in refused.stderr


def test_they_are_shown_with_the_others(tmp_path: Path) -> None:
    """What one of them says as it is read stays off standard output."""
    file = tmp_path / "mine.py"
    file.write_text("print('good morning')\n")
    shown = pilotage("components", *named([*FILES, str(file)]), "--json", folder=tmp_path)
    assert shown.returncode == 0, shown.stderr
    assert "good morning" in shown.stderr
    rows = json.loads(shown.stdout)["components"]
    assert {(role, name) for role, name, _ in rows} >= REGISTERED | {("planner", "astar")}
    assert all(text for _, _, text in rows)


@pytest.fixture
def alone(monkeypatch: pytest.MonkeyPatch) -> None:
    """What a refused plugin leaves in this process is taken back."""
    monkeypatch.delenv(plugins.VARIABLE, raising=False)
    monkeypatch.setattr(plugins, "_loaded", dict(plugins._loaded))


TAKEN = """
from pilotage.core.config import Config
from pilotage.stack.planning.planner import PLANNERS
class Mine(Config):
    "Nothing."
@PLANNERS.add("astar", Mine)
class Astar:
    "Mine."
"""
REGISTERS = """
from pilotage.core.config import Config
from pilotage.stack.planning.planner import PLANNERS
class Mine(Config):
    "Nothing."
class Planner:
    "Mine."
    def plan(self, request):
        "Nothing."
PLANNERS.add({name}, {config})({what})
"""
NAMED = REGISTERS.format(name="'mine'", config="Mine", what="Planner").replace(
    '"Nothing."', "name: str = 'x'", 1
)
PARAMETERS = """
from __future__ import annotations
import numpy as np
from pydantic import Field
from pilotage.core.config import Config
from pilotage.stack.planning.planner import PLANNERS
class Mine(Config):
    {parameter}
@PLANNERS.add("mine", Mine)
class Planner:
    "Mine."
    clearance_m = 0.3
    def plan(self, request):
        "Nothing."
"""
MUTE = "class Mute(Exception):\n    def __str__(self):\n        return 1 / 0\n"
TAKEN_METRIC = """
from pilotage.evaluation.metric import Metric
from pilotage.evaluation.metrics import METRICS
METRICS.add(Metric("duration_s", "mine", "s", ""))
"""


@pytest.mark.usefixtures("alone")
@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("import no_such_module_anywhere\n", "line 1: ModuleNotFoundError"),
        ("x = 1\n\ny = x / 0\n", "line 3: ZeroDivisionError: division by zero"),
        ("def broken(:\n    pass\n", "line 1: SyntaxError"),
        ("raise SystemExit(3)\n", "line 1: SystemExit: 3"),
        (MUTE + "raise Mute()\n", "line 4: Mute: without a text that can be shown"),
        ("raise GeneratorExit\n", "line 1: GeneratorExit"),
        ("class Odd(BaseException):\n    pass\nraise Odd('no')\n", "line 3: Odd: no"),
        (REGISTERS.format(name="'mine'", config="Mine", what="3"), "'mine': expected a class, found int 3"),
        (REGISTERS.format(name="'mine'", config="Mine", what="len"), "'mine': expected a class, found"),
        (REGISTERS.format(name="'mine'", config="int", what="Planner"), "derives from Config, found int"),
        (REGISTERS.format(name="'mine'", config="{}", what="Planner"), "derives from Config, found dict {}"),
        (REGISTERS.format(name="''", config="Mine", what="Planner"), "expected a name, a text that is not"),
        (REGISTERS.format(name="3", config="Mine", what="Planner"), "expected a name, a text that is not"),
        (REGISTERS.format(name="' mine'", config="Mine", what="Planner"), "a name without spaces around it"),
        (
            REGISTERS.format(name="'mi\\nne'", config="Mine", what="Planner"),
            "'mi\\nne': expected a name without",
        ),
        (
            NAMED.format(name="'mine'", config="Mine", what="Planner"),
            "planner 'mine': expected parameters of any other name, found 'name'",
        ),
        (
            PARAMETERS.format(parameter="weights: np.ndarray = None"),
            "planner 'mine': expected parameters that a file can hold (numbers, texts, true or false, lists, "
            "mappings, other configs), found 'weights', which is of ndarray",
        ),
        (
            PARAMETERS.format(parameter="decay: float = Field(0.5, alias='lambda')"),
            "expected parameters named in files as in the class, found 'decay' with the alias 'lambda'",
        ),
        (
            PARAMETERS.format(parameter="gain: float = float('inf')"),
            "expected defaults that it takes itself: gain: input should be a finite number, found inf",
        ),
        (
            TAKEN.replace("def plan", "def plot").replace("astar", "mine"),
            "expected a class with a method 'plan'",
        ),
        (TAKEN, "planner 'astar': expected a new name, found it registered already"),
        (TAKEN_METRIC, "metric 'duration_s': expected a new key, found it declared already"),
        (None, "expected a Python file, found none there"),
        ("raise MemoryError", "line 1: MemoryError\n"),
    ],
)
def test_a_plugin_that_cannot_be_used_is_one_line(
    text: str | None, told: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "mine.py"
    if text is not None:
        file.write_text(text)
    for _ in range(2):  # it stays refused
        assert main(["components", "--plugin", str(file)]) == 2
        answer = capsys.readouterr()
        assert answer.out == ""
        assert answer.err.count("\n") == 1
        assert told in answer.err
        assert answer.err.count(f"plugin '{file}'") == 1
    assert str(file) not in plugins.named_plugins()
    assert set(tmp_path.iterdir()) <= {file}


@pytest.mark.usefixtures("alone")
def test_a_plugin_leaves_no_compiled_copy_beside_it(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "dont_write_bytecode", False)
    (tmp_path / "mine.py").write_text("x = 1\n")
    plugins.load_file(str(tmp_path / "mine.py"))
    assert [path.name for path in tmp_path.iterdir()] == ["mine.py"]


@pytest.mark.usefixtures("alone")
def test_a_plugin_that_looks_for_its_neighbour_is_told_how(tmp_path: Path) -> None:
    """ "No module named 'helper'", which lay beside it."""
    (tmp_path / "helper.py").write_text("x = 1\n")
    (tmp_path / "parts").mkdir()
    for name, said in (("helper", True), ("parts.one", True), ("nowhere", False)):
        (tmp_path / "mine.py").write_text(f"import {name}\n")
        with pytest.raises(InputError, match="line 1: ModuleNotFoundError") as refused:
            plugins.load_file(str(tmp_path / "mine.py"))
        assert ("lies beside it, but a plugin's folder is not looked in" in str(refused.value)) is said


@pytest.mark.usefixtures("alone")
def test_one_file_by_several_paths_is_one_plugin(tmp_path: Path) -> None:
    """An attribution of a mission that named it by ``..`` called its names registered already."""
    (tmp_path / "deep").mkdir()
    (tmp_path / "mine.py").write_text("x = 1\n")
    (tmp_path / "link.py").symlink_to("mine.py")
    paths = [str(tmp_path / path) for path in ("mine.py", "deep/../mine.py", "link.py")]
    plugins.add_plugins(paths)
    assert plugins.named_plugins() == paths[:1]
    assert [path for path in plugins._loaded if path.startswith(str(tmp_path))] == paths[:1]


@pytest.mark.usefixtures("alone")
def test_a_plugins_folder_may_be_called_anything(tmp_path: Path) -> None:
    """A colon parted its path in two, of which neither was a file."""
    folder = tmp_path / "mine: a b"
    folder.mkdir()
    (folder / "mine.py").write_text("x = 1\n")
    plugins.add_plugins([str(folder / "mine.py")])
    assert plugins.named_plugins() == [str(folder / "mine.py")]
    plugins.load_plugins()


BUGGY = """
from pilotage.core.config import Config
from pilotage.stack.planning.planner import PLANNERS
class Mine(Config):
    "Nothing."
@PLANNERS.add("buggy", Mine)
class Buggy:
    "Mine."
    def __init__(self, config):
        self.clearance_m = 0.5
    def plan(self, request):
        return half(request.start.x_m)
def half(x):
    return x / 0
"""


def test_a_plugin_that_fails_is_told_as_the_plugins(tmp_path: Path) -> None:
    """Its own lines are shown, ours are not; nothing is left behind."""
    file = tmp_path / "mine.py"
    file.write_text(BUGGY)
    words = ("--plugin", str(file), "--set", "stack.planner.name=buggy", "--json", "--out", "runs")
    done = pilotage("run", "museum-1", *words, folder=tmp_path)
    assert (done.returncode, done.stdout) == (2, "")
    lines = done.stderr.splitlines()
    assert lines[0] == "Traceback of the plugin (most recent call last):"
    assert [line.split()[-1] for line in lines if line.startswith("  File")] == ["plan", "half"]
    assert all("pilotage/" not in line for line in lines[:-1])
    assert lines[-1] == f"pilotage: plugin '{file}' line 14: ZeroDivisionError: float division by zero"
    assert not (tmp_path / "runs").exists()


BAD_LOCALIZER = """
import sys
import numpy as np
from pilotage.core.config import Config
from pilotage.core.types import Pose2
from pilotage.stack.interface import Belief
from pilotage.stack.localization.localizer import LOCALIZERS
print("good morning")
class Mine(Config):
    "Nothing."
@LOCALIZERS.add("mine", Mine)
class MyLocalizer:
    def __init__(self, config, robot, chart, initial, journal):
        self.belief = initial
    def step(self, readings):
        return {gives}
"""
BAD_CONTROLLER = """
from pilotage.core.config import Config
from pilotage.stack.control.controller import CONTROLLERS
class Mine(Config):
    "Nothing."
@CONTROLLERS.add("mine", Mine)
class MyController:
    def __init__(self, config, robot):
        pass
    def reset(self):
        pass
    def step(self, pose, reference, feedforward):
        return feedforward
"""


SPEAKS = BAD_LOCALIZER.replace("self.belief = initial", "self.belief = initial; journal.{says}").replace(
    "{gives}", "self.belief"
)
THROUGH = SPEAKS.replace("journal.{says}", "Path.through([(1.0, 1.0)])").replace(
    "import sys", "from pilotage.stack.planning.planner import Path"
)


@pytest.mark.usefixtures("alone")
@pytest.mark.parametrize(
    ("role", "text", "told"),
    [
        (
            "localizer",
            BAD_LOCALIZER.format(gives="Belief(Pose2(1.0, 1.0, 0.0), np.full((3, 3), np.nan))"),
            "expected a Belief of finite pose and positive covariance (3, 3), found Belief with cov nan",
        ),
        ("localizer", BAD_LOCALIZER.format(gives="sys.exit(0)"), "line 16: SystemExit: 0"),
        ("localizer", BAD_LOCALIZER.format(gives="(_ for _ in ()).throw(GeneratorExit)"), ": GeneratorExit"),
        ("localizer", BAD_LOCALIZER.format(gives="(_ for _ in ()).throw(KeyboardInterrupt)"), ": Key"),
        (
            "localizer",
            BAD_LOCALIZER.format(gives="readings.by_sensor.clear()"),
            "line 16: AttributeError: 'mappi",
        ),
        ("localizer", BAD_LOCALIZER.format(gives="open('/none/x')"), "line 16: FileNotFoundError: "),
        ("controller", BAD_CONTROLLER, ": step: expected a Control of finite numbers, found Twist("),
        (
            "localizer",
            SPEAKS.format(says="say(float('nan'), 'here', 'no')"),
            "ValueError: event: expected a fi",
        ),
        ("localizer", SPEAKS.format(says="say(1.0, 'here', None)"), "found 1.0, 'here', None"),
        ("localizer", SPEAKS.format(says="channel({3: 'm'})"), "found 3: 'm'"),
        ("localizer", SPEAKS.format(says="channel({'t_s': 's'})"), "found 't_s', which it has already"),
        ("localizer", THROUGH, "path: expected two corners or more that lie apart, found 1 (plugin '"),
    ],
)
def test_a_plugin_that_gives_something_else_is_named(
    role: str, text: str, told: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """They ended in a traceback as bugs of ours, in nothing at all, or drove about until the time limit."""
    file = tmp_path / "mine.py"
    file.write_text(text)
    words = (
        "--plugin",
        str(file),
        "--set",
        f"stack.{role}.name=mine",
        "--json",
        "--out",
        str(tmp_path / "runs"),
    )
    assert main(["run", "museum-hall", *words]) == 2
    answer = capsys.readouterr()
    assert answer.out == ""
    last = answer.err.splitlines()[-1]
    assert told in last
    assert "'mine'" in last or str(file) in last or "'t_s'" in last
    assert not (tmp_path / "runs").exists()
