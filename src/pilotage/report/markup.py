"""The page's HTML: small functions from values to markup; every text goes through ``escape``."""

from __future__ import annotations

import html
import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from importlib import resources
from itertools import pairwise
from string import Template

from pilotage.core.types import Event
from pilotage.records.reading import clean_text
from pilotage.report import quantities
from pilotage.report.event_kinds import event_kind
from pilotage.report.metrics_table import Row
from pilotage.report.style import Illustration, Key

REPORT_FILE = "report.html"
"""Every page's name, in the folder that it is about."""
VALUE, PLAIN, ROW = "value", "value plain", "row"
"""How a column's cells look: numbers, numbers with something below, the row's own name; else plain text."""
WHOLE = 9
"""Characters of a cell that stay on one line."""
_BEFORE_UNIT = re.compile(r"(?<=\d) (?=(?:[kmµ]?m|m?s|min|h|%|m?rad|m/s|rad/s|Hz)(?!\w))")
_LONG = re.compile(r"\S{40}(?=\S)")
"""As much of a word as has to stay together in a table; a longer one would push all numbers out of sight."""
Columns = Sequence[tuple[str, str]]
"""Headings, each with how its cells look."""


class Html(str):
    """Markup already: ``table`` does not escape it."""

    __slots__ = ()


@dataclass(frozen=True, slots=True)
class Section:
    """A part of a page that its contents name; one without ``html`` is left out."""

    slug: str
    title: str
    html: str


def escape(text: str) -> str:
    """Text as markup; marks that would turn the direction of what follows, and control characters, show."""
    return html.escape(clean_text(text))


def section(slug: str, title: str, *parts: str) -> Section:
    """A section of markup under its heading; without any it is left out."""
    inner = "".join(parts)
    head = f'<section id="{slug}"><h2><a href="#{slug}">{escape(title)}</a></h2>'
    return Section(slug, title, f"{head}{inner}</section>" if inner else "")


def table(columns: Columns, rows: Iterable[Sequence[str]], look: str = "", *, box: str = "") -> str:
    """A table of text, or of ``Html``; a row of one cell is a heading over those that follow.

    Parameters
    ----------
    look
        The style sheet's class of the table: ``cells``, ``events``, ``metrics``.
    box
        What it may scroll in: ``wide`` or ``long``.
    """
    heads = "".join(
        f'<th scope="col" class="value">{_escaped(name)}</th>'
        if cells.startswith(VALUE)
        else f'<th scope="col">{_escaped(name)}</th>'
        for name, cells in columns
    )
    body = "".join(_row(columns, row) for row in rows)
    style = f' class="{look}"' if look else ""
    made = f"<table{style}><thead><tr>{heads}</tr></thead><tbody>{body}</tbody></table>"
    return f'<div class="{box}" tabindex="0">{made}</div>' if box else made


def _row(columns: Columns, row: Sequence[str]) -> str:
    if len(row) == 1 < len(columns):
        title = _escaped(row[0])
        return f'<tr class="group"><th colspan="{len(columns)}" scope="rowgroup">{title}</th></tr>'
    return f"<tr>{''.join(_cell(text, look) for text, (_, look) in zip(row, columns, strict=True))}</tr>"


def _cell(text: str, look: str) -> str:
    if look == ROW:
        return f'<th scope="row">{_escaped(text)}</th>'
    # A number is read whole; an interval or a sentence may be broken at its blanks.
    look = look or ("whole" if len(text) <= WHOLE else "")
    style = f' class="{look}"' if look else ""
    return f"<td{style}>{_escaped(text)}</td>"


def _escaped(text: str) -> str:
    if isinstance(text, Html):
        return text
    ends = [0, *(found.end() for found in _LONG.finditer(text)), len(text)]
    return "<wbr>".join(escape(text[a:b]) for a, b in pairwise(ends))


def _whole(text: str) -> str:
    """A sentence escaped, its numbers on one line with their units."""
    return escape(_BEFORE_UNIT.sub("\u00a0", text))


def figure_sections(figures: Sequence[Illustration]) -> list[Section]:
    """The figures with legend and caption, numbered as they are drawn."""
    made, number = [], 0
    for figure in figures:
        number += bool(figure.svg)
        inner = f'<p class="absent">{escape(figure.caption)}</p>'
        if figure.svg:
            inner = (
                f'<figure>{legend(figure)}<div class="plot" tabindex="0">{figure.svg}</div><figcaption>'
                f"<b>Figure {number}.</b> {_whole(figure.caption)}</figcaption></figure>"
            )
        made.append(section(figure.slug, figure.title, inner))
    return made


def legend(figure: Illustration) -> str:
    """Return the legend; entries of layers are check boxes that switch the layer without any script."""
    if not figure.keys:
        return ""
    entries = []
    for key in figure.keys:
        label = f"{swatch(key)}{escape(key.label)}"
        if key.layer:
            checked = " checked" if key.shown else ""
            box = f'<input type="checkbox" id="{figure.slug}-show-{key.layer}"{checked}>'
            entries.append(f"<li><label>{box}{label}</label></li>")
        else:
            entries.append(f"<li>{label}</li>")
    return f'<ul class="legend">{"".join(entries)}</ul>'


