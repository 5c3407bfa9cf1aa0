"""Tracking on rendered films: other views, colours, light; what cannot be tracked is told in one line."""

from __future__ import annotations

import json
import shutil
import sys
import tempfile
import threading
from collections.abc import Callable
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from pilotage.cli.main import main
from pilotage.core.errors import InputError
from pilotage.maps.cell_map import CellState
from pilotage.tracking.channels import greatest_channel, least_channel
from pilotage.tracking.opencv import opencv
from pilotage.tracking.output import annotated_film
from pilotage.tracking.path import build_path
from pilotage.tracking.robot_colour import parse_hsv
from pilotage.tracking.robot_finder import Sighting
from pilotage.tracking.scene import TrackOptions, learn_scene
from pilotage.tracking.sheet import Sheet, in_map_order, parse_corners, project
from pilotage.tracking.sheet_finder import find_corners
from pilotage.tracking.track import Track, follow
from support.films import (
    FROM_ABOVE,
    FROM_THE_SIDE,
    SIZE_M,
    FilmScript,
    render_film,
    true_path_m,
    true_path_px,
)

cv2 = pytest.importorskip("cv2", reason="OpenCV is not installed (pilotage[vision])")


Filmed = Callable[[FilmScript], Path]


@pytest.fixture(scope="module")
def filmed(tmp_path_factory: pytest.TempPathFactory) -> Filmed:
    """Each film is rendered once; who damages it takes a copy."""
    folder = tmp_path_factory.mktemp("films")

    @cache
    def film(script: FilmScript) -> Path:
        path = Path(tempfile.mkdtemp(dir=folder)) / "film.avi"
        render_film(path, script)
        return path

    return film


@pytest.fixture(scope="module")
def tracked(filmed: Filmed) -> Callable[[FilmScript], Track]:
    """What is found in each film with nothing given, once."""

    @cache
    def track(script: FilmScript) -> Track:
        return with_options(filmed(script), TrackOptions())

    return track


def with_options(film: Path, options: TrackOptions) -> Track:
    return follow(film, learn_scene(film, options))


def errors_px(track: Track, script: FilmScript) -> np.ndarray:
    away = track.path.points_px - true_path_px(script)[track.path.frames]
    return np.asarray(np.hypot(*away.T))


@pytest.mark.parametrize(
    "script",
    [
        FilmScript(frames=40),
        FilmScript(frames=40, corners_px=FROM_ABOVE, robot=(40, 180, 40), noise=10.0),
        FilmScript(frames=40, corners_px=FROM_THE_SIDE, robot=(30, 40, 200), light=0.25),
        FilmScript(frames=40, robot=(90, 90, 90), radius_m=0.06),
        FilmScript(frames=60, resting=42),
        FilmScript(frames=40, passer_by=True),
    ],
    ids=["tilted-blue", "above-green-noise", "side-red-light", "small-grey", "mostly-resting", "passer-by"],
)
def test_the_robot_is_found_where_it_is(script: FilmScript, tracked: Callable[[FilmScript], Track]) -> None:
    track = tracked(script)
    corner_error = np.abs(track.scene.sheet.corners_px - np.array(script.corners_px)).max()
    assert len(track.path.frames) == track.frames == script.frames
    assert np.median(errors_px(track, script)) < 0.6
    assert errors_px(track, script).max() < 2.0
    assert corner_error < 1.5
    off_m = np.hypot(*(track.path.points_m - true_path_m(script)).T)
    assert np.median(off_m) < 0.004
    # Stated uncertainty is for each axis; the median of the distance is 1.18 of it.
    assert 0.3 < np.median(off_m) / (1.18 * np.median(track.path.std_m)) < 3.0


def test_a_small_quick_robot_is_followed_from_near_to_far(tracked: Callable[[FilmScript], Track]) -> None:
    # Three radii from frame to frame, and several times as many pixels near the camera as far from it.
    script = FilmScript(frames=20, radius_m=0.035)
    track = tracked(script)
    assert len(track.path.frames) == script.frames
    assert errors_px(track, script).max() < 2.0


def test_marks_and_visited_cells_fall_into_their_cells(tracked: Callable[[FilmScript], Track]) -> None:
    script = FilmScript(frames=40)
    track = tracked(script)
    boxes, lines = track.cells.holds(CellState.OBSTACLE), track.cells.holds(CellState.LINE)
    # Boxes of 0.5 x 0.15 and 0.35 x 0.12 m: rows 3 to 5 and 20 to 22, columns 2 to 9 and 18 to 22.
    assert boxes[4, 2:10].all()
    assert boxes[21, 19:22].all()
    assert not boxes[8:18].any()
    assert lines[20, 7:12].all()
    assert not (lines & boxes).any()
    cells = np.floor(true_path_m(script) / (SIZE_M / 25)).astype(int)
    assert np.mean(track.visited[cells[:, 1], cells[:, 0]]) > 0.95
    assert track.visited[boxes].sum() == 0
    kinds = {edge["kind"] for edge in track.as_dict()["edges"]}
    assert kinds == {"line", "obstacle"}


