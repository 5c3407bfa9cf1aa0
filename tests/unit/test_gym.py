"""Missions as Gymnasium environments."""

from __future__ import annotations

import subprocess
import sys
import warnings
from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest

gymnasium = pytest.importorskip("gymnasium", reason="needs the extra 'gym'")

import pilotage as pl  # noqa: E402
from pilotage.bridges import gym  # noqa: E402 - registers the environments
from pilotage.core.types import Pose2  # noqa: E402
from pilotage.sensors.numbers import Numbers, SensorSetting  # noqa: E402
from pilotage.sensors.sensor import SENSORS, SensorConfig  # noqa: E402
from pilotage.sim.sensing.sensor import SIMULATED_SENSORS  # noqa: E402
from support.missions import reach  # noqa: E402


def rollout(env: Any, seed: int, steps: int = 30) -> list[Any]:
    rng = np.random.default_rng(0)
    out = [env.reset(seed=seed)[0]]
    for _ in range(steps):
        observation, reward, over, late, _ = env.step(rng.uniform(-1.0, 1.0, 2).astype(np.float32))
        out += [observation, reward]
        if over or late:
            break
    return out


@pytest.mark.parametrize("order", ["import gymnasium, pilotage", "import pilotage, gymnasium"])
def test_importing_both_is_enough(order: str) -> None:
    ask = f"{order}; print(gymnasium.spec('pilotage/museum-1-v0').id)"
    done = subprocess.run([sys.executable, "-c", ask], capture_output=True, text=True, check=True)
    assert done.stdout == "pilotage/museum-1-v0\n"


@pytest.mark.parametrize("name", ["museum-1", "car-park", "gale-pose"])
def test_the_checker_finds_nothing(name: str) -> None:
    from gymnasium.utils.env_checker import check_env

    env = gymnasium.make(f"pilotage/{name}-v0")
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        check_env(env.unwrapped, skip_render_check=True)
    env.close()


def test_the_same_seed_gives_the_same_episode() -> None:
    env, other = (gymnasium.make("pilotage/museum-1-v0") for _ in range(2))
    first, again = rollout(env, 7), rollout(other, 7)
    np.testing.assert_equal(first, again)
    np.testing.assert_equal(rollout(env, 7), first)
    assert (rollout(env, 8)[0]["lidar"] != first[0]["lidar"]).any()
    assert env.reset()[1]["seed"] != env.reset()[1]["seed"]


def test_the_reward_is_the_sum_of_its_terms_and_an_episode_ends() -> None:
    near = {"goal.x_m": 3.0, "goal.y_m": 1.0}
    settings = {f"world.{key}": value for key, value in near.items()}
    mission = pl.load("museum-1", set={**settings, "world.goal.tolerance_m": 0.2})
    env = gymnasium.make(gym.OWN, mission=mission)
    env.reset(seed=1)
    over, total = False, 0.0
    while not over:
        _, reward, over, late, info = env.step(np.array([0.5, 0.0], dtype=np.float32))
        assert reward == pytest.approx(sum(info["reward_terms"].values()))
        total += float(reward)
        assert not late
    assert info["success"]
    assert info["reward_terms"]["reached"] == 10.0
    assert total > 11.0


ALL = {
    "gps": {"name": "gps"},
    "imu": {"name": "imu"},
    "compass": {"name": "compass"},
    "bumper": {"name": "bumper", "sectors": 4},
    "infrared": {"name": "infrared", "rate_hz": 10},
    "gyroscope": {"name": "gyroscope", "rate_hz": 50},
    "magnetometer": {"name": "magnetometer", "rate_hz": 10},
    "radio": {"name": "radio"},
}


def test_every_sensor_is_observed_and_a_base_that_drives_sideways_does() -> None:
    robot = {"motion": {"name": "omnidirectional", "max_lateral_m_s": 0.5}, "sensors": ALL}
    mission = {"extends": "museum-1", "mission": "all", "robot": robot}
    env = gymnasium.make(gym.OWN, mission=mission, disable_env_checker=True).unwrapped
    before, info = env.reset(seed=1)
    assert set(before) == {*pl.load("museum-1").robot.sensors, *ALL, "goal"} - {"radio"}
    assert [before[name].shape[0] for name in ("gps", "bumper", "gyroscope", "odometry")] == [2, 4, 5, 3]
    assert [one.name for one in env.numbers["gps"]] == ["x_m", "y_m"]
    assert "gps" not in info["spoke"]
    count = env.numbers["beacons"][0].size
    assert ((before["beacons"][:count] < 20.0) == (before["beacons"][count:] != 0.0)).all()
    assert env.action_space.shape == (3,)
    for _ in range(9):
        observation, *_, info = env.step(np.array([0.0, 0.0, 1.0], np.float32))
        assert env.observation_space.contains(observation)
    assert "gps" in info["spoke"]
    assert observation["gps"] == pytest.approx([1.0, 1.4], abs=6.0)
    assert observation["odometry"][2] == pytest.approx(0.05, abs=0.02)
    assert (env._sim.truth.x_m, env._sim.truth.y_m) == pytest.approx((1.0, 1.41))


