"""What a worker has done by its first trial, done at once: the server of ``warm_workers`` imports this."""

from __future__ import annotations

from pilotage.experiments.mission import load_mission
from pilotage.experiments.run import run_mission
from pilotage.experiments.studies import local_workers

__all__ = ["local_workers"]

run_mission(load_mission("museum-plan", ["stack.planner.iterations=100"]), save=False)
