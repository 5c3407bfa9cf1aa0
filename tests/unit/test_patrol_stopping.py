"""Robots on patrol stop in time: what of a command may be braked, and the best arc of those that may."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pilotage.core.types import FloatArray
from pilotage.kernels.control import disc_returns, eikonal, safe_stop, voronoi_window
from pilotage.kernels.geometry.field import Field
from pilotage.kernels.geometry.motion import exact_arc, wrap
from pilotage.stack.navigator.patrol.gate import NO_GATE

NOBODY = np.zeros((0, 2))
REACTION, BRAKING = 0.25, 2.0
NO_MAP = np.zeros((1, 1))


def stops(
    v: float,
    w: float,
    near: FloatArray,
    strange: FloatArray,
    people: FloatArray = NOBODY,
    *,
    turning: float | None = None,
    known: FloatArray = NO_MAP,
) -> bool:
    """Whether one that drives at v, and turns at w or at another rate yet, may be told (v, w)."""
    limits = np.array([1.5, 2.0, BRAKING, 2.0, 8.0, 0.2])
    safety = np.array([REACTION, 0.3, 0.04, 0.1, 1.4])
    now = w if turning is None else turning
    return bool(
        safe_stop.stop_is_clear(
            v, now, v, w, limits, safety, (near, strange, people), np.zeros(3), (known, -2.0, -2.0, 0.1)
        )
    )


class TestStopping:
    @settings(max_examples=200, deadline=None)
    @given(
        gap=st.floats(0.05, 4.0),
        bearing=st.floats(-1.5, 1.5),
        first=st.floats(0.0, 1.5),
        second=st.floats(0.0, 1.5),
    )
    def test_two_that_both_may_go_on_come_to_rest_apart(
        self, gap: float, bearing: float, first: float, second: float
    ) -> None:
        """Each knows only where the other's surface is, and drives straight at it as fast as it may."""
        away = gap + 0.3  # from an axle to the other's nearest point
        seen = away * np.array([[math.cos(bearing), math.sin(bearing)]])
        come = 0.0
        for speed in (first, second):
            if stops(speed, 0.0, NOBODY, seen):
                come += max(0.0, (speed * REACTION + 0.5 * speed**2 / BRAKING) * math.cos(bearing))
        assert come <= max(gap - 0.1, 0.0) + 1e-3

    def test_turning_on_the_spot_is_free_and_backing_off_is(self) -> None:
        touching = np.array([[0.31, 0.0]])
        assert stops(0.0, 2.0, touching, touching)
        assert not stops(0.2, 0.0, touching, NOBODY)
        assert not stops(0.2, 0.0, NOBODY, touching)
        assert stops(-0.2, 0.0, touching, touching)

    def test_who_is_nearer_than_the_margin_may_slide_along_a_wall_and_not_come_nearer(self) -> None:
        wall = np.column_stack([np.linspace(-1.0, 1.0, 81), np.full(81, 0.32)])
        assert stops(0.5, 0.0, wall, NOBODY)
        assert not stops(0.5, 0.3, wall, NOBODY)
        assert stops(0.5, -0.3, wall, NOBODY)

    def test_what_the_ramp_of_the_turn_rate_sweeps_counts(self) -> None:
        """From a hard turn to the right, told to go straight, it still comes further to the right."""
        beside = np.array([[0.45, -0.39]])
        assert stops(1.0, 0.0, beside, NOBODY)
        assert not stops(1.0, 0.0, beside, NOBODY, turning=-2.0)

    @pytest.mark.parametrize(("y_m", "clear"), [(0.5, True), (0.33, False)])
    def test_a_wall_seen_end_on_is_known_from_the_map(self, y_m: float, clear: bool) -> None:
        """A wall of no width, from (0.4, y) to the right, returns nothing to who looks along it."""
        rows, columns = np.mgrid[:41, :41]
        x, y = 0.1 * columns - 2.0, 0.1 * rows - 2.0
        field = np.hypot(np.minimum(x - 0.4, 0.0), y - y_m)
        assert stops(1.0, 0.0, NOBODY, NOBODY)
        assert stops(1.0, 0.0, NOBODY, NOBODY, known=field) is clear

    @pytest.mark.parametrize("bearing", [-0.5, 0.5])
    def test_who_came_to_rest_at_a_corner_that_its_field_cuts_turns_past_it(self, bearing: float) -> None:
        """Straight on, where the time falls, the corner is too near; a little to the side it is not."""
        limits, safety = np.array([1.0, 2.0, 2.0, 2.0, 8.0, 0.2]), np.array([REACTION, 0.3, 0.06, 0.1, 1.4])
        corner = 0.361 * np.array([math.cos(bearing), math.sin(bearing)])
        time = np.tile(6.0 - 0.1 * np.arange(61), (61, 1))
        pose, v, w = np.zeros(3), 0.0, 0.0
        for _ in range(25):
            ahead = disc_returns.rotated((corner - pose[:2])[None], -pose[2])
            assert math.hypot(*ahead[0]) > 0.35
            seen, field, known = (
                (ahead, NOBODY, NOBODY),
                (time, -2.0, -3.0, 0.1),
                (NO_MAP, 0.0, 0.0, 0.1),
            )
            window = (0.9, 0.3, 0.5, 0.25, 6, 15, 0.0)
            v, w, _ = voronoi_window.choose(
                v, w, pose, limits, safety, seen, field, NO_GATE, known, 0.0, window
            )
            pose = pose + 0.2 * np.array(
                [v * math.cos(pose[2] + 0.1 * w), v * math.sin(pose[2] + 0.1 * w), w]
            )
        assert pose[0] > 1.0

    @pytest.mark.parametrize("acceleration", [0.3, 0.5, 2.0])
    def test_who_stands_beside_the_field_sets_out_however_slowly_it_speeds_up(
        self, acceleration: float
    ) -> None:
        """A place told 0.3 m wrong has no time to go; in its first arc a weak one comes 3 cm nearer."""
        limits = np.array([1.0, acceleration, acceleration, 2.0, 8.0, 0.1])
        safety = np.array([0.15, 0.3, 0.06, 0.1, 1.4])
        time = np.tile(6.0 - 0.15 * np.arange(41), (41, 1))
        time[:, :20] = np.inf
        pose, v, w = np.array([-0.2, 0.0, 0.0]), 0.0, 0.0
        for _ in range(100):
            v, w, _ = voronoi_window.choose(
                v,
                w,
                pose,
                limits,
                safety,
                (NOBODY, NOBODY, NOBODY),
                (time, -3.0, -3.0, 0.15),
                NO_GATE,
                (NO_MAP, 0.0, 0.0, 0.1),
                0.0,
                (0.9, 0.3, 0.5, 0.25, 6, 15, 0.0),
            )
            pose = pose + 0.1 * np.array([v * math.cos(pose[2]), v * math.sin(pose[2]), w])
        assert pose[0] > 0.5

    @pytest.mark.parametrize(("x_m", "y_m"), [(-0.222, 0.17), (-0.25, 0.19), (-0.222, -0.17)])
    def test_who_came_to_rest_beside_the_edge_of_a_door_gets_through(self, x_m: float, y_m: float) -> None:
        """The field knows one row of nodes in the door, and leads into its edge."""
        limits, safety = np.array([1.0, 2.0, 2.0, 2.0, 8.0, 0.2]), np.array([REACTION, 0.3, 0.06, 0.1, 1.4])
        half_m, row_m = 0.45, math.copysign(0.05, y_m)
        beside = np.linspace(half_m, 2.0, 60)
        wall = np.column_stack([np.zeros(120), np.concatenate([beside, -beside])])
        rows, columns = np.mgrid[:41, :41]
        x, y = 0.15 * (columns - 20), row_m + 0.15 * (rows - 20)
        to_wall_m = np.hypot(x, np.maximum(half_m - np.abs(y), 0.0))
        time = np.where(x < 0.0, 4.0 + np.hypot(x, y - row_m), 4.0 - x)
        time[to_wall_m < 0.38] = np.inf
        pose, v, w = np.array([x_m, y_m, 0.0]), 0.0, 0.0
        for _ in range(40):
            near = disc_returns.rotated(wall - pose[:2], -pose[2])
            assert np.hypot(*near.T).min() > 0.34
            v, w, _ = voronoi_window.choose(
                v,
                w,
                pose,
                limits,
                safety,
                (near, NOBODY, NOBODY),
                (time, -3.0, row_m - 3.0, 0.15),
                NO_GATE,
                (NO_MAP, 0.0, 0.0, 0.1),
                0.0,
                (0.9, 0.3, 0.5, 0.25, 6, 15, 0.0),
            )
            pose = pose + 0.2 * np.array(
                [v * math.cos(pose[2] + 0.1 * w), v * math.sin(pose[2] + 0.1 * w), w]
            )
            if pose[0] > 0.5:
                return
        pytest.fail(f"it stands at {pose}")

    def test_who_rolls_on_weak_brakes_does_not_turn_into_the_wall_beside_it(self) -> None:
        """A wall ahead, just beyond its stop, one to its left, and the field leads back, to the left."""
        limits, safety = np.array([1.0, 0.3, 0.3, 2.0, 2.0, 0.2]), np.array([REACTION, 0.3, 0.06, 0.1, 1.4])
        along = np.linspace(0.0, 1.19, 60)
        left = np.column_stack([along, np.full(60, 0.42)])
        ahead = np.column_stack([np.full(60, 1.19), np.linspace(-1.0, 0.42, 60)])
        walls = np.concatenate([left, ahead])
        rows, columns = np.mgrid[:41, :41]
        time = 10.0 + 0.15 * (columns - 20) - 0.1 * 0.15 * (rows - 20)
        pose, v, w = np.zeros(3), 0.7, 0.0
        for step in range(60):
            near = disc_returns.rotated(walls - pose[:2], -pose[2])
            told_v, told_w, _ = voronoi_window.choose(
                v,
                w,
                pose,
                limits,
                safety,
                (near, NOBODY, NOBODY),
                (time, -3.0, -3.0, 0.15),
                NO_GATE,
                (NO_MAP, 0.0, 0.0, 0.1),
                0.0,
                (0.9, 0.3, 0.5, 0.25, 6, 15, 0.0),
            )
            for _ in range(20):
                v, w = safe_stop.toward(v, told_v, 0.003), safe_stop.toward(w, told_w, 0.02)
                pose = pose + 0.01 * np.array([v * math.cos(pose[2]), v * math.sin(pose[2]), w])
                assert np.hypot(*(walls - pose[:2]).T).min() > 0.33, step
        assert abs(pose[2]) > 1.0  # at rest it turned

    @pytest.mark.parametrize("side", [1.0, -1.0])
    @pytest.mark.parametrize("others", ["nobody", "a mate", "a walker"])
    def test_who_stops_in_a_bend_does_not_roll_off_it_into_the_wall(self, side: float, others: str) -> None:
        """On weak brakes it rolls on for 0.6 m: straight on that ends in the wall outside of the bend.

        So it does before somebody from whom no arc keeps what it should.
        """
        limits, safety = np.array([1.2, 1.0, 1.0, 2.0, 8.0, 0.2]), np.array([REACTION, 0.25, 0.06, 0.1, 1.4])
        along = np.linspace(-0.5, 1.5, 200)
        wall = np.column_stack([along, -side * (0.36 - 0.23 * along)])
        walker, mate = np.array([[1.6, 0.5 * side]]), np.array([[0.9, 0.3 * side]])
        strange, people = {
            "nobody": (NOBODY, NOBODY),
            "a mate": (mate, NOBODY),
            "a walker": (walker, walker),
        }[others]
        least = []
        for is_told in (True, False):
            pose, v, w = np.zeros(3), 1.1, 0.85 * side
            for _ in range(8):
                near, moving, coming = (
                    disc_returns.rotated(points - pose[:2], -pose[2]) for points in (wall, strange, people)
                )
                seen, known = (near, moving, coming), (NO_MAP, 0.0, 0.0, 0.1)
                turn = safe_stop.braking_turn(v, w, limits, safety, seen, pose, known)
                for _ in range(20):
                    v = safe_stop.toward(v, 0.0, 0.01)
                    w = safe_stop.toward(w, turn if is_told else 0.0, 0.08)
                    pose = pose + 0.01 * np.array([v * math.cos(pose[2]), v * math.sin(pose[2]), w])
                    least.append(float(np.hypot(*(wall - pose[:2]).T).min()))
            if is_told:
                assert min(least) > 0.25
        assert min(least) < 0.25

    def test_who_stops_straight_on_where_that_is_clear_is_told_no_turn(self) -> None:
        limits, safety = np.array([1.2, 1.0, 1.0, 2.0, 8.0, 0.2]), np.array([REACTION, 0.25, 0.06, 0.1, 1.4])
        seen, known = (np.array([[1.2, 0.0]]), NOBODY, NOBODY), (NO_MAP, 0.0, 0.0, 0.1)
        assert safe_stop.braking_turn(1.0, 1.0, limits, safety, seen, np.zeros(3), known) == 0.0

    def test_who_gives_way_to_nobody_has_all_the_room_he_may_take(self) -> None:
        """Coming at 1.4 m/s while the robot stops from 1 m/s he takes 1 m; half of a mate's room is less."""
        ahead = np.array([[1.8, 0.0]])
        assert stops(1.0, 0.0, NOBODY, ahead)
        assert not stops(1.0, 0.0, NOBODY, ahead, ahead)
        assert stops(1.0, 0.0, NOBODY, 1.25 * ahead, 1.25 * ahead)


