"""The tasks of following a route and of knowing where one is, judged on runs that fail them, too."""

from __future__ import annotations

import math
from typing import Any, cast

import numpy as np
import pytest

from pilotage.core.errors import InputError
from pilotage.evaluation.tasks.follow import _cross_track_m
from pilotage.evaluation.visits import visited_in_order
from pilotage.experiments.build.build import build
from pilotage.experiments.mission import mission_of
from pilotage.experiments.run import run_mission
from support.missions import follow, localize


def metrics_of(values: dict[str, Any]) -> dict[str, Any]:
    return cast(dict[str, Any], run_mission(mission_of(values), save=False).metrics)


def route(points: list[list[float]], **task: Any) -> dict[str, Any]:
    return {**follow(), "task": {"name": "follow", "points_m": points, **task}}


def test_a_route_is_followed_point_by_point() -> None:
    found = metrics_of(route([[4.0, 4.0], [7.0, 4.0], [8.0, 6.0]]))
    assert found["success"], found["reason"]
    assert found["route_points_passed"] == 3
    assert 0.0 < found["route_error_rmse_m"] <= found["route_error_max_m"] < 0.6


def test_a_robot_that_believes_it_passed_and_did_not_has_failed() -> None:
    """A start off by 0.4 m that dead reckoning never notices; the tolerance is the truth's."""
    values = route([[4.0, 4.0], [7.0, 4.0]], tolerance_m=0.2)
    values["stack"]["localizer"] = "dead-reckoning"
    values["stack"]["initial"] = {"x_var_m2": 0.0, "y_var_m2": 0.0, "theta_var_rad2": 0.09}
    failed = [metrics_of({**values, "run": {"time_limit_s": 60.0, "seed": seed}}) for seed in range(4)]
    missed = [found for found in failed if found["route_points_passed"] < 2]
    assert missed
    assert all(not found["success"] for found in missed)
    assert any("came not within 0.2 m of" in found["reason"] or found["collisions"] for found in missed)


@pytest.mark.parametrize(
    ("values", "told"),
    [
        (route([[40.0, 4.0]]), "expected points on the map 'room', found \\(40, 4\\)"),
        (route([]), "points_m"),
        (
            {**route([[4.0, 4.0]]), "world": {**follow()["world"], "goal": {"x_m": 8.0, "y_m": 6.0}}},
            "the route's last point is the goal",
        ),
    ],
)
def test_routes_that_cannot_be_are_refused(values: dict[str, Any], told: str) -> None:
    with pytest.raises(InputError, match=told):
        build(mission_of(values))


def test_points_count_in_their_order_only() -> None:
    there_and_back = np.column_stack([np.r_[0:5:0.1, 5:0:-0.1], np.zeros(100)])
    assert len(visited_in_order(there_and_back, np.array([[4.0, 0.0], [1.0, 0.0]]), [0.1, 0.1])) == 2
    assert len(visited_in_order(there_and_back[:50], np.array([[4.0, 0.0], [1.0, 0.0]]), [0.1, 0.1])) == 1


def test_the_distance_from_a_route_is_that_from_its_nearest_piece() -> None:
    corners = np.array([[0.0, 0.0], [4.0, 0.0], [4.0, 3.0]])
    points = np.array([[-3.0, 4.0], [2.0, 0.5], [4.2, 2.0], [4.0, 4.0]])
    np.testing.assert_allclose(_cross_track_m(points, corners), [5.0, 0.5, 0.2, 1.0])


def test_who_knows_where_it_is_has_succeeded() -> None:
    found = metrics_of(localize())
    assert found["success"], found["reason"]
    assert found["localized_after_s"] == 0.0


def test_who_does_not_know_has_failed_whatever_it_drove() -> None:
    """A wrong start that dead reckoning never corrects: driven well, and not known."""
    values = localize()
    values["stack"]["localizer"] = "dead-reckoning"
    values["stack"]["initial"] = {"x_var_m2": 4.0, "y_var_m2": 4.0, "theta_var_rad2": 1e-4}
    assert metrics_of({**values, "task": "drive"})["success"]
    found = metrics_of(values)
    assert not found["success"]
    assert found["reason"] == "the robot does not know where it is at the end"
    assert "localized_after_s" not in found
    wide = {**values, "task": {"name": "localize", "tolerance_m": 50.0, "tolerance_rad": math.pi}}
    assert metrics_of(wide)["success"]
