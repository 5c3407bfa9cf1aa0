# ruff: noqa: T201 - a command of its own, it prints
"""SIGKILL at random moments: ``python -m fuzz.kills --times 50``; what is there afterwards is whole.

A child repeats one command, each time to a place of its own, and is killed while it is warm: most of the time
it works or writes. Whatever has its final name must be whole then: as many files as a healthy one, of which a
report is written without a word. A study is killed with its workers, goes on with ``--resume`` and is
killed again; every row that was there once is there in the end, as it was.
"""

from __future__ import annotations

import argparse
import contextlib
import itertools
import json
import os
import random
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from pilotage.cli.main import main as main_of_pilotage
from pilotage.core.errors import InputError
from pilotage.experiments.studies.database import DATABASE
from pilotage.experiments.studies.rows import read_rows
from support.fuzz_targets import BY_NAME, QUICK
from support.fuzz_targets.target import write_yaml
from support.outcome import run
from support.warm_commands import start

LONGEST_WAIT_S = 0.4
ROWS = 24


@dataclass(frozen=True)
class Victim:
    """A command that is repeated and killed.

    Attributes
    ----------
    words
        With NUMBER where each repetition has its own.
    made
        What repetitions make, as a pattern in the working folder.
    read
        The words that use one of these, with MADE for its path; none: sizes are compared.
    """

    name: str
    write: Callable[[Path], None]
    words: tuple[str, ...]
    made: str
    read: tuple[str, ...] = ()


VICTIMS = (
    Victim(
        "run",
        BY_NAME["run floor"].write,
        ("run", "mission.yaml", *QUICK, "--seed", "NUMBER"),
        "out/*",
        ("report", "MADE"),
    ),
    Victim(
        "slam",
        BY_NAME["slam carmen"].write,
        ("slam", "lab.log", "--quiet", "--out", "outNUMBER"),
        "out*/*",
        ("evaluate", "MADE/trajectory.tum", "MADE/before.tum"),
    ),
    *(
        Victim(
            f"export {form}",
            BY_NAME["export csv"].write,
            ("export", "run", "--to", form, "--out", f"made-NUMBER{end}"),
            f"made-*{end}",
        )
        for form, end in (("mcap", ".mcap"), ("rosbag", ".bag"), ("tum", ""), ("csv", ".csv"))
    ),
)


def children_of(folder: Path, *arguments: str) -> subprocess.Popen[str]:
    """A process group of its own that runs in ``folder``."""
    return subprocess.Popen(
        [sys.executable, *arguments],
        cwd=folder,
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        text=True,
        start_new_session=True,
        env=os.environ | {"PYTHONPATH": os.pathsep.join(sys.path)},
    )


def end(child: subprocess.Popen[str]) -> None:
    """SIGKILL to it and all that it started."""
    with contextlib.suppress(ProcessLookupError):
        os.killpg(child.pid, signal.SIGKILL)
    child.communicate()


def repeat(words: Sequence[str]) -> int:
    """One command again and again, with the number of each in the place of NUMBER."""
    for k in itertools.count():
        main_of_pilotage([word.replace("NUMBER", str(k)) for word in words])
        print(k, flush=True)
    return 0


def killed(victim: Victim, folder: Path, rng: random.Random) -> list[str]:
    """Kill it once; returns what is not whole."""
    victim.write(folder)
    with tempfile.TemporaryDirectory(prefix="pilotage-killed-") as place:
        child = start(Path(place), repeat, victim.words, folder=folder)
        try:
            child.line(0)  # the first one compiles and imports
            time.sleep(rng.uniform(0.0, LONGEST_WAIT_S))
        finally:
            with contextlib.suppress(ProcessLookupError):
                os.killpg(child.pid, signal.SIGKILL)
            child.ended()
    made = sorted(path for path in folder.glob(victim.made) if not path.name.startswith("."))
    if not made:
        return ["nothing was made"]
    whole = _contents(min(made, key=lambda path: path.stat().st_mtime_ns))
    wrong = []
    for path in made:
        if _contents(path).keys() != whole.keys():
            wrong.append(f"{path.name}: {sorted(_contents(path))} as opposed to {sorted(whole)}")
        if victim.read:
            outcome = run([word.replace("MADE", str(path)) for word in victim.read], folder)
            if outcome.code or outcome.err:
                wrong.append(f"{path.name}: {outcome.code}, {outcome.err[:200]}")
        elif _contents(path) != whole:
            wrong.append(f"{path.name}: {_contents(path)} as opposed to {whole}")
    return wrong


