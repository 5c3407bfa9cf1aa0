"""Elevation, slopes, the crater terrain and its images."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from PIL import Image
from pydantic import ValidationError
from scipy.interpolate import CubicSpline

from pilotage.core.errors import InputError
from pilotage.core.types import FloatArray, Pose2
from pilotage.experiments.build.charts import load_chart
from pilotage.maps.crater_terrain import CraterTerrainConfig, crater_terrain
from pilotage.maps.elevation import ElevationModel
from pilotage.maps.elevation_file import read_elevation
from pilotage.maps.grid_image import read_grey, read_hazard_image, write_grey
from pilotage.maps.landmark_image import read_landmark_image
from pilotage.maps.occupancy_grid import squared_distances
from pilotage.stack.planning.grid_space import GridSpace

SMALL = CraterTerrainConfig(
    rows=150,
    columns=225,
    resolution_m=200.0,
    least_crater_m=600.0,
    craters_per_km2=0.1,
    landmarks_per_km2=0.02,
)


class TestElevation:
    def test_slope_of_a_plane(self) -> None:
        rows, columns = np.indices((7, 9))
        model = ElevationModel((columns * 3.0 - rows * 4.0).astype(np.float32), 10.0)
        assert np.allclose(model.slope_rad(), math.atan(0.5), atol=1e-6)
        assert model.hazards(26.0).blocked().all()
        assert not model.hazards(27.0).blocked().any()

    def test_heights_between_the_cells(self) -> None:
        """Row 0 is on top; the grid is turned by a quarter about its corner."""
        model = ElevationModel(
            np.array([[0.0, 10.0], [20.0, 40.0]], np.float32), 2.0, Pose2(5.0, 0.0, math.pi / 2)
        )
        points = np.array([[4.0, 1.0], [2.0, 1.0], [4.0, 3.0], [3.0, 2.0]])
        assert np.allclose(model.heights_at(points), [20.0, 0.0, 40.0, 17.5])
        assert np.isnan(model.heights_at(np.array([[9.0, 9.0]]))).all()

    @given(st.integers(0, 2**32 - 1))
    @settings(max_examples=30, deadline=None)
    def test_single_cells_have_the_same_slope(self, seed: int) -> None:
        rng = np.random.default_rng(seed)
        heights = rng.normal(0.0, 20.0, tuple(rng.integers(2, 9, 2)))
        ground = ElevationModel(heights.astype(np.float32), 7.0)
        cells = np.argwhere(np.ones(heights.shape, dtype=np.bool_))
        np.testing.assert_allclose(ground.slopes_at(cells), ground.slope_rad().ravel(), rtol=1e-5)

    def test_unknown_heights_are_unknown_hazards(self) -> None:
        heights = np.zeros((5, 5), np.float32)
        heights[2, 2] = math.nan
        cells = ElevationModel(heights, 1.0).hazards(20.0).cells
        assert cells[0, 0] == 0
        assert cells[2, 1] == -1

    def test_slopes_toward_the_sun_are_brighter(self) -> None:
        """Light from the north-west."""
        ramp = np.tile(np.arange(5, dtype=np.float32), (5, 1))
        assert ElevationModel(ramp, 1.0).shaded()[2, 2] > ElevationModel(-ramp, 1.0).shaded()[2, 2]
        assert ElevationModel(ramp.T, 1.0).shaded()[2, 2] > ElevationModel(-ramp.T, 1.0).shaded()[2, 2]

    @pytest.mark.parametrize("limit", [0.0, 90.0, -3.0, math.nan])
    def test_misuse(self, limit: float) -> None:
        model = ElevationModel(np.zeros((2, 2), np.float32), 1.0)
        with pytest.raises(InputError, match="slope limit"):
            model.hazards(limit)
        with pytest.raises(InputError, match="resolution"):
            ElevationModel(np.zeros((2, 2), np.float32), 0.0)


class TestFiles:
    SIDE: dict[str, Any] = {  # noqa: RUF012 - read only
        "size": [2, 3],
        "format": "uint16-le",
        "metresPerPixel": 10.0,
        "elevationMin": -100.0,
        "elevationMax": 555.35,
    }

    def write(self, folder: Path, **change: Any) -> Path:
        np.array([[0, 1000, 65535], [0, 0, 0]], "<u2").tofile(folder / "ground.bin")
        side = {key: value for key, value in (self.SIDE | change).items() if value is not None}
        (folder / "ground.json").write_text(json.dumps(side))
        return folder / "ground.json"

    def test_raw_array_with_side_file(self, tmp_path: Path) -> None:
        model = read_elevation(self.write(tmp_path), Pose2(1.0, 2.0, 0.0))
        assert np.allclose(model.elevation_m[0], [-100.0, -90.0, 555.35], atol=1e-3)
        assert (model.resolution_m, model.origin.x_m) == (10.0, 1.0)

    def test_cells_become_square(self, tmp_path: Path) -> None:
        path = self.write(tmp_path, metresPerPixel=None, metresPerPixelLat=10.0, metresPerPixelLon=20.0)
        model = read_elevation(path)
        assert model.elevation_m.shape == (2, 6)
        assert model.elevation_m[0, 1] == pytest.approx(-100.0 + 0.25 * 10.0, abs=1e-2)

    @pytest.mark.parametrize(
        ("change", "match"),
        [
            ({"size": [3, 3]}, "18 bytes"),
            ({"size": "big"}, "size"),
            ({"format": "uint7"}, "format"),
            ({"metresPerPixel": 0}, "above 0"),
            ({"elevationMax": None}, "elevationMax"),
            ({"file": "other.bin"}, "other.bin"),
            ({"size": 3_000_000}, "needs about"),
            ({"format": ["uint16-le"]}, "format"),
            ({"metresPerPixel": True}, "expected a number"),
            ({"metresPerPixel": 10**400}, "a number of 401 digits"),
            ({"metresPerPixel": 1e-300}, "resolution from"),
            ({"metresPerPixelLon": 1e20, "metresPerPixelLat": 1.0}, "at most 1,536 MB"),
            ({"elevationMax": 1e20}, "heights up to"),
        ],
    )
    def test_bad_files_are_refused(self, tmp_path: Path, change: dict[str, Any], match: str) -> None:
        with pytest.raises(InputError, match=match):
            read_elevation(self.write(tmp_path, **change))

    ASCII: dict[str, Any] = {  # noqa: RUF012 - read only
        "ncols": 3,
        "nrows": 2,
        "xllcorner": 500_000.0,
        "yllcorner": 4_649_776.5,
        "cellsize": 0.5,
        "NODATA_value": -32768,
        "values": "1.5 -2e0\t3\n4 -32768 nan\n",
    }

    def write_ascii(self, folder: Path, **change: Any) -> Path:
        whole = {key: value for key, value in (self.ASCII | change).items() if value is not None}
        lines = [f"{key}   {value}\r\n" for key, value in whole.items() if key != "values"]
        (folder / "ground.asc").write_text("".join(lines) + whole["values"], newline="")
        return folder / "ground.asc"

    def test_ascii_grid(self, tmp_path: Path) -> None:
        model = read_elevation(self.write_ascii(tmp_path))
        assert np.array_equal(model.elevation_m, [[1.5, -2.0, 3.0], [4.0, np.nan, np.nan]], equal_nan=True)
        assert (model.resolution_m, model.origin) == (0.5, Pose2(500_000.0, 4_649_776.5, 0.0))
        assert read_elevation(self.write_ascii(tmp_path), Pose2(1.0, 2.0, 0.1)).origin == Pose2(1.0, 2.0, 0.1)

    @pytest.mark.parametrize(
        ("change", "shape", "corner"),
        [
            ({"xllcorner": None, "XLLCENTER": 2, "NCOLS": 3, "ncols": None}, (2, 3), (1.75, 4_649_776.5)),
            ({"cellsize": None, "dx": 1.0, "dy": 0.5}, (2, 6), (500_000.0, 4_649_776.5)),
            ({"NODATA_value": None, "values": "1 2 3 4 5 -9999"}, (2, 3), (500_000.0, 4_649_776.5)),
            ({"values": "nan 2\n3\n\n4 5 6\n"}, (2, 3), (500_000.0, 4_649_776.5)),
        ],
    )
    def test_ascii_grids_of_other_programs(
        self, tmp_path: Path, change: dict[str, Any], shape: tuple[int, int], corner: tuple[float, float]
    ) -> None:
        model = read_elevation(self.write_ascii(tmp_path, **change))
        assert model.elevation_m.shape == shape
        assert (model.origin.x_m, model.origin.y_m) == corner
        assert np.isnan(model.elevation_m).any()

    @pytest.mark.parametrize(
        ("change", "match"),
        [
            ({"ncols": None}, "ncols: expected a whole number above 1, found none"),
            ({"nrows": 1.5}, "nrows: expected a whole number above 1, found '1.5'"),
            ({"xllcorner": None}, "xllcorner: missing"),
            ({"yllcorner": "inf"}, "yllcorner: expected a place"),
            ({"cellsize": 0}, "cellsize: expected a side of cells above 0 m, found 0"),
            ({"cellsize": None, "dx": 1.0}, "dy: missing"),
            ({"cells": 1}, "expected a header of cellsize, .*, found 'cells'"),
            ({"NCOLS": 3}, "ncols: expected once, found twice"),
            ({"values": "1 2 3 4 5"}, "expected 6 values for 3 x 2 cells, found 5; .* cut short"),
            ({"values": ""}, "found 0; .* cut short"),
            ({"values": "1 2 3 4,5 5 6"}, "row 2, column 1: expected a number, found '4,5'"),
            ({"values": "1 2 3 4 5 1e400"}, "heights up to"),
            ({"ncols": 3_000_000, "nrows": 3_000_000}, "needs about"),
            ({"NODATA_value": None, "values": "1 2 3 4 5 -32768"}, "a mark for unknown that the file"),
            ({"cellsize": 0.0002777, "values": "412 415 420 420 418 417"}, "or degrees"),
        ],
    )
    def test_bad_ascii_grids_are_refused(self, tmp_path: Path, change: dict[str, Any], match: str) -> None:
        with pytest.raises(InputError, match=match):
            read_elevation(self.write_ascii(tmp_path, **change))

    def test_an_ascii_grid_in_degrees_is_refused_by_its_projection(self, tmp_path: Path) -> None:
        path = self.write_ascii(tmp_path)
        (tmp_path / "ground.prj").write_text('PROJCS["UTM",GEOGCS["GCS_WGS_1984"]]')
        read_elevation(path)
        (tmp_path / "ground.prj").write_text('GEOGCS["GCS_WGS_1984"]')
        with pytest.raises(InputError, match=r"found degrees in ground\.prj"):
            read_elevation(path)

    @pytest.mark.parametrize(
        ("turned_rad", "row_m", "first"), [(0.0, -10.0, 1.0), (0.0, 10.0, 2.0), (0.3, -10.0, None)]
    )
    def test_geotiff(self, tmp_path: Path, turned_rad: float, row_m: float, first: float | None) -> None:
        """North up, south up (turned over), and turned, which is refused."""
        rasterio = pytest.importorskip("rasterio", reason="GeoTIFF needs the extra terrain")
        path = tmp_path / "ground.tif"
        c, s = math.cos(turned_rad), math.sin(turned_rad)
        place = rasterio.transform.Affine(10.0 * c, -row_m * s, 1000.0, 10.0 * s, row_m * c, 500.0)
        heights = np.array([[1.0, 1.0, 1.0], [2.0, 2.0, -9.0]], np.float32)
        size = {"height": 2, "width": 3, "count": 1, "dtype": "float32"}
        with rasterio.open(
            path, "w", driver="GTiff", crs="EPSG:32633", transform=place, nodata=-9.0, **size
        ) as f:
            f.write(heights, 1)
        if first is None:
            with pytest.raises(InputError, match="rows that run east"):
                read_elevation(path)
            return
        model = read_elevation(path)
        assert model.elevation_m[0, 0] == first
        assert np.isnan(model.elevation_m).sum() == 1
        assert (model.origin.x_m, model.origin.y_m) == (1000.0, 480.0 if row_m < 0.0 else 500.0)

    def test_a_geotiff_taken_for_an_image_of_obstacles(self, tmp_path: Path) -> None:
        (tmp_path / "dem.tif").write_bytes(b"")
        with pytest.raises(InputError, match=r"heights: {name: elevation, file: dem\.tif}$"):
            load_chart(str(tmp_path / "dem.tif"))

    def test_missing_or_other(self, tmp_path: Path) -> None:
        for name in ("none.json", "none.tif"):
            with pytest.raises(InputError, match="found none"):
                read_elevation(tmp_path / name)
        (tmp_path / "a.json").write_text("{")
        (tmp_path / "a.txt").write_text("")
        (tmp_path / "a.asc").write_text("")
        for name in ("a.json", "a.txt", "a.asc"):
            with pytest.raises(InputError, match="expected"):
                read_elevation(tmp_path / name)


class TestCraterTerrain:
    def test_same_seed_same_ground(self) -> None:
        one, two = crater_terrain(SMALL), crater_terrain(SMALL)
        other = crater_terrain(SMALL.model_copy(update={"seed": SMALL.seed + 1}))
        assert (one.elevation.elevation_m == two.elevation.elevation_m).all()
        assert (one.landmarks.points_xy_m == two.landmarks.points_xy_m).all()
        assert not (one.elevation.elevation_m == other.elevation.elevation_m).all()
        assert (one.hazards.cells == one.elevation.hazards(SMALL.slope_limit_deg).cells).all()

    @pytest.mark.parametrize(
        ("change", "said"),
        [
            ({"least_crater_m": 8000.0}, "at most 5 times over"),
            ({"crater_exponent": 1e-9}, "at most 5 times over"),
            ({"craters_per_km2": 1000.0}, "at most 200000 craters"),
            ({"resolution_m": 1e9}, "at most 200000 craters"),
            ({"resolution_m": 1e-9}, "at most 20000 cells"),
            ({"scarp_spacing_m": 1e9}, "at most 20000 cells"),
        ],
    )
    def test_what_takes_minutes_is_refused_at_once(self, change: dict[str, float], said: str) -> None:
        config = CraterTerrainConfig.model_validate(change)
        with pytest.raises(InputError, match=said):
            crater_terrain(config)

    @pytest.mark.parametrize("name", ["mound_radius_m", "rim_radius_m"])
    def test_a_radius_is_at_least_a_millimetre(self, name: str) -> None:
        """Smaller ones are none in single precision."""
        with pytest.raises(ValidationError, match=name):
            CraterTerrainConfig.model_validate({name: 1e-40})
        config = SMALL.model_copy(update={name: 1e-3})
        assert np.isfinite(crater_terrain(config).elevation.elevation_m).all()

    def test_images_hold_what_was_made(self, tmp_path: Path) -> None:
        terrain = crater_terrain(SMALL)
        ground, obstacles, marks = (tmp_path / f"{name}.png" for name in ("ground", "obstacles", "marks"))
        shaded = terrain.elevation.shaded()
        write_grey(ground, shaded)
        write_grey(obstacles, np.where(terrain.hazards.blocked(), np.uint8(255), np.uint8(0)))
        pixels = np.repeat(shaded[..., None], 3, axis=2)
        for step in ((0, 0), (0, 1), (1, 0), (0, -1), (-1, 0)):
            cells = terrain.hazards.cells_at(terrain.landmarks.points_xy_m) + np.array(step)
            inside = ((cells >= 0) & (cells < shaded.shape)).all(axis=1)
            pixels[tuple(cells[inside].T)] = (255, 220, 0)
        Image.fromarray(pixels).save(marks)
        assert (read_grey(ground)[0] == shaded).all()
        origin = terrain.hazards.origin
        assert (read_hazard_image(obstacles, 200.0, origin).cells == terrain.hazards.cells).all()
        found = read_landmark_image(marks, 200.0, origin).points_xy_m
        true = terrain.landmarks.points_xy_m
        away = np.hypot(*(true[:, None] - found[None]).transpose(2, 0, 1))
        # Crosses that touch are read as one.
        alone = np.sort(np.hypot(*(true[:, None] - true[None]).transpose(2, 0, 1)), axis=1)[:, 1] > 900.0
        inside = (true > 400.0).all(axis=1) & (true < [44_600.0, 29_600.0]).all(axis=1)
        assert np.count_nonzero(alone & inside) > 5
        assert away.min(axis=1)[alone & inside].max() <= 100.0 * math.sqrt(2.0) + 1e-6
        with pytest.raises(InputError, match="coloured points"):
            read_landmark_image(ground, 200.0, origin)

    def test_the_default_suits_the_rovers_tasks(self) -> None:
        """Hazards on a fifth of the map; P0, P1, P2 joined by free ground; no straight way from P1 to P2."""
        terrain = crater_terrain(CraterTerrainConfig())
        grid = terrain.hazards
        assert grid.cells.shape == (3000, 4500)
        blocked = grid.blocked()
        assert blocked.mean() >= 0.2
        cells = [grid.cell_at(*place) for place in ((42380, 11590), (33070, 19010.0000002), (10870, 25670))]
        assert cells[1:] == [(1097, 3307), (432, 1087)]
        space = GridSpace(blocked)
        assert space.connected(cells[0], cells[1])
        assert space.connected(cells[1], cells[2])
        assert not space.sees(cells[1], cells[2], cut_corners=True)
        first = along(TASK_1_M)
        away_m = 10.0 * np.sqrt(squared_distances(blocked)[tuple(grid.cells_at(first).T)])
        assert 20.0 < away_m.min() < 100.0
        second = space.shortest(cells[1], cells[2])
        assert second is not None
        for path_m in (first, grid.centres_m(second.cells[::5])):
            assert stretches_without(terrain.landmarks.points_xy_m, path_m) >= 3


def along(corners_m: FloatArray) -> FloatArray:
    """Points about 10 m apart, by a curve of third degree through the corners."""
    s = np.arange(len(corners_m))
    return np.asarray(CubicSpline(s, corners_m)(np.linspace(0.0, s[-1], 120 * len(s))))


def stretches_without(marks_m: FloatArray, path_m: FloatArray) -> int:
    """How many stretches of over 1 km have no landmark within 500 m."""
    away_m = np.hypot(*(path_m[:, None] - marks_m[None]).transpose(2, 0, 1)).min(axis=1)
    s_m = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(path_m, axis=0).T))])
    seen_m = s_m[away_m < 500.0]
    return int(np.count_nonzero(np.diff(seen_m) > 1000.0))


TASK_1_M = np.array(
    [
        [42380.0, 11590.0],
        [42228.6, 12778.8],
        [41877.9, 13925.0],
        [41343.2, 14997.8],
        [40643.3, 15971.0],
        [39800.7, 16823.7],
        [38839.9, 17540.9],
        [37786.4, 18113.5],
        [36665.3, 18538.9],
        [35499.6, 18820.8],
        [34309.5, 18970.4],
        [33110.4, 19010.0],
    ]
)
"""The move to the pose P1 with the report's gains, 30,000 s apart."""
