"""What a finished run leaves in its folder, as records."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from pilotage.core.types import FloatArray
from pilotage.evaluation.finished import FinishedRun, RobotRun, Verdict
from pilotage.experiments.loop import Run
from pilotage.experiments.pictures import is_large, is_terrain, terrain_pictures
from pilotage.experiments.resolve import resolved_yaml
from pilotage.maps.cell_map import CellMap
from pilotage.maps.occupancy_grid import OccupancyGrid
from pilotage.maps.true_cells import true_map
from pilotage.maps.world_map import WorldMap
from pilotage.records.cells import SheetData
from pilotage.records.grid import MOST_CELLS
from pilotage.records.patrol import PatrolRecord
from pilotage.records.plans import Plan, Plans
from pilotage.records.run_folder import RobotFiles, RunFiles
from pilotage.records.trace import merged, trace_of
from pilotage.records.world import RobotOutline, World, landmarks_of


def files_of(run: Run, verdict: Verdict, metrics: Mapping[str, object]) -> RunFiles:
    """Everything that a run's folder holds."""
    finished = run.finished
    world = _world(finished)
    traces = {
        robot.name: _joined(robot.trace, columns)
        for robot, columns in zip(finished.robots, verdict.columns, strict=True)
    }
    single = len(traces) == 1
    chart = finished.chart
    return RunFiles(
        trace=trace_of(next(iter(traces.values()))) if single else merged(traces),
        metrics=metrics,
        events=tuple(finished.events),
        mission_text=resolved_yaml(finished.mission, chart),
        world=world,
        terrain=terrain_pictures(finished, run.sightings[0].seen()),
        grid=drawn_grid(chart),
        people=run.people.tracks(),
        patrol=_patrol(verdict),
        robots=tuple(
            RobotFiles(
                plans=_plans(robot, verdict),
                sightings=run.sightings[index].seen(),
                updates=tuple(run.albums[index].pictures()),
                cells=_cells(finished, robot, world, verdict),
                own_map=_own_map(robot),
            )
            for index, robot in enumerate(finished.robots)
        ),
    )


def _patrol(verdict: Verdict) -> PatrolRecord | None:
    """What the task of patrolling saw."""
    told = {
        name.removeprefix("patrol/"): array
        for name, array in verdict.extras.items()
        if name.startswith("patrol/")
    }
    if not told:
        return None
    whole = {name: told[name].astype(np.int64) for name in ("edges", "tour")}
    return PatrolRecord(**{**told, **whole, "cell_m": float(told["cell_m"])})  # type: ignore[arg-type]


def _joined(trace: Mapping[str, FloatArray], columns: Mapping[str, FloatArray]) -> dict[str, FloatArray]:
    """A trace with what was worked out for its rows; where nobody drove, the rows are those of the plan."""
    rows = len(trace["t_s"])
    if columns and any(len(values) != rows for values in columns.values()):
        return dict(columns)
    return {**trace, **columns}


def _world(run: FinishedRun) -> World:
    """Walls, landmarks, what no robot was told of, outlines, starts and goals; of a sheet what lies on it."""
    chart, markings = run.chart, run.chart.markings
    sheet = None if markings is None else markings.source
    robots = tuple(_outline(robot) for robot in run.robots)
    landmarks = landmarks_of(chart.landmarks.ids, chart.landmarks.points_xy_m)
    if sheet is not None and markings is not None:
        boxes = [(min(a, c), min(b, d), max(a, c), max(b, d)) for a, b, c, d in sheet.obstacles]
        return World(
            bounds_m=chart.bounds_m,
            landmarks=landmarks,
            robots=robots,
            boxes_m=np.array(boxes, dtype=np.float64).reshape(-1, 4),
            lines_m=tuple(np.array(line, dtype=np.float64).reshape(-1, 2) for line in sheet.lines),
            tape_width_m=markings.tape_width_m,
            cells=sheet.cells,
        )
    known = drawn_walls(chart)
    return World(
        segments_m=known,
        circles_m=np.zeros((0, 3)) if chart.geometry is None else chart.geometry.circles_m,
        bounds_m=chart.bounds_m,
        landmarks=landmarks,
        obstacle_segments_m=run.obstacle_segments_m,
        obstacle_circles_m=run.obstacle_circles_m,
        obstacle_polygons_m=tuple(run.obstacle_polygons_m),
        robots=robots,
    )


