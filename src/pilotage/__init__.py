"""pilotage: the open navigation lab for mobile robots.

Everything public is listed in ``__all__`` and loaded when it is first asked for; the rest may change.

Examples
--------
>>> import pilotage as pl
>>> run = pl.run("museum-route", seed=4, save=False)
>>> run.success
True
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

from pilotage.bridges.gym_import import register_with_gymnasium as _register_with_gymnasium
from pilotage.core.version import __version__ as __version__

if TYPE_CHECKING:
    from pilotage.bridges.export import export as export
    from pilotage.core.errors import InputError as InputError
    from pilotage.core.types import Pose2 as Pose2
    from pilotage.core.types import Twist as Twist
    from pilotage.core.types import WheelSpeeds as WheelSpeeds
    from pilotage.face import filters as filters
    from pilotage.face import lines as lines
    from pilotage.face import planners as planners
    from pilotage.face.calibrating import calibrate as calibrate
    from pilotage.face.evaluating import evaluate as evaluate
    from pilotage.face.localizing import localize as localize
    from pilotage.face.mapping import slam as slam
    from pilotage.face.maps import draw as draw
    from pilotage.face.maps import vectorize as vectorize
    from pilotage.face.missions import load as load
    from pilotage.face.planning import Plan as Plan
    from pilotage.face.planning import plan as plan
    from pilotage.face.runs import Run as Run
    from pilotage.face.runs import open_run as open_run
    from pilotage.face.runs import run as run
    from pilotage.face.stepping import Simulation as Simulation
    from pilotage.face.stepping import make as make
    from pilotage.face.studies import Study as Study
    from pilotage.face.studies import study as study
    from pilotage.face.tracking import track as track
    from pilotage.missions.mission import Mission as Mission

_PLACES = {
    "load": "face.missions",
    "run": "face.runs",
    "open_run": "face.runs",
    "make": "face.stepping",
    "plan": "face.planning",
    "study": "face.studies",
    "draw": "face.maps",
    "vectorize": "face.maps",
    "localize": "face.localizing",
    "slam": "face.mapping",
    "calibrate": "face.calibrating",
    "evaluate": "face.evaluating",
    "export": "bridges.export",
    "track": "face.tracking",
    "Mission": "missions.mission",
    "Run": "face.runs",
    "Simulation": "face.stepping",
    "Plan": "face.planning",
    "Study": "face.studies",
    "Twist": "core.types",
    "WheelSpeeds": "core.types",
    "Pose2": "core.types",
    "InputError": "core.errors",
}
"""Where each public name lives."""
_ROOMS = ("filters", "planners", "lines")
"""Public modules: what works on one's own arrays."""

__all__ = [
    "InputError",
    "Mission",
    "Plan",
    "Pose2",
    "Run",
    "Simulation",
    "Study",
    "Twist",
    "WheelSpeeds",
    "calibrate",
    "draw",
    "evaluate",
    "export",
    "filters",
    "lines",
    "load",
    "localize",
    "make",
    "open_run",
    "plan",
    "planners",
    "run",
    "slam",
    "study",
    "track",
    "vectorize",
]


if not TYPE_CHECKING:  # a checker that saw this would take any name for a right one

    def __getattr__(name: str) -> Any:
        if name in _ROOMS:
            found: Any = importlib.import_module(f"pilotage.face.{name}")
        elif name in _PLACES:
            found = getattr(importlib.import_module(f"pilotage.{_PLACES[name]}"), name)
        else:
            raise AttributeError(f"module 'pilotage' has no attribute '{name}'")
        globals()[name] = found
        return found


def __dir__() -> list[str]:
    return sorted([*globals(), *__all__])


_register_with_gymnasium()
