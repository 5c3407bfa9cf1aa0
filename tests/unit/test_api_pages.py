"""The generated reference is up to date, and every example in it runs."""

from __future__ import annotations

import doctest
import importlib.util
from pathlib import Path
from types import ModuleType

import pytest

import pilotage as pl

ROOT = Path(__file__).parents[2]
REMEDY = "write it anew with `make api`"


def maker() -> ModuleType:
    spec = importlib.util.spec_from_file_location("make_api", ROOT / "docs" / "make_api.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_the_reference_is_up_to_date() -> None:
    made = maker().pages()
    there = {path.name: path.read_text(encoding="utf-8") for path in (ROOT / "docs" / "api").glob("*.md")}
    assert sorted(made) == sorted(there), REMEDY
    assert [name for name in made if made[name] != there[name]] == [], REMEDY


def test_names_that_differ_by_their_case_have_pages_of_their_own() -> None:
    names = [maker().page_of(name).lower() for name in pl.__all__]
    assert len(set(names)) == len(names)


def examples() -> list[doctest.DocTest]:
    found = doctest.DocTestFinder(recurse=True)
    tests = {test.name: test for test in found.find(pl, "pilotage") if test.examples}
    for name in pl.__all__:
        public = getattr(pl, name)
        for test in found.find(public, name, globs={}):
            if test.examples:
                tests[test.name] = test
    return list(tests.values())


@pytest.mark.slow
@pytest.mark.parametrize("test", examples(), ids=lambda test: test.name)
def test_every_example_runs(test: doctest.DocTest, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    told: list[str] = []
    runner = doctest.DocTestRunner(optionflags=doctest.IGNORE_EXCEPTION_DETAIL)
    failed, tried = runner.run(test, out=told.append)
    assert tried
    assert not failed, "".join(told)
