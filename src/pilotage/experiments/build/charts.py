"""Finding a mission's map, whatever its format: a shipped name, a file, or the map itself."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache
from importlib import resources
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

from pilotage.core.config import Config, validate
from pilotage.core.errors import InputError, unknown_name
from pilotage.core.file_kinds import check_kind
from pilotage.core.neighbours import found_instead
from pilotage.core.types import Pose2
from pilotage.experiments.values import parse_yaml, read_text
from pilotage.maps.crater_cache import cached_crater_terrain
from pilotage.maps.distance_field import SPACING_M
from pilotage.maps.edge import closed
from pilotage.maps.elevation_file import HEIGHTS_ALONE, read_elevation
from pilotage.maps.grid_file import GRID_SUFFIXES, read_grid
from pilotage.maps.grid_image import as_bytes, read_grey, read_hazard_image
from pilotage.maps.known_maps import KEPT, known_map
from pilotage.maps.landmark_image import read_landmark_image
from pilotage.maps.landmark_table import read_landmark_table
from pilotage.maps.landmarks import Landmarks
from pilotage.maps.map_file import LandmarkMap, MapFile, build_map, parse_map
from pilotage.maps.markings import FloorMarkings
from pilotage.maps.occupancy_grid import OccupancyGrid
from pilotage.maps.segment_map import SegmentMap, box_segments
from pilotage.maps.true_cells import SheetFile
from pilotage.maps.world_map import WorldMap
from pilotage.missions.map_choice import CraterMap, ElevationMap, GridMap, ImagesMap
from pilotage.missions.world import MarkingsConfig, WorldConfig

SHIPPED = resources.files("pilotage.missions") / "maps"
PLAIN = MarkingsConfig()
MapSource = str | MapFile | SheetFile | CraterMap | ImagesMap | ElevationMap | GridMap


ROS_KEYS = frozenset({"resolution", "origin", "negate", "occupied_thresh", "free_thresh"})
"""What a ROS map's file says beside its image; no other map has them."""


def shipped_maps() -> list[str]:
    """Names of the maps that come with pilotage."""
    return sorted(
        entry.name.removesuffix(".yaml") for entry in SHIPPED.iterdir() if entry.name.endswith(".yaml")
    )


def load_chart(source: MapSource, markings: MarkingsConfig = PLAIN) -> WorldMap:
    """Load a map of any format; the same object again for one that was just met.

    Raises
    ------
    InputError
        Where no such map is shipped, the file is missing, or what it holds is no map.
    """
    return known_map(_read(source, markings))


def _read(source: MapSource, markings: MarkingsConfig) -> WorldMap:
    """From wherever it is told of."""
    if isinstance(source, str):
        return _named(source, markings)
    if isinstance(source, MapFile):
        return _walls(build_map(source, "world.map"))
    if isinstance(source, SheetFile):
        return _sheet(source, "sheet", markings)
    if isinstance(source, CraterMap):
        terrain = cached_crater_terrain(source)
        grid = terrain.hazards
        return WorldMap(
            "crater",
            bounds_of(grid),
            grid=grid,
            elevation=terrain.elevation,
            slope_limit_deg=source.slope_limit_deg,
            landmarks=terrain.landmarks,
            open_ground=True,
        )
    if isinstance(source, ImagesMap):
        return _images(source)
    path = Path(source.file)
    origin = None if source.origin is None else Pose2(*source.origin)
    if isinstance(source, ElevationMap):
        elevation = read_elevation(path, origin, source.resolution_m)
        hazards = elevation.hazards(source.slope_limit_deg)
        return WorldMap(
            path.stem,
            bounds_of(hazards),
            grid=hazards,
            elevation=elevation,
            slope_limit_deg=source.slope_limit_deg,
            open_ground=True,
        )
    if path.suffix.lower() in HEIGHTS_ALONE:
        raise InputError(f"world.map.file: expected a grid map, found '{path}'; take name: elevation")
    return replace(_grid(path, source.resolution_m, origin), open_ground=source.open_ground)


def chart_of(world: WorldConfig) -> WorldMap:
    """The chart of a mission's world, its edge closed where cells are its walls, its landmarks put on it."""
    return known_map(_with_landmarks(_read(world.map, world.markings), world))


def _with_landmarks(chart: WorldMap, world: WorldConfig) -> WorldMap:
    if chart.grid is not None and chart.geometry is None and not chart.open_ground:
        chart = replace(chart, grid=closed(chart.grid))  # its bounds stay: they are those of the floor
    if world.landmarks is None:
        return chart
    if isinstance(world.landmarks, str):
        return chart.with_landmarks(read_landmark_table(Path(world.landmarks)))
    ids = np.array([entry.id for entry in world.landmarks], dtype=np.int64)
    points = np.array([(entry.x_m, entry.y_m) for entry in world.landmarks]).reshape(-1, 2)
    return chart.with_landmarks(Landmarks(ids, points))


def bounds_of(grid: OccupancyGrid) -> tuple[float, float, float, float]:
    """The rectangle around a grid, which may be turned."""
    width, height = grid.size_m
    corners = grid.origin.placed(np.array([[0.0, 0.0], [width, 0.0], [0.0, height], [width, height]]))
    (xmin, ymin), (xmax, ymax) = corners.min(axis=0).tolist(), corners.max(axis=0).tolist()
    return xmin, ymin, xmax, ymax


