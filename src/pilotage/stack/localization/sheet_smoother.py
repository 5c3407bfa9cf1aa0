"""Pose by smoothing the whole run: every keyframe, every landmark, every systematic error at once.

A filter cannot correct its past; exact cells need the past corrected too. All that encoders, gyroscope,
beams and line sensors said is kept (a quarter of an hour on a small sheet is little), and every few seconds
Gauss-Newton steps are taken over the whole graph (Lu and Milios 1997; Thrun, Burgard and Fox 2005, chapter
11). Rests need no treatment of their own: encoders that do not count say that the heading stays, which
shows the gyroscope's bias.
"""

from __future__ import annotations

import math
from itertools import count

import numpy as np
from pydantic import Field

from pilotage.core.angles import wrap_to_pi
from pilotage.core.chi_square import chi_square_quantile
from pilotage.core.config import Config
from pilotage.core.types import FloatArray, Pose2
from pilotage.kernels.filters import arrow_solve
from pilotage.kernels.sheet import graph as sheet_graph
from pilotage.stack.interface import Belief
from pilotage.stack.localization.given_pose import SURE_M, GivenKeyframes, PoseSource
from pilotage.stack.localization.keyframes import GyroscopeErrors, Keyframes, OdometryErrorsConfig
from pilotage.stack.localization.line_map import Kind, LineMap, LineMapConfig
from pilotage.stack.localization.observations import Observations

RELAXED, STRICT = 30.0, 3.0
"""Standard deviations at which a residual weighs a quarter: just after landmarks were merged, and always."""

JUMP_PROBABILITY = 0.9999
GROWN_M, GROWN_RAD = 0.012, math.radians(1.5)
"""What a position and a heading may lose, at most, between two solutions (standard deviations)."""
DISTRUST = 10.0
"""Observations under suspicion are taken for so much less exact."""

EDGE_ANGLE_STD_RAD, EDGE_OFFSET_STD_M = 3e-4, 5e-4


class SmootherConfig(Config):
    """What is known beforehand, and how landmarks are made."""

    start_position_std_m: float = Field(default=0.001, gt=0.0)
    start_heading_std_rad: float = Field(default=0.002, gt=0.0)
    odometry: OdometryErrorsConfig = OdometryErrorsConfig()
    landmarks: LineMapConfig = LineMapConfig()
    range_std_factor: float = Field(default=1.25, gt=0.0)
    """Beams are trusted less than their data sheet says: corners, and neighbours that share an error."""
    range_std_m: float = Field(default=0.0015, gt=0.0)
    crossing_std_m: float = Field(default=0.003, gt=0.0)
    walls_along_axes_std_rad: float = Field(default=0.0, ge=0.0)
    """Walls within 5 degrees of the sheet's axes are taken to lie along them, this surely; 0: not at all."""


def surely(config: SmootherConfig) -> SmootherConfig:
    """The same where odometry has no systematic error and the start is exact."""
    exact = dict.fromkeys(
        ("distance_scale_std", "turn_scale_std", "radius_difference_std", "slip_std_m_sqrt_m"), SURE_M
    )
    odometry = config.odometry.model_copy(update={**exact, "slip_mean": 0.0})
    start = {"start_position_std_m": SURE_M, "start_heading_std_rad": SURE_M}
    return config.model_copy(update={**start, "odometry": odometry})


