"""What commands make a robot drive: by the data sheet as by the simulated body, and how wrong that is."""

import numpy as np
import pytest

from pilotage.core.errors import InputError
from pilotage.core.random import RandomStreams
from pilotage.core.types import Command, Twist, WheelSpeeds
from pilotage.experiments.build.build import build
from pilotage.experiments.loop import run_loop
from pilotage.experiments.mission import mission_of
from pilotage.models.motion.bicycle import BicycleConfig
from pilotage.models.motion.differential_drive import DifferentialDriveConfig
from pilotage.models.motion.motion import MotionConfig
from pilotage.models.motion.omnidirectional import OmnidirectionalConfig
from pilotage.models.motion.wheel_drive import WheelDriveConfig, WheelErrorsConfig
from pilotage.sensors.readings import OdometryIncrement
from pilotage.sensors.wheel_odometry import WheelOdometryConfig
from pilotage.sim.bodies.motion import SIMULATED_MOTIONS
from pilotage.stack.localization.command_error import CommandError
from pilotage.stack.localization.commanded_motion import CommandedMotion
from support.missions import SMALL_VAR, reach

DT_S = 0.05
EXACT = WheelErrorsConfig(
    radius_difference=0.0, separation_error=(0.0, 0.0), slip=(0.0, 0.0), slip_std_m_sqrt_m=0.0
)


@pytest.mark.parametrize(
    "motion",
    [
        DifferentialDriveConfig(),
        OmnidirectionalConfig(max_lateral_m_s=1.0),
        WheelDriveConfig(errors=EXACT),
        WheelDriveConfig(errors=EXACT, motor_lag_s=0.0),
        BicycleConfig(max_steering_rate_rad_s=1000.0),
    ],
)
def test_a_robot_drives_what_its_data_sheet_foretells(motion: MotionConfig) -> None:
    rng = np.random.default_rng(3)
    body = SIMULATED_MOTIONS.of(motion, "robot.motion")(motion, DT_S, 100, RandomStreams(0), "robot.motion")
    commanded = CommandedMotion(motion, DT_S)
    for step in range(300):
        if step % 7 == 0:
            v, w, aside = rng.uniform(-1.5, 1.5, 3).tolist()
            command: Command = Twist(v, w, aside if motion.drives_sideways else 0.0)
            if isinstance(motion, WheelDriveConfig):
                # Twists that the wheels bear, else both slow down alike; and wheel speeds.
                command = Twist(0.05 * v, 0.2 * w) if step % 2 else WheelSpeeds(3.0 * v, 3.0 * w)
        commanded.sent(step * DT_S, command)
        body.command(command)
        ahead, left, turn = body.moves.sum(axis=0).tolist()
        told = commanded.step((step + 1) * DT_S)
        assert (told.distance_m, told.lateral_m, told.angle_rad) == pytest.approx(
            (ahead, left, turn), abs=2e-3 if isinstance(motion, WheelDriveConfig) else 1e-9
        )


def test_commands_act_late() -> None:
    motion = DifferentialDriveConfig(max_acceleration_m_s2=1000.0, delay_s=2 * DT_S)
    commanded = CommandedMotion(motion, DT_S)
    driven = []
    for step in range(4):
        commanded.sent(step * DT_S, Twist(1.0, 0.0))
        driven.append(commanded.step((step + 1) * DT_S).distance_m)
    assert driven == pytest.approx([0.0, 0.0, DT_S, DT_S])


def test_how_wrong_commands_are_is_learnt_and_the_odometrys_noise_is_not_theirs() -> None:
    """White errors of 0.02 m^2/s are found; a robot that obeys is believed to within the odometry's noise."""
    sensor, period_s = WheelOdometryConfig(rate_hz=5.0), 0.2
    rng = np.random.default_rng(1)
    obeyed, disobeyed = (CommandError(DifferentialDriveConfig(), sensor) for _ in range(2))
    commanded = np.array([0.1, 0.0, 0.0])
    noise_std = np.sqrt(sensor.distance_var_m2_per_m * 0.1)
    for _ in range(500):
        noise_m = float(noise_std * rng.standard_normal())
        obeyed.tell(OdometryIncrement(0.1 + noise_m, 0.0), commanded, period_s)
        wrong_m = float(np.sqrt(0.02 * period_s) * rng.standard_normal())
        disobeyed.tell(OdometryIncrement(0.1 + noise_m + wrong_m, 0.0), commanded, period_s)
    assert obeyed.densities[0] < noise_std**2 / period_s
    # The mean of some hundred squares: off by 14 %, one standard deviation; four of them.
    assert disobeyed.densities[0] == pytest.approx(0.02, rel=0.6)
    # What nobody can have driven is no disobedience.
    obeyed.tell(OdometryIncrement(100.0, 0.0), commanded, period_s)
    assert obeyed.densities[0] < 1.0


def test_who_does_not_answer_goes_on_as_it_went() -> None:
    error = CommandError(DifferentialDriveConfig(), WheelOdometryConfig(rate_hz=5.0))
    for _ in range(20):
        error.tell(OdometryIncrement(0.1, 0.04), np.zeros(3), 0.2)
    assert error.rates == pytest.approx([0.5, 0.0, 0.2], rel=0.1)


@pytest.mark.parametrize(
    ("localizer", "sensors", "most_m"),
    [
        (
            "ekf-gps",
            {"gps": {"name": "gps", "position_std_m": 0.1, "bias_std_m": 0.1}, "compass": "compass"},
            0.6,
        ),
        ("ekf-walls", {"lidar": {"name": "lidar", "beams": 180}}, 0.1),
        ("ekf-landmarks", {"beacons": "beacons"}, 0.2),
    ],
)
def test_a_car_without_odometry_reckons_by_its_commands(
    localizer: str, sensors: dict[str, object], most_m: float
) -> None:
    """It was refused, though it senses where it is."""
    robot = {"footprint": {"radius_m": 0.3}, "motion": "bicycle", "sensors": sensors}
    stack = {"initial": SMALL_VAR, "localizer": localizer}
    stack["navigator"] = {"name": "open-loop", "speed_m_s": 0.5, "turn_rate_rad_s": 0.2, "duration_s": 8.0}
    values = reach(robot=robot, stack=stack, task="drive")
    run = run_loop(build(mission_of(values, seed=3))).finished
    trace = run.robots[0].trace
    off_m = np.hypot(trace["true_x_m"] - trace["est_x_m"], trace["true_y_m"] - trace["est_y_m"])
    assert run.robots[0].driven_m > 3.0
    assert off_m.max() < most_m
    assert run.events[0].kind == "no-odometry"
    values["stack"]["localizer"] = "dead-reckoning"
    with pytest.raises(InputError, match="expected one wheel-odometry among"):
        build(mission_of(values))
