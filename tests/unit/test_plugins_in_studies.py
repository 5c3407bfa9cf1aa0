"""Studies and pools of components that print, end the process or raise: whose fault it is is said."""

from __future__ import annotations

import csv
import json
import shutil
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest
import yaml

from pilotage.core import plugins
from pilotage.core.errors import InputError
from pilotage.core.plugins import PluginError
from pilotage.experiments.run_pool import blamed
from pilotage.experiments.studies.study import differences, load_study
from support.warm_commands import pilotage

ODD = """
import sys
from pilotage.core.config import Config
from pilotage.stack.planning.plan_status import PlanStatus
from pilotage.stack.planning.planner import PLANNERS, PlanResult
class Mine(Config):
    "What it does."
    how: str = "print"
@PLANNERS.add("odd", Mine)
class Odd:
    "Finds nothing."
    clearance_m = 0.5
    def __init__(self, config):
        self.how = config.how
    def plan(self, request):
        if self.how == "exit":
            sys.exit(3)
        if self.how == "raise":
            raise ValueError("no, thank you")
        print("good morning")
        return PlanResult(PlanStatus.NO_PATH, "none", None)
"""


@dataclass(frozen=True)
class Swept:
    """A folder with a study of a plugin's planner, and what its command said."""

    folder: Path
    said: subprocess.CompletedProcess[str]


@pytest.fixture(scope="module")
def swept(tmp_path_factory: pytest.TempPathFactory) -> Swept:
    tmp_path = tmp_path_factory.mktemp("swept")
    (tmp_path / "odd.py").write_text(ODD)
    stack = {"planner": "odd", "smoother": "none"}
    mission = {"extends": "museum-plan", "plugins": ["odd.py"], "stack": stack}
    (tmp_path / "m.yaml").write_text(yaml.safe_dump(mission))
    asked = ("--vary", "stack.planner.how=print,exit,raise", "--trials", "1", "--workers", "1", "--no-report")
    done = pilotage("sweep", "m.yaml", *asked, "--json", "--quiet", "--name", "odd", folder=tmp_path)
    return Swept(tmp_path, done)


def test_trials_of_odd_plugins(swept: Swept) -> None:
    """Words of a worker's stood before the JSON object; that it ended itself was a worker that died."""
    tmp_path, done = swept.folder, swept.said
    assert json.loads(done.stdout)["failed"] == 2
    assert "good morning" in done.stderr
    assert "Traceback" not in done.stderr
    with (tmp_path / "studies/odd/trials.csv").open(newline="") as file:
        rows = {row["factor.how"]: row for row in csv.DictReader(file)}
    assert rows["print"]["status"] == "done"
    assert rows["exit"]["reason"] == f"plugin '{tmp_path / 'odd.py'}' line 17: SystemExit: 3"
    assert rows["raise"]["reason"] == f"plugin '{tmp_path / 'odd.py'}' line 19: ValueError: no, thank you"


def test_a_study_whose_plugin_was_moved(swept: Swept, tmp_path: Path) -> None:
    """Its page is written from its rows; what runs asks for the plugin, and takes it from where it lies."""
    folder, study = tmp_path / "there", "studies/odd"
    shutil.copytree(swept.folder, folder)
    (folder / "new").mkdir()
    for file in (folder / study).glob("*.yaml"):
        file.write_text(file.read_text().replace(str(swept.folder), str(folder)))
    (folder / "odd.py").rename(folder / "new/odd.py")
    page = pilotage("report", study, folder=folder)
    assert page.returncode == 0, page.stderr
    assert "left out of the report: pictures of trials" in page.stderr
    with pytest.raises(PluginError, match=r"name it where it is now: --plugin FOLDER/odd\.py$"):
        load_study(str(folder / study))
    resume = ("study", study, "--resume", "--no-report", "--quiet", "--plugin", "new/odd.py")
    taken = pilotage(*resume, folder=folder)
    assert taken.returncode == 1, taken.stderr  # two trials failed, as before
    assert "2 of 3 trials failed" in taken.stderr
    # The study's folder says where its plugin lies now.
    listed = yaml.safe_load((folder / study / "mission.yaml").read_text())["plugins"]
    assert listed == [str(folder / "new/odd.py")]


def test_a_plugin_that_was_moved_is_the_same_one_and_another_is_not() -> None:
    def essence(path: str, digest: str) -> dict[str, Any]:
        return {"mission": {"plugins": ["lab", path]}, "files": {path: digest, "/a/map.yaml": "1"}}

    before = essence("/a/odd.py", "2")
    assert not differences(before, essence("/b/odd.py", "2"))
    assert differences(before, essence("/b/odd.py", "3")) == ["files.odd.py: 2 -> 3"]


def test_a_pools_worker_says_where_a_plugin_failed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Its line was lost on the way to the parent; one that ended the process was a worker that died."""
    monkeypatch.setattr(plugins, "_loaded", dict(plugins._loaded))
    file = tmp_path / "ends.py"
    file.write_text("def work(code):\n    raise SystemExit(code)\n")
    plugins.load_file(str(file))
    work = sys.modules[plugins._loaded[str(file)]].work
    with pytest.raises(InputError, match=r"^plugin '.*ends\.py' line 2: SystemExit: 3$"):
        blamed(work, 3)
    with pytest.raises(ZeroDivisionError):
        blamed(lambda: 1 / 0)
