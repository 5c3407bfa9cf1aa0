"""Monte-Carlo localization on the distance field of a map, drawn in segments or in cells."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, ClassVar

import numpy as np
import scipy
from pydantic import Field, model_validator

from pilotage.core.angles import wrap_array_to_pi
from pilotage.core.config import Config
from pilotage.core.errors import InputError
from pilotage.core.types import FloatArray, Pose2
from pilotage.kernels.filters import particles
from pilotage.maps.world_map import WorldMap
from pilotage.models.odometry import OdometryModel
from pilotage.sensors.joint_lidar import places_of_lasers_m
from pilotage.sensors.lidar import LidarConfig
from pilotage.sensors.readings import LidarScan, OdometryIncrement, Readings
from pilotage.sensors.sensor import NonNegative, Positive
from pilotage.sensors.wheel_odometry import WheelOdometryConfig
from pilotage.stack.interface import Belief, BeliefStatus
from pilotage.stack.journal import Journal
from pilotage.stack.knowledge import RobotKnowledge
from pilotage.stack.localization.gyro_odometry import GyroOdometry
from pilotage.stack.localization.likelihood_field import LikelihoodField
from pilotage.stack.localization.localizer import LOCALIZERS, require_initial_pose
from pilotage.stack.localization.odometry_doubt import OdometryDoubt
from pilotage.stack.localization.odometry_prediction import OdometryBelief, OdometryPrediction
from pilotage.stack.localization.odometry_watch import (
    LINEAR_RAD,
    MOST_HEADING_VAR,
    STANDS_M,
    TURN_AS_PATH_M,
    OdometryWatch,
)
from pilotage.stack.localization.relocalization import STDS, Relocalization
from pilotage.stack.localization.same_witness import SameWitness
from pilotage.stack.localization.scan_judge import ScanJudge
from pilotage.stack.localization.self_check import LEAST_SEEN
from pilotage.stack.localization.walls_between import WallsBetween

NAME = "particle-filter"
COLUMNS = {"particles": "1", "effective_particles": "1", "scan_parts": "1", "localized": "1"}
"""Size of the cloud, how much of it was effective, how many parts the scan was let in by, and whether the
robot holds itself for localized."""
MOST_ALIKE = 5
"""So many scans on walls count where the robot stands: what is on no map, and what the map is wrong by, is
the same in all of them."""
FLOOR = np.diag([1e-12, 1e-12, 1e-12])
"""Added to the particles' covariance, which is singular where the start is exact and nothing has moved."""


class MclConfig(Config):
    """The cloud's size, the map it is weighed on, and the density of a beam.

    Variances left out are taken from the sensors' data sheets; the scales serve experiments with a filter
    that is wrong about its noise.
    """

    least_particles: int = Field(default=400, ge=20, le=1_000_000)
    most_particles: int = Field(default=2000, ge=20, le=1_000_000)
    kld_error: float = Field(default=0.02, gt=0.0, lt=1.0)
    """Kullback-Leibler distance of the cloud from the posterior that is to be kept,"""
    kld_probability: float = Field(default=0.99, gt=0.5, lt=1.0)
    """with this probability (Fox 2003)."""
    bin_m: Positive = 0.05
    bin_rad: float = Field(default=0.02, gt=1e-4, le=math.pi)
    effective_share: float = Field(default=0.5, gt=0.0, lt=1.0)
    """A scan that would leave a smaller share of effective particles is let in by parts."""
    spread: float = Field(default=0.3, ge=0.0, lt=1.0)
    """Width of the kernel that moves resampled particles apart, in standard deviations of the cloud."""
    most_rounds: int = Field(default=30, ge=1)
    """Parts after which the rest of a scan is let in at once."""
    resolution_m: Positive | None = None
    """Of the field around walls. None: 5 cm, or a cell's side where that is less."""
    beams: int = Field(default=60, ge=1)
    max_range_m: Positive | None = None
    """Readings beyond are left out. None: those beyond what the scanner surely reaches."""
    range_var_m2: Positive | None = None
    field_std_m: NonNegative | None = None
    """What the map is wrong by; added to the range's variance. None: 1 cm, of a grid a third of a cell
    beside the cell itself."""
    random_share: float = Field(default=0.05, gt=0.0, lt=1.0)
    """Share of readings that are no wall of the map."""
    relocalize: bool = True
    """Whether it searches the whole map while it is lost."""
    measurement_var_scale: Positive = 1.0
    odometry_model: OdometryModel = OdometryModel.EXACT_ARC
    odometry: OdometryBelief = OdometryBelief()
    odometry_var_scale: Positive = 1.0

    @model_validator(mode="before")
    @classmethod
    def _map_is_the_worlds(cls, values: Any) -> Any:
        if isinstance(values, Mapping) and "grid_file" in values:
            raise ValueError("grid_file is gone; expected the grid as the robot's map: world.map: FILE.yaml")
        return values


