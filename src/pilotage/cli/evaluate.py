"""``pilotage evaluate``: an estimated trajectory against its reference."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from pilotage.cli.options import Json
from pilotage.cli.output import print_columns, print_json
from pilotage.core.errors import InputError, unknown_name


def evaluate(
    estimate: Annotated[Path, typer.Argument(metavar="ESTIMATE", help="The trajectory to judge.")],
    reference: Annotated[Path, typer.Argument(metavar="REFERENCE", help="The true one.")],
    form: Annotated[
        str | None,
        typer.Option("--format", metavar="tum|kitti", help="Format of both; by default told by the columns."),
    ] = None,
    align: Annotated[bool, typer.Option("--align", help="Rotate and shift the estimate first.")] = False,
    scale: Annotated[bool, typer.Option("--scale", help="Correct the estimate's scale first.")] = False,
    json: Json = False,
) -> int:
    """Say how far an estimated trajectory is from its reference (absolute and relative errors)."""
    from pilotage.evaluation.trajectory import trajectory_errors
    from pilotage.logs.trajectories import TrajectoryFormat, guess_format, read_trajectory

    names = [str(name) for name in TrajectoryFormat]
    if form is not None and form not in names:
        raise unknown_name("--format", form, names)
    if form is None:
        formats = [guess_format(path) for path in (estimate, reference)]
        if formats[0] is not formats[1]:
            raise InputError(
                "evaluate: expected both files in one format, found by their columns "
                f"{estimate} as {formats[0]} and {reference} as {formats[1]}"
            )
        form = formats[0]
    judged = TrajectoryFormat(form)
    found, true = read_trajectory(estimate, judged), read_trajectory(reference, judged)
    if found.t_s is None and len(found) != len(true):
        short, full = (estimate, reference) if len(found) < len(true) else (reference, estimate)
        raise InputError(
            f"{short}: without times expected as many poses as in {full} ({max(len(found), len(true))}), "
            f"found {min(len(found), len(true))}; is the file cut short?"
        )
    errors = trajectory_errors(found, true, align=align, scale=scale)
    answer = {**errors.summary(), "format": form, "align": align, "scale_corrected": scale}
    if json:
        print_json(answer)
    else:
        print_columns(
            (key, f"{value:.6g}" if isinstance(value, float) else str(value)) for key, value in answer.items()
        )
    return 0
