"""Odometry with a gyroscope: what it does at rest, while wheels slip, and where it falls silent."""

from __future__ import annotations

import math

import numpy as np
import pytest

from pilotage.core.angles import wrap_to_pi
from pilotage.core.random import RandomStreams
from pilotage.core.types import Pose2
from pilotage.models.footprint import Footprint
from pilotage.models.motion.differential_drive import DifferentialDriveConfig
from pilotage.models.odometry import OdometryModel
from pilotage.sensors.gyroscope import GyroscopeConfig
from pilotage.sensors.imu import ImuConfig
from pilotage.sensors.readings import GyroscopeRates, OdometryIncrement, Reading, Readings, YawRate
from pilotage.sensors.sensor import SensorConfig
from pilotage.sensors.wheel_odometry import WheelOdometryConfig
from pilotage.stack.interface import Belief, BeliefStatus
from pilotage.stack.journal import Journal
from pilotage.stack.knowledge import RobotKnowledge
from pilotage.stack.localization.gyro_odometry import GyroOdometry
from pilotage.stack.localization.odometry_prediction import OdometryBelief, OdometryPrediction

DT_S = 0.1
WHEELS = WheelOdometryConfig(angle_var_rad2_per_rad=0.01, angle_var_rad2_per_m=5e-3)
IMU = ImuConfig(rate_hz=10.0, bias_rad_s=0.02, bias_walk_rad_s_sqrt_s=1e-4, rate_std_rad_s=0.002)


class Reckoned:
    """A belief that is moved by what the odometry tells, as a localizer without sightings does it."""

    def __init__(self, sensors: dict[str, SensorConfig], gyroscope: bool = True) -> None:
        motion = DifferentialDriveConfig(max_speed_m_s=2.0, max_turn_rate_rad_s=3.0)
        robot = RobotKnowledge(Footprint.disc(0.2), motion, sensors, DT_S, RandomStreams(0))
        believed = OdometryBelief(gyroscope=gyroscope)
        wheels = sensors["wheels"]
        assert isinstance(wheels, WheelOdometryConfig)
        prediction = OdometryPrediction(wheels, believed, 1.0, OdometryModel.EXACT_ARC)
        self.journal = Journal()
        self.odometry = GyroOdometry(robot, "wheels", prediction, self.journal)
        self.prediction = prediction
        self.heading, self.var, self.steps = 0.0, 1e-6, 0
        self.status = BeliefStatus.LOCALIZED

    @property
    def belief(self) -> Belief:
        return Belief(Pose2(0.0, 0.0, wrap_to_pi(self.heading)), np.diag([1.0, 1.0, self.var]), self.status)

    def step(self, **readings: Reading) -> OdometryIncrement | None:
        self.steps += 1
        told = self.odometry.increment(Readings(DT_S * self.steps, readings), self.belief)
        if told is not None:
            self.heading += told.angle_rad
            self.var += self.prediction.variances(told)[1]
        return told

    @property
    def bias(self) -> tuple[float, float]:
        found = self.odometry.bias_rad_s
        assert found is not None
        return found


@pytest.mark.parametrize(("sensors", "gyroscope"), [({}, True), ({"imu": IMU}, False)])
def test_without_a_gyroscope_the_wheels_own_reading_is_passed_on(
    sensors: dict[str, SensorConfig], gyroscope: bool
) -> None:
    own = Reckoned({"wheels": WHEELS, **sensors}, gyroscope)
    wheels = OdometryIncrement(0.05, 0.02)
    assert own.step(wheels=wheels, imu=YawRate(1.0)) is wheels
    assert not own.journal.units
    assert own.odometry.bias_rad_s is None


def test_the_bias_is_learnt_at_rest_and_taken_off() -> None:
    own = Reckoned({"wheels": WHEELS, "imu": IMU})
    rng = np.random.default_rng(0)
    for _ in range(100):
        own.step(wheels=OdometryIncrement(0.0, 0.0), imu=YawRate(0.015 + 0.002 * rng.standard_normal()))
    bias, var = own.bias
    assert abs(bias - 0.015) < 3.3 * math.sqrt(var)
    assert math.sqrt(var) < 6e-4
    assert abs(own.heading) < 1e-3
    assert own.journal.row[0] == bias
    # Driving an arc with wheels that claim a fifth too much: the gyroscope is believed.
    begin = own.heading
    for _ in range(50):
        own.step(wheels=OdometryIncrement(0.05, 0.048), imu=YawRate(0.4 + 0.015))
    assert own.heading - begin == pytest.approx(2.0, abs=0.02)


@pytest.mark.parametrize("kind", ["imu", "gyroscope", "slow"])
def test_the_told_variance_is_that_of_the_errors(kind: str) -> None:
    """200 drives of 20 s, the bias unknown; the slow one is too cautious: no variance told is taken back."""
    squares = []
    for seed in range(200):
        rng = np.random.default_rng(seed)
        gyroscope = GyroscopeConfig(
            rate_hz=200.0, bias_rad_s=0.02, bias_walk_rad_s_sqrt_s=1e-4, scale_error=0.0, rate_std_rad_s=0.009
        )
        slow = IMU.model_copy(update={"rate_hz": 2.0})
        own = Reckoned({"wheels": WHEELS, kind: {"imu": IMU, "slow": slow, "gyroscope": gyroscope}[kind]})
        heard: list[float] = []
        bias, true = 0.02 * rng.standard_normal(), 0.0
        own.heading = 1e-3 * rng.standard_normal()
        for k in range(200):
            turn = 0.05 * math.sin(0.05 * k)
            true += turn
            bias += 1e-4 * math.sqrt(DT_S) * rng.standard_normal()
            spread = math.sqrt(0.01 * abs(turn) + 5e-3 * 0.03)
            wheels = OdometryIncrement(0.03, turn + spread * rng.standard_normal())
            rate = turn / DT_S + bias
            heard.append(rate)
            if kind == "imu":
                own.step(wheels=wheels, imu=YawRate(rate + 0.002 * rng.standard_normal()))
            elif kind == "slow" and k % 5 == 4:
                own.step(wheels=wheels, slow=YawRate(sum(heard[-5:]) / 5 + 0.002 * rng.standard_normal()))
            elif kind == "slow":
                own.step(wheels=wheels)
            else:
                own.step(wheels=wheels, gyroscope=GyroscopeRates(rate + 0.009 * rng.standard_normal(20)))
        squares.append((own.heading - true) ** 2 / own.var)
    # Standard error sqrt(2 / 200) = 0.1: a right filter fails once in 10^3.
    assert (0.3 if kind == "slow" else 0.67) < np.mean(squares) < 1.33


