"""docs/reports.md is up to date, and every command that it names can be run."""

from __future__ import annotations

import importlib.util
import itertools
import json
from pathlib import Path

import pytest

from pilotage.cli.main import main
from pilotage.experiments.build.build import build
from pilotage.experiments.mission import load_mission, shipped_missions
from pilotage.experiments.reproduced import Reproduced, reproduced
from pilotage.experiments.studies.study import shipped_studies

ROOT = Path(__file__).parents[2]


def test_the_page_is_up_to_date() -> None:
    spec = importlib.util.spec_from_file_location("make_reports", ROOT / "docs" / "make_reports.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    assert module.PAGE.read_text(encoding="utf-8") == module.page(), "write it anew with `make api`"


@pytest.mark.parametrize("row", reproduced(), ids=lambda row: f"{row.report} {row.item}")
def test_what_reproduces_it_exists(row: Reproduced, capsys: pytest.CaptureFixture[str]) -> None:
    assert row.item
    assert row.shows
    words = row.command.split()
    if words[0] != "pilotage":
        assert len(words) == 1
        assert (ROOT / words[0]).is_file(), f"{row.command}: no such file"
    elif words[1] == "run":
        assert words[2] in shipped_missions()
        said = row.remark.split()
        overrides = [value for flag, value in itertools.pairwise(said) if flag == "--set"]
        if overrides:
            build(load_mission(words[2], overrides, 0))
    elif words[1] == "study":
        assert words[2] in shipped_studies()
    else:
        names = [word for word in words[1:3] if not word.startswith(("-", "."))]
        assert main([*names[: 2 if words[1] == "calibrate" else 1], "--help"]) == 0, capsys.readouterr().err


def test_no_item_is_named_twice() -> None:
    names = [(row.report, row.item) for row in reproduced()]
    assert len(set(names)) == len(names)


@pytest.mark.parametrize("number", range(1, 35))
def test_every_figure_of_the_night_watch_has_its_row(number: int) -> None:
    assert ("night-watch", f"figure {number}") in [(row.report, row.item) for row in reproduced()]


def test_study_list_names_studies_and_reports(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["study", "--list"]) == 0
    printed = capsys.readouterr().out
    assert all(name in printed for name in shipped_studies())
    assert all(row.command in printed for row in reproduced())
    assert main(["study", "--list", "--json"]) == 0
    listed = json.loads(capsys.readouterr().out)
    assert sorted(listed["studies"]) == sorted(shipped_studies())
    assert len(listed["reports"]) == len(reproduced())


def test_a_study_is_named_or_listed(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["study"]) == 2
    assert "--list" in capsys.readouterr().err