def layer_rules(figure: Illustration) -> str:
    """Return the style rules that hide a layer whose box is not ticked."""
    slug = figure.slug
    return "\n".join(
        f"#{slug}:has(#{slug}-show-{key.layer}:not(:checked)) .layer-{key.layer}{{display:none}}"
        for key in figure.keys
        if key.layer
    )


def swatch(key: Key) -> str:
    """Return the little sample of a legend entry."""
    stroke = f'stroke="{key.colour}"'
    shapes = {
        "line": f'd="M1 6h20" {stroke} stroke-width="2.4"',
        "dash": f'd="M1 6h20" {stroke} stroke-width="2" stroke-dasharray="5 3"',
        "dot": f'd="M2 6h20" {stroke} stroke-width="2.4" stroke-dasharray="0 4.5" stroke-linecap="round"',
        "band": f'd="M1 1h20v10h-20z" fill="{key.colour}" fill-opacity="{key.opacity:g}"',
        "spot": f'd="M11 1.5 15.5 6 11 10.5 6.5 6z" fill="{key.colour}"',
    }
    shape = f"<path {shapes[key.look]}/>"
    return f'<svg class="swatch" viewBox="0 0 22 12" aria-hidden="true">{shape}</svg>'


def metrics_section(groups: Sequence[tuple[str, Sequence[Row]]], note: str = "") -> Section:
    """The table of metrics with what each means, under a note."""
    columns = (("what", ROW), ("value", VALUE), ("what it means", ""))
    rows: list[tuple[str, ...]] = []
    for title, members in groups:
        rows.append((title,))
        rows += [(row.name, row.value, Html(f"{_whole(row.meaning)}{_band(row)}")) for row in members]
    told = f"<p>{escape(note)}</p>" if note else ""
    made = table(columns, rows or [("The run left no numbers.",)], "metrics")
    return section("metrics", "Numbers", told, made)


def _band(row: Row) -> str:
    return f' <span class="range">95 % band: {escape(row.band)}.</span>' if row.band else ""


def events_section(events: Sequence[Event]) -> Section:
    """The numbered list of events."""
    if not events:
        return section("events", "Events", '<p class="absent">Nothing out of the ordinary happened.</p>')
    rows = []
    for index, event in enumerate(events, start=1):
        kind = event_kind(event.kind)
        time = quantities.moment(event.t_s)
        badge = Html(f'<span class="badge" style="border-color:{kind.colour}">{index}</span>')
        rows.append((badge, time, kind.name, event.text))
    columns = (("no.", ""), ("time", VALUE), ("kind", ""), ("what happened", ""))
    return section("events", "Events", table(columns, rows, "events", box="long"))


def page(
    sections: Sequence[Section],
    figures: Sequence[Illustration] = (),
    *,
    title: str,
    eyebrow: str,
    footer: str,
    heading: str = "",
    descriptions: Sequence[str] = (),
    outcome: str = "",
    headline: str = "",
    tiles: Sequence[tuple[str, str]] = (),
    rules: str = "",
    script_source: str = "'none'",
) -> str:
    """The whole page.

    Parameters
    ----------
    figures
        Those whose layers are switched.
    heading
        The title, where none is given.
    outcome
        Markup before the headline; all else is text.
    tiles
        The few numbers that stand large above everything: (name, value).
    script_source
        The one script that the page's policy lets run.
    """
    shown = [part for part in sections if part.html]
    entries = "".join(f'<li><a href="#{part.slug}">{escape(part.title)}</a></li>' for part in shown)
    return _PAGE.substitute(
        title=escape(title),
        layers="".join(layer_rules(figure) for figure in figures) + rules,
        eyebrow=escape(eyebrow),
        heading=escape(heading or title),
        description="".join(f'<p class="description">{escape(text)}</p>' for text in descriptions),
        outcome=outcome,
        headline=escape(headline),
        tiles=_tiles(tiles),
        contents=f'<nav aria-label="Contents"><ol>{entries}</ol></nav>',
        body="\n".join(part.html for part in shown),
        footer=escape(footer),
        script_source=script_source,
        style=resources.files(__package__).joinpath("page.css").read_text("utf-8"),
    )


def _tiles(tiles: Sequence[tuple[str, str]]) -> str:
    parts = "".join(f"<div><dt>{escape(name)}</dt><dd>{escape(value)}</dd></div>" for name, value in tiles)
    return f'<dl class="tiles">{parts}</dl>' if parts else ""


_PAGE = Template(
    """<!DOCTYPE html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<meta http-equiv="Content-Security-Policy"
content="default-src 'none'; img-src data:; style-src 'unsafe-inline'; script-src $script_source">
<title>$title</title>
<style>
$style
$layers
</style>
</head>
<body>
<header>
<p class="eyebrow">$eyebrow</p>
<h1>$heading</h1>
$description
<p class="headline">$outcome $headline</p>
$tiles
$contents
</header>
<main>
$body
</main>
<footer>$footer</footer>
</body>
</html>
"""
)
