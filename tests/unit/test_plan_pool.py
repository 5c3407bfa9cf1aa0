"""Plans priced in one call, and the pair of points on either side of a way: as the parts one by one."""

from __future__ import annotations

import math

import numpy as np
import pytest

from pilotage.core.types import FloatArray
from pilotage.kernels.control.gap_points import nearest_pair, points_within
from pilotage.kernels.control.plan_pool import priced_pool
from pilotage.kernels.control.rollouts import (
    Price,
    later,
    plan_costs,
    pursuits,
    rollout_costs,
    weighted_mean,
)
from pilotage.stack.control.local.body import make_body
from support.seen_ground import DRIVE, JACKAL, ground_of

PRICE = Price(0.05, 0.02, 0.2, 1.0, 0.25, 0.01, 1.0, 30.0, 3.0, 0.0, 0.3, 1.0, 1.5, 0.5)
LOOKS, SPEEDS = np.array([[0.3, 0.1], [0.45, 0.3]]), np.array([1.0, 0.0])
STEPS, NONE = 6, np.empty((0, 2))


@pytest.mark.parametrize("last_steps", [0, 4, 9])
@pytest.mark.parametrize("samples", [0, 12])
def test_a_pool_holds_what_its_parts_give(last_steps: int, samples: int) -> None:
    """To the bit, in the order told; of a shorter last plan the last command goes on."""
    rng = np.random.default_rng(last_steps + samples)
    x, y = np.meshgrid(np.arange(80.0), np.arange(80.0))
    togo = np.hypot(x - 70.0, y - 40.0) / 20.0
    ground, body = ground_of(np.array([[1.0, 0.1], [1.2, -0.6]]), togo), make_body(JACKAL)
    start, path = np.array([0.0, 0.0, 0.1, 0.4, 0.2]), np.column_stack([np.linspace(0, 2, 21), np.zeros(21)])
    last, held = rng.normal(size=(last_steps, 2)), np.array([[0.6, 2.0]])
    noise = rng.normal(size=(samples, STEPS, 2))
    commands, plans = np.empty((samples, STEPS, 2)), np.empty((20, STEPS, 2))
    movers = np.zeros((STEPS, 0, 3))
    fixed = 0.1, DRIVE, body, ground, movers, PRICE
    costs = priced_pool(start, last, 0.5, path, LOOKS, SPEEDS, 1.0, held, noise, 0.1, *fixed, commands, plans)

    expected: list[FloatArray] = []
    if last_steps:
        expected.append(later(last, 0.5)[np.minimum(np.arange(STEPS), last_steps - 1)])
    chased = np.empty((4, STEPS, 2))
    pursuits(start, path, LOOKS, SPEEDS, 1.0, 0.1, DRIVE, chased)
    expected += [*chased, np.zeros((STEPS, 2)), np.tile(held[0], (STEPS, 1))]
    priced = plan_costs(start, np.array(expected), *fixed)
    if samples:
        drawn = np.empty((samples, STEPS, 2))
        sampled = rollout_costs(start, expected[int(np.argmin(priced))], noise, *fixed, drawn)
        more = np.array([drawn[int(np.argmin(sampled))], weighted_mean(drawn, sampled, 0.1)])
        expected += [*more]
        priced = np.append(priced, plan_costs(start, more, *fixed))
    assert (costs == priced).all()
    assert (plans[: len(costs)] == np.array(expected)).all()


def test_the_pair_across_a_way_is_the_nearest() -> None:
    """Against all pairs; what lies on the way itself is on neither side."""
    rng = np.random.default_rng(3)
    for _ in range(20):
        points = rng.uniform(-2.0, 2.0, (40, 2))
        ground = ground_of(points)
        near = points_within(ground.hits, ground.mean, -4.0, -4.0, 20.0, 0.3, -0.2, 0.8)
        held = ground.mean[np.flatnonzero(ground.hits)]
        assert {*map(tuple, near)} == {*map(tuple, held[np.hypot(*(held - [0.3, -0.2]).T) < 0.8])}
        turn = rng.uniform(-math.pi, math.pi)
        c, s = math.cos(turn), math.sin(turn)
        across = c * (near[:, 1] + 0.2) - s * (near[:, 0] - 0.3)
        pairs = [
            (math.dist(near[i], near[j]), int(i), int(j))
            for i in np.flatnonzero(across > 0.02)
            for j in np.flatnonzero(across < -0.02)
        ]
        left, right, apart = nearest_pair(near, 0.3, -0.2, c, s)
        if pairs:
            assert (apart, left, right) == min(pairs)
        else:
            assert (left, right, apart) == (-1, -1, math.inf)
    left, right, _ = nearest_pair(np.array([[0.0, 0.5], [0.0, 0.01]]), 0.0, 0.0, 1.0, 0.0)
    assert (left, right) == (-1, -1)
