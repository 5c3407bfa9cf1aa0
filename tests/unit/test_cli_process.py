"""The command line's parts and its process: poses, plain values, the progress line, pipes and streams."""

from __future__ import annotations

import io
import math
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from pilotage import __version__
from pilotage.cli.output import plain, progress_line
from pilotage.cli.plan import parse_pose
from pilotage.core.errors import InputError
from pilotage.experiments.progress import Progress, metres
from pilotage.face.progress import ProgressLine, progress_text


@pytest.mark.parametrize(
    ("text", "values"), [("1,2", (1.0, 2.0)), ("-1, 2.5 ,-3.1", (-1.0, 2.5, -3.1)), ("1e1,0", (10.0, 0.0))]
)
def test_a_pose_is_read(text: str, values: tuple[float, ...]) -> None:
    assert parse_pose(text, "--start") == values


@pytest.mark.parametrize("text", ["", "1", "1,2,3,4", "a,b", "1,,2", "inf,0", "1,nan"])
def test_what_is_no_pose_is_refused(text: str) -> None:
    with pytest.raises(InputError, match="--start: expected X,Y or X,Y,TH"):
        parse_pose(text, "--start")


def test_plain_values_are_json() -> None:
    value = {
        1: np.float64(2.0),
        "nan": np.float64(math.nan),
        "inf": [math.inf, -math.inf, 0.5],
        "array": np.array([[1.0, math.nan]]),
        "flag": np.bool_(True),
        "count": np.int64(3),
        "path": Path("a/b"),
        "none": None,
        "true": True,
    }
    assert plain(value) == {
        "1": 2.0,
        "nan": None,
        "inf": [None, None, 0.5],
        "array": [[1.0, None]],
        "flag": True,
        "count": 3,
        "path": "a/b",
        "none": None,
        "true": True,
    }


class Terminal(io.StringIO):
    def isatty(self) -> bool:
        return True


class Clock:
    now_s = 0.0

    def __call__(self) -> float:
        return self.now_s


def test_progress_tells_time_distance_error_and_sigma() -> None:
    text = progress_text(
        Progress(
            12.34, (("to go", metres(45.6, 1)), ("error", metres(0.0123, 3)), ("sigma", metres(math.nan, 3)))
        )
    )
    assert " ".join(text.split()) == "t 12.3 s to go 45.6 m error 0.012 m sigma - m"


