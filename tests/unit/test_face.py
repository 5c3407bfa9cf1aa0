"""The public face: its lines run as they are written; mypy, strict on this file too, sees its types."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import assert_type

import numpy as np
import pytest

import pilotage as pl
from pilotage.core.types import FloatArray
from pilotage.experiments.loop import simulate
from pilotage.experiments.progress import Progress
from pilotage.face.progress import showing_progress
from pilotage.maps.occupancy_grid import OccupancyGrid
from pilotage.maps.ros_map import RosMap, write_ros_map
from pilotage.sensors.readings import LidarScan, OdometryIncrement

SHORT = {"run.time_limit_s": 3.0}


@pytest.fixture(scope="module")
def night(tmp_path_factory: pytest.TempPathFactory) -> pl.Run:
    """One run of the museum's first mission."""
    mission = pl.load("museum-1", seed=7, set={"stack.localizer.gate": 0.99})
    return pl.run(mission, out=tmp_path_factory.mktemp("runs"))


def small_map(folder: Path) -> str:
    cells = np.zeros((40, 60), dtype=bool)
    cells[:, 0] = cells[:, -1] = cells[0] = cells[-1] = True
    cells[12:, 30] = True
    path = folder / "map.yaml"
    write_ros_map(path, RosMap.of(OccupancyGrid.of(cells, 0.1), "map.pgm"))
    return str(path)


def test_everything_public_is_there_and_documented() -> None:
    assert sorted(pl.__all__) == pl.__all__
    assert set(pl.__all__) <= set(dir(pl))
    for name in pl.__all__:
        assert (getattr(pl, name).__doc__ or "").strip(), name
    with pytest.raises(AttributeError, match="no attribute 'lod'"):
        _ = pl.lod  # type: ignore[attr-defined]


def test_importing_loads_nothing() -> None:
    code = (
        "import sys, pilotage; heavy = {'numpy', 'numba', 'scipy', 'pydantic', 'matplotlib', 'pyarrow'};"
        "print(sorted(heavy & set(sys.modules)))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


def test_a_mission_comes_from_a_name_a_file_or_a_mapping(tmp_path: Path) -> None:
    mission = pl.load("museum-1", seed=7, set={"stack.localizer.gate": 0.99})
    assert_type(mission, pl.Mission)
    assert mission.run.seed == 7
    assert mission.stack.localizer is not None
    assert mission.stack.localizer.parameters["gate"] == 0.99
    file = tmp_path / "own.yaml"
    file.write_text("extends: museum-1\nmission: own\nrun: {seed: 7}\nstack: {localizer: {gate: 0.99}}\n")
    values = {"extends": "museum-1", "mission": "own", "run": {"seed": np.int64(7)}}
    from_values = pl.load(values, set={"stack.localizer.gate": np.float64(0.99)})
    for other in (pl.load(file), pl.load(str(file)), from_values):
        assert other.description == "extends museum-1"
        named = {"mission": "museum-1", "description": mission.description}
        assert other.model_copy(update=named) == mission
    assert pl.load(mission) == pl.load(pl.load(mission))
    assert pl.load(mission, seed=8).run.seed == 8
    assert values["run"] == {"seed": 7}, "the caller's mapping stays as it was"


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"stack.localizer.gat": 0.9}, "gat"),
        ({"stak.localizer": 1}, "did you mean 'stack'"),
        ({"": 1}, "expected keys such as"),
        ({"run.seed": "seven"}, "seed"),
        ({"stack.localizer.gate": 2.0}, "gate"),
        ([("a", 1)], "expected a mapping"),
    ],
)
def test_wrong_settings_are_told_in_one_line(settings: dict[str, object], message: str) -> None:
    with pytest.raises(pl.InputError, match=message) as caught:
        pl.load("museum-1", set=settings)
    assert "\n" not in str(caught.value)


def test_what_is_no_mission_is_told_in_one_line() -> None:
    for wrong, message in ((3, "found a int"), ("nowhere.yaml", "none there"), ("musem-1", "museum-1")):
        with pytest.raises(pl.InputError, match=message):
            pl.load(wrong)  # type: ignore[arg-type]
    with pytest.raises(pl.InputError, match="whole number"):
        pl.load("museum-1", seed="7")  # type: ignore[arg-type]


