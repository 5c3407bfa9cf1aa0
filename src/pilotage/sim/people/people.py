"""The role: people who follow one plan, whatever it is; and the registry of plans."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from pilotage.core.checked import Gives, keeps
from pilotage.core.misfit import kept, unfit_array
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


def _unfit_kept(people: People) -> str:
    radius_m = kept(people, "radius_m")
    wrong = unfit_array(radius_m, None) or ("" if (radius_m > 0.0).all() else f"{radius_m}")
    return f"radius_m {wrong}" if wrong else ""


def _unfit(given: object, people: People, *_: object) -> str:
    wrong = unfit_array(given, 2, untold=True) or _unfit_kept(people)
    if wrong or not isinstance(given, np.ndarray):
        return wrong
    count = len(people.radius_m)
    return "" if len(given) == count else f"an array {given.shape} of {count} people"


PEOPLE: Registry[People] = Registry(
    "people",
    "pilotage.sim.people",
    gives=(
        keeps("radius_m (K,) of numbers above 0", _unfit_kept),
        Gives("step", "places (K, 2) of numbers, NaN for who is not there", _unfit),
    ),
)
"""Plans by name, as ``world.people`` lists them."""
