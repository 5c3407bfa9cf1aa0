"""Smoothers: shorten a planned path without losing its validity, or leave it as it is."""

from __future__ import annotations

import math

import numpy as np
from pydantic import Field

from pilotage.core.angles import wrap_array_to_pi
from pilotage.core.config import Config
from pilotage.core.types import BoolArray, FloatArray, IntArray
from pilotage.kernels.rrt import dubins, shortcut
from pilotage.kernels.rrt.clearance import Space, least_step, skin, slack_at
from pilotage.stack.planning.driving_space import (
    CHECK_SPACING_M,
    SPARE,
    STATE_SPACING_M,
    is_valid,
    space_for,
    spaced_waypoints,
)
from pilotage.stack.planning.outline_smoothing import shortened
from pilotage.stack.planning.planner import SMOOTHERS, Path, PlanRequest

LEAST_RADIUS_M = 1e-3
"""Stands for turning on the spot, so that every path is made of Dubins curves."""
OWN_COST = 100.0
"""What a metre of a path that the robot cannot drive costs against one of a curve that it can."""


class NoSmootherConfig(Config):
    """The report's behaviour has no settings."""


@SMOOTHERS.add("none", NoSmootherConfig)
class NoSmoother:
    """Returns the path as it is: the report leaves smoothing to the local planner."""

    def __init__(self, config: NoSmootherConfig) -> None:
        del config

    def smooth(self, path: Path, request: PlanRequest, clearance_m: float) -> Path:  # noqa: ARG002
        """Return ``path`` itself."""
        return path


class ShortcutSmootherConfig(Config):
    """Settings of the shortcut smoother.

    ``sample_spacing_m`` is the spacing of the states between which shortcuts are tried (wider on paths
    of more than ``max_samples`` of them: their number decides the time), ``rounds`` the most repetitions,
    ``waypoint_spacing_m`` the spacing of the waypoints handed to the local planner; null: at most that of the
    planner's own, so that an edge stays no longer than the planner connects.
    """

    waypoint_spacing_m: float | None = Field(1.5, gt=0.0, le=1000.0)
    sample_spacing_m: float = Field(0.3, ge=0.01, le=100.0)
    max_samples: int = Field(400, ge=10, le=10_000)
    rounds: int = Field(3, ge=1, le=50)


