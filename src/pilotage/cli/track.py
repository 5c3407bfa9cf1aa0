"""``pilotage track``: the path of a robot on a map, from a film."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import Annotated

import typer

from pilotage.cli.options import Json
from pilotage.cli.output import print_answer, print_line
from pilotage.core.whole_file import made_folder
from pilotage.face.progress import StatusLine


def track(
    video: Annotated[
        str, typer.Argument(metavar="VIDEO", help="A film by a fixed camera that sees the map.")
    ],
    corners: Annotated[
        str | None,
        typer.Option(
            metavar="X,Y,X,Y,X,Y,X,Y",
            help="The map's corners in pixels: from its origin counter-clockwise as seen; else found.",
        ),
    ] = None,
    hsv: Annotated[
        str | None,
        typer.Option(metavar="H0,S0,V0,H1,S1,V1", help="The robot's colour, hue 0 to 179; else learned."),
    ] = None,
    grid: Annotated[int, typer.Option(metavar="N", help="Cells along a side.")] = 25,
    size: Annotated[float, typer.Option(metavar="M", help="Side of the square map in metres.")] = 1.8,
    radius: Annotated[
        float | None, typer.Option(metavar="M", help="Radius of the robot's coloured disc; else learned.")
    ] = None,
    height: Annotated[
        float, typer.Option(metavar="M", help="Height of that disc over the floor, taken back in metres.")
    ] = 0.0,
    out: Annotated[
        str | None,
        typer.Option(metavar="DIR", help="Write JSON, CSV, map picture, text maps, annotated film."),
    ] = None,
    json: Json = False,
) -> int:
    """Track a robot on a square map through a film."""
    from pilotage.tracking.output import annotated_film, write_track
    from pilotage.tracking.robot_colour import parse_hsv
    from pilotage.tracking.scene import TrackOptions, learn_scene
    from pilotage.tracking.sheet import parse_corners
    from pilotage.tracking.track import follow

    options = TrackOptions(
        None if corners is None else parse_corners(corners),
        None if hsv is None else parse_hsv(hsv),
        grid,
        size,
        radius,
        height,
    )
    film = Path(video)
    with _progress("learning") as advance:
        scene = learn_scene(film, options, advance)
    folder = None if out is None else Path(out)
    written: list[Path] = []
    with ExitStack() as made:
        writer = None
        if folder is not None:
            made.enter_context(made_folder(folder))
            writer = made.enter_context(annotated_film(folder, scene))
        with _progress("tracking") as advance:
            result = follow(film, scene, writer, advance)
        if folder is not None:
            written = write_track(folder, result)
    values = result.as_dict()
    broke = scene.film.broke_at_frame
    if broke is not None:
        promised = scene.film.promised
        print_line(f"pilotage: {video}: breaks off at frame {broke} of {promised}", sys.stderr)
    rows = [
        ("frames", str(values["frames"])),
        ("tracked", str(values["tracked"])),
        ("corners_px", "  ".join(f"{x:.1f},{y:.1f}" for x, y in values["corners_px"])),
        ("visited_cells", f"{values['visited_count']} of {grid * grid}"),
        ("jitter_px", f"{values['jitter_px']:.2f}"),
        *(("written", str(path)) for path in written),
    ]
    print_answer(values, rows, as_json=json)
    return 0 if values["tracked"] or values["frames"] == 1 else 1


@contextmanager
def _progress(what: str) -> Iterator[Callable[[int, int], None]]:
    """Yield what shows how far a pass is: a bar on a terminal, a line now and then elsewhere."""
    line = StatusLine(sys.stderr)

    def show(done: int, promised: int) -> None:
        if not line.is_due():
            return
        share = min(done / promised, 1.0) if promised else 0.0
        bar = "#" * round(30 * share) + "-" * (30 - round(30 * share))
        line.show(f"{what} [{bar}] frame {done}" + (f" of {promised}" if promised else ""))

    try:
        yield show
    finally:
        line.close()
