"""Grid maps: which cell is where, and the file formats, loss-free and with one-line errors."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import array_shapes, arrays
from PIL import Image

from pilotage.core.errors import InputError
from pilotage.core.types import Pose2
from pilotage.kernels.grids.marks import marked_at
from pilotage.maps import memory
from pilotage.maps.grid_file import read_grid
from pilotage.maps.grid_image import read_grey, read_hazard_image, write_grey
from pilotage.maps.moving_ai import read_moving_ai_map, read_scenario
from pilotage.maps.occupancy_grid import (
    FREE,
    OCCUPIED,
    UNKNOWN,
    OccupancyArray,
    OccupancyGrid,
    near_blocked,
)
from pilotage.maps.ros_map import RosMap, RosMapFile, read_ros_map, write_ros_map

SHAPES = array_shapes(min_dims=2, max_dims=2, min_side=1, max_side=6)


def is_meant(number: float) -> bool:
    """Whether a file may say it: 0, or not absurdly small."""
    return number == 0.0 or abs(number) >= 1e-100


FINITE = (st.floats(-1e6, 1e6)).filter(is_meant)
IN_A_FOLDER = settings(suppress_health_check=[HealthCheck.function_scoped_fixture])


class TestCells:
    def test_the_rovers_pixels(self) -> None:
        """Equations 3.1 and 3.2 of the rover report: X[0,0] = 0, Y[0,0] = 29990, 10 m a pixel."""
        grid = OccupancyGrid.of(np.zeros((3000, 4500), np.bool_), 10.0, Pose2(0.0, -10.0, 0.0))
        assert grid.cell_at(33070.0, 19010.0000002) == (1097, 3307)
        points = np.random.default_rng(0).uniform([0.0, -10.0], [45000.0, 29990.0], (1000, 2))
        j = np.floor((points[:, 0] - 0.0 + 10.0) / 10.0) - 1.0
        i = np.floor((29990.0 - points[:, 1] + 10.0) / 10.0) - 1.0
        assert (grid.cells_at(points) == np.stack([i, j], axis=1)).all()

    def test_row_0_is_on_top_and_the_origin_below(self) -> None:
        grid = OccupancyGrid.of(np.zeros((2, 3), np.bool_), 0.5, Pose2(10.0, 20.0, 0.0))
        assert grid.cell_at(10.1, 20.1) == (1, 0)
        assert grid.cell_at(11.4, 20.9) == (0, 2)
        assert grid.cell_at(9.9, 20.1) == (1, -1)
        assert not grid.contains(*grid.cell_at(1e300, -1e300))
        assert grid.size_m == (1.5, 1.0)

    @given(FINITE, FINITE, st.floats(-math.pi, math.pi), st.floats(0.01, 100.0))
    def test_a_centre_lies_in_its_cell(self, x: float, y: float, yaw: float, resolution: float) -> None:
        grid = OccupancyGrid.of(np.zeros((4, 5), np.bool_), resolution, Pose2(x, y, yaw))
        cells = np.argwhere(grid.cells == FREE)
        assert (grid.cells_at(grid.centres_m(cells)) == cells).all()

    def test_yaw_turns_about_the_corner(self) -> None:
        grid = OccupancyGrid.of(np.zeros((2, 2), np.bool_), 1.0, Pose2(0.0, 0.0, math.pi / 2))
        assert np.allclose(grid.centres_m(np.array([[1, 0], [1, 1]])), [[-0.5, 0.5], [-0.5, 1.5]])

    @given(
        arrays(np.int8, SHAPES, elements=st.sampled_from([-1, -1, -1, 0, 100])),
        st.floats(-math.pi, math.pi),
        st.integers(1, 3),
    )
    def test_what_is_known_stays_where_it_is(self, cells: OccupancyArray, yaw: float, step: int) -> None:
        """And what is not is left out but for one cell around it, and what whole steps take."""
        grid = OccupancyGrid(np.pad(cells, 2, constant_values=UNKNOWN), 0.5, Pose2(3.0, -7.0, yaw))
        part = grid.known_part(step)
        known = np.argwhere(grid.cells != UNKNOWN)
        if len(known) == 0:
            assert part is grid
            return
        more = np.array(part.cells.shape) - np.ptp(known, axis=0) - 3
        assert ((more >= 0) & (more < step)).all()
        steps = grid.places_at(part.points_m(np.array([[part.rows, 0]])))[0] / step
        below = grid.rows / step - steps[0]
        assert abs(below - round(below)) + abs(steps[1] - round(steps[1])) < 1e-9
        row, column = part.cells_at(grid.centres_m(known)).T
        assert (part.cells[row, column] == grid.cells[tuple(known.T)]).all()
        assert (part.cells != UNKNOWN).sum() == len(known)

    def test_values_of_every_kind(self) -> None:
        assert OccupancyGrid.of(np.array([[True, False]]), 1.0).cells.tolist() == [[OCCUPIED, FREE]]
        assert OccupancyGrid.of([[0.5, math.nan]], 1.0).cells.tolist() == [[50, UNKNOWN]]
        grid = OccupancyGrid.of([[0, 64, 65, 100, -1]], 1.0)
        assert grid.blocked().tolist() == [[False, False, True, True, True]]
        assert grid.blocked(unknown_is_free=True).tolist() == [[False, False, True, True, False]]

    @pytest.mark.parametrize(
        ("values", "resolution", "origin"),
        [
            ([[101]], 1.0, (0, 0, 0)),
            ([[-2]], 1.0, (0, 0, 0)),
            ([[1.5]], 1.0, (0, 0, 0)),
            ([1, 2], 1.0, (0, 0, 0)),
            ([["a"]], 1.0, (0, 0, 0)),
            ([[0]], 0.0, (0, 0, 0)),
            ([[0]], math.nan, (0, 0, 0)),
            ([[0]], 1.0, (0, math.inf, 0)),
        ],
    )
    def test_misuse_is_refused(self, values: Any, resolution: float, origin: tuple[float, ...]) -> None:
        with pytest.raises(InputError, match="expected"):
            OccupancyGrid.of(values, resolution, Pose2(*origin))

    def test_cells_are_frozen_and_the_callers_are_not(self) -> None:
        cells = np.zeros((2, 2), np.int8)
        grid = OccupancyGrid(cells, 1.0)
        cells[0, 0] = OCCUPIED
        assert grid.cells[0, 0] == FREE
        with pytest.raises(ValueError, match="read-only"):
            grid.cells[0, 0] = OCCUPIED

    def test_inflation_is_by_centres_and_exact(self) -> None:
        mask = np.zeros((13, 13), np.bool_)
        mask[6, 6] = True
        rows, columns = np.indices(mask.shape)
        away = (rows - 6) ** 2 + (columns - 6) ** 2
        for radius in (0.5, 1.0, 1.5, 5.0):
            assert (near_blocked(mask, radius) == ((away < radius**2) | mask)).all()
        assert not near_blocked(np.zeros((3, 3), np.bool_), 9.0).any()


class TestImages:
    def test_white_is_an_obstacle(self, tmp_path: Path) -> None:
        path = tmp_path / "hazard.png"
        write_grey(path, np.array([[255, 0], [127, 128]], np.uint8))
        grid = read_hazard_image(path, 10.0)
        assert grid.blocked().tolist() == [[True, False], [False, True]]
        write_grey(path, np.where(grid.blocked(), np.uint8(255), np.uint8(0)))
        assert (read_hazard_image(path, 10.0).cells == grid.cells).all()

    def test_grey_in_other_clothes(self, tmp_path: Path) -> None:
        grey = np.arange(6, dtype=np.uint8).reshape(2, 3) * 40
        for mode in ("RGB", "RGBA", "LA"):
            Image.fromarray(grey).convert(mode).save(tmp_path / "a.png")
            assert (read_grey(tmp_path / "a.png")[0] == grey).all()
        Image.fromarray(grey).convert("P").save(tmp_path / "a.png")
        assert (read_grey(tmp_path / "a.png")[0] == grey).all()
        (tmp_path / "plain.pgm").write_text("P2\n# a comment\n3 2\n255\n0 40 80\n120 160 200\n")
        assert (read_grey(tmp_path / "plain.pgm")[0] == grey).all()

    @pytest.mark.parametrize("mode", ["RGB", "RGBA", "P"])
    def test_nearly_grey_counts_as_grey(self, tmp_path: Path, mode: str) -> None:
        """Drawing programs' palettes and smoothed edges are off by one to three; such maps were refused."""
        shades = [[0, 1, 1], [2, 0, 2], [254, 254, 251], [205, 205, 205]]
        image = Image.fromarray(np.array([shades], np.uint8))
        image = image.quantize(8) if mode == "P" else image.convert(mode)
        assert image.mode == mode
        image.save(tmp_path / "a.png")
        assert read_grey(tmp_path / "a.png")[0].tolist() == [[1, 1, 253, 205]]

    @pytest.mark.parametrize("name", ["a.png", "a.pgm", "a.tif", "plain.pgm"])
    def test_sixteen_bits_are_read_as_they_are(self, tmp_path: Path, name: str) -> None:
        path, deep = tmp_path / name, np.array([[0, 1, 32767], [32768, 52000, 65535]], np.uint16)
        for grey in (deep, np.arange(6, dtype=np.uint16).reshape(2, 3) * 257 * 40):
            if name == "plain.pgm":
                path.write_text("P2\n3 2\n65535\n" + " ".join(map(str, grey.ravel())) + "\n")
            else:
                Image.fromarray(grey).save(path)
            read, alpha = read_grey(path)
            assert alpha is None
            # Where 8 bits say all of it, it is what they say: thresholds and map_saver's greys hold.
            assert (read == (grey if grey is deep else grey // 257)).all()
            assert read.dtype == (np.uint16 if grey is deep else np.uint8)
            assert (read_hazard_image(path, 1.0).blocked() == (grey > 32767)).all()

    def test_what_cannot_be_used_is_said_in_one_line(self, tmp_path: Path) -> None:
        path = tmp_path / "a.png"
        with pytest.raises(InputError, match="found none"):
            read_grey(path)
        Image.fromarray(np.zeros((2, 2, 3), np.uint8) + np.array([9, 0, 0], np.uint8)).save(path)
        with pytest.raises(InputError, match="coloured"):
            read_grey(path)
        Image.fromarray(np.zeros((2, 2), np.int32)).save(tmp_path / "a.tif")
        with pytest.raises(InputError, match="8 or 16 bits"):
            read_grey(tmp_path / "a.tif")
        write_grey(path, np.zeros((50, 60), np.uint8))
        with pytest.raises(InputError, match="60 x 50"):
            read_grey(path, size=(60, 50))
        whole = path.read_bytes()
        path.write_bytes(whole[: len(whole) // 2])
        with pytest.raises(InputError, match="cut short"):
            read_grey(path)
        path.write_text("no image")
        with pytest.raises(InputError, match="another format"):
            read_grey(path)

    def test_what_does_not_fit_is_told_before_it_is_read(self, tmp_path: Path) -> None:
        path = tmp_path / "huge.pgm"
        path.write_bytes(b"P5\n1000000 1000000\n255\n")
        with pytest.raises(InputError, match="expected at most 512 MB, found 1,000,000 MB"):
            read_grey(path)


@st.composite
def ros_maps(draw: st.DrawFn) -> RosMap:
    free = draw(st.floats(0.0, 0.99).filter(is_meant))
    file = RosMapFile(
        image=draw(st.sampled_from(["a.png", "map.v2.png", "yes.png"])),
        mode=draw(st.sampled_from(["trinary", "scale", "raw"])),
        resolution=draw(st.floats(1e-6, 1e6)),
        origin=(draw(FINITE), draw(FINITE), draw(st.floats(-7.0, 7.0).filter(is_meant))),
        negate=draw(st.booleans()),
        free_thresh=free,
        occupied_thresh=draw(st.floats(free, 1.0, exclude_min=True).filter(is_meant)),
    )
    pixels = draw(arrays(np.uint8, SHAPES))
    alpha = draw(st.none() | arrays(np.uint8, pixels.shape))
    if alpha is None and draw(st.booleans()):
        deep = pixels.astype(np.uint16) * 257
        deep[0, 0] ^= 1  # not all of it would go into 8 bits
        return RosMap(file, deep, None)
    return RosMap(file, pixels, alpha)


class TestRosMaps:
    @IN_A_FOLDER
    @given(ros_maps())
    def test_written_back_loss_free(self, tmp_path: Path, ros_map: RosMap) -> None:
        write_ros_map(tmp_path / "map.yaml", ros_map)
        again = read_ros_map(tmp_path / "map.yaml")
        assert again.file == ros_map.file
        assert (again.pixels == ros_map.pixels).all()
        assert (again.alpha is None) == (ros_map.alpha is None)
        if again.alpha is not None and ros_map.alpha is not None:
            assert np.array_equal(again.alpha, ros_map.alpha)
        assert (again.grid.cells == ros_map.grid.cells).all()

    @IN_A_FOLDER
    @given(arrays(np.int8, SHAPES, elements=st.integers(-1, 100)), st.sampled_from(["pgm", "png"]), FINITE)
    def test_any_grid_is_written_loss_free(
        self, tmp_path: Path, cells: np.ndarray[Any, np.dtype[np.int8]], suffix: str, yaw: float
    ) -> None:
        for grid in (
            OccupancyGrid(cells, 0.05, Pose2(-1.5, 2.25, yaw)),
            OccupancyGrid.of(cells > 50, 0.05, Pose2(-1.5, 2.25, yaw)),
        ):
            write_ros_map(tmp_path / "map.yaml", RosMap.of(grid, f"map.{suffix}"))
            again = read_grid(tmp_path / "map.yaml")
            assert (again.cells == grid.cells).all()
            assert (again.origin, again.resolution_m) == (grid.origin, grid.resolution_m)

    @pytest.mark.parametrize(
        ("mode", "negate", "expected"),
        [
            ("trinary", False, [100, 100, -1, 0, 0]),
            ("trinary", True, [0, 0, 0, 100, 100]),
            ("scale", False, [100, 100, 54, 0, 0]),
            ("scale", True, [0, 0, 0, 100, 100]),
            ("raw", False, [0, 50, -1, -1, -1]),
        ],
    )
    def test_the_map_servers_rules(self, mode: Any, negate: bool, expected: list[int]) -> None:
        file = RosMapFile(
            image="a.pgm",
            mode=mode,
            resolution=1.0,
            origin=(0, 0, 0),
            negate=negate,
            free_thresh=0.196 if not negate else 0.6,
            occupied_thresh=0.65,
        )
        assert RosMap(file, np.array([[0, 50, 142, 220, 254]], np.uint8)).grid.cells.tolist() == [expected]

    def test_one_threshold_for_both_leaves_nothing_unknown(self) -> None:
        """A published map has it, and its server takes it."""
        file = RosMapFile(
            image="a.pgm", resolution=1.0, origin=(0, 0, 0), free_thresh=0.196, occupied_thresh=0.196
        )
        pixels = np.array([[0, 100, 230, 254]], np.uint8)
        assert RosMap(file, pixels).grid.cells.tolist() == [[OCCUPIED, OCCUPIED, FREE, FREE]]

    def test_the_one_threshold_that_a_file_has_is_for_both_where_the_others_default_is_above_it(self) -> None:
        """Published maps have it: the default for what is free, 0.25, was held against 0.05 as if written."""
        file = RosMapFile(image="a.pgm", resolution=1.0, origin=(0, 0, 0), occupied_thresh=0.05)
        pixels = np.array([[0, 205, 240, 243, 254]], np.uint8)
        assert RosMap(file, pixels).grid.cells.tolist() == [[OCCUPIED, OCCUPIED, OCCUPIED, FREE, FREE]]
        assert RosMapFile(image="a.pgm", resolution=1.0, origin=(0, 0, 0)).free_thresh == 0.25

    @pytest.mark.parametrize(("grey", "expected"), [(205, UNKNOWN), (206, FREE)])
    def test_what_map_saver_wrote_as_unknown_is(self, grey: int, expected: int) -> None:
        """By the threshold that Navigation 2 writes both are free: robots patrolled around buildings."""
        file = RosMapFile(image="a.pgm", mode="trinary", resolution=1.0, origin=(0, 0, 0), free_thresh=0.25)
        pixels = np.array([[0, grey, 254, 255]], np.uint8)
        assert RosMap(file, pixels, None).grid.cells.tolist() == [[OCCUPIED, expected, FREE, FREE]]
        painted = np.array([[0, grey, 254, 230]], np.uint8)
        assert RosMap(file, painted, None).grid.cells.tolist() == [[OCCUPIED, FREE, FREE, FREE]]

    def test_sixteen_bits_are_scaled_to_one(self) -> None:
        pixels = np.array([[0, 100, 25_700, 32_768, 52_600, 52_700, 65_535]], np.uint16)
        expected = {
            "trinary": [100, 100, -1, -1, -1, 0, 0],
            "scale": [100, 100, 91, 67, 0, 0, 0],
            "raw": [0, 0, 100, -1, -1, -1, -1],
        }
        for mode, cells in expected.items():
            file = RosMapFile.model_validate(
                {"image": "a.png", "mode": mode, "resolution": 1.0, "origin": (0, 0, 0)}
                | {"free_thresh": 0.196, "occupied_thresh": 0.65}
            )
            assert RosMap(file, pixels).grid.cells.tolist() == [cells]

    @pytest.mark.parametrize("mode", ["trinary", "scale"])
    def test_what_is_not_opaque_is_unknown(self, mode: Any) -> None:
        """As Navigation 2 has it now: transparent black was a wall, an opaque grey of 205 free."""
        file = RosMapFile(image="a.png", mode=mode, resolution=1.0, origin=(0, 0, 0))
        pixels, alpha = np.array([[255, 255, 0]], np.uint8), np.array([[255, 254, 0]], np.uint8)
        assert RosMap(file, pixels, alpha).grid.cells.tolist() == [[0, -1, -1]]

    def test_an_empty_image_is_called_so(self, tmp_path: Path) -> None:
        """As one that a repository keeps elsewhere leaves: it was of another format."""
        (tmp_path / "a.pgm").write_bytes(b"")
        (tmp_path / "map.yaml").write_text("image: a.pgm\nresolution: 0.05\norigin: [0, 0, 0]\n")
        with pytest.raises(InputError, match="expected a PNG, PGM or other image, found an empty file"):
            read_grid(tmp_path / "map.yaml")

    @pytest.mark.parametrize(
        ("change", "match"),
        [
            ({"image": "missing.pgm"}, "missing.pgm', or one of its name beside it, found none; beside"),
            ({"image": "/on/the/robot/ab.pgm"}, "found none; did you mean '.*/a.pgm'"),
            ({"occupied_threshold": 0.6, "occupied_thresh": None}, "occupied_thresh"),
            ({"free_threshold": 0.2}, "free_threshold: unknown key; did you mean 'free_thresh'"),
            ({"Mode": "raw"}, "Mode: unknown key; did you mean 'mode'"),
            ({"resolution": 0.0}, "resolution"),
            ({"resolution": math.nan}, "resolution"),
            ({"origin": [0.0]}, "origin"),
            ({"mode": "trinery"}, "mode"),
            ({"free_thresh": 0.7}, "free_thresh"),
            ({"negat": 1}, "negate"),
        ],
    )
    def test_bad_files_are_refused(self, tmp_path: Path, change: dict[str, Any], match: str) -> None:
        write_grey(tmp_path / "a.pgm", np.zeros((2, 2), np.uint8))
        values = {"image": "a.pgm", "resolution": 0.05, "origin": [0, 0, 0], "occupied_thresh": 0.65}
        (tmp_path / "map.yaml").write_text(yaml.safe_dump(values | change))
        with pytest.raises(InputError, match=match):
            read_grid(tmp_path / "map.yaml")
        (tmp_path / "map.yaml").write_text("image: [")
        with pytest.raises(InputError, match="YAML"):
            read_grid(tmp_path / "map.yaml")

    @pytest.mark.parametrize(
        "change",
        [
            {"name": "hall", "map_type": "occupancy", "frame_id": "map", "layers": [{"image": "b.pgm"}]},
            {"image": "/on/the/robot/a.pgm"},
            {"image": "C:\\maps\\a.pgm"},
            {"image": "package://hall/maps/a.pgm"},
            {"mode": "Trinary"},
            {"origin": [0, 0]},
        ],
    )
    def test_what_others_maps_have_besides_is_none_of_its_business(
        self, tmp_path: Path, change: dict[str, Any]
    ) -> None:
        """`name` was refused as a misspelt `mode`, and a path on the robot that made the map as missing."""
        write_grey(tmp_path / "a.pgm", np.array([[0, 254], [205, 254]], np.uint8))
        values = {"image": "a.pgm", "resolution": 0.05, "origin": [0, 0, 0], "negate": 0}
        text = yaml.safe_dump(values | change)
        for written in (
            text,
            text.replace("\n", "\r\n"),
            "\ufeff" + text,
            text.replace("negate: 0", "negate:\t0"),
        ):
            (tmp_path / "map.YAML").write_bytes(written.encode())
            assert read_grid(tmp_path / "map.YAML").cells.tolist() == [[OCCUPIED, FREE], [UNKNOWN, FREE]]

    @pytest.mark.parametrize("negate", [1, 2, True, "yes"])
    def test_a_negated_map_is_one_however_it_says_so(self, negate: Any) -> None:
        values = {"image": "a.pgm", "resolution": 0.05, "origin": [0, 0, 0], "negate": negate}
        assert RosMapFile.model_validate(values).negate


MAP = "type octile\nheight 2\nwidth 4\nmap\n.GS@\nTOW.\n"


class TestMovingAi:
    @pytest.mark.parametrize("text", [MAP, MAP.replace("\n", "\r\n"), MAP[:-1], MAP + "\n\n"])
    def test_terrain(self, tmp_path: Path, text: str) -> None:
        path = tmp_path / "a.map"
        path.write_bytes(text.encode())
        read = read_moving_ai_map(path)
        assert read.terrain.tobytes() == b".GS@TOW."
        assert read.grid().blocked().tolist() == [[False, False, False, True], [True, True, True, False]]
        assert read.blocked(b"W").tolist() == [[True] * 4, [True, True, False, True]]
        assert read.scaled(4, 8).terrain.tobytes() == b"..GGSS@@" * 2 + b"TTOOWW.." * 2
        assert read.scaled(1, 2).terrain.tobytes() == b".S"

    @pytest.mark.parametrize(
        ("text", "match"),
        [
            (MAP[:-4], "row 2: expected 4 cells|cut short"),
            (MAP[: MAP.index("TOW")], "cut short"),
            (MAP.replace(".GS@\n", ".GS@.\n"), "row 1: expected 4 cells, found 5"),
            (MAP.replace("G", "x"), "found 'x'"),
            (MAP.replace("height 2\n", ""), "height"),
            (MAP.replace("width 4", "width 0"), "width"),
            ("hello", "header"),
            ("", "header"),
            (MAP.replace("height 2", "height 4000000").replace("width 4", "width 4000000"), "48,000.0 GB"),
        ],
    )
    def test_bad_files_are_refused(self, tmp_path: Path, text: str, match: str) -> None:
        (tmp_path / "a.map").write_text(text)
        with pytest.raises(InputError, match=match):
            read_moving_ai_map(tmp_path / "a.map")

    def test_scenarios_of_every_version(self, tmp_path: Path) -> None:
        path = tmp_path / "a.scen"
        path.write_text("version 1.0\n0 maps/a b.map 4 2 0 1 3 0 3.41\n")
        scenario = read_scenario(path)
        assert (scenario.starts.tolist(), scenario.goals.tolist()) == ([[1, 0]], [[0, 3]])
        assert scenario.sizes.tolist() == [[2, 4]]
        path.write_text("0\ta.map\t0\t1\t3\t0\t12345.6\n\n")
        scenario = read_scenario(path)
        assert (scenario.starts.tolist(), scenario.goals.tolist()) == ([[1, 0]], [[0, 3]])
        assert scenario.tolerances[0] == pytest.approx(0.05)
        for text in (
            "",
            "version 1\n",
            "version 1\n0 a.map 4 2 0 1 3\n",
            "version 1\n0 a.map 4 2 0 x 3 0 1\n",
        ):
            path.write_text(text)
            with pytest.raises(InputError, match="expected"):
                read_scenario(path)


class TestOtherFiles:
    def test_arrays(self, tmp_path: Path) -> None:
        np.save(tmp_path / "a.npy", np.array([[True, False]]))
        assert read_grid(tmp_path / "a.npy", 2.0).cells.tolist() == [[OCCUPIED, FREE]]
        np.save(tmp_path / "a.npy", np.array([{}]), allow_pickle=True)
        with pytest.raises(InputError, match="expected an array of numbers"):
            read_grid(tmp_path / "a.npy")
        for fractions in (np.array([[0.0, 0.5]]), np.array([[0.0, 0.5]], np.float16)):
            np.save(tmp_path / "a.npy", fractions)
            with pytest.raises(InputError, match=r"whole per cent, found float.*--slope-limit"):
                read_grid(tmp_path / "a.npy")

    def test_what_a_file_needs_is_said(self, tmp_path: Path) -> None:
        write_grey(tmp_path / "a.png", np.zeros((2, 2), np.uint8))
        with pytest.raises(InputError, match="resolution"):
            read_grid(tmp_path / "a.png")
        with pytest.raises(InputError, match="resolution above 0"):
            read_grid(tmp_path / "a.png", 0.0)
        with pytest.raises(InputError, match=r"\.txt"):
            read_grid(tmp_path / "a.txt")
        with pytest.raises(InputError, match="YAML file"):
            read_grid(tmp_path / "a.yaml", 1.0)

    def test_memory_is_asked_for(self, monkeypatch: pytest.MonkeyPatch) -> None:
        monkeypatch.setattr(memory, "available_bytes", lambda: 10**9)
        memory.require_memory(5 * 10**8, "a map")
        with pytest.raises(InputError, match=r"a map: needs about 2.0 GB of memory, 1.0 GB are free"):
            memory.require_memory(2 * 10**9, "a map")
        monkeypatch.setattr(memory, "available_bytes", lambda: None)
        memory.require_memory(10**18, "a map")


@settings(max_examples=30, deadline=None)
@given(
    marks=arrays(np.bool_, array_shapes(min_dims=2, max_dims=2, max_side=6)),
    theta_rad=st.sampled_from([0.0, 0.4, -2.0, math.pi]),
    seed=st.integers(0, 1000),
)
def test_marked_cells_are_those_that_places_lie_in(marks: Any, theta_rad: float, seed: int) -> None:
    grid = OccupancyGrid.of(marks, 0.3, Pose2(-0.7, 0.2, theta_rad))
    rng = np.random.default_rng(seed)
    points = np.vstack([rng.uniform(-3.0, 3.0, (40, 2)), [(math.nan, 0.0), (math.inf, 0.0), (0.0, -1e300)]])
    with np.errstate(invalid="ignore"):
        cells = grid.cells_at(points)
    expected = [grid.contains(row, column) and bool(marks[row, column]) for row, column in cells]
    assert marked_at(points, np.ascontiguousarray(marks), grid.frame).tolist() == expected
