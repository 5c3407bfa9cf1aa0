"""Studies: throughput of two workers against one, overhead a trial, twenty kills.

``python -m benchmarks.studies`` prints the table; the study is 200 short missions.
"""

from __future__ import annotations

import json
import os
import random
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

from pilotage.core.config import validate
from pilotage.experiments.studies.database import DATABASE
from pilotage.experiments.studies.definition import StudyDefinition
from pilotage.experiments.studies.engine import run_study
from pilotage.experiments.studies.options import StudyOptions
from pilotage.experiments.studies.rows import read_rows
from pilotage.experiments.studies.study import Study, make_study
from pilotage.experiments.studies.trial import Task, TrialRunner

TRIALS = 100
KILLS = 20


def short_missions(trials: int = TRIALS) -> Study:
    """Two cells of a drive of some seconds."""
    values: dict[str, Any] = {
        "study": "throughput",
        "mission": "museum-route",
        "set": {"run.time_limit_s": 40.0},
        "factors": [{"key": "stack.localizer.gate", "values": [0.99, 0.999]}],
        "trials": trials,
    }
    return make_study(validate(StudyDefinition, values, ""))


def numbers(folder: Path) -> list[tuple[int, str, str]]:
    """The rows, clock times apart."""
    rows, trouble = read_rows(folder / DATABASE)
    assert not trouble
    return [(row["row"], row["status"], json.dumps(row["metrics"], sort_keys=True)) for row in rows]


def in_this_process(study: Study, count: int) -> float:
    """Seconds a trial without any engine."""
    runner = TrialRunner(study.base)
    tasks = [
        Task(row, 0, study.seed(row), study.cells[study.place(row)[0]].overrides) for row in range(count)
    ]
    runner.run(tasks[0])
    runner.run(tasks[1])
    began = time.perf_counter()
    for task in tasks:
        assert not runner.run(task).reason
    return (time.perf_counter() - began) / count


def killed(study: Study, folder: Path, undisturbed: Path, seconds: float) -> bool:
    """Whether a study killed at random moments ends as one that was not."""
    script = (
        "from pathlib import Path\nfrom benchmarks.studies import short_missions\n"
        "from pilotage.experiments.studies.database import DATABASE\n"
        "from pilotage.experiments.studies.engine import run_study\n"
        "from pilotage.experiments.studies.options import StudyOptions\n"
        "if __name__ == '__main__':\n"
        f"    folder = Path({str(folder)!r})\n"
        "    options = StudyOptions(workers=2, resume=(folder / DATABASE).is_file())\n"
        "    run_study(short_missions(), folder, options)\n"
    )
    rng = random.Random(0)
    for _ in range(KILLS):
        process = subprocess.Popen([sys.executable, "-c", script], start_new_session=True)
        time.sleep(rng.uniform(0.3, 2.5 + seconds / KILLS))
        os.killpg(process.pid, signal.SIGKILL)
        process.wait()
    run_study(study, folder, StudyOptions(workers=2, resume=True))
    return numbers(folder) == numbers(undisturbed)


def main() -> None:
    """Print the table."""
    study = short_missions()
    with tempfile.TemporaryDirectory() as place:
        root = Path(place)
        run_study(short_missions(), root / "warm", StudyOptions(workers=2))
        took: dict[int, float] = {}
        for workers in (1, 2, 1, 2):
            folder = root / f"{workers}-{len(took)}-{time.monotonic_ns()}"
            began = time.perf_counter()
            run_study(study, folder, StudyOptions(workers=workers))
            took[workers] = min(took.get(workers, 1e9), time.perf_counter() - began)
        alone = in_this_process(study, 40)
        few = short_missions(10)
        began = time.perf_counter()
        run_study(few, root / "few", StudyOptions(workers=1))
        start = time.perf_counter() - began
        each = (took[1] - start) / (study.rows - few.rows)
        overhead = each - alone
        print(f"one worker: {took[1]:.1f} s, two: {took[2]:.1f} s, ratio {took[1] / took[2]:.2f} (bar 1.8)")
        print(
            f"a trial alone: {1e3 * alone:.1f} ms; in the study {1e3 * each:.1f} ms: overhead "
            f"{1e3 * overhead:.1f} ms (bar 5), beside the start of a worker"
        )
        same = killed(study, root / "killed", root / "warm", took[2])
        print(f"killed {KILLS} times and resumed: {'all rows equal' if same else 'ROWS DIFFER'}")


if __name__ == "__main__":
    main()
