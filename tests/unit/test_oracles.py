"""Oracles: each makes its module's error go away, leaves the world as it is, and is offered where it fits."""

from __future__ import annotations

import functools
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from pilotage.cli.main import main
from pilotage.core.errors import InputError
from pilotage.evaluation.finished import FinishedRun, RobotRun
from pilotage.experiments.build.build import build
from pilotage.experiments.loop import run_loop
from pilotage.experiments.mission import load_mission
from pilotage.experiments.oracles.applicable import applicable, check_oracles
from pilotage.experiments.oracles.ideal_sensors import FAULTS, ideal
from pilotage.experiments.run import judge
from pilotage.experiments.studies.attribution import attribution_study
from pilotage.missions.mission import Mission
from pilotage.sensors.sensor import SENSORS, Mount, SensorConfig

PROPERTIES = {
    "rate_hz",
    "mount",
    "field_of_view_rad",
    "max_range_m",
    "range_m",
    "min_range_m",
    "reliable_range_m",
    "beams",
    "cone_rad",
    "counts_per_turn",
    "field_ut",
    "disturbance_length_m",
    "bias_time_s",
    "sectors",
}
"""What a sensor is, as opposed to what it does wrong."""


def simulated(mission: Mission) -> tuple[FinishedRun, dict[str, Any]]:
    """A run and its metrics."""
    check_oracles(mission)
    experiment = build(mission)
    run = run_loop(experiment)
    return run.finished, judge(experiment, run).metrics


def only(run: FinishedRun) -> RobotRun:
    (robot,) = run.robots
    return robot


class TestIdealSensors:
    def test_every_field_of_every_sensor_is_either_a_property_or_a_fault(self) -> None:
        for entry in SENSORS:
            faults = set(FAULTS[entry.config])  # type: ignore[index]
            assert set(entry.config.model_fields) - PROPERTIES == faults, entry.name

    def test_properties_stay_and_faults_go(self) -> None:
        odometer = SENSORS.configure(
            "wheel-odometry", {"rate_hz": 5.0, "angle_scale": 1.3, "angle_bias_rad_s": 0.1}, ""
        )
        assert isinstance(odometer, SensorConfig)
        silent = ideal(odometer).model_dump()
        assert silent["rate_hz"] == 5.0
        assert (silent["angle_scale"], silent["angle_bias_rad_s"]) == (1.0, 0.0)
        assert silent["angle_var_rad2_per_rad"] == 0.0

    def test_of_a_foreign_sensor_the_variances_go(self) -> None:
        class Sonar(SensorConfig):
            echo_var_m2: float = 0.5
            gain: float = 2.0

        assert ideal(Sonar(mount=Mount(x_m=1.0))) == Sonar(mount=Mount(x_m=1.0), echo_var_m2=0.0, gain=2.0)


class TestFloor:
    def test_silent_sensors_have_no_systematic_error_either(self) -> None:
        """Odometry that turns 20 % too far and a crooked beacon sensor, by dead reckoning."""
        wrong = [
            "stack.localizer=dead-reckoning",
            "robot.sensors.odometry.angle_scale=1.2",
            "robot.sensors.odometry.angle_bias_rad_s=0.01",
            "run.time_limit_s=20",
            "run.oracles=[sensors, initial]",
        ]
        mission = load_mission("museum-1", wrong)
        metrics = simulated(mission)[1]
        assert metrics["position_rmse_m"] == pytest.approx(0.0, abs=1e-3)
        mission = load_mission("museum-1", [*wrong[:-1], "run.oracles=[initial]"])
        assert simulated(mission)[1]["position_rmse_m"] > 0.1

    def test_the_start_is_told(self) -> None:
        first = []
        for oracle in ("", "initial"):
            settings = ["stack.initial.x_var_m2=100", "run.time_limit_s=1", f"run.oracles=[{oracle}]"]
            mission = load_mission("museum-1", ["stack.localizer=dead-reckoning", *settings])
            trace = only(simulated(mission)[0]).trace
            off = np.hypot(trace["est_x_m"] - trace["true_x_m"], trace["est_y_m"] - trace["true_y_m"])
            first.append(off[0])
        assert first[1] < 0.01 < 0.1 < first[0]


# --- sheets ------------------------------------------------------------------------------------------

