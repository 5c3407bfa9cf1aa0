"""Landmarks of the last seconds, carried along by the robot, give its pose anew."""

from __future__ import annotations

import math

import numpy as np
import pytest

from pilotage.core.angles import wrap_to_pi
from pilotage.stack.localization.gauss_markov_config import EkfGaussMarkovConfig
from pilotage.stack.localization.recent_sightings import WINDOW_S, RecentSightings

POINTS = np.array([[3.0, 1.0], [1.0, 4.0], [-2.0, 2.0], [4.0, -3.0]])
MOUNT = np.array([0.2, -0.1, 0.3])
R = np.diag([0.01, 0.001])


def drive(recent: RecentSightings, landmarks: tuple[int, ...], dt_s: float = 0.4) -> np.ndarray:
    """See one landmark, move on by an arc, see the next; returns the pose at the last sighting."""
    pose = np.array([0.5, -0.3, 2.5])
    for k, landmark in enumerate(landmarks):
        if k:
            distance, angle = 0.15, 0.2
            middle = pose[2] + 0.5 * angle
            pose = pose + np.array([distance * np.cos(middle), distance * np.sin(middle), angle])
            recent.move(distance, 0.0, angle, k * dt_s)
        c, s = np.cos(pose[2]), np.sin(pose[2])
        sensor = pose[:2] + np.array([[c, -s], [s, c]]) @ MOUNT[:2]
        away = POINTS[landmark] - sensor
        bearing = np.arctan2(away[1], away[0]) - pose[2] - MOUNT[2]
        recent.add(k * dt_s, landmark, float(np.hypot(*away)), float(bearing), MOUNT)
    return pose


@pytest.mark.parametrize("landmarks", [(0, 1, 0), (2, 3, 1, 0)])
def test_pictures_of_a_moving_robot_are_laid_together(landmarks: tuple[int, ...]) -> None:
    recent = RecentSightings()
    pose = drive(recent, landmarks)
    fix = recent.fix(POINTS, R, least_landmarks=2)
    assert fix is not None
    np.testing.assert_allclose(fix.pose[:2], pose[:2], atol=1e-9)
    assert abs(wrap_to_pi(float(fix.pose[2] - pose[2]))) < 1e-9
    assert fix.chi2 < 1e-12


def test_too_little_gives_no_pose() -> None:
    for landmarks in ((0, 0, 0), (0, 1), ()):
        recent = RecentSightings()
        drive(recent, landmarks)
        assert recent.fix(POINTS, R, least_landmarks=2) is None


def test_old_sightings_and_those_before_unknown_motion_are_dropped() -> None:
    recent = RecentSightings()
    drive(recent, (0, 1, 2))
    recent.move(0.1, 0.0, 0.0, 2.0 * WINDOW_S)
    assert recent.fix(POINTS, R, least_landmarks=2) is None
    drive(recent, (0, 1, 2))
    recent.forget()
    assert recent.fix(POINTS, R, least_landmarks=2) is None


def test_an_error_of_which_one_field_is_given_keeps_the_others() -> None:
    config = EkfGaussMarkovConfig.model_validate({"landmark_range_error": {"std": 0.02}})
    assert config.landmark_range_error.std == 0.02
    assert config.landmark_range_error.time_constant_s == 30.0


def test_sightings_lie_where_each_move_would_have_carried_them(monkeypatch: pytest.MonkeyPatch) -> None:
    """They are carried when somebody asks for a pose, to the bit as if it had been done at every move."""
    rng, recent = np.random.default_rng(3), RecentSightings()
    laid: list[np.ndarray] = []
    monkeypatch.setattr(
        "pilotage.stack.localization.recent_sightings.fix_from_beacons",
        lambda _, ranges, bearings, *__: laid.append(np.column_stack([ranges, bearings])),
    )
    points, seen = rng.uniform(-3.0, 3.0, (4, 2)), list[tuple[float, float, float]]()
    for k in range(400):
        t_s = 0.05 * k
        arc, aside, turn = rng.normal(0.0, 0.1, 3).tolist()
        recent.move(arc, aside, turn, t_s)
        c, s = math.cos(0.5 * turn), math.sin(0.5 * turn)
        dx, dy = arc * c - aside * s, arc * s + aside * c
        c, s = math.cos(turn), math.sin(turn)
        moved = [(t, x - dx, y - dy) for t, x, y in seen if t >= t_s - WINDOW_S]
        seen = [(t, c * x + s * y, -s * x + c * y) for t, x, y in moved]
        if k % 3 == 0:
            range_m, bearing_rad = float(rng.uniform(1.0, 5.0)), float(rng.uniform(-1.0, 1.0))
            recent.add(t_s, k % 4, range_m, bearing_rad, np.zeros(3))
            seen.append((t_s, range_m * math.cos(bearing_rad), range_m * math.sin(bearing_rad)))
        if k % 17 == 16:
            assert recent.fix(points, np.eye(2), 2) is None
            at = np.array([(x, y) for _, x, y in seen])
            polar = np.column_stack([np.hypot(*at.T), np.arctan2(at[:, 1], at[:, 0])])
            assert np.array_equal(laid[-1], polar)
    assert len(recent._moves) <= WINDOW_S / 0.05 + 2
