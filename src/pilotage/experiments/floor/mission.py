"""Loading a mission that must be one on a floor."""

from __future__ import annotations

from collections.abc import Sequence

from pilotage.core.errors import InputError
from pilotage.experiments.mission import load_mission
from pilotage.missions.floor import FloorMission


def load_floor_mission(
    name_or_path: str, overrides: Sequence[str] = (), seed: int | None = None
) -> FloorMission:
    """Load a mission as ``load_mission`` does.

    Raises
    ------
    InputError
        Also where the mission is not one on a floor.
    """
    mission = load_mission(name_or_path, overrides, seed)
    if not isinstance(mission, FloorMission):
        raise InputError(f"mission '{name_or_path}': expected a mission on a floor (world.kind: floor)")
    return mission