def test_a_run_tells_what_came_out(night: pl.Run) -> None:
    assert night.success
    assert night.reason == "arrived"
    assert_type(night.metrics["position_rmse_m"], float)
    assert 0.0 < night.metrics["position_rmse_m"] < 0.05
    assert night.metrics["final_error.x_m"] is not None
    assert night.metrics.as_dict()["mission"] == "museum-1"
    table = night.metrics.table()
    row = next(row for row in table if row["metric"] == "position_rmse_m")
    assert row["unit"] == "m"
    assert row["meaning"]
    assert "position_rmse_m" in str(table)
    assert table._repr_html_().startswith("<table>")
    assert "position_rms" not in night.metrics
    with pytest.raises(pl.InputError, match="did you mean 'position_rmse_m'"):
        _ = night.metrics["position_rms_m"]
    with pytest.raises(KeyError):
        _ = night.metrics["nothing"]
    assert [event.kind for event in night.events].count("replan") > 0


def test_a_trace_is_columns_by_name(night: pl.Run) -> None:
    trace = night.trace
    assert_type(trace["t_s"], FloatArray)
    error = np.hypot(trace["true_x_m"] - trace["est_x_m"], trace["true_y_m"] - trace["est_y_m"])
    settled = trace["t_s"] > 1.0
    assert float(np.sqrt(np.mean(error[settled] ** 2))) == pytest.approx(night.metrics["position_rmse_m"])
    assert trace.to_arrow().column_names == list(trace)
    assert trace.rows == trace.to_arrow().num_rows
    with pytest.raises(pl.InputError, match="true_x_m"):
        _ = trace["true_x"]
    with pytest.raises(pl.InputError, match="expected a number from 0 to 0"):
        trace.of(1)


def test_a_trace_becomes_a_data_frame(night: pl.Run) -> None:
    try:
        import pandas  # type: ignore[import-untyped,unused-ignore]  # noqa: F401
    except ImportError:
        with pytest.raises(pl.InputError, match="pip install pandas"):
            night.trace.to_pandas()
        return
    assert list(night.trace.to_pandas().columns) == list(night.trace)


def test_a_run_is_reported_and_opened_again(night: pl.Run, tmp_path: Path) -> None:
    page = night.report(tmp_path / "pages" / "night.html")
    assert page.read_text().startswith("<!")
    assert (night.folder / "report.html").is_file()
    again = pl.open_run(night.folder)
    assert again == night
    assert again.metrics == night.metrics or str(again.metrics) == str(night.metrics)
    np.testing.assert_array_equal(again.trace["est_x_m"], night.trace["est_x_m"])
    assert again.mission.run.seed == 7
    shown = night._repr_html_()
    assert "<svg" in shown
    assert "museum-1" in shown
    with pytest.raises(pl.InputError, match="expected a run's folder, found nothing"):
        pl.open_run(tmp_path / "nothing")
    with pytest.raises(pl.InputError, match="expected a file to write"):
        night.report(tmp_path)


def test_a_run_from_its_own_mission_is_the_same_run(night: pl.Run) -> None:
    again = pl.run(night.mission, save=False)
    for name in ("true_x_m", "est_x_m", "est_theta_rad"):
        np.testing.assert_array_equal(again.trace[name], night.trace[name])


def test_stepping_by_hand_gives_what_a_run_meets() -> None:
    mission = pl.load("museum-route", seed=4, set={"run.time_limit_s": 2.0})
    robot = simulate(mission).finished.robots[0]
    sim = pl.make(mission)
    readings = sim.reset()
    rows = [sim.truth]
    for v, w in list(zip(robot.trace["v_cmd_m_s"], robot.trace["w_cmd_rad_s"], strict=True))[:-1]:
        readings = sim.step(pl.Twist(float(v), float(w)))
        rows.append(sim.truth)
    assert_type(readings.t_s, float)
    assert sim.t_s == pytest.approx(2.0)
    np.testing.assert_array_equal([pose.x_m for pose in rows], robot.trace["true_x_m"])
    odometry = readings.by_sensor["odometry"]
    assert isinstance(odometry, OdometryIncrement)
    assert odometry.distance_m == robot.trace["odom_distance_m"][-1]


def test_stepping_begins_anew_by_its_seed() -> None:
    sim = pl.make("museum-1", seed=7)

    def drive(seed: int | None = None) -> FloatArray:
        readings = sim.reset(seed)
        for _ in range(5):
            readings = sim.step(pl.Twist(0.5, 0.1))
        scan = readings.by_sensor["lidar"]
        assert isinstance(scan, LidarScan)
        return scan.ranges_m

    first = drive()
    np.testing.assert_array_equal(drive(), first)
    assert (drive(8) != first).any()
    np.testing.assert_array_equal(drive(7), first)
    assert sim.collisions == [0]


