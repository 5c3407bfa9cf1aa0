"""``pilotage plan``: one planning query on a map."""

from __future__ import annotations

import math
from typing import Annotated, Any

import typer

from pilotage.cli.options import Json, Overrides, Plugins, Seed
from pilotage.cli.output import print_answer, stdout_for_json, tell_if_cold, worded
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
    clearance: Annotated[
        float | None, typer.Option(metavar="M", help="Distance to keep; default the planner's own.")
    ] = None,
    footprint: Annotated[
        str | None,
        typer.Option(
            metavar="R|X,Y...",
            help="The robot's outline: a radius, or corners with spaces between.",
        ),
    ] = None,
    overrides: Overrides = None,
    seed: Seed = None,
    json: Json = False,
    plugin: Plugins = None,  # noqa: ARG001 - loaded while the options are read
) -> int:
    """Plan a path on a map and say how long it is against the shortest one."""
    from_, to = parse_pose(start, "--start"), parse_pose(goal, "--goal")
    outline = None if footprint is None else parse_outline(footprint)
    from pilotage.face.planning import plan as planned_by

    tell_if_cold()
    with stdout_for_json(json):
        answer = planned_by(
            map_,
            from_,
            to,
            planner=planner,
            clearance_m=clearance,
            footprint=outline,
            slope_limit_deg=slope_limit,
            seed=seed or 0,
            set=overrides or (),
        ).answer
    rows = [(key, _show(value)) for key, value in answer.items() if key != "path"]
    print_answer(answer, rows, as_json=json)
    return 0 if answer["success"] else 1


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


def parse_outline(text: str) -> float | list[tuple[float, ...]]:
    """Read ``R`` or ``X,Y X,Y X,Y ...``.

    Raises
    ------
    InputError
        If it is neither.
    """
    try:
        corners = [tuple(float(part) for part in corner.split(",")) for corner in text.split()]
    except ValueError:
        corners = []
    if len(corners) == 1 and len(corners[0]) == 1:
        return corners[0][0]
    if not corners or any(len(corner) != 2 for corner in corners):
        raise InputError(f"--footprint: expected a radius or corners 'X,Y X,Y X,Y' in metres, found '{text}'")
    return corners


def _show(value: Any) -> str:
    return "-" if isinstance(value, float) and not math.isfinite(value) else worded(value)
