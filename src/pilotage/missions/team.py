"""A team: how many robots of one description, where they begin, how they share out a task and talk."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any, Literal

from pydantic import Field, model_validator

from pilotage.core.config import Config
from pilotage.missions.choice import ComponentChoice, by_default
from pilotage.missions.places import Point, PoseConfig
from pilotage.sensors.sensor import NonNegative, Positive

LARGEST_TEAM = 16
RADIO = "radio"
"""What a team's radio is called among a robot's sensors."""


class Failure(Config):
    """Something of a robot breaks: it stops for good and says nothing, or its radio alone."""

    robot: int = Field(ge=0)
    at_s: NonNegative
    kind: Literal["stop", "radio"] = "stop"
    for_s: Positive | None = None
    """Mended after so long; None: never."""


class BatteryConfig(Config):
    """How far a robot drives on a full battery, and how long it stands at its station to fill it."""

    range_m: Positive
    charge_s: Positive
    reserve_m: NonNegative = 10.0
    """It sets out for its station while the range suffices for so much more: for who is in the way there."""


class TeamConfig(Config):
    """With ``size``, so many robots as ``robot`` describes; else ``robots`` lists them.

    Without ``starts`` their starting places are drawn from the run's seed.
    """

    size: int | None = Field(default=None, ge=1, le=LARGEST_TEAM)
    strategy: ComponentChoice | None = None
    """Who goes where next; None: the task needs none."""
    radio: Annotated[ComponentChoice, by_default(RADIO)] | None = None
    """Of every robot that has none of its own; None: they cannot talk."""
    starts: tuple[PoseConfig, ...] = ()
    spacing_m: Positive = 1.5
    """At least so far apart are starting places that are drawn, middle to middle; wide bodies farther."""

    failures: tuple[Failure, ...] = ()
    battery: BatteryConfig | None = None
    """Of every robot; None: they drive for ever."""
    stations: tuple[Point, ...] = ()
    """Where each robot charges, in their order; none: where each begins."""

    @model_validator(mode="after")
    def _stations_for_batteries(self) -> TeamConfig:
        if self.stations and self.battery is None:
            raise ValueError("stations: expected team.battery beside them, found none")
        return self

    @model_validator(mode="after")
    def _a_place_for_each(self) -> TeamConfig:
        if self.size is not None and self.starts and self.size > len(self.starts):
            places = len(self.starts)
            robots = f"{places} robots, one for each of" if places > 1 else "1 robot, for the one place of"
            raise ValueError(f"size: expected at most {robots} team.starts, found {self.size}")
        return self


def with_team(values: dict[str, Any]) -> dict[str, Any]:
    """A mission's values with its team written out: entries of ``robots`` and the radio of each.

    Where the team cannot be read it is left as it is, for its own check to say why.
    """
    team = values.get("team")
    if not isinstance(team, Mapping):
        return values
    size, robots, starts = team.get("size"), values.get("robots"), team.get("starts") or ()
    if not isinstance(starts, list | tuple) or not all(isinstance(start, Mapping) for start in starts):
        return values
    count = int(size) if isinstance(size, float) and size.is_integer() else size  # as the field reads it
    if isinstance(count, int) and not isinstance(count, bool) and 1 <= count <= LARGEST_TEAM and not robots:
        placed = [{"start": start} for start in starts[:count]]
        robots = placed + [{} for _ in range(count - len(placed))]
        values = {**values, "robots": robots}
    radio = team.get("radio")
    named = radio.get("name", RADIO) if isinstance(radio, Mapping) else radio
    if isinstance(named, str) and isinstance(robots, list | tuple):
        entries = [_with_radio(entry, values.get("robot"), radio) for entry in robots]
        values = {**values, "robots": entries}
    return values


def _with_radio(entry: Any, common: Any, radio: Any) -> Any:
    """An entry of ``robots`` with the team's radio, unless it or the common robot has one."""
    if not isinstance(entry, Mapping):
        return entry
    sensors = entry.get("sensors") or {}
    shared = common.get("sensors") if isinstance(common, Mapping) else None
    if (
        not isinstance(sensors, Mapping)
        or RADIO in sensors
        or (isinstance(shared, Mapping) and RADIO in shared)
    ):
        return entry
    chosen = {"name": RADIO, **radio} if isinstance(radio, Mapping) else {"name": radio}
    return {**entry, "sensors": {**sensors, RADIO: chosen}}
