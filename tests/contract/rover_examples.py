"""Examples of what a rover on open ground runs: its localizers, the polar law, the curve over cells."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from pilotage.core.random import RandomStreams
from pilotage.core.types import Goal, Pose2, Twist
from pilotage.maps.landmarks import Landmarks
from pilotage.maps.occupancy_grid import OccupancyGrid
from pilotage.maps.world_map import WorldMap
from pilotage.models.footprint import Footprint
from pilotage.models.motion.bicycle import BicycleConfig
from pilotage.models.motion.motion import MotionConfig
from pilotage.sensors.beacon import BeaconConfig
from pilotage.sensors.compass import CompassConfig
from pilotage.sensors.gps import GpsConfig
from pilotage.sensors.readings import BeaconReadings, OdometryIncrement, Readings
from pilotage.sensors.wheel_odometry import WheelOdometryConfig
from pilotage.sim.source import RobotSpec, Simulator
from pilotage.sim.worlds.world import World
from pilotage.stack.control.kanayama import KanayamaConfig, KanayamaController
from pilotage.stack.interface import Belief, Stack, StackStatus
from pilotage.stack.journal import Journal
from pilotage.stack.knowledge import RobotKnowledge, TaskKnowledge
from pilotage.stack.navigator.navigator import Parts
from pilotage.stack.planning.grid_planners import AstarPlanner, GridSearchConfig
from support.worlds import simulator

LANDMARKS = Landmarks(np.array([7, 3]), np.array([[60.0, 40.0], [20.0, -50.0]]))
OPEN = WorldMap("open", (-200.0, -200.0, 200.0, 200.0), landmarks=LANDMARKS)
ODOMETER = WheelOdometryConfig(
    rate_hz=1.0, distance_var_m2_per_m=4e-5, angle_var_rad2_per_rad=0.0, angle_var_rad2_per_m=1.9e-6
)
SEER = BeaconConfig(
    rate_hz=1.0,
    field_of_view_rad=2.0 * math.pi,
    max_range_m=100.0,
    range_var_m2=0.01,
    bearing_var_rad2=1.9e-5,
)
SENSORS = {
    "odometer": ODOMETER,
    "lidar": SEER,
    "gps": GpsConfig(),
    "compass": CompassConfig(rate_hz=1.0),
}
DT_S = 1.0
BODY = Footprint.disc(0.5)
MOTION = BicycleConfig(
    wheelbase_m=3.0,
    max_speed_m_s=0.5,
    max_steering_rad=1.57,
    max_steering_rate_rad_s=100.0,
    max_acceleration_m_s2=100.0,
)


def rover(chart: WorldMap, start: Pose2, motion: MotionConfig, seed: int) -> Simulator:
    """The rover with its two sensors."""
    return Simulator(
        World.of(chart), [RobotSpec("rover", BODY, motion, SENSORS, start, RandomStreams(seed))], DT_S
    )


def knowledge() -> RobotKnowledge:
    """What it knows of itself."""
    return RobotKnowledge(BODY, MOTION, SENSORS, DT_S, RandomStreams(0))


def _follows_the_bend(factory: Any, config: Any) -> None:
    """Within 5 sigma of the truth at every step of a gentle bend; the initial belief is left alone."""
    initial = Belief(Pose2(0.5, -0.3, 0.004), np.diag([1.0, 1.0, 1e-4]))
    before, beliefs = initial.cov.copy(), []
    for _attempt in range(2):
        sim = rover(OPEN, Pose2(0.0, 0.0, 0.0), MOTION, 4)
        localizer = factory(config, knowledge(), OPEN, initial, Journal())
        for _ in range(300):
            belief = localizer.step(sim.step([Twist(0.4, 0.002)])[0])
            assert (belief.cov == belief.cov.T).all()
            assert np.linalg.eigvalsh(belief.cov).min() > 0.0
            truth = sim.bodies[0].pose
            error = math.hypot(belief.pose.x_m - truth.x_m, belief.pose.y_m - truth.y_m)
            assert error < 5.0 * math.sqrt(np.linalg.eigvalsh(belief.cov[:2, :2])[-1])
        beliefs.append(belief)
    assert (initial.cov == before).all()
    assert beliefs[0].pose == beliefs[1].pose


dead_reckoning_follows_the_bend = gps_filter_follows_the_bend = _follows_the_bend


def rover_filter_follows(factory: Any, config: Any) -> None:
    """The bend; and a sighting of what is on no map changes nothing."""
    _follows_the_bend(factory, config)
    initial = Belief(Pose2(0.0, 0.0, 0.0), np.diag([1.0, 1.0, 1e-4]))
    told = []
    for ids in ([], [99]):
        seen = BeaconReadings(np.array(ids, dtype=np.int64), np.full(len(ids), 5.0), np.zeros(len(ids)))
        localizer = factory(config, knowledge(), OPEN, initial, Journal())
        told.append(localizer.step(Readings(1.0, {"odometer": OdometryIncrement(0.4, 0.0), "lidar": seen})))
    assert told[0].pose == told[1].pose
    assert (told[0].cov == told[1].cov).all()


class _Truth:
    """A localizer that knows, for navigators that are tried alone."""

    def __init__(self, sim: Simulator) -> None:
        self._sim = sim

    @property
    def belief(self) -> Belief:
        """The truth."""
        return Belief(self._sim.bodies[0].pose, 1e-8 * np.eye(3))

    def step(self, readings: Readings) -> Belief:
        """The truth still."""
        del readings
        return self.belief


def _driven(stack: Stack, sim: Simulator, steps: int) -> Pose2:
    command: Any = Twist(0.0, 0.0)
    for _ in range(steps):
        command = stack.step(sim.step([command])[0])
        if stack.status[0] is not StackStatus.RUNNING:
            break
    assert stack.status[0] is StackStatus.ARRIVED, stack.status
    return sim.bodies[0].pose


def moves_to_a_pose(factory: Any, config: Any) -> None:
    """From beside the goal and facing away it ends at the goal with the goal's heading."""
    config = config.model_copy(
        update={"rho_gain_per_s": 0.02, "alpha_gain_per_s": 0.05, "beta_gain_per_s": -0.02}
    )
    sim = rover(OPEN, Pose2(0.0, 0.0, 2.0), MOTION, 0)
    parts = Parts(_Truth(sim), None, None, None, None, None, None, None)
    task = TaskKnowledge(parts.localizer.belief, (Goal(30.0, 20.0, 1.0),), 0.3)  # type: ignore[union-attr]
    journal = Journal()
    end = _driven(factory(config, knowledge(), OPEN, task, parts, journal), sim, 3000)
    assert math.hypot(end.x_m - 30.0, end.y_m - 20.0) <= config.arrival_m + 0.02
    assert abs(math.remainder(end.theta_rad - 1.0, 2.0 * math.pi)) < 0.05
    assert [event.kind for event in journal.events] == ["arrived"]


