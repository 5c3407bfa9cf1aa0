"""One robot of a mission, driven by whoever learns: readings as observations, twists as actions."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, SupportsFloat

import gymnasium
import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from pilotage.bridges.gym_action import shares_of
from pilotage.bridges.gym_observation import LastWords, Observation, numbers_of_sensors
from pilotage.core.angles import wrap_to_pi
from pilotage.core.errors import InputError
from pilotage.core.types import Twist
from pilotage.experiments.build.robots import motion_of
from pilotage.face.missions import MissionLike, load
from pilotage.face.stepping import Simulation, make
from pilotage.missions.mission import Mission
from pilotage.missions.places import GoalConfig
from pilotage.sensors.numbers import FARTHEST_M, Numbers
from pilotage.sensors.readings import Readings

LARGEST_SEED = 2**31 - 1
REACHED, HIT, A_STEP = 10.0, -10.0, -0.01
GOAL = "goal"
GOAL_NUMBERS = (Numbers("distance_m", 1, 0.0, FARTHEST_M), Numbers.around_zero("bearing_rad", math.pi))


class MissionEnv(gymnasium.Env[Any, Any]):
    """A mission's first goal, to be reached by one's own policy.

    **Action** (2,), -1 to 1: forward speed and turn rate as shares of the motion's greatest; (3,) of a motion
    that drives sideways, the speed to the left last.

    **Observation**: a mapping from the names of the robot's sensors to arrays, and ``goal`` (2,), distance in
    m and direction in rad of the goal in the robot's frame, which is the truth (a real robot would ask its
    localizer). What stands in an array the attribute ``numbers`` tells: names with units, how many, bounds.
    They are what the sensor's config declares (``SensorConfig.as_numbers``), else what its first reading
    holds, without bounds; sensors that tell no numbers, as a radio, are left out. One that has not spoken yet
    reads its reach, or 0; ``info["spoke"]`` names those that spoke in this step.

    **Reward** a step, in ``info["reward_terms"]`` one by one: ``progress`` (metres by which the straight line
    to the goal became shorter), ``time`` (-0.01), ``collision`` (-10), ``reached`` (+10).

    Where the mission draws its start or its goal each beginning has others, of its seed.

    **Over** when the goal is reached within its tolerance (a heading that it asks for is not looked at) or
    something is hit; truncated at the mission's time limit.

    Parameters
    ----------
    mission, set
        What ``pilotage.load`` takes.

    Raises
    ------
    InputError
        Where the mission has several robots, no goal or one where it starts, a sensor is called ``goal``, or
        one that declares no numbers is silent.
    """

    metadata: dict[str, Any] = {"render_modes": []}  # noqa: RUF012 - as Gymnasium declares it

    def __init__(
        self,
        mission: MissionLike,
        set: Mapping[str, Any] | None = None,  # noqa: A002 - as the command line calls it
    ) -> None:
        self.mission = load(mission, set=set)
        check_goal(self.mission)
        motion = motion_of(self.mission.members[0], "robot")
        top = [motion.top_speed_m_s, motion.top_turn_rate_rad_s]
        self._top = np.array(top + [motion.top_lateral_m_s] * motion.drives_sideways)
        sensors = numbers_of_sensors(self.mission)
        if GOAL in sensors:
            raise InputError(
                f"gymnasium: robot.sensors: expected another name than '{GOAL}', which is the goal's"
            )
        self.numbers = {**sensors, GOAL: GOAL_NUMBERS}
        self._words = LastWords(self.numbers)
        self.observation_space = spaces.Dict({**self._words.spaces})
        self.action_space = spaces.Box(-1.0, 1.0, self._top.shape, np.float32)
        self._sim: Simulation | None = None
        self._goal, self._to_go_m = GoalConfig(x_m=0.0, y_m=0.0), math.nan  # until a reset

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Observation, dict[str, Any]]:
        """Begin anew with the mission's noise of that seed; without one, of a seed drawn from the last."""
        super().reset(seed=seed, options=options)
        drawn = int(self.np_random.integers(LARGEST_SEED)) if seed is None else int(seed)
        if self._sim is None:
            self._sim = make(self.mission, seed=drawn)
        readings = self._sim.reset(drawn)
        self._words.forget()
        self._goal = goal_of(self._sim.drawn)
        observation = self._observed(readings)
        self._to_go_m = float(observation["goal"][0])
        return observation, {"seed": drawn, "t_s": readings.t_s, "spoke": tuple(readings.by_sensor)}

    def step(
        self, action: NDArray[np.float32]
    ) -> tuple[Observation, SupportsFloat, bool, bool, dict[str, Any]]:
        """Drive one time step."""
        if self._sim is None:
            raise InputError("gymnasium: expected reset() before the first step, found none")
        shares = shares_of(action, *self._top.shape)
        twist = Twist(*(shares * self._top).tolist())
        readings = self._sim.step(twist)
        observation = self._observed(readings)
        to_go_m = float(observation["goal"][0])
        reached = to_go_m <= self._goal.tolerance_m
        hit = self._sim.collisions[0] > 0
        terms = {
            "progress": self._to_go_m - to_go_m,
            "time": A_STEP,
            "collision": HIT if hit else 0.0,
            "reached": REACHED if reached and not hit else 0.0,
        }
        self._to_go_m = to_go_m
        late = readings.t_s >= self.mission.run.time_limit_s - 1e-9
        info = {
            "t_s": readings.t_s,
            "reward_terms": terms,
            "success": reached and not hit,
            "spoke": tuple(readings.by_sensor),
        }
        return observation, sum(terms.values()), reached or hit, late, info

    def _observed(self, readings: Readings) -> Observation:
        """The last word of every sensor, and where the goal is."""
        assert self._sim is not None, "made at reset"
        pose = self._sim.truth
        dx, dy = self._goal.x_m - pose.x_m, self._goal.y_m - pose.y_m
        self._words.see(GOAL, [math.hypot(dx, dy), wrap_to_pi(math.atan2(dy, dx) - pose.theta_rad)])
        return self._words.hear(readings)


def check_goal(mission: Mission) -> None:
    """Refuse what can be no environment.

    Raises
    ------
    InputError
        Where a mission has several robots, no goal, or one that it starts at.
    """
    if mission.robots:
        raise InputError(f"gymnasium: expected a mission with one robot, found {len(mission.robots)}")
    if mission.world.random_goal is not None:
        return
    start, goal = mission.start_of(mission.members[0]), mission.goal_of(mission.members[0])
    if goal is None:
        raise InputError(f"gymnasium: expected a mission with world.goal, found '{mission.mission}'")
    if start is None:
        return
    away_m = math.hypot(goal.x_m - start.x_m, goal.y_m - start.y_m)
    if away_m <= goal.tolerance_m:
        raise InputError(
            f"gymnasium: expected world.goal elsewhere than the start of '{mission.mission}', found it "
            f"{away_m:g} m away: an episode would be over before a step"
        )


def goal_of(drawn: Mission) -> GoalConfig:
    """The goal of a mission that can be an environment, whose places are drawn."""
    goal = drawn.goal_of(drawn.members[0])
    assert goal is not None, "checked above"
    return goal
