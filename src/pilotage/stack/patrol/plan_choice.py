"""Which plan a team takes: the one whose idleness is forecast to be least, of many numbers of rounds."""

from __future__ import annotations

from collections.abc import Sequence
from operator import itemgetter

import numpy as np
from pydantic import Field

from pilotage.core.config import Config
from pilotage.sensors.sensor import NonNegative, Positive
from pilotage.stack.patrol.forecast import Driving, forecast_m
from pilotage.stack.patrol.partition import Plan, annealed, groupings, partition
from pilotage.stack.patrol.strategy import PatrolSetting

SAME = 0.01
"""Of a forecast, which may be so much above another by chance."""


class PlanChoice(Config):
    """How plans are weighed, and how robots are reckoned to drive.

    Rounds are looked for whose worst idleness plus each of ``mean_weights`` times their mean is little; the
    worst of one that several robots share counts ``sharing_cost`` more there and its mean half of that. Each
    plan found is forecast, and costs its worst plus ``forecast_mean_weight`` times its mean; the mean counts
    ``forecast_sharing_cost`` more for the part of the team that shares rounds, for what a forecast does not
    know. Of those that are within ``alike`` of the least the one whose mean is least is taken: so much of a
    worst is luck, and more of it than of a mean. One whose worst or mean is forecast to be above that of a
    share for each robot (MSP) is taken only where there is no other.

    In a forecast legs take up to half of ``leg_spread_m`` more or less, and two who come near each other lose
    ``meeting_m`` of driving on average where they have just room abreast: most pass at once, now and then
    they stand in each other's way for long. Robots wait for each other as ``slack``, ``most_slack`` and
    ``beside_passage_m`` say. A round on which robots are nearer to each other than ``headway_m``, who watch
    and avoid each other all the time, is taken only where there is no other.
    """

    mean_weights: tuple[NonNegative, ...] = Field(default=(0.5, 2.0), min_length=1)
    sharing_cost: NonNegative = 0.06
    forecast_mean_weight: NonNegative = 0.5
    forecast_sharing_cost: NonNegative = 0.03
    alike: NonNegative = 0.03
    leg_spread_m: NonNegative = 0.7
    meeting_m: NonNegative = 0.5
    headway_m: NonNegative = 6.0
    slack: Positive = 0.5
    most_slack: Positive = Field(default=0.1, le=0.5)
    beside_passage_m: NonNegative = 0.5


def driving_of(setting: PatrolSetting, choice: PlanChoice) -> Driving:
    """How the team drives, for forecasts of its plans."""
    return Driving(
        visit_m=setting.visit_m,
        turn_m=setting.turn_m,
        meeting_m=choice.meeting_m,
        leg_spread_m=choice.leg_spread_m,
        slack=choice.slack,
        most_slack=choice.most_slack,
        beside_m=choice.beside_passage_m,
        talks=setting.talks,
    )


def best_plan(setting: PatrolSetting, paces: Sequence[float], choice: PlanChoice) -> Plan:
    """The plan for robots of paces (N,) that is forecast to be best: one round for all, for each, or between.

    Of every number of rounds those that are shortest, and those that turn back least for that.
    """
    graph, robots = setting.graph, len(paces)
    most = min(robots, len(graph))
    # What lies between is much alike: a few numbers of groups stand for all.
    numbers = {1, 2, 3, robots // 2, robots - 1, robots, most}
    plans = [
        annealed(graph, sizes, weight, choice.sharing_cost, turn_m, slowest)
        for weight in sorted(set(choice.mean_weights))
        for groups in sorted(numbers)
        if 1 <= groups <= most
        for sizes, slowest in sorted(groupings(paces, groups), reverse=True)
        for turn_m in sorted({0.0, setting.turn_m})
    ]
    driving = driving_of(setting, choice)

    def forecast(plan: Plan) -> tuple[float, float]:
        return forecast_m(plan, graph, setting.passages, driving)

    alone = [partition(graph, sizes, slowest) for sizes, slowest in groupings(paces, most)]
    most_m = np.min([forecast(plan) for plan in alone], axis=0) * (1.0 + SAME)

    def judged(plan: Plan) -> tuple[tuple[bool, bool], float, float]:
        """Why it is taken only where there is no other, its cost, and its mean as it counts."""
        worst_m, mean_m = forecast(plan)
        together = zip(plan.rounds, plan.sizes, strict=True)
        is_crowded = any(
            size > 1 and 0.0 < walk.length_m < size * choice.headway_m for walk, size in together
        )
        is_above = worst_m > most_m[0] or mean_m > most_m[1]
        mean_m *= 1.0 + choice.forecast_sharing_cost * sum(n for n in plan.sizes if n > 1) / robots
        return (is_crowded, is_above), worst_m + choice.forecast_mean_weight * mean_m, mean_m

    looked_at = [(*judged(plan), plan) for plan in [*plans, *alone]]
    kind, least_m = min(judgement[:2] for judgement in looked_at)
    best = [
        (mean_m, plan)
        for k, cost_m, mean_m, plan in looked_at
        if k == kind and cost_m <= least_m * (1.0 + choice.alike)
    ]
    return min(best, key=itemgetter(0))[1]
