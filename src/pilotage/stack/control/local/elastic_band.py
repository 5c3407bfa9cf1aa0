"""Timed elastic bands of several homotopy classes: the quickest is driven."""

from __future__ import annotations

import math

import numpy as np
from pydantic import Field

from pilotage.core.config import Config
from pilotage.core.types import FloatArray, Twist
from pilotage.kernels.control import band as kernels
from pilotage.kernels.control import togo
from pilotage.kernels.control.rollouts import follow_path
from pilotage.kernels.control.togo import togo_at
from pilotage.sensors.sensor import NonNegative, Positive
from pilotage.stack.control.local.command_check import first_safe, slower
from pilotage.stack.control.local.role import LOCAL_CONTROLLERS, LocalView
from pilotage.stack.control.local.rolling import Scene
from pilotage.stack.control.local.rolling_config import RollingConfig
from pilotage.stack.control.local.rolling_step import RollingController

SPACING_M = 0.1


class TebConfig(Config):
    """The band, its forces, and how it is driven."""

    ground: RollingConfig = RollingConfig()
    length_m: Positive = 3.0
    classes: int = Field(default=3, ge=1, le=6)
    """Bands tried: around every narrow place of those before the next one has to find another way."""
    iterations: int = Field(default=40, ge=1, le=1000)
    stiffness: Positive = 0.6
    push: Positive = 0.3
    room_m: Positive = 0.55
    margin_m: NonNegative = 0.05
    slow_m_s: Positive = 0.3
    """Speed at the least distance a footprint can pass; it rises to the full one at ``room_m``."""
    change_s: NonNegative = 0.4
    """Another class has to be quicker by this."""
    look_m: Positive = 0.35
    look_s: NonNegative = 0.15
    turn_in_place_rad: Positive = 1.0


@LOCAL_CONTROLLERS.add("teb", TebConfig)
class Teb(RollingController):
    """Elastic bands (Quinlan and Khatib 1993) with time-optimal speeds, one a homotopy class.

    After Roesmann et al. (2017), who choose among classes by time; here position and time are optimized one
    after the other, not in one graph. Classes come from the time to go: the way down, then the way down with
    the narrowest place of the bands so far closed. The band does not know of orientation and is followed by
    pursuit, as fast as it can still stop: in places narrower than the outer disc it may stay before them.
    """

    def __init__(self, config: TebConfig, generator: np.random.Generator) -> None:
        del generator  # nothing here is drawn
        super().__init__(config.ground)
        self._config = config
        self._band: FloatArray | None = None

    def _decide(self, view: LocalView, scene: Scene) -> Twist:
        del view
        config = self._config
        best: FloatArray | None = None
        best_s = math.inf
        speeds = np.zeros(1)
        for kept, guess in self._guesses(scene):
            relaxed = kernels.relax_band(
                guess, scene.ground, config.room_m, config.stiffness, config.push, config.iterations
            )
            times, profile = self._timed(relaxed, scene)
            times -= config.change_s if kept else 0.0
            if times < best_s:
                best, best_s, speeds = relaxed, times, profile
        self._band = best
        if best is None or best.shape[0] < 2:
            # None is free to its end, or the way down ends in the goal's cell.
            best = scene.path if scene.path.shape[0] > 1 else np.vstack([scene.start[:2], scene.goal])
        # The speed a little ahead: from rest the profile begins at 0.
        wanted = float(speeds[min(2, speeds.shape[0] - 1)])
        command = follow_path(
            scene.start,
            best,
            config.look_m,
            config.look_s,
            max(wanted, 0.05),
            config.turn_in_place_rad,
            1,
            scene.dt_s,
            scene.drive,
        )[0]
        # The band is a disc's, and it leads over ground that was not seen yet.
        return first_safe(scene, slower(Twist(float(command[0]), float(command[1]))), config.margin_m)

    def _guesses(self, scene: Scene) -> list[tuple[bool, FloatArray]]:
        """First guesses of bands, and whether each is that of the step before."""
        config = self._config
        most = max(4, round(config.length_m / SPACING_M))
        guesses: list[tuple[bool, FloatArray]] = []
        if self._band is not None:
            rest = _from_here(self._band, scene.start[:2])
            if rest.shape[0] >= 4:
                guesses.append((True, rest))
        path = np.ascontiguousarray(scene.path[:most])
        guesses.append((False, path))
        closed: list[FloatArray] = []
        for _ in range(config.classes - 1):
            if path.shape[0] < 8:
                break
            away = kernels.path_distances(path, scene.ground)
            inner = slice(4, path.shape[0])
            narrow = 4 + int(np.argmin(away[inner]))
            if away[narrow] > config.room_m:
                break  # open ground: there is one class
            closed.append(np.array([path[narrow, 0], path[narrow, 1], float(away[narrow]) + 0.1]))
            field = self._ground.time_to_go_beside(np.array(closed), scene)
            ground = scene.ground
            other = togo.descent_path(
                scene.start[0],
                scene.start[1],
                field,
                ground.x0_m,
                ground.y0_m,
                ground.coarse_m,
                SPACING_M,
                most,
            )
            if other.shape[0] < 4:
                break
            guesses.append((False, other))
            path = other
        return guesses

    def _timed(self, band: FloatArray, scene: Scene) -> tuple[float, FloatArray]:
        """Time along a band and on from its end, and the speeds along it."""
        config = self._config
        ground, drive = scene.ground, scene.drive
        away = kernels.path_distances(band, ground)
        least = scene.body.inner_m + config.margin_m
        share = np.clip((away - least) / (config.room_m - least), 0.0, 1.0)
        caps = config.slow_m_s + (drive.speed - config.slow_m_s) * share
        # A band through an obstacle is none.
        if np.any(away[2:] < scene.body.inner_m):
            return math.inf, caps
        speeds = kernels.speed_profile(band, max(scene.start[3], 0.05), 0.0, caps, drive)
        end = band[-1]
        rest = togo_at(end[0], end[1], ground.togo_s, ground.x0_m, ground.y0_m, ground.coarse_m)
        return kernels.path_time(band, np.maximum(speeds, 0.05)) + rest, speeds


def _from_here(band: FloatArray, place: FloatArray) -> FloatArray:
    """The band from the point nearest to a place on, beginning at the place."""
    nearest = int(np.argmin(np.hypot(*(band - place).T)))
    return np.ascontiguousarray(np.vstack([place, band[nearest + 1 :]]))
