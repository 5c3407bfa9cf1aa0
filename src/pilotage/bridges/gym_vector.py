"""Many environments of one mission, stepped in one kernel call: ``gymnasium.make_vec``."""

from __future__ import annotations

import math
import os
from collections.abc import Mapping
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import numpy as np
from gymnasium import spaces
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space
from numpy.typing import NDArray

from pilotage.bridges.gym_action import shares_of
from pilotage.bridges.gym_env import A_STEP, HIT, LARGEST_SEED, REACHED, check_goal, goal_of
from pilotage.core import given
from pilotage.core.errors import InputError
from pilotage.core.random import RandomStreams
from pilotage.core.types import FloatArray
from pilotage.experiments.build.build import Source, build_source
from pilotage.experiments.build.places import pose_of, random_places
from pilotage.experiments.build.robots import sensors_of
from pilotage.face.missions import MissionLike, load
from pilotage.kernels.bodies import drive, environments
from pilotage.missions.mission import Mission
from pilotage.models.motion.differential_drive import DifferentialDriveConfig
from pilotage.sensors.lidar import LidarConfig
from pilotage.sensors.numbers import FARTHEST_M
from pilotage.sim.sensing.lidar import fan_of

Observations = dict[str, NDArray[np.float32]]
MOST_BEAMS = 50_000_000
"""Of all environments together; each takes some 20 bytes."""
PLACES = 1000
"""So many starts and goals are drawn for episodes to choose from."""


