"""What components from outside keep, are built from and give is looked at where they do."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass, replace
from functools import partial
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from pilotage.core.checked import Gives, checked
from pilotage.core.config import validate
from pilotage.core.errors import InputError
from pilotage.core.types import Goal, Pose2, Twist
from pilotage.evaluation.finished import Verdict
from pilotage.evaluation.metric import Metric
from pilotage.evaluation.metrics.registry import Metrics
from pilotage.evaluation.tasks.task import TASKS
from pilotage.maps.distance_field import DistanceField
from pilotage.maps.segment_map import SegmentMap
from pilotage.models.motion.motion import MotionConfig
from pilotage.sensors.readings import GpsFix, LidarScan
from pilotage.sim.bodies.motion import SIMULATED_MOTIONS
from pilotage.sim.faults.fault import FAULTS
from pilotage.sim.people.people import PEOPLE
from pilotage.sim.sensing.sensor import SIMULATED_SENSORS
from pilotage.stack.control.controller import CONTROLLERS, Control
from pilotage.stack.control.escape import ESCAPES
from pilotage.stack.control.local.role import LOCAL_CONTROLLERS
from pilotage.stack.control.reactive import REACTIVES, Reaction, ReactionKind
from pilotage.stack.interface import NAVIGATORS, Belief, BeliefStatus, StackStatus
from pilotage.stack.localization.heading_filter import HEADING_FILTERS, HeadingEstimate
from pilotage.stack.localization.localizer import LOCALIZERS
from pilotage.stack.mapping.mapper import MAPPERS
from pilotage.stack.patrol.strategy import STRATEGIES
from pilotage.stack.planning.grid_path import GridPath
from pilotage.stack.planning.grid_planner import GRID_PLANNERS, GridRequest, GridResult
from pilotage.stack.planning.grid_space import GridSpace
from pilotage.stack.planning.local_planner import LOCAL_PLANNERS, LocalPath
from pilotage.stack.planning.plan_status import PlanStatus
from pilotage.stack.planning.planner import PLANNERS, SMOOTHERS, Path, PlanRequest, PlanResult

NAN = math.nan
ROUNDED = np.diag([0.1, 0.1, 0.0]) - 1e-14 * np.eye(3)
ROOM = [[0, 0, 6, 0], [6, 0, 6, 4], [6, 4, 0, 4], [0, 4, 0, 0], [3, 0, 3, 2.5]]
WALLS = SegmentMap.of(np.array(ROOM, dtype=np.float64), np.zeros((0, 3)))
ASKED = PlanRequest(
    Pose2(1.0, 1.0, 0.0), Goal(5.0, 1.0, None), DistanceField.from_map(WALLS), np.random.default_rng(0), 0.3
)
AROUND = Path.through([(1.0, 1.0), (2.0, 3.2), (4.0, 3.2), (5.0, 1.0)])
THROUGH = Path.through([(1.0, 1.0), (5.0, 1.0)])
SHORT = Path.through([(1.0, 1.0), (2.0, 3.2)])
SPARSE = Path(AROUND.waypoints, AROUND.waypoints, AROUND.length_m, 0.0)
NOWHERE = Path(np.full((9, 3), NAN), AROUND.waypoints, 1.0, 0.0)
WHOLE = Path(AROUND.states.astype(int), AROUND.waypoints, 1.0, 0.0)
EYE = np.eye(3)


def found(path: object) -> PlanResult:
    return PlanResult(PlanStatus.FOUND, "", path)  # type: ignore[arg-type]


def belief(x_m: Any = 0.0, cov: Any = EYE) -> Belief:
    return Belief(Pose2(x_m, 0.0, 0.0), cov)


def control(v_m_s: Any) -> Control:
    return Control(Twist(v_m_s, 0.0), 0.0, 0.0, 0.0)


def verdict(**metrics: object) -> Verdict:
    return Verdict(metrics, ({},), {})


@dataclass(frozen=True)
class OwnReading:
    depth_m: float


WALL = np.zeros((3, 5), dtype=np.bool_)
WALL[:2, 2] = True


def cells(*path: tuple[int, int]) -> GridResult:
    return GridResult(PlanStatus.FOUND, "", GridPath(np.array(path), 1.0, 1.0, 1), 0.1)


CORRELATED = np.array([[1.0, 2.0, 0.0], [2.0, 1.0, 0.0], [0.0, 0.0, 1.0]])
SKEW = np.array([[1.0, 0.5, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]])
KNOWN = SimpleNamespace(own_idleness_s=np.zeros(4))
GIVES: dict[str, tuple[Any, str]] = {
    "planner": (PLANNERS, "plan"),
    "smoother": (SMOOTHERS, "smooth"),
    "local planner": (LOCAL_PLANNERS, "plan"),
    "localizer": (LOCALIZERS, "step"),
    "heading": (HEADING_FILTERS, "step"),
    "controller": (CONTROLLERS, "step"),
    "local controller": (LOCAL_CONTROLLERS, "step"),
    "reactive": (REACTIVES, "step"),
    "escape": (ESCAPES, "step"),
    "navigator": (NAVIGATORS, "step"),
    "mapper": (MAPPERS, "step"),
    "strategy": (STRATEGIES, "next_vertex"),
    "task": (TASKS, "judge"),
    "sensor": (SIMULATED_SENSORS, "read"),
    "motion": (SIMULATED_MOTIONS, "command"),
    "words": (STRATEGIES, "words"),
    "row": (TASKS, "row"),
    "progress": (TASKS, "progress"),
    "grid planner": (GRID_PLANNERS, "search"),
    "people": (PEOPLE, "step"),
    "fault": (FAULTS, "pass_on"),
}
KEEPS: dict[str, dict[str, object]] = {
    "planner": {"clearance_m": 0.3},
    "localizer": {"belief": belief()},
    "heading": {"USES": frozenset(), "estimate": HeadingEstimate(0.0, 0.1)},
    "local controller": {"status": "driving"},
    "navigator": {"belief": belief(), "status": (StackStatus.RUNNING, "")},
    "mapper": {"circles_m": np.zeros((0, 3))},
    "people": {"radius_m": np.full(1, 0.3)},
    "task": {"columns": {"a_m": "m"}, "events": [], "goals": (), "drives": True},
    "motion": {"moves": np.zeros((1, 3)), "spins_on": False, "release_m": 1e-6},
}
"""What a component of a role keeps from when it is built."""
CALLED_WITH: dict[str, tuple[object, ...]] = {
    "planner": (ASKED,),
    "smoother": (AROUND, ASKED, 0.3),
    "strategy": (KNOWN,),
    "motion": (Twist(0.1, 0.0),),
    "task": (SimpleNamespace(robots=[SimpleNamespace(trace={"t_s": np.zeros(3)})]),),
    "fault": (1.0, (GpsFix(1.0, 2.0),)),
    "grid planner": (GridRequest(GridSpace(WALL), (0, 0), (0, 4)),),
}


def made(role: str, gives: object, **members: object) -> Any:
    """A stranger's component of a role whose method gives this."""
    registry, method = GIVES[role]
    roles = registry.gives
    methods: dict[str, object] = {
        each.method: lambda *_: gives for each in roles if each.method != "__init__" and not each.optional
    }
    keeps = KEEPS.get(registry.role, {})
    cls = type("Mine", (), {"__module__": "somebodys", **methods, **keeps, **members})
    return getattr(checked(cls, f"{role} 'mine'", *roles)(), method)


