"""A command that runs for ever, and one that begins anew whenever it was ended: for signals at any moment."""

from __future__ import annotations

import sys
from typing import Any

import pilotage.experiments.run as lab
from pilotage.cli.main import main

SHORT = ["run", "museum-1", "--set", "run.time_limit_s=3", "--quiet"]


def endless(for_good: bool) -> int:
    """Run until a signal ends it; the first run is over where it says that it is ready."""
    once, warm = lab.run_mission, list[Any]()

    def again_and_again(mission: Any, **_: Any) -> Any:
        if not warm:
            warm.append(once(mission, save=False))
        print("ready", flush=True)  # noqa: T201 - to who sends the signal
        while True:
            once(mission, save=False)

    lab.run_mission = again_and_again
    if for_good:
        sys.argv[1:] = SHORT
        return main()
    while True:
        print(main(SHORT), flush=True)  # noqa: T201