class SheetSmoother:
    """The graph of a run so far.

    Parameters
    ----------
    told
        Where the robot was told that it begins; it stands there but for ``start_position_std_m`` and
        ``start_heading_std_rad`` besides.
    separation_m
        Of the wheels, by the data sheet.
    edges_seen
        Whether line sensors see the sheet's edge, whose place is known.
    given
        A pose from outside: then only landmarks are found out.
    """

    def __init__(
        self,
        config: SmootherConfig,
        told: Belief,
        separation_m: float,
        gyro: GyroscopeErrors,
        size_m: tuple[float, float],
        edges_seen: bool,
        rng: np.random.Generator,
        given: PoseSource | None = None,
    ) -> None:
        if given is not None:
            config = surely(config)
        self._config, self._gyro, self._separation = config, gyro, separation_m
        self._jump_gate = chi_square_quantile(JUMP_PROBABILITY, 3)
        first = (told.pose.x_m, told.pose.y_m, told.pose.theta_rad)
        self._start = np.array([*first, 0.0])
        self.keyframes = (
            Keyframes(first, separation_m, config.odometry, gyro)
            if given is None
            else GivenKeyframes(given, first, separation_m, config.odometry, gyro)
        )
        self.map = LineMap(config.landmarks, size_m, edges_seen, rng)
        self.beams, self.crossings = Observations(5), Observations(2)
        self._fresh = 0
        self.solved_s = 0.0
        self.solves = 0
        self._solved_beams = self._solved_crossings = 0
        put_down = np.array([config.start_position_std_m] * 2 + [config.start_heading_std_rad]) ** 2
        self.cov: FloatArray = np.diag(put_down if given is not None else put_down + np.diag(told.cov))
        self._start_stds, self._solved_xy_m = np.sqrt(np.diag(self.cov)), first[:2]
        self.position_std_m = float(self._start_stds[:2].max())

    @property
    def belief(self) -> Belief:
        """Pose now; its covariance is the last solution's, whose heading has led it on since.

        J P J' with the derivative of the pose now by that one; what wheels lose in between is left out.
        """
        x, y, theta = self.keyframes.pose
        J = np.eye(3)
        J[0, 2], J[1, 2] = self._solved_xy_m[1] - y, x - self._solved_xy_m[0]
        return Belief(Pose2(x, y, wrap_to_pi(theta)), J @ self.cov @ J.T)

    @property
    def has_news(self) -> bool:
        """Whether something was observed since the last solution."""
        return self._fresh > 0

    def add_beam(self, x: float, y: float, ux: float, uy: float, range_m: float, share: float) -> None:
        """Add a beam that hit something: its origin and direction on the body, what it read, its noise."""
        keyframes, config = self.keyframes, self._config
        ox, oy = keyframes.in_frame(x, y)
        c, s = math.cos(keyframes.turned_rad), math.sin(keyframes.turned_rad)
        spread = config.range_std_factor * share * range_m + config.range_std_m
        values = (ox, oy, c * ux - s * uy, s * ux + c * uy, range_m)
        self.beams.add(keyframes.count - 1, values, spread, self.position_std_m)
        self._fresh += 1

    def add_crossing(self, at: tuple[float, float]) -> None:
        """Add a point of the map where a line was crossed just now."""
        values = self.keyframes.to_frame(*at)
        self.crossings.add(self.keyframes.count - 1, values, self._config.crossing_std_m, self.position_std_m)
        self._fresh += 1

    def solve(self, steps: int = 1) -> None:
        """Take Gauss-Newton steps over everything so far; more of them where landmarks were merged.

        A pose that jumps farther than its covariance allows was drawn by a wrong association: then all is
        set back, and what was observed since the last solution is left out of it and merged with nothing.
        """
        self.keyframes.close()
        n, landmarks = self.keyframes.count, self.map
        poses, systematic = self.keyframes.poses[:n].copy(), self.keyframes.systematic.copy()
        lines, cov = landmarks.saved(), self.belief.cov
        self._iterate(steps, merge=True)
        if not self._is_plausible(self.keyframes.poses[n - 1] - poses[n - 1], cov):
            self.keyframes.poses[:n] = poses
            self.keyframes.systematic[:] = systematic
            landmarks.restore(lines)
            for seen, since in ((self.beams, self._solved_beams), (self.crossings, self._solved_crossings)):
                seen.spread[since : seen.count] *= DISTRUST
            self._iterate(1, merge=False)
        self.keyframes.corrected()
        self._solved_xy_m = self.keyframes.pose[:2]
        self._solved_beams, self._solved_crossings = self.beams.count, self.crossings.count
        self.solved_s = self.keyframes.t_s
        self.solves += 1
        self._fresh = 0

    def _is_plausible(self, jump: FloatArray, cov: FloatArray) -> bool:
        """Whether the newest pose moved no farther than it may, given how sure it was before."""
        grown = cov + np.diag([GROWN_M**2, GROWN_M**2, GROWN_RAD**2])
        return float(jump[:3] @ np.linalg.solve(grown, jump[:3])) < self._jump_gate

    def _iterate(self, steps: int, merge: bool) -> None:
        relaxed = 0
        for step in count():
            if relaxed == 0:
                if step >= steps:
                    break
                merged = self.map.update(self.keyframes.poses, self.beams, self.crossings, merge)
                relaxed = 2 if merged else 0
                self._step(RELAXED if merged else STRICT)
            else:
                relaxed -= 1
                self._step(RELAXED if relaxed else STRICT)

    def _step(self, robust: float) -> None:
        keyframes, landmarks = self.keyframes, self.map
        n, shared = keyframes.count, sheet_graph.SYSTEMATIC + 2 * landmarks.count
        arrow = arrow_solve.no_arrow(n, sheet_graph.STATES, shared)
        sheet_graph.add_odometry(
            keyframes.poses, keyframes.systematic, keyframes.steps, keyframes.spreads, n, arrow
        )
        for seen, is_beam in ((self.beams, True), (self.crossings, False)):
            sheet_graph.add_landmarks(
                keyframes.poses,
                landmarks.lines,
                seen.frame,
                seen.values,
                seen.spread,
                seen.landmark,
                seen.count,
                is_beam,
                robust,
                arrow,
            )
        self._add_priors(arrow)
        if arrow_solve.solve_arrow(arrow) != arrow_solve.SOLVED:
            return
        keyframes.poses[:n] += arrow.right
        keyframes.systematic += arrow.right_corner[: sheet_graph.SYSTEMATIC]
        lines = arrow.right_corner[sheet_graph.SYSTEMATIC :].reshape(-1, 2)
        landmarks.lines[: landmarks.count, :2] += lines
        cov = arrow_solve.last_block_cov(arrow)
        self.cov = 0.5 * (cov + cov.T)[:3, :3]
        half, skew = 0.5 * (self.cov[0, 0] + self.cov[1, 1]), 0.5 * (self.cov[0, 0] - self.cov[1, 1])
        self.position_std_m = math.sqrt(half + math.hypot(skew, self.cov[0, 1]))

    def _add_priors(self, arrow: arrow_solve.Arrow) -> None:
        """Add the start, the data sheets, and the places of the sheet's edges."""
        corner, right_corner = arrow.corner, arrow.right_corner
        config, errors, gyro = self._config, self._config.odometry, self._gyro
        weights = np.array([*self._start_stds, gyro.bias_std]) ** -2.0
        arrow.diagonal[0][np.diag_indices(4)] += weights
        arrow.right[0] -= weights * (self.keyframes.poses[0] - self._start)
        turn_per_m = errors.radius_difference_std / self._separation
        shared = np.array([gyro.scale_std, errors.turn_scale_std, turn_per_m, errors.distance_scale_std])
        mean = np.array([0.0, 0.0, 0.0, -errors.slip_mean])
        for k in range(sheet_graph.SYSTEMATIC):
            _hold(corner, right_corner, k, self.keyframes.systematic[k] - mean[k], float(shared[k]))
        for j in range(self.map.count):
            at = sheet_graph.SYSTEMATIC + 2 * j
            if j < self.map.edges:
                # The edges' angles are 0, 90, 180 and -90 degrees, their offsets 0.
                off = float(self.map.lines[j, 0])
                off -= round(off / (0.5 * math.pi)) * 0.5 * math.pi
                _hold(corner, right_corner, at, off, EDGE_ANGLE_STD_RAD)
                _hold(corner, right_corner, at + 1, float(self.map.lines[j, 1]), EDGE_OFFSET_STD_M)
                continue
            # What is seen of a landmark fixes it; this only keeps the matrix regular.
            corner[at, at] += 1e-6
            corner[at + 1, at + 1] += 1e-6
            if self.map.kinds[j] == Kind.WALL and config.walls_along_axes_std_rad > 0.0:
                off = float(self.map.lines[j, 0])
                off -= round(off / (0.5 * math.pi)) * 0.5 * math.pi
                if abs(off) < math.radians(5.0):
                    _hold(corner, right_corner, at, off, config.walls_along_axes_std_rad)


def _hold(corner: FloatArray, right: FloatArray, k: int, off: float, std: float) -> None:
    """Add a prior on a shared unknown that is ``off`` its mean."""
    corner[k, k] += std**-2
    right[k] -= off * std**-2