@pytest.mark.parametrize(
    ("role", "gives"),
    [
        ("planner", found(AROUND)),
        ("planner", PlanResult(PlanStatus.NO_PATH, "", None)),
        ("smoother", AROUND),
        ("local planner", None),
        ("local planner", LocalPath(AROUND.states, 0.3)),
        ("localizer", belief()),
        ("localizer", Belief.anywhere((0.0, 0.0, 9.0, 9.0))),
        ("localizer", belief(np.float32(1.0), np.zeros((3, 3)))),
        ("localizer", belief(cov=ROUNDED)),
        ("heading", HeadingEstimate(0.1, 0.0)),
        ("controller", control(1)),
        ("local controller", Twist(0.1, 0.2)),
        ("reactive", Reaction(ReactionKind.NONE, 0.0, math.inf, math.inf)),
        ("escape", None),
        ("strategy", np.int64(3)),
        ("task", verdict(success=np.bool_(True), reason="there")),
        ("sensor", None),
        ("sensor", GpsFix(1.0, 2.0)),
        ("sensor", OwnReading(1.0)),
        ("grid planner", cells((0, 0), (2, 0), (2, 4), (0, 4))),
        ("grid planner", GridResult(PlanStatus.NO_PATH, "", None, 0.1)),
        ("mapper", False),
        ("words", np.zeros(0)),
        ("row", (NAN,)),
        ("progress", (("gone", "3 m"),)),
        ("task", verdict(success=True, reason="", gap_m=NAN, robots={"a": [1, None, np.int64(3)]})),
        ("people", np.full((1, 2), NAN)),
        ("fault", []),
        ("fault", (GpsFix(3.0, 4.0),)),
    ],
)
def test_what_is_right_comes_through(role: str, gives: object) -> None:
    assert made(role, gives)(*CALLED_WITH.get(role, ())) is gives


