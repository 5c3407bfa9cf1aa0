"""What a report is made of: words for numbers, thinned series, bands, ellipses, labels, the map's view."""

from __future__ import annotations

import io
import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from matplotlib.axes import Axes
from matplotlib.axis import Axis, YAxis
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from rich.console import Console
from scipy.stats import chi2

from pilotage.core.types import FloatArray
from pilotage.experiments.mission import mission_of
from pilotage.experiments.run import run_mission
from pilotage.missions.team import LARGEST_TEAM
from pilotage.records.people import PeopleTracks
from pilotage.records.run_data import read_run
from pilotage.report import quantities, style, summary_table
from pilotage.report.calibration.plots import MOST_BINS, histogram, panels_in_a_row
from pilotage.report.event_kinds import event_kind
from pilotage.report.figures.close_ups import close_ups_figure
from pilotage.report.figures.consistency import _statistic, chi_square_band
from pilotage.report.figures.covariance import covariance_figure
from pilotage.report.figures.layers import ellipse_outlines
from pilotage.report.figures.map import map_figure
from pilotage.report.figures.map_view import map_axes, view_limits
from pilotage.report.figures.placing import MOST_PLACES, LabelPlacer, along
from pilotage.report.headline import headline
from pilotage.report.light_axes import LightAxes
from pilotage.report.markup import Html, escape, page, table
from pilotage.report.replay.floor import floor_scene
from pilotage.report.series import band, decimate, merge_spans, running_mean, spans
from pilotage.report.team import colour_of, team_section
from support.browser import Browser
from support.component_missions import short
from support.fabricated_run import fabricate_metrics, fabricate_run, fabricate_world
from support.missions import drive
from support.pages import page_of


def _printed(metrics: dict[str, Any], width: int = 100) -> str:
    console = Console(width=width, record=True, file=io.StringIO())
    console.print(summary_table(metrics))
    return console.export_text()


def test_summary_table() -> None:
    text = _printed(fabricate_metrics(600))
    for part in ("two-rooms", "seed 3", "success", "5.60\u00a0mm", "0.120°", "1.017", "2.70 to 3.20"):
        assert part in text
    failed = _printed({"success": False, "reason": "stuck [bold]here[/bold]", "position_rmse_m": math.nan})
    assert "failed: stuck [bold]here[/bold]" in failed
    assert "nan" not in failed
    assert "outcome not said" in _printed({})
    assert "…" not in _printed(fabricate_metrics(600), width=70), "a number that is cut is another one"


def test_a_guard_alone_tells_of_the_intruder_as_a_team_does() -> None:
    told = {"success": True, "reason": "over", "detected": True, "detection_time_s": 4.0}
    assert "the intruder was detected 4.0" in headline(told).replace("\u00a0", " ")
    assert "the intruder was not detected" in headline({**told, "detected": False})


def test_each_robot_of_the_largest_team_has_a_colour_of_its_own() -> None:
    """Robots 12 to 15 had those of 0 to 3: nobody could say who was where."""
    assert len({colour_of(robot) for robot in range(LARGEST_TEAM)}) == LARGEST_TEAM


def test_the_headline_tells_what_the_mission_was_about() -> None:
    found = headline({"success": True, "lost_s": 5.1, "found_after_s": 5.2}).replace("\u00a0", " ")
    assert found == "Done; lost for 5.10 s and found itself."
    done = headline({"success": True, "reason": "done: 442 cells visited", "collisions": 0})
    assert done == "Done without a collision: 442 cells visited."
    gone = headline({"success": False, "reason": "time is up", "lost_s": 60.0}).replace("\u00a0", " ")
    assert gone == "Failed: time is up; lost for 60.0 s and did not find itself."
    mapped = headline({"success": True, "floor_mapped": 0.99, "wall_rms_m": 0.025}).replace("\u00a0", " ")
    assert mapped == "Done; 99.0 % of the reachable floor mapped, its walls 25.0 mm off (RMS)."
    swept = headline({"success": False, "reason": "time is up", "swept_fraction": 0.076})
    assert swept.replace("\u00a0", " ") == "Failed: time is up; 7.6 % of the floor swept."
    missed = {"success": False, "reason": "the robot stands 312.36 m from its goal", "goal_error_m": 312.36}
    assert headline(missed).count("312.36") == 1
    team = {"success": True, "robots": {"a": {"success": True}, "b": {"success": True}}}
    assert "intruder" not in headline(team)
    seen = headline(team | {"detected": True, "detection_time_s": 18.1}).replace("\u00a0", " ")
    assert seen == "All 2 robots succeeded; the intruder was detected 18.1 s after he came in."
    assert "the intruder was not detected" in headline(team | {"detected": False})


