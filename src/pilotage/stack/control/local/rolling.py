"""The rolling ground: odometry corrected by the laser, obstacles and seen ground."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from pilotage.core.errors import InputError
from pilotage.core.types import FloatArray, IntArray, Pose2, Twist
from pilotage.kernels.control import first_ground, ground_shown, ground_update, match, scan_ends, togo
from pilotage.kernels.control.footprint import Body
from pilotage.kernels.control.ground import Ground
from pilotage.kernels.control.merged_means import without_passed
from pilotage.kernels.control.motion_limits import Drive
from pilotage.kernels.geometry.motion import wrap
from pilotage.kernels.grids.distance import nearest_marked
from pilotage.stack.control.answer import Answer
from pilotage.stack.control.local.body import dense_m, make_body
from pilotage.stack.control.local.role import LocalLimits, LocalView
from pilotage.stack.control.local.rolling_config import PEOPLE_FADE_HITS, RollingConfig
from pilotage.stack.control.local.time_to_go import TimeToGo
from pilotage.stack.perception.movers import Movers

LOOKS_PAST_M, LOOKS_ASIDE_M, PASSED_BEHIND_M = 2.0, 0.025, 0.04
"""What the scan looks past so near and by so little to the side, and ends so far behind, is not there."""
INSIDE_M = 0.05
"""A point so deep inside the footprint is a mistake. Where people walk any inside is somebody who brushed
past: behind the robot, where its laser does not look, it would shut the robot in for ever."""
BLIND_SHARE = 0.5
"""With more than this share of its ranges 0 the laser is covered."""
MANY_SHARE = 0.125
"""Where somebody may move, so many beams have to end near at things that stand to correct the odometry."""
DOUBT = 2.0
"""Times the data sheet's standard deviation an odometry may be off."""
STANDS = 1e-6
"""Moved and turned by less, in metres and radians, it stands where it stood."""
ROLL_M, MOST_OFF_M = 0.5, 1.0
"""The grids follow a robot so far from their middle: where the time to go is worked out, and at any time."""


@dataclass(frozen=True, slots=True)
class Scene:
    """The ground at one step.

    Attributes
    ----------
    pose
        (3,) corrected pose now, in the map frame: the odometry's at the first step.
    start
        (5,) x, y, theta, v, w when the next command takes effect.
    goal
        (2,) in the map frame.
    sheet, drive
        Limits as the data sheet gives them, and as the robot's answers so far make likely.
    path
        (N, 2) down the time to go, a point every 0.1 m.
    delay_s
        As it seems to be.
    blind
        The laser is covered: nothing can be said of what is around.
    """

    pose: FloatArray
    start: FloatArray
    goal: FloatArray
    distance_m: float
    body: Body
    sheet: Drive
    drive: Drive
    ground: Ground
    dt_s: float
    path: FloatArray
    delay_s: float
    movers: Movers
    blind: bool