@pytest.mark.parametrize(
    ("role", "gives", "told"),
    [
        ("planner", "found", "found str 'found'"),
        ("planner", None, "found none"),
        ("planner", found(None), "found none that is found"),
        ("planner", PlanResult("found", "", AROUND), "PlanResult with status str 'found'"),  # type: ignore[arg-type]
        ("planner", found(NOWHERE), "Path with states nan in an array (9, 3)"),
        ("planner", found(WHOLE), "Path with states an array of int64"),
        ("planner", found(SPARSE), "states 2.42 m apart (at most 0.05 m"),
        ("planner", found(SHORT), "a path whose goal is 3.72 m away from where it was asked for"),
        ("planner", found(THROUGH), "a path through what stands at (3.0"),
        ("smoother", THROUGH, "a path through what stands at (3.0"),
        ("local planner", LocalPath(np.zeros(3), 0.3), "an array (3,) instead of (N, 3)"),
        ("localizer", belief(NAN), "Belief with pose Pose2 with x_m nan"),
        ("localizer", belief("1"), "Pose2 with x_m str '1'"),
        ("localizer", belief(cov=np.eye(2)), "a covariance (2, 2)"),
        ("localizer", belief(cov=EYE * NAN), "cov nan in an array (3, 3)"),
        ("localizer", belief(cov=CORRELATED), "a covariance with an eigenvalue of -1"),
        ("localizer", belief(cov=SKEW), "a covariance that is not symmetric"),
        ("localizer", Belief(Pose2(0.0, 0.0, 0.0), EYE, "lost"), "Belief with status str 'lost'"),  # type: ignore[arg-type]
        ("heading", HeadingEstimate(NAN, 0.0), "HeadingEstimate with heading_rad nan"),
        ("controller", Twist(0.1, 0.0), "found Twist(v_m_s="),
        ("controller", control(math.inf), "twist Twist with v_m_s inf"),
        ("local controller", None, "found none"),
        ("local controller", Twist(NAN, 0.0), "Twist with v_m_s nan"),
        ("reactive", Reaction(ReactionKind.AVOID, NAN, 1.0, 1.0), "Reaction with w_rad_s nan"),
        ("escape", (0.1, 0.0), "found tuple (0.1, 0.0)"),
        ("strategy", 4, "found 4"),
        ("strategy", 1.0, "found float 1.0"),
        ("task", verdict(success="yes", reason=""), "found success str 'yes'"),
        ("task", verdict(reason=""), "found success none"),
        ("task", verdict(success=True), "found reason none"),
        ("sensor", "hello", "found str 'hello'"),
        ("sensor", GpsFix(NAN, 0.0), "GpsFix with x_m nan"),
        ("sensor", LidarScan([1.0]), "LidarScan with ranges_m list [1.0]"),  # type: ignore[arg-type]
        ("sensor", OwnReading(NAN), "OwnReading with depth_m nan"),
        (
            "sensor",
            OwnReading(math.inf),
            "(the reach where nothing is hit), or None, found OwnReading with depth_m inf",
        ),
        ("planner", found(replace(AROUND, length_m=-1.0)), "found length_m -1.0"),
        ("planner", found(replace(AROUND, length_m=10**400)), "Path with length_m int 1000"),
        ("planner", found(replace(AROUND, length_m=1e300)), "Path with length_m 1e+300"),
        (
            "planner",
            found(replace(AROUND, waypoints=AROUND.waypoints + 1.0)),
            "a path's waypoints whose start",
        ),
        ("planner", replace(found(AROUND), reason=3), "PlanResult with reason int 3"),  # type: ignore[arg-type]
        ("planner", replace(found(AROUND), first="x"), "PlanResult with first str 'x'"),  # type: ignore[arg-type]
        ("planner", replace(found(AROUND), first=NOWHERE), "PlanResult with first Path with states nan"),
        ("planner", replace(found(AROUND), tree_edges_m=np.zeros((3, 2))), "tree_edges_m an array (3, 2)"),
        ("local planner", LocalPath(AROUND.states[:1], 0.3), "found an array (1, 3)"),
        ("local planner", LocalPath(AROUND.states, -0.3), "LocalPath with speed_m_s -0.3"),
        ("localizer", belief(1e300), "Pose2 with x_m 1e+300"),
        ("heading", HeadingEstimate(0.0, -0.1), "HeadingEstimate with variance_rad2 -0.1"),
        ("reactive", Reaction("avoid", 0.0, 1.0, 1.0), "Reaction with kind str 'avoid'"),  # type: ignore[arg-type]
        ("reactive", Reaction(ReactionKind.AVOID, 0.0, NAN, 1.0), "Reaction with speed_limit_m_s nan"),
        ("reactive", Reaction(ReactionKind.AVOID, 0.0, -1.0, 1.0), "Reaction with speed_limit_m_s -1.0"),
        ("mapper", None, "found none"),
        ("words", None, "found none"),
        ("words", np.zeros((2, 2)), "an array (2, 2) instead of (N,)"),
        ("row", (), "found tuple ()"),
        ("row", ("x",), "found str 'x'"),
        ("progress", (("gone", 3.0),), "found tuple (('gone', 3.0),)"),
        ("task", Verdict({"success": True, "reason": ""}, (), {}), "found columns tuple () of 1 robots"),
        ("task", verdict(success=True, reason="", mine=object()), "found mine object <object"),
        ("task", verdict(success=True, reason="", mine={"a": 10**400}), "found mine a int 1000"),
        ("people", [[1.0, 2.0]], "found list [[1.0, 2.0]]"),
        ("people", np.zeros((2, 2)), "an array (2, 2) of 1 people"),
        ("people", np.full((1, 2), math.inf), "inf in an array (1, 2)"),
        ("grid planner", None, "found none"),
        ("grid planner", GridResult(PlanStatus.FOUND, "", None, 0.1), "found none that is found"),
        (
            "grid planner",
            cells((0, 0), (2, 0)),
            "a path whose goal is the cell (2, 0) where (0, 4) was asked for",
        ),
        ("grid planner", cells((0, 0), (0, 2), (0, 4)), "a path over the cell (0, 2), which is not free"),
        ("grid planner", cells((0, 0), (0, 4)), "a path from the cell (0, 0) to (0, 4) through what is not"),
        ("fault", None, "found none"),
        ("fault", (GpsFix(NAN, 0.0),), "GpsFix with x_m nan"),
        ("fault", (1.0,), "found float 1.0"),
        ("fault", (LidarScan(np.zeros(3)),), "found LidarScan("),
    ],
)
def test_what_is_not_is_refused_by_name(role: str, gives: object, told: str) -> None:
    """It drove about until the time limit, ended deep in our own code, or went unseen."""
    _, method = GIVES[role]
    with pytest.raises(InputError) as refused:
        made(role, gives)(*CALLED_WITH.get(role, ()))
    assert str(refused.value).startswith(f"{role} 'mine' of 'somebodys': {method}: expected ")
    assert told in str(refused.value)


