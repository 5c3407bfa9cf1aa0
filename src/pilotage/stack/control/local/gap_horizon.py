"""Our own: sampled plans that end in a stop on seen ground, led by the time to go, each command checked."""

from __future__ import annotations

import math

import numpy as np

from pilotage.core.types import STOP, FloatArray, Pose2, Twist
from pilotage.kernels.control.band import path_distances
from pilotage.kernels.control.evasion import best_evasion
from pilotage.kernels.control.ground import nearest_m
from pilotage.kernels.control.motion_limits import Drive, approach, command_is_safe
from pilotage.kernels.control.scan_ends import cleaned_ranges, scan_points
from pilotage.kernels.control.togo import UNREACHED_S, togo_at
from pilotage.stack.control.local.among_people import AmongPeople
from pilotage.stack.control.local.blind_side import blind_clearance_m
from pilotage.stack.control.local.command_check import ROUNDING_M, footprint_clearance_m
from pilotage.stack.control.local.gap_horizon_config import GapHorizonConfig
from pilotage.stack.control.local.multi_point_turn import MultiPointTurn, find_multi_point_turn
from pilotage.stack.control.local.narrow_passage import (
    SLOW_M_S,
    NarrowPassage,
    find_narrow_passage,
    sharpened,
    tight_m,
)
from pilotage.stack.control.local.plan_pool import PlanPool
from pilotage.stack.control.local.role import LOCAL_CONTROLLERS, LocalView
from pilotage.stack.control.local.rolling import Scene
from pilotage.stack.control.local.rolling_step import RollingController
from pilotage.stack.control.local.time_to_go import is_same_goal
from pilotage.stack.control.local.turning_room import TurningRoom, find_turning_room

BLIND_M = 0.02
"""So much from what its laser does not see, and where it backs: it may be nearer than it was seen to be."""
BACK = -SLOW_M_S, 0.0
FORESEEN_M = 0.9
"""So far ahead it looks for gaps that leave it hardly any room."""
TRIED_M = 0.3
"""Two narrow places nearer to each other than this are one."""
TURNS_M_S = 0.1
"""Slower than this it brakes before it could get around anything."""
SWERVES = (0.0, -0.2, 0.2, -0.4, 0.4, -0.7, 0.7, -1.0, 1.0)
HOLDS_S = (0.15, 0.4, 0.8)


