"""CONTRIBUTING.md holds: its rooms are those of import-linter, its worked examples run as they stand."""

from __future__ import annotations

import importlib
import inspect
import json
import re
import subprocess
import tomllib
from collections import defaultdict
from pathlib import Path
from typing import get_args, get_type_hints

import pytest

from pilotage.cli.main import main
from pilotage.core import plugins
from pilotage.experiments.roles import ROLES
from support.warm_commands import pilotage

ROOT = Path(__file__).parents[2]
TEXT = (ROOT / "CONTRIBUTING.md").read_text()
MODULES = dict(re.findall(r"^```python\n# src/pilotage/(\S+)\n(.*?)^```", TEXT, re.MULTILINE | re.DOTALL))
(MISSION,) = re.findall(r"^```yaml\n(.*?)^```", TEXT, re.MULTILINE | re.DOTALL)
NAMES = {"beeline", "position_fix", "tricycle", "stroll"}

RUN = "run", "a-stroll.yaml", "--json", "--out", "runs"


def check(done: subprocess.CompletedProcess[str]) -> float:
    assert done.returncode == 0, done.stderr
    answer = json.loads(done.stdout)
    assert (answer["success"], answer["reason"]) == (True, "strolled")
    assert answer["collisions"] == 0
    return float(answer["path_length_m"])


def test_the_rooms_are_those_of_the_contracts() -> None:
    contracts = tomllib.loads((ROOT / "pyproject.toml").read_text())["tool"]["importlinter"]["contracts"]
    listed = [
        [part.strip() for part in block.split(">") if part.strip()]
        for block in re.findall(r"((?:^    [a-z].*\n?(?:^        > .*\n)*))", TEXT, re.MULTILINE)
        if " > " in block
    ]
    for contract in contracts[:2]:
        assert contract["layers"] in listed
    there = {path.name for path in (ROOT / "src/pilotage").iterdir() if (path / "__init__.py").is_file()}
    assert there == {room for layer in contracts[0]["layers"] for room in layer.split(" | ")}


def test_the_examples_run_from_inside(tmp_path: Path) -> None:
    for place, text in MODULES.items():
        path = tmp_path / "rooms" / place
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)
    (tmp_path / "a-stroll.yaml").write_text(MISSION)
    done = pilotage(*RUN, folder=tmp_path, rooms=tmp_path / "rooms")
    assert check(done) >= 2.0


def test_the_examples_run_from_outside(tmp_path: Path) -> None:
    parts: dict[str, list[str]] = defaultdict(list)
    for place, text in MODULES.items():
        parts[Path(place).stem].append(text)
    assert set(parts) == NAMES
    words = []
    for name, texts in parts.items():
        between = re.compile(rf"^from pilotage\.[\w.]+\.{name} import .*\n", re.MULTILINE)
        (tmp_path / f"{name}.py").write_text("\n\n".join(between.sub("", text) for text in texts))
        words += ["--plugin", f"{name}.py"]
        assert f"--plugin {name}.py" in TEXT
    (metric,) = re.findall(r"^```python\n# wobble.py\n(.*?)^```", TEXT, re.MULTILINE | re.DOTALL)
    (tmp_path / "wobble.py").write_text(metric)
    (tmp_path / "a-stroll.yaml").write_text(MISSION)
    done = pilotage(*RUN, *words, "--plugin", "wobble.py", folder=tmp_path)
    assert check(done) >= 2.0
    assert json.loads(done.stdout)["wobble_rad"] > 0.0


def test_the_table_of_roles_is_true() -> None:
    """Every role but those of the worked examples, what it is built as and what its protocol has."""
    row = r"^\| `(\w+)`.* \| `(\w+)` of `(\S+)\.py` \| `(.*?)` \| (.*) \|$"
    reference = (ROOT / "docs/api/roles.md").read_text()
    rows = {key.removesuffix("s"): rest for key, *rest in re.findall(row, TEXT, re.MULTILINE)}
    assert set(rows) == set(ROLES) - {"planner", "sensor", "motion", "task"}
    for role, (registry, file, built, has) in rows.items():
        module = importlib.import_module("pilotage." + file.replace("/", "."))
        assert getattr(module, registry) is ROLES[role]
        said = re.sub(r"(\w+): \w+", r"\1", " ".join(inspect.getsource(module).split()))
        assert f"uilt as ``{built}``" in said, role
        (protocol,) = get_args(get_type_hints(module)[registry])
        public = {name for name in vars(protocol) | get_type_hints(protocol) if not name.startswith("_")}
        assert set(re.findall(r"`(\w+)`", has)) - {"StackStatus"} == public, role
        (told,) = re.findall(rf"^## {role}$(.*?)^## ", reference, re.MULTILINE | re.DOTALL)
        assert set(re.findall(r"^#* ?[-#] `(\w+)(?:\(|: )", told, re.MULTILINE)) == public, role


@pytest.mark.parametrize("word", ["stroll", "beeline"])
def test_without_them_the_mission_is_refused_in_one_line(
    word: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """In this process: it registers nothing."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.delenv(plugins.VARIABLE, raising=False)
    Path("a-stroll.yaml").write_text(MISSION)
    words = ["--set", "task=reach"] if word == "beeline" else []
    assert main(["run", "a-stroll.yaml", "--json", "--out", "runs", *words]) == 2
    told = capsys.readouterr()
    assert told.out == ""
    assert told.err.count("\n") == 1