def test_what_a_localizer_corrects_the_heading_by_teaches_the_bias() -> None:
    """The wheels know nothing of the turn; the headings of a localizer with a compass tell the bias."""
    poor = WheelOdometryConfig(angle_var_rad2_per_rad=1.0, angle_var_rad2_per_m=1.0)
    taught, alone = Reckoned({"wheels": poor, "imu": IMU}), Reckoned({"wheels": poor, "imu": IMU})
    rng = np.random.default_rng(1)
    for own in (taught, alone):
        for _ in range(300):
            own.step(wheels=OdometryIncrement(0.05, 0.3 * rng.standard_normal()), imu=YawRate(0.012))
            if own is taught:
                S = own.var + 1e-4
                own.heading += own.var / S * (0.0 + 0.01 * rng.standard_normal() - own.heading)
                own.var *= 1e-4 / S
    bias, var = taught.bias
    assert abs(bias - 0.012) < 3.3 * math.sqrt(var)
    assert math.sqrt(var) < 0.5 * math.sqrt(alone.bias[1])


def test_a_robot_that_is_lost_teaches_no_bias() -> None:
    own = Reckoned({"wheels": WHEELS, "imu": IMU})
    for _ in range(20):
        own.step(wheels=OdometryIncrement(0.05, 0.0), imu=YawRate(0.01))
    bias, own.status = own.bias, BeliefStatus.LOST
    own.heading, own.var = 2.0, 1e-6
    own.step(imu=YawRate(0.01))
    assert own.bias[0] == bias[0]


def test_wheels_that_slip_are_not_followed_and_a_new_bias_is_found() -> None:
    own = Reckoned({"wheels": WHEELS, "imu": IMU})
    for _ in range(50):
        own.step(wheels=OdometryIncrement(0.0, 0.0), imu=YawRate(0.0))
    told = own.step(wheels=OdometryIncrement(0.0, 0.4), imu=YawRate(0.0))
    assert told is not None
    assert told.angle_rad == pytest.approx(0.0, abs=0.01)
    assert told.angle_var_rad2 == pytest.approx(0.4**2, rel=0.01)
    assert own.bias[0] == pytest.approx(0.0, abs=1e-3)
    for _ in range(300):
        own.step(wheels=OdometryIncrement(0.0, 0.0), imu=YawRate(0.3))
    assert own.bias[0] == pytest.approx(0.3, abs=1e-3)


def test_a_gyroscope_that_falls_silent_leaves_the_wheels() -> None:
    own = Reckoned({"wheels": WHEELS, "imu": IMU})
    wheels = OdometryIncrement(0.05, 0.02)
    assert own.step(wheels=wheels) is wheels
    assert own.step(wheels=wheels, imu=YawRate(math.nan)) is wheels
    own.step(wheels=wheels, imu=YawRate(0.2))  # what came in between is not known
    told = own.step(wheels=wheels, imu=YawRate(0.2))
    assert told is not wheels


def test_gyroscopes_slower_and_faster_than_the_odometry() -> None:
    """Both correct the turn of the whole time that they tell of."""
    slow = IMU.model_copy(update={"rate_hz": 2.0})
    own = Reckoned({"wheels": WHEELS, "imu": slow})
    for k in range(1, 101):
        own.step(wheels=OdometryIncrement(0.0, 0.0), **({} if k % 5 else {"imu": YawRate(0.0)}))
    for k in range(1, 101):
        said: dict[str, Reading] = {"wheels": OdometryIncrement(0.05, 0.024)}
        if k % 5 == 0:
            said["imu"] = YawRate(0.2)
        own.step(**said)
    assert own.heading == pytest.approx(2.0, abs=0.05)
    fast = Reckoned({"wheels": WHEELS.model_copy(update={"rate_hz": 2.0}), "imu": IMU})
    for k in range(1, 101):
        fast.step(imu=YawRate(0.0), **({} if k % 5 else {"wheels": OdometryIncrement(0.0, 0.0)}))
    for k in range(1, 101):
        said = {"imu": YawRate(0.2)}
        if k % 5 == 0:
            said["wheels"] = OdometryIncrement(0.25, 0.12)
        fast.step(**said)
    assert fast.heading == pytest.approx(2.0, abs=0.05)


def test_of_two_gyroscopes_the_quieter_one_is_used() -> None:
    noisy = IMU.model_copy(update={"rate_std_rad_s": 0.1})
    own = Reckoned({"wheels": WHEELS, "a": noisy, "b": IMU})
    for _ in range(50):
        own.step(wheels=OdometryIncrement(0.0, 0.0), a=YawRate(9.0), b=YawRate(0.01))
    assert own.bias[0] == pytest.approx(0.01, abs=1e-3)
