"""What takes the place of another file, and what never gives way to one."""

from __future__ import annotations

import os
import stat
from pathlib import Path

import pytest

from pilotage.cli.main import main
from pilotage.core.errors import InputError
from pilotage.core.whole_file import write_whole


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="no named pipes here")
@pytest.mark.parametrize("linked", [False, True])
def test_a_pipe_or_a_device_is_not_replaced(linked: bool, tmp_path: Path) -> None:
    """As root ``--out /dev/null`` put a file in the place of the device, for everybody."""
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    path = tmp_path / "link" if linked else pipe
    if linked:
        path.symlink_to(pipe)
    with pytest.raises(InputError, match="expected a place for a file, found a device, a pipe or a socket"):
        write_whole(path, "text")
    assert stat.S_ISFIFO(pipe.stat().st_mode)
    assert path.is_symlink() == linked
    assert {entry.name for entry in tmp_path.iterdir()} == {"pipe", path.name}


def test_a_folder_is_not_replaced(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="expected a place for a file, found a folder"):
        write_whole(tmp_path, "text")


def test_a_file_and_a_link_to_nothing_are(tmp_path: Path) -> None:
    (tmp_path / "a").write_text("old")
    (tmp_path / "b").symlink_to(tmp_path / "nothing")
    for name in "ab":
        write_whole(tmp_path / name, "new")
        assert (tmp_path / name).read_text() == "new"


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="no named pipes here")
def test_a_command_says_so_in_one_line(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    pipe = tmp_path / "map.png"
    os.mkfifo(pipe)
    assert main(["draw", "flat", "--out", str(pipe)]) == 2
    said = capsys.readouterr().err
    assert said == f"pilotage: {pipe}: expected a place for a file, found a device, a pipe or a socket\n"
