# ruff: noqa: T201 - a command of its own, it prints
"""Recordings, graphs, worlds and maps drawn from their formats, with their pages: ``python -m fuzz.files``.

Nothing in them is damaged, and much is what nobody expects; each is read, or refused in one line.
"""

from __future__ import annotations

import argparse
import json
import random
import shutil
import sys
import tempfile
import time
from collections import Counter
from pathlib import Path

from support.drawn_files import DRAWS
from support.outcome import Outcome, run

SLOWEST_S = 10.0


def faults(name: str, seed: str, folder: Path) -> tuple[Outcome, list[str]]:
    """Draw one set of files into a new folder and read it; what broke."""
    folder.mkdir()
    outcome = run(words := DRAWS[name](folder, random.Random(seed)), folder)
    found = [fault for fault in outcome.faults() if "['\\xa0']" not in fault]  # before units on a terminal
    if "--json" in words and outcome.code != 2:
        try:
            json.loads(outcome.out, parse_constant=lambda text: found.append(f"{text} in the JSON"))
        except ValueError as error:
            found.append(f"standard output is no JSON: {error}")
    return outcome, found


def main() -> int:
    """Draw in turn until the time is over; 1 where anything broke."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--minutes", type=float, default=10.0)
    parser.add_argument("--seed", type=int, default=None, help="else by the clock")
    parser.add_argument("--only", default="", help="what has this in its name")
    asked = parser.parse_args()
    seed = int(time.time()) if asked.seed is None else asked.seed
    names = [name for name in DRAWS if asked.only in name]
    codes, broke, number = Counter[tuple[str, int]](), Counter[str](), 0
    end = time.monotonic() + 60.0 * asked.minutes
    with tempfile.TemporaryDirectory(prefix="pilotage-files-") as place:
        for name in names:  # what is compiled or imported once
            faults(name, "0", Path(place) / name)
        while time.monotonic() < end:
            name = names[number % len(names)]
            folder = Path(place) / str(number)
            outcome, found = faults(name, f"{seed}-{number}", folder)
            codes[name, outcome.code] += 1
            if outcome.cpu_s > SLOWEST_S:
                found.append(f"{outcome.cpu_s:.0f} s of processor time")
            if found:
                broke[f"{name}: {found[0][-80:]}"] += 1
                if broke[f"{name}: {found[0][-80:]}"] <= 2:
                    print(f"seed {seed}-{number}, {name}: {found[0][-700:]}", flush=True)
            shutil.rmtree(folder)
            number += 1
    for name in names:
        print(
            name,
            ", ".join(f"{count} with {code}" for (of, code), count in sorted(codes.items()) if of == name),
        )
    print(f"seed {seed}: {number} cases; {sum(broke.values())} broke something")
    return 1 if broke else 0


if __name__ == "__main__":
    sys.exit(main())
