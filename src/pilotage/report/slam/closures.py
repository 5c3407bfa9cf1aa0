"""Every closure explained: a choice of them drawn, all of them in a table."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure

from pilotage.core.types import Pose2
from pilotage.records.slam_folder import ClosureRow, SlamFolder
from pilotage.report.markup import ROW, VALUE, Html, Section, section, table
from pilotage.report.slam.viewer import MOST_CLOSURES, script, viewer
from pilotage.report.style import BLUE, VERMILLION, WIDTH_PT, Illustration, Key, render

COLUMNS = 4
ACCEPTED_DRAWN, REFUSED_DRAWN = 4, 8
LISTED = 400
"""Rows of the table; ``closures.json`` has all."""
POINTS = 900

MEANINGS = {
    "accepted": "fits alone, with the graph and with the others around it",
    "accepted across its course alone": "fits across its course, open along it; others bear it out",
    "no match": "nothing in the window was alike",
    "low score": "the best place in the window is not alike enough",
    "little overlap": "too few points fall where the other stretch saw",
    "walls disagree": "walls of the one stand where the other saw through",
    "ambiguous": "another place in the window is nearly as good",
    "contradicts the graph": "farther off than the graph's uncertainty allows",
    "contradicts other closures": "does not go with the larger group of closures that agree",
    "no other closure seconds it": "no agreeing closure near it on both stretches",
    "no full closure followed from it": "open along its course, and nothing near it bore it out",
}


def closures_figure(data: SlamFolder) -> Illustration:
    """Draw the accepted closures of the widest windows, and refused ones of every reason."""
    chosen = _choice(data.closures)
    title, slug = "Closures, looked at", "overlays"
    if not chosen:
        return Illustration(slug, title, "", "No two stretches of the path were near enough to be compared.")
    rows = -(-len(chosen) // COLUMNS)
    cell = WIDTH_PT / COLUMNS
    figure = Figure(figsize=(WIDTH_PT / 72.0, rows * (cell + 26.0) / 72.0))
    for n, closure in enumerate(chosen):
        row, column = divmod(n, COLUMNS)
        axes = figure.add_axes(
            (
                (column + 0.03) / COLUMNS,
                1.0 - (row + 1) / rows + 0.02 / rows,
                0.94 / COLUMNS,
                cell / (cell + 26.0) / rows * 0.94,
            )
        )
        axes.set_title(f"{closure.number}: {closure.verdict}", fontsize=7.5)
        for number, colour in ((closure.earlier_submap, BLUE), (closure.later_submap, VERMILLION)):
            points = data.submap(number)
            if colour is VERMILLION:
                points = Pose2.from_array(np.array(closure.relative)).placed(points)
            points = points[:: max(1, len(points) // POINTS)]
            axes.plot(points[:, 0], points[:, 1], ",", color=colour, alpha=0.8, rasterized=True)
        axes.set_xlim(-7.0, 7.0)
        axes.set_ylim(-7.0, 7.0)
        axes.set_aspect("equal")
        axes.set_xticks([])
        axes.set_yticks([])
    caption = (
        "Two stretches of the path laid over each other as the search found best, 14 m a side: of accepted "
        "ones "
        "those with the widest windows, of the refused the best-scoring of each reason. Numbers are those of "
        "the table."
    )
    keys = (Key("earlier stretch", BLUE, "spot"), Key("later stretch", VERMILLION, "spot"))
    alt = "Pairs of submaps laid over each other"
    return Illustration(slug, title, alt, caption, render(figure, slug, alt), keys)


def closures_section(data: SlamFolder) -> Section:
    """The table: how many of each verdict, then closure by closure."""
    counts = data.metrics["closures_by_verdict"]
    summary = [(verdict, str(count), MEANINGS.get(verdict, "")) for verdict, count in counts.items()]
    kept = sorted(data.closures, key=lambda c: (_interest(c), c.number))[:MOST_CLOSURES]
    rows = map(_row, sorted(kept[:LISTED], key=lambda c: c.number))
    looked = [c for c in sorted(kept, key=lambda c: c.number) if c.score > 0.0]
    left = len(data.closures) - min(len(kept), LISTED)
    more = (
        f'<p class="absent">{left} more can be looked at by number, and are in closures.json.</p>'
        if left
        else ""
    )
    numbers = ("scans", "window", "score", "second", "agreement", "chi-square", "seconded by")
    columns = (("no.", ""), *((name, VALUE) for name in numbers), ("verdict", ""))
    return section(
        "closures",
        "Closures, all",
        viewer(data, looked, [_said(c) for c in looked]),
        table((("verdict", ROW), ("count", VALUE), ("why", "")), summary, "metrics"),
        table(columns, rows, "events", box="long"),
        more,
        f"<script>{script()}</script>",
    )


def _row(c: ClosureRow) -> tuple[str, ...]:
    return (
        Html(f'<span data-closure="{c.number}">{c.number}</span>'),
        f"{'earlier map' if c.earlier_scan is None else c.earlier_scan} ↔ {c.later_scan}",
        f"±{c.window_m:.1f} m",
        f"{c.score:.2f}",
        f"{c.second_score:.2f}",
        f"{100.0 * c.agreement:.0f}\u00a0%",
        "–" if c.chi_square is None else f"{c.chi_square:.1f}",
        str(c.support),
        c.verdict,
    )


def _said(c: ClosureRow) -> str:
    """What the viewer says of a closure, with the reason in full."""
    chi = "" if c.chi_square is None else f", chi-square {c.chi_square:.1f}"
    earlier = "of the earlier map" if c.earlier_scan is None else c.earlier_scan
    why = f" ({MEANINGS[c.verdict]})" if c.verdict in MEANINGS else ""
    return (
        f"scans {earlier} and {c.later_scan}, window ±{c.window_m:.1f} m, score {c.score:.2f} "
        f"(second {c.second_score:.2f}), agreement {100.0 * c.agreement:.0f}\u00a0%{chi}, "
        f"seconded by {c.support}: {c.verdict}{why}"
    )


def _interest(c: ClosureRow) -> int:
    """Accepted ones first, then what was refused late; what never matched tells least."""
    if c.accepted:
        return 0
    return 2 if c.verdict in {"no match", "low score"} else 1


def _choice(closures: list[ClosureRow]) -> list[ClosureRow]:
    accepted = sorted((c for c in closures if c.accepted), key=lambda c: -c.window_m)
    chosen = accepted[:ACCEPTED_DRAWN]
    reasons: dict[str, list[ClosureRow]] = {}
    for c in sorted(closures, key=lambda c: -c.score):
        if not c.accepted and c.score > 0.0:
            reasons.setdefault(c.verdict, []).append(c)
    refused = [group[k] for k in range(2) for group in reasons.values() if len(group) > k]
    return chosen + refused[:REFUSED_DRAWN]
