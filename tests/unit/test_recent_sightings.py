"""Landmarks of the last seconds, carried along by the robot, give its pose anew."""

from __future__ import annotations

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
