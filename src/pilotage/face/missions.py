"""Missions: loaded by name, from a file or from plain values."""

from __future__ import annotations

from collections.abc import Mapping
from os import PathLike
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np

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
    return mission_of(values_of(source), (), _seed(seed), _plain(set or {}))


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
        return extended({str(key): value for key, value in _plain(source).items()}, "mission")
    if isinstance(source, PathLike):
        path = Path(source)
        return read_mission(str(path) if path.suffix else f"{path.parent}/{path.name}")
    if isinstance(source, str):
        return read_mission(source)
    raise InputError(
        f"mission: expected a name, a file, a mapping or a mission, found a {type(source).__name__}"
    )


def as_mission(source: MissionLike, seed: int | None = None) -> Mission:
    """The mission itself, or what is loaded by that name."""
    return source if isinstance(source, Mission) and seed is None else load(source, seed=seed)


def _seed(seed: int | None) -> int | None:
    if seed is None:
        return None
    if isinstance(seed, bool) or not isinstance(seed, int | np.integer):
        raise InputError(f"seed: expected a whole number >= 0, found {seed!r}")
    return int(seed)


def _plain(values: Mapping[str, Any]) -> dict[str, Any]:
    """The same with numpy's numbers and arrays, tuples and paths as YAML would have them."""
    if not isinstance(values, Mapping):
        raise InputError(f"set: expected a mapping of keys to values, found a {type(values).__name__}")
    return {key: _plain_value(value) for key, value in values.items()}


def _plain_value(value: Any) -> Any:
    if isinstance(value, Mapping):
        return _plain(value)
    if isinstance(value, list | tuple):
        return [_plain_value(item) for item in value]
    if isinstance(value, np.ndarray | np.generic):
        return value.tolist()
    return str(value) if isinstance(value, PathLike) else value
