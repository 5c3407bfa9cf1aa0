"""Every example runs, from any folder, and says something."""

from __future__ import annotations

import runpy
import subprocess
import sys
from pathlib import Path

import pytest

EXAMPLES = sorted((Path(__file__).parents[2] / "examples").glob("*.py"))
FEWER = {"compare_filters": ["2"], "romi_five_panels": ["0", "20"]}
"""Seeds, or a seed and seconds: what an example is asked for that does the same again and again."""


SHOWN = "night_watch"
"""What the README shows is run as whoever reads it would; the others need no interpreter of their own."""


def test_the_shown_example_runs_in_a_process_of_its_own(tmp_path: Path) -> None:
    done = subprocess.run(
        [sys.executable, "-W", "error", str(EXAMPLES[0].with_stem(SHOWN))],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    assert done.stdout.strip()
    assert done.stderr == ""


@pytest.mark.parametrize(
    "script", [path for path in EXAMPLES if path.stem != SHOWN], ids=lambda path: path.stem
)
def test_example_runs(
    script: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "argv", [str(script), *FEWER.get(script.stem, [])])
    runpy.run_path(str(script), run_name="__main__")
    told = capfd.readouterr()
    assert told.out.strip()
    assert told.err == ""


def test_the_readme_shows_the_example_as_it_is() -> None:
    readme = (EXAMPLES[0].parents[1] / "README.md").read_text()
    code = (EXAMPLES[0].parent / "night_watch.py").read_text().split('"""', 2)[2].strip()
    assert code in readme