@LOCALIZERS.add(NAME, MclConfig)
class ParticleFilterLocalizer:
    """Monte-Carlo localization with the likelihood field (Thrun et al. 2005, tables 6.3, 8.2 and 8.4).

    The cloud has as many particles as KLD sampling asks for. A scan far sharper than the cloud would leave
    a single particle alive; it is let in by parts, and the cloud is resampled and spread out between them.

    The field knows no direction: a wall seen aslant is taken to be as uncertain across as along the beam,
    so the filter believes a little less than it could. Scans on cells err alike (``LikelihoodField.kept``):
    the cloud is never much narrower than one scan alone would make it. On walls a robot that stands takes in
    a few scans, and judges itself by the others.

    After a wrong start, or carried away, it notices and searches the whole map (``Relocalization``); it finds
    no place while several look alike. Fails where the belief is no single hump: the spreading keeps mean and
    covariance, and would draw two humps together.
    """

    BY_COMMANDS: ClassVar[bool] = True

    def __init__(
        self,
        config: MclConfig,
        robot: RobotKnowledge,
        chart: WorldMap,
        initial: Belief,
        journal: Journal,
    ) -> None:
        if config.most_particles < config.least_particles:
            raise InputError(
                f"stack.localizer.most_particles: expected at least least_particles "
                f"({config.least_particles}), found {config.most_particles}"
            )
        if not config.relocalize:
            require_initial_pose(initial, f"{NAME} without relocalize")
        self._config = config
        self._odometry, odometry = robot.one_sensor(WheelOdometryConfig, NAME)
        self._lidar, lidar = robot.one_sensor(LidarConfig, NAME)
        self._prediction = OdometryPrediction(
            odometry, config.odometry, config.odometry_var_scale, config.odometry_model
        )
        self._motion = GyroOdometry(robot, self._odometry, self._prediction, journal)
        self._watch = OdometryWatch(robot, odometry)
        self._doubt, self._witness = OdometryDoubt(), SameWitness()
        self._blind = bool(initial.cov[2, 2] > LINEAR_RAD**2)
        self._moved, self._alike = (0.0, 0.0), 0
        range_var_m2 = lidar.range_var_m2 if config.range_var_m2 is None else config.range_var_m2
        self._field = LikelihoodField(
            chart,
            resolution_m=config.resolution_m,
            range_var_m2=config.measurement_var_scale * range_var_m2,
            field_std_m=None
            if config.field_std_m is None
            else math.sqrt(config.measurement_var_scale) * config.field_std_m,
            random_share=config.random_share,
            reach_m=lidar.max_range_m,
        )
        told = initial.status is not BeliefStatus.LOST
        self._relocalization = (
            Relocalization(self._field, chart.bounds_m, told) if config.relocalize else None
        )
        self._judge = ScanJudge(self._field, self._relocalization, self._doubt)
        self._check = self._judge.check
        self._picked = np.unique(np.linspace(0, lidar.beams - 1, min(config.beams, lidar.beams)).astype(int))
        angles = lidar.beam_angles_rad()[self._picked] + lidar.mount.theta_rad
        self._directions = np.column_stack([np.cos(angles), np.sin(angles)])
        self._mount_xy = np.array([lidar.mount.x_m, lidar.mount.y_m])
        self._walls_between = WallsBetween(chart, _eyes_m(lidar, robot))
        self._max_range = min(config.max_range_m or lidar.sure_range_m, lidar.max_range_m)
        self._rng = robot.streams.stream(NAME)
        self._quantile = float(scipy.special.ndtri(config.kld_probability))
        self._poses = _draw(initial, config.most_particles, self._rng)
        self._wanted = config.most_particles
        self._rounds, self._effective = 0, float(config.most_particles)
        self.belief = initial
        self._telemetry = journal.channel(COLUMNS)

    @property
    def particles(self) -> FloatArray:
        """Poses (N, 3) of the cloud, all of the same weight; a copy."""
        return self._poses.copy()

    def step(self, readings: Readings) -> Belief:
        """Move the cloud by the odometry increment, then weigh it by the scan."""
        odometry, t_s = self._motion.increment(readings, self.belief), readings.t_s
        if odometry is not None:
            self._move(odometry)
        self._spread(*self._watch.variances(t_s, odometry, self.belief))
        scan = readings.by_sensor.get(self._lidar)
        moments, seen = None, np.zeros((0, 2))
        if isinstance(scan, LidarScan):
            seen = self._points_of(scan.ranges_m)
            self._move_apart()
            prior = self._unweighted()
            points = self._field.mapped(seen, prior[0])
            if not self._blind and self._walls_between.speak_against(*prior, seen):
                self._check.alarm(t_s)
            if len(points) and not self._blind:
                weighs, moved = not self._tells_nothing_new(), self._moved
                moments = self._weigh(points, prior[1]) if weighs else None
                if moments is not None:
                    self._doubt.tell(t_s, prior, moments[0], *moved)
                mean = prior[0] if moments is None else moments[0]
                self._judge.tell(t_s, prior, mean, points, len(self._picked))
            elif self._check.lost(t_s) and len(seen) >= LEAST_SEEN:
                self._check.alarm(t_s)  # what says nothing does not find it
        if moments is None:
            self._rounds, self._effective = 0, float(self._poses.shape[0])
            moments = self._unweighted()
        mean, cov = moments
        wide = bool(cov[2, 2] > LINEAR_RAD**2)
        if isinstance(scan, LidarScan):
            # What silence hid since the last scan the next one tells, let in by parts.
            self._blind = wide
        lost = wide or self._check.lost(t_s)
        if self._relocalization is not None:
            # Where the last scans fit elsewhere those that fit here do so by chance.
            lost |= self._relocalization.trial is not None or self._relocalization.elsewhere
            if isinstance(scan, LidarScan):
                self._relocalization.see(seen)
            tried = self._relocalization.trial
            place = self._relocalization.begin(t_s, lost, mean)
            if self._relocalization.trial is not tried:
                self._check.try_anew(elsewhere=place is not None)
            if place is not None:
                mean, cov = self._begin_at(place)
        self.belief = Belief(
            Pose2.from_array(mean), cov, BeliefStatus.LOST if lost else BeliefStatus.LOCALIZED
        )
        self._telemetry.tell(self._poses.shape[0], self._effective, self._rounds, 0.0 if lost else 1.0)
        return self.belief

    def _begin_at(self, place: FloatArray) -> tuple[FloatArray, FloatArray]:
        """A new cloud around a place (3,) of the map."""
        initial = Belief(Pose2.from_array(place), np.diag(STDS**2))
        self._poses = _draw(initial, self._config.most_particles, self._rng)
        self._wanted, self._blind, self._alike = self._config.most_particles, False, 0
        self._doubt.forget()
        self._witness.forget()
        return self._unweighted()

    def _move(self, odometry: OdometryIncrement) -> None:
        moved_m, turned_rad = self._moved
        driven_m = math.hypot(odometry.distance_m, odometry.lateral_m)
        self._moved = (moved_m + driven_m, turned_rad + abs(odometry.angle_rad))
        if self._relocalization is not None:
            self._relocalization.move(odometry)
        distance_var, angle_var = self._prediction.variances(odometry)
        particles.sample_motion(
            self._poses,
            odometry.distance_m,
            odometry.angle_rad,
            math.sqrt(distance_var),
            math.sqrt(angle_var),
            self._rng.standard_normal((self._poses.shape[0], 2)),
            self._prediction.exact,
        )
        if odometry.lateral_m != 0.0:
            particles.sample_sideways(
                self._poses,
                odometry.lateral_m,
                odometry.angle_rad,
                math.sqrt(self._prediction.lateral_variance(odometry)),
                self._rng.standard_normal((self._poses.shape[0],)),
                self._prediction.exact,
            )

    def _spread(self, place_m2: float, heading_rad2: float) -> None:
        """Move the particles apart by what the odometry has not told."""
        if place_m2 > 0.0 or heading_rad2 > 0.0:
            self._alike = 0
            if self._relocalization is not None:
                self._relocalization.forget()
            stds = np.sqrt([place_m2, place_m2, min(heading_rad2, MOST_HEADING_VAR)])
            self._poses += stds * self._rng.standard_normal(self._poses.shape)
            self._poses[:, 2] = wrap_array_to_pi(self._poses[:, 2])

    def _move_apart(self) -> None:
        """By what the odometry is not believed."""
        stds = self._doubt.stds
        if stds is not None:
            self._doubt.spend()
            if self._relocalization is not None:
                self._relocalization.forget()
            ahead, aside, turn = stds[:, None] * self._rng.standard_normal((3, self._poses.shape[0]))
            c, s = np.cos(self._poses[:, 2]), np.sin(self._poses[:, 2])
            self._poses += np.column_stack([c * ahead - s * aside, s * ahead + c * aside, turn])
            self._poses[:, 2] = wrap_array_to_pi(self._poses[:, 2])

    def _tells_nothing_new(self) -> bool:
        """Whether on walls a scan is one too many from where the robot stands."""
        moved_m, turned_rad = self._moved
        stands = moved_m + TURN_AS_PATH_M * turned_rad < STANDS_M
        self._alike = self._alike + 1 if stands else 0
        return not self._field.errs_alike and self._alike > MOST_ALIKE

    def _weigh(self, points: FloatArray, prior_cov: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Weigh and resample the cloud by a scan's end points (K, 2) in the robot's frame; returns the
        weighted mean and covariance."""
        alike, self._rounds = self._field.alike(*self._moved), 0
        self._moved = (0.0, 0.0)
        whole = self._field.independent_share
        share = whole * (1.0 - alike)
        remaining, narrowing = share, True
        while narrowing:
            self._rounds += 1
            likelihoods = self._field.log_likelihoods(points, self._poses)
            part, narrowing = max(remaining, 0.0), False
            if self._rounds < self._config.most_rounds:
                enough = self._config.effective_share * self._poses.shape[0]
                most = whole if alike > 0.0 else remaining
                narrowed = particles.largest_exponent(likelihoods, most, enough)
                if narrowed < most:
                    part, narrowing = narrowed, True
            remaining -= part
            self._effective = particles.effective_count(likelihoods, part)
            weights = particles.normalized(likelihoods, part)
            moments = _moments(self._poses, weights)
            self._resample(weights, *moments)
        if alike > 0.0:
            wider = self._witness.widening(prior_cov, moments[1], alike, (share - remaining) / whole)
            moments = self._widen(*moments, wider)
        return moments

    def _widen(self, mean: FloatArray, cov: FloatArray, wider: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Move the particles apart about their mean; returns the moments then."""
        apart = self._poses - mean
        apart[:, 2] = wrap_array_to_pi(apart[:, 2])
        self._poses = mean + apart @ wider.T
        self._poses[:, 2] = wrap_array_to_pi(self._poses[:, 2])
        return mean, wider @ cov @ wider.T

    def _unweighted(self) -> tuple[FloatArray, FloatArray]:
        """Mean and covariance of the cloud as it is."""
        return _moments(self._poses, np.full(self._poses.shape[0], 1.0 / self._poses.shape[0]))

    def _points_of(self, ranges_m: FloatArray) -> FloatArray:
        """(K, 2) where the picked beams ended, in the robot's frame."""
        ranges = ranges_m[self._picked]
        seen = ranges < self._max_range  # neither beyond reach nor NaN
        points: FloatArray = self._mount_xy + ranges[seen, None] * self._directions[seen]
        return points

    def _resample(self, weights: FloatArray, mean: FloatArray, cov: FloatArray) -> None:
        config = self._config
        count = min(max(self._wanted, config.least_particles), config.most_particles)
        drawn = particles.low_variance_indices(weights, count, float(self._rng.random()))
        self._poses = self._poses[drawn]
        normals = self._rng.standard_normal((count, 3))
        root = np.asarray(np.linalg.cholesky(cov), dtype=np.float64)
        particles.spread_out(self._poses, mean, root, config.spread, normals)
        bins = particles.occupied_bins(self._poses, config.bin_m, config.bin_rad)
        self._wanted = math.ceil(particles.kld_count(bins, config.kld_error, self._quantile))


def _eyes_m(lidar: LidarConfig, robot: RobotKnowledge) -> FloatArray:
    """(V, 2) where the lasers of a scan are, in the robot's frame."""
    mount, joined_m = lidar.mount, places_of_lasers_m(lidar, robot.sensors)
    return mount.pose.placed(joined_m if len(joined_m) else np.zeros((1, 2)))


def _moments(poses: FloatArray, weights: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Mean (3,) and covariance (3, 3) of the cloud."""
    mean, cov = np.empty(3), np.empty((3, 3))
    particles.moments(poses, weights, mean, cov)
    return mean, cov + FLOOR


def _draw(initial: Belief, count: int, rng: np.random.Generator) -> FloatArray:
    """Particles (N, 3) of the initial belief."""
    values, vectors = np.linalg.eigh(initial.cov)
    root = vectors * np.sqrt(np.maximum(values, 0.0))
    poses = initial.pose.as_array() + rng.standard_normal((count, 3)) @ root.T
    poses[:, 2] = np.mod(poses[:, 2] + math.pi, 2.0 * math.pi) - math.pi
    return np.ascontiguousarray(poses)
