# ruff: noqa: T201 - a command of its own, it prints
"""The long run of ``make fuzz``: damaged inputs over all commands, SIGKILLs, and readers guided by coverage.

What breaks something is kept in ``fuzz-found/`` with its seed and words; ``--again FOLDER`` tries it once
more. A quarter of the time goes to ``fuzz.guided``, reader by reader, where atheris is installed.
"""

from __future__ import annotations

import argparse
import importlib.util
import json
import os
import random
import shutil
import subprocess
import sys
import tempfile
import time
from collections import Counter
from pathlib import Path

from fuzz.guided import READERS, seed_of
from fuzz.kills import kill_all
from support import damage
from support.fuzz_targets import BY_NAME, FILM_TARGETS, OPTIONS, TARGETS, Target
from support.fuzzing import Healthy, damaged_case
from support.outcome import Outcome, run

# FFmpeg's own words about a damaged film, where it was loaded before pilotage could silence it.
os.environ.setdefault("OPENCV_FFMPEG_LOGLEVEL", "-8")
os.environ.setdefault("OPENCV_LOG_LEVEL", "SILENT")

FOUND = Path("fuzz-found")
GUIDED_SHARE = 0.25
OPTIONS_SHARE = 0.15
SHOWN_OF_A_KIND = 3
KILLS = 15
SLOWEST_S = 10.0
"""Processor time that a case may take here; the tests, which run on machines of any speed, allow more."""


def main() -> int:
    """Fuzz; 1 where anything broke."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--minutes", type=float, default=10.0)
    parser.add_argument("--cases", type=int, default=None, help="no more than so many")
    parser.add_argument("--seed", type=int, default=None, help="else by the clock")
    parser.add_argument("--only", default="", help="uses whose name holds this")
    parser.add_argument("--again", type=Path, help="a folder of fuzz-found")
    asked = parser.parse_args()
    if asked.again is not None:
        return again(asked.again)
    seed = int(time.time()) if asked.seed is None else asked.seed
    guided = importlib.util.find_spec("atheris") is not None and not (asked.only or asked.cases)
    lasts_s = 60.0 * asked.minutes * (1.0 - GUIDED_SHARE if guided else 1.0)
    targets = (*TARGETS, *FILM_TARGETS)
    chosen = [target for target in targets if asked.only in target.name]
    broken = drawn(seed, lasts_s, asked.cases, chosen, not asked.only)
    if not (asked.only or asked.cases):
        cut = kill_all(KILLS, seed)
        print("\n".join([*cut, f"{KILLS} kills, {len(cut)} things not whole"]), flush=True)
        broken += len(cut)
    if guided:
        broken += coverage_guided(60.0 * asked.minutes * GUIDED_SHARE / len(READERS))
    return 1 if broken else 0


def drawn(seed: int, lasts_s: float, most: int | None, targets: list[Target], with_words: bool) -> int:
    """Damaged inputs and words until the time is over; returns how many broke something."""
    codes: Counter[int] = Counter()
    kinds: Counter[str] = Counter()
    number, slowest_s, largest_mb = 0, 0.0, 0.0
    with tempfile.TemporaryDirectory(prefix="pilotage-fuzz-") as place:
        healthy, case = Healthy(Path(place) / "healthy"), Path(place) / "case"
        for target in targets:  # what is compiled or imported once is not the damage's doing
            run(target.words, healthy.copy(target, case))
        # Only now: on a busy machine with an empty cache half an hour went by before the first case.
        end = time.monotonic() + lasts_s
        while time.monotonic() < end and number != most:
            rng = random.Random(f"{seed}-{number}")
            target = targets[number % len(targets)]
            words: tuple[str, ...] = target.words
            if with_words and rng.random() < OPTIONS_SHARE:
                healthy.copy(BY_NAME["run floor"], case)
                value = rng.choice((*damage.NUMBERS, *damage.WORDS))
                words = tuple(word.replace("VALUE", value) for word in rng.choice(OPTIONS))
                what = "words"
            else:
                what = damaged_case(target, healthy, case, rng)
            outcome = run(words, case)
            codes[outcome.code] += 1
            slowest_s, largest_mb = max(slowest_s, outcome.cpu_s), max(largest_mb, outcome.grown_mb)
            slow = [f"{outcome.cpu_s:.0f} s of processor time"] if outcome.cpu_s > SLOWEST_S else []
            for fault in (outcome.faults() + slow)[:1]:
                kind = f"{words[0]}: {fault[-80:]}"
                kinds[kind] += 1
                if kinds[kind] <= SHOWN_OF_A_KIND:
                    print(f"seed {seed}, case {number}, {target.name}, {what}: {fault[:600]}", flush=True)
                    keep(case, f"{seed}-{number}", words, outcome)
            number += 1
    told = ", ".join(f"{count} with {code}" for code, count in sorted(codes.items()))
    worst = f"the slowest took {slowest_s:.1f} s, the largest {largest_mb:.0f} MB"
    print(f"seed {seed}: {number} cases ({told}), {worst}; {sum(kinds.values())} broke something", flush=True)
    return sum(kinds.values())


def keep(case: Path, name: str, words: tuple[str, ...], outcome: Outcome) -> None:
    """Keep a case for another look; what is endless is not copied."""
    folder = FOUND / name
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    for path in case.rglob("*"):
        if path.is_file() and not path.is_symlink() and path.stat().st_size < 100_000_000:
            kept = folder / path.relative_to(case)
            kept.parent.mkdir(parents=True, exist_ok=True)
            shutil.copyfile(path, kept)
    (folder / "words.json").write_text(json.dumps(words))
    (folder / "said.txt").write_text(outcome.err)


def again(folder: Path) -> int:
    """Run a kept case once more."""
    outcome = run(json.loads((folder / "words.json").read_text()), folder)
    print(outcome.err, end="")
    print(f"exit code {outcome.code}; {'; '.join(outcome.faults()) or 'nothing broke'}")
    return 1 if outcome.faults() else 0


def coverage_guided(seconds: float) -> int:
    """Each reader in a process of its own; returns how many crashed."""
    crashed = 0
    FOUND.mkdir(exist_ok=True)
    for reader in READERS:
        seeds = tempfile.mkdtemp(prefix="pilotage-seeds-")
        (Path(seeds) / "healthy").write_bytes(seed_of(reader))
        done = subprocess.run(
            [
                sys.executable,
                "-m",
                "fuzz.guided",
                reader,
                f"-max_total_time={max(1, round(seconds))}",
                "-timeout=30",
                "-rss_limit_mb=2000",
                "-max_len=65536",
                f"-artifact_prefix={FOUND}/{reader}-",
                seeds,
            ],
            capture_output=True,
            text=True,
            check=False,
            env=os.environ | {"PYTHONPATH": os.pathsep.join(sys.path)},
        )
        shutil.rmtree(seeds)
        runs = [line for line in done.stderr.splitlines() if line.startswith("Done ")]
        print(f"{reader}: {runs[-1] if runs else 'crashed'}", flush=True)
        if done.returncode != 0:
            crashed += 1
            print(done.stderr[-1500:], flush=True)
    if not any(FOUND.iterdir()):
        FOUND.rmdir()
    return crashed


if __name__ == "__main__":
    sys.exit(main())
