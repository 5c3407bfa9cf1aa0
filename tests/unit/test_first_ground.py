"""The ground that a robot stands on at first, which its laser does not show: it may turn there."""

from __future__ import annotations

import math

import numpy as np
import pytest

from pilotage.core.types import FloatArray, Pose2, Twist
from pilotage.kernels.control.ground import seen_under
from pilotage.models.footprint import Footprint
from pilotage.stack.control.local.drive import polygon_around
from pilotage.stack.control.local.role import LocalLimits, LocalView
from pilotage.stack.control.local.rolling import RollingGround, Scene
from pilotage.stack.control.local.rolling_config import RollingConfig

ANGLES = np.linspace(-0.75 * math.pi, 0.75 * math.pi, 541)
LIMITS = LocalLimits(1.0, 0.5, 2.0, 2.0, 2.0, 8.0)
OUTLINES = [
    *(polygon_around(Footprint.disc(radius_m)) for radius_m in (0.15, 0.2, 0.29, 0.4)),
    np.array([[0.3, 0.0], [0.15, 0.26], [-0.15, 0.26], [-0.3, 0.0], [-0.15, -0.26], [0.15, -0.26]]),
    np.array([[0.36, 0.2], [-0.36, 0.2], [-0.36, -0.2], [0.36, -0.2]]),
    np.array([[0.254, 0.215], [-0.254, 0.215], [-0.254, -0.215], [0.254, -0.215]]),
    np.array([[0.5, 0.2], [-0.1, 0.2], [-0.1, -0.2], [0.5, -0.2]]),
]


def _scene(pose: Pose2, outline_m: FloatArray) -> Scene:
    return RollingGround(RollingConfig()).update(_view(0.0, pose, outline_m))


def _view(t_s: float, pose: Pose2, outline_m: FloatArray) -> LocalView:
    """In the open, where three quarters of the circle are looked at."""
    return LocalView(
        t_s,
        pose,
        Twist(0.0, 0.0),
        np.full(len(ANGLES), 20.0),
        ANGLES,
        Pose2(0.0, 0.0, 0.0),
        20.0,
        (6.0, 0.0),
        LIMITS,
        outline_m,
    )


def _is_seen(scene: Scene, x: float, y: float, theta: float) -> bool:
    ground, body = scene.ground, scene.body
    return bool(
        seen_under(
            x,
            y,
            math.cos(theta),
            math.sin(theta),
            body.outer_m,
            body.discs,
            ground.unseen_m,
            ground.x0_m,
            ground.y0_m,
            ground.coarse_m,
            ground.per_coarse,
        )
    )


@pytest.mark.parametrize("outline_m", OUTLINES, ids=range(len(OUTLINES)))
def test_a_robot_turns_where_it_stands_at_first(outline_m: FloatArray) -> None:
    """Whatever its shape, and wherever in a cell it stands: round ones did not."""
    rng = np.random.default_rng(4)
    for _ in range(40):
        x, y, theta = rng.uniform([-0.1, -0.1, -math.pi], [0.1, 0.1, math.pi])
        scene = _scene(Pose2(x, y, theta), outline_m)
        assert all(_is_seen(scene, x, y, heading) for heading in np.linspace(-math.pi, math.pi, 61))


@pytest.mark.parametrize("outline_m", OUTLINES, ids=range(len(OUTLINES)))
def test_it_does_not_back_over_ground_that_it_never_saw(outline_m: FloatArray) -> None:
    """Its back may not come two cells out of the disc that it turns in, wherever in a cell it stands."""
    rng = np.random.default_rng(5)
    for _ in range(40):
        x, y, theta = rng.uniform([-0.1, -0.1, -math.pi], [0.1, 0.1, math.pi])
        scene = _scene(Pose2(x, y, theta), outline_m)
        back_m = scene.body.outer_m + 0.2 + outline_m[:, 0].min()
        assert not _is_seen(scene, x - back_m * math.cos(theta), y - back_m * math.sin(theta), theta)


@pytest.mark.parametrize("outline_m", OUTLINES, ids=range(len(OUTLINES)))
def test_who_stands_on_ground_that_it_never_saw_stands_on_seen_ground(outline_m: FloatArray) -> None:
    """Backed a little too far it stood on unseen ground, and was then led over any of it."""
    rng = np.random.default_rng(6)
    for _ in range(20):
        x, y, theta = rng.uniform([-0.1, -0.1, -math.pi], [0.1, 0.1, math.pi])
        ground, back_m = RollingGround(RollingConfig()), 0.0
        for k in range(4):
            here = Pose2(x - back_m * math.cos(theta), y - back_m * math.sin(theta), theta)
            scene = ground.update(_view(0.1 * k, here, outline_m))
            assert _is_seen(scene, here.x_m, here.y_m, theta)
            back_m += 0.04
        length_m = scene.body.outer_m - outline_m[:, 0].min()
        assert not _is_seen(
            scene, here.x_m - length_m * math.cos(theta), here.y_m - length_m * math.sin(theta), theta
        )
