"""Compiling before timing: the first call of a kernel compiles it or loads it from the cache."""

from __future__ import annotations

from pilotage.experiments.loop import simulate
from pilotage.kernels.code_cache import cache_is_cold
from pilotage.missions.choice import ComponentChoice
from pilotage.missions.mission import Mission
from pilotage.stack.planning.planner import PLANNERS

STEPS = 3
FIRST_LIMIT_S = 300.0
"""Simulated time of the rehearsal on a machine where nothing is compiled yet."""
_WARM: set[tuple[str, ...]] = set()


def warm_up(mission: Mission) -> None:
    """Take the first steps of a mission once, so that its times are not those of a compiler.

    Done once a process for each set of components. With an empty cache the mission is rehearsed whole:
    what its later course needs (a replan around an obstacle, say) is compiled then too. One whose first plan
    takes long is not rehearsed: its users would wait twice, and its times are those of planning anyway.
    """
    key = _components(mission)
    if key in _WARM or any(_takes_long(mission.stack_of(robot).planner) for robot in mission.members):
        return
    limit_s = FIRST_LIMIT_S if cache_is_cold() else STEPS * mission.run.dt_s
    short = mission.run.model_copy(update={"time_limit_s": min(limit_s, mission.run.time_limit_s)})
    simulate(mission.model_copy(update={"run": short}))
    _WARM.add(key)


def _takes_long(planner: ComponentChoice | None) -> bool:
    return planner is not None and getattr(PLANNERS.entry(planner.name).factory, "TAKES_LONG", False)


def _components(mission: Mission) -> tuple[str, ...]:
    """Names of everything that a mission is made of."""
    chosen = {f"task={mission.task.name}", f"map={type(mission.world.map).__name__}"}
    for robot in mission.members:
        roles = mission.stack_of(robot).roles()
        chosen |= {f"{role}={choice.name}" for role, choice in roles.items()}
        chosen |= {f"sensor={choice.name}" for choice in robot.sensors.values()}
        chosen |= {f"motion={robot.motion.name}", f"footprint={robot.footprint.name}"}
    return tuple(sorted(chosen))
