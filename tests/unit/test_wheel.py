"""What is handed out: the wheel has every file, a registry would take it, it runs without the repository."""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest
import yaml

from pilotage.core.version import __version__

PROGRAM = """
import sys, pilotage
from pilotage.cli.main import main
print(pilotage.__file__)
main(sys.argv[1:])
"""
ROOT = Path(__file__).parents[2]
pytest.importorskip("build", reason="needs the extra 'dev'")


def call(*words: str, folder: Path, **environment: str) -> str:
    environment = {key: value for key, value in os.environ.items() if key != "PYTHONPATH"} | environment
    done = subprocess.run(words, cwd=folder, env=environment, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("dist")
    words = ("-m", "build", "--wheel", "--no-isolation", "--outdir", str(folder), str(ROOT))
    call(sys.executable, *words, folder=folder)
    (found,) = folder.glob("*.whl")
    return found


def test_it_holds_every_file_of_the_package(wheel: Path) -> None:
    source = ROOT / "src"
    wanted = {
        str(path.relative_to(source))
        for path in (source / "pilotage").rglob("*")
        if path.is_file() and "__pycache__" not in path.parts
    }
    with zipfile.ZipFile(wheel) as archive:
        there = {name for name in archive.namelist() if not name.startswith("pilotage-")}
        (entries,) = [name for name in archive.namelist() if name.endswith("entry_points.txt")]
        assert "pilotage = pilotage.cli.main:main" in archive.read(entries).decode()
    assert there == wanted


def test_a_registry_would_take_it(wheel: Path) -> None:
    pytest.importorskip("twine", reason="needs the extra 'dev'")
    assert "PASSED" in call(
        sys.executable, "-m", "twine", "check", "--strict", str(wheel), folder=wheel.parent
    )


def test_it_runs_without_the_repository(wheel: Path, tmp_path: Path) -> None:
    home, place = tmp_path / "site", tmp_path / "place"
    place.mkdir()
    with zipfile.ZipFile(wheel) as archive:
        archive.extractall(home)
    words = ("run", "museum-route", "--json", "--set", "run.time_limit_s=3")
    told = call(sys.executable, "-c", PROGRAM, *words, folder=place, PYTHONPATH=str(home))
    where, answer = told.splitlines()
    assert where.startswith(str(home))
    folder = place / json.loads(answer)["run_dir"]
    assert (folder / "report.html").stat().st_size > 100_000


def test_the_citation_is_of_this_version() -> None:
    citation = yaml.safe_load((ROOT / "CITATION.cff").read_text())
    assert citation["version"] == __version__
    assert {"cff-version", "title", "message", "authors", "license"} <= set(citation)


def test_the_core_is_locked_alone_and_as_the_rest() -> None:
    """What a demonstration installs is what the tests run with, and none of their tools."""
    locks = {
        name: dict(re.findall(r"^([\w.-]+)==(\S+)", (ROOT / name).read_text(), re.MULTILINE))
        for name in ("requirements-core.lock", "requirements.lock")
    }
    core, whole = locks.values()
    assert core.items() <= whole.items()
    assert not {"pytest", "mypy", "opencv-python-headless", "dask", "rosbags", "gymnasium"} & set(core)
    assert "numba" in core
