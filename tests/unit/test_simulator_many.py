"""Many robots in one world, people among them, new sensors, and components from outside the package."""

from __future__ import annotations

import importlib.util
import math
import textwrap
from pathlib import Path

import numpy as np
import pytest

from pilotage.core.errors import InputError
from pilotage.core.random import RandomStreams
from pilotage.core.types import Pose2, Twist
from pilotage.maps.segment_map import SegmentMap
from pilotage.maps.world_map import WorldMap
from pilotage.models.footprint import Footprint
from pilotage.models.motion.differential_drive import DifferentialDriveConfig
from pilotage.models.motion.motion import MOTIONS
from pilotage.models.motion.omnidirectional import OmnidirectionalConfig
from pilotage.models.motion.wheel_drive import WheelDriveConfig
from pilotage.sensors.bumper import BumperConfig
from pilotage.sensors.compass import CompassConfig
from pilotage.sensors.gps import GpsConfig
from pilotage.sensors.gyroscope import GyroscopeConfig
from pilotage.sensors.imu import ImuConfig
from pilotage.sensors.lidar import LidarConfig
from pilotage.sensors.readings import (
    BumperReading,
    CompassHeading,
    GpsFix,
    GyroscopeRates,
    LidarScan,
    OdometryIncrement,
    YawRate,
)
from pilotage.sensors.sensor import SENSORS, Mount
from pilotage.sensors.wheel_encoders import WheelEncodersConfig
from pilotage.sensors.wheel_odometry import WheelOdometryConfig
from pilotage.sim.source import RobotSpec, Simulator
from pilotage.sim.worlds.world import World
from support.worlds import CAR, DISC, ROOM_MAP, START, robot, simulator

EMPTY = WorldMap("empty", (-50.0, -50.0, 50.0, 50.0))
BOX = Footprint.polygon(np.array([[0.4, 0.3], [-0.4, 0.3], [-0.4, -0.3], [0.4, -0.3]]))
QUIET = LidarConfig(beams=5, field_of_view_rad=math.pi, range_var_m2=0.0, max_range_m=9.0)


def at(x: float, y: float = 0.0, theta: float = 0.0, shape: Footprint = DISC, name: str = "") -> RobotSpec:
    return robot({"scan": QUIET}, start=Pose2(x, y, theta), footprint=shape, name=name or f"at {x:g}, {y:g}")


def solid(chart: WorldMap = EMPTY) -> World:
    """A world with a far wall, so that scanners have something to end at."""
    return World.of(chart, np.array([[40.0, -40.0, 40.0, 40.0]]))


@pytest.mark.parametrize(("first", "second"), [(DISC, DISC), (DISC, BOX), (BOX, DISC), (BOX, BOX)])
def test_robots_see_each_other_and_collide_when_they_touch(first: Footprint, second: Footprint) -> None:
    sim = Simulator(solid(), [at(0.0, shape=first), at(3.0, theta=math.pi, shape=second)], 0.1)
    edges = [(DISC.radius_m if shape is DISC else 0.4) for shape in (first, second)]
    readings = sim.step([Twist(0.0, 0.0), Twist(0.0, 0.0)])
    for heard, edge in zip(readings, reversed(edges), strict=True):
        scan = heard.by_sensor["scan"]
        assert isinstance(scan, LidarScan)
        assert scan.ranges_m[2] == pytest.approx(3.0 - edge)
        assert scan.ranges_m[0] == 9.0
    for _ in range(60):
        sim.step([Twist(1.0, 0.0), Twist(0.0, 0.0)])
    one, other = sim.bodies
    assert one.pose.x_m == pytest.approx(3.0 - sum(edges), abs=1e-6)
    assert other.pose.x_m == 3.0
    assert (one.collisions, other.collisions) == (1, 1)
    assert one.touching
    assert other.touching
    assert one.clearance_m == pytest.approx(0.0, abs=1e-6)
    for _ in range(10):
        sim.step([Twist(-1.0, 0.0), Twist(0.0, 0.0)])
    assert not one.touching
    assert not other.touching
    assert other.clearance_m == pytest.approx(one.clearance_m)
    assert (one.collisions, other.collisions) == (1, 1)


