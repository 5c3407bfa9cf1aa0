"""The summary that a run leaves in the terminal."""

from __future__ import annotations

from collections.abc import Mapping

from rich import box
from rich.table import Table
from rich.text import Text

from pilotage.report.headline import outcome
from pilotage.report.metrics_table import metric_rows


def summary_table(metrics: Mapping[str, object]) -> Table:
    """Return a table of a run's metrics: grouped, aligned, in humane units.

    Parameters
    ----------
    metrics
        The run's object, the keys of ``metrics.json``; whatever is missing is left out.
    """
    table = Table(
        box=box.SIMPLE_HEAD, show_header=False, title=_title(metrics), title_justify="left", pad_edge=False
    )
    table.add_column("group", style="dim", no_wrap=True)
    table.add_column("metric")  # a name may run over lines; a number that is cut is another one
    table.add_column("value", justify="right", no_wrap=True)
    table.add_column("band", style="dim", no_wrap=True)
    for title, rows in metric_rows(metrics):
        for index, row in enumerate(rows):
            # Text, not str: square brackets of a name or reason are no markup.
            table.add_row(
                title if index == 0 else "",
                Text(row.name),
                Text(row.value),
                Text(f"95 %: {row.band}" if row.band else ""),
                end_section=index == len(rows) - 1,
            )
    return table


def _title(metrics: Mapping[str, object]) -> Text:
    title = Text(str(metrics.get("mission") or "run"), style="bold")
    if metrics.get("seed") is not None:
        title.append(f"  seed {metrics['seed']}", style="dim")
    # In the title, where a long reason may run over lines without widening a column.
    return title.append("\n").append_text(_outcome(metrics))


def _outcome(metrics: Mapping[str, object]) -> Text:
    success = outcome(metrics)
    if success is None:
        return Text("outcome not said", style="yellow")
    if success:
        return Text("success", style="bold green")
    return Text(f"failed: {metrics.get('reason') or 'no reason given'}", style="bold red")