class TestTheBestArc:
    """What is not looked at, because another arc is better or nothing is near, is not what is best."""

    LIMITS = np.array([1.0, 2.0, 2.0, 2.0, 8.0, 0.2])
    SAFETY = np.array([REACTION, 0.3, 0.06, 0.1, 1.4])
    WINDOW = (0.9, 0.3, 0.5, 0.25, 6, 15, 0.0)

    @pytest.mark.parametrize("seed", range(40))
    def test_is_the_best_of_all_that_can_be_braked(self, seed: int) -> None:
        rng = np.random.default_rng(seed)
        pose = np.array([*rng.uniform(-1.0, 1.0, 2), rng.uniform(-3.0, 3.0)])
        v0, w0, lane_m = rng.uniform(0.0, 1.0), rng.uniform(-1.0, 1.0), 0.3 * (seed % 2)
        near, strange, people = (rng.normal(0.0, 1.2, (n, 2)) for n in rng.integers(0, 4, 3))
        near, strange = near[np.hypot(*near.T) > 0.4], strange[np.hypot(*strange.T) > 0.6]
        rows, columns = np.mgrid[:101, :101]
        x, y = 0.1 * columns - 5.0, 0.1 * rows - 5.0
        time, beyond = np.hypot(x - 3.0, y), np.hypot(x - 3.0, y - 2.0)
        known = np.hypot(x - pose[0], y - pose[1] - rng.uniform(0.5, 2.0)), -5.0, -5.0, 0.1
        there = (*(pose[:2] + rng.uniform(-0.8, 0.8, 2)).tolist(), 0.5)
        gate = ((beyond, -5.0, -5.0, 0.1), *there, 2.0) if seed % 4 else NO_GATE
        seen, field = (near, strange, people), (time, -5.0, -5.0, 0.1)
        told = v0, w0, pose, self.LIMITS, self.SAFETY, seen
        costs = {
            (v, w): self._cost(v, w, pose, near, field, gate, lane_m)
            for v in np.linspace(max(0.0, v0 - 0.4), min(1.0, v0 + 0.4), 6).tolist()
            for w in np.linspace(max(-2.0, w0 - 1.6), min(2.0, w0 + 1.6), 15).tolist()
            if safe_stop.stop_is_clear(v0, w0, v, w, *told[3:], pose, known)
        }
        v, w, status = voronoi_window.choose(*told, field, gate, known, lane_m, self.WINDOW)
        best = min(costs, key=lambda arc: costs[arc], default=(0.0, 0.0))
        if best[0] > 1e-3:
            assert status == voronoi_window.FREE
            assert (v, w) == pytest.approx(best)
        else:
            assert status == voronoi_window.HELD or v > 1e-3

    def _cost(
        self,
        v: float,
        w: float,
        pose: FloatArray,
        near: FloatArray,
        field: Field,
        gate: voronoi_window.Gate,
        lane_m: float,
    ) -> float:
        """Of one arc, without leaving anything out."""
        horizon_s, heading_cost, near_cost, soft_m, *_ = self.WINDOW
        cost = self._at(v, w, horizon_s, pose, field, heading_cost, lane_m)
        if gate[3] > 0.0:
            cost += gate[4]
            came = False
            for t in (0.25 * horizon_s * np.arange(1, 5)).tolist():
                x, y, _ = exact_arc(pose[0], pose[1], pose[2], v * t, w * t)
                came = came or math.hypot(x - gate[1], y - gate[2]) <= gate[3]
                if came:
                    left = self._at(v, w, t, pose, gate[0], heading_cost, lane_m)
                    cost = min(cost, left + t - horizon_s)
        x, y, _ = exact_arc(0.0, 0.0, 0.0, v * horizon_s, w * horizon_s)
        least = min(np.hypot(near[:, 0] - x, near[:, 1] - y).min(initial=np.inf), soft_m + 0.3)
        return cost + near_cost * float((soft_m + 0.3 - least) / soft_m) ** 2

    @staticmethod
    def _at(
        v: float,
        w: float,
        t: float,
        pose: FloatArray,
        field: Field,
        heading_cost: float,
        lane_m: float,
    ) -> float:
        x, y, theta = exact_arc(pose[0], pose[1], pose[2], v * t, w * t)
        x, y = x - lane_m * math.sin(theta), y + lane_m * math.cos(theta)
        dx, dy = eikonal.descent(x, y, field)
        return eikonal.value_at(x, y, field, 2.0) + heading_cost * abs(wrap(math.atan2(dy, dx) - theta))