@pytest.mark.parametrize(
    ("role", "name", "value", "told"),
    [
        ("planner", "clearance_m", None, "clearance_m none"),
        ("planner", "clearance_m", -1.0, "clearance_m -1.0"),
        ("localizer", "belief", None, "belief none"),
        (
            "navigator",
            "belief",
            Belief(Pose2(NAN, 0.0, 0.0), EYE),
            "belief Belief with pose Pose2 with x_m nan",
        ),
        ("navigator", "belief", belief(cov=CORRELATED), "belief a covariance with an eigenvalue of -1"),
        ("navigator", "status", "arrived", "status str 'arrived'"),
        ("navigator", "status", ("arrived", ""), "status tuple ('arrived', '')"),
        ("mapper", "circles_m", np.zeros((2, 2)), "circles_m an array (2, 2) instead of (N, 3)"),
        ("mapper", "circles_m", np.full((1, 3), -1.0), "circles_m a radius of -1.0"),
        ("heading", "USES", ["gyroscope"], "USES list ['gyroscope']"),
        ("heading", "USES", frozenset({"nose"}), "USES frozenset({'nose'})"),
        ("heading", "estimate", None, "estimate none"),
        ("people", "radius_m", 0.3, "radius_m float 0.3"),
        ("people", "radius_m", np.zeros(1), "radius_m [0.]"),
        ("motion", "moves", np.zeros((0, 3)), "moves an array (0, 3)"),
        ("motion", "moves", np.full((1, 3), NAN), "moves nan in an array (1, 3)"),
        ("motion", "spins_on", None, "spins_on none"),
        ("motion", "release_m", "x", "release_m str 'x'"),
        ("task", "columns", {1: "m"}, "columns with int 1: str 'm'"),
        ("task", "events", (), "events tuple ()"),
        ("task", "goals", (1,), "goals tuple (1,)"),
        ("task", "drives", None, "drives none"),
    ],
)
def test_what_a_component_keeps_is_looked_at_when_it_is_built(
    role: str, name: str, value: object, told: str
) -> None:
    """It came to light far away, in lines of our own, or never."""
    with pytest.raises(InputError, match=re.escape(f"found {told}")) as refused:
        made(role, None, **{name: value})
    assert str(refused.value).startswith(f"{role} 'mine' of 'somebodys': expected ")