SMALL = """
size_m: [1.0, 0.8]
cells: [10, 8]
start_pose: [0.3, 0.3, 0.0]
obstacles: [[0.62, 0.45, 0.8, 0.6]]
lines: [[[0.2, 0.6], [0.45, 0.6]]]
"""


@pytest.fixture(scope="module")
def small(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("sheet") / "small.yaml"
    path.write_text(SMALL)
    return path


def explored_now(sheet: Path, oracle: str, *more: str) -> tuple[FinishedRun, dict[str, Any]]:
    settings = [f"world.map={sheet}", f"run.oracles=[{oracle}]", "run.seed=3", *more]
    return simulated(load_mission("romi-explore", settings))


explored = functools.cache(explored_now)
"""What several tests look at is driven once."""


REPORTS = ("stack.navigator.name=surround-check", "stack.navigator.margin_cells=0")
WANDERS = (
    "stack.navigator.name=random-walk",
    "stack.navigator.fusion=false",
    "stack.navigator.avoidance=false",
)


class TestSheets:
    @pytest.mark.parametrize("explorer", [(), REPORTS, WANDERS])
    def test_the_true_pose(self, small: Path, explorer: tuple[str, ...]) -> None:
        _, found = explored(small, "", *explorer)
        _, known = explored(small, "localizer", *explorer)
        assert found["position_rmse_m"] > 1e-3
        assert known["position_rmse_m"] < 1e-9
        assert known["heading_rmse_rad"] < 1e-9
        assert known["nees_mean"] < 1e-3
        if not explorer:
            # The others mark a visit 20 times a second, and miss a cell that was left sooner.
            assert known["visited_accuracy"] == 1.0

    @pytest.mark.parametrize("explorer", [(), REPORTS, WANDERS])
    def test_the_map_that_is_there(self, small: Path, explorer: tuple[str, ...]) -> None:
        _, known = explored(small, "mapper", *explorer)
        assert known["feature_precision"] == 1.0
        assert known["feature_recall_all"] == 1.0
        _, found = explored(small, "", *explorer)
        assert min(found["feature_precision"] or 0.0, found["feature_recall_all"]) < 1.0

    def test_a_drive_as_on_its_data_sheet(self, small: Path) -> None:
        """Wheels and encoders then say exactly where the robot is; not so with the drive's errors."""
        worst = []
        for oracle in ("", "drive"):
            trace = only(explored(small, oracle, *WANDERS)[0]).trace
            # A box that stops the body while the wheels spin on is no fault of the drive.
            free = trace["collisions"] == 0.0
            off = np.hypot(trace["est_x_m"] - trace["true_x_m"], trace["est_y_m"] - trace["true_y_m"])
            worst.append(off[free].max())
        assert worst[0] > 3e-3
        # A count of an encoder is 0.15 mm.
        assert worst[1] < 5e-4

    def test_sensors_without_faults(self, small: Path) -> None:
        """A gyroscope with a large scale error misleads the fused heading of the report's robot."""
        bad = (
            "robot.sensors.gyroscope.scale_error=0.2",
            "robot.sensors.gyroscope.rate_std_rad_s=0.05",
            "run.time_limit_s=60",
        )
        drive = explored(small, "drive", *REPORTS, *bad)[1]["heading_rmse_rad"]
        both = explored(small, "drive, sensors", *REPORTS, *bad)[1]["heading_rmse_rad"]
        assert both < 0.5 * drive

    @pytest.mark.parametrize("explorer", [(), REPORTS, WANDERS])
    def test_who_knows_covers_all_and_is_the_fastest(self, small: Path, explorer: tuple[str, ...]) -> None:
        run, knows = explored(small, "explorer", *explorer)
        assert knows["success"]
        assert knows["coverage_reachable"] == 1.0
        assert knows["position_rmse_m"] == 0.0
        assert knows["overhang_max_m"] < 1e-3
        assert only(run).results["left"] == ()
        if not explorer:
            assert knows["duration_s"] < 0.7 * explored(small, "")[1]["duration_s"]
        # A cell a step of its side at full speed, and no less.
        cells = knows["reachable_cells"]
        assert knows["duration_s"] > (cells - 1) * 0.1 / (3.0 * 0.035)

    def test_ground_that_no_way_leads_to_is_left(self, tmp_path: Path) -> None:
        sheet = tmp_path / "parted.yaml"
        sheet.write_text("size_m: [1.0, 0.5]\nstart_pose: [0.2, 0.25, 1]\ncells: [10, 5]\n"
                         "obstacles: [[0.5, 0.0, 0.55, 0.5]]\n")  # fmt: skip
        run, knows = explored(sheet, "explorer")
        assert knows["success"]
        assert 0.3 < knows["coverage_reachable"] < 0.7
        left = only(run).results["left"]
        assert isinstance(left, tuple)
        assert len(left) == knows["cells_left"] > 0

    def test_the_same_seed_has_the_same_robot(self, small: Path) -> None:
        """What an oracle replaces changes; the drive's errors and everybody's noise do not."""
        plain, _ = explored(small, "", *WANDERS)
        knows, _ = explored(small, "localizer", *WANDERS)
        again, _ = explored_now(small, "localizer", *WANDERS)
        # The wanderer drives by chance and one beam: where it goes does not depend on its pose at all.
        for name in ("true_x_m", "true_y_m", "true_theta_rad"):
            np.testing.assert_array_equal(only(plain).trace[name], only(knows).trace[name])
        for name, column in only(knows).trace.items():
            np.testing.assert_array_equal(column, only(again).trace[name])


# --- terrain -----------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def ground(tmp_path_factory: pytest.TempPathFactory) -> list[str]:
    """Ground of 60 x 40 pixels with a wall across it, a gap on top, and landmarks."""
    folder = tmp_path_factory.mktemp("ground")
    pixels = np.zeros((40, 60), np.uint8)
    pixels[3:, 30] = 255
    Image.fromarray(pixels).save(folder / "obstacles.png")
    return [
        "world.map.name=images",
        f"world.map.obstacles={folder / 'obstacles.png'}",
        "world.start.x_m=55",
        "world.start.y_m=45",
        "world.goal.x_m=545",
        "world.goal.y_m=45",
        # Two cells off the hazards, which stop it, and heading along the path.
        "stack.navigator.cost_map.inflation_m=15",
        "world.start.theta_rad=0.8",
        "world.landmarks=[{id: 7, x_m: 100, y_m: 200}, {id: 3, x_m: 400, y_m: 300}]",
    ]


def driven(
    mission: str, ground: list[str], oracle: str, *more: str, seed: int = 5
) -> tuple[FinishedRun, dict[str, Any]]:
    settings = [*ground, f"run.oracles=[{oracle}]", f"run.seed={seed}", *more]
    return simulated(load_mission(mission, settings))


CURVE = "gale-astar-ekf"


class TestTerrain:
    def test_the_true_pose(self, ground: list[str]) -> None:
        assert driven(CURVE, ground, "")[1]["position_rmse_m"] > 0.01
        run, knows = driven(CURVE, ground, "localizer")
        assert knows["position_rmse_m"] == 0.0
        assert knows["final_position_error_m"] == 0.0
        trace = only(run).trace
        np.testing.assert_array_equal(trace["est_theta_rad"], trace["true_theta_rad"])

    def test_silent_sensors_and_a_known_start_leave_no_error(self, ground: list[str]) -> None:
        """Watched, so that both drive the same way."""
        wrong = "robot.sensors.odometer.angle_scale=1.05"
        plain = driven(CURVE, ground, "driver, initial", wrong)[1]["position_rmse_m"]
        run, silent = driven(CURVE, ground, "driver, initial, sensors", wrong)
        # The mean of a pose whose heading is uncertain lies a millimetre beside the likeliest one.
        assert silent["position_rmse_m"] < 2e-3 < 0.1 * plain
        # The filter expects noise still: its covariance grows as it would.
        assert only(run).trace["cov_xx_m2"].max() > 1e-4

    def test_one_oracle_leaves_what_the_others_draw(self, ground: list[str]) -> None:
        plain, told, silent = (
            only(driven(CURVE, ground, oracle)[0]).trace
            for oracle in ("driver", "driver, initial", "driver, sensors")
        )
        for name in ("odom_distance_m", "odom_angle_rad", "beacons_seen", "true_x_m"):
            np.testing.assert_array_equal(plain[name], told[name])
        np.testing.assert_array_equal(plain["beacons_seen"], silent["beacons_seen"])
        assert not np.array_equal(plain["odom_distance_m"], silent["odom_distance_m"], equal_nan=True)
        initial = load_mission(CURVE, [*ground, "run.seed=5"])
        first = {
            name: build(
                initial.model_copy(
                    update={"run": initial.run.model_copy(update={"oracles": ("driver", *name.split())})}
                )
            )
            .team[0]
            .stack.belief.pose
            for name in ("", "sensors", "initial")
        }
        assert first[""] == first["sensors"] != first["initial"]

    def test_the_controller_follows_from_the_true_pose(self, ground: list[str]) -> None:
        """With an odometer that turns 5 % too far, who steers by the estimate leaves the path."""
        wrong = ("robot.sensors.odometer.angle_scale=1.05", "stack.localizer=dead-reckoning")
        off = []
        for oracle in ("initial", "initial, controller"):
            trace = only(driven(CURVE, ground, oracle, *wrong)[0]).trace
            ahead = np.isfinite(trace["ref_x_m"])
            dx = trace["true_x_m"][:, None] - trace["ref_x_m"][ahead]
            dy = trace["true_y_m"][:, None] - trace["ref_y_m"][ahead]
            off.append(np.hypot(dx, dy).min(axis=1).max())
        # References are 3.2 m apart.
        assert off[1] < 3.2
        assert off[0] > 2.0 * off[1], off

    def test_any_angle_is_no_longer(self, ground: list[str]) -> None:
        own = driven("gale-astar", ground, "")[1]
        knows = driven("gale-astar", ground, "planner")[1]
        assert knows["planned_length_m"] < 0.99 * own["planned_length_m"]
        # From either end over the wall's top, two straight lines: no any-angle path is shorter.
        top = 45.0 + 32 * 10.0
        assert knows["planned_length_m"] >= 2.0 * math.hypot(245.0, top - 45.0) * 0.99

    def test_a_rover_that_needs_an_oracle_says_so(self, ground: list[str]) -> None:
        with pytest.raises(InputError, match=r"stack\.localizer, or run\.oracles: \[localizer\]"):
            driven("gale-pose", [w for w in ground if "cost_map" not in w], "", "world.goal.theta_rad=0")


# --- what is offered ---------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("mission", "more", "offered"),
    [
        ("gale-pose", [], {"localizer"}),
        ("gale-astar", [], {"planner"}),
        ("gale-astar", ["stack.planner.name=theta-star"], set()),
        ("gale-astar", ["stack.navigator.cost_map.slope_that_doubles_deg=10"], set()),
        ("gale-ekf", [], {"sensors", "initial", "localizer", "driver"}),
        (CURVE, [], {"sensors", "initial", "localizer", "planner", "controller", "driver"}),
        ("romi-explore", [], {"sensors", "drive", "localizer", "mapper", "explorer"}),
        ("romi-baseline", [], {"sensors", "drive", "localizer", "mapper", "explorer"}),
        ("museum-plan", [], {"initial", "planner"}),
        ("museum-1", [], {"sensors", "initial", "localizer", "mapper", "planner", "controller", "driver"}),
    ],
)
def test_what_a_mission_offers(mission: str, more: list[str], offered: set[str]) -> None:
    assert set(applicable(load_mission(mission, more))) == offered


