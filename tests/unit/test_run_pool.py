"""A pool of runs ends when it is told to, not when its runs do."""

from __future__ import annotations

import contextlib
import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

LONG_S = 120
"""A run that is over by then was waited for."""

POOLED = f"""
import os, signal, sys, time
from pathlib import Path
from pilotage.cli import app
from pilotage.cli.main import main
from pilotage.experiments.run_pool import all_done

def long(number):
    Path(f"{{number}}.begun").write_text(str(os.getpid()))
    time.sleep({LONG_S})
    Path(f"{{number}}.over").touch()

def pooled(*_given, **_named):
    for _ in all_done(long, [(1,), (2,), (3,)], 2, "bench"):
        pass
    return 0

if __name__ == "__main__":
    signal.signal(signal.SIGINT, signal.default_int_handler)  # a test in the background was started without
    app.dispatch = pooled
    sys.exit(main(["missions"]))
"""


@pytest.fixture
def parent(tmp_path: Path) -> Iterator[subprocess.Popen[str]]:
    """A command with two workers under way."""
    (tmp_path / "pooled.py").write_text(POOLED)
    process = subprocess.Popen(
        [sys.executable, "pooled.py"],
        cwd=tmp_path,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        env=os.environ | {"PYTHONPATH": os.pathsep.join(sys.path)},
        start_new_session=True,
    )
    while process.poll() is None and len([p for p in tmp_path.glob("*.begun") if p.read_text()]) < 2:
        time.sleep(0.05)
    yield process
    with contextlib.suppress(ProcessLookupError):
        os.killpg(process.pid, signal.SIGKILL)
    process.communicate()


def workers_end(folder: Path) -> bool:
    """Wait until none of the workers is there any more, or their runs are over."""
    numbers = [int(path.read_text()) for path in folder.glob("*.begun")]
    assert len(numbers) == 2
    while any(_runs(number) for number in numbers) and not list(folder.glob("*.over")):
        time.sleep(0.05)
    return not list(folder.glob("*.over"))


def _runs(number: int) -> bool:
    try:
        return Path(f"/proc/{number}/stat").read_text().rsplit(")", 1)[1].split()[0] != "Z"
    except OSError:
        return False


@pytest.mark.skipif(not Path("/proc/self/stat").exists(), reason="asks Linux who is still there")
class TestItEnds:
    @pytest.mark.parametrize(
        ("number", "all_of_them", "line"),
        [
            (signal.SIGTERM, False, "pilotage: ended by SIGTERM\n"),
            (signal.SIGINT, True, "pilotage: interrupted\n"),
        ],
    )
    def test_without_waiting_for_its_runs(
        self,
        parent: subprocess.Popen[str],
        tmp_path: Path,
        number: signal.Signals,
        all_of_them: bool,
        line: str,
    ) -> None:
        """It waited for the runs under way, minutes long, and took no second Ctrl-C."""
        (os.killpg if all_of_them else os.kill)(parent.pid, number)
        _, told = parent.communicate()
        assert told == line
        assert parent.returncode == 128 + number
        assert workers_end(tmp_path)

    def test_with_its_parent(self, parent: subprocess.Popen[str], tmp_path: Path) -> None:
        """Killed, it left its workers waiting for ever."""
        parent.kill()
        parent.wait()
        assert workers_end(tmp_path)