def test_text_on_a_page_turns_no_direction_and_breaks_where_it_is_too_long() -> None:
    assert escape("a<b\u202egnp\x1b[0m\tc\u200cd") == "a&lt;b\ufffdgnp\ufffd[0m\tc\u200cd"
    made = table(
        (("name", "row"), ("value", "")), [("<" * 90 + " " + "b" * 40, Html("<i>" + "c" * 90 + "</i>"))]
    )
    assert f"{'&lt;' * 40}<wbr>{'&lt;' * 40}<wbr>{'&lt;' * 10} {'b' * 40}</th>" in made
    assert f"<i>{'c' * 90}</i>" in made


def test_text_in_a_figure_turns_no_direction_either() -> None:
    """A study's factors are named by whoever wrote its file."""
    figure = Figure(figsize=(2.0, 1.0))
    figure.text(0.1, 0.1, "a\u202egnp\x1b[0m")
    with style.drawing_style():
        drawn = style.render(figure, "x", "what \u202eis\x1b there")
    assert "a\ufffdgnp\ufffd[0m" in drawn
    assert "what \ufffdis\ufffd there" in drawn


def test_quantities_are_humane() -> None:
    assert quantities.length(0.00512) == "5.12\u00a0mm"
    assert quantities.length(2.6e-7) == "<0.001\u00a0mm"
    assert quantities.measured(1.46e-6, "") == "1.46 × 10⁻⁶"
    assert quantities.length(66.3) == "66.30\u00a0m"
    assert quantities.angle(math.pi / 180.0) == "1.00°"
    assert quantities.duration(0.0123) == "12.3\u00a0ms"
    assert quantities.duration(119.99) == "120.0\u00a0s"
    assert quantities.duration(135.4) == "2\u00a0min 15\u00a0s"
    assert quantities.duration(-594.5) == "−9\u00a0min 54\u00a0s"
    assert quantities.share(-0.0004) == "0.0\u00a0%"
    assert quantities.share(0.5) == "50.0\u00a0%"
    assert quantities.significant(0.99996) == "1.00"
    assert quantities.duration(9960.0) == "2\u00a0h 46\u00a0min"
    assert quantities.moment(332.0) == "332.0\u00a0s"
    assert quantities.moment(761640.0) == "8.815\u00a0days"
    for write in (quantities.length, quantities.angle, quantities.duration, quantities.count):
        assert write(math.nan) == quantities.NOTHING


@given(
    values=arrays(np.float64, st.integers(1, 400), elements=st.floats(-1e6, 1e6) | st.just(math.nan)),
    buckets=st.integers(1, 50),
)
def test_decimation_keeps_the_extremes_in_order(values: FloatArray, buckets: int) -> None:
    t_s = np.arange(len(values), dtype=np.float64)
    times, kept = decimate(t_s, values, buckets)
    assert len(kept) <= max(2 * buckets + 2, 2)
    assert bool((np.diff(times) > 0.0).all())
    assert times[0] == t_s[0]
    assert times[-1] == t_s[-1]
    np.testing.assert_array_equal(kept, values[times.astype(int)])
    if bool(np.isfinite(values).any()):
        assert np.nanmax(kept) == np.nanmax(values)
        assert np.nanmin(kept) == np.nanmin(values)


@given(values=arrays(np.float64, st.integers(1, 300), elements=st.floats(0.0, 1e6) | st.just(math.nan)))
def test_bands_never_shrink(values: FloatArray) -> None:
    times, widths = band(np.arange(len(values), dtype=np.float64), values, 20)
    assert len(times) == len(widths)
    if bool(np.isfinite(values).any()):
        assert np.nanmax(widths) == np.nanmax(values)