class TestDrivingThrough:
    @pytest.mark.parametrize("bearing", [0.0, -0.8, 1.6])
    def test_who_knows_the_way_on_need_not_slow_down_at_a_place(self, bearing: float) -> None:
        """From 1.5 m before it to 1.5 m behind it in another direction."""
        assert self._driven_s(bearing, knows=True) < 0.95 * self._driven_s(bearing, knows=False)

    @staticmethod
    def _driven_s(bearing: float, *, knows: bool) -> float:
        limits, safety = np.array([1.0, 2.0, 2.0, 2.0, 8.0, 0.1]), np.array([REACTION, 0.3, 0.06, 0.1, 1.4])
        window, seen = (0.9, 0.3, 0.5, 0.25, 6, 15, 0.0), (NOBODY, NOBODY, NOBODY)
        rows, columns = np.mgrid[:101, :101]
        x, y = 0.1 * columns - 5.0, 0.1 * rows - 5.0
        end = 2.0 * np.array([math.cos(bearing), math.sin(bearing)])
        to_place, to_end = np.hypot(x, y), np.hypot(x - end[0], y - end[1])
        grid, known = (-5.0, -5.0, 0.1), (NO_MAP, 0.0, 0.0, 0.1)
        gate = ((to_end, *grid), 0.0, 0.0, 0.5, 2.0 + 0.3 * abs(bearing)) if knows else NO_GATE
        pose, v, w, came = np.array([-1.5, 0.0, 0.0]), 1.0, 0.0, False
        for k in range(200):
            came = came or math.hypot(*pose[:2]) <= 0.5
            if came and math.hypot(*(pose[:2] - end)) <= 0.5:
                return 0.1 * k
            field = (to_end if came else to_place, *grid)
            v, w, _ = voronoi_window.choose(
                v, w, pose, limits, safety, seen, field, NO_GATE if came else gate, known, 0.0, window
            )
            pose = pose + 0.1 * np.array(
                [v * math.cos(pose[2] + 0.05 * w), v * math.sin(pose[2] + 0.05 * w), w]
            )
        return math.inf
