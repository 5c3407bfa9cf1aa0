"""Many environments at once are the single one many times over."""

from __future__ import annotations

import math
import warnings
from typing import Any

import numpy as np
import pytest

gymnasium = pytest.importorskip("gymnasium", reason="needs the extra 'gym'")

from pilotage.bridges import gym  # noqa: E402
from pilotage.core.errors import InputError  # noqa: E402
from pilotage.experiments.build.build import build_source  # noqa: E402
from support.missions import reach  # noqa: E402

EXACT = {"robot.sensors.lidar.range_var_m2": 0.0, "run.time_limit_s": 12.0}


@pytest.fixture(autouse=True)
def registered() -> None:
    gym.register()


def many(mission: Any = "museum-1", count: Any = 3, **options: Any) -> Any:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # Gymnasium is not sure of vector entry points
        return gymnasium.make_vec(
            gym.OWN, num_envs=count, vectorization_mode="vector_entry_point", mission=mission, **options
        )


@pytest.mark.parametrize("mission", ["museum-1", "room"])
def test_each_is_equal_to_the_single_environment(mission: str) -> None:
    """Without noise, to a collision and beyond it, in walls; the vector's ranges are float32 of the same."""
    values: Any = reach() if mission == "room" else mission
    one = gymnasium.make(gym.OWN, mission=values, set=EXACT, disable_env_checker=True).unwrapped
    three = many(values, set=EXACT, threads=2)
    seen, _ = one.reset(seed=5)
    all_seen, _ = three.reset(seed=5)
    rng, ends = np.random.default_rng(2), 0
    one_over = False
    for step in range(150):
        for key in ("lidar", "goal"):
            for row in all_seen[key]:
                np.testing.assert_allclose(row, seen[key], atol=2e-6, err_msg=f"{key} at step {step}")
        action = np.array([1.0, 0.5 * rng.uniform(-1.0, 1.0)], np.float32)
        all_seen, rewards, ended, late, _ = three.step(np.tile(action, (3, 1)))
        if one_over:
            seen, _ = one.reset(seed=5)  # the vector's own step to begin anew
            assert not ended.any()
            assert (rewards == 0.0).all()
            one_over = False
            continue
        seen, reward, over, out_of_time, _ = one.step(action)
        np.testing.assert_allclose(rewards, reward, atol=2e-5)
        assert (ended == over).all()
        assert (late == out_of_time).all()
        one_over = over or out_of_time
        ends += one_over
    assert ends > 0


DRAWN: dict[str, Any] = {"world.random_start": {}, "world.random_goal": {}, "world.obstacles": []}


def test_every_episode_has_a_start_and_a_goal_of_its_own_where_the_mission_draws_them() -> None:
    """Out of those that the mission's seed gives; which, by the environments' seed and not by the threads."""

    def begun(seed: int, threads: int) -> Any:
        env = many(count=40, set=EXACT | DRAWN, threads=threads)
        first, _ = env.reset(seed=seed)
        seen, beginnings = first, [first["goal"]]
        for _ in range(200):
            over = env._over.copy()
            seen, *_ = env.step(np.tile(np.array([1.0, 0.3], np.float32), (40, 1)))
            beginnings.append(seen["goal"][over])
        env.close()
        return np.concatenate(beginnings), first["lidar"]

    goals, scans = begun(3, 1)
    assert len(goals) > 80
    assert len(np.unique(goals[:, 0])) > 0.9 * len(goals)
    assert goals[:, 0].min() > 0.6
    # All stand on the floor, with the room that was asked for, but for what the body moved none yet.
    assert scans.min() > 0.6 - 1e-6
    again, _ = begun(3, 4)
    assert np.array_equal(goals, again)
    assert not np.array_equal(goals[:40], begun(4, 1)[0][:40])


def test_no_episode_begins_or_ends_in_what_the_seed_put_there() -> None:
    across = {"world.obstacles": [{"kind": "across-path", "length_m": [5.0, 6.0], "thickness_m": 2.0}]}
    env = many(count=1, set=EXACT | DRAWN | across)
    placed = build_source(env.mission).obstacles
    places = np.concatenate([env._beginnings[1:, :2], env._goals[1:, :2]])
    assert len(placed.polygons_m) == 1
    assert min(placed.room_m(x, y) for x, y in places.tolist()) >= 0.6
    env.close()


def test_noise_goes_by_the_seed_and_not_by_the_threads() -> None:
    actions = np.random.default_rng(0).uniform(-1.0, 1.0, (20, 7, 2)).astype(np.float32)

    def rollout(seed: int, threads: int) -> list[Any]:
        env = many(count=7, threads=threads)
        out = [env.reset(seed=seed)[0]["lidar"]]
        out += [env.step(action)[0]["lidar"] for action in actions]
        env.close()
        return out

    first, again, other = rollout(3, 1), rollout(3, 4), rollout(4, 1)
    assert np.array_equal(first, again)
    assert not np.array_equal(first, other)
    assert np.array_equal(first[0].shape, (7, first[0].shape[1]))
    assert len(np.unique(first[-1][:, 0])) == 7


def test_observations_are_of_their_spaces() -> None:
    env = many(count=5, set={"robot.sensors.lidar.beams": 64})
    seen, _ = env.reset(seed=0)
    assert env.observation_space.contains(seen)
    env.action_space.seed(0)
    for _ in range(60):
        seen, rewards, ended, late, _ = env.step(env.action_space.sample())
    assert env.observation_space.contains(seen)
    assert seen["lidar"].shape == (5, 64)
    assert rewards.shape == ended.shape == late.shape == (5,)
    env.close()


@pytest.mark.parametrize(
    ("mission", "told"),
    [
        ("car-park", "expected robot.motion differential-drive"),
        ("calibrate-x", "expected a mission with world.goal|expected a lidar"),
        (
            {"extends": "museum-1", "robot": {"sensors": {"lidar": {"rate_hz": 5}}}},
            "expected a lidar of 10 Hz",
        ),
    ],
)
def test_what_cannot_be_stepped_at_once_is_refused(mission: Any, told: str) -> None:
    with pytest.raises(InputError, match=told):
        many(mission)


def test_numbers_that_no_environments_have_are_refused() -> None:
    for count, told in ((1.5, "a whole number >= 1, found 1.5"), (10**9, "at most .* found 1000000000")):
        with pytest.raises(InputError, match=f"num_envs: expected {told}"):
            many(count=count)
    with pytest.raises(InputError, match="seed: expected a whole number, found nan"):
        many(count=2).reset(seed=math.nan)


@pytest.mark.parametrize(
    ("action", "told"),
    [
        (np.full((2, 2), np.nan), "from -1 to 1, found NaN"),
        (np.zeros(2), r"shape \(2, 2\), found shape \(2,\)"),
        ([["a", "b"]] * 2, "expected numbers of shape"),
    ],
)
def test_actions_that_are_none_are_refused_alone_and_among_many(action: Any, told: str) -> None:
    """NaN, as of a policy that has diverged, would be a robot that is nowhere from then on."""
    env = many(count=2)
    env.reset(seed=0)
    with pytest.raises(InputError, match=told):
        env.step(action)
    one = gymnasium.make("pilotage/museum-1-v0").unwrapped
    one.reset(seed=0)
    with pytest.raises(InputError, match="gymnasium: action: expected numbers"):
        one.step(action[0])
