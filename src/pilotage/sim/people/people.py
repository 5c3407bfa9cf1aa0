"""The role: people who follow one plan, whatever it is; and the registry of plans."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from pilotage.core.registry import Registry
from pilotage.core.types import FloatArray
from pilotage.sim.worlds.world import World


@dataclass(frozen=True, slots=True, eq=False)
class PeopleSetting:
    """What a plan is built in.

    Attributes
    ----------
    world
        The layers that stand still.
    robots_m
        (R, 4) x, y, heading and radius of the robots at the start.
    stopping
        (R, 2) delay (s) and braking (m/s^2) by the robots' data sheets.
    rng
        This plan's own.
    where
        Its place in the mission, for messages.
    """

    world: World
    robots_m: FloatArray
    stopping: FloatArray
    dt_s: float
    rng: np.random.Generator
    where: str


@dataclass(frozen=True, slots=True, eq=False)
class Around:
    """Whom people see when they take a step; arrays to be read only.

    Attributes
    ----------
    robots_m
        (R, 4) true x, y, heading and radius.
    people_m
        (P, 3) x, y and radius of the people of all plans; NaN where somebody is not there.
    first
        Row of one's own first person in ``people_m``.
    """

    robots_m: FloatArray
    people_m: FloatArray
    first: int


class People(Protocol):
    """Discs that follow one plan, built as ``cls(config, setting)``.

    Attributes
    ----------
    radius_m
        (K,) of each; a plan has as many people at the end as at the start.
    """

    radius_m: FloatArray

    def step(self, t_s: float, around: Around) -> FloatArray:
        """Where they are at a time (K, 2); NaN for who is not there.

        First called with the start, then a step on each time; between two steps they walk straight.
        """
        ...


PEOPLE: Registry[People] = Registry("people", "pilotage.sim.people")
"""Plans by name, as ``world.people`` lists them."""