def drives_over_cells(factory: Any, config: Any) -> None:
    """Round a wall of cells, and it stands at the goal at the end."""
    cells = np.zeros((12, 16), dtype=np.int8)
    cells[3:, 8] = 100
    grid = OccupancyGrid(cells, 2.0, Pose2(0.0, 0.0, 0.0))
    chart = WorldMap("cells", (0.0, 0.0, 32.0, 24.0), grid=grid)
    spec = RobotSpec("rover", BODY, MOTION, {}, Pose2(5.0, 5.0, 1.5), RandomStreams(0))
    sim = simulator(spec, chart, DT_S)
    robot = knowledge()
    controller = KanayamaController(KanayamaConfig(along_per_s=0.1, length_m=3.0), robot)
    parts = Parts(_Truth(sim), AstarPlanner(GridSearchConfig()), None, None, controller, None, None, None)
    task = TaskKnowledge(parts.localizer.belief, (Goal(27.0, 5.0),), 1.0)  # type: ignore[union-attr]
    journal = Journal()
    end = _driven(factory(config, robot, chart, task, parts, journal), sim, 500)
    assert math.hypot(end.x_m - 27.0, end.y_m - 5.0) < 1.0
    assert sim.bodies[0].collisions == 0
    assert [event.kind for event in journal.events] == ["plan", "arrived"]
    assert len(journal.plans) == 1


def chains_legs(factory: Any, config: Any) -> None:
    """To a pose among cells, then over the cells to the goal; each leg says that it arrived."""
    cells = np.zeros((12, 16), dtype=np.int8)
    cells[3:, 8] = 100
    chart = WorldMap("cells", (0.0, 0.0, 32.0, 24.0), grid=OccupancyGrid(cells, 2.0, Pose2(0.0, 0.0, 0.0)))
    spec = RobotSpec("rover", BODY, MOTION, {}, Pose2(3.0, 11.0, -1.5), RandomStreams(0))
    sim = simulator(spec, chart, DT_S)
    robot = knowledge()
    controller = KanayamaController(KanayamaConfig(along_per_s=0.1, length_m=3.0), robot)
    parts = Parts(_Truth(sim), AstarPlanner(GridSearchConfig()), None, None, controller, None, None, None)
    goals = (Goal(9.0, 7.0, 0.0), Goal(27.0, 5.0))
    task = TaskKnowledge(parts.localizer.belief, goals, 0.5)  # type: ignore[union-attr]
    journal = Journal()
    end = _driven(factory(config, robot, chart, task, parts, journal), sim, 3000)
    assert math.hypot(end.x_m - 27.0, end.y_m - 5.0) < 1.0
    assert [event.kind for event in journal.events] == ["arrived", "plan", "arrived"]
    assert journal.plans[0].t_s == journal.events[0].t_s > 0.0