def drawn_walls(chart: WorldMap) -> FloatArray:
    """Walls as segments; of a large grid none: what is drawn of it are its cells, or its picture."""
    if chart.geometry is not None:
        return chart.geometry.segments_m
    if chart.grid is not None and is_large(chart.grid):
        return np.zeros((0, 4))
    return chart.walls.segments_m


def drawn_grid(chart: WorldMap) -> OccupancyGrid | None:
    """The grid that is drawn as one: that of a floor, in blocks where no record holds its cells."""
    grid = chart.grid
    if grid is None or chart.geometry is not None or (is_terrain(chart) and is_large(grid)):
        return None
    step = 1
    while math.ceil(grid.rows / step) * math.ceil(grid.columns / step) > MOST_CELLS:
        step += 1
    return grid.in_blocks(step)


def _outline(robot: RobotRun) -> RobotOutline:
    start, footprint = robot.start, robot.footprint
    return RobotOutline(
        name=robot.name,
        radius_m=footprint.radius_m,
        polygon_m=footprint.points_m,
        start=(start.x_m, start.y_m, start.theta_rad),
        goals=tuple((goal.x_m, goal.y_m, goal.theta_rad) for goal in robot.goals),
    )


def _plans(robot: RobotRun, verdict: Verdict) -> Plans:
    """Every plan adopted, the obstacle points mapped, the exact shortest path."""
    mapped = robot.results.get("mapped_circles_m")
    shortest = verdict.extras.get(f"{robot.name}/shortest_path")
    return Plans(
        tuple(
            Plan(p.states, p.waypoints, p.tree_edges_m, p.t_s, p.length_m, p.planning_time_s, p.clearance_m)
            for p in robot.plans
        ),
        np.zeros((0, 2)) if mapped is None else np.asarray(mapped)[:, :2],
        np.zeros((0, 2)) if shortest is None else shortest,
    )


def _own_map(robot: RobotRun) -> OccupancyGrid | None:
    """The map that a robot made of a floor."""
    grid = robot.results.get("grid")
    return grid if isinstance(grid, OccupancyGrid) else None


def _cells(run: FinishedRun, robot: RobotRun, world: World, verdict: Verdict) -> SheetData | None:
    """The cell maps of an explorer: its own, its visited layer, what is true, what was visited and when."""
    cells = robot.results.get("cells")
    markings = run.chart.markings
    if not isinstance(cells, CellMap) or markings is None or markings.source is None:
        return None
    if f"{robot.name}/visited" not in verdict.extras:
        return None  # an explorer may drive in a task that does not judge exploring
    left = robot.results["left"]
    told = {
        name: verdict.extras[f"{robot.name}/{name}"] for name in ("visited", "first_visit_s", "reachable")
    }
    return SheetData(
        size_m=markings.size_m,
        boxes_m=world.boxes_m,
        lines_m=world.lines_m,
        tape_width_m=markings.tape_width_m,
        robot_radius_m=robot.footprint.radius_m,
        states=cells.states,
        true_states=true_map(markings.source).cells.states,
        visited=told["visited"] > 0.5,
        own_visited=np.asarray(robot.results["visited"]),
        first_visit_s=told["first_visit_s"],
        reachable=told["reachable"] > 0.5,
        left=np.array([[cell.row, cell.column] for cell in left], dtype=np.int64).reshape(-1, 2),  # type: ignore[attr-defined]
        left_reasons=tuple(cell.reason for cell in left),  # type: ignore[attr-defined]
    )
