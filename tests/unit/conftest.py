"""Fixtures that several of the unit tests share."""

from __future__ import annotations

import shutil
import subprocess
import tempfile
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from pilotage.experiments.studies import local_workers
from pilotage.experiments.studies.engine import run_study
from pilotage.experiments.studies.options import StudyOptions
from support import hostile_trials
from support.browser import Browser, find_browser
from support.hostile_studies import study_of


@pytest.fixture
def order(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Callable[..., None]:
    """Give rows their orders."""
    return _giver(tmp_path, monkeypatch)


@pytest.fixture(scope="session")
def finished_study(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of a study that nothing befell, to be copied."""
    place = tmp_path_factory.mktemp("finished")
    with pytest.MonkeyPatch.context() as patch:
        _giver(place, patch)
        run_study(study_of(), place / "study", StudyOptions(workers=1))
    return place / "study"


def _giver(place: Path, monkeypatch: pytest.MonkeyPatch) -> Callable[..., None]:
    marks = place / "marks"
    marks.mkdir()
    monkeypatch.setenv(hostile_trials.MARKS, str(marks))
    monkeypatch.setattr(local_workers, "_work", hostile_trials.work)

    def give(*orders: str) -> None:
        monkeypatch.setenv(hostile_trials.ORDERS, ",".join(orders))

    give()
    return give


@pytest.fixture(scope="session")
def _chromium() -> Iterator[Browser]:
    program = find_browser()
    if program is None:
        pytest.skip("no Chromium is installed: pages are not tried in a browser")
    with Browser(program) as browser:
        yield browser


@pytest.fixture(scope="module")
def browser(_chromium: Browser) -> Browser:
    """A browser with an empty page; the program is the same for all modules."""
    return _chromium.begin()


@pytest.fixture
def small_disk() -> Iterator[Callable[[str], Path]]:
    """Disks of their own, of some kilobytes."""
    made: list[Path] = []

    def mount(size: str) -> Path:
        place = Path(tempfile.mkdtemp(prefix="pilotage-disk-"))
        ran = subprocess.run(
            ["mount", "-t", "tmpfs", "-o", f"size={size}", "tmpfs", str(place)],
            capture_output=True,
            check=False,
        )
        if ran.returncode != 0:
            place.rmdir()
            pytest.skip("cannot mount a small disk here")
        made.append(place)
        return place

    if shutil.which("mount") is None:
        pytest.skip("no mount here")
    yield mount
    for place in made:
        subprocess.run(["umount", "-l", str(place)], check=True)
        place.rmdir()
