"""Definitions and databases that hold what a file can hold: one line each, and no folder."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from pilotage.cli.main import main
from pilotage.core.errors import InputError
from pilotage.experiments.studies.database import DATABASE
from pilotage.experiments.studies.store import Store
from support.hostile_studies import study_of

HEAD = "study: x\nmission: museum-plan\n"
RADIUS = "{key: stack.planner.turning_radius_m, name: f%d, values: [0.%d]}"
BOMB = "a: &a [x, x, x, x, x, x, x, x, x]\n" + "".join(
    f"{letter}: &{letter} [{', '.join([f'*{before}'] * 9)}]\n"
    for before, letter in zip("abcdefgh", "bcdefghi", strict=True)
)


@pytest.mark.parametrize(
    ("text", "told"),
    [
        (HEAD + BOMB, "expected at most"),
        (f"{HEAD}set: {'{a: ' * 3000}1{'}' * 3000}\n", "deep inside one another"),
        (f"{HEAD}set: &a {{b: *a}}\n", "inside itself"),
        (f"{HEAD}factors: [{', '.join(RADIUS % (i, i + 1) for i in range(2000))}]\n", "found 2000"),
        (
            f"{HEAD}factors: [{{key: run.dt_s, values: [{', '.join(f'{i}.5' for i in range(20_000))}]}}]\n",
            "expected at most 10000 values, found 20000",
        ),
        (f"{HEAD}factors: [{{key: run.dt_s, range: {{start: 0, stop: 1, step: 1e-9}}}}]\n", "at most 10000"),
        (f"{HEAD}trials: 9999999\n", "rows"),
        ("study: x\nmission: one.yaml\n", "cannot extend itself"),
    ],
    ids=["bomb", "deep", "self", "factors", "values", "range", "rows", "extends"],
)
def test_a_definition_that_swells_is_one_line(
    text: str, told: str, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("one.yaml").write_text("extends: two.yaml\nmission: a\n")
    Path("two.yaml").write_text("extends: one.yaml\nmission: b\n")
    Path("study.yaml").write_text(text)
    assert main(["study", "study.yaml", "--out", "out"]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert told in line
    assert len(line) < 1500
    assert not Path("out").exists()


@pytest.mark.parametrize("how", ["loop", "pipe", "device", "folder"])
def test_what_is_no_file_is_not_read(how: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for path in (tmp_path / "study.yaml", tmp_path / "x" / DATABASE):
        path.parent.mkdir(exist_ok=True)
        if how == "loop":
            path.symlink_to(path)
        elif how == "pipe":
            os.mkfifo(path)
        elif how == "device":
            path.symlink_to("/dev/zero")
        else:
            path.mkdir()
    assert main(["study", str(tmp_path / "study.yaml"), "--out", str(tmp_path)]) == 2
    assert len(capsys.readouterr().err.splitlines()) == 1
    with pytest.raises(InputError, match="expected a study's database, found"):
        Store(tmp_path / "x", study_of())
