"""Bayesian decisions between neighbours: GBS and SEBS (Portugal and Rocha 2013)."""

from __future__ import annotations

import math

import numpy as np
from pydantic import Field

from pilotage.core.config import Config
from pilotage.core.types import FloatArray, IntArray
from pilotage.sensors.sensor import Positive
from pilotage.stack.patrol.messages import PatrolKnowledge
from pilotage.stack.patrol.strategy import STRATEGIES, PatrolSetting, Wordless, best_of
from pilotage.stack.patrol.tours import Round


class BayesianConfig(Config):
    """What a gain, the idleness of a vertex over the time to get there, is worth.

    The papers set the saturating gain by hand for each map and team. By default it is twice the time around
    all vertices over that along a short edge (the lower quartile), times N^(-1/3): the trend of their tables.
    """

    probability_at_zero: float = Field(default=0.1, gt=0.0, lt=1.0)
    saturating_gain_ratio: Positive | None = None


class _Gains:
    """Posterior of moving to a neighbour, up to a factor that all share."""

    def __init__(self, config: BayesianConfig, setting: PatrolSetting) -> None:
        graph = setting.graph
        edges_m = graph.edges_m[np.isfinite(graph.edges_m) & (graph.edges_m > 0.0)]
        self._graph, self._speed_m_s = graph, setting.speed_m_s
        self._least_m = float(np.quantile(edges_m, 0.25)) if edges_m.size else 1.0
        usual = 2.0 * Round.best(graph).length_m / self._least_m * setting.team_size ** (-1.0 / 3.0)
        self._saturating = config.saturating_gain_ratio or max(usual, 1e-9)
        self._zero = config.probability_at_zero

    def posterior(self, knowledge: PatrolKnowledge, beside: IntArray) -> FloatArray:
        """(K,) ``p exp(ln(1/p) gain / saturating)``, at most 1."""
        away_m = np.maximum(self._graph.edges_m[knowledge.at, beside], self._least_m)
        gain = knowledge.idleness_s[beside] * self._speed_m_s / away_m
        share = np.minimum(gain / self._saturating, 1.0)
        return np.asarray(self._zero * np.exp(-math.log(self._zero) * share))


@STRATEGIES.add("greedy-bayesian", BayesianConfig)
class GreedyBayesianStrategy(Wordless):
    """GBS: the neighbour of the largest posterior gain; robots tell each other which vertices they visit."""

    def __init__(self, config: BayesianConfig, setting: PatrolSetting) -> None:
        self._graph, self._rng, self._gains = setting.graph, setting.rng, _Gains(config, setting)

    def next_vertex(self, knowledge: PatrolKnowledge) -> int:
        """The neighbour of the largest posterior."""
        beside = self._graph.neighbours(knowledge.at)
        if len(beside) == 0:
            return knowledge.at
        return best_of(beside, self._gains.posterior(knowledge, beside), self._rng)


@STRATEGIES.add("sebs", BayesianConfig)
class SebsStrategy(Wordless):
    """State exchange: as GBS, and a vertex that c other robots are bound for counts 2^(N-c) / (2^N - 1)."""

    def __init__(self, config: BayesianConfig, setting: PatrolSetting) -> None:
        self._graph, self._rng, self._gains = setting.graph, setting.rng, _Gains(config, setting)
        self._team = setting.team_size

    def next_vertex(self, knowledge: PatrolKnowledge) -> int:
        """The neighbour of the largest posterior, others' intentions considered."""
        beside = self._graph.neighbours(knowledge.at)
        if len(beside) == 0:
            return knowledge.at
        bound_for = [state.target for state in knowledge.others()]
        count = np.array([bound_for.count(vertex) for vertex in beside.tolist()])
        state = np.where(count > 0, 2.0 ** (self._team - count) / (2.0**self._team - 1.0), 1.0)
        return best_of(beside, self._gains.posterior(knowledge, beside) * state, self._rng)
