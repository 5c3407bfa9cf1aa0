"""``pilotage plan``: one planning query on a map."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any

import typer

from pilotage.cli.options import Json, Overrides, Plugins, Seed
from pilotage.cli.output import print_columns, print_json, stdout_for_json
from pilotage.core.errors import InputError


def plan(
    map_: Annotated[
        str,
        typer.Argument(
            metavar="MAP", help="A shipped map's name or a file: walls, a grid, an elevation model."
        ),
    ],
    start: Annotated[str, typer.Option(metavar="X,Y[,TH]", help="Start in metres and radians.")],
    goal: Annotated[str, typer.Option(metavar="X,Y[,TH]", help="Goal; without TH any heading will do.")],
    planner: Annotated[
        str | None, typer.Option(help="Registered name; default rrt-star-dubins, astar on grids.")
    ] = None,
    slope_limit: Annotated[
        float | None,
        typer.Option(metavar="DEG", help="MAP is an elevation model; what is steeper is a hazard."),
    ] = None,
    overrides: Overrides = None,
    seed: Seed = None,
    json: Json = False,
    plugin: Plugins = None,  # noqa: ARG001 - loaded while the options are read
) -> int:
    """Plan a path on a map and say how long it is against the shortest one."""
    from_, to = parse_pose(start, "--start"), parse_pose(goal, "--goal")
    with stdout_for_json(json):
        answer = _answer(map_, from_, to, planner, overrides or (), seed or 0, slope_limit)
    if json:
        print_json(answer)
    else:
        print_columns((key, _show(value)) for key, value in answer.items() if key != "path")
    return 0 if answer["success"] else 1


def _answer(
    map_: str,
    start: tuple[float, ...],
    goal: tuple[float, ...],
    planner: str | None,
    overrides: Sequence[str],
    seed: int,
    slope_limit_deg: float | None,
) -> dict[str, Any]:
    """Ask on a grid where the file holds one, else on a map of walls."""
    if Path(map_).suffix:
        from pilotage.experiments.grid_planning import is_grid_map, plan_on_grid

        if is_grid_map(map_):
            return plan_on_grid(Path(map_), start, goal, planner or "astar", overrides, slope_limit_deg)
    if slope_limit_deg is not None:
        raise InputError(f"--slope-limit: expected an elevation model's file, found the map '{map_}'")
    from pilotage.experiments.planning import plan_on_map

    return plan_on_map(map_, start, goal, planner or "rrt-star-dubins", overrides, seed)


def parse_pose(text: str, option: str) -> tuple[float, ...]:
    """Read ``X,Y`` or ``X,Y,TH``.

    Raises
    ------
    InputError
        If it is not two or three finite numbers.
    """
    try:
        values = tuple(float(part) for part in text.split(","))
    except ValueError:
        values = ()
    if len(values) not in (2, 3) or not all(math.isfinite(value) for value in values):
        raise InputError(f"{option}: expected X,Y or X,Y,TH in metres and radians, found '{text}'")
    return values


def _show(value: Any) -> str:
    if isinstance(value, float):
        return f"{value:.4g}" if math.isfinite(value) else "-"
    return str(value)