def _named(source: str, markings: MarkingsConfig) -> WorldMap:
    """A shipped map, or a file by its suffix and its keys."""
    path = Path(source)
    suffix = path.suffix.lower()
    if not suffix and "/" not in source:
        if source not in shipped_maps():
            raise unknown_name("map", source, shipped_maps())
        return _shipped((SHIPPED / f"{source}.yaml").read_text(), source, markings)
    if not path.is_file():
        found = found_instead(path, {".yaml", ".yml", *GRID_SUFFIXES, *HEIGHTS_ALONE})
        raise InputError(f"map '{source}': expected a map file, found {found}")
    if suffix in HEIGHTS_ALONE:
        return _read(validate(ElevationMap, {"name": "elevation", "file": source}, "map"), markings)
    if suffix in {".yaml", ".yml"}:
        values = parse_yaml(read_text(path), str(path))
        if "image" not in values and ROS_KEYS & values.keys():
            raise InputError(
                f"{path}: image: missing; a ROS map names its image beside "
                f"{', '.join(sorted(ROS_KEYS & values.keys()))}"
            )
        return _grid(path) if "image" in values else _of_values(values, str(path), markings)
    if suffix in GRID_SUFFIXES:
        return _grid(path)
    raise InputError(
        f"map '{source}': expected a map of walls or a sheet (.yaml), a ROS map (.yaml with an image), or a "
        f"grid ({', '.join(sorted(GRID_SUFFIXES))}) or heights ({', '.join(sorted(HEIGHTS_ALONE))}), "
        f"found '{suffix}'"
    )


@lru_cache(maxsize=KEPT)
def _shipped(text: str, name: str, markings: MarkingsConfig) -> WorldMap:
    """A map that comes with pilotage, which each trial of a study asks for."""
    return _of_values(parse_yaml(text, name), name, markings)


def _of_values(values: dict[str, Any], where: str, markings: MarkingsConfig) -> WorldMap:
    """A map of walls, or a sheet of boxes and tapes."""
    check_kind(values, "map", where)
    if "size_m" in values and "walls_m" not in values:
        return _sheet(validate(SheetFile, values, where), Path(where).stem, markings)
    return _walls(parse_map(values, where))


def _walls(floor: LandmarkMap) -> WorldMap:
    return WorldMap(floor.name, floor.walls.bounds_m, geometry=floor.walls, landmarks=floor.landmarks)


def _sheet(sheet: SheetFile, name: str, markings: MarkingsConfig) -> WorldMap:
    """Boxes as walls, tapes and edge as markings."""
    sides = [
        box_segments(0.5 * (x0 + x1), 0.5 * (y0 + y1), abs(x1 - x0), abs(y1 - y0), 0.0)
        for x0, y0, x1, y1 in sheet.obstacles
    ]
    pieces = [(*start, *end) for line in sheet.lines for start, end in pairwise(line)]
    bounds = (0.0, 0.0, *sheet.size_m)
    return WorldMap(
        name,
        bounds,
        geometry=SegmentMap(np.concatenate([np.zeros((0, 4)), *sides]), np.zeros((0, 3)), bounds),
        markings=FloorMarkings(
            sheet.size_m,
            sheet.cells,
            np.array(pieces, dtype=np.float64).reshape(-1, 4),
            markings.tape_width_m,
            markings.edge_is_dark,
            sheet,
        ),
    )


def _grid(path: Path, resolution_m: float | None = None, origin: Pose2 | None = None) -> WorldMap:
    grid = read_grid(path, resolution_m, origin)
    # Programs that draw maps leave much of the image grey: cells are for where somebody may be. Nodes of the
    # map's distances lie where they would over all of it.
    grid = grid.known_part(max(1, round(SPACING_M / grid.resolution_m)))
    return WorldMap(path.stem, bounds_of(grid), grid=grid)


def _images(source: ImagesMap) -> WorldMap:
    origin = Pose2(*source.origin_m, 0.0)
    hazards = read_hazard_image(Path(source.obstacles), source.resolution_m, origin)
    size = (int(hazards.cells.shape[0]), int(hazards.cells.shape[1]))
    picture = None
    if source.environment is not None:
        picture = as_bytes(read_grey(Path(source.environment), size)[0])
    chart = WorldMap(
        "images", bounds_of(hazards), grid=hazards, picture=picture, open_ground=source.open_ground
    )
    if source.landmarks is None:
        return chart
    return chart.with_landmarks(
        read_landmark_image(Path(source.landmarks), source.resolution_m, origin, size)
    )


def inlined(source: MapSource, chart: WorldMap) -> Any:
    """What stands for a map in a mission that is to run again from its file alone.

    Walls and sheets are written into it; grids of many cells stay in their files, named so that they are
    found from anywhere.
    """
    if isinstance(source, str):
        if source in shipped_maps():
            return source
        if chart.markings is not None and chart.markings.source is not None:
            return chart.markings.source.model_dump(mode="json")
        if chart.geometry is None:
            return str(Path(source).absolute())
        return {
            "map": chart.name,
            "bounds_m": list(chart.bounds_m),
            "walls_m": chart.geometry.segments_m.tolist(),
            "circles_m": chart.geometry.circles_m.tolist(),
            "landmarks": [
                {"id": int(i), "x_m": float(x), "y_m": float(y)}
                for i, (x, y) in zip(chart.landmarks.ids, chart.landmarks.points_xy_m, strict=True)
            ],
        }
    values = Config.model_dump(source, mode="json")
    for key in ("file", "obstacles", "environment", "landmarks"):
        if isinstance(values.get(key), str):
            values[key] = str(Path(values[key]).absolute())
    return values
