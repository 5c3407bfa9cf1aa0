"""``pilotage components``: what can be named in a mission file or a study."""

from __future__ import annotations

from typing import Annotated

import typer

from pilotage.cli.options import Json, Plugins
from pilotage.cli.output import print_columns, print_json


def components(
    name: Annotated[str | None, typer.Argument(metavar="NAME", help="One component: its parameters.")] = None,
    json: Json = False,
    plugin: Plugins = None,  # noqa: ARG001 - loaded while the options are read
) -> None:
    """List the components and metrics, or what there is to know of one of them."""
    from pilotage.experiments.catalogue import components as registered

    rows = registered(name)
    if json:
        print_json({"parameters" if name else "components": rows})
    else:
        print_columns(rows)
