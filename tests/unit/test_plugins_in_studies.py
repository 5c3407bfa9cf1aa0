"""Studies and pools of components that print, end the process or raise: whose fault it is is said."""

from __future__ import annotations

import csv
import json
import sys
from pathlib import Path

import pytest
import yaml

from pilotage.core import plugins
from pilotage.core.errors import InputError
from pilotage.experiments.run_pool import blamed
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


def test_trials_of_odd_plugins(tmp_path: Path) -> None:
    """Words of a worker's stood before the JSON object; that it ended itself was a worker that died."""
    (tmp_path / "odd.py").write_text(ODD)
    stack = {"planner": "odd", "smoother": "none"}
    mission = {"extends": "museum-plan", "plugins": ["odd.py"], "stack": stack}
    (tmp_path / "m.yaml").write_text(yaml.safe_dump(mission))
    asked = ("--vary", "stack.planner.how=print,exit,raise", "--trials", "1", "--workers", "1", "--no-report")
    done = pilotage("sweep", "m.yaml", *asked, "--json", "--quiet", "--name", "odd", folder=tmp_path)
    assert json.loads(done.stdout)["failed"] == 2
    assert "good morning" in done.stderr
    assert "Traceback" not in done.stderr
    with (tmp_path / "studies/odd/trials.csv").open(newline="") as file:
        rows = {row["factor.how"]: row for row in csv.DictReader(file)}
    assert rows["print"]["status"] == "done"
    assert rows["exit"]["reason"] == f"plugin '{tmp_path / 'odd.py'}' line 17: SystemExit: 3"
    assert rows["raise"]["reason"] == f"plugin '{tmp_path / 'odd.py'}' line 19: ValueError: no, thank you"


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
