"""All plans worth a look at one step, priced in one call: handing tuples of arrays over costs as much."""

from __future__ import annotations

import numpy as np

from pilotage.kernels.arrays import FloatArray
from pilotage.kernels.control.footprint import Body
from pilotage.kernels.control.ground import Ground
from pilotage.kernels.control.motion_limits import Drive
from pilotage.kernels.control.rollouts import (
    Price,
    later,
    plan_costs,
    pursuits,
    rollout_costs,
    weighted_mean,
)
from pilotage.kernels.jit import kernel


@kernel
def priced_pool(
    start: FloatArray,
    last: FloatArray,
    later_by: float,
    path: FloatArray,
    looks: FloatArray,
    speeds: FloatArray,
    turn_in_place: float,
    held: FloatArray,
    noise: FloatArray,
    temperature: float,
    dt: float,
    drive: Drive,
    body: Body,
    ground: Ground,
    movers: FloatArray,
    price: Price,
    commands: FloatArray,
    plans: FloatArray,
) -> FloatArray:
    """Costs (C,) of the first C of ``plans`` (K, N, 2), which are filled.

    In this order: the ``last`` plan, pursuits of a path, standing still, commands that are held; and, of
    samples around the best of these, the best and the weighted mean.

    Parameters
    ----------
    last, later_by
        (L, 2) what is left of it is what comes ``later_by`` of its own steps later; without any row none.
    path, looks, speeds, turn_in_place
        As ``pursuits`` takes them.
    held
        (H, 2) speeds and turn rates that are held for a whole plan.
    noise, commands
        (S, N, 2) the samples' noise, and room for the samples; without any row there are none.
    """
    steps = plans.shape[1]
    count = 0
    if last.shape[0] > 0:
        moved = later(last, later_by)
        for k in range(steps):
            plans[0, k] = moved[min(k, moved.shape[0] - 1)]
        count = 1
    chased = speeds.shape[0] * looks.shape[0]
    pursuits(start, path, looks, speeds, turn_in_place, dt, drive, plans[count : count + chased])
    count += chased
    plans[count] = 0.0
    count += 1
    for i in range(held.shape[0]):
        plans[count, :] = held[i]
        count += 1
    costs = np.empty(count + (2 if noise.shape[0] > 0 else 0))
    costs[:count] = plan_costs(start, plans[:count], dt, drive, body, ground, movers, price)
    if noise.shape[0] > 0:
        mean = plans[np.argmin(costs[:count])]
        sampled = rollout_costs(start, mean, noise, dt, drive, body, ground, movers, price, commands)
        more = plans[count : count + 2]
        more[0] = commands[np.argmin(sampled)]
        more[1] = weighted_mean(commands, sampled, temperature)
        costs[count:] = plan_costs(start, more, dt, drive, body, ground, movers, price)
    return costs
