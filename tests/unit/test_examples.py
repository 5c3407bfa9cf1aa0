"""Every example runs, from any folder, and says something."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

EXAMPLES = sorted((Path(__file__).parents[2] / "examples").glob("*.py"))
FEWER = {"compare_filters": ["2"], "romi_five_panels": ["0", "60"]}
"""Seeds, or a seed and seconds: what an example is asked for that does the same again and again."""


@pytest.mark.parametrize("script", EXAMPLES, ids=lambda path: path.stem)
def test_example_runs(script: Path, tmp_path: Path) -> None:
    done = subprocess.run(
        [sys.executable, "-W", "error", str(script), *FEWER.get(script.stem, [])],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    assert done.stdout.strip()
    assert done.stderr == ""


def test_the_readme_shows_the_example_as_it_is() -> None:
    readme = (EXAMPLES[0].parents[1] / "README.md").read_text()
    code = (EXAMPLES[0].parent / "night_watch.py").read_text().split('"""', 2)[2].strip()
    assert code in readme