def test_spans_and_running_mean() -> None:
    t_s = np.arange(6.0)
    stretches = spans(t_s, np.array([True, False, True, True, False, True]))
    np.testing.assert_allclose(stretches, [[0, 1], [2, 4], [5, 6]])
    np.testing.assert_allclose(merge_spans(stretches, 1.5), [[0, 6]])
    assert spans(t_s, np.zeros(6, dtype=np.bool_)).shape == (0, 2)
    mean = running_mean(np.array([1.0, np.nan, 3.0, 5.0]), 2)
    np.testing.assert_allclose(mean, [1.0, 1.0, 3.0, 4.0])


def test_chi_square_band_holds_its_probability() -> None:
    for dof in (1.0, 3.0, 8.0):
        low, high = chi_square_band(dof, 0.95)
        assert chi2.cdf(high, dof) - chi2.cdf(low, dof) == pytest.approx(0.95)
        assert chi2.cdf(low, dof) == pytest.approx(0.025)


def test_ellipse_holds_its_probability(tmp_path: Path) -> None:
    run = read_run(fabricate_run(tmp_path / "run", steps=5))
    (outline,) = ellipse_outlines(run, [4])
    trace = run.trace
    centre = np.array([trace["est_x_m"][4], trace["est_y_m"][4]])
    xx, xy, yy = (float(trace[name][4]) for name in ("cov_xx_m2", "cov_xy_m2", "cov_yy_m2"))
    inverse = np.linalg.inv(np.array([[xx, xy], [xy, yy]]))
    away = np.asarray(outline.vertices)[:-1] - centre
    squared = np.einsum("ni,ij,nj->n", away, inverse, away)
    np.testing.assert_allclose(squared, chi2.ppf(0.95, 2), rtol=1e-6)


def test_labels_keep_off_lines_and_each_other() -> None:
    line = along(np.array([[0.0, 50.0], [100.0, 50.0]]), 2.0, 1.0)
    placer = LabelPlacer(line, (0.0, 0.0, 100.0, 100.0))
    places = [placer.place(50.0, 50.0, 6.0, 6.0, np.array([5.0, 12.0, 25.0])) for _ in range(4)]
    for i, (x, y) in enumerate(places):
        assert abs(y - 50.0) > 6.0
        for other_x, other_y in places[:i]:
            assert max(abs(x - other_x), abs(y - other_y)) > 6.0


def test_map_shows_the_whole_floor_or_the_part_that_matters(tmp_path: Path) -> None:
    whole = view_limits(read_run(fabricate_run(tmp_path / "whole", steps=50)))
    assert whole is not None
    assert whole[0] < 0.0
    assert whole[2] > 12.0
    floor = fabricate_world() | {
        "bounds_m": [-60, -60, 60, 60],
        "segments_m": [[-60, -60, 60, -60], [60, -60, 60, 60]],
    }
    run = fabricate_run(tmp_path / "part", steps=50, world=floor)
    part = view_limits(read_run(run))
    assert part is not None
    assert part[0] > -20.0
    assert part[3] < 30.0
    assert "Only the part of the floor around the run is shown." in page_of(run)


@pytest.mark.parametrize("radius_m", [1e-9, 1e-99])
def test_a_body_too_small_for_axes_has_a_page(radius_m: float, tmp_path: Path) -> None:
    """The map was zoomed in to ten of its radii: walls had 8e10 places, or it no size."""
    values = short(drive(), 1)
    values["robot"]["footprint"]["radius_m"] = radius_m
    run_dir = run_mission(mission_of(values), out=tmp_path).run_dir
    assert run_dir is not None
    assert "<svg" in page_of(run_dir)


def test_a_line_that_leaves_the_picture_far_behind_has_no_places_without_end() -> None:
    places = along(np.array([[0.0, 0.0], [1e3, 0.0]]), 1e-9, 1.5)
    assert len(places) <= MOST_PLACES + 1
    assert places[-1, 0] == 1e3


