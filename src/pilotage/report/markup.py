"""The page's HTML: small functions from values to markup; every text goes through ``escape``."""

from __future__ import annotations

import html
from collections.abc import Sequence
from importlib import resources
from string import Template

from pilotage.core.types import Event
from pilotage.report import quantities
from pilotage.report.event_kinds import event_kind
from pilotage.report.metrics_table import Row
from pilotage.report.style import Illustration, Key

escape = html.escape


def figure_section(number: int, figure: Illustration) -> str:
    """Return one numbered figure with its legend and caption."""
    title = f'<h2><a href="#{figure.slug}">{escape(figure.title)}</a></h2>'
    if not figure.svg:
        return f'<section id="{figure.slug}">{title}<p class="absent">{escape(figure.caption)}</p></section>'
    return (
        f'<section id="{figure.slug}">{title}<figure>{legend(figure)}'
        f'<div class="plot" tabindex="0">{figure.svg}</div>'
        f"<figcaption><b>Figure {number}.</b> {escape(figure.caption)}</figcaption></figure></section>"
    )


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


def metrics_section(groups: Sequence[tuple[str, Sequence[Row]]]) -> str:
    """Return the table of metrics with what each means."""
    rows = []
    for title, members in groups:
        rows.append(f'<tr class="group"><th colspan="3" scope="rowgroup">{escape(title)}</th></tr>')
        rows += [
            f'<tr><th scope="row">{escape(row.name)}</th><td class="value">{escape(row.value)}</td>'
            f"<td>{escape(row.meaning)}{_band(row)}</td></tr>"
            for row in members
        ]
    body = "".join(rows) or '<tr><td colspan="3">The run left no numbers.</td></tr>'
    return (
        '<section id="metrics"><h2><a href="#metrics">Numbers</a></h2><table class="metrics"><thead><tr>'
        '<th scope="col">what</th><th scope="col" class="value">value</th><th scope="col">what it means</th>'
        f"</tr></thead><tbody>{body}</tbody></table></section>"
    )


def _band(row: Row) -> str:
    return f' <span class="range">95 % band: {escape(row.band)}.</span>' if row.band else ""


def events_section(events: Sequence[Event]) -> str:
    """Return the numbered list of events."""
    head = '<section id="events"><h2><a href="#events">Events</a></h2>'
    if not events:
        return f'{head}<p class="absent">Nothing out of the ordinary happened.</p></section>'
    rows = []
    for index, event in enumerate(events, start=1):
        kind = event_kind(event.kind)
        time = f"{event.t_s:.1f} s" if event.t_s == event.t_s else quantities.NOTHING
        rows.append(
            f'<tr><td><span class="badge" style="border-color:{kind.colour}">{index}</span></td>'
            f'<td class="value">{time}</td><td>{escape(kind.name)}</td><td>{escape(event.text)}</td></tr>'
        )
    return (
        f'{head}<div class="long"><table class="events"><thead><tr><th scope="col">no.</th>'
        '<th scope="col" class="value">time</th><th scope="col">kind</th>'
        '<th scope="col">what happened</th></tr></thead>'
        f"<tbody>{''.join(rows)}</tbody></table></div></section>"
    )


def tiles(entries: Sequence[tuple[str, str]]) -> str:
    """Return the few numbers that stand large above everything."""
    return "".join(f"<div><dt>{escape(name)}</dt><dd>{escape(value)}</dd></div>" for name, value in entries)


def contents(entries: Sequence[tuple[str, str]]) -> str:
    """Return the table of contents."""
    items = "".join(f'<li><a href="#{slug}">{escape(title)}</a></li>' for slug, title in entries)
    return f'<nav aria-label="Contents"><ol>{items}</ol></nav>'


def document(script_source: str = "'none'", **parts: str) -> str:
    """Return the whole page; ``script_source`` is the one script that its policy lets run."""
    return _PAGE.substitute(
        parts,
        script_source=script_source,
        style=resources.files(__package__).joinpath("page.css").read_text("utf-8"),
    )


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
<dl class="tiles">$tiles</dl>
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