def test_an_attribution_keeps_the_oracles_that_the_mission_has() -> None:
    cells = {cell.name: cell.overrides for cell in attribution_study(CURVE, (), 2).cells}
    assert "driver" in str(cells["as it is"])
    assert "driver" in str(cells["oracle planner"])
    assert "planner" in str(cells["oracle planner"])
    with pytest.raises(InputError, match="modules that an oracle can replace"):
        attribution_study("gale-pose", (), 2)


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        (["run", "gale-astar", "--set", "run.oracles=[localizer]"], "expected one of planner in the mission"),
        (
            ["run", "romi-explore", "--set", "run.oracles=[planner]"],
            "expected one of sensors, localizer, mapper, drive, explorer",
        ),
        (
            ["run", "gale-astar", "--set", "stack.planner.name=theta-star", "--set", "run.oracles=[planner]"],
            "expected none",
        ),
        (["attribute", "gale-astar", "--set", "stack.planner.name=theta-star"], "that an oracle can replace"),
    ],
)
def test_others_are_refused_in_one_line(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    arguments: list[str],
    told: str,
) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(arguments) == 2
    answer = capsys.readouterr()
    assert answer.out == ""
    assert answer.err.count("\n") == 1
    assert told in answer.err
    assert list(tmp_path.iterdir()) == []
