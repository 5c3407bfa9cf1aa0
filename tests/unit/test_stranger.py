"""What somebody meets who has a clone of the core and nothing else."""

from __future__ import annotations

import builtins
import subprocess
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from pilotage.bridges.rerun_file import rerun
from pilotage.core.errors import InputError
from pilotage.logs.rosbags_extra import rosbags
from pilotage.tracking.opencv import opencv

ROOT = Path(__file__).parents[2]
AT_THE_ROOT = {
    *(
        ".ci",
        ".gitignore",
        "CHANGELOG.md",
        "CITATION.cff",
        "CONTRIBUTING.md",
        "LICENSE",
        "Makefile",
        "README.md",
    ),
    *("benchmarks", "docs", "examples", "pyproject.toml", "src", "tests"),
    *("requirements.lock", "requirements-bench.lock", "requirements-core.lock"),
}


def test_nothing_is_left_at_the_root() -> None:
    """Six drawn floors of an experiment were."""
    if not (ROOT / ".git").exists():
        pytest.skip("no clone")
    listed = subprocess.run(["git", "ls-files"], cwd=ROOT, capture_output=True, text=True, check=True).stdout
    assert {path.split("/")[0] for path in listed.splitlines()} <= AT_THE_ROOT


@pytest.mark.parametrize(
    ("extra", "ask"), [("rerun", rerun), ("ros", lambda: rosbags("highlevel")), ("vision", opencv)]
)
def test_a_library_that_is_missing_is_had_from_the_clone(
    extra: str, ask: Callable[[], Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Whoever typed ``pip install pilotage[ros]`` as told asked an index for somebody else's package."""
    real = builtins.__import__

    def without(name: str, *given: Any, **named: Any) -> Any:
        if name.split(".")[0] in {"rerun", "rosbags", "cv2"}:
            raise ImportError(name)
        return real(name, *given, **named)

    monkeypatch.setattr(builtins, "__import__", without)
    monkeypatch.setattr("importlib.import_module", without)
    with pytest.raises(InputError) as caught:
        ask()
    assert f"pip install -e '.[{extra}]'" in str(caught.value)
    assert f"\n{extra} = [" in (ROOT / "pyproject.toml").read_text()
