# ruff: noqa: T201 - a command of its own, it prints
"""Every number of every component at all ends of its range: ``python -m fuzz.ends [ROLE | NAME ...]``.

Each in a process of its own, whose memory and processor time are bounded; prints what broke.
"""

from __future__ import annotations

import json
import os
import resource
import sys
import traceback
import warnings
from collections import Counter
from typing import Any

from contract.examples import EXAMPLES
from pilotage.core.errors import InputError
from pilotage.experiments.roles import ROLES
from support.bounds import PARAMETERS, changed, numbers_of
from support.component_missions import mission_with, short
from support.told import ill_told

STEPS = 20
CPU_S, ADDRESSES_BYTES = 10, 4 << 30
FATTEST_MB = 1000.0


def main() -> int:
    """Drive all; 1 where anything broke."""
    warnings.simplefilter("error")
    counts: Counter[str] = Counter()
    seen: set[str] = set()
    for role, registry in ROLES.items():
        for entry in registry:
            if sys.argv[1:] and not {role, entry.name} & set(sys.argv[1:]):
                continue
            parameters = {**EXAMPLES[role, entry.name].parameters, **PARAMETERS.get((role, entry.name), {})}
            config = registry.configure(entry.name, parameters, role)
            ill_told(short(mission_with(role, entry.name, parameters), STEPS))  # what is compiled once
            for place, whose, ends in numbers_of(config):
                if f"{role} {whose}" in seen:
                    continue
                seen.add(f"{role} {whose}")
                for end in ends:
                    values = changed(config.model_dump(mode="json"), place, end)
                    kind, told = alone(short(mission_with(role, entry.name, values), STEPS))
                    counts[kind] += 1
                    if kind == "broke":
                        print(
                            f"{role} {entry.name}: {'.'.join(map(str, place))} = {end!r}: {told}", flush=True
                        )
    print(", ".join(f"{count} {kind}" for kind, count in counts.items()))
    return 1 if counts["broke"] else 0


def alone(values: dict[str, Any]) -> tuple[str, str]:
    """Run a mission in a process of its own: ended, refused or broke, and what it said."""
    reader, writer = os.pipe()
    child = os.fork()
    if child == 0:
        resource.setrlimit(resource.RLIMIT_AS, (ADDRESSES_BYTES, ADDRESSES_BYTES))
        resource.setrlimit(resource.RLIMIT_CPU, (CPU_S, CPU_S + 1))
        os.write(writer, json.dumps(_tried(values)).encode()[:60_000])
        os._exit(0)
    os.close(writer)
    with os.fdopen(reader, "rb") as pipe:
        said = pipe.read()
    _, status, used = os.wait4(child, 0)
    if not said:
        return "broke", f"ended with {os.waitstatus_to_exitcode(status)} after {used.ru_utime:.0f} s"
    kind, told = json.loads(said)
    if used.ru_maxrss / 1000.0 > FATTEST_MB:
        return "broke", f"{used.ru_maxrss / 1000.0:.0f} MB of memory"
    return kind, told


def _tried(values: dict[str, Any]) -> tuple[str, str]:
    try:
        wrong = ill_told(values)
    except InputError as error:
        return "refused", str(error)
    except Exception as error:
        where = traceback.extract_tb(error.__traceback__)[-1]
        return "broke", f"{type(error).__name__}: {error} ({where.filename}:{where.lineno})"
    return ("broke", f"no numbers: {', '.join(wrong)}") if wrong else ("ended", "")


if __name__ == "__main__":
    sys.exit(main())