def test_what_a_component_keeps_is_looked_at_with_what_it_gives() -> None:
    for role, gives, name, value in (
        ("navigator", Twist(0.1, 0.0), "belief", Belief(Pose2(NAN, 0.0, 0.0), EYE, BeliefStatus.LOST)),
        ("navigator", Twist(0.1, 0.0), "status", "arrived"),
        ("localizer", belief(), "belief", None),
        ("local controller", Twist(0.1, 0.0), "status", 3),
        ("mapper", False, "circles_m", np.zeros((2, 2))),
        ("people", np.zeros((1, 2)), "radius_m", np.zeros(1)),
        ("motion", None, "moves", np.full((1, 3), NAN)),
    ):
        method = made(role, gives)
        setattr(method.__self__, name, value)
        with pytest.raises(InputError, match=f"{role} 'mine' of 'somebodys': .*: expected"):
            method(*CALLED_WITH.get(role, ()))


@pytest.mark.parametrize(("method", "called_with"), [("command", (Twist(0.1, 0.0),)), ("stop", ())])
def test_a_motion_makes_as_many_moves_as_at_first(method: str, called_with: tuple[object, ...]) -> None:
    """The body's arrays are as long; nothing is left on the motion to remember it by."""

    def another(motion: Any, *_: object) -> None:
        motion.moves = np.zeros((2, 3))

    motion = made("motion", None, **{method: another}).__self__
    assert not hasattr(motion, "moves_a_step")
    with pytest.raises(InputError, match=f"'mine' of 'somebodys': {method}: .*, found 2 moves instead of 1"):
        getattr(motion, method)(*called_with)


