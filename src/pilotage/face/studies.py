"""Studies: settings times seeds, judged."""

from __future__ import annotations

import contextlib
import hashlib
import json
from collections.abc import Mapping, Sequence
from functools import cached_property
from pathlib import Path
from typing import Any

from pilotage.core import given
from pilotage.core.config import validate
from pilotage.core.errors import InputError
from pilotage.core.given import FilePath
from pilotage.core.interruptions import interruptible
from pilotage.experiments.resolve import resolved_values
from pilotage.experiments.studies.definition import StudyDefinition
from pilotage.experiments.studies.engine import Listener, run_study
from pilotage.experiments.studies.export import export
from pilotage.experiments.studies.findings import study_object
from pilotage.experiments.studies.options import StudyOptions
from pilotage.experiments.studies.study import Study as Definition
from pilotage.experiments.studies.study import make_study
from pilotage.experiments.studies.table import StudyTable, read_study
from pilotage.face.missions import MissionLike, as_mission
from pilotage.face.tables import Table

FURTHER = 4
"""Metrics in the table where none are asked for."""


class Study:
    """A study by its folder.

    Attributes
    ----------
    folder
        Where its definition, its database of trials and its exports are.
    """

    def __init__(self, folder: Path) -> None:
        self.folder = folder

    def __repr__(self) -> str:
        answer = self.answer
        return f"Study({answer['study']!r}, {answer['trials']} trials, {answer['failed']} failed)"

    def _repr_html_(self) -> str:
        return self.table()._repr_html_()

    @cached_property
    def answer(self) -> Mapping[str, Any]:
        """Everything, as ``pilotage study --json`` prints it: counts, and one object a cell."""
        return study_object(self.rows)

    @cached_property
    def rows(self) -> StudyTable:
        """Every finished trial as columns: ``rows.values["duration_s"]``, ``rows.cell``, ``rows.seed``."""
        return read_study(self.folder)

    def table(self, *metrics: str) -> Table:
        """One row a setting: its values, how often it succeeded, and means with their 95 % bands.

        Parameters
        ----------
        metrics
            Which to show; none given: those that the study asked for, else what matters most.

        Raises
        ------
        InputError
            Where no trial gave a metric.
        """
        cells = self.answer["cells"]
        given = list(cells[0]["metrics"])
        for name in metrics:
            if name not in given:
                raise InputError(f"table: expected metrics among {', '.join(given)}, found '{name}'")
        shown = list(metrics) or (given if self.rows.study.definition.metrics else given[:FURTHER])
        factors = list(dict.fromkeys(key for cell in cells for key in cell["values"]))
        columns = [*factors, "trials", "success"]
        for name in shown:
            columns += [name, f"{name}_low", f"{name}_high"]
        rows = []
        for cell in cells:
            row: list[Any] = [cell["values"].get(factor, "") for factor in factors]
            row += [cell["success"]["n"], _number(cell["success"]["mean"])]
            for name in shown:
                row += [_number(cell["metrics"][name][key]) for key in ("mean", "low", "high")]
            rows.append(tuple(row))
        return Table(tuple(columns), tuple(rows))


@interruptible()
def study(
    mission: MissionLike,
    vary: Mapping[str, Sequence[Any]],
    *,
    trials: int = 10,
    metrics: Sequence[str] = (),
    workers: int | None = None,
    name: str | None = None,
    out: FilePath = "studies",
    resume: bool = True,
) -> Study:
    """Run a mission with every combination of settings, each with the same seeds.

    Parameters
    ----------
    mission
        What ``load`` gives, or what it takes.
    vary
        By dotted key, the values that it takes; several keys are crossed.
    trials
        Runs of each setting, with seeds 0, 1, 2, ...
    metrics
        What to report; the first one answers the question. None given: whatever the trials give.
    workers
        Processes; None takes one a core.
    name
        The study's name and its folder's; None makes one from what is asked.
    out
        Folder that the study's folder is made in.
    resume
        Whether trials that are finished in that folder count; a finished study is then only read.

    Raises
    ------
    InputError
        A key that the mission does not have, no values, a metric that it does not give; nothing is written
        then.

    Notes
    -----
    Workers import what a mission names, not the script that asks: components of one's own come from a
    plugin file (``plugins`` in the mission).

    Examples
    --------
    >>> import pilotage as pl
    >>> gates = {"stack.localizer.gate": [0.9, 0.99]}
    >>> found = pl.study("museum-route", vary=gates, trials=2, workers=1, metrics=["position_rmse_m"])
    >>> found.table()["success"]
    [1.0, 1.0]
    """
    loaded, place, resume = as_mission(mission), given.folder("out", out), given.flag("resume", resume)
    definition = _definition(
        loaded.mission, given.settings("vary", vary), given.whole("trials", trials, 1), metrics, name
    )
    if workers is not None:
        given.whole("workers", workers, 1)
    made = make_study(definition, values=resolved_values(loaded))
    if name is None:
        made = _named_by_content(made)
    folder = place / made.name
    begun = folder.exists() and any(folder.iterdir())
    options = StudyOptions(workers=workers, resume=resume and begun)
    counts = run_study(made, folder, options, Listener())
    with contextlib.suppress(OSError):  # the rows are safe, whatever becomes of their exports
        export(folder)
    if counts.failed == counts.total:
        reasons = read_study(folder).broken
        told = reasons[0].reason if reasons else "no reason given"
        raise InputError(f"study: every trial failed, the first with: {told}")
    return Study(folder)


def _definition(
    mission: str, vary: Mapping[str, Sequence[Any]], trials: int, metrics: Sequence[str], name: str | None
) -> StudyDefinition:
    if not vary:
        raise InputError("vary: expected a mapping of dotted keys to lists of values, found none")
    factors = []
    for key, values in vary.items():
        listed = given.plain(f"vary '{key}'", values)
        if not isinstance(listed, list):
            raise InputError(f"vary '{key}': expected a list of values, found {given.told(values)}")
        factors.append({"name": key, "key": key, "values": listed})
    metrics = given.words("metrics", metrics)
    asked: dict[str, Any] = {
        "study": "study" if name is None else given.word("name", name),
        "mission": mission,
        "factors": factors,
        "trials": trials,
        "metrics": list(metrics),
        "primary": metrics[0] if metrics else None,
    }
    return validate(StudyDefinition, asked, "")


def _named_by_content(made: Definition) -> Definition:
    """A name by mission and settings: asked again, the same study is the same folder."""
    from dataclasses import replace

    text = json.dumps([made.digest, list(made.definition.metrics)])
    digest = hashlib.sha256(text.encode()).hexdigest()[:8]
    stem = "".join(c if c.isalnum() or c in "-_." else "-" for c in made.definition.mission)
    definition = made.definition.model_copy(update={"study": f"study-{stem}-{digest}"})
    return replace(made, definition=definition)


def _number(value: float | None) -> float:
    return float("nan") if value is None else value