class MissionVectorEnv(VectorEnv[Any, Any, Any]):
    """N robots, each alone in its copy of a mission's world, as ``MissionEnv`` steps one.

    **Actions** (N, 2), **rewards** and ends are those of ``MissionEnv``. **Observations**: the first LiDAR's
    ranges (N, beams) under its name, and ``goal`` (N, 2); the other sensors are left out. An environment that
    is over begins anew in the next step, whose action and reward do not count (``AutoresetMode.NEXT_STEP``).

    The kernels are those that simulate every mission: without noise the numbers are equal to those of
    ``MissionEnv``. Obstacles that a seed places stand where the mission's own seed puts them; a start or a
    goal that the mission draws is another one in each episode, out of ``PLACES`` of that seed.

    Parameters
    ----------
    mission, set
        What ``pilotage.load`` takes; ``set={"robot.sensors.lidar.beams": 64}``, say.
    num_envs
        N.
    threads
        Among which they are shared; None: one a core. The numbers do not depend on it.

    Raises
    ------
    InputError
        Where the mission has several robots, people, no goal, no LiDAR that speaks at every step, or another
        motion than ``differential-drive``.
    """

    metadata: dict[str, Any] = {  # noqa: RUF012 - as Gymnasium declares it
        "render_modes": [],
        "autoreset_mode": AutoresetMode.NEXT_STEP,
    }

    def __init__(
        self,
        mission: MissionLike,
        num_envs: int = 1,
        set: Mapping[str, Any] | None = None,  # noqa: A002 - as the command line calls it
        threads: int | None = None,
    ) -> None:
        num_envs = given.whole("gymnasium: num_envs", num_envs, 1)
        threads = None if threads is None else given.whole("gymnasium: threads", threads, 1)
        self.mission = load(mission, set=set)
        check_goal(self.mission)
        built = build_source(self.mission)
        source = built.simulator
        if source.crowd is not None:
            raise InputError(
                "gymnasium: expected a mission without people where many are stepped, found some"
            )
        body, robot, dt_s = source.bodies[0], self.mission.members[0], self.mission.run.dt_s
        sheets = sensors_of(robot, "robot")
        lidars = [(name, sheet) for name, sheet in sheets.items() if isinstance(sheet, LidarConfig)]
        if not lidars or lidars[0][1].every_steps(dt_s, "robot.sensors") != 1:
            raise InputError(f"gymnasium: expected a lidar of {1.0 / dt_s:g} Hz where many are stepped")
        self._lidar, lidar = lidars[0]
        if num_envs * lidar.beams > MOST_BEAMS:
            raise InputError(
                f"gymnasium: num_envs: expected at most {MOST_BEAMS // lidar.beams} with {lidar.beams} beams "
                f"each, found {num_envs}"
            )
        motion = _motion(self.mission)
        self.num_envs = num_envs
        low, high = np.array([0.0, -np.pi], np.float32), np.array([FARTHEST_M, np.pi], np.float32)
        self.single_observation_space = spaces.Dict(
            {
                self._lidar: spaces.Box(0.0, lidar.max_range_m, (lidar.beams,), np.float32),
                "goal": spaces.Box(low, high, dtype=np.float32),
            }
        )
        self.single_action_space = spaces.Box(-1.0, 1.0, (2,), np.float32)
        self.observation_space = batch_space(self.single_observation_space, num_envs)
        self.action_space = batch_space(self.single_action_space, num_envs)
        changes = motion.max_acceleration_m_s2 * dt_s, motion.max_turn_acceleration_rad_s2 * dt_s
        limits = np.array([motion.max_speed_m_s, motion.max_turn_rate_rad_s, *changes])
        self._top = limits[:2].copy()
        self._beams, self._noisy = lidar.beams, lidar.range_var_m2 > 0.0
        mount = lidar.mount.as_array()
        steps = math.ceil(self.mission.run.time_limit_s / dt_s - 1e-9)
        self._fixed: tuple[Any, ...] = (
            limits,
            dt_s,
            body.motion.release_m,
            steps,
            np.array([A_STEP, HIT, REACHED]),
            mount,
            fan_of(lidar),
            math.sqrt(lidar.range_var_m2),
        )
        self._beginnings, self._goals = _episodes(self.mission, built)
        self._episode = np.zeros(num_envs, dtype=np.int64)
        world = source.world
        self._solid = (body.footprint.outline, world.fixed, world.traffic.others, body.own)
        self._states = np.zeros((num_envs, drive.STATE_SIZE))
        self._speeds, self._commands = np.zeros((num_envs, 2)), np.zeros((num_envs, 2))
        self._counts = np.zeros(num_envs, dtype=np.int64)
        self._over = np.ones(num_envs, dtype=np.bool_)
        self._normals = np.zeros((num_envs, self._beams), dtype=np.float32)
        self._to_go, self._ranges = np.zeros((num_envs, 2)), np.zeros((num_envs, self._beams))
        self._reward = np.zeros(num_envs)
        self._ended, self._late = np.zeros((2, num_envs), dtype=np.bool_)
        count = min(num_envs, threads or os.cpu_count() or 1)
        self._shares = [(num_envs * k // count, num_envs * (k + 1) // count) for k in range(count)]
        self._pool = ThreadPoolExecutor(count) if count > 1 else None

    def reset(
        self, *, seed: int | list[int | None] | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Observations, dict[str, Any]]:
        """Begin anew, with noise of that seed; without one it goes on."""
        del options
        if isinstance(seed, list):
            seed = seed[0] if seed else None
        if seed is not None and not isinstance(seed, int | np.integer):
            raise InputError(f"gymnasium: seed: expected a whole number, found {given.told(seed)}")
        super().reset(seed=None if seed is None else int(seed) % LARGEST_SEED)
        self._over[:] = True
        self._advance()
        return self._observed(), {}

    def step(
        self, actions: Any
    ) -> tuple[Observations, NDArray[np.float64], NDArray[np.bool_], NDArray[np.bool_], dict[str, Any]]:
        """Drive every robot one time step."""
        np.multiply(shares_of(actions, self.num_envs, 2), self._top, out=self._commands)
        self._advance()
        return self._observed(), self._reward.copy(), self._ended.copy(), self._late.copy(), {}

    def close_extras(self, **kwargs: Any) -> None:
        """End the threads."""
        del kwargs
        if self._pool is not None:
            self._pool.shutdown()

    def _advance(self) -> None:
        if len(self._goals) > 1:
            fresh = np.flatnonzero(self._over)
            self._episode[fresh] = self.np_random.integers(len(self._goals), size=len(fresh))
        if self._noisy:
            self.np_random.standard_normal(out=self._normals, dtype=np.float32)
        if self._pool is None:
            self._share(*self._shares[0])
        else:
            list(self._pool.map(self._share, *zip(*self._shares, strict=True)))

    def _share(self, first: int, last: int) -> None:
        arguments: tuple[Any, ...] = (
            first,
            last,
            self._states,
            self._speeds,
            self._counts,
            self._over,
            self._episode,
            self._beginnings,
            self._goals,
            self._commands,
            *self._fixed,
            self._normals,
            *self._solid,
            np.zeros((1, 3)),
            np.zeros(1),
            self._to_go,
            self._ranges,
            self._reward,
            self._ended,
            self._late,
        )
        environments.step_environments(*arguments)

    def _observed(self) -> Observations:
        return {self._lidar: self._ranges.astype(np.float32), "goal": self._to_go.astype(np.float32)}


def _episodes(mission: Mission, built: Source) -> tuple[FloatArray, FloatArray]:
    """(P, drive.STATE_SIZE) states of the body to begin with, and (P, 3) goals, x, y and how near.

    P is ``PLACES`` where the mission draws any of them, else 1.
    """
    body, world = built.simulator.bodies[0], mission.world
    states, goals = [body.state.copy()], [goal_of(built.mission)]
    if world.random_start is not None or world.random_goal is not None:
        (draw,) = random_places(mission, built.chart, built.obstacles)
        rng = RandomStreams(mission.run.seed).stream("episodes")
        room_m = goals[0].tolerance_m + body.footprint.radius_m
        for _ in range(PLACES - 1):
            start = draw.start(rng)
            body.carry_to(pose_of(start))
            states.append(body.state.copy())
            goals.append(goals[0] if world.random_goal is None else draw.goal(rng, [(start, room_m)]))
    return np.array(states), np.array([[goal.x_m, goal.y_m, goal.tolerance_m] for goal in goals])


def _motion(mission: Any) -> DifferentialDriveConfig:
    from pilotage.experiments.build.robots import motion_of

    motion = motion_of(mission.members[0], "robot")
    if not isinstance(motion, DifferentialDriveConfig):
        raise InputError(
            f"gymnasium: expected robot.motion differential-drive where many are stepped, "
            f"found {mission.members[0].motion.name}"
        )
    return motion