def test_corners_and_colour_may_be_given(filmed: Filmed) -> None:
    script = FilmScript(frames=30)
    options = TrackOptions(np.array(script.corners_px), parse_hsv("100,80,40,125,255,255"), radius_m=0.09)
    track = with_options(filmed(script), options)
    assert np.array_equal(track.scene.sheet.corners_px, np.array(script.corners_px))
    assert np.median(errors_px(track, script)) < 0.6


def test_a_robot_that_never_moves_is_found_by_its_given_colour(filmed: Filmed) -> None:
    script = FilmScript(frames=20, resting=20)
    track = with_options(filmed(script), TrackOptions(colour=parse_hsv("100,80,40,125,255,255")))
    assert len(track.path.frames) == 20
    assert np.median(errors_px(track, script)) < 1.5
    with pytest.raises(InputError, match="nothing moves"):
        learn_scene(filmed(script), TrackOptions())


def test_the_command_writes_json_csv_pictures_and_a_film(
    filmed: Filmed, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    film, out = filmed(FilmScript(frames=30)), tmp_path / "out"
    capfd.readouterr()
    assert main(["track", str(film), "--out", str(out), "--json"]) == 0
    captured = capfd.readouterr()
    values = json.loads(captured.out)
    assert captured.err == ""
    assert values["frames"] == values["tracked"] == len(values["path"]) == 30
    assert {"frame", "x_px", "y_px", "x_m", "y_m", "std_m"} <= set(values["path"][0])
    assert values == json.loads((out / "track.json").read_text())
    assert (out / "path.csv").read_text().count("\n") == 31
    assert cv2.imread(str(out / "map.png")).shape == (1000, 1000, 3)
    names = {path.name for path in out.iterdir()}
    assert names == {
        "annotated.webm",
        "floor_map.txt",
        "visited_map.txt",
        "map.png",
        "path.csv",
        "track.json",
    }
    annotated = cv2.VideoCapture(str(out / "annotated.webm"))
    count = 0
    while annotated.grab():
        count += 1
    assert count == 30
    printed = [str(out / "visited_map.txt"), str(out / "floor_map.txt")]
    assert main(["map-score", *printed, "--visited", str(out / "track.json"), "--json"]) == 0
    score = json.loads(capfd.readouterr().out)
    assert score["feature_precision"] == score["visited_accuracy"] == 1.0


def test_what_strikes_while_the_film_is_finished_ends_what_encodes(
    filmed: Filmed, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A signal there left half a film, and the encoder's threads aborted the process at its end."""
    join, struck = threading.Thread.join, list[threading.Thread]()

    def strike(thread: threading.Thread, timeout: float | None = None) -> None:
        if not struck:
            struck.append(thread)
            raise KeyboardInterrupt
        join(thread, timeout)

    scene, out = learn_scene(filmed(FilmScript(frames=30)), TrackOptions()), tmp_path / "out"
    out.mkdir()
    monkeypatch.setattr(threading.Thread, "join", strike)
    with pytest.raises(KeyboardInterrupt), annotated_film(out, scene) as film:
        film(scene.film.samples[0], None)
    assert not struck[0].is_alive()
    assert list(out.iterdir()) == []


def test_a_film_that_breaks_off_gives_what_there_was(
    filmed: Filmed, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    film, whole = tmp_path / "film.avi", filmed(FilmScript(frames=40)).read_bytes()
    film.write_bytes(whole[: int(len(whole) * 0.6)])
    capfd.readouterr()
    assert main(["track", str(film), "--json"]) == 0
    captured = capfd.readouterr()
    values = json.loads(captured.out)
    assert 15 < values["frames"] < 30
    assert values["tracked"] == values["frames"] == values["broke_at_frame"]
    assert f"breaks off at frame {values['frames']} of 40" in captured.err


def test_a_photograph_gives_the_map_without_a_path(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    film, photo = tmp_path / "film.avi", tmp_path / "photo.png"
    render_film(film, FilmScript(frames=1))
    cv2.imwrite(str(photo), cv2.VideoCapture(str(film)).read()[1])
    capfd.readouterr()
    assert main(["track", str(photo), "--json"]) == 0
    values = json.loads(capfd.readouterr().out)
    assert (values["frames"], values["tracked"], values["path"]) == (1, 0, [])
    assert any("O" in row for row in values["grid"]["rows"])


@pytest.mark.parametrize(
    ("arguments", "complaint"),
    [
        (["--corners", "0,0,100,100,100,0,0,100"], "convex"),
        (["--corners", "0,0,100,0,100,100"], "eight numbers"),
        (["--corners", "0,0,0,9000,9000,9000,9000,0"], "outside the picture"),
        (["--grid", "0"], "--grid"),
        (["--size", "-1"], "--size"),
        (["--size", "nan"], "--size"),
        (["--size", "1e300"], "--size"),
        (["--corners", "1e308,0,0,1e308,-1e308,0,0,-1e308"], "eight numbers"),
        (["--hsv", "1,2,3"], "--hsv"),
        (["--hsv", "40,100,100,60,255,255"], "no robot of this colour"),
    ],
)
def test_bad_options_leave_nothing_behind(
    arguments: list[str], complaint: str, filmed: Filmed, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    film, out = filmed(FilmScript(frames=4)), tmp_path / "out"
    capfd.readouterr()
    assert main(["track", str(film), *arguments, "--out", str(out)]) == 2
    error = capfd.readouterr().err
    assert error.count("\n") == 1
    assert complaint in error
    assert not out.exists()


def test_a_full_disk_leaves_nothing_behind(
    filmed: Filmed, small_disk: Callable[[str], Path], capfd: pytest.CaptureFixture[str]
) -> None:
    film, disk = filmed(FilmScript(frames=4)), small_disk("16k")
    capfd.readouterr()
    assert main(["track", str(film), "--out", str(disk / "new" / "out")]) == 2
    error = capfd.readouterr().err
    assert error.count("\n") == 1
    assert error.startswith(f"pilotage: {disk}/new/out/")
    assert error.endswith(": No space left on device\n")
    assert not list(disk.iterdir())


@pytest.mark.parametrize("text", ["#EXTM3U\n#EXTINF:1,\nfilm.avi\n", "ffconcat version 1.0\nfile film.avi\n"])
def test_a_list_of_films_is_none(
    text: str, filmed: Filmed, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    """FFmpeg opened what it names, such as a pipe, and asked a minute long for what is still to come."""
    shutil.copy(filmed(FilmScript(frames=4)), tmp_path / "film.avi")
    (tmp_path / "list.m3u8").write_text(text)
    capfd.readouterr()
    assert main(["track", str(tmp_path / "list.m3u8")]) == 2
    assert "found a list of other files" in capfd.readouterr().err


@pytest.mark.parametrize("kind", ["missing", "empty", "text", "noise", "blank", "thin"])
def test_films_without_a_map_are_refused_in_one_line(
    kind: str, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    film, out = tmp_path / "film.avi", tmp_path / "out"
    if kind in ("empty", "text"):
        film.write_text("" if kind == "empty" else "not a film\n" * 50)
    elif kind != "missing":
        rng = np.random.default_rng(3)
        rough = cv2.GaussianBlur(rng.integers(0, 256, (240, 320, 3)).astype(np.uint8), (0, 0), 5.0)
        picture = cv2.normalize(rough, None, 0, 255, cv2.NORM_MINMAX) if kind == "noise" else rough * 0 + 128
        if kind == "thin":  # reduced to half of nothing
            picture = np.full((2, 2000, 3), 128, np.uint8)
        writer = cv2.VideoWriter(str(film), cv2.VideoWriter_fourcc(*"MJPG"), 30.0, picture.shape[1::-1])
        for i in range(20):
            writer.write(cv2.circle(picture.copy(), (40 + 10 * i, 120), 15, (255, 0, 0), -1))
        writer.release()
    capfd.readouterr()
    assert main(["track", str(film), "--out", str(out), "--json"]) == 2
    captured = capfd.readouterr()
    assert captured.out == ""
    assert captured.err.count("\n") == 1
    assert not out.exists()


def test_without_opencv_the_remedy_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "cv2", None)
    with pytest.raises(InputError, match=r"pip install -e '\.\[vision\]'"):
        opencv()


def test_corners_are_taken_in_either_sense() -> None:
    seen_around = parse_corners("10,90,90,90,80,10,20,10")
    clockwise = parse_corners("20,10,80,10,90,90,10,90")
    assert np.array_equal(seen_around, clockwise)
    assert np.array_equal(in_map_order(np.roll(seen_around, 2, axis=0)[::-1]), seen_around)


def test_the_camera_is_found_from_the_view_of_the_square() -> None:
    focal, height, tilt = 900.0, 2.0, 0.9
    forward = np.array([0.0, np.cos(tilt), -np.sin(tilt)])
    right = np.array([1.0, 0.0, 0.0])
    rotation = np.array([right, np.cross(forward, right), forward])
    camera = np.array([0.6, -1.2, height])

    def seen(points_m: np.ndarray) -> np.ndarray:
        local = (np.column_stack([points_m, np.zeros(len(points_m))]) - camera) @ rotation.T
        return np.asarray(focal * local[:, :2] / local[:, 2:] + np.array([640.0, 360.0]))

    corners_m = SIZE_M * np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
    sheet = Sheet(seen(corners_m), SIZE_M, 0.0)
    found = sheet.camera_m((720, 1280))
    assert found is not None
    assert found == pytest.approx(camera, abs=0.01)
    point = np.array([[0.7, 1.1]])
    assert project(sheet.to_floor, seen(point)) == pytest.approx(point, abs=1e-4)
    step = 1e-3
    numeric = np.array(
        [
            (project(sheet.to_floor, seen(point) + move) - project(sheet.to_floor, seen(point) - move))[0]
            for move in (np.array([[step, 0.0]]), np.array([[0.0, step]]))
        ]
    ).T / (2 * step)
    assert sheet.metres_per_px(seen(point)[0]) == pytest.approx(numeric, rel=1e-4)


def photograph(corners: np.ndarray, bow_px: float = 0.0, hand: bool = False) -> np.ndarray:
    """A sheet on a rough floor, its sides bent outwards by a lens, a hand on its upper right corner."""
    rng = np.random.default_rng(5)
    floor = rng.integers(40, 90, (120, 214, 1)).astype(np.uint8)
    picture = cv2.resize(floor, (640, 360), interpolation=cv2.INTER_CUBIC)[..., None].repeat(3, axis=2)
    share = np.linspace(0.0, 1.0, 60, endpoint=False)[:, None]
    outline = []
    for start, end in zip(corners, np.roll(corners, -1, axis=0), strict=True):
        outward = np.array([-(end - start)[1], (end - start)[0]]) / np.hypot(*(end - start))
        outward = outward if outward @ (0.5 * (start + end) - corners.mean(axis=0)) > 0.0 else -outward
        outline.append(start + share * (end - start) + 4.0 * share * (1.0 - share) * bow_px * outward)
    cv2.fillPoly(picture, [np.rint(16.0 * np.concatenate(outline)).astype(np.int32)], (205, 210, 212), 0, 4)
    if hand:
        cv2.circle(picture, tuple(int(value) for value in corners[2]), 30, (120, 150, 190), -1)
    blurred: np.ndarray = cv2.GaussianBlur(picture, (0, 0), 0.7)
    return blurred


TURNED = np.array([[395.0, 338.0], [147.0, 202.0], [274.0, 82.0], [427.0, 166.0]])


def test_a_rough_floor_is_not_taken_for_the_sheet() -> None:
    found = find_corners([photograph(TURNED)] * 9)
    assert found is not None
    assert np.abs(found[0] - in_map_order(TURNED)).max() < 1.5


def test_a_hand_on_a_corner_most_of_the_time_does_not_move_it() -> None:
    corners = np.array([[102.0, 338.0], [538.0, 338.0], [454.0, 82.0], [185.0, 82.0]])
    found = find_corners([photograph(corners, hand=i % 3 < 2) for i in range(9)])
    assert found is not None
    assert np.abs(found[0] - corners).max() < 1.5


def test_bent_sides_make_corners_less_sure() -> None:
    corners = np.array([[102.0, 338.0], [538.0, 338.0], [454.0, 82.0], [185.0, 82.0]])
    straight, bent = find_corners([photograph(corners)] * 9), find_corners([photograph(corners, 4.0)] * 9)
    assert straight is not None
    assert bent is not None
    assert straight[1] < 0.6
    # The root mean square over corners and axes, against what it says.
    off = np.sqrt(np.mean((bent[0] - corners) ** 2))
    assert 0.5 < off / bent[1] < 2.0


def test_a_body_that_is_no_disc_is_placed_less_surely() -> None:
    sheet = Sheet(np.array(FROM_ABOVE), SIZE_M, 0.3)
    centres = [np.array([0.5 + 0.01 * i, 0.9]) for i in range(20)]
    stated = [
        build_path([(i, Sighting(c, 0.1, 0.0, 0.03, bare)) for i, c in enumerate(centres)], sheet).std_m
        for bare in (0.0, 0.2)
    ]
    assert stated[0].max() < 0.005
    assert stated[1] == pytest.approx(np.sqrt(stated[0] ** 2 + 0.02**2))


def test_channels_are_reduced_as_numpy_reduces_them() -> None:
    rng = np.random.default_rng(2)
    for picture in (
        rng.integers(0, 256, (7, 5, 3), dtype=np.uint8),
        rng.integers(-255, 256, (2, 7, 5, 3)).astype(np.int16),
        rng.normal(size=(7, 5, 3)).astype(np.float32),
    ):
        before = picture.copy()
        assert np.array_equal(least_channel(picture), picture.min(axis=-1))
        assert np.array_equal(greatest_channel(picture), picture.max(axis=-1))
        assert least_channel(picture).dtype == picture.dtype
        assert np.array_equal(picture, before)
