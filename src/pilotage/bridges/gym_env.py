"""One robot of a mission, driven by whoever learns: readings as observations, twists as actions."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, SupportsFloat, TypeAlias

import gymnasium
import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from pilotage.core.angles import wrap_to_pi
from pilotage.core.errors import InputError
from pilotage.core.types import Twist
from pilotage.experiments.build.robots import motion_of, sensors_of
from pilotage.face.missions import MissionLike, load
from pilotage.face.stepping import Simulation, make
from pilotage.missions.mission import Mission
from pilotage.missions.places import GoalConfig
from pilotage.sensors.lidar import LidarConfig
from pilotage.sensors.readings import LidarScan, OdometryIncrement, Readings, UltrasonicReading
from pilotage.sensors.ultrasonic import UltrasonicConfig
from pilotage.sensors.wheel_odometry import WheelOdometryConfig

Array: TypeAlias = NDArray[np.float32]
Observation: TypeAlias = dict[str, Array]

LARGEST_SEED = 2**31 - 1
REACHED, HIT, A_STEP = 10.0, -10.0, -0.01
FARTHEST_M = 1e6
"""Bound of a goal's distance."""
ODOMETRY_FACTOR = 4.0
"""An increment's bound: so many times what the drive can do between two readings."""


class MissionEnv(gymnasium.Env[Any, Any]):
    """A mission's first goal, to be reached by one's own policy.

    **Action** (2,), -1 to 1: forward speed and turn rate as shares of the motion's greatest.

    **Observation**: a mapping from the names of the robot's sensors to arrays: a LiDAR's ranges (N,) in m,
    an ultrasonic's range (1,), a wheel odometry's distance and angle (2,) since its last reading; and
    ``goal`` (2,), distance in m and direction in rad of the goal in the robot's frame, which is the truth (a
    real robot would ask its localizer). A sensor that has not spoken yet reads its reach. Beacons are left
    out: how many are in sight varies.

    **Reward** a step, in ``info["reward_terms"]`` one by one: ``progress`` (metres by which the straight line
    to the goal became shorter), ``time`` (-0.01), ``collision`` (-10), ``reached`` (+10).

    **Over** when the goal is reached within its tolerance (a heading that it asks for is not looked at) or
    something is hit; truncated at the mission's time limit.

    Parameters
    ----------
    mission, set
        What ``pilotage.load`` takes.

    Raises
    ------
    InputError
        Where the mission has several robots or no goal.
    """

    metadata: dict[str, Any] = {"render_modes": []}  # noqa: RUF012 - as Gymnasium declares it

    def __init__(
        self,
        mission: MissionLike,
        set: Mapping[str, Any] | None = None,  # noqa: A002 - as the command line calls it
    ) -> None:
        self.mission = load(mission, set=set)
        self._goal = goal_of(self.mission)
        robot = self.mission.members[0]
        motion = motion_of(robot, "robot")
        self._top = motion.top_speed_m_s, motion.top_turn_rate_rad_s
        self._rest: Observation = {}
        within: dict[str, spaces.Box[Any]] = {}
        for name, sensor in sensors_of(robot, "robot").items():
            if isinstance(sensor, LidarConfig):
                within[name] = _box(0.0, sensor.max_range_m, sensor.beams)
                self._rest[name] = np.full(sensor.beams, sensor.max_range_m, dtype=np.float32)
            elif isinstance(sensor, UltrasonicConfig):
                within[name] = _box(0.0, sensor.max_range_m, 1)
                self._rest[name] = np.full(1, sensor.max_range_m, dtype=np.float32)
            elif isinstance(sensor, WheelOdometryConfig):
                most = ODOMETRY_FACTOR * np.array(self._top) / sensor.rate_hz
                within[name] = spaces.Box(*_both(most), dtype=np.float32)
                self._rest[name] = np.zeros(2, dtype=np.float32)
        within["goal"] = spaces.Box(
            np.array([0.0, -np.pi], np.float32), np.array([FARTHEST_M, np.pi], np.float32), dtype=np.float32
        )
        self._within = within
        self.observation_space = spaces.Dict({**within})
        self.action_space = spaces.Box(*_both(np.ones(2)), dtype=np.float32)
        self._sim: Simulation | None = None
        self._seen: Observation = {}
        self._to_go_m = math.nan

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Observation, dict[str, Any]]:
        """Begin anew with the mission's noise of that seed; without one, of a seed drawn from the last."""
        super().reset(seed=seed, options=options)
        drawn = int(self.np_random.integers(LARGEST_SEED)) if seed is None else int(seed)
        if self._sim is None:
            self._sim = make(self.mission, seed=drawn)
        readings = self._sim.reset(drawn)
        self._seen = dict(self._rest)
        observation = self._observed(readings)
        self._to_go_m = float(observation["goal"][0])
        return observation, {"seed": drawn, "t_s": readings.t_s}

    def step(self, action: Array) -> tuple[Observation, SupportsFloat, bool, bool, dict[str, Any]]:
        """Drive one time step."""
        if self._sim is None:
            raise InputError("gymnasium: expected reset() before the first step, found none")
        share = np.clip(np.asarray(action, dtype=np.float64).reshape(-1), -1.0, 1.0)
        twist = Twist(float(share[0]) * self._top[0], float(share[1]) * self._top[1])
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
        info = {"t_s": readings.t_s, "reward_terms": terms, "success": reached and not hit}
        return observation, sum(terms.values()), reached or hit, late, info

    def _observed(self, readings: Readings) -> Observation:
        """The last word of every sensor, and where the goal is."""
        assert self._sim is not None, "made at reset"
        for name, reading in readings.by_sensor.items():
            if name not in self._within:
                continue
            if isinstance(reading, LidarScan):
                self._see(name, reading.ranges_m)
            elif isinstance(reading, UltrasonicReading):
                self._see(name, [math.inf if reading.saturated else reading.range_m])
            elif isinstance(reading, OdometryIncrement):
                self._see(name, [reading.distance_m, reading.angle_rad])
        pose = self._sim.truth
        dx, dy = self._goal.x_m - pose.x_m, self._goal.y_m - pose.y_m
        self._see("goal", [math.hypot(dx, dy), wrap_to_pi(math.atan2(dy, dx) - pose.theta_rad)])
        return dict(self._seen)

    def _see(self, name: str, values: Any) -> None:
        """Take a reading within its bounds."""
        box = self._within[name]
        self._seen[name] = np.clip(np.asarray(values, dtype=np.float32), box.low, box.high)


def goal_of(mission: Mission) -> GoalConfig:
    """The goal of a mission that can be an environment.

    Raises
    ------
    InputError
        Where it has several robots or no goal.
    """
    if mission.robots:
        raise InputError(f"gymnasium: expected a mission with one robot, found {len(mission.robots)}")
    goal = mission.goal_of(mission.members[0])
    if goal is None:
        raise InputError(f"gymnasium: expected a mission with world.goal, found '{mission.mission}'")
    return goal


def _both(most: Any) -> tuple[Array, Array]:
    """Bounds on both sides of nothing."""
    high = np.asarray(most, dtype=np.float32)
    return -high, high


def _box(low: float, high: float, size: int) -> spaces.Box[Any]:
    bounds = np.full(size, low, np.float32), np.full(size, high, np.float32)
    return spaces.Box(*bounds, dtype=np.float32)
