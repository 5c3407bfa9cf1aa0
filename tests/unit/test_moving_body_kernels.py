"""Kernels that tell who moves about: clusters of returns, their tracks, where they will be."""

from __future__ import annotations

import math

import numpy as np
import pytest

from pilotage.core.types import FloatArray
from pilotage.kernels.control.closing_in import closes_in
from pilotage.kernels.control.movers import (
    COLUMNS,
    MISSED,
    PP,
    READINGS,
    VX,
    VY,
    X,
    Y,
    foretold,
    off_discs,
    track_step,
)
from pilotage.kernels.control.scan_clusters import cut_off, scan_clusters
from pilotage.stack.control.local.body import make_body


def test_a_walker_is_tracked_and_foretold() -> None:
    tracks = np.zeros((0, COLUMNS))
    rng = np.random.default_rng(2)
    for k in range(60):
        place = np.array([[0.05 * 1.2 * k, 1.0], [3.0, -2.0]]) + rng.normal(0.0, 0.03, (2, 2))
        tracks, of_centre = track_step(tracks, place, 0.05, 0.08, 0.8, 0.4, 0.2, 4.0, True, 8)
        assert of_centre.shape == (2,)
    assert tracks.shape[0] == 2
    walker = tracks[int(np.argmax(np.abs(tracks[:, VX])))]
    assert walker[VX] == pytest.approx(1.2, abs=0.25)
    assert abs(walker[VY]) < 0.25
    discs = foretold(tracks, 0.0, 0.5, 3, 0.25, 1.0, 0.8, 0.4)
    i = int(np.argmax(np.abs(tracks[:, VX])))
    assert discs[2, i, 0] == pytest.approx(walker[X] + walker[VX])
    assert discs[2, i, 1] == pytest.approx(walker[Y] + walker[VY])
    assert np.all(np.diff(discs[:, :, 2], axis=0) > 0.0)
    # A runner with the same readings may turn and brake by more.
    runner = walker.copy()
    runner[VX] *= 4.0
    both = foretold(np.array([walker, runner]), 1.0, 0.5, 1, 0.25, 1.0, 0.8, 0.4)[0, :, 2]
    assert both[1] > both[0] + 0.3


@pytest.mark.parametrize("dt", [0.05, 0.1])
def test_a_runner_who_turns_is_followed_whatever_the_rate(dt: float) -> None:
    """Half a second after a turn by 30 degrees, which changes the velocity by 1.4 m/s."""

    def behind(lasts: float) -> float:
        tracks, place, velocity = np.zeros((0, COLUMNS)), np.zeros(2), np.array([2.8, 0.0])
        for k in range(round(2.5 / dt)):
            if k == round(2.0 / dt):
                velocity = 2.8 * np.array([math.cos(math.pi / 6.0), math.sin(math.pi / 6.0)])
            place = place + dt * velocity
            tracks, _ = track_step(tracks, place[None], dt, 0.08, 0.8, 0.4, lasts, 4.0, True, 8)
        assert tracks.shape[0] == 1
        return math.hypot(*(tracks[0, VX : VY + 1] - velocity))

    assert behind(0.2) < 0.25
    assert behind(0.2) < 0.7 * behind(0.0)


def test_a_vague_track_does_not_take_the_centre_of_a_sure_one() -> None:
    """In standard deviations the vague one is nearer: 0.4 m of 0.41, where the sure one is 0.15 m of 0.09."""
    tracks = np.zeros((2, COLUMNS))
    tracks[:, READINGS], tracks[:, X] = 10.0, (0.15, -0.4)
    tracks[:, PP] = 0.04**2, 0.4**2
    out, of_centre = track_step(tracks, np.zeros((1, 2)), 0.05, 0.08, 0.8, 0.4, 0.2, 4.0, True, 8)
    assert of_centre.tolist() == [0]
    assert out[:, MISSED].tolist() == [0.0, 1.0]
    _, of_centre = track_step(tracks, np.zeros((1, 2)), 0.05, 0.08, 0.8, 0.4, 0.2, 4.0, False, 8)
    assert of_centre.tolist() == [1]


def test_clusters_end_at_gaps_and_wide_ones_are_none() -> None:
    wall = np.column_stack([np.full(40, 3.0), np.linspace(-2.0, 1.0, 40)])
    body = np.column_stack([np.full(6, 2.0), np.linspace(1.5, 1.8, 6)])
    centres, of_point = scan_clusters(0.0, 0.0, np.vstack([wall, body]), 0.2, 0.8, 3)
    assert centres.shape == (1, 2)
    assert np.all(of_point[:40] == -1)
    assert np.all(of_point[40:] == 0)
    assert math.hypot(*centres[0]) > math.hypot(2.0, 1.65)