def test_several_robots_take_and_give_lists() -> None:
    own = {
        "extends": "museum-route",
        "mission": "two",
        "robots": [{"name": "a"}, {"name": "b", "start": {"x_m": 3.0, "y_m": 1.0, "theta_rad": 0.0}}],
    }
    sim = pl.make(own)
    assert len(sim.reset_all()) == 2
    readings = sim.step([pl.Twist(0.5, 0.0), pl.Twist(0.0, 0.5)])
    assert [entry.t_s for entry in readings] == [sim.t_s] * 2
    assert [type(pose) for pose in sim.poses] == [pl.Pose2, pl.Pose2]
    assert sim.truth == sim.poses  # type: ignore[comparison-overlap]
    assert sim.names == ["a", "b"]
    with pytest.raises(pl.InputError, match="a list of 2 commands"):
        sim.step(pl.Twist(0.5, 0.0))


def test_wrong_steps_are_told_in_one_line() -> None:
    sim = pl.make("museum-route")
    with pytest.raises(pl.InputError, match=r"expected reset\(\)"):
        sim.step(pl.Twist(0.5, 0.0))
    sim.reset()
    for wrong, message in (
        ((0.5, 0.1), "found a list of 2"),
        ("go", "found str"),
        ([0.5], "expected Twist or WheelSpeeds"),
        (pl.Twist(float("nan"), 0.0), "expected a finite number, found nan"),
    ):
        with pytest.raises(pl.InputError, match=message):
            sim.step(wrong)  # type: ignore[arg-type]


@pytest.mark.parametrize("planner", [None, "theta-star"])
def test_a_path_on_a_map_of_cells(tmp_path: Path, planner: str | None) -> None:
    start, goal = (1.0, 1.0), (5.0, 1.0)
    path = pl.plan(small_map(tmp_path), start, goal, planner=planner).path
    assert_type(path, FloatArray)
    assert path.shape[1] == 2
    kept = pl.plan(small_map(tmp_path), start, goal, clearance_m=0.4)
    assert kept.success
    assert kept.length_m > pl.plan(small_map(tmp_path), start, goal).length_m


def test_a_path_on_a_map_of_walls() -> None:
    found = pl.plan("museum", pl.Pose2(1.0, 1.0, 0.0), np.array([9.0, 3.0]), clearance_m=0.35, seed=3)
    assert found.success
    assert found.answer["clearance_m"] == 0.35
    assert found.shortest_length_m <= found.length_m * 1.0001
    assert "planned_length_m" in found._repr_html_()


@pytest.mark.parametrize(
    ("start", "options", "message"),
    [
        ((1.0,), {}, "start: expected x, y"),
        ("ab", {}, "start: expected x, y"),
        ((1.0, float("nan")), {}, "start: expected x, y"),
        ((-50.0, 0.0), {}, "expected a place on the map"),
        ((1.0, 1.0), {"planner": "astr"}, "did you mean 'astar'"),
        ((1.0, 1.0), {"clearance_m": -1.0}, "clearance_m: expected"),
        ((1.0, 1.0), {"set": "stop=first"}, "expected a mapping"),
        ((1.0, 1.0), {"set": {"stop": "never"}}, "stop"),
    ],
)
def test_wrong_queries_are_told_in_one_line(
    start: Sequence[float], options: dict[str, object], message: str
) -> None:
    with pytest.raises(pl.InputError, match=message) as caught:
        pl.plan("museum", start, (9.0, 3.0), **options)  # type: ignore[arg-type]
    assert "\n" not in str(caught.value)


@pytest.mark.slow
def test_a_study_is_a_table(tmp_path: Path) -> None:
    mission = pl.load("museum-route", set={"run.time_limit_s": 3.0})
    asked = {"stack.localizer.gate": [0.9, 0.99]}
    found = pl.study(mission, asked, trials=2, workers=2, metrics=["position_rmse_m"], out=tmp_path)
    table = found.table()
    assert table["stack.localizer.gate"] == [0.9, 0.99]
    assert table["trials"] == [2, 2]
    assert all(low <= mean <= high for _, _, _, mean, low, high in table.rows)
    assert found.answer["failed"] == 0
    again = pl.study(mission, asked, trials=2, workers=2, metrics=["position_rmse_m"], out=tmp_path)
    assert again.folder == found.folder
    assert str(again.table()) == str(table)
    with pytest.raises(pl.InputError, match="expected metrics among"):
        found.table("nothing")


