"""The report's wall filter as its program ran it: its error matrix, its joint gate, its own route."""

from __future__ import annotations

import math

import numpy as np
import pytest

from pilotage.core.errors import InputError
from pilotage.core.types import FloatArray
from pilotage.evaluation.driving import poses
from pilotage.experiments.build.build import build
from pilotage.experiments.loop import run_loop
from pilotage.experiments.mission import load_mission
from pilotage.experiments.studies.study import load_study
from pilotage.kernels.lines import infinite


def test_the_error_matrix_compares_walls_of_one_side_only() -> None:
    """A robot at (1, 1) beside the walls x = 0, x = 5, y = 0, and one across the corner."""
    lines = np.array(
        [[1.0, 0.0, 0.0], [1.0, 0.0, -5.0], [0.0, 1.0, 0.0], [math.sqrt(0.5), math.sqrt(0.5), -5.0]]
    )
    feet = np.array([[-1.1, 0.0], [3.8, 0.0], [-0.2, -1.0], [-0.9, 0.9]])  # left, right, below, oblique
    errors = infinite.error_matrix(1.0, 1.0, feet, lines, 0.5)
    assert errors[0] == pytest.approx([0.1, 99.0, 99.0, 99.0])
    assert errors[1] == pytest.approx([99.0, -0.2, 99.0, 99.0])
    assert errors[2] == pytest.approx([99.0, 99.0, math.hypot(1.0, 0.2) - 1.0, 99.0])
    assert (errors[3] == infinite.NO_ERROR).all()


def lines_of(*walls: FloatArray, noise_m: float = 0.0) -> FloatArray:
    rng = np.random.default_rng(0)
    points = np.concatenate(walls)
    points = points + noise_m * rng.standard_normal(points.shape)
    labels = np.zeros(len(points), np.int64)
    return infinite.cluster_lines(np.ascontiguousarray(points), labels, 0.1, 10, rng.random(2048))


def test_a_cluster_around_a_corner_gives_both_lines() -> None:
    along = np.linspace(0.0, 2.0, 40)
    feet = lines_of(
        np.column_stack([along, np.full(40, 2.0)]), np.column_stack([2.0 + 0.015 * along, along])[::-1]
    )
    # A point of the other wall may be an inlier, and an extreme one.
    assert feet.shape == (2, 2)
    assert feet[np.argsort(feet[:, 0])] == pytest.approx(np.array([[0.0, 2.0], [2.0, 0.0]]), abs=0.15)


def test_a_wall_along_y_comes_out_in_pieces_where_its_points_are_noisy() -> None:
    """Its lines are polynomials y of x: 3 mm of noise across a wall of slope 68 are 0.2 m along y."""
    y = np.linspace(1.0, 6.0, 120)
    along_y, along_x = np.column_stack([4.0 - y / 68.0, y]), np.column_stack([y, 4.0 - y / 68.0])
    assert len(lines_of(along_y)) == len(lines_of(along_x)) == 1
    assert len(lines_of(along_x, noise_m=0.003)) == 1
    assert len(lines_of(along_y, noise_m=0.003)) > 2


def errors_m(overrides: list[str], seed: int) -> tuple[FloatArray, float]:
    """Position errors over a run, and the share of steps with an update."""
    trace = (
        run_loop(build(load_mission("museum-walls-report", overrides, seed)), None).finished.robots[0].trace
    )
    off = (poses(trace, "est") - poses(trace, "true"))[:, :2]
    return np.hypot(*off.T), float((trace["lines_accepted"] > 0).mean())


def setting(threshold: float, variance: float) -> list[str]:
    return [f"stack.localizer.threshold_chi2={threshold}", f"stack.localizer.distance_var_m2={variance}"]


def test_no_scan_passes_the_first_setting_and_more_pass_each_of_the_others() -> None:
    """Figures 15, 17 and 18; the first 26 s, seed 1."""
    short = "run.time_limit_s=26"
    nothing, none = errors_m([*setting(0.0039, 0.01), short], 1)
    _, some = errors_m([*setting(1.0, 1.0), short], 1)
    _, most = errors_m([*setting(2.0, 5.0), short], 1)
    assert none < 0.01 < some < most
    assert nothing.max() < 1.0, "the odometry alone, from the true pose"


def test_figures_15_and_16_last_longer_than_17_and_the_sign_is_what_loses_it() -> None:
    """The whole drive, seed 0: when each is first 1 m off."""

    def tracked_s(overrides: list[str]) -> float:
        return float(0.05 * np.argmax(np.append(errors_m(overrides, 0)[0], 9.0) > 1.0))

    assert tracked_s(setting(0.1, 0.5)) > 80.0
    assert 20.0 < tracked_s(setting(1.0, 1.0)) < 80.0
    mended, taken = errors_m([*setting(2.0, 5.0), "stack.localizer.jacobian=signed"], 0)
    assert mended.max() < 0.6, "figure 18: below 0.5 m to the end"
    assert taken > 0.8


def test_the_kept_matrix_has_a_column_for_each_wall() -> None:
    experiment = build(load_mission("museum-walls-report", ["run.time_limit_s=2"], 0))
    run_loop(experiment, None)
    kept = np.asarray(experiment.team[0].journal.results()["error_matrix_m"])
    assert kept.shape[0] >= 4
    assert kept.shape[1] == 32
    assert (np.abs(kept) < 0.1).any(axis=1).sum() >= 3


def test_its_scan_heading_needs_a_compass() -> None:
    with pytest.raises(InputError, match="one compass"):
        build(load_mission("museum-walls-report", ["robot.sensors.compass=null"]))


def test_the_study_has_the_four_settings_and_ours() -> None:
    cells = load_study("museum-walls-report").cells
    assert [cell.name for cell in cells][-1] == "ours"
    assert len(cells) == 7
    assert all(cell.published for cell in cells[:4])


def test_a_program_of_commands_ends_each_leg_on_time() -> None:
    legs = "[{duration_s: 0.5, speed_m_s: 0.4}, {duration_s: 0.3, turn_rate_rad_s: 1.0}, {duration_s: 0.2}]"
    experiment = build(load_mission("calibrate-x", [f"stack.navigator.program={legs}", "run.dt_s=0.1"]))
    trace = run_loop(experiment, None).finished.robots[0].trace
    assert trace["v_cmd_m_s"][:10] == pytest.approx([0.4] * 5 + [0.0] * 5)
    assert trace["w_cmd_rad_s"][:10] == pytest.approx([0.0] * 5 + [1.0] * 3 + [0.0] * 2)