def test_what_the_end_of_the_view_cuts_off_is_no_whole_thing() -> None:
    """Of three things the first beam cuts off one, and the reach another; the first and the last alike."""
    angles = np.linspace(-0.5, 0.5, 101)
    ranges = np.full(101, 20.0)
    ranges[:8], ranges[40:50], ranges[80:90] = 3.0, 4.0, 5.9
    ranges[90:93] = 6.02
    beams = np.flatnonzero(ranges < 6.0)
    points = ranges[beams, None] * np.column_stack([np.cos(angles[beams]), np.sin(angles[beams])])
    cut = cut_off(points, beams, ranges, 6.0, 0.2, False)
    assert cut.tolist() == [True] * 8 + [False] * 10 + [True] * 10
    # All around there is no end; and what stands a step behind is another thing.
    assert cut_off(points, beams, ranges, 6.0, 0.2, True).tolist() == [False] * 18 + [True] * 10
    ranges[90:93] = 6.3
    assert cut_off(points, beams, ranges, 6.0, 0.2, False).tolist() == [True] * 8 + [False] * 20


def seen_discs(*discs: tuple[float, float]) -> FloatArray:
    """(N, 2) returns of a laser at the origin, counter-clockwise, of discs of 0.25 m radius."""
    points = []
    for angle in np.arange(-0.8, 0.8, 0.0065):
        c, s = math.cos(angle), math.sin(angle)
        ranges = []
        for x, y in discs:
            along, beside = c * x + s * y, c * y - s * x
            if abs(beside) < 0.25:
                ranges.append(along - math.sqrt(0.25**2 - beside**2))
        if ranges:
            points.append((min(ranges) * c, min(ranges) * s))
    return np.array(points)


def test_two_people_side_by_side_are_two_and_a_corner_is_nobody() -> None:
    pair = [(2.5, -0.27), (2.6, 0.27)]
    centres, of_point = scan_clusters(0.0, 0.0, seen_discs(*pair), 0.22, 0.8, 3)
    assert centres.shape == (2, 2)
    assert np.abs(centres - np.array(pair)).max() < 0.1
    assert set(of_point.tolist()) == {0, 1}
    y = np.linspace(-0.6, 0.6, 30)
    for x in (3.0 - np.abs(y), 3.0 + np.abs(y), np.full(30, 3.0)):  # corners of both kinds, and a wall
        assert scan_clusters(0.0, 0.0, np.column_stack([x, y]), 0.22, 0.8, 3)[0].shape == (0, 2)


def test_who_drives_away_from_somebody_who_comes_closes_no_gap() -> None:
    body = make_body(np.array([[0.3, 0.2], [-0.3, 0.2], [-0.3, -0.2], [0.3, -0.2]]))

    def closes(after: tuple[float, float, float], x: float, y: float) -> bool:
        return bool(
            closes_in((0.0, 0.0, 0.0), after, body.polygon, body.outer_m, np.array([[x, y, 0.25]]), 0.05)
        )

    assert closes((0.05, 0.0, 0.0), 0.58, 0.0)
    assert not closes((0.05, 0.0, 0.0), 0.8, 0.0)  # far enough away
    assert not closes((0.05, 0.0, 0.0), -0.5, 0.0)  # from behind, even where he overlaps
    assert not closes((0.0, 0.0, 0.0), 0.5, 0.0)  # it stands
    assert closes((0.0, 0.0, 0.3), -0.6, 0.0)  # a corner swings towards him
    assert closes((0.001, 0.0, 0.1), 0.0, 0.5)  # turning on the spot, all around it
    assert not closes((0.1, 0.0, 0.1), -0.5, 0.0)  # a bend away from him
    assert closes((0.05, 0.0, 0.0), 0.0, 0.47)  # past him: he may be nearer than he is believed to be
    both = np.array([[0.58, 0.0, 0.25], [-0.5, 0.0, 0.25]])
    assert closes_in((0.0, 0.0, 0.0), (0.05, 0.0, 0.0), body.polygon, body.outer_m, both, 0.05)


def test_points_off_all_discs_are_those_that_arrays_find() -> None:
    rng = np.random.default_rng(8)
    for discs_there in (0, 1, 40):
        points = rng.uniform(-3.0, 3.0, (200, 2))
        discs = np.column_stack(
            [rng.uniform(-3.0, 3.0, (discs_there, 2)), rng.uniform(0.0, 0.4, discs_there)]
        )
        away = np.hypot(*(points[:, None] - discs[:, :2]).transpose(2, 0, 1)) - discs[:, 2]
        wanted = (away > 0.15).all(axis=1) & (np.hypot(points[:, 0] - 0.5, points[:, 1] + 0.2) < 2.0)
        assert 0 < np.count_nonzero(wanted) < len(points)
        assert off_discs(points, discs, 0.5, -0.2, 2.0, 0.15) == pytest.approx(points[wanted], abs=0.0)
