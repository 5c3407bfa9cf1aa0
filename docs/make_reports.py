"""Writes ``docs/reports.md`` from the tables in ``src/pilotage/missions/reports``."""

from __future__ import annotations

import itertools
from pathlib import Path

from pilotage.experiments.reproduced import reproduced

PAGE = Path(__file__).parent / "reports.md"
HEAD = """# The three reports, table by table

Each table and figure of the reports that pilotage reproduced first, and the command that gives it today: a
study, a mission, a calibration or an example. `pilotage study --list` prints the same. Written by `make api`
from `src/pilotage/missions/reports`; a test holds that whatever is named here exists.
"""


def page() -> str:
    """The whole page."""
    parts = [HEAD]
    for report, rows in itertools.groupby(reproduced(), key=lambda row: row.report):
        parts += [
            f"## {report.replace('-', ' ').capitalize()}",
            "",
            "| | shows | command | |",
            "| --- | --- | --- | --- |",
        ]
        parts += [f"| {row.item} | {row.shows} | `{row.command}` | {row.remark} |" for row in rows]
        parts.append("")
    return "\n".join(parts)


if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8")