@LOCAL_CONTROLLERS.add("gap-horizon", GapHorizonConfig)
class GapHorizon(RollingController):
    """Plans over the seen ground only, and drives only what can still be braked there.

    1. The time to go (Dijkstra, speed by clearance, unseen ground taken for free but slow) says where to.
    2. Plans: pursuit of its way down at several speeds, the last plan, and samples around the best of them
       (MPPI: Williams et al. 2017). A plan is driven out under the limits from where the robot will be when a
       command takes effect; it must stay on seen ground, clear of every point, and end where the robot can
       still brake. So the speed follows from the limits and the sight.
    3. The first command of the best plan is checked with finer steps and worse brakes, followed by a stop;
       where that fails, the next plan's, then slower ones. Where none is safe, what ends best: braking alone
       or with a turn (``best_evasion``); near people just the brakes.

    Where nothing moves and limits are no worse than ``brake_trust`` of the data sheet, it cannot hit what it
    has seen beyond the map's errors (least margin against laser noise and odometry within a step). It does
    not plan over orientation but for one gap at a time, once it is stuck before it (``NarrowPassage``).
    """

    def __init__(self, config: GapHorizonConfig, generator: np.random.Generator) -> None:
        super().__init__(config.ground, foresees=True)
        self._config = config
        self._pool = PlanPool(config, generator)
        self._plan: FloatArray | None = None
        self._keep_turning = True
        self._passage: NarrowPassage | None = None
        self._bound_for = np.zeros(2)
        self._room: TurningRoom | None = None
        self._turn: MultiPointTurn | None = None
        self._backs_out = False
        self._moved_s = 0.0
        self._tried: list[tuple[float, float, FloatArray]] = []
        self._since: tuple[float, float, float] | None = None
        self._people = AmongPeople(config)

    @property
    def _is_busy(self) -> bool:
        return self._turn is not None

    def _careful(self, view: LocalView, scene: Scene) -> Scene:
        return self._people.careful(view, scene)

    def _decide(self, view: LocalView, scene: Scene) -> Twist:
        config = self._config
        if self._people.must_stand(view, scene):
            self._plan = None
            return STOP
        if self._passage is not None and not self._still_leads_through(self._passage, scene):
            self._passage = None
        if self._passage is None and self._room is None and self._turn is None:
            self._passage = self._tight_ahead(view, scene)
        if self._passage is not None:
            return self._squeeze(view, scene, self._passage)
        if self._room is not None:
            self._room, wanted = self._room.step(scene, self._room_m(scene), view.t_s)
            command = self._checked(scene, np.array([wanted.v_m_s, wanted.w_rad_s]))
            if self._room is not None and command is not None:
                return command
            self._room = None
        if self._turn is not None:
            self._turn, wanted = self._turn.step(scene, view.t_s)
            sharper = sharpened(scene, _scanned(view, scene), _laser_xy_m(view, scene))
            command = self._checked(sharper, np.array([wanted.v_m_s, wanted.w_rad_s]))
            if self._turn is not None and command is not None:
                return command
            self._turn = None
        trust = self._worse(scene).deceleration / scene.drive.deceleration
        price = config.price(view, scene, config.margin_s, trust)
        plans, costs = self._pool.priced(scene, price, self._plan)
        for i in np.argsort(costs)[:6]:
            command = self._checked(scene, plans[i][0])
            if command is not None:
                self._plan = plans[i].copy()
                return command
        best = plans[int(np.argmin(costs))]
        for share in (0.6, 0.3, 0.0):
            command = self._checked(scene, share * best[0])
            if command is not None:
                self._plan = share * best
                return command
        self._plan = None
        curvature = scene.start[4] / scene.start[3] if abs(scene.start[3]) > 0.05 else 0.0
        slower = max(abs(scene.start[3]) - scene.drive.deceleration * scene.dt_s, 0.0)
        if self._people.are_near(scene):
            return STOP
        along = curvature * math.copysign(slower, scene.start[3]) if self._keep_turning else 0.0
        return self._evasion(scene, along) if abs(scene.start[3]) > TURNS_M_S else Twist(0.0, along)

    def _evasion(self, scene: Scene, along_rad_s: float) -> Twist:
        """The command that ends best where none is safe: braking alone, or with a turn, now or later."""
        v, fastest = float(scene.start[3]), scene.drive.turn_rate
        fan = [(0.0, along_rad_s, scene.dt_s)]
        fan += [(u, share * fastest, hold) for u in (0.0, v) for share in SWERVES for hold in HOLDS_S]
        best, _ = best_evasion(
            scene.start,
            np.array(fan),
            self._config.check_step_s,
            scene.drive,
            self._worse(scene),
            scene.body,
            scene.ground,
        )
        return Twist(fan[best][0], fan[best][1])

    def _squeeze(self, view: LocalView, scene: Scene, passage: NarrowPassage) -> Twist:
        """The next command of the manoeuvre through a gap, as fast as it is safe."""
        config = self._config
        points = _scanned(view, scene)
        sharper = sharpened(scene, points, _laser_xy_m(view, scene))
        self._passage, wanted = passage.step(sharper, points, view.t_s)
        # What lines up before the gap has no need to swing its corners by as closely as it is narrow.
        inside = self._passage is None or self._passage.goes_in(scene)
        margin_m = config.margin_m
        if inside:
            margin_m = passage.margin_m(sharper, config.passage_margin_m, config.margin_m)
        scene = sharper if inside else scene
        tried = [(share * wanted.v_m_s, share * wanted.w_rad_s) for share in (1.0, 0.5, 0.25)]
        sees = inside or blind_clearance_m(view, scene, BLIND_M) >= BLIND_M
        tried = [one for one in tried if sees or one[0] >= 0.0]
        back = [BACK] if sees else []
        command = self._first_safe(scene, [*back, *tried] if self._backs_out else tried, margin_m)
        if command is None and not inside:
            # A post beside it is in the way of its turn: straight back, until it can turn on the spot.
            self._backs_out, command = True, self._first_safe(scene, back, margin_m)
        x, y = float(scene.pose[0]), float(scene.pose[1])
        if inside or nearest_m(x, y, scene.ground) > scene.body.outer_m + config.margin_m:
            if self._backs_out and self._passage is not None:
                self._passage = self._passage.backed_out(scene, view.t_s)
            self._backs_out = False
        if command is None:
            if inside and passage.is_past_middle(scene):
                # What is ahead is not the gap: plans lead around it.
                self._passage = None
            return STOP
        if abs(command.v_m_s) + abs(command.w_rad_s) > 0.02:
            self._moved_s = view.t_s
        return command

    def _tight_ahead(self, view: LocalView, scene: Scene) -> NarrowPassage | None:
        """A gap close ahead that leaves so little room that plans hardly get into it, if it is new.

        Between people there is none: who stands now walks on before it has lined up.
        """
        if view.people_about or self._people.are_near(scene):
            return None
        found = find_narrow_passage(scene, FORESEEN_M, view.t_s, tight_m(scene.body))
        if found is None or not (found.is_tight(scene.body) and found.is_ahead(scene)):
            return None
        if self._has_tried(found, scene):
            return None
        self._take_on(found, view, scene)
        return found

    def _take_on(self, found: NarrowPassage, view: LocalView, scene: Scene) -> None:
        """It lines up before that gap from now on, once for this goal."""
        self._tried.append((found.x_m, found.y_m, scene.goal))
        self._moved_s, self._bound_for = view.t_s, scene.goal

    def _still_leads_through(self, passage: NarrowPassage, scene: Scene) -> bool:
        """Whether it is in the gap already, or bound for where it was when it began to line up."""
        return passage.goes_in(scene) or is_same_goal(self._bound_for, scene.goal)

    def _has_tried(self, found: NarrowPassage, scene: Scene) -> bool:
        """Whether it lined up before that gap already, on its way to this goal."""
        self._tried = [one for one in self._tried if is_same_goal(one[2], scene.goal)]
        return any(math.hypot(found.x_m - a, found.y_m - b) <= TRIED_M for a, b, _ in self._tried)

    def _room_m(self, scene: Scene) -> float:
        """What its middle has to keep from everything for a body to turn on the spot, and a little more."""
        return scene.body.outer_m + 2.0 * self._config.margin_m

    def _first_safe(self, scene: Scene, commands: list[tuple[float, float]], margin_m: float) -> Twist | None:
        for first in commands:
            command = self._checked(scene, np.array(first), margin_m)
            if command is not None:
                return command
        return None

    def _look_back(self, view: LocalView, scene: Scene) -> None:
        """Where it is stuck: the narrowest place straight, room to turn, or close it; reopen where all is."""
        config = self._config
        x, y = float(scene.pose[0]), float(scene.pose[1])
        squeezes = self._passage is not None and view.t_s - self._moved_s < config.stuck_s
        if squeezes or self._turn is not None:
            self._since = (view.t_s, x, y)
            return
        if self._since is None or math.hypot(x - self._since[1], y - self._since[2]) > config.stuck_m:
            self._since = (view.t_s, x, y)
        if view.t_s - self._since[0] < config.stuck_s or scene.distance_m < view.goal_tolerance_m:
            return
        self._since = (view.t_s, x, y)
        self._plan = None
        self._ground.look_past(_scanned(view, scene), _laser_xy_m(view, scene))
        if self._passage is not None:
            moved = self._moved_s > self._passage.begun_s
            self._passage, self._moved_s = self._passage.again(view.t_s) if moved else None, view.t_s
            if self._passage is not None:
                return
        here = togo_at(x, y, scene.ground.togo_s, scene.ground.x0_m, scene.ground.y0_m, scene.ground.coarse_m)
        if here >= UNREACHED_S:
            self._tried = []
            self._passage = None
            self._ground.open_all()
            return
        self._room = find_turning_room(scene, self._room_m(scene), config.margin_m, view.t_s)
        if self._room is not None:
            return
        sharper = sharpened(scene, _scanned(view, scene), _laser_xy_m(view, scene))
        self._turn = find_multi_point_turn(
            sharper, self._room_m(scene), (config.margin_m, config.least_margin_m), BLIND_M, view.t_s
        )
        if self._turn is not None:
            return
        found = find_narrow_passage(scene, FORESEEN_M, view.t_s)
        found = found or find_narrow_passage(scene, config.close_ahead_m, view.t_s)
        if found and not self._has_tried(found, scene):
            # Straight through it first; where that fails as well it is closed.
            self._take_on(found, view, scene)
            self._passage = found
            return
        ahead = np.ascontiguousarray(scene.path[: max(3, round(config.close_ahead_m / 0.1))])
        away = path_distances(ahead, scene.ground)
        narrow = int(np.argmin(away))
        if away[narrow] > scene.body.outer_m:
            self._ground.open_all()
            return
        self._ground.close(float(ahead[narrow, 0]), float(ahead[narrow, 1]), float(away[narrow]) + 0.05)

    def _is_squeezed(self, scene: Scene) -> bool:
        enough = self._config.least_margin_m
        x, y, theta = scene.pose
        return footprint_clearance_m(scene, x, y, theta, enough) < enough

    def _worse(self, scene: Scene) -> Drive:
        """Limits that are relied on: worse than the data sheet's, and than those that seem likely."""
        share = min(self._config.brake_trust, 0.9 * scene.drive.deceleration / scene.sheet.deceleration)
        return scene.sheet.scaled(share)

    def _checked(self, scene: Scene, first: FloatArray, margin_m: float | None = None) -> Twist | None:
        """The command if it can be held for a step and braked from without touching anything."""
        config, drive = self._config, scene.drive
        margin_m = config.least_margin_m if margin_m is None else margin_m
        hold_s = scene.dt_s
        # As it is checked, so it is sent: near people the limits are narrower than the robot's own.
        v, w = float(first[0]), float(first[1])
        if abs(v) > config.squeezed_m_s and self._is_squeezed(scene):
            v, w = math.copysign(config.squeezed_m_s, v), w * config.squeezed_m_s / abs(v)
        v, w = min(max(v, -drive.reverse), drive.speed), min(max(w, -drive.turn_rate), drive.turn_rate)
        if v < 0.0:
            # Behind it walls are where they were before its heading drifted.
            margin_m = max(margin_m, BLIND_M)
        if drive.least_radius > 0.0:
            faster, slower = drive.acceleration * scene.dt_s, drive.deceleration * scene.dt_s
            most = max(approach(float(scene.start[3]), v, faster, slower), 0.0) / drive.least_radius
            w = min(max(w, -most), most)
        if abs(v) > abs(scene.start[3]) and self._people.are_near(scene):
            hold_s = max(hold_s, config.people_hold_s)
        # From within the margin no nearer: a millimetre, which the check lets go, in every step is a contact.
        x, y, theta = (float(value) for value in scene.start[:3])
        least_m = min(margin_m, footprint_clearance_m(scene, x, y, theta, margin_m)) - ROUNDING_M
        for keep_turning in (True, False):
            safe, clear_m = command_is_safe(
                scene.start,
                v,
                w,
                hold_s,
                config.check_step_s,
                keep_turning,
                drive,
                self._worse(scene),
                scene.body,
                scene.ground,
                scene.movers.foretold(
                    scene.delay_s + config.check_step_s, config.check_step_s, 30, config.people_std
                ),
                margin_m,
                config.least_margin_s,
                config.people_margin_m,
            )
            if safe and clear_m >= least_m:
                self._keep_turning = keep_turning
                return Twist(v, w)
        return None


def _laser_xy_m(view: LocalView, scene: Scene) -> tuple[float, float]:
    at = Pose2.from_array(scene.pose).compose(view.mount)
    return at.x_m, at.y_m


def _scanned(view: LocalView, scene: Scene) -> FloatArray:
    """(N, 2) where the scan's beams ended, in the order of the beams."""
    ranges, _ = cleaned_ranges(view.ranges_m, view.max_range_m)
    angles, mount = view.beam_angles_rad, view.mount
    step = float(angles[-1] - angles[0]) / (len(angles) - 1)
    in_base, _ = scan_points(
        mount.x_m, mount.y_m, mount.theta_rad, ranges, float(angles[0]), step, view.max_range_m
    )
    return Pose2.from_array(scene.pose).placed(in_base)