def _contents(path: Path) -> dict[str, int]:
    """Files with their size; a report may or may not be there yet."""
    files = [path] if path.is_file() else [inner for inner in path.rglob("*") if inner.is_file()]
    return {str(file.relative_to(path)): file.stat().st_size for file in files if file.name != "report.html"}


def study_killed(folder: Path, rng: random.Random, times: int) -> list[str]:
    """Kill a study again and again; returns what became of its rows."""
    definition = {
        "study": "killed",
        "mission": "museum-plan",
        "trials": ROWS // 2,
        "set": {"stack.planner.iterations": 100},
        "factors": [{"key": "stack.planner.turning_radius_m", "values": [0.3, 0.5]}],
    }
    write_yaml(folder / "study.yaml", definition)
    known: dict[int, str] = {}
    wrong: list[str] = []
    words = ("-m", "pilotage", "study", "study.yaml", "--workers", "2", "--quiet", "--no-report")
    for k in range(times):
        child = children_of(folder, *words, *(("--resume",) if k else ()))
        begun, wait_s = time.monotonic(), rng.uniform(0.0, 3.0)
        have = len(known)
        # From the next row on, so that every try goes somewhat further and some strike between two rows.
        while child.poll() is None and len(_rows(folder)) <= have and time.monotonic() - begun < 60.0:
            time.sleep(0.02)
        time.sleep(wait_s * rng.random() * 0.1)
        end(child)
        found = _rows(folder)
        wrong += [f"row {row} is not what it was" for row, text in known.items() if found.get(row) != text]
        known |= found
    done = subprocess.run(
        [sys.executable, *words, "--resume"],
        cwd=folder,
        capture_output=True,
        text=True,
        check=False,
        env=os.environ | {"PYTHONPATH": os.pathsep.join(sys.path)},
    )
    found = _rows(folder)
    wrong += [f"row {row} is not what it was" for row, text in known.items() if found.get(row) != text]
    if done.returncode or len(found) != ROWS:
        wrong.append(f"{len(found)} of {ROWS} rows, exit code {done.returncode}: {done.stderr[-300:]}")
    return wrong


def _rows(folder: Path) -> dict[int, str]:
    """Finished rows by their number."""
    study = folder / "studies" / "killed" / DATABASE
    if not study.is_file():
        return {}
    try:
        rows, _ = read_rows(study)
    except InputError:  # its tables are not made yet
        return {}
    return {row["row"]: json.dumps(row["metrics"]) for row in rows if row["status"] == "done"}


def kill_all(times: int, seed: int, victims: Sequence[Victim] = VICTIMS) -> list[str]:
    """So many kills, a third of them of a study; returns what was not whole."""
    rng, wrong = random.Random(seed), []
    of_study = times // 3
    with tempfile.TemporaryDirectory(prefix="pilotage-kills-") as place:
        for k in range(times - of_study):
            victim, folder = victims[k % len(victims)], Path(place) / str(k)
            folder.mkdir()
            found = killed(victim, folder, rng)
            wrong += [f"kill {k}, {victim.name}: {text}" for text in found]
        folder = Path(place) / "study"
        folder.mkdir()
        wrong += [f"study: {text}" for text in study_killed(folder, rng, of_study)]
    return wrong


def main() -> int:
    """Kill; 1 where anything was not whole."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--times", type=int, default=50)
    parser.add_argument("--seed", type=int, default=0)
    asked = parser.parse_args()
    wrong = kill_all(asked.times, asked.seed)
    for text in wrong:
        print(text)
    print(f"seed {asked.seed}: {asked.times} kills, {len(wrong)} things not whole")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
