"""What a plan makes of paths of planners that plan for the robot's outline, and of those that do not."""

from typing import Any

import numpy as np
import pytest

import pilotage as pl
from pilotage.cli.plan import parse_outline
from pilotage.core.random import RandomStreams
from pilotage.core.types import Goal, Pose2
from pilotage.maps.segment_map import SegmentMap
from pilotage.maps.world_map import WorldMap
from pilotage.models.motion.differential_drive import DifferentialDriveConfig
from pilotage.stack.journal import Journal
from pilotage.stack.knowledge import RobotKnowledge
from pilotage.stack.navigator.global_plan import GlobalPlan
from pilotage.stack.planning.plan_status import PlanStatus
from pilotage.stack.planning.planner import Path, PlanRequest, PlanResult
from support.yards import CAR, TURNING_M


class Straight:
    """Along the line between start and goal."""

    clearance_m = 0.06

    def plan(self, request: PlanRequest) -> PlanResult:  # noqa: ARG002
        """Answer one query."""
        path = Path.through([(1.0, 0.0), (4.0, 0.0)])
        return PlanResult(PlanStatus.FOUND, "straight on", Path(path.states, path.waypoints, 3.0, TURNING_M))


class StraightForOutline(Straight):
    """The same, and says that its clearance is kept beside the outline."""

    FOR_OUTLINE = True


@pytest.mark.parametrize(
    ("planner", "beside_m", "drives"),
    [(StraightForOutline, 0.04, True), (StraightForOutline, -0.01, False), (Straight, 0.04, False)],
)
def test_an_outline_s_planner_is_believed_but_for_contact(
    planner: type[Straight], beside_m: float, drives: bool
) -> None:
    """Its looks are 4 cm apart: a path that it calls 6 cm clear may come 2 cm nearer in between."""
    y = 0.3 + beside_m
    walls = SegmentMap.of(np.array([[-1.0, y, 6.0, y], [-1.0, -y, 6.0, -y]]), np.zeros((0, 3)))
    walls = SegmentMap(walls.segments_m, walls.circles_m, (-1.0, -1.0, 6.0, 1.0))
    robot = RobotKnowledge(CAR, DifferentialDriveConfig(), {}, 0.1, RandomStreams(0))
    chart = WorldMap("lane", walls.bounds_m, walls)
    rng, journal = np.random.default_rng(0), Journal()
    plan = GlobalPlan(planner(), None, chart, rng, journal, robot=robot, as_planned=True)
    nothing = np.zeros((0, 3))
    result = plan.make(0.0, Pose2(1.0, 0.0, 0.0), Goal(4.0, 0.0), nothing, [plan.clearance_m])
    assert (result.path is not None) == drives, result.reason


LANE: dict[str, Any] = {
    "map": "lane",
    "walls_m": [[0, 0, 8, 0], [8, 0, 8, 0.9], [8, 0.9, 0, 0.9], [0, 0.9, 0, 0]],
}
WIDE = [[0.7, 0.42], [-0.3, 0.25], [-0.3, -0.25], [0.7, -0.42]]
LONG = [[0.7, 0.25], [-0.3, 0.25], [-0.3, -0.25], [0.7, -0.25]]


@pytest.mark.parametrize(
    ("planner", "footprint", "reason"),
    [
        ("rrt-star-dubins", {"points_m": LONG}, ""),
        ("hybrid-astar", {"points_m": LONG}, ""),
        ("theta-star", {"points_m": WIDE}, "does not fit"),
        ("theta-star", {"radius_m": 0.4}, ""),
    ],
)
def test_the_task_of_planning_plans_for_the_outline(
    planner: str, footprint: dict[str, Any], reason: str
) -> None:
    """In a lane 0.9 m wide it planned for a point that keeps 0.46 m, or drove 0.2 m from walls."""
    run = pl.run(
        pl.load(
            {
                "extends": "museum-plan",
                "mission": "a-lane",
                "world": {"map": LANE, "start": {"x_m": 1, "y_m": 0.45}, "goal": {"x_m": 7, "y_m": 0.45}},
                "robot": {"footprint": footprint},
                "stack": {"planner": {"name": planner, "clearance_m": 0.15}},
            }
        )
    )
    assert run.success == (not reason), run.reason
    if reason:
        assert reason in run.reason
        return
    assert run.metrics["planned_clearance_m"] > 0.04
    assert run.metrics["shortest_length_m"] <= run.metrics["planned_length_m"] + 1e-6


def test_a_query_is_answered_for_an_outline() -> None:
    """It knew no outlines: planners for them planned for a point."""
    van = [[0.9, 0.3], [-0.2, 0.3], [-0.2, -0.3], [0.9, -0.3]]
    ends = (1.2, 2.4, 0.0), (7.5, 7.62, -0.5 * np.pi)
    for planner in ("hybrid-astar", "rrt-star-reeds-shepp"):
        point, body = (pl.plan("car-park", *ends, planner=planner, footprint=f) for f in (None, van))
        assert point.success
        assert body.success, body.reason
        assert point.shortest_length_m < body.shortest_length_m < body.length_m
    nose_first = pl.plan("car-park", *ends, planner="rrt-star-dubins", footprint=van, clearance_m=0.06)
    assert "forwards only" in nose_first.reason
    wide = pl.plan("museum", (1, 1, 0), (20, 12), planner="theta-star", clearance_m=0.1, footprint=0.4)
    assert wide.answer["clearance_m"] == 0.4
    for bad in (0.0, -1.0, "van", [[1, 0], [2, 0], [2, 2]], [[1, 0, 0]], [[1, 0], [1, 1]]):
        with pytest.raises(pl.InputError, match=r"^footprint: "):
            pl.plan("museum", (1, 1, 0), (20, 12), footprint=bad)


def test_a_path_for_an_outline_is_smoothed_as_all_are() -> None:
    ends = (1.0, 1.0, 0.0), (20.0, 12.0, 0.0)
    van = [[0.8, 0.3], [-0.2, 0.3], [-0.2, -0.3], [0.8, -0.3]]
    own, smooth = (
        pl.plan("museum", *ends, planner="hybrid-astar", footprint=van, set=settings)
        for settings in ({"smoother": "none"}, {})
    )
    assert smooth.length_m < 0.97 * own.length_m


def test_outlines_are_typed_on_the_command_line() -> None:
    assert parse_outline("0.3") == 0.3
    assert parse_outline(" 1,0.2  -1,0.2 0,-1 ") == [(1.0, 0.2), (-1.0, 0.2), (0.0, -1.0)]
    for text in ("", "a", "1,2,3 4,5,6", "0.3 0.4"):
        with pytest.raises(pl.InputError, match="--footprint"):
            parse_outline(text)
