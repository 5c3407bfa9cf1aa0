"""A robot in the open that does not see the ground which its width asks for looks around, and drives on."""

from __future__ import annotations

import math

import numpy as np
import pytest

from pilotage.core.types import Pose2, Twist
from pilotage.kernels.control.ground import seen_under
from pilotage.kernels.control.motion_limits import Drive, advance
from pilotage.kernels.scans.rays import fan_ranges
from pilotage.models.footprint import Footprint
from pilotage.stack.control.local.body import make_body
from pilotage.stack.control.local.drive import polygon_around
from pilotage.stack.control.local.role import LOCAL_CONTROLLERS, LocalLimits, LocalView

HALL = np.array(
    [[-3.0, -3.0, 5.0, -3.0], [5.0, -3.0, 5.0, 3.0], [5.0, 3.0, -3.0, 3.0], [-3.0, 3.0, -3.0, -3.0]]
)
AHEAD = np.linspace(-0.25 * math.pi, 0.25 * math.pi, 200)
WEAK = LocalLimits(2.4, 0.5, 0.34, 0.34, 2.5, 5.0)
GOAL = 1.5, -1.0


def _arrives_s(name: str, heading_rad: float) -> float:
    """When a disc of 0.45 m that sees a quarter of the circle is at its goal, 4.6 m off; inf within 40 s."""
    config = LOCAL_CONTROLLERS.configure(name, {}, name)
    controller = LOCAL_CONTROLLERS.entry(name).factory(config, np.random.default_rng(1))
    outline, true = polygon_around(Footprint.disc(0.45)), Drive(2.4, 0.5, 0.34, 0.34, 2.5, 5.0)
    step, mount = float(AHEAD[1] - AHEAD[0]), Pose2(0.0, 0.0, 0.0)
    state = (-2.0, 2.0, heading_rad, 0.0, 0.0)
    for k in range(800):
        x, y, theta, v, w = state
        ranges = fan_ranges(x, y, theta + float(AHEAD[0]), step, AHEAD.size, 20.0, HALL, np.zeros((0, 3)))
        view = LocalView(
            0.05 * k, Pose2(x, y, theta), Twist(v, w), ranges, AHEAD, mount, 20.0, GOAL, WEAK, outline, 0.25,
            goal_is_sure=True,
        )  # fmt: skip
        command = controller.step(view)
        if controller.status == "arrived":
            return 0.05 * k
        state = advance(*state, command.v_m_s, command.w_rad_s, 0.05, true)
    return math.inf


@pytest.mark.parametrize("name", ["dwa", "vfh", "teb", "mppi", "pure-pursuit", "gap-horizon"])
def test_nobody_stands_in_the_open(name: str) -> None:
    """`teb`, and mostly `dwa` and `gap-horizon`, stood for good beside ground that a turn shows."""
    assert max(_arrives_s(name, heading_rad) for heading_rad in (-0.3, 1.2)) < 30.0


def test_a_round_robot_that_turns_stands_on_the_same_ground() -> None:
    """Half a metre from what it never saw: discs over its pieces reached farther out at some headings."""
    body = make_body(polygon_around(Footprint.disc(0.45)))
    unseen = np.full((40, 40), 0.42)
    seen = {
        bool(
            seen_under(
                2.0,
                2.0,
                math.cos(theta),
                math.sin(theta),
                body.outer_m,
                body.discs,
                unseen,
                0.0,
                0.0,
                0.1,
                10.0,
            )
        )
        for theta in np.linspace(-math.pi, math.pi, 60)
    }
    assert seen == {True}
