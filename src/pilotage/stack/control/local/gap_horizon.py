"""Our own: sampled plans that end in a stop on seen ground, led by the time to go, each command checked."""

from __future__ import annotations

import math

import numpy as np
from pydantic import Field

from pilotage.core.config import Config
from pilotage.core.types import STOP, FloatArray, Twist
from pilotage.kernels.control.commands_sent import scaled
from pilotage.kernels.control.motion_limits import Drive, command_is_safe
from pilotage.kernels.control.rollouts import Price, follow_path, rollout_cost, rollout_costs, weighted_mean
from pilotage.sensors.sensor import NonNegative, Positive
from pilotage.stack.control.local.role import LOCAL_CONTROLLERS, LocalView
from pilotage.stack.control.local.rolling import RollingConfig, RollingGround, Scene

Share = Field(default=0.65, gt=0.0, le=1.0)
BANK = 64
"""Noises are drawn once, so many times what a step needs, and a step takes a random stretch of them."""
SPEEDS = (1.0, 0.7, 0.45, 0.25)
LOOKS = ((0.3, 0.1), (0.45, 0.3))


class GapHorizonConfig(Config):
    """Horizon, samples and what a plan costs beside its time."""

    ground: RollingConfig = RollingConfig()
    horizon_s: Positive = 1.6
    step_s: Positive = 0.1
    rollouts: int = Field(default=192, ge=8, le=20000)
    speed_std_m_s: Positive = 0.5
    turn_std_rad_s: Positive = 1.0
    temperature_s: Positive = 0.05
    margin_m: NonNegative = 0.04
    """Between footprint and obstacle points, in plans."""
    least_margin_m: NonNegative = 0.025
    """The same in the last check of a command."""
    soft_m: Positive = 0.15
    near_cost: NonNegative = 1.0
    heading_s_per_rad: NonNegative = 0.25
    turning_cost_s: NonNegative = 0.01
    reverse_cost: NonNegative = 1.0
    no_stop_s: NonNegative = 30.0
    brake_trust: float = Share
    """Share of the data sheet's braking and turning that is relied on."""
    check_step_s: Positive = 0.05
    stuck_s: Positive = 4.0
    stuck_m: Positive = 0.15


