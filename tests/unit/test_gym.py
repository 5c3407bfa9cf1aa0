"""Missions as Gymnasium environments."""

from __future__ import annotations

import subprocess
import sys
import warnings
from typing import Any

import numpy as np
import pytest

gymnasium = pytest.importorskip("gymnasium", reason="needs the extra 'gym'")

import pilotage as pl  # noqa: E402
from pilotage.bridges import gym  # noqa: E402 - registers the environments


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


def test_what_cannot_be_learned_is_one_line() -> None:
    with pytest.raises(pl.InputError, match=r"expected a mission with world\.goal"):
        gymnasium.make("pilotage/romi-explore-v0")
    with pytest.raises(pl.InputError, match="one robot"):
        gymnasium.make(gym.OWN, mission={"extends": "museum-1", "mission": "two", "robots": [{}, {}]})
