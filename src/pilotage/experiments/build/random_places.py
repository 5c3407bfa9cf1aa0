"""Where a robot begins and where it is to go, as far as a seed says."""

from __future__ import annotations

import numpy as np

from pilotage.core.errors import InputError
from pilotage.core.types import BoolArray
from pilotage.experiments.build.obstacles import Obstacles
from pilotage.experiments.build.open_floor import Apart, OpenFloor
from pilotage.kernels.bodies.outline import least_along
from pilotage.maps.world_map import WorldMap
from pilotage.missions.places import GoalConfig, PoseConfig
from pilotage.missions.world import WorldConfig
from pilotage.models.footprint import Footprint

MAX_DRAWS = 1000
ROOM_M = 0.1
"""Of a place that is drawn, beyond the body."""


class RandomPlaces:
    """Draws places for one robot, again and again on the floor that its passages join.

    Those have ``ROOM_M`` beside its disc. A body that reaches farther than places are asked to be from walls
    has as much room as it stands there.

    Attributes
    ----------
    given
        Where it begins where no start is drawn, else what its floor is connected to; None: the floor that is
        meant.
    goal_like
        Whose tolerances a drawn goal has; a heading is drawn where this one has one.
    """

    def __init__(
        self,
        world: WorldConfig,
        chart: WorldMap,
        obstacles: Obstacles,
        given: PoseConfig | None,
        goal: GoalConfig | None,
        body: Footprint,
    ) -> None:
        self._world, self._chart, self._obstacles = world, chart, obstacles
        self.given, self.goal_like = given, goal or GoalConfig(x_m=0.0, y_m=0.0)
        self._body = body
        self._floors: dict[float, tuple[OpenFloor, BoolArray]] = {}

    def start(self, rng: np.random.Generator, apart_from: Apart = ()) -> PoseConfig:
        """A starting pose; the given one where the world draws none.

        Raises
        ------
        InputError
            Where the floor has none so far from others.
        """
        if self._world.random_start is not None:
            return self._free(self._world.random_start.clearance_m, rng, apart_from)
        assert self.given is not None, "what is not drawn is given"
        return self.given

    def goal(self, rng: np.random.Generator, apart_from: Apart) -> GoalConfig:
        """A goal, where the world draws them.

        Raises
        ------
        InputError
            Where the floor has none so far from others.
        """
        assert self._world.random_goal is not None, "asked only then"
        drawn = self._free(self._world.random_goal.clearance_m, rng, apart_from)
        heading = {} if self.goal_like.theta_rad is None else {"theta_rad": drawn.theta_rad}
        return self.goal_like.model_copy(update={"x_m": drawn.x_m, "y_m": drawn.y_m, **heading})

    def _free(self, clearance_m: float, rng: np.random.Generator, apart_from: Apart) -> PoseConfig:
        """A pose with room beside what stands there unexpectedly, too."""
        floor, part = self._floor(clearance_m)
        for _ in range(MAX_DRAWS):
            drawn = floor.pose(rng, apart_from, part)
            if self._obstacles.room_m(drawn.x_m, drawn.y_m) >= floor.clearance_m and (
                self._body.radius_m <= floor.clearance_m or self._stands(drawn)
            ):
                return drawn
        if self._body.radius_m > floor.clearance_m:
            raise InputError(
                f"world: expected a random place {clearance_m:g} m from walls with room for the whole "
                "footprint, found none; ask for more clearance_m, or take a smaller robot"
            )
        raise InputError("world.obstacles: expected room beside them for a random place, found none")

    def _stands(self, place: PoseConfig) -> bool:
        """Whether a body that reaches far has room as it stands."""
        walls, others = self._chart.barriers, self._obstacles
        room_m = least_along(
            np.array([[place.x_m, place.y_m, place.theta_rad]]),
            self._body.outline,
            np.concatenate([walls.segments_m, others.segments_m]),
            np.concatenate([walls.circles_m, others.circles_m]),
        )
        return room_m >= ROOM_M

    def _floor(self, clearance_m: float) -> tuple[OpenFloor, BoolArray]:
        """What is open, and the part of it that is drawn on; laid once for start and goal alike."""
        if clearance_m not in self._floors:
            floor = OpenFloor(self._chart, clearance_m, self.given)
            self._floors[clearance_m] = floor, floor.joined(self.given, self._body.radius_m + ROOM_M)
        return self._floors[clearance_m]