@LOCAL_CONTROLLERS.add("gap-horizon", GapHorizonConfig)
class GapHorizon:
    """Plans over the seen ground only, and drives only what can still be braked there.

    1. The time to go (Dijkstra, speed by clearance, unseen ground taken for free but slow) says where to.
    2. Plans: pursuit of its way down at several speeds, the last plan, and samples around the best of them
       (MPPI: Williams et al. 2017). A plan is driven out under the limits from where the robot will be when a
       command takes effect; it must stay on seen ground, clear of every point, and end where the robot can
       still brake. So the speed follows from the limits and the sight.
    3. The first command of the best plan is checked with finer steps and worse brakes, followed by a stop;
       where that fails, the next plan's, then slower ones, then the stop that was checked a step before.

    Where nothing moves and limits are no worse than ``brake_trust`` of the data sheet, it cannot hit what it
    has seen beyond the map's errors (least margin against laser noise and odometry within a step). It does
    not plan over orientation: in a dead end narrower than its turning circle it backs out by samples, slowly.
    """

    def __init__(self, config: GapHorizonConfig, generator: np.random.Generator) -> None:
        self._config = config
        self._ground = RollingGround(config.ground)
        self._generator = generator
        self._steps = max(2, round(config.horizon_s / config.step_s))
        noise = generator.standard_normal((BANK * config.rollouts, self._steps, 2))
        self._bank = _smoothed(noise) * np.array([config.speed_std_m_s, config.turn_std_rad_s])
        self._commands = np.empty((config.rollouts, self._steps, 2))
        self._plan: FloatArray | None = None
        self._keep_turning = True
        self._status = "waiting"
        self._progress: tuple[float, float] = (-math.inf, math.inf)
        self.scene: Scene | None = None

    @property
    def status(self) -> str:
        """What it is doing, in a word."""
        return self._status

    def step(self, view: LocalView) -> Twist:
        """Take the view in and give the next command."""
        scene = self._ground.update(view)
        self.scene = scene
        command = STOP if scene.distance_m < view.goal_tolerance_m else self._decide(view, scene)
        if scene.distance_m < view.goal_tolerance_m:
            self._status = "arrived"
        self._ground.sent(view.t_s, command)
        return command

    def _decide(self, view: LocalView, scene: Scene) -> Twist:
        config = self._config
        price = Price(
            config.margin_m,
            config.soft_m,
            config.near_cost,
            config.heading_s_per_rad,
            config.turning_cost_s,
            config.reverse_cost,
            config.no_stop_s,
            float(scene.goal[0]),
            float(scene.goal[1]),
            view.goal_tolerance_m,
            self._worse(scene).deceleration / scene.drive.deceleration,
        )
        plans, costs = self._plans(scene, price)
        for i in np.argsort(costs)[:6]:
            command = self._checked(scene, plans[i][0])
            if command is not None:
                self._plan = plans[i]
                self._status = "driving" if command.v_m_s > 0.05 else "turning"
                if command.v_m_s < -0.01:
                    self._status = "backing"
                return command
        best = plans[int(np.argmin(costs))]
        for share in (0.6, 0.3, 0.0):
            command = self._checked(scene, share * best[0])
            if command is not None:
                self._plan = share * best
                self._status = "driving"
                return command
        self._plan = None
        self._status = "waiting"
        curvature = scene.start[4] / scene.start[3] if abs(scene.start[3]) > 0.05 else 0.0
        slower = max(abs(scene.start[3]) - scene.drive.deceleration * scene.dt_s, 0.0)
        return Twist(0.0, curvature * math.copysign(slower, scene.start[3]) if self._keep_turning else 0.0)

    def _plans(self, scene: Scene, price: Price) -> tuple[list[FloatArray], FloatArray]:
        """All plans worth a look with their costs."""
        config = self._config
        plans: list[FloatArray] = []
        if self._plan is not None:
            plans.append(_later(self._plan, scene.dt_s / config.step_s))
        for speed in SPEEDS:
            for look_m, look_s in LOOKS:
                plans.append(
                    follow_path(
                        scene.start,
                        scene.path,
                        look_m,
                        look_s,
                        speed * scene.drive.speed,
                        1.0,
                        self._steps,
                        config.step_s,
                        scene.drive,
                    )
                )
        plans.append(np.zeros((self._steps, 2)))
        costs = [
            rollout_cost(scene.start, plan, config.step_s, scene.drive, scene.body, scene.ground, price)
            for plan in plans
        ]
        mean = plans[int(np.argmin(costs))]
        offset = int(self._generator.integers(0, (BANK - 1) * config.rollouts))
        noise = self._bank[offset : offset + config.rollouts]
        sampled = rollout_costs(
            scene.start,
            mean,
            noise,
            config.step_s,
            scene.drive,
            scene.body,
            scene.ground,
            price,
            self._commands,
        )
        plans.append(self._commands[int(np.argmin(sampled))].copy())
        costs.append(float(sampled.min()))
        blended = weighted_mean(self._commands, sampled, config.temperature_s)
        plans.append(blended)
        costs.append(
            rollout_cost(scene.start, blended, config.step_s, scene.drive, scene.body, scene.ground, price)
        )
        return plans, np.array(costs)

    def _worse(self, scene: Scene) -> Drive:
        """Limits that are relied on: worse than the data sheet's, and than those that seem likely."""
        share = min(self._config.brake_trust, 0.9 * scene.drive.deceleration / scene.sheet.deceleration)
        return Drive(*scaled(scene.sheet, share))

    def _checked(self, scene: Scene, first: FloatArray) -> Twist | None:
        """The command if it can be held for a step and braked from without touching anything."""
        config = self._config
        for keep_turning in (True, False):
            safe, _ = command_is_safe(
                scene.start,
                float(first[0]),
                float(first[1]),
                scene.dt_s,
                config.check_step_s,
                keep_turning,
                scene.drive,
                self._worse(scene),
                scene.body,
                scene.ground,
                config.least_margin_m,
            )
            if safe:
                self._keep_turning = keep_turning
                return Twist(float(first[0]), float(first[1]))
        return None


def _smoothed(noise: FloatArray) -> FloatArray:
    """Noise (K, N, 2) made to hang together in time, of unit variance (an AR(1) process)."""
    out = np.empty_like(noise)
    out[:, 0] = noise[:, 0]
    for k in range(1, noise.shape[1]):
        out[:, k] = 0.8 * out[:, k - 1] + 0.6 * noise[:, k]
    return out


def _later(plan: FloatArray, steps: float) -> FloatArray:
    """A plan (N, 2) as it is ``steps`` of its own steps later; the last command is held."""
    at = np.minimum(np.arange(plan.shape[0]) + steps, plan.shape[0] - 1.0)
    low = np.floor(at).astype(np.int64)
    high = np.minimum(low + 1, plan.shape[0] - 1)
    part = (at - low)[:, None]
    return np.ascontiguousarray((1.0 - part) * plan[low] + part * plan[high])