def test_a_recording_without_a_truth_is_shown_where_it_believed_to_be(tmp_path: Path) -> None:
    """A map showed two metres around the start of a drive through a whole building."""
    columns: dict[str, Any] = dict.fromkeys(("true_x_m", "true_y_m", "true_theta_rad", "nees"))
    localized = np.ones(200)
    localized[150:] = 0.0
    x_m = np.where(localized > 0.0, np.linspace(1.0, 19.0, 200), 1e4)
    told = {**columns, "est_x_m": x_m, "localized": localized}
    run = read_run(fabricate_run(tmp_path / "run", steps=200, plans=None, columns=told))
    limits = view_limits(run)
    assert limits is not None
    assert limits[0] < 1.0
    assert x_m[:150].max() < limits[2] < 100.0
    scene = floor_scene(run)
    assert scene is not None
    assert scene.series[0].title == "95 % half axis of position"


@pytest.mark.parametrize(
    "limits",
    [
        (0.0, 0.0, 30.0, 25.0),
        (-10.0, -10.4, 10.0, 10.4),
        (-3.0, -11.0, 9.0, -8.4),
        (-9000.0, -12500.0, 9000.0, -500.0),
        (499000.0, 4649000.0, 499800.0, 4649900.0),
    ],
)
def test_numbers_and_label_of_the_maps_axis_lie_in_the_figure(
    limits: tuple[float, float, float, float],
) -> None:
    """Numbers such as -10.0 pushed the label half out of it."""
    with style.drawing_style():
        figure, axes, _ = map_axes(limits)
        canvas: Any = FigureCanvasAgg(figure)
        canvas.draw()
        seen = axes.yaxis.get_tightbbox(canvas.get_renderer())
    assert seen is not None
    assert 0.0 <= seen.x0 <= 12.0


def test_values_nearly_all_of_which_are_equal_make_a_histogram_of_few_bars() -> None:
    values = np.zeros(100_000)
    values[:3], values[-20_000:] = 1e3, 1e-9
    _, (axes,) = panels_in_a_row(["a"], ["b"])
    histogram(axes, values)
    assert 1 <= len(axes.patches) <= MOST_BINS


def test_what_happens_every_few_metres_is_not_marked_on_the_map() -> None:
    assert not event_kind("closure").on_map
    assert all(event_kind(kind).on_map for kind in ("close", "stall", "explored", "of-a-plugin"))


