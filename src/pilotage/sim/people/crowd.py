"""All the people of a world, and what the robots' meetings with them come to."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from pilotage.core.types import FloatArray, IntArray
from pilotage.kernels.people import encounters
from pilotage.models.footprint import Footprint
from pilotage.sim.people.people import Around, People
from pilotage.sim.worlds.traffic import Traffic


@dataclass(frozen=True, slots=True)
class Encounters:
    """How one robot got on with people.

    Attributes
    ----------
    collisions, touches
        How often it drove into somebody, and how often somebody walked into it.
    closest_m
        Least distance from its edge to theirs, swept over the steps; inf where nobody was ever there.
    near_share
        Share of the time in which somebody was within ``encounters.NEAR_M`` of it.
    """

    collisions: int
    touches: int
    closest_m: float
    near_share: float


class Crowd:
    """Moves the people of all plans and counts whom robots touch.

    Parameters
    ----------
    plans
        In the mission's order.
    states
        (R, drive.STATE_SIZE) of the robots' bodies, which the simulator keeps up to date.
    plan_names
        What the people of each plan are called; ``person`` where none are given.

    Attributes
    ----------
    names
        Of everybody, in order: the plan's name, numbered from 1 where several are called so.
    """

    def __init__(
        self,
        plans: Sequence[People],
        footprints: Sequence[Footprint],
        states: FloatArray,
        dt_s: float,
        plan_names: Sequence[str] = (),
    ) -> None:
        self._plans, self._states, self._dt_s = tuple(plans), states, dt_s
        self.radius_m: FloatArray = np.concatenate([np.zeros(0), *(plan.radius_m for plan in plans)])
        self._first = np.cumsum([0, *(len(plan.radius_m) for plan in plans)])
        called = plan_names or ["person"] * len(plans)
        self.names = _names([n for n, plan in zip(called, plans, strict=True) for _ in plan.radius_m])
        count, robots = len(self.radius_m), len(footprints)
        self.places_m: FloatArray = np.full((count, 2), np.nan)
        self._before, self._robots_before = self.places_m.copy(), states[:, :3].copy()
        self._corners = np.concatenate([*(shape.points_m for shape in footprints), np.zeros((0, 2))])
        self._corner_of: IntArray = np.cumsum([0, *(len(shape.points_m) for shape in footprints)])
        self._radii = np.array([shape.radius_m for shape in footprints])
        self._between: IntArray = np.zeros((robots, count), dtype=np.int64)
        self._tally = np.zeros((robots, encounters.TALLY_SIZE))
        self._tally[:, encounters.CLOSEST] = np.inf

    def walk_to(self, t_s: float, traffic: Traffic) -> None:
        """Move everybody on to a time; the robots are still where they were."""
        self._robots_before[:] = self._states[:, :3]
        self._before[:] = self.places_m
        robots = np.column_stack([self._states[:, :3], self._radii])
        seen = np.column_stack([self._before, self.radius_m])
        for plan, first in zip(self._plans, self._first[:-1].tolist(), strict=True):
            places = plan.step(t_s, Around(robots, seen, first))
            self.places_m[first : first + len(plan.radius_m)] = places
        # Who walks into a robot goes through it: it is not held by those whom it did not drive into.
        traffic.put_people(
            encounters.solid_people(
                self._states,
                self._corners,
                self._corner_of,
                self._radii,
                self.places_m,
                self.radius_m,
                self._between,
            )
        )

    def arrive(self, traffic: Traffic) -> None:
        """Put everybody where they are, now that the robots have moved as well: for all that is seen."""
        traffic.put_people(self.places_m)

    def meet(self) -> None:
        """Count who touched whom, now that the robots have moved as well."""
        encounters.meet_people(
            self._robots_before,
            self._states,
            self._corners,
            self._corner_of,
            self._radii,
            self._before,
            self.places_m,
            self.radius_m,
            self._dt_s,
            self._between,
            self._tally,
        )

    def driven_into(self, robot: int) -> tuple[str, ...]:
        """Whom a robot drove into and is not yet apart from, by name."""
        return tuple(self.names[k] for k in np.flatnonzero(self._between[robot] == encounters.HIT))

    def encounters(self, robot: int) -> Encounters:
        """What a robot's meetings came to so far."""
        row = self._tally[robot]
        return Encounters(
            int(row[encounters.CAUSED]),
            int(row[encounters.SUFFERED]),
            float(row[encounters.CLOSEST]),
            float(row[encounters.NEAR] / max(row[encounters.STEPS], 1.0)),
        )


def _names(called: Sequence[str]) -> tuple[str, ...]:
    """Each with a number of its own, but who alone is called so."""
    so_far: Counter[str] = Counter()
    names = []
    for name in called:
        so_far[name] += 1
        names.append(name if called.count(name) == 1 else f"{name} {so_far[name]}")
    return tuple(names)
