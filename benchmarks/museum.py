"""What is compared: the museum's walls, planning queries, route and robot, and pilotage's side of each.

Everything that a peer is given comes from here, so that both sides meet the same walls, the same
clearance, the same scanner and the same route.
"""

from __future__ import annotations

import time
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from pilotage.core.random import RandomStreams
from pilotage.core.types import STOP, Command, FloatArray, Goal, Pose2
from pilotage.experiments.build.build import build
from pilotage.experiments.build.charts import load_chart
from pilotage.experiments.build.robots import footprint_of
from pilotage.experiments.mission import load_mission
from pilotage.kernels.geometry import plane
from pilotage.maps.distance_field import DistanceField
from pilotage.maps.occupancy_grid import OccupancyGrid
from pilotage.maps.rasterize import rasterized
from pilotage.maps.world_map import WorldMap
from pilotage.missions.mission import Mission
from pilotage.models.footprint import Footprint
from pilotage.models.motion.differential_drive import DifferentialDriveConfig
from pilotage.sensors.lidar import LidarConfig
from pilotage.sensors.readings import LidarScan
from pilotage.sim.source import RobotSpec, Simulator
from pilotage.sim.worlds.world import World
from pilotage.stack.interface import StackStatus
from pilotage.stack.planning.planner import PLANNERS, Planner, PlanRequest, PlanResult

CLEARANCE_M = 0.46
TURNING_RADIUS_M = 0.5
CONNECTION_M = 1.5
VALIDATION_M = 0.5
GOAL_TOLERANCE_M = 0.3
LATER_S = 1.0
"""Path lengths are compared after this time of planning."""

CHECK_STEP_M = 0.01
CHECK_SLACK_M = 0.01
"""A path counts as invalid below the clearance less this; it covers a lookup grid of a centimetre."""

ROUTE = "museum-route"
LIKE_THE_PEER = (
    *(f"robot.sensors.{name}=null" for name in ("beacons", "front", "left", "right")),
    "stack.mapper=null",
    "stack.localizer=dead-reckoning",
    "run.oracles=[localizer]",
)
"""The route with scanner and control alone, on the truth: what a step of IR-SIM does."""

CELL_M = 0.05
"""Of the museum as a grid map."""
POSE_SPACING_M = 1.0
MANY_ITERATIONS = 5_000_000


@dataclass(frozen=True, slots=True)
class Query:
    """One planning query; any heading will do at the goal."""

    name: str
    start: tuple[float, float, float]
    goal: tuple[float, float]


PATROLS = (
    Query("(1, 1) to (2, 27)", (1.0, 1.0, 0.0), (2.0, 27.0)),
    Query("(2, 37) to (37, 10)", (2.0, 37.0, 0.0), (37.0, 10.0)),
)
"""The night watch's two demonstrations: several doors and corridors on the way."""

CONTROLS = (
    Query("(2, 20) to (37, 20)", (2.0, 20.0, 0.0), (37.0, 20.0)),
    Query("(1, 1) to (2, 14)", (1.0, 1.0, 0.0), (2.0, 14.0)),
)
"""Within easy reach of every planner: straight across the open hall, and along one corridor."""


@dataclass(frozen=True, slots=True)
class Attempt:
    """How one planner fared on one query.

    Attributes
    ----------
    first_s, first_m
        Time until the first solution and its length; None where there was none in time.
    later_m
        Length of the best path after ``LATER_S``; None where there was none by then.
    clearance_m
        Least distance to a wall of every path that came out, checked each centimetre.
    """

    first_s: float | None
    first_m: float | None
    later_m: float | None
    clearance_m: tuple[float, ...]

    @property
    def invalid(self) -> int:
        """How many of its paths come too near to a wall."""
        return sum(value < CLEARANCE_M - CHECK_SLACK_M for value in self.clearance_m)