@pytest.mark.parametrize(
    ("name", "value", "told"),
    [
        ("top_speed_m_s", None, "expected top_speed_m_s above 0, found none"),
        ("top_speed_m_s", math.inf, "expected top_speed_m_s above 0, found inf"),
        ("top_turn_rate_rad_s", 0.0, "expected top_turn_rate_rad_s above 0, found 0.0"),
        ("braking_m_s2", NAN, "expected braking_m_s2 above 0, found nan"),
        ("least_turning_radius_m", -1.0, "expected least_turning_radius_m from 0 to 1e+30, found -1.0"),
        ("curvature_rate_per_m_s", 10**400, "expected curvature_rate_per_m_s above 0, found int 1000"),
    ],
)
def test_a_data_sheet_without_limits_is_refused(name: str, value: object, told: str) -> None:
    """It drove by what is no number, or ended in a division by zero of ours."""
    limits = {"top_speed_m_s": 1.0, "top_turn_rate_rad_s": 1.0, name: value}
    members = {key: property(partial(lambda limit, _: limit, limit)) for key, limit in limits.items()}
    sheet = type("Sheet", (MotionConfig,), {"__module__": "somebodys", **members})
    with pytest.raises(InputError, match=re.escape(f"robot.motion: {told}")):
        validate(sheet, {}, "robot.motion")


class TakesOne:
    def __init__(self, config: object) -> None:
        """Nothing."""


class TakesWords:
    def __init__(self, *, config: object) -> None:
        """Nothing."""


class TakesNothing:
    """It has no constructor."""


@pytest.mark.parametrize(("base", "found"), [(TakesOne, "(self, config)"), (TakesWords, "(self, *, config)")])
def test_one_that_cannot_be_built_as_its_role_says_is_refused(base: type, found: str) -> None:
    """It was a TypeError of ours."""
    members = {"__module__": "somebodys", "step": lambda *_: None, "reset": lambda *_: None}
    cls = checked(type("Mine", (base,), members), "controller 'mine'", *CONTROLLERS.gives)
    told = f"^controller 'mine' of 'somebodys': expected to be built from 2 arguments .*{re.escape(found)}"
    with pytest.raises(InputError, match=told):
        cls(1, 2)


def test_a_planner_is_looked_at_over_cells_as_well() -> None:
    """Navigator curve drove a path that began elsewhere."""
    planner = made("planner", None, search=lambda *_: cells((1, 1), (0, 4))).__self__
    with pytest.raises(InputError, match=r"planner 'mine' .*: search: expected .* whose start is the cell"):
        planner.search(*CALLED_WITH["grid planner"])
    assert not hasattr(made("planner", None).__self__, "search")


def test_one_without_a_constructor_is_built_from_nothing() -> None:
    members = {"__module__": "somebodys", "step": lambda *_: None, "reset": lambda *_: None}
    cls = checked(type("Mine", (TakesNothing,), members), "controller 'mine'", *CONTROLLERS.gives)
    assert cls()
    with pytest.raises(InputError, match="expected to be built from 2 arguments"):
        cls(1, 2)


def test_a_navigator_that_says_how_far_it_is_drives() -> None:
    assert made("navigator", Twist(0.1, 0.0))() == Twist(0.1, 0.0)


def test_one_without_its_roles_method_is_refused_as_it_registers() -> None:
    cls = type("Mine", (), {"__module__": "somebodys"})
    with pytest.raises(InputError, match="expected a class with a method 'plan', found none"):
        checked(cls, "planner 'mine'", *PLANNERS.gives)


