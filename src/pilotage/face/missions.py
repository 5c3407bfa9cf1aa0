"""Missions: loaded by name, from a file or from plain values."""

from __future__ import annotations

from collections.abc import Mapping
from os import PathLike
from typing import Any, TypeAlias

from pilotage.core import given
from pilotage.core.errors import InputError
from pilotage.experiments.mission import extended, mission_of, read_mission
from pilotage.experiments.resolve import resolved_values
from pilotage.missions.mission import Mission

MissionLike: TypeAlias = "str | PathLike[str] | Mapping[str, Any] | Mission"
"""A shipped mission's name, a YAML file, plain values, or a mission that was loaded before."""


def load(
    source: MissionLike,
    *,
    seed: int | None = None,
    set: Mapping[str, Any] | None = None,  # noqa: A002 - as the command line and mission files call it
) -> Mission:
    """Load a mission, change what should be different, and check all of it.

    Parameters
    ----------
    source
        A shipped mission's name (``pilotage missions``), a YAML file, a mapping of the same keys, which may
        say ``extends: museum-1``, or a mission that was loaded before.
    seed
        Of every random draw; None leaves the mission's own.
    set
        Values by dotted key. Changing a component's ``name`` drops the parameters of the old one.

    Returns
    -------
    Mission
        Frozen; its fields are the file's: ``world``, ``robot``, ``robots``, ``task``, ``stack``, ``run``.

    Raises
    ------
    InputError
        One line: what was expected, what was found, the nearest right name.

    Examples
    --------
    >>> import pilotage as pl
    >>> mission = pl.load("museum-1", seed=7, set={"stack.localizer.gate": 0.99})
    >>> mission.run.seed, mission.stack.localizer.name
    (7, 'ekf-landmarks')
    >>> pl.load("museum-one")
    Traceback (most recent call last):
        ...
    pilotage.core.errors.InputError: unknown mission 'museum-one'; did you mean 'museum-concave'?
    """
    changes = given.plain("set", given.settings("set", set))
    return mission_of(values_of(source), (), None if seed is None else given.whole("seed", seed), changes)


def values_of(source: MissionLike) -> dict[str, Any]:
    """A mission's plain values, its ``extends`` resolved.

    Raises
    ------
    InputError
        Where there is no such mission, or it is nothing of what is expected.
    """
    if isinstance(source, Mission):
        return resolved_values(source)
    if isinstance(source, Mapping):
        return extended(given.plain("mission", given.settings("mission", source)), "mission")
    if isinstance(source, PathLike):
        path = given.path("mission", source)
        return read_mission(str(path) if path.suffix else f"{path.parent}/{path.name}")
    if isinstance(source, str):
        return read_mission(source)
    raise InputError(
        f"mission: expected a name, a file, a mapping or a mission, found a {type(source).__name__}"
    )


def as_mission(source: MissionLike, seed: int | None = None) -> Mission:
    """The mission itself, or what is loaded by that name."""
    return source if isinstance(source, Mission) and seed is None else load(source, seed=seed)
