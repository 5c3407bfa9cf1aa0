"""``pilotage bench-scen``: every problem of a MovingAI scenario file."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from pilotage.cli.options import Json
from pilotage.cli.output import print_columns, print_json, print_line, stdout_for_json


def bench_scen(
    map_: Annotated[Path, typer.Argument(metavar="MAP", help="A MovingAI map file.")],
    scenario: Annotated[Path, typer.Argument(metavar="SCEN", help="Its scenario file.")],
    json: Json = False,
) -> int:
    """Solve every problem of a MovingAI scenario file and compare with its optimal lengths."""
    from pilotage.experiments.scenario_benchmark import run_scenario

    with stdout_for_json(json):
        answer = run_scenario(map_, scenario)
    if json:
        print_json(answer)
    else:
        shown = {key: value for key, value in answer.items() if key != "failures"}
        print_columns(
            (key, f"{value:.4g}" if isinstance(value, float) else str(value)) for key, value in shown.items()
        )
        for failure in answer["failures"]:
            print_line(f"missed: {failure}")
    return 0 if answer["success"] else 1