@dataclass(frozen=True, slots=True)
class Echo:
    """A reading of a plugin."""

    word: str
    ranges_m: Any
    loud: bool = True
    at: Pose2 | None = None


class Echoes(SensorConfig):
    """What a plugin's sensor declares: nothing."""


class FewEchoes(SensorConfig):
    """One whose readings have several lengths."""

    def as_numbers(self, setting: SensorSetting) -> tuple[Numbers, ...]:
        assert setting.dt_s == 0.1
        return (Numbers("ranges_m", 3, 0.0, 5.0, 5.0),)


class EchoesOnceASecond:
    """Pings."""

    def __init__(self, *_: Any) -> None:
        self._count = 0

    def read(self) -> Echo:
        self._count += 1
        return Echo("ping", np.array([[1.0], [9.0]])[: self._count], at=Pose2(1.0, 2.0, 0.5))


@pytest.fixture
def _echoes(monkeypatch: pytest.MonkeyPatch) -> None:
    for registry in (SENSORS, SIMULATED_SENSORS):
        monkeypatch.setattr(registry, "_entries", dict(registry._entries))
    for name, config in (("echoes", Echoes), ("few-echoes", FewEchoes)):
        SENSORS.add_config(name)(config)
        SIMULATED_SENSORS.add(config)(EchoesOnceASecond)


@pytest.mark.usefixtures("_echoes")
def test_a_sensor_of_ones_own_is_observed() -> None:
    sensors = {"a": {"name": "echoes", "rate_hz": 2}, "few": {"name": "few-echoes"}}
    mission = {"extends": "museum-1", "mission": "own", "robot": {"sensors": sensors}}
    env = gymnasium.make(gym.OWN, mission=mission, disable_env_checker=True).unwrapped
    assert [one.name for one in env.numbers["a"]] == ["ranges_m", "loud", "at.x_m", "at.y_m", "at.theta_rad"]
    seen, _ = env.reset(seed=1)
    assert (seen["a"] == 0.0).all()
    assert seen["few"] == pytest.approx([1.0, 5.0, 5.0])
    for _ in range(4):
        seen, *_ = env.step(np.zeros(2, np.float32))
    assert seen["a"] == pytest.approx([1.0, 1.0, 1.0, 2.0, 0.5])
    assert seen["few"] == pytest.approx([1.0, 5.0, 5.0])
    for _ in range(4):
        env.step(np.zeros(2, np.float32))
    with pytest.raises(pl.InputError, match=r"robot\.sensors\.a: expected 1 numbers of ranges_m at most"):
        env.step(np.zeros(2, np.float32))


def test_what_cannot_be_learned_is_one_line() -> None:
    with pytest.raises(pl.InputError, match=r"expected a mission with world\.goal"):
        gymnasium.make("pilotage/romi-explore-v0")
    with pytest.raises(pl.InputError, match="an episode would be over before a step"):
        gymnasium.make("pilotage/museum-laps-v0")
    with pytest.raises(pl.InputError, match="one robot"):
        gymnasium.make(gym.OWN, mission={"extends": "museum-1", "mission": "two", "robots": [{}, {}]})


def test_a_goal_that_the_mission_draws_is_another_one_with_each_seed() -> None:
    values = reach()
    del values["world"]["goal"]
    drawn: dict[str, Any] = {"world.random_goal": {}}
    env: Any = gymnasium.make(gym.OWN, mission=values, set=drawn, disable_env_checker=True).unwrapped
    first, again, other = (env.reset(seed=seed)[0]["goal"].tolist() for seed in (1, 1, 2))
    assert first == again != other
    seen, _, _, _, info = env.step(np.zeros(2, np.float32))
    assert seen["goal"].tolist() == pytest.approx(other)
    assert info["reward_terms"]["progress"] == pytest.approx(0.0)
