"""The last look at a command: held for a step and then braked, does it touch anything that was seen?"""

from __future__ import annotations

import math
from collections.abc import Sequence

from pilotage.core.types import STOP, Twist
from pilotage.kernels.control.ground import sure_clearance
from pilotage.kernels.control.motion_limits import command_is_safe
from pilotage.stack.control.local.rolling import Scene

BRAKE_TRUST = 0.65
"""Share of the data sheet's braking that is reckoned with."""
STEP_S, STEPS = 0.05, 30
ROUNDING_M = 1e-6
MARGIN_M, MARGIN_S = 0.01, 0.015
"""To what was seen, at rest, and more per m/s."""
PEOPLE_MARGIN_M, PEOPLE_STD = 0.05, 1.5
"""To where moving bodies are foretold, with so many standard deviations of the place."""
SLOWER = (1.0, 0.5, 0.25, 0.125)
"""Shares of a command's speed that are tried along its arc."""
LESS = 0.8
"""Of the margin, where no command keeps all of it."""
BACK_M_S = 0.1
"""Backwards, where nothing else is free."""
ROUND = 0.98
"""With an inner radius of this share of the outer one a body is a disc, by the corners that stand for one."""
AT_REST_M_S = 0.01
"""Slower than this a robot stands."""
BACK_M, GAIN = 0.05, 0.1
"""From within the margin it backs where that brings it away by this share of the way."""


def is_safe(scene: Scene, command: Twist, margin_m: float = MARGIN_M) -> bool:
    """Whether a command can be held for a step and then be braked along its arc, also with worse brakes.

    Nearer than ``margin_m`` to what was seen it may not come, and where it already is, no nearer at all:
    a millimetre in every step would end in a contact. A round robot at rest may turn wherever it stands.
    """
    x, y, theta, v_m_s, _ = scene.start
    turns = command.v_m_s == command.lateral_m_s == 0.0 and abs(v_m_s) < AT_REST_M_S
    if turns and scene.body.inner_m > ROUND * scene.body.outer_m:
        return True
    begin = footprint_clearance_m(scene, x, y, theta, margin_m)
    discs = scene.movers.foretold(scene.delay_s + STEP_S, STEP_S, STEPS, PEOPLE_STD)
    safe, least = command_is_safe(
        scene.start,
        command.v_m_s,
        command.w_rad_s,
        scene.dt_s,
        STEP_S,
        True,
        scene.drive,
        scene.sheet.scaled(BRAKE_TRUST),
        scene.body,
        scene.ground,
        discs,
        margin_m,
        MARGIN_S,
        PEOPLE_MARGIN_M,
    )
    return bool(safe and least >= min(margin_m, begin) - ROUNDING_M)


def footprint_clearance_m(scene: Scene, x: float, y: float, theta: float, enough_m: float) -> float:
    """Of the footprint at a pose from what was seen, exact below ``enough_m``."""
    ground, body = scene.ground, scene.body
    clearance_m: float = sure_clearance(
        x,
        y,
        theta,
        body.polygon,
        body.outer_m,
        ground.hits,
        ground.nearest,
        ground.mean,
        ground.x0_m,
        ground.y0_m,
        ground.cell_m,
        ground.per_cell,
        enough_m,
    )
    return clearance_m


def slower(command: Twist) -> list[Twist]:
    """A command and ever slower ones along the same arc."""
    return [Twist(share * command.v_m_s, share * command.w_rad_s) for share in SLOWER]


def first_safe(scene: Scene, commands: Sequence[Twist], margin_m: float = MARGIN_M) -> Twist:
    """The first of the commands that is safe; where none is, slowly straight back, or else a stop.

    Where none keeps the margin a little less will do: beside a corner the best of them dips into it.
    """
    back = Twist(-min(scene.drive.reverse, BACK_M_S), 0.0)
    for keep_m in (margin_m, LESS * margin_m):
        for command in commands:
            if is_safe(scene, command, keep_m):
                return command
    return back if _leaves(scene, margin_m) and is_safe(scene, back, margin_m) else STOP


def _leaves(scene: Scene, margin_m: float) -> bool:
    """Whether backing brings it away from what is within the margin; else it slides along, and touches it."""
    x, y, theta, _, _ = scene.start
    room_m = footprint_clearance_m(scene, x, y, theta, margin_m)
    if room_m >= LESS * margin_m:
        return True
    x, y = x - BACK_M * math.cos(theta), y - BACK_M * math.sin(theta)
    return footprint_clearance_m(scene, x, y, theta, margin_m) > room_m + GAIN * BACK_M
