"""Damaged inputs for every reader and every command: refused in one line, quickly, with nothing left behind.

A short part of what ``make fuzz`` does in ten minutes; the draws are the same at every run.
"""

from __future__ import annotations

import os
import random
import resource
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from support import damage
from support.fuzz_targets import BY_NAME, OPTIONS, QUICK, TARGETS, Target
from support.fuzzing import Healthy, damaged_case, renamed
from support.outcome import run

NAMES = [target.name for target in TARGETS]
DRAWS = 6
SHARES, OF_WORDS = 4, 3
"""Of the corpus a use gets one in so many, and a place for a word of the words."""
RIGHT = {("calibrate range", "a thousand columns"), ("study on", "nothing")}
"""What is no damage: columns with their unit are what a range log is, a study without rows has to begin."""
LIMIT_MB = 4000
"""Address space of a process: what Python, NumPy and LLVM reserve is two thirds of it."""


@pytest.fixture(scope="module")
def healthy(tmp_path_factory: pytest.TempPathFactory) -> Healthy:
    return Healthy(tmp_path_factory.mktemp("healthy"))


@pytest.mark.parametrize("name", NAMES)
def test_healthy_inputs_do_what_they_should_whatever_their_names(
    name: str, healthy: Healthy, tmp_path: Path
) -> None:
    """Else the damage is never reached; no name reaches the terminal or breaks what is written."""
    target = BY_NAME[name]
    folder = healthy.copy(target, tmp_path / "case")
    words = renamed(target, folder, damage.MARKS[NAMES.index(name) % len(damage.MARKS)])
    outcome = run(words, folder)
    assert not outcome.faults(), words
    if "expected a name without control characters" in outcome.err:  # a course's mission has its file's
        outcome = run(target.words, healthy.copy(target, tmp_path / "case"))
        assert not outcome.faults()
    assert outcome.code in ((0, 1) if name.startswith("run") else (0,)), outcome.err


@pytest.mark.parametrize("name", NAMES)
def test_what_is_something_else_is_refused(name: str, healthy: Healthy, tmp_path: Path) -> None:
    """A share of the corpus for each use of a reader; the shares of all uses together hold all of it.

    Where a command goes on without a file, each of its files is another damaged one at once; the others are
    tried again without the one that it refuses.
    """
    target = BY_NAME[name]
    share = NAMES.index(name)
    cases = [case for i, case in enumerate(damage.CORPUS.items()) if (i + share) % SHARES == 0]
    files = target.files if target.goes_on else (target.files[share % len(target.files)],)
    groups = [dict(zip(files, cases[k:], strict=False)) for k in range(0, len(cases), len(files))]
    while groups:
        group = groups.pop()
        folder = healthy.copy(target, tmp_path / "case")
        for file, (_, content) in group.items():
            damage.put(folder / file, content)
        outcome = run(target.words, folder)
        told = {file: kind for file, (kind, _) in group.items()}
        assert not outcome.faults(), told
        right = len(told) == 1 and (name, *told.values()) in RIGHT
        assert outcome.code in ((0,) if right else (2, *target.goes_on)), told
        if outcome.code == 2 and len(group) > 1:
            refused = [file for file in group if Path(file).name in outcome.err]
            rest = {file: case for file, case in group.items() if file not in refused}
            groups += [rest] if refused else [{file: case} for file, case in group.items()]


@pytest.mark.parametrize("name", NAMES)
@settings(max_examples=DRAWS, suppress_health_check=list(HealthCheck))
@given(seed=st.integers(0, 2**32 - 1))
def test_what_is_damaged_breaks_nothing(
    name: str, healthy: Healthy, tmp_path_factory: pytest.TempPathFactory, seed: int
) -> None:
    target = BY_NAME[name]
    folder = tmp_path_factory.getbasetemp() / "drawn"
    what = damaged_case(target, healthy, folder, random.Random(seed))
    outcome = run(target.words, folder)
    assert not outcome.faults(), f"seed {seed}: {what}"


@pytest.mark.parametrize("words", OPTIONS, ids=lambda words: " ".join(words)[:40])
def test_no_word_on_the_command_line_breaks_anything(
    words: tuple[str, ...], healthy: Healthy, tmp_path: Path
) -> None:
    target = next(target for target in TARGETS if target.name == "run floor")
    for i, value in enumerate([*damage.NUMBERS, *damage.WORDS]):
        if i % OF_WORDS != len(" ".join(words)) % OF_WORDS or "\0" in value:
            continue
        folder = healthy.copy(target, tmp_path / "case")
        outcome = run([word.replace("VALUE", value) for word in words], folder)
        assert not outcome.faults(), (words, value[:40])


def test_a_folder_whose_name_is_no_text(healthy: Healthy, tmp_path: Path) -> None:
    target = BY_NAME["run floor"]
    folder = healthy.copy(target, tmp_path / os.fsdecode(b"\xff\xfe"))
    for out in (os.fsdecode(b"out-\xff"), "out-\x1b[31m", "out-\u202e"):
        outcome = run(["run", "mission.yaml", *QUICK, "--out", out], folder)
        assert not outcome.faults()
        assert outcome.code in (0, 1)
        assert (folder / out).is_dir()


@pytest.mark.parametrize("kind", ["an alias bomb", "gzip of much", "a huge number", "a long word"])
def test_little_memory_is_enough_to_refuse(kind: str, healthy: Healthy, tmp_path: Path) -> None:
    """In a process that may take no more than so much address space."""
    name = "evaluate tum" if kind.startswith("gzip") else "run floor"
    target: Target = BY_NAME[name]
    folder = healthy.copy(target, tmp_path / "case")
    (folder / target.files[0]).write_bytes(damage.WHOLE[kind])

    def limited() -> None:
        resource.setrlimit(resource.RLIMIT_AS, (LIMIT_MB * 1_000_000, LIMIT_MB * 1_000_000))

    done = subprocess.run(
        [sys.executable, "-m", "pilotage", *target.words],
        cwd=folder,
        capture_output=True,
        text=True,
        check=False,
        preexec_fn=limited,
        env=os.environ | {"PYTHONPATH": os.pathsep.join(sys.path), "OPENBLAS_NUM_THREADS": "1"},
    )
    assert done.returncode == 2, done.stderr
    assert done.stderr.count("\n") == 1
    assert not (folder / "out").exists()
    shutil.rmtree(folder)