@SMOOTHERS.add("shortcut", ShortcutSmootherConfig)
class ShortcutSmoother:
    """Best chain of Dubins shortcuts, then local tightening; deterministic, it draws nothing.

    The result keeps the path's turning radius and the clearance, checked every centimetre, and is never
    longer than the input: where nothing better is found, the input comes back with evenly spaced
    waypoints. It does not leave the way around obstacles that the input takes, unless a shortcut does.

    A path for an outline becomes the cheapest chain of curves for it, with changes of direction and metres
    backwards dearer; one that goes forwards only does so still.

    A path with tighter corners than the robot can drive (lines of a planner that knows nothing of turning
    circles) is replaced by curves that it can, wherever there is room for them; that may be longer.
    """

    def __init__(self, config: ShortcutSmootherConfig) -> None:
        self._config = config

    def smooth(self, path: Path, request: PlanRequest, clearance_m: float) -> Path:
        """Return a path from the same start to the same goal that is valid and no longer than ``path``."""
        if request.beside_outline and path.turning_radius_m > 0.0:
            config = self._config
            how = config.sample_spacing_m, config.max_samples, config.rounds
            states, length_m = shortened(path, request, clearance_m, *how)
            waypoints = spaced_waypoints(states, self._spacing_m(path, length_m))
            return Path(states, waypoints, length_m, path.turning_radius_m)
        space = space_for(request.field, clearance_m)
        tight = path.turning_radius_m < request.least_turning_radius_m
        radius_m = max(
            path.turning_radius_m, SPARE * request.least_turning_radius_m if tight else LEAST_RADIUS_M
        )
        step = min(CHECK_SPACING_M * 5.0, least_step(clearance_m, radius_m))
        extra = skin(step, clearance_m, radius_m)
        for state in (path.states[0], path.states[-1]):
            extra = min(extra, max(0.0, float(slack_at(state[0], state[1], space, clearance_m))))
        heading_free = request.goal.theta_rad is None
        own_cost = OWN_COST if tight else 1.0
        rules = shortcut.Rules(radius_m, clearance_m + extra, step, heading_free, own_cost)
        best = _Chain.of(path, request.start.theta_rad if tight else None)
        for number in range(self._config.rounds):
            shorter = self._round(best, space, rules)
            better = shorter.length_m < best.length_m or (tight and number == 0)
            if not (better and shorter.is_valid(space, clearance_m)):
                break
            gain_m = best.length_m - shorter.length_m
            best = shorter
            if gain_m < 1e-4 * best.length_m and not (tight and number == 0):
                break
        drivable_m = path.turning_radius_m if best.own else radius_m
        waypoints = spaced_waypoints(best.states, self._spacing_m(path, best.length_m))
        return Path(best.states, waypoints, best.length_m, drivable_m if tight else path.turning_radius_m)

    def _spacing_m(self, path: Path, length_m: float) -> float:
        """Of the waypoints along a path of some length."""
        if self._config.waypoint_spacing_m is not None:
            return self._config.waypoint_spacing_m
        longest_m = float(np.hypot(*np.diff(path.waypoints[:, :2], axis=0).T).max(initial=0.0))
        return length_m / max(1, math.ceil(length_m / longest_m - 1e-9)) if longest_m > 0.0 else math.inf

    def _round(self, chain: _Chain, space: Space, rules: shortcut.Rules) -> _Chain:
        """One pass of shortcuts and tightening."""
        s = shortcut.arc_lengths(np.ascontiguousarray(chain.states), rules.radius)
        if s[-1] <= 0.0:
            return chain
        count = min(self._config.max_samples, math.ceil(s[-1] / self._config.sample_spacing_m) + 1)
        picked = np.unique(np.searchsorted(s, np.linspace(0.0, s[-1], max(2, count)) - 1e-9))
        picked[-1] = len(s) - 1
        samples = np.ascontiguousarray(chain.states[picked])
        nodes, kept = shortcut.best_chain(samples, s[picked], space, rules)
        ranges = np.column_stack([picked[nodes[:-1]], picked[nodes[1:]]])
        nodes_path = shortcut.tighten(samples[nodes], kept, space, rules, 0.4, 0.01)
        nodes_path, kept, was = shortcut.split(nodes_path, kept, space, rules, self._config.sample_spacing_m)
        nodes_path = shortcut.tighten(nodes_path, kept, space, rules, 0.2, 0.004)
        return _Chain.through(nodes_path, kept, ranges[was], chain, s, rules)


class _Chain:
    """A dense path and its parts that are checked at a finer spacing than its states."""

    def __init__(self, states: FloatArray, length_m: float, fine: FloatArray, own: bool) -> None:
        self.states, self.length_m, self._fine, self.own = states, length_m, fine, own

    @staticmethod
    def of(path: Path, heading_rad: float | None) -> _Chain:
        """The input as it is, but for the first heading where lines begin with another than the robot's."""
        states = path.states
        if heading_rad is not None:
            states = states.copy()
            states[0, 2] = heading_rad
        return _Chain(states, path.length_m, states, True)

    @staticmethod
    def through(
        nodes_path: FloatArray,
        kept: BoolArray,
        ranges: IntArray,
        old: _Chain,
        s: FloatArray,
        rules: shortcut.Rules,
    ) -> _Chain:
        """Join curves through waypoints (K, 3) with the kept pieces, ranges of the old path's states."""
        coarse, fine = [old.states[:1]], [old.states[:1]]
        length_m = 0.0
        for i in range(len(kept)):
            if kept[i]:
                low, high = int(ranges[i, 0]), int(ranges[i, 1])
                coarse.append(old.states[low + 1 : high + 1])
                fine.append(old.states[low + 1 : high + 1])
                length_m += float(s[high] - s[low])
                continue
            free = rules.goal_heading_free and i == len(kept) - 1
            x, y, th = nodes_path[i]
            gx, gy, gth = nodes_path[i + 1]
            curve = dubins.connect(x, y, th, gx, gy, gth, free, rules.radius)
            coarse.append(dubins.sample(curve, STATE_SPACING_M)[1:])
            fine.append(dubins.sample(curve, CHECK_SPACING_M)[1:])
            length_m += dubins.length_of(curve)
        states = np.concatenate(coarse)
        states[-1, :2] = old.states[-1, :2]
        if not rules.goal_heading_free:
            states[-1, 2] = old.states[-1, 2]
        states[:, 2] = wrap_array_to_pi(states[:, 2])
        return _Chain(states, length_m, np.concatenate(fine), bool(kept.any()) and old.own)

    def is_valid(self, space: Space, clearance_m: float) -> bool:
        """Whether every centimetre keeps the clearance."""
        return is_valid(self._fine, space, clearance_m)