def test_wrong_studies_are_told_in_one_line(tmp_path: Path) -> None:
    for vary, message in (
        ({}, "expected a mapping"),
        ({"stack.localizer.gate": 0.9}, "expected a list"),
        ({"stack.localizer.gat": [0.9]}, "gat"),
        ({"stack.localizer.gate": [0.9, 0.9]}, "0.9"),
    ):
        with pytest.raises(pl.InputError, match=message):
            pl.study("museum-route", vary, trials=1, out=tmp_path)  # type: ignore[arg-type]
    assert not list(tmp_path.iterdir())


def test_trajectories_are_judged_as_files_and_as_arrays(tmp_path: Path) -> None:
    t = np.arange(30) * 0.1
    truth = np.column_stack([t, np.cos(t), np.sin(t), t])
    estimate = truth + np.array([0.0, 0.03, 0.04, 0.0])
    for name, poses in (("truth.tum", truth), ("estimate.tum", estimate)):
        rows = [
            f"{s:.6f} {x:.9f} {y:.9f} 0 0 0 {np.sin(a / 2):.12f} {np.cos(a / 2):.12f}" for s, x, y, a in poses
        ]
        (tmp_path / name).write_text("\n".join(rows) + "\n")
    found = pl.evaluate(estimate, truth)
    assert found["ate_rmse_m"] == pytest.approx(0.05)
    by_file = pl.evaluate(tmp_path / "estimate.tum", tmp_path / "truth.tum")
    assert by_file["ate_rmse_m"] == pytest.approx(0.05, abs=1e-6)
    assert pl.evaluate(estimate, truth, align=True)["ate_rmse_m"] == pytest.approx(0.0, abs=1e-9)
    with pytest.raises(pl.InputError, match="two files or two arrays"):
        pl.evaluate(estimate, tmp_path / "truth.tum")
    with pytest.raises(pl.InputError, match="expected finite poses"):
        pl.evaluate(estimate[:, :2], truth)


def test_recordings_that_are_none_are_told_in_one_line(tmp_path: Path) -> None:
    with pytest.raises(pl.InputError, match="unknown format"):
        pl.localize(tmp_path, format="mrclan")  # type: ignore[arg-type]
    with pytest.raises(pl.InputError, match="expected"):
        pl.localize(tmp_path, format="mrclam", robot=1)
    with pytest.raises(pl.InputError, match="unknown calibration"):
        pl.calibrate("odometer")  # type: ignore[arg-type]
    with pytest.raises(pl.InputError, match="expected"):
        pl.calibrate("heading")
    with pytest.raises(pl.InputError, match="expected"):
        pl.slam(tmp_path / "nothing.bag")
    with pytest.raises(pl.InputError):
        pl.track(tmp_path / "nothing.mp4")


def test_calibration_from_readings(tmp_path: Path) -> None:
    values = np.random.default_rng(3).normal(2.0, 0.01, 400)
    file = tmp_path / "front.csv"
    file.write_text("range_m\n" + "\n".join(f"{value:.6f}" for value in values) + "\n")
    found = pl.calibrate("range", [file], out=tmp_path / "runs")
    estimate = found["front_range_var_m2"]
    assert estimate["low"] < 1e-4 < estimate["high"]
    with pytest.raises(pl.InputError, match="unknown estimate"):
        _ = found["front_range_var"]


