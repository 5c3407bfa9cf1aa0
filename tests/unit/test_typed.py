"""``mypy --strict`` on a user's file outside the repository sees the types of the public face."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

pytest.importorskip("mypy", reason="needs the extra 'dev'")
ROOT = Path(__file__).parents[2]
RIGHT = """
import numpy as np
import pilotage as pl

mission = pl.load("museum-1", seed=7, set={"stack.localizer.gate": 0.99})
run = pl.run(mission)
error_m: float = run.metrics["position_rmse_m"]
run.report("night.html")
again: pl.Run = pl.open_run(run.folder)
sim = pl.make(mission)
readings = sim.reset()
readings = sim.step(pl.Twist(0.5, 0.1))
path = pl.plan("map.yaml", (0.0, 0.0, 0.0), (1.0, 1.0)).path
found = pl.localize("drive.bag", map="map.yaml", start=np.zeros(3))
gain = pl.calibrate("commands", ["drive.bag"]).answer["speed_gain"]
"""
WRONG = {
    'pl.load("museum-1", seed="seven")': "arg-type",
    "pl.Twist(0.5)": "call-arg",
    'pl.run(mission).metrics["position_rmse_m"].upper()': "attr-defined",
    "pl.no_such_name": "attr-defined",
}


CONFIG = f"""
[mypy]
strict = True
plugins = pydantic.mypy
mypy_path = {ROOT / "src"}
[mypy-pilotage.*]
follow_imports = silent
[mypy-numba.*,pyarrow.*]
ignore_missing_imports = True
[mypy-scipy.*,matplotlib.*,rich.*,typer.*,PIL.*,pandas.*,distributed.*,rosbags.*,yaml.*]
follow_imports = skip
follow_imports_for_stubs = True
"""
"""As where pilotage is installed: its signatures are read, the bodies of its functions are not checked.

What stands in no signature of the lines below is not read at all.
"""


def test_a_strict_user_is_told_what_is_wrong_and_nothing_else(tmp_path: Path) -> None:
    file = tmp_path / "mine.py"
    file.write_text(RIGHT + "".join(f"{line}\n" for line in WRONG))
    (tmp_path / "mypy.ini").write_text(CONFIG)
    # What it read of NumPy and of pilotage it needs not read again at the next run, as for any user.
    cache = ROOT / ".pytest_cache" / "mypy"
    words = ("--config-file", "mypy.ini", "--cache-dir", str(cache), "--no-error-summary", str(file))
    done = subprocess.run(
        [sys.executable, "-m", "mypy", *words],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 1, done.stdout + done.stderr
    first = RIGHT.count("\n") + 1
    told = [line.split(": ", 2) for line in done.stdout.splitlines() if "error:" in line]
    places = {
        int(line.split(":")[1]): line.rsplit("[", 1)[1].rstrip("]")
        for line in done.stdout.splitlines()
        if "error:" in line
    }
    assert places == {first + k: code for k, code in enumerate(WRONG.values())}, done.stdout
    assert told
