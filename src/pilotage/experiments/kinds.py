"""The kinds of missions there are, by name; what each of them offers stands in ``mission_kind``.

A kind is loaded when a mission asks for it: the rover's terrain costs a museum run nothing.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from pilotage.core.errors import InputError, unknown_name
from pilotage.experiments.mission_kind import Kind
from pilotage.missions.mission import DEFAULT_KIND, Mission


def _floor() -> Kind:
    from pilotage.experiments.floor.kind import FLOOR

    return FLOOR


def _sheet() -> Kind:
    from pilotage.experiments.sheet.kind import SHEET

    return SHEET


def _terrain() -> Kind:
    from pilotage.experiments.terrain.kind import TERRAIN

    return TERRAIN


KINDS: dict[str, Callable[[], Kind]] = {
    "floor": _floor,
    "sheet": _sheet,
    "terrain": _terrain,
}
"""Each kind's loader by the ``world.kind`` of its missions."""


def kind_name(values: Mapping[str, Any]) -> str:
    """The kind that a mission's values name.

    Raises
    ------
    InputError
        If there is no such kind.
    """
    world = values.get("world")
    name = world.get("kind", DEFAULT_KIND) if isinstance(world, Mapping) else DEFAULT_KIND
    if not isinstance(name, str):
        raise InputError(f"world.kind: expected one of {', '.join(KINDS)}, found {name}")
    if name not in KINDS:
        raise unknown_name("world.kind", name, KINDS)
    return name


def kind_of(mission: Mission) -> Kind:
    """The kind of a validated mission."""
    for load in KINDS.values():
        kind = load()
        if isinstance(mission, kind.schema):
            return kind
    raise TypeError(f"expected a mission of a kind in {', '.join(KINDS)}, found {type(mission).__name__}")


def check_oracles(kind: Kind, mission: Mission) -> None:
    """Refuse an oracle that the mission has no place for.

    Raises
    ------
    InputError
        With those that it has.
    """
    known = kind.oracles(mission)
    for name in mission.run.oracles:
        if name not in known:
            offered = f"one of {', '.join(known)}" if known else "none"
            raise InputError(
                f"run.oracles: expected {offered} in the mission '{mission.mission}', found '{name}'"
            )