class RollingGround:
    """Keeps the grids of one robot; give it every view and every command.

    A controller that ``foresees`` moving bodies finds them in the scene's movers; to the others they are
    obstacles.
    """

    def __init__(self, config: RollingConfig, *, foresees: bool = False) -> None:
        self._config, self._foresees, self._tracks = config, foresees, False
        self._cells = 2 * math.ceil(0.5 * config.width_m / config.cell_m)
        half = self._cells // 2
        self._cell_m, self._coarse_m = config.cell_m, 2.0 * config.cell_m
        self._hits = np.zeros((self._cells, self._cells), dtype=np.uint8)
        self._mean = np.zeros((self._cells * self._cells, 2))
        # Of what is shown of the hits, kept from step to step.
        self._shown = np.zeros_like(self._hits)
        self._rise, self._nearest = nearest_marked(self._shown > 0)
        self._seen = np.zeros((half, half), dtype=np.bool_)
        self._corner = (0, 0)
        self._togo = TimeToGo(config)
        self._odometry: Pose2 | None = None
        self._pose = np.zeros(3)
        self._goal_given: tuple[float, float] | None = None
        self._goal = np.zeros(2)
        self._t_s = -math.inf
        self._dt_s = 0.05
        self._answer = Answer()
        self._movers = Movers(config.movers)
        self._body: Body | None = None
        self._footprint: FloatArray | None = None
        self._limits: LocalLimits | None = None
        self._laser = (0, 0.0)

    def sent(self, t_s: float, command: Twist) -> None:
        """Remember a command: it is under way while the robot's delay lasts."""
        self._answer.sent(t_s, command.v_m_s, command.w_rad_s)

    def update(self, view: LocalView, avoid: FloatArray | None = None) -> Scene:
        """Take a view in and give the ground as it is now.

        Parameters
        ----------
        avoid
            (N, 3) x, y, radius in the map frame: discs that the time to go leads around beside the obstacles.
        """
        if view.t_s <= self._t_s:
            raise InputError(f"view: expected a time after {self._t_s:.3f} s, found {view.t_s:.3f} s")
        if self._t_s > -math.inf:
            self._dt_s = min(max(view.t_s - self._t_s, 1e-3), 0.5)
        self._t_s = view.t_s
        body = self._take_body(view)
        drive = self._take_limits(view.limits)
        ranges, silent = scan_ends.cleaned_ranges(view.ranges_m, view.max_range_m)
        blind = silent > BLIND_SHARE * ranges.shape[0]
        angles = view.beam_angles_rad
        first = float(angles[0])
        step = float(angles[-1] - angles[0]) / (angles.shape[0] - 1)
        first_view = self._odometry is None
        self._predict(view)
        predicted = self._pose
        in_base, least_m = scan_ends.scan_points(
            view.mount.x_m, view.mount.y_m, view.mount.theta_rad, ranges, first, step, view.max_range_m
        )
        still = things = in_base
        self._tracks = self._config.movers.enabled or view.people_about
        if not self._tracks:
            self._movers.forget()
        else:
            on_track, steady = self._movers.update(
                (view.mount.x_m, view.mount.y_m),
                in_base,
                self._pose,
                self._dt_s,
                (view.mount.theta_rad + float(angles[0]), view.mount.theta_rad + float(angles[-1])),
            )
            things = in_base[steady]
            if self._foresees:
                still = in_base[~on_track]
        # Somebody is inside the robot's own outline: such a scan shows him, and not where the robot is.
        covered = least_m < body.inner_m
        if self._config.match and not first_view and not covered and self._are_many(things, angles.size):
            self._match(view, things)
        self._odometry = view.pose
        if view.goal_is_sure or self._goal_given != view.goal_xy_m:
            self._goal_given = view.goal_xy_m
            self._goal = _moved(view.goal_xy_m, view.pose, self._pose)
        # Not before the scan is matched: it is to the last ground, whose means roll as well.
        rolled = self._roll(predicted, first_view)
        if first_view:
            # Where the robot stands at first it may turn: the laser does not see the ground under it, nor,
            # if it shows less than the half before it, what is beside that even after a turn.
            self._mark_first(body, float(angles[-1] - angles[0]) < math.pi - 1e-6)
        config, mount = self._config, view.mount
        ground_update.insert_scan(
            ground_update.Grids(self._hits, self._mean, self._seen, *self._corner_m, self._cell_m),
            ground_update.Fan(
                ranges, first, step, view.max_range_m, self._take_sectors(angles.shape[0], step)
            ),
            self._pose,
            mount.as_array(),
            config.reach_m,
            dense_m(body.inner_m, step),
            still,
            body.polygon,
            0.0 if self._tracks else INSIDE_M,
            max(config.fade_hits, PEOPLE_FADE_HITS) if view.people_about else config.fade_hits,
        )
        ground = self._ground(body, drive, rolled, avoid)
        self._answer.learn(
            view.t_s,
            np.array([view.twist.v_m_s, view.twist.w_rad_s]),
            np.array([view.speed_var_m2_s2, view.turn_rate_var_rad2_s2]),
            view.limits.delay_s,
            drive,
        )
        state = np.concatenate([self._pose, self._answer.rates])
        likely = self._answer.likely(drive)
        start = self._answer.after_delay(view.t_s, state, view.limits.delay_s, likely)
        path = togo.descent_path(
            start[0], start[1], ground.togo_s, ground.x0_m, ground.y0_m, ground.coarse_m, 0.1, 60
        )
        distance = math.hypot(self._goal[0] - self._pose[0], self._goal[1] - self._pose[1])
        return Scene(
            self._pose.copy(),
            start,
            self._goal.copy(),
            distance,
            body,
            drive,
            likely,
            ground,
            self._dt_s,
            path,
            view.limits.delay_s * self._answer.delay_factor,
            self._movers,
            blind,
        )

    def _mark_first(self, body: Body, sees_little: bool) -> None:
        (x, y), corner_m = self._pose[:2], self._corner_m
        first_ground.mark_turn(self._seen, x, y, body, *corner_m, self._coarse_m)
        if sees_little:
            first_ground.mark_disc(self._seen, x, y, body.outer_m + self._coarse_m, *corner_m, self._coarse_m)

    def _are_many(self, points: FloatArray, beams: int) -> bool:
        """Whether enough is near that stands: in the open the few points left may be a group that walks."""
        if not self._tracks:
            return True
        near = np.hypot(points[:, 0], points[:, 1]) < self._config.reach_m
        return bool(near.sum() >= MANY_SHARE * beams)

    def _take_body(self, view: LocalView) -> Body:
        if self._body is None or view.footprint_xy_m is not self._footprint:
            self._body, self._footprint = make_body(view.footprint_xy_m), view.footprint_xy_m
        return self._body

    def _take_sectors(self, beams: int, step: float) -> IntArray:
        if self._laser != (beams, step):
            self._laser, self._sectors = (beams, step), ground_update.sectors(beams, step)
        return self._sectors

    def _take_limits(self, limits: LocalLimits) -> Drive:
        if limits is not self._limits:
            self._limits, self._sheet = limits, drive_of(limits)
        return self._sheet

    def _predict(self, view: LocalView) -> None:
        """Move the corrected pose by what the odometry moved."""
        before = self._odometry
        if before is None:
            self._pose = view.pose.as_array()
            return
        self._pose = np.array(
            [
                *_moved((view.pose.x_m, view.pose.y_m), before, self._pose),
                wrap(self._pose[2] + view.pose.theta_rad - before.theta_rad),
            ]
        )

    def _roll(self, pose: FloatArray, first_view: bool) -> bool:
        """Shift the grids by whole coarse cells, so that a robot at ``pose`` stays near their middle.

        As the time to go is due anew after it, it waits for when that is due in any case, if it can.
        """
        half_m = 0.5 * self._cells * self._cell_m
        wanted = (
            math.floor((pose[0] - half_m) / self._coarse_m),
            math.floor((pose[1] - half_m) / self._coarse_m),
        )
        dc, dr = wanted[0] - self._corner[0], wanted[1] - self._corner[1]
        if first_view:
            self._corner = wanted
            return True
        if max(abs(dc), abs(dr)) * self._coarse_m < (ROLL_M if self._togo.is_due else MOST_OFF_M):
            return False
        ground_shown.rolled(self._hits, self._mean, self._seen, dr, dc)
        self._corner = wanted
        return True

    def _match(self, view: LocalView, in_base: FloatArray) -> None:
        config = self._config
        assert self._odometry is not None
        moved = math.hypot(view.pose.x_m - self._odometry.x_m, view.pose.y_m - self._odometry.y_m)
        turned = abs(wrap(view.pose.theta_rad - self._odometry.theta_rad))
        if moved + turned < STANDS:
            return
        position, angle = (
            config.drift_m * math.sqrt(moved) + 1e-3,
            config.drift_rad * math.sqrt(moved + turned) + 1e-3,
        )
        if view.speed_var_m2_s2 > 0.0:
            position = min(position, DOUBT * self._dt_s * math.sqrt(view.speed_var_m2_s2) + 1e-4)
        if view.turn_rate_var_rad2_s2 > 0.0:
            angle = min(angle, DOUBT * self._dt_s * math.sqrt(view.turn_rate_var_rad2_s2) + 1e-4)
        pose_std = np.array([position, position, angle])
        ground = self._last_ground
        x, y, theta, _ = match.match_scan(
            self._pose[0],
            self._pose[1],
            self._pose[2],
            in_base,
            max(1, in_base.shape[0] // config.match_points),
            ground,
            config.match_reach_m,
            config.point_std_m,
            pose_std,
            float(view.beam_angles_rad[1] - view.beam_angles_rad[0]),
        )
        self._pose = np.array([x, y, wrap(theta)])

    @property
    def _corner_m(self) -> tuple[float, float]:
        """Lower left corner of both grids."""
        return self._corner[0] * self._coarse_m, self._corner[1] * self._coarse_m

    def _ground(self, body: Body, drive: Drive, rolled: bool, avoid: FloatArray | None) -> Ground:
        x0, y0 = self._corner_m
        unseen = ground_shown.looked_at(
            self._hits, self._seen, self._coarse_m, body.outer_m, self._shown, self._rise, self._nearest
        )
        unseen = first_ground.with_seen_under(self._seen, unseen, self._pose, body, x0, y0, self._coarse_m)
        field = self._togo.update(
            self._nearest,
            self._mean,
            self._seen,
            (x0, y0),
            self._goal,
            self._pose,
            body,
            drive,
            rolled,
            avoid,
        )
        self._last_ground = Ground(
            self._shown,
            self._mean,
            self._nearest,
            unseen,
            field,
            x0,
            y0,
            self._cell_m,
            self._coarse_m,
            1.0 / self._cell_m,
            1.0 / self._coarse_m,
        )
        return self._last_ground

    def close(self, x_m: float, y_m: float, radius_m: float) -> None:
        """Lead no way through a disc of the map frame any more: it proved too narrow."""
        self._togo.close(x_m, y_m, radius_m)

    def open_all(self) -> None:
        """Forget what was closed: a way through it may be better than none."""
        self._togo.open_all()

    def look_past(self, points_xy_m: FloatArray, laser_xy_m: tuple[float, float]) -> None:
        """Forget what a scan with its ends at points (N, 2) looks past from nearby: ``without_passed``."""
        limits_m = LOOKS_PAST_M, LOOKS_ASIDE_M, PASSED_BEHIND_M
        self._hits[:] = without_passed(self._hits, self._mean, points_xy_m, *laser_xy_m, *limits_m)

    def time_to_go_beside(self, discs: FloatArray, scene: Scene) -> FloatArray:
        """Time to go (m, m) where discs (N, 3), x, y, radius in the map frame, are closed as well."""
        return self._togo.beside(discs, scene.body, scene.sheet)


def drive_of(limits: LocalLimits) -> Drive:
    """The limits as kernels take them."""
    return Drive(
        limits.speed_m_s,
        limits.reverse_m_s,
        limits.acceleration_m_s2,
        limits.deceleration_m_s2,
        limits.turn_rate_rad_s,
        limits.turn_acceleration_rad_s2,
    )


def _moved(point: tuple[float, float], seen_from: Pose2, now: FloatArray) -> FloatArray:
    """Carry a point from the frame where the robot is at ``seen_from`` to that where it is at ``now``."""
    turn = now[2] - seen_from.theta_rad
    c, s = math.cos(turn), math.sin(turn)
    dx, dy = point[0] - seen_from.x_m, point[1] - seen_from.y_m
    return np.array([now[0] + c * dx - s * dy, now[1] + s * dx + c * dy])