def test_a_wheel_drive_that_runs_into_another_one_counts_for_both() -> None:
    specs = [
        robot(motion=WheelDriveConfig(max_wheel_speed_rad_s=20.0), start=Pose2(x, 0.0, 0.0), name=f"{x}")
        for x in (0.0, 1.0)
    ]
    sim = Simulator(World.of(EMPTY), specs, 0.05)
    for _ in range(60):
        sim.step([Twist(0.5, 0.0), Twist(0.0, 0.0)])
    assert [body.collisions for body in sim.bodies] == [1, 1]
    assert 0.0 <= sim.bodies[0].clearance_m < 0.01


def test_a_crowd_never_overlaps() -> None:
    rng = np.random.default_rng(5)
    shapes = [DISC, BOX, CAR]
    specs = [
        robot(
            footprint=shapes[k % 3],
            start=Pose2(1.9 * (k % 3) - 1.9, 1.9 * (k // 3) - 1.9, float(rng.uniform(-3, 3))),
            name=str(k),
            motion=OmnidirectionalConfig() if k % 2 else None,
        )
        for k in range(9)
    ]
    corners = np.array([[-3.0, -3.0], [3.0, -3.0], [3.0, 3.0], [-3.0, 3.0]])
    walls = SegmentMap.of(np.hstack([corners, np.roll(corners, -1, axis=0)]))
    sim = Simulator(World.of(WorldMap("pen", walls.bounds_m, geometry=walls)), specs, 0.1)
    for k in range(400):
        if k % 10 == 0:
            commands = [
                Twist(float(rng.uniform(-1, 1)), float(rng.uniform(-2, 2)), float(rng.uniform(-1, 1)))
                for _ in specs
            ]
        sim.step(commands)
        for row, body in enumerate(sim.bodies):
            assert body.clearance_m > -1e-6
            for other in sim.bodies[:row]:
                assert body.distance_to_m(other) > -1e-6
    assert sum(body.collisions for body in sim.bodies) > 5


def test_robots_that_start_inside_each_other_are_refused() -> None:
    with pytest.raises(InputError, match="robots 'one' and 'two': expected starts apart"):
        Simulator(solid(), [at(0.0, name="one"), at(0.5, name="two")], 0.1)


def test_commands_act_after_the_motions_delay() -> None:
    prompt, late = (
        Simulator(solid(), [robot(motion=DifferentialDriveConfig(delay_s=delay_s))], 0.1)
        for delay_s in (0.0, 0.3)
    )
    commands = [Twist(0.1 * k, 0.2 * k) for k in range(8)]
    poses = [[_stepped(sim, command) for command in commands] for sim in (prompt, late)]
    assert poses[1][:3] == [START] * 3
    assert poses[1][3:] == poses[0][:-3]
    with pytest.raises(InputError, match=r"robot\.motion\.delay_s: expected a multiple of run\.dt_s"):
        Simulator(solid(), [robot(motion=DifferentialDriveConfig(delay_s=0.25))], 0.1)


def _stepped(sim: Simulator, command: Twist) -> Pose2:
    sim.step([command])
    return sim.bodies[0].pose


def test_each_robot_draws_from_its_own_streams() -> None:
    sensors = {"odometry": WheelOdometryConfig(), "scan": LidarConfig(beams=31)}
    starts = [Pose2(2.0, 2.0, 0.0), Pose2(2.0, 6.0, 0.0)]
    specs = [robot(sensors, start=start, seed=k, name=str(k)) for k, start in enumerate(starts)]
    sim = Simulator(World.of(ROOM_MAP), specs, 0.1)
    alone = [simulator(spec) for spec in specs]
    for _ in range(10):
        both = sim.step([Twist(0.2, 0.0)] * 2)
        for one, other in zip(both, alone, strict=True):
            assert one.by_sensor["odometry"] == other.step([Twist(0.2, 0.0)])[0].by_sensor["odometry"]


def readings(config: object, steps: int, command: Twist, **more: object) -> tuple[list[object], Simulator]:
    sim = simulator(robot({"it": config}, **more), EMPTY)  # type: ignore[arg-type, dict-item]
    return [sim.step([command])[0].by_sensor.get("it") for _ in range(steps)], sim


def test_an_inertial_unit_reads_the_turn_with_its_bias_and_noise() -> None:
    config = ImuConfig(bias_rad_s=0.02, bias_walk_rad_s_sqrt_s=0.0, rate_std_rad_s=0.01)
    heard, _ = readings(config, 2000, Twist(0.1, 0.5))
    rates = np.array([reading.rate_rad_s for reading in heard if isinstance(reading, YawRate)])[10:]
    assert abs(abs(rates.mean() - 0.5) - 0.02) < 4 * 0.01 / math.sqrt(len(rates))
    assert rates.std() == pytest.approx(0.01, rel=0.1)
    slow, _ = readings(config.model_copy(update={"rate_hz": 2.0}), 50, Twist(0.0, 0.5))
    assert [k for k, reading in enumerate(slow) if reading is not None] == list(range(4, 50, 5))


def test_a_walking_bias_spreads_with_the_square_root_of_time() -> None:
    config = ImuConfig(bias_rad_s=0.0, bias_walk_rad_s_sqrt_s=0.01, rate_std_rad_s=0.0)
    ends = []
    for seed in range(150):
        heard, _ = readings(config, 100, Twist(0.0, 0.0), seed=seed)
        assert isinstance(heard[-1], YawRate)
        ends.append(heard[-1].rate_rad_s)
    # 150 seeds: five standard errors of a standard deviation are 29 per cent.
    assert np.std(ends) == pytest.approx(0.01 * math.sqrt(10.0), rel=0.29)


def test_a_compass_reads_the_heading_with_its_errors() -> None:
    config = CompassConfig(heading_std_rad=0.02, declination_rad=0.1, disturbance_rad=0.0)
    heard, _ = readings(config, 1000, Twist(0.0, 0.0), start=Pose2(1.0, 1.0, 3.1))
    errors = [
        math.remainder(reading.heading_rad - 3.1, 2 * math.pi)
        for reading in heard
        if isinstance(reading, CompassHeading)
    ]
    assert all(
        -math.pi <= reading.heading_rad < math.pi for reading in heard if isinstance(reading, CompassHeading)
    )
    assert np.mean(errors) == pytest.approx(0.1, abs=4 * 0.02 / math.sqrt(1000))
    assert np.std(errors) == pytest.approx(0.02, rel=0.12)
    disturbed, _ = readings(CompassConfig(heading_std_rad=0.0, disturbance_rad=0.2), 300, Twist(1.0, 0.0))
    aside = np.array([r.heading_rad for r in disturbed if isinstance(r, CompassHeading)])
    assert 0.02 < np.abs(aside).max() <= 0.2


def test_a_satellite_fix_has_white_noise_a_stationary_bias_and_drop_outs() -> None:
    config = GpsConfig(
        rate_hz=10.0,
        position_std_m=0.3,
        bias_std_m=0.0,
        dropout_share=0.25,
        mount=Mount(x_m=0.5),
    )
    heard, _ = readings(config, 4000, Twist(0.0, 0.0), start=Pose2(3.0, -2.0, math.pi / 2))
    fixes = np.array([(fix.x_m, fix.y_m) for fix in heard if isinstance(fix, GpsFix)])
    # Binomial: five standard deviations.
    assert abs(len(fixes) / 4000 - 0.75) < 5 * math.sqrt(0.25 * 0.75 / 4000)
    assert fixes.mean(axis=0) == pytest.approx([3.0, -1.5], abs=5 * 0.3 / math.sqrt(len(fixes)))
    assert fixes.std(axis=0) == pytest.approx([0.3, 0.3], rel=0.08)
    wander = GpsConfig(rate_hz=10.0, position_std_m=0.0, bias_std_m=2.0, bias_time_s=1.0)
    heard, _ = readings(wander, 6000, Twist(0.0, 0.0), start=Pose2(0.0, 0.0, 0.0))
    bias = np.array([fix.x_m for fix in heard if isinstance(fix, GpsFix)])
    # 600 s of a bias that forgets in 1 s: some 300 independent values.
    assert bias.std() == pytest.approx(2.0, rel=0.25)
    correlation = np.corrcoef(bias[:-10], bias[10:])[0, 1]
    assert correlation == pytest.approx(math.exp(-1.0), abs=0.2)


@pytest.mark.parametrize("shape", [DISC, BOX], ids=["disc", "box"])
@pytest.mark.parametrize(("bearing", "sector"), [(-1.2, 0), (0.0, 1), (1.2, 2), (math.pi, None)])
def test_a_bumper_feels_where_a_contact_is(shape: Footprint, bearing: float, sector: int | None) -> None:
    spec = robot({"it": BumperConfig()}, OmnidirectionalConfig(), shape, Pose2(0.0, 0.0, 0.5))
    post = np.array([[math.cos(bearing + 0.5), math.sin(bearing + 0.5), 0.05]])
    sim = Simulator(World.of(EMPTY, obstacle_circles_m=post), [spec], 0.1)
    for _ in range(20):
        heard = sim.step([Twist(math.cos(bearing), 0.0, math.sin(bearing))])[0].by_sensor["it"]
    assert sim.bodies[0].touching
    assert isinstance(heard, BumperReading)
    assert heard.pressed == tuple(k == sector for k in range(3))


def test_a_box_feels_a_post_beside_its_middle_where_it_is() -> None:
    """The contact's place on the outline counts, not the way that the wall's normal points."""
    spec = robot({"it": BumperConfig(sectors=9)}, footprint=BOX, start=Pose2(0.0, 0.0, 0.0))
    sim = Simulator(World.of(EMPTY, obstacle_circles_m=np.array([[1.0, 0.25, 0.05]])), [spec], 0.1)
    for _ in range(20):
        heard = sim.step([Twist(1.0, 0.0)])[0].by_sensor["it"]
    assert isinstance(heard, BumperReading)
    assert sim.bodies[0].contact_bearing_rad() == pytest.approx(math.atan2(0.25, 0.4), abs=1e-3)
    assert heard.pressed.index(True) == int((math.atan2(0.25, 0.4) + math.pi / 2) / (math.pi / 9))


def test_a_gyroscope_on_any_motion_reads_rates_in_samples() -> None:
    exact = GyroscopeConfig(
        rate_hz=200.0, bias_rad_s=0.0, bias_walk_rad_s_sqrt_s=0.0, scale_error=0.0, rate_std_rad_s=0.0
    )
    heard, _ = readings(exact, 20, Twist(0.1, 0.5))
    assert isinstance(heard[-1], GyroscopeRates)
    assert heard[-1].rates_rad_s == pytest.approx(np.full(20, 0.5))
    slow, _ = readings(exact.model_copy(update={"rate_hz": 5.0}), 20, Twist(0.1, 0.5))
    assert [reading is not None for reading in slow[:4]] == [False, True, False, True]
    with pytest.raises(InputError, match=r"rate_hz: expected a multiple of 10 Hz"):
        readings(exact.model_copy(update={"rate_hz": 33.0}), 1, Twist(0.0, 0.0))
    mixed = {"gyro": exact, "encoders": WheelEncodersConfig(rate_hz=300.0)}
    with pytest.raises(InputError, match=r"gyro\.rate_hz: expected a whole part of 300 Hz"):
        simulator(robot(mixed, WheelDriveConfig()), EMPTY)


def test_odometry_of_a_base_that_drives_sideways() -> None:
    config = WheelOdometryConfig(distance_var_m2_per_m=1e-4)
    heard, _ = readings(config, 800, Twist(0.0, 0.0, 0.5), motion=OmnidirectionalConfig())
    aside = np.array([step.lateral_m for step in heard if isinstance(step, OdometryIncrement)])[10:]
    assert aside.mean() == pytest.approx(0.05, abs=5e-4)
    assert aside.var() == pytest.approx(1e-4 * 0.05, rel=0.3)


TRICYCLE = '''
"""A tricycle: its front wheel steers and drives."""
import math

import numpy as np

from pilotage.core.types import Twist
from pilotage.models.motion.motion import MOTIONS, MotionConfig, Positive
from pilotage.sim.bodies.motion import SIMULATED_MOTIONS


@MOTIONS.add_config("tricycle")
class TricycleConfig(MotionConfig):
    """The front wheel turns as far as it likes; it sits this far ahead of the rear axle."""

    wheelbase_m: Positive = 0.8
    max_wheel_speed_m_s: Positive = 1.0

    @property
    def top_speed_m_s(self) -> float:
        """The front wheel straight ahead."""
        return self.max_wheel_speed_m_s

    @property
    def top_turn_rate_rad_s(self) -> float:
        """The front wheel across."""
        return self.max_wheel_speed_m_s / self.wheelbase_m


@SIMULATED_MOTIONS.add(TricycleConfig)
class Tricycle:
    spins_on = False
    release_m = 1e-6
    turned_rad = None

    def __init__(self, config, dt_s, samples, streams, where):
        self.moves = np.zeros((1, 3))
        self.config, self.dt_s = config, dt_s

    def command(self, command):
        v, w = command.v_m_s, command.w_rad_s
        wheel = math.hypot(v, w * self.config.wheelbase_m)
        share = min(1.0, self.config.max_wheel_speed_m_s / max(wheel, 1e-12))
        self.moves[0] = share * v * self.dt_s, 0.0, share * w * self.dt_s

    def stop(self):
        pass
'''

SONAR = '''
"""How far it is to the nearest thing all around."""
from dataclasses import dataclass

from pilotage.sensors.sensor import SENSORS, SensorConfig
from pilotage.sim.sensing.sensor import SIMULATED_SENSORS


@dataclass(frozen=True, slots=True)
class Nearest:
    distance_m: float


@SENSORS.add_config("nearest")
class NearestConfig(SensorConfig):
    """Clearance, as it is."""


@SIMULATED_SENSORS.add(NearestConfig)
class SimulatedNearest:
    def __init__(self, config, carrier, rng):
        carrier.world.check_solids(carrier.where, "nearest")
        self.body = carrier.body

    def read(self):
        return Nearest(self.body.clearance_m)
'''


def load(path: Path, text: str) -> None:
    path.write_text(textwrap.dedent(text))
    spec = importlib.util.spec_from_file_location(path.stem, path)
    assert spec is not None
    assert spec.loader is not None
    spec.loader.exec_module(importlib.util.module_from_spec(spec))


def test_a_motion_and_a_sensor_from_outside_the_package(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for registry in (MOTIONS, SENSORS):
        registry.names()
        monkeypatch.setattr(registry, "_entries", dict(registry._entries))
    load(tmp_path / "tricycle.py", TRICYCLE)
    load(tmp_path / "nearest.py", SONAR)
    motion = MOTIONS.configure("tricycle", {"wheelbase_m": 1.0}, "robot.motion")
    sensor = SENSORS.configure("nearest", {}, "robot.sensors.it")
    spec = RobotSpec("trike", CAR, motion, {"it": sensor}, Pose2(2.0, 2.0, 0.0), RandomStreams(0))  # type: ignore[arg-type, dict-item]
    sim = simulator(spec)
    for _ in range(40):
        heard = sim.step([Twist(0.8, 0.0)])[0].by_sensor["it"]
    assert sim.bodies[0].collisions == 1
    assert heard.distance_m == pytest.approx(0.0, abs=1e-6)  # type: ignore[union-attr]
    with pytest.raises(InputError, match=r"robot\.sensors\.it: nearest needs a world with walls or a grid"):
        simulator(spec, EMPTY)


def test_what_nobody_simulates_is_refused() -> None:
    class HovercraftConfig(type(robot().motion).__mro__[1]):  # type: ignore[misc]
        """Floats."""

    with pytest.raises(InputError, match="nothing simulates a motion of type HovercraftConfig"):
        simulator(robot(motion=HovercraftConfig()))
