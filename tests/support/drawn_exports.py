"""Runs with names, columns and times that nobody expects, to be handed on."""

from __future__ import annotations

import random
from pathlib import Path
from typing import Any

import numpy as np

from pilotage.records.trace import merged, write_trace
from support.fabricated_run import fabricate_columns, fabricate_run

NAMES = (
    "Guard 1",
    "guard-1",
    "一",
    "二",
    "../up",
    "/",
    ".",
    "A",
    "a",
    "<b>",
    "map",
    "tf",
    "a" * 300,
    "x-truth",
    "x",
)
COLUMNS = (
    "class",
    "from",
    "None",
    "",
    " ",
    "é",
    "一",
    "a" * 400,
    "float64",
    "header",
    "x/y",
    "1",
    "A",
    "a",
    "a__b",
)
BEGIN_S = (0.0,) * 4 + (-5.0, -1e9, 2.0**31 - 1, 2.0**31 + 5, 1e12)
VALUES = (np.nan, np.inf, -np.inf, 1e300, 1e-310, 0.0, 1e9)
FORMS = (("mcap", "a.mcap"), ("rosbag", "bag"), ("rosbag", "a.bag"), ("tum", "tum"), ("csv", "a.csv"))


def exported(folder: Path, rng: random.Random) -> tuple[str, ...]:
    """One robot with odd columns and times, or a team with odd names."""
    steps = rng.choice((1, 2, 3, 30))
    columns: dict[str, Any] = fabricate_columns(max(steps, 2), np.random.default_rng(rng.randrange(2**32)))
    columns = {name: values[:steps] for name, values in columns.items()}
    for name in rng.sample(COLUMNS, rng.choice((0, 0, 3))):
        columns[name] = np.ones(steps)
    for name in columns:
        if name != "t_s" and rng.random() < 0.1:
            columns[name] = np.full(steps, rng.choice(VALUES))
    columns["t_s"] = rng.choice(BEGIN_S) + rng.choice((0.1, 0.1, 1e-9, 1e3)) * np.arange(steps)
    run = fabricate_run(folder / "run", steps=max(steps, 2), columns=columns)
    if rng.random() < 0.5:
        names = rng.sample(NAMES, rng.choice((2, 3, 8)))
        write_trace(run, merged(dict.fromkeys(names, columns)))
    to, out = rng.choice(FORMS)
    return ("export", "run", "--to", to, "--out", out)
