"""Runs on one sheet side by side: paths, visited cells, features (exploration report, fig. 5 to 7)."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from pilotage.core.errors import InputError
from pilotage.core.whole_file import write_whole
from pilotage.records.numbers import number
from pilotage.records.run_data import RunData, read_run
from pilotage.report import quantities
from pilotage.report.markup import figure_sections, page
from pilotage.report.sheet.maps import ACCURACY_KEYS, draw_features, draw_visits
from pilotage.report.sheet.panels import sheet_panels
from pilotage.report.sheet.path import PATH_KEYS, draw_path
from pilotage.report.style import Illustration, drawing_style, render

IN_A_ROW = 3


def write_side_by_side(folders: Mapping[str, Path], file: Path) -> Path:
    """Write a page with a panel for each run: its path, its visited cells, its features.

    Parameters
    ----------
    folders
        Run folders by what the runs are called, in their order; all of one sheet.

    Raises
    ------
    InputError
        Where a folder is no run's, or the run was on no sheet.
    """
    runs = {name: read_run(folder) for name, folder in folders.items()}
    for name, run in runs.items():
        if run.sheet is None:
            raise InputError(f"{name}: expected a run on a sheet, found none in {folders[name]}")
    with drawing_style():
        figures = _figures(runs)
    coverage = {name: number(run.metrics.get("coverage_visited")) for name, run in runs.items()}
    text = page(
        figure_sections(figures),
        figures,
        title="Runs side by side",
        eyebrow=f"pilotage report · {len(runs)} runs",
        descriptions=[_told(runs)],
        tiles=[(name, quantities.share(visited)) for name, visited in coverage.items()],
        footer="Made by pilotage from run folders; the tiles tell the share of all cells that was visited.",
    )
    write_whole(file, text)
    return file


def _figures(runs: Mapping[str, RunData]) -> list[Illustration]:
    sheets = {name: run.sheet for name, run in runs.items()}
    first = next(sheet for sheet in sheets.values() if sheet is not None)
    made = []
    for slug, title, keys, caption in (
        ("paths", "The true paths", PATH_KEYS, "Each run's true path and where it believed to be."),
        (
            "visits",
            "Visited cells that the maps have right",
            ACCURACY_KEYS[:3],
            "The cells that each robot was in, and its own visited layer.",
        ),
        (
            "features",
            "Features that the maps have right",
            ACCURACY_KEYS,
            "Each robot's OBSTACLE and LINE cells against the true ones.",
        ),
    ):
        figure, panels = sheet_panels(first, list(runs), IN_A_ROW)
        for axes, (name, run) in zip(panels, runs.items(), strict=True):
            sheet = sheets[name]
            assert sheet is not None, "refused above"
            if slug == "paths":
                draw_path(axes, run, sheet)
            elif slug == "visits":
                draw_visits(axes, sheet)
            else:
                draw_features(axes, sheet)
        alt = f"{title} of {', '.join(runs)}"
        made.append(Illustration(slug, title, alt, caption, render(figure, slug, alt), keys))
    return made


def _told(runs: Mapping[str, RunData]) -> str:
    """Why each ended."""
    return "; ".join(f"{name}: {run.metrics.get('reason', '')}" for name, run in runs.items())
