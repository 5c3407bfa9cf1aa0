"""Missions as Gymnasium environments: ``gymnasium.make("pilotage/museum-1-v0")``.

Importing this module registers them, as Gymnasium has it since 1.0: it looks for no entry points any more.
"""

from __future__ import annotations

import contextlib
from importlib import resources

VERSION = "v0"
OWN = f"pilotage/mission-{VERSION}"
"""Of a mission of one's own: ``gymnasium.make("pilotage/mission-v0", mission="mine.yaml")``."""


def register() -> None:
    """Tell Gymnasium of every shipped mission; those without a goal are refused when they are made."""
    import gymnasium

    place, many = "pilotage.bridges.gym_env:MissionEnv", "pilotage.bridges.gym_vector:MissionVectorEnv"
    files = (resources.files("pilotage.missions") / "files").iterdir()
    names = sorted(entry.name.removesuffix(".yaml") for entry in files if entry.name.endswith(".yaml"))
    known = {f"pilotage/{name}-{VERSION}": {"mission": name} for name in names}
    for key, options in {**known, OWN: {}}.items():
        if key not in gymnasium.registry:
            gymnasium.register(id=key, entry_point=place, vector_entry_point=many, kwargs=options)


with contextlib.suppress(ImportError):  # the extra is told of where an environment is made
    register()