class Museum:
    """The floor and pilotage's planner, scanner and closed loop on it."""

    @cached_property
    def floor(self) -> WorldMap:
        """Walls and landmarks."""
        return load_chart("museum")

    @cached_property
    def grid(self) -> OccupancyGrid:
        """The same floor as cells, as a ROS map has it."""
        return rasterized(self.floor.walls, CELL_M)

    @cached_property
    def field(self) -> DistanceField:
        """What pilotage's planner is given, made before the clock starts."""
        return DistanceField.from_map(self.floor.walls)

    @cached_property
    def mission(self) -> Mission:
        """The programmed route with all sensors on."""
        return load_mission(ROUTE)

    @property
    def radius_m(self) -> float:
        """The robot's."""
        return footprint_of(self.mission.robot, "robot").radius_m

    @property
    def route_xy_m(self) -> list[tuple[float, float]]:
        """Corners of the programmed route."""
        planner = self.mission.stack.planner
        assert planner is not None
        return [(float(x), float(y)) for x, y in planner.parameters["points_m"]]

    @property
    def route_length_m(self) -> float:
        """Length of the polyline through the corners."""
        return float(np.hypot(*np.diff(np.array(self.route_xy_m), axis=0).T).sum())

    @cached_property
    def poses(self) -> list[Pose2]:
        """Poses about a metre apart along the route, for scans."""
        states = build(self.mission).team[0].journal.plans[0].states
        step = np.hypot(*np.diff(states[:, :2], axis=0).T)
        marks = np.searchsorted(np.cumsum(step), np.arange(0.0, step.sum(), POSE_SPACING_M))
        return [Pose2.from_array(state) for state in states[marks]]

    def clearance_along(self, points_xy_m: FloatArray) -> float:
        """Least exact distance of a polyline to a wall, checked every centimetre."""
        steps = np.hypot(*np.diff(points_xy_m, axis=0).T)
        s = np.concatenate([[0.0], np.cumsum(steps)])
        at = np.linspace(0.0, s[-1], int(np.ceil(s[-1] / CHECK_STEP_M)) + 1)
        points = np.column_stack([np.interp(at, s, points_xy_m[:, k]) for k in range(2)])
        walls = self.floor.walls
        return float(plane.least_distance(points, walls.segments_m, walls.circles_m))

    # Planning

    def plan_first(
        self, query: Query, seed: int, connection_m: float = CONNECTION_M, guided: bool = True
    ) -> Attempt:
        """Plan until the first solution; the time is that of the whole call, final check included.

        ``guided=False`` leaves out the rough way on the distance field that steers the samples: what
        remains is plain RRT*, like the peer's.
        """
        options = {} if guided else {"guide_bias": 0.0, "iterations": MANY_ITERATIONS}
        planner = self._planner(connection_m, stop="first", **options)
        begin = time.perf_counter()
        result = planner.plan(self._request(query, seed))
        took = time.perf_counter() - begin
        if result.path is None:
            return Attempt(None, None, None, ())
        return Attempt(took, result.path.length_m, None, (self._least_clearance(result),))

    def plan_on(self, query: Query, seed: int) -> Attempt:
        """Plan for ``LATER_S`` and give the length that is reached by then."""
        iterations = MANY_ITERATIONS // 10
        planner = self._planner(CONNECTION_M, stop="optimize", iterations=iterations, time_budget_s=LATER_S)
        result = planner.plan(self._request(query, seed))
        if result.path is None:
            return Attempt(None, None, None, ())
        clearances = (self._least_clearance(result),)
        return Attempt(result.first_solution_s, None, result.path.length_m, clearances)

    def _planner(self, connection_m: float, **options: object) -> Planner:
        name = "rrt-star-dubins"
        parameters: dict[str, object] = {
            "turning_radius_m": TURNING_RADIUS_M,
            "validation_distance_m": VALIDATION_M,
            "max_connection_distance_m": connection_m,
            "clearance_m": CLEARANCE_M,
        }
        return PLANNERS.entry(name).factory(PLANNERS.configure(name, parameters | options, name))

    def _request(self, query: Query, seed: int) -> PlanRequest:
        return PlanRequest(Pose2(*query.start), Goal(*query.goal), self.field, np.random.default_rng(seed))

    def _least_clearance(self, result: PlanResult) -> float:
        assert result.path is not None
        return self.clearance_along(result.path.states[:, :2])

    # Scans

    def scanner(self, range_var_m2: float | None = None, *, on_grid: bool = False) -> Simulator:
        """A robot with the missions' scanner alone, its noise changed where asked for."""
        floor = WorldMap("cells", self.floor.bounds_m, grid=self.grid) if on_grid else self.floor
        config = LidarConfig() if range_var_m2 is None else LidarConfig(range_var_m2=range_var_m2)
        robot = RobotSpec(
            "robot",
            Footprint.disc(self.radius_m),
            DifferentialDriveConfig(),
            {"lidar": config},
            self.poses[0],
            RandomStreams(0),
        )
        return Simulator(World.of(floor), [robot], self.mission.run.dt_s)

    def scans_per_s(self, scanner: Simulator, rounds: int = 15) -> float:
        """Scan at every pose, ``rounds`` times over; the step that a scan belongs to counts, too."""
        begin = time.perf_counter()
        for _ in range(rounds):
            for pose in self.poses:
                self._scan_at(scanner, pose)
        return rounds * len(self.poses) / (time.perf_counter() - begin)

    def exact_ranges(self, *, on_grid: bool = False) -> FloatArray:
        """(poses, beams) ranges without noise, to be held against the peer's."""
        scanner = self.scanner(range_var_m2=0.0, on_grid=on_grid)
        return np.array([self._scan_at(scanner, pose) for pose in self.poses])

    @staticmethod
    def _scan_at(scanner: Simulator, pose: Pose2) -> FloatArray:
        scanner.bodies[0].carry_to(pose)
        scan = scanner.step([STOP])[0].by_sensor["lidar"]
        assert isinstance(scan, LidarScan)
        return scan.ranges_m

    # Closed loop

    def loop_steps(self, seed: int, *, like_the_peer: bool = False) -> tuple[int, float]:
        """Drive the route once; return the steps and the seconds that the stepping took.

        Every step simulates the body, collisions, odometry, scanner, beacons and three ultrasonic cones,
        and runs the robot's stack: EKF, local planner, path follower, map of obstacles, guard.
        ``like_the_peer`` leaves scanner, odometry and control on the truth.
        """
        experiment = build(load_mission(ROUTE, LIKE_THE_PEER if like_the_peer else (), seed=seed))
        simulator, stack = experiment.simulator, experiment.team[0].stack
        command: Command = STOP
        steps = 0
        begin = time.perf_counter()
        while stack.status[0] is StackStatus.RUNNING:
            command = stack.step(simulator.step([command])[0])
            steps += 1
        took = time.perf_counter() - begin
        if stack.status[0] is not StackStatus.ARRIVED or simulator.bodies[0].collisions:
            raise RuntimeError(f"{ROUTE}, seed {seed}: expected an arrival, found {stack.status}")
        return steps, took
