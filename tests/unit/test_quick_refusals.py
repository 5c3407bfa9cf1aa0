"""A wrong name is refused before what only a right one needs is loaded: numba alone takes a second."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

from pilotage.kernels.jit import kernel

COMMANDS = """
run nosuch|run nosuch.yaml|report nosuch|slam nosuch|localize nosuch|study nosuch|draw nosuch|vectorize nosuch
sweep nosuch --vary task.radius_m=1,2|attribute nosuch|export nosuch --to csv|evaluate nosuch nosuch
track nosuch|map-score nosuch nosuch
calibrate odometry nosuch|plan nosuch --start 1,1 --goal 2,2|bench barn nosuch
bench-scen nosuch nosuch|serve nosuch|components nosuch|new nosuch nosuch
"""

SCRIPT = """
import sys
from pilotage.cli.main import main
commands = sys.argv[1].replace("\\n", "|").strip("|").split("|")
heavy = {"numba", "matplotlib", "pandas"}
heavy |= {f"scipy.{name}" for name in ("ndimage", "optimize", "sparse", "spatial", "special", "stats")}
for command in commands:
    code = main(command.split())
    print(f"{command}: {code}" + "".join(f" {name}" for name in sorted(heavy & set(sys.modules))))
    heavy -= set(sys.modules)
"""


def test_a_refusal_loads_nothing_heavy(tmp_path: Path) -> None:
    """Nor does what was asked for before it: all commands in one process, each named by what it adds."""
    words = [sys.executable, "-W", "error", "-c", SCRIPT, COMMANDS]
    done = subprocess.run(words, capture_output=True, text=True, check=False, cwd=tmp_path)
    asked = COMMANDS.replace("\n", "|").strip("|").split("|")
    assert done.stdout.splitlines() == [f"{command}: 2" for command in asked], done.stderr
    assert len(done.stderr.splitlines()) == len(asked)


def test_a_kernel_is_what_it_was_before_and_after_numba_is_loaded(tmp_path: Path) -> None:
    """Called from Python, from another package's kernel, from threads, pickled: all before the first call."""
    (tmp_path / "theirs.py").write_text(
        "import numba\n"
        "from pilotage.kernels.jit import kernel, leading_zeros\n"
        "import numpy as np\n"
        "@kernel\n"
        "def twice(x):\n    return 2 * x\n"
        "@kernel\n"
        "def zeros(x):\n    return leading_zeros(np.uint64(x))\n"
        "@numba.njit\n"
        "def four_times(x):\n    return twice(twice(x))\n"
    )
    script = (
        "import pickle, sys\n"
        "from concurrent.futures import ThreadPoolExecutor\n"
        "import theirs\n"
        "held = theirs.twice\n"
        "assert pickle.loads(pickle.dumps(held)) is held\n"
        "assert theirs.four_times(2) == 8\n"
        "assert theirs.zeros(1) == 63\n"
        "with ThreadPoolExecutor(4) as threads:\n"
        "    assert list(threads.map(held, range(8))) == list(range(0, 16, 2))\n"
        "assert theirs.twice is not held and theirs.twice(3) == held(3) == 6\n"
        "assert held.py_func(4) == 8 and sum(held.stats.cache_misses.values()) == 1\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", script],
        capture_output=True,
        text=True,
        check=False,
        cwd=tmp_path,
        env=_environment(tmp_path),
    )
    assert (done.returncode, done.stderr) == (0, "")


def _environment(cache: Path) -> dict[str, str]:
    path = os.pathsep.join([str(cache), *sys.path])
    return os.environ | {"PYTHONPATH": path, "PILOTAGE_CACHE_DIR": str(cache)}


def test_a_kernels_name_and_words_are_its_functions() -> None:
    @kernel
    def doubled(x: float) -> float:
        """Twice."""
        return 2.0 * x

    assert (doubled.__name__, doubled.__doc__) == ("doubled", "Twice.")
