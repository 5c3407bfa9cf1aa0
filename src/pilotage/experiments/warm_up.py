"""Compiling before timing: the first call of a kernel compiles it or loads it from the cache."""

from __future__ import annotations

from collections.abc import Callable

from pilotage.missions.schema import ComponentChoice, Mission

STEPS = 3
_WARM: set[tuple[str, ...]] = set()


def warm_up(mission: Mission, simulate: Callable[[Mission], object]) -> None:
    """Take the first steps of a mission once, so that its times are not those of a compiler.

    Done once a process for each set of components. What the mission's later course alone needs (a replan
    around an obstacle, say) may still be compiled on the way.
    """
    key = _components(mission)
    if key in _WARM:
        return
    short = mission.run.model_copy(update={"time_limit_s": STEPS * mission.run.dt_s})
    simulate(mission.model_copy(update={"run": short}))
    _WARM.add(key)


def _components(mission: Mission) -> tuple[str, ...]:
    """Names of everything that a mission is made of."""
    roles = dict(mission.stack)
    chosen = [
        f"{role}={choice.name}" for role, choice in roles.items() if isinstance(choice, ComponentChoice)
    ]
    sensors = [f"{name}={choice.name}" for name, choice in mission.robot.sensors.items()]
    return tuple(sorted([*chosen, *sensors]))
