"""``pilotage bench barn`` on a few of the real courses."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from pilotage.cli.main import main
from support.recordings import recording


def test_our_own_controller_gets_through(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Three courses, once each; the page shows what others published of Gazebo."""
    folder = recording("barn/worlds.csv").parent
    arguments = ["--trials", "1", "--courses", "3", "--workers", "1", "--replays", "0", "--json"]
    assert main(["bench", "barn", str(folder), "--out", str(tmp_path), *arguments]) == 0
    answer = json.loads(capsys.readouterr().out)
    assert (answer["success"], answer["collision"]) == (1.0, 0.0)
    assert answer["metric"] > 0.45
    page = (tmp_path / "report.html").read_text()
    assert "lics_ki (Gazebo)" in page
    assert "yardstick" in page