@pytest.mark.parametrize(
    ("registry", "method"), [(CONTROLLERS, "reset"), (REACTIVES, "reset"), (ESCAPES, "begin")]
)
def test_one_without_a_method_that_gives_nothing_is_refused_as_well(registry: Any, method: str) -> None:
    """It drove until the method was called, if it ever was."""
    cls = type("Mine", (), {"__module__": "somebodys", "step": lambda *_: None})
    with pytest.raises(InputError, match=f"expected a class with a method '{method}', found none"):
        checked(cls, "mine", *registry.gives)


@pytest.mark.parametrize("role", GIVES)
def test_a_method_that_does_not_take_what_its_role_calls_it_with_is_refused(role: str) -> None:
    """It was a TypeError of ours, that named every plugin."""
    _, name = GIVES[role]
    method = made(role, None, **{name: lambda _0, _1, _2, _3, _4, _5, _6: None})
    with pytest.raises(InputError, match=rf"'mine' of 'somebodys': {name}: expected to take \d argument"):
        method(*CALLED_WITH.get(role, ()))


def test_a_type_error_of_a_components_own_stays_its_own() -> None:
    with pytest.raises(TypeError, match="unsupported operand"):
        made("planner", None, plan=lambda *_: 1 + None)(ASKED)  # type: ignore[operator]
    metrics = Metrics([], {})
    metrics.computed_by(Metric("mine_m", "mine", "m", ""))(lambda *_: 1 + None)  # type: ignore[operator]
    with pytest.raises(TypeError, match="unsupported operand"):
        metrics.computed("reach", {}, {})


def test_a_metric_that_does_not_take_a_run_is_refused() -> None:
    metrics = Metrics([], {})
    metrics.computed_by(Metric("mine_m", "mine", "m", ""))(lambda _: 1.0)  # type: ignore[arg-type, misc]
    with pytest.raises(InputError, match=r"metric 'mine_m' of .*: expected to take 2 arguments as its role"):
        metrics.computed("reach", {}, {})


def test_our_own_are_left_as_they_are() -> None:
    cls = type("Ours", (), {"__module__": "pilotage.stack.planning.ours"})
    assert checked(cls, "planner 'ours'", Gives("plan", "", lambda *_: "wrong")) is cls


@pytest.mark.parametrize("value", [NAN, math.inf, "5", np.arange(3.0)])
def test_a_metric_that_gives_no_number_is_refused(value: Any) -> None:
    metrics = Metrics([], {})
    metrics.computed_by(Metric("mine_m", "mine", "m", ""))(lambda *_: value)
    with pytest.raises(InputError, match=r"metric 'mine_m' of .*: expected a finite number, or None"):
        metrics.computed("reach", {}, {})


def test_metrics_look_at_a_run_and_leave_it_alone() -> None:
    column, known = np.zeros(3), {"success": True}
    for change in (lambda *given: given[0]["x_m"].fill(1.0), lambda *given: given[1].update(success=False)):
        metrics = Metrics([], {})
        metrics.computed_by(Metric("mine_m", "mine", "m", ""))(change)
        with pytest.raises((ValueError, AttributeError)):
            metrics.computed("reach", {"x_m": column}, known)
    assert (column == 0.0).all()
    assert known == {"success": True}


@pytest.mark.parametrize("most", [[1e9, 0.0, 0.0], [0.0, 0.0, -1e5]])
def test_a_motion_moves_no_farther_than_any_robot(most: list[float]) -> None:
    """To look for contacts along a thousand million metres a step took minutes."""

    def far(motion: Any, *_: object) -> None:
        motion.moves = np.array([most])

    told = r"expected moves .* up to 10,000 .*, found a move of 1(e\+09|00000) m or rad"
    with pytest.raises(InputError, match=told):
        made("motion", None, command=far)(Twist(0.1, 0.0))


# Installed packages