class TestFiltersOnArrays:
    """Filters without a mission."""

    landmarks = np.array([[4.0, 0.0], [0.0, 3.0], [-2.0, -2.0]])

    def seen_from(self, pose: FloatArray) -> tuple[FloatArray, FloatArray]:
        offset = self.landmarks - pose[:2]
        bearings = np.arctan2(offset[:, 1], offset[:, 0]) - pose[2]
        return np.hypot(*offset.T), np.arctan2(np.sin(bearings), np.cos(bearings))

    @pytest.mark.parametrize(
        "kind", [pl.filters.EkfLandmarks, pl.filters.IekfLandmarks, pl.filters.UkfLandmarks]
    )
    def test_they_find_the_pose_and_stay_values(self, kind: type[pl.filters.EkfLandmarks]) -> None:
        start = kind(landmarks=self.landmarks, pose=(0.1, -0.1, 0.05))
        truth, filtered = np.array([0.0, 0.0, 0.0]), start
        for _ in range(20):
            heading = truth[2] + 0.01
            truth = truth + np.array([0.1 * np.cos(heading), 0.1 * np.sin(heading), 0.02])
            filtered = filtered.predict(0.1, 0.02).update([0, 1, 2], *self.seen_from(truth))
        assert filtered.accepted.all()
        assert (filtered.nis < 10.0).all()
        np.testing.assert_allclose(filtered.mean.as_array(), truth, atol=0.02)
        assert start.mean == pl.Pose2(0.1, -0.1, 0.05)
        assert (filtered.std < start.std).all()

    def test_the_gate_keeps_out_what_cannot_be(self) -> None:
        start = pl.filters.EkfLandmarks(landmarks=self.landmarks)
        after = start.update([0, 7], [9.0, 1.0], [0.0, 0.0])
        assert after.accepted.tolist() == [False, False]
        assert after.mean == start.mean
        assert pl.filters.EkfLandmarks(landmarks=self.landmarks, gate=1.0).update(0, 9.0, 0.0).accepted.all()

    @pytest.mark.parametrize(
        ("options", "message"),
        [
            ({"landmarks": [1.0, 2.0]}, "landmarks: expected"),
            ({"landmarks": [[0.5, 1.0, 2.0]]}, "whole numbers"),
            ({"pose": (0.0, 1.0)}, "pose: expected numbers of shape"),
            ({"pose": (0.0, np.nan, 0.0)}, "finite"),
            ({"cov": -np.eye(3)}, "symmetric positive"),
            ({"gate": 0.0}, "gate"),
            ({"range_var_m2": 0.0}, "range_var_m2"),
            ({"angle_var_rad2_per_m": -1.0}, "angle_var_rad2_per_m"),
        ],
    )
    def test_wrong_arrays_are_told_in_one_line(self, options: dict[str, object], message: str) -> None:
        with pytest.raises(pl.InputError, match=message):
            pl.filters.EkfLandmarks(**{"landmarks": self.landmarks, **options})  # type: ignore[arg-type]

    def test_wrong_measurements_are_told_in_one_line(self) -> None:
        start = pl.filters.EkfLandmarks(landmarks=self.landmarks)
        with pytest.raises(pl.InputError, match="ranges_m: expected numbers of shape"):
            start.update([0, 1], [1.0], [0.0, 0.0])
        with pytest.raises(pl.InputError, match="finite"):
            start.predict(np.inf, 0.0)


def test_lines_and_planners_take_arrays() -> None:
    angles = np.radians(np.linspace(-45.0, 45.0, 181))
    found = pl.lines.extract(2.0 / np.cos(angles), field_of_view_rad=np.pi / 2)
    assert found.rho_alpha[0] == pytest.approx([2.0, 0.0], abs=1e-6)
    with pytest.raises(pl.InputError, match="ranges_m"):
        pl.lines.extract([[1.0]])
    with pytest.raises(pl.InputError, match="cutof"):
        pl.lines.extract(np.ones(10), set={"cutof_m": 1.0})
    with pytest.raises(pl.InputError, match="goal: expected a place"):
        pl.planners.on_walls([[0, 0, 4, 0], [4, 0, 4, 4]], (1, 1), (9, 9))
    with pytest.raises(pl.InputError, match="start: expected a row"):
        pl.planners.on_cells(np.zeros((3, 3), dtype=bool), (5, 5), (0, 0))


class FakeNotebook:
    """What IPython offers in a notebook, as far as it is used."""

    def __init__(self) -> None:
        self.shown: list[dict[str, str]] = []
        self.kernel = object()

    def get_ipython(self) -> FakeNotebook:
        return self

    def display(self, shown: dict[str, str], **options: object) -> FakeNotebook:
        assert options == {"raw": True, "display_id": True}
        self.shown.append(shown)
        return self

    def update(self, shown: dict[str, str], **options: object) -> None:
        assert options == {"raw": True}
        self.shown.append(shown)


def test_a_notebook_shows_a_bar_that_goes_away(monkeypatch: pytest.MonkeyPatch) -> None:
    notebook = FakeNotebook()
    monkeypatch.setitem(sys.modules, "IPython", notebook)
    monkeypatch.setitem(sys.modules, "IPython.display", notebook)
    with showing_progress(None, 60.0) as show:
        assert show is not None
        for t_s in (1.0, 2.0):
            show(Progress(t_s, (("error", "<3 mm"),)))
    bars = [entry["text/html"] for entry in notebook.shown]
    assert ['value="1"' in bars[0], 'value="2"' in bars[1], bars[2]] == [True, True, ""]
    assert "&lt;3 mm" in bars[0]


def test_a_log_is_left_alone(capsys: pytest.CaptureFixture[str]) -> None:
    for wanted in (None, False):
        with showing_progress(wanted, 60.0) as show:
            assert show is None
    with showing_progress(True, 60.0) as show:
        assert show is not None
    assert capsys.readouterr().err == ""
