"""What a plan makes of paths of planners that plan for the robot's outline, and of those that do not."""

import numpy as np
import pytest

from pilotage.core.random import RandomStreams
from pilotage.core.types import Goal, Pose2
from pilotage.maps.segment_map import SegmentMap
from pilotage.maps.world_map import WorldMap
from pilotage.models.motion.differential_drive import DifferentialDriveConfig
from pilotage.stack.journal import Journal
from pilotage.stack.knowledge import RobotKnowledge
from pilotage.stack.navigator.global_plan import GlobalPlan
from pilotage.stack.planning.planner import Path, PlanRequest, PlanResult, PlanStatus
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
