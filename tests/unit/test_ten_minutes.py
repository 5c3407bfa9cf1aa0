"""docs/ten-minutes.md as it stands: its files are written, its commands run, their output is as shown."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from support.warm_commands import pilotage

TEXT = (Path(__file__).parents[2] / "docs/ten-minutes.md").read_text()
AS_TYPED = {"new", "sweep"}
"""Started by a shell, as is what needs one; the others are processes of their own that import nothing."""
BLOCK = re.compile(r"^```(\w+)\n(.*?)^```", re.MULTILINE | re.DOTALL)


def commands(block: str) -> Iterator[tuple[str, list[str]]]:
    """What is typed, and the lines that are shown below it."""
    typed = ""
    shown: list[str] = []
    for line in block.splitlines():
        if line.startswith("$ "):
            if typed:
                yield typed, shown
            typed, shown = line[2:], []
        else:
            shown.append(line)
    yield typed, shown


def as_pattern(shown: list[str]) -> str:
    """``...`` stands for anything, alone on its line for any lines; white space is as wide as it likes."""
    parts = []
    for line in shown:
        if line == "...":
            parts.append(r"(?:.*\n)*?")
            continue
        words = [
            r"\S*".join(map(re.escape, word.split("..."))) if word != "..." else ".*" for word in line.split()
        ]
        parts.append(r"\s*" + r"\s+".join(words) + r"\s*\n")
    return "".join(parts)


@pytest.fixture
def shell(tmp_path: Path) -> dict[str, str]:
    """An environment in which ``pilotage`` and ``python`` are this code and this interpreter."""
    folder = tmp_path / "bin"
    folder.mkdir()
    for name, words in (("pilotage", "-m pilotage"), ("python", "")):
        (folder / name).write_text(f'#!/bin/sh\nexec "{sys.executable}" {words} "$@"\n')
        (folder / name).chmod(0o755)
    return {
        **{key: value for key, value in os.environ.items() if key != "PILOTAGE_PLUGINS"},
        "PATH": f"{folder}{os.pathsep}{os.environ['PATH']}",
        "COLUMNS": "120",
    }


@pytest.mark.slow
def test_the_ten_minutes_run_as_they_stand(
    tmp_path: Path, shell: dict[str, str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("COLUMNS", shell["COLUMNS"])
    folder = tmp_path / "mine"
    folder.mkdir()
    run = 0
    for language, block in BLOCK.findall(TEXT):
        if language in ("python", "yaml"):
            name = block.splitlines()[0].removeprefix("# ")
            (folder / name).write_text(block)
        if language != "console":
            continue
        for typed, shown in commands(block):
            program, *words = typed.split()
            if program == "pilotage" and words[0] not in AS_TYPED and not set(typed) & set("|\"'"):
                done = pilotage(*words, folder=folder)
            else:
                done = subprocess.run(
                    typed, shell=True, cwd=folder, env=shell, capture_output=True, text=True, check=False
                )
            assert done.returncode == 0, (typed, done.stdout, done.stderr)
            assert re.fullmatch(as_pattern(shown), done.stdout), (typed, done.stdout)
            run += 1
    assert run == 8
    replay = next((folder / "runs").glob("cart-*/report.html")).read_text()
    assert "arrived" in replay


def test_the_planner_has_twenty_lines() -> None:
    """Of what it does, imports and configuration apart."""
    (code,) = [
        block for language, block in BLOCK.findall(TEXT) if language == "python" and "# rrt.py" in block
    ]
    body = code.split("def plan(self, request):\n", 1)[1]
    assert len([line for line in body.splitlines() if line.strip()]) <= 20
