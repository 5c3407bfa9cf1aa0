"""``pilotage draw`` and ``pilotage vectorize``: what was understood of a map, and walls from its cells."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, TypeAlias

import typer

from pilotage.cli.options import Json
from pilotage.cli.output import print_answer, print_json, print_line

MAP_HELP = "A shipped map's name or a file: walls, a sheet, a ROS map, MovingAI, an image, heights."
Resolution: TypeAlias = Annotated[
    float | None,
    typer.Option(metavar="M", help="Metres a cell of a file that does not say, such as an image."),
]


def draw(
    map_: Annotated[str, typer.Argument(metavar="MAP", help=MAP_HELP)],
    out: Annotated[
        Path | None,
        typer.Option(metavar="FILE.png", help="The picture; default MAP.png, or the next number."),
    ] = None,
    resolution: Resolution = None,
    json: Json = False,
) -> None:
    """Draw a map as it is understood, and say what it has."""
    from pilotage.face.maps import draw as drawn_by

    drawn = drawn_by(map_, out, resolution_m=resolution)
    answer = {**drawn.layers, "picture": str(drawn.path)}
    print_answer(answer, [(key, _in_words(value)) for key, value in answer.items()], as_json=json)


def _in_words(value: object) -> str:
    """For people: 384 cells of 0.05 m end at 9.2 m, not at 9.200000000000003."""
    if isinstance(value, list):
        return f"[{', '.join(_in_words(one) for one in value)}]"
    return str(round(value, 9) if isinstance(value, float) else value)


def vectorize(
    map_: Annotated[str, typer.Argument(metavar="MAP", help="A ROS map, a MovingAI map or an image.")],
    out: Annotated[
        Path | None, typer.Option(metavar="FILE.yaml", help="The map; default the map's name, -walls.yaml.")
    ] = None,
    tolerance: Annotated[
        float,
        typer.Option(metavar="M", help="How far a wall may lie from the cells: 0 keeps their staircases."),
    ] = 0.0,
    resolution: Resolution = None,
    json: Json = False,
) -> None:
    """Make a map of walls from a map of cells, so that a filter on walls works on it."""
    from pilotage.experiments.build.charts import load_chart
    from pilotage.face.maps import vectorize as vectorized_by

    path = vectorized_by(map_, out, tolerance_m=tolerance, resolution_m=resolution)
    walls = len(load_chart(str(path)).walls.segments_m)
    if json:
        print_json({"map": str(path), "walls": walls})
    else:
        print_line(f"{path}: {walls} walls")
