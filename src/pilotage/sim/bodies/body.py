"""A robot's body in truth: where it is, how it moves, what it runs into."""

from __future__ import annotations

from collections import deque

import numpy as np

from pilotage.core.types import STOP, Command, FloatArray, IntArray, Pose2, Twist
from pilotage.kernels.bodies import clearances, drive
from pilotage.models.footprint import Footprint
from pilotage.sim.bodies.motion import SimulatedMotion
from pilotage.sim.worlds.world import World

COLLISIONS, TOUCHING, BLOCKED = drive.COLLISIONS, drive.TOUCHING, drive.BLOCKED

APART_M = 1e-3
"""A body that another one ran into counts as touched until it is farther away than this."""


class Body:
    """A footprint that a motion drives through a world; a contact stops it and counts once until it is clear.

    Attributes
    ----------
    name
        The robot's.
    stopped
        Whether it stands whatever it is commanded, because something of it broke.
    touched
        What it ran into when last a collision was counted, or what into it: a few words each; who runs the
        world writes them.
    table, row, state
        (R, drive.STATE_SIZE) what the kernels keep of all bodies, and this one's row of it; see
        ``kernels.bodies.drive``.
    rates_rad_s
        (K,) true turn rates in the moves of the last step.
    owns, own
        (R, 3) the bodies' rows in the world's traffic, and (3,) this one's.
    """

    def __init__(
        self,
        name: str,
        footprint: Footprint,
        motion: SimulatedMotion,
        start: Pose2,
        world: World,
        dt_s: float,
        table: FloatArray,
        row: int,
        owns: IntArray,
        delay_steps: int = 0,
    ) -> None:
        self.name, self.footprint, self.motion, self.world = name, footprint, motion, world
        self.stopped = False
        self.touched: tuple[str, ...] = ()
        self.table, self.row, self.owns = table, row, owns
        self.state, self.own = table[row], owns[row]
        own = self.own
        self.rates_rad_s: FloatArray = np.zeros(len(motion.moves))
        self._dt_s = dt_s
        self._under_way: deque[Command] | None = deque([STOP] * delay_steps) if delay_steps else None
        self._outline, self._others = footprint.outline, world.traffic.others
        self._among_all = (self._outline, world.fixed, self._others, own)
        self._step = (dt_s, motion.spins_on, motion.release_m, *self._among_all)
        self.carry_to(start)

    @property
    def pose(self) -> Pose2:
        """The true pose."""
        x, y, theta = self.state[:3].tolist()
        return Pose2(x, y, theta)

    @property
    def twist(self) -> Twist:
        """The true velocity, the mean over the last step; at rest after a contact that ended the step."""
        state = self.state
        if state[BLOCKED] > 0.0 and not self.motion.spins_on:
            return Twist(0.0, 0.0)
        distance, lateral, angle = state[drive.DISTANCE : drive.ANGLE + 1].tolist()
        return Twist(distance / self._dt_s, angle / self._dt_s, lateral / self._dt_s)

    @property
    def clearance_m(self) -> float:
        """Distance from the footprint's edge to what is nearest, walls or others; inf for nothing."""
        return float(self.state[drive.CLEARANCE])

    @property
    def collisions(self) -> int:
        """How often it ran into something, or another body into it."""
        return int(self.state[COLLISIONS])

    @property
    def touching(self) -> bool:
        """Whether it touches something now."""
        return bool(self.state[TOUCHING] > 0.0)

    @property
    def driven_m(self) -> float:
        """Length of the centre's path so far."""
        return float(self.state[drive.DRIVEN])

    @property
    def on_hazard(self) -> bool:
        """Whether its centre is on a hazard of open ground, which does not stop it."""
        ground = self.world.ground
        return ground is not None and ground.on_hazard(float(self.state[0]), float(self.state[1]))

    def step(self, command: Command) -> None:
        """Drive one step, by the command that takes effect now."""
        if self.stopped:
            command = STOP
        motion = self.motion
        if self._under_way is not None:
            self._under_way.append(command)
            command = self._under_way.popleft()
        motion.command(command)
        if drive.drive(self.state, motion.moves, self.rates_rad_s, *self._step) and not motion.spins_on:
            motion.stop()

    def carry_to(self, pose: Pose2) -> None:
        """Set it down elsewhere, standing still; its wheels do not turn meanwhile."""
        state = self.state
        state[:3] = pose.x_m, pose.y_m, pose.theta_rad
        state[drive.DISTANCE : drive.BLOCKER + 1] = 0.0
        state[TOUCHING] = 0.0
        self.motion.stop()
        self.rates_rad_s[:] = 0.0
        x, y, theta = state[:3].tolist()
        fixed = float(clearances.fixed_clearance(x, y, theta, *self._among_all[:2]))
        state[drive.FIXED_CLEARANCE] = fixed
        if len(self.world.traffic.own):
            drive.place_outline(state, self._outline, self._others, self.own)
        gap = clearances.others_clearance(x, y, theta, self._outline, self._others, self.own)
        state[drive.CLEARANCE] = min(fixed, gap)

    def run_into(self, now: bool) -> None:
        """Count that another body runs into this one, once until both are apart again."""
        state = self.state
        if now and state[TOUCHING] == 0.0:
            state[COLLISIONS] += 1.0
            state[TOUCHING] = 2.0
        elif not now and state[TOUCHING] == 2.0 and state[drive.CLEARANCE] >= APART_M:
            state[TOUCHING] = 0.0

    def contact_bearing_rad(self) -> float:
        """Where on the footprint something is nearest, from the axle in the base frame, not wrapped."""
        x, y, theta = self.state[:3].tolist()
        return float(clearances.contact_bearing(x, y, theta, *self._among_all))

    def apart_at_m(self, pose: Pose2) -> float:
        """Clearance from all other bodies if it stood elsewhere; inf where there are none."""
        x, y, theta = pose.x_m, pose.y_m, pose.theta_rad
        return float(clearances.others_clearance(x, y, theta, self._outline, self._others, self.own))

    def distance_to_m(self, other: Body) -> float:
        """Clearance from another robot."""
        traffic, (first, last, disc) = self.world.traffic, other.own.tolist()
        circles = traffic.circles_m[disc : disc + 1] if disc >= 0 else traffic.circles_m[:0]
        sides = traffic.segments_m[first:last]
        nobody = np.array([0, 0, -1], dtype=np.int64)
        x, y, theta = self.state[:3].tolist()
        return float(clearances.others_clearance(x, y, theta, self._outline, (sides, circles), nobody))
