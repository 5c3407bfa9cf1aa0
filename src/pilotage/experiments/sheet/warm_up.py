"""Compiling before timing, for a run on a sheet."""

from __future__ import annotations

from collections.abc import Callable

from pilotage.kernels.jit import cache_is_cold
from pilotage.missions.sheet import SheetMission

FIRST_LIMIT_S = 120.0
"""Simulated time of the rehearsal on a machine where nothing is compiled yet."""
SHORT_S = 0.2
_WARM: set[str] = set()


def warm_up(mission: SheetMission, simulate: Callable[[SheetMission], object]) -> None:
    """Take the first moments of a mission once a process and explorer."""
    key = mission.stack.explorer.name
    if key in _WARM:
        return
    limit_s = FIRST_LIMIT_S if cache_is_cold() else SHORT_S
    run = mission.run.model_copy(update={"time_limit_s": min(limit_s, mission.run.time_limit_s)})
    simulate(mission.model_copy(update={"run": run}))
    _WARM.add(key)