@pytest.mark.parametrize(("most", "looks"), [(1.5, False), (0.02, False), (3e7, True), (2e-7, True)])
def test_titles_are_placed_without_laying_out_numbers_where_none_is_in_their_way(
    most: float, looks: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A power of ten above an axis is: there matplotlib looks, as ever. The figure is the same."""

    def drawn() -> str:
        with style.drawing_style():
            figure, (panel,) = style.stacked_axes(["what it is [m]"], [60.0])
            panel.set_ylim(0.0, most)
            style.time_limits([panel], np.arange(5.0))
            style.series(panel, np.arange(5.0), most * np.linspace(0.1, 0.9, 5), style.BLUE)
            return style.render(figure, "it", "it")

    laid_out: list[str] = []
    bounds = YAxis.get_tightbbox

    def counted(self: Any, *words: Any, **named: Any) -> Any:
        laid_out.append("y")
        return bounds(self, *words, **named)

    monkeypatch.setattr(YAxis, "get_tightbbox", counted)
    now = drawn()
    assert bool(laid_out) is looks
    monkeypatch.setattr(style, "_let_titles_stay", lambda _: None)
    assert drawn() == now


@pytest.mark.parametrize("label", ["", "how much"])
@pytest.mark.parametrize("log", [False, True])
def test_ticks_that_nobody_styled_one_by_one_are_as_matplotlib_copies_them(
    label: str, log: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Lines of the grid end at the panel, numbers keep their size; the words of an axis stay beside them.

    Nothing is drawn of ticks without length.
    """

    def drawn() -> str:
        with style.drawing_style():
            figure, panels = style.stacked_axes(["what it is [m]", "and more"], [60.0, 40.0])
            for panel in panels:
                style.series(panel, np.arange(5.0), np.linspace(1.0, 900.0, 5), style.BLUE)
                panel.set_ylabel(label)
            panels[1].tick_params(axis="y", labelcolor=style.GREEN, labelsize=6.0, length=2.0)
            if log:
                style.logarithmic(panels[0], 1.0, 900.0)
            style.time_limits(panels, np.arange(5.0))
            svg = style.render(figure, "it", "it")
        return svg.replace("<g/>", "")  # of what is not drawn

    copied: list[Any] = []
    copy = vars(Axis)["_copy_tick_props"]

    def counted(self: Axis, *ticks: Any) -> None:
        copied.append(ticks)
        copy(self, *ticks)

    monkeypatch.setattr(Axis, "_copy_tick_props", counted)
    now = drawn()
    before = len(copied)
    monkeypatch.setattr(style, "_let_ticks_be_as_told", lambda _: None)
    monkeypatch.setattr(style, "LightAxes", Axes)
    assert drawn() == now
    assert len(copied) > 2 * before + 10


def test_a_filter_that_is_far_too_modest_is_on_its_axis() -> None:
    figure = Figure()
    axes = figure.add_subplot(axes_class=LightAxes)
    t_s, modest = np.arange(0.0, 50.0, 0.1), np.full(500, 0.004)
    _statistic(axes, t_s, modest, np.full(500, 0.2), np.full(500, 9.3), 3.0, 100)
    assert axes.get_ylim()[0] < 0.004
    _statistic(axes, t_s, np.full(500, 2.9), np.full(500, 0.2), np.full(500, 9.3), 3.0, 100)
    assert axes.get_ylim()[0] > 0.04


def test_close_ups_are_as_large_as_the_body_asks_for(tmp_path: Path) -> None:
    run = read_run(fabricate_run(tmp_path / "run"))
    corners = np.array([[0.75, 0.3], [-0.25, 0.3], [-0.25, -0.3], [0.75, -0.3]])
    car = replace(run.world.robots[0], polygon_m=corners, radius_m=0.85)
    figure = close_ups_figure(replace(run, world=replace(run.world, robots=(car,))))
    # Of the car's length, not of the circle about its rear axle that holds it.
    assert "Windows of 6.00\u00a0m" in figure.caption
    assert "Windows of 3.60\u00a0m" in close_ups_figure(run).caption


def test_a_pose_that_was_given_is_sure_and_not_unrecorded(tmp_path: Path) -> None:
    nothing = np.zeros(60)
    given = dict.fromkeys(("cov_xx_m2", "cov_yy_m2", "cov_tt_rad2"), nothing)
    figure = covariance_figure(read_run(fabricate_run(tmp_path / "run", steps=60, columns=given)))
    assert "zero throughout" in figure.svg
    assert "not recorded" not in figure.svg


def test_pillars_alone_are_walls_in_the_legend(tmp_path: Path) -> None:
    run = read_run(fabricate_run(tmp_path / "run"))
    pillars = replace(run.world, segments_m=np.zeros((0, 4)), circles_m=np.array([[1.0, 1.0, 0.2]]))
    assert "walls" in {key.label for key in map_figure(replace(run, world=pillars)).keys}


def test_close_ups_show_who_was_there(tmp_path: Path) -> None:
    run = read_run(fabricate_run(tmp_path / "run"))
    x, y = run.trace["true_x_m"], run.trace["true_y_m"]
    beside = np.stack([np.column_stack([x + 0.6, y]), np.column_stack([x + 500.0, y])], axis=1)
    seen = close_ups_figure(replace(run, people=PeopleTracks(run.trace.t_s, beside, np.array([0.25, 0.25]))))
    assert "people at that moment" in {key.label for key in seen.keys}
    assert seen.svg.count('class="layer-people"') == 3, "one in each window, and nobody half a kilometre away"


def test_a_robots_long_reason_leaves_its_numbers_in_sight(browser: Browser, tmp_path: Path) -> None:
    reason = "stuck: gave up after 30 replans, the last because the laser shows no room for the command"
    entry = {"success": False, "reason": reason, "path_length_m": 10.0, "position_rmse_m": 0.01}
    box = "document.querySelector('#robots table').parentElement"
    whole = dict.fromkeys(("goal_error_m", "position_max_m", "min_clearance_m"), 0.1)
    for width, more in ((900, {}), (1280, whole | {"collisions": 0, "replans": 0})):
        each = {"a long name of the first of them": entry | more, "b": entry | more}
        shown = page([team_section({"robots": each})], title="", eyebrow="", footer="")
        file = tmp_path / f"{width}.html"
        file.write_text(shown, encoding="utf-8")
        browser.size(width, 800)
        browser.open(file, "document.querySelector('#robots table')")
        assert browser.js(f"{box}.scrollWidth <= {box}.clientWidth")