def test_on_a_terminal_one_line_rewrites_itself_and_is_wiped(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("TERM", "xterm")
    stream, clock = Terminal(), Clock()
    line = ProgressLine(stream, clock)
    for clock.now_s in np.linspace(0.0, 1.0, 101):
        line(Progress(1.0, (("to go", "2 m"),)))
    line.close()
    assert 9 <= stream.getvalue().count("\rt ") <= 11
    assert "\n" not in stream.getvalue()
    assert stream.getvalue().endswith("\r\x1b[K")


def test_elsewhere_a_plain_line_comes_now_and_then() -> None:
    stream, clock = io.StringIO(), Clock()
    line = ProgressLine(stream, clock)
    for clock.now_s in np.linspace(0.0, 25.0, 251):
        line(Progress(1.0, (("to go", "2 m"),)))
    line.close()
    assert stream.getvalue().count("\n") == 2
    assert "\r" not in stream.getvalue()


def test_the_line_is_wiped_also_when_the_run_breaks_off(monkeypatch: pytest.MonkeyPatch) -> None:
    terminal = Terminal()
    monkeypatch.setattr(sys, "stderr", terminal)
    monkeypatch.setenv("TERM", "xterm")

    def broken_run() -> None:
        with progress_line(True) as show:
            assert show is not None
            show(Progress(1.0, (("to go", "2 m"),)))
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        broken_run()
    assert terminal.getvalue().endswith("\r\x1b[K")


# The process


def test_help_imports_nothing_heavy() -> None:
    script = """
import sys
from pilotage.cli.main import main
code = main(["--help"]) or main(["run", "--help"])
heavy = {"numba", "numpy", "scipy", "matplotlib", "pyarrow", "rich", "yaml"} & set(sys.modules)
sys.exit(code or ", ".join(sorted(heavy)) or 0)
"""
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (0, "")


def test_a_run_imports_only_what_it_uses(tmp_path: Path) -> None:
    """Arrow would import pandas for any array; half a second of each run and of each worker of a study."""
    script = """
import sys
from pilotage.cli.main import main
words = ["--no-report", "--set", "run.time_limit_s=0.5", "--out", sys.argv[1]]
code = main(["run", "museum-1", *words])
unused = {"pandas", "matplotlib"} | {f"scipy.{name}" for name in ("ndimage", "optimize", "spatial", "stats")}
unused &= set(sys.modules)
sys.exit(", ".join(sorted(unused)) or code)
"""
    words = [sys.executable, "-W", "error", "-c", script, str(tmp_path)]
    done = subprocess.run(words, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (1, "")
    assert list(tmp_path.glob("*/trace.parquet"))


def test_garbage_is_looked_for_seldom_in_a_process_of_its_own_only() -> None:
    """Fifty times as seldom as Python 3.11 does; later ones begin with other numbers."""
    script = """
import gc, sys
from pilotage.cli.main import main
before = gc.get_threshold()
code = main(["--version"])
called = gc.get_threshold() == before
sys.argv[1:] = ["--version"]
code = code or main()
print(code, called, gc.get_threshold()[0] >= 35_000)
"""
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=False)
    assert done.stdout.splitlines()[-1] == "0 True True"


def test_a_closed_pipe_is_quiet() -> None:
    reader, writer = os.pipe()
    os.close(reader)
    command = [sys.executable, "-m", "pilotage", "--help"]
    done = subprocess.run(command, stdout=writer, stderr=subprocess.PIPE, text=True, check=False)
    os.close(writer)
    assert (done.returncode, done.stderr) == (141, "")


def test_a_stream_that_was_closed_is_no_bug() -> None:
    shell = f"'{sys.executable}' -m pilotage zzz >&-; echo $? >&2; exec 2>&-; "
    done = subprocess.run(
        ["sh", "-c", shell + f"'{sys.executable}' -m pilotage --version"],
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.stdout == f"pilotage {__version__}\n"
    assert done.stderr.count("\n") == 2
    assert done.stderr.splitlines()[-1] == "2"


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="a device that is full is Linux's")
@pytest.mark.parametrize("unbuffered", ["", "1"])
@pytest.mark.parametrize(
    ("stream", "command", "code"),
    [("stderr", "run nosuch", 2), ("stdout", "--version", 2), ("stderr", "--version", 0)],
)
def test_where_a_stream_is_full_the_code_tells_alone(
    stream: str, command: str, code: int, unbuffered: str
) -> None:
    """It was that of a task that failed in the field; and 120, where the interpreter buffers its lines."""
    words = [sys.executable, "-m", "pilotage", *command.split()]
    streams = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
    environment = os.environ | {"PYTHONUNBUFFERED": unbuffered}
    with Path("/dev/full").open("w") as full:
        done = subprocess.run(words, **(streams | {stream: full}), check=False, env=environment)  # type: ignore[call-overload]
    assert done.returncode == code


def test_a_folder_that_is_gone_is_told(tmp_path: Path) -> None:
    """It was "No such file or directory", of no file."""
    command = f"mkdir gone; cd gone; rmdir ../gone; '{sys.executable}' -m pilotage run museum-plan --json"
    environment = os.environ | {"PYTHONPATH": ""}
    words = ["sh", "-c", command]
    done = subprocess.run(words, cwd=tmp_path, env=environment, capture_output=True, text=True, check=False)
    told = "pilotage: the current folder is gone; change into one that exists\n"
    assert (done.returncode, done.stderr) == (2, told)


def test_a_terminal_that_lacks_a_character_shows_a_question_mark() -> None:
    script = "import sys; from pilotage.cli.main import main; main(['run', '\u2212.yaml']); print('\u2212')"
    done = subprocess.run(
        [sys.executable, "-c", script],
        capture_output=True,
        text=True,
        check=False,
        env={**os.environ, "PYTHONIOENCODING": "ascii"},
    )
    assert done.stdout == "?\n"
    assert done.stderr.startswith("pilotage: mission file '?.yaml'")


def test_settings_of_others_libraries_break_nothing(tmp_path: Path) -> None:
    done = subprocess.run(
        [sys.executable, "-m", "pilotage", "draw", "museum", "--out", str(tmp_path / "a.png")],
        capture_output=True,
        text=True,
        check=False,
        env={
            **os.environ,
            "MPLBACKEND": "none of these",
            "MPLCONFIGDIR": "/dev/null/no-folder",
            "NUMBA_NUM_THREADS": "0",
            "SOURCE_DATE_EPOCH": "yesterday",
        },
    )
    assert (done.returncode, done.stderr) == (0, "")


@pytest.mark.parametrize("megabytes", [100, 400, 640])
def test_little_address_space_is_told_in_one_line(megabytes: int, tmp_path: Path) -> None:
    """Libraries that could not be loaded ended in a traceback, in words of their own or never."""
    resource = pytest.importorskip("resource", reason="systems without such limits")

    def limited() -> None:
        resource.setrlimit(resource.RLIMIT_AS, (megabytes * 2**20, megabytes * 2**20))

    done = subprocess.run(
        [sys.executable, "-m", "pilotage", "run", "museum-1", "--set", "run.time_limit_s=1"],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        check=False,
        preexec_fn=limited,
    )
    told = "pilotage: this needs more memory than there is; take a smaller or coarser input\n"
    assert (done.returncode, done.stderr) == (2, told)
    assert not list(tmp_path.iterdir())
