"""How every figure looks, and how a matplotlib figure becomes a small clean piece of SVG.

Colours are Okabe and Ito's, which stay apart for colour-blind readers; where two lines run close together
they differ in width or dashes as well. Text stays text in the page's own font, so it can be searched.
"""

from __future__ import annotations

import io
import math
import re
import warnings
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from copy import copy
from dataclasses import dataclass
from functools import partial
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.axis import Tick
from matplotlib.backends.backend_svg import FigureCanvasSVG
from matplotlib.figure import Figure
from matplotlib.patches import PathPatch
from matplotlib.path import Path as Outline
from matplotlib.text import Text
from matplotlib.ticker import MaxNLocator
from matplotlib.transforms import Bbox, Transform

from pilotage.core.types import FloatArray
from pilotage.records.reading import clean_text
from pilotage.report.light_axes import LightAxes
from pilotage.report.quantities import HOURS_FROM_S
from pilotage.report.series import decimate

BLACK = "#000000"
ORANGE = "#E69F00"
SKY = "#56B4E9"
GREEN = "#009E73"
YELLOW = "#F0E442"
BLUE = "#0072B2"
VERMILLION = "#D55E00"
PURPLE = "#CC79A7"

INK = "#1f2933"
MUTED = "#5f6b76"
FAINT = "#9aa5b1"
GRID = "#e4e8ec"
SHADE = "#e3e7ec"

TICK_PT = 8.5
"""Size of the numbers beside axes."""
WIDTH_PT = 720.0
"""All figures are drawn this wide and scale with the page."""
_LEFT_PT, _RIGHT_PT, _TOP_PT, _BOTTOM_PT, _GAP_PT = 50.0, 10.0, 20.0, 32.0, 24.0

# Any: which names matplotlib lists as settings, and so their type, differs between its versions.
_RC: Any = {
    "svg.fonttype": "none",
    "text.parse_math": False,
    "font.family": "DejaVu Sans",
    "font.size": 9.0,
    "axes.unicode_minus": True,
    "path.simplify": True,
    "path.simplify_threshold": 0.15,
    "axes.facecolor": "none",
    "axes.edgecolor": FAINT,
    "axes.linewidth": 0.7,
    "axes.labelcolor": MUTED,
    "axes.labelsize": 9.0,
    "axes.titlesize": 9.5,
    "axes.titleweight": "bold",
    "axes.titlecolor": INK,
    "axes.titlelocation": "left",
    "axes.titlepad": 6.0,
    "axes.grid": True,
    "axes.grid.axis": "both",
    "axes.axisbelow": True,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.formatter.useoffset": False,
    "grid.color": GRID,
    "grid.linewidth": 0.6,
    "lines.linewidth": 1.0,
    "lines.solid_joinstyle": "round",
    "text.color": INK,
    "xtick.color": FAINT,
    "ytick.color": FAINT,
    "xtick.labelcolor": MUTED,
    "ytick.labelcolor": MUTED,
    "xtick.labelsize": TICK_PT,
    "ytick.labelsize": TICK_PT,
    "xtick.major.size": 3.0,
    "ytick.major.size": 0.0,
    "ytick.minor.size": 0.0,
    "xtick.major.width": 0.7,
}


@dataclass(frozen=True, slots=True)
class Key:
    """One entry of a legend: what it is, its colour, and how it is drawn.

    ``look`` is ``line``, ``dash``, ``dot`` (a dotted line), ``band`` (an area) or ``spot``. ``layer`` names
    the drawn layer that the entry switches on and off.
    """

    label: str
    colour: str
    look: str = "line"
    layer: str = ""
    opacity: float = 0.45
    shown: bool = True


@dataclass(frozen=True, slots=True)
class Illustration:
    """One figure of the page; without ``svg`` the caption says why there is none."""

    slug: str
    title: str
    alt: str
    caption: str
    svg: str = ""
    keys: tuple[Key, ...] = ()


@contextmanager
def drawing_style() -> Iterator[None]:
    """The context in which figures are made and rendered; it leaves the caller's settings alone.

    Numbers and names come from files: what overflows or is no number is a gap in a curve, a letter that the
    font lacks an empty box, and neither is a warning.
    """
    with mpl.rc_context(_RC), np.errstate(all="ignore"), warnings.catch_warnings():
        warnings.filterwarnings("ignore", message="Glyph ")
        yield


def stacked_axes(
    titles: Sequence[str], heights_pt: Sequence[float], *, share_time: bool = True
) -> tuple[Figure, list[Axes]]:
    """Return a figure of panels one above the other that share their time axis, or have one each.

    Parameters
    ----------
    titles
        One a panel: the quantity and its unit.
    heights_pt
        One a panel: the height of its drawing area.
    """
    gap = _GAP_PT if share_time else _GAP_PT + _BOTTOM_PT
    total = _TOP_PT + sum(heights_pt) + gap * (len(heights_pt) - 1) + _BOTTOM_PT
    figure = Figure(figsize=(WIDTH_PT / 72.0, total / 72.0))
    width = (WIDTH_PT - _LEFT_PT - _RIGHT_PT) / WIDTH_PT
    top = total - _TOP_PT
    panels = []
    for index, (title, height) in enumerate(zip(titles, heights_pt, strict=True)):
        box = _LEFT_PT / WIDTH_PT, (top - height) / total, width, height / total
        axes = figure.add_axes(box, axes_class=LightAxes)
        axes.set_title(title)
        if share_time and index < len(titles) - 1:
            axes.tick_params(axis="x", labelbottom=False, length=0)
        else:
            axes.set_xlabel("time [s]", labelpad=3.0)
        panels.append(axes)
        top -= height + gap
    return figure, panels


def time_limits(panels: Sequence[Axes], t_s: FloatArray) -> None:
    """Give all panels the run's time axis, also a run of a single step."""
    start = float(t_s[0]) if len(t_s) else 0.0
    end = float(t_s[-1]) if len(t_s) else 0.0
    for axes in panels:
        axes.set_xlim(min(start, 0.0), end if end > start else start + 1.0)
    if end - start < HOURS_FROM_S:
        return
    unit, name = (3600.0, "h") if end - start < 48.0 * 3600.0 else (86_400.0, "d")
    ticks = np.asarray(MaxNLocator(8, steps=[1, 2, 2.5, 5, 10]).tick_values(start / unit, end / unit))
    ticks = ticks[(ticks >= start / unit) & (ticks <= end / unit)]
    for axes in panels:
        axes.set_xticks(unit * ticks, [f"{tick:g}" for tick in ticks])
    panels[-1].set_xlabel(f"time [{name}]")


def series(axes: Axes, t_s: FloatArray, values: FloatArray, colour: str, **look: Any) -> None:
    """Draw one series, thinned to what can be seen."""
    look.setdefault("linewidth", 1.0)
    # A single step has no line; a dot says that there was a value.
    if int(np.isfinite(values).sum()) == 1:
        look.setdefault("marker", "o")
        look.setdefault("markersize", 3.0)
    axes.plot(*decimate(t_s, values), color=colour, **look)


def shade(axes: Axes, stretches: FloatArray, colour: str, alpha: float = 1.0) -> None:
    """Shade (k, 2) stretches of time over the whole height of a panel, as one single shape."""
    if not len(stretches):
        return
    boxes = [Outline([(a, 0.0), (b, 0.0), (b, 1.0), (a, 1.0), (a, 0.0)], closed=True) for a, b in stretches]
    one_shape(axes, boxes, axes.get_xaxis_transform(), facecolor=colour, alpha=alpha, zorder=0.4)


def one_shape(
    axes: Axes, outlines: Sequence[Outline], transform: Transform | None = None, **look: Any
) -> None:
    """Draw many outlines as one path element: a tenth of the size of as many elements."""
    if not outlines:
        return
    look.setdefault("linewidth", 0.0)
    look.setdefault("edgecolor", "none")
    gid = look.pop("gid", None)
    patch = PathPatch(Outline.make_compound_path(*outlines), **look)
    if transform is not None:
        patch.set_transform(transform)
    if gid is not None:
        patch.set_gid(gid)
    # add_artist instead of add_patch: limits are set on purpose, never guessed from what is drawn.
    axes.add_artist(patch)


def note(axes: Axes, text: str) -> None:
    """Say in the middle of an empty panel why it is empty."""
    axes.set_yticks([])
    axes.text(0.5, 0.5, text, transform=axes.transAxes, ha="center", va="center", color=MUTED)


def nice_limit(value: float) -> float:
    """Return a limit a little above a peak; one where there is no peak."""
    return 1.15 * value if math.isfinite(value) and value > 0.0 else 1.0


def peak(values: FloatArray) -> float:
    """Return the greatest absolute value, NaN where there is none."""
    finite = np.abs(values[np.isfinite(values)])
    return float(finite.max()) if finite.size else math.nan


_HEAD = re.compile(r"^.*?(?=<svg)", re.DOTALL)
_METADATA = re.compile(r"<metadata>.*?</metadata>\s*", re.DOTALL)
_GLOBAL_STYLE = re.compile(r"<defs>\s*<style type=\"text/css\">.*?</style>\s*</defs>\s*", re.DOTALL)
_ROOT = re.compile(r"<svg[^>]*?viewBox=\"([^\"]*)\"[^>]*>")
_FONT = re.compile(r"font: (?:(\w+) )?([\d.]+)px [^;\"]*")
_FAMILY = re.compile(r"font-family: [^;\"]*;? ?")
_GROUP_ID = re.compile(r" id=\"(?!layer-)[A-Za-z.]+\w*_\d+\"")
_LAYER_ID = re.compile(r" id=\"layer-([a-z0-9-]+)\"")
_OUTLINE = re.compile(r" d=\"([^\"]*)\"")
_TOO_FINE = re.compile(r"(?<=\.\d\d)\d+")
_LONG_PLACE = re.compile(r"( (?:x|y)=\"-?\d+\.\d\d)\d+\"")
_NO_TURN = re.compile(r" transform=\"rotate\(-?0 [^)]*\)\"")
_BETWEEN = re.compile(r">\s+<")


def render(figure: Figure, slug: str, alt: str) -> str:
    """Render a figure as SVG to be put into a page beside others.

    No prolog, no metadata, no style that would leak into the page; identifiers start with ``slug`` so that
    those of two figures never meet; coordinates to a hundredth of a point. Control characters show, as in
    ``markup.escape``.
    """
    buffer = io.StringIO()
    _let_titles_stay(figure)
    _let_ticks_be_as_told(figure)
    with mpl.rc_context({"svg.hashsalt": slug}):
        FigureCanvasSVG(figure)
        figure.savefig(buffer, format="svg", facecolor="none", metadata={"Date": None})
    svg = _HEAD.sub("", buffer.getvalue(), count=1)
    svg = _GLOBAL_STYLE.sub("", _METADATA.sub("", svg), count=1)
    svg = _OUTLINE.sub(_short_outline, svg)
    svg = _LONG_PLACE.sub(r'\1"', _NO_TURN.sub("", svg))
    svg = _FAMILY.sub("", _FONT.sub(_font_size, svg))
    # Several artists may make up one layer, and an identifier may be there but once.
    svg = _LAYER_ID.sub(r' class="layer-\1"', _GROUP_ID.sub("", svg))
    svg = svg.replace(' id="', f' id="{slug}-').replace("url(#", f"url(#{slug}-")
    svg = svg.replace('xlink:href="#', 'href="#').replace('href="#', f'href="#{slug}-')
    svg = _ROOT.sub(rf'<svg viewBox="\1" role="img" aria-label="{_attribute(alt)}">', svg, count=1)
    return clean_text(_BETWEEN.sub("><", svg).strip())


MOST_LAYOUTS = 2000
_LAYOUTS: dict[tuple[object, ...], Any] = {}
"""Of numbers at axes, by what they say and how they are written."""

_PLAIN = 1e-3, 9e5
"""Largest numbers of an axis that is labelled without a power of ten above it (``axes.formatter.limits``)."""


def _let_titles_stay(figure: Figure) -> None:
    """Tell matplotlib that no title has to make room, where it would look and find nothing above its axes.

    To look, it lays out all numbers of an axis once more: a fifth of the time of a page.
    """
    numbers = [max(map(abs, axes.get_ylim())) for axes in figure.axes]
    bottom = all(axes.xaxis.get_label_position() == "bottom" for axes in figure.axes)
    if bottom and all(_PLAIN[0] <= most <= _PLAIN[1] for most in numbers):
        for axes in figure.axes:
            vars(axes)["_autotitlepos"] = False


def _let_ticks_be_as_told(figure: Figure) -> None:
    """Spare matplotlib what changes nothing here: a quarter of the time of a page.

    Ticks are styled by ``tick_params`` alone, so that all of an axis look like its first one; each would be
    made of five new objects, and then told all that the first one's have. An axis without words has none
    whose place its numbers tell, and a tick without length none to draw.
    """
    for axes in figure.axes:
        for axis in (axes.xaxis, axes.yaxis):
            for tick in axis.majorTicks:
                _lay_out_once(tick.label1)
                if tick.get_tick_padding() == 0.0:  # it has no length
                    tick.tick1line.set_visible(False)
            vars(axis)["_get_tick"] = partial(_tick_of, axis)
            vars(axis)["_copy_tick_props"] = _clip_alike
            if axis.get_label_text():
                continue
            vars(axis)["_autolabelpos"] = False
            if _PLAIN[0] <= max(map(abs, axis.get_view_interval())) <= _PLAIN[1]:
                vars(axis)["_get_ticklabel_bboxes"] = _nowhere


def _nowhere(_ticks: object, _renderer: object) -> tuple[list[Bbox], list[Bbox]]:
    """Where an axis's numbers stand: asked for a power of ten beside them, which there is none."""
    return [], []


def _tick_of(axis: Any, major: bool) -> Tick:
    """One more: the first one's copy; what is not shown of them is one and the same."""
    if not major or not vars(axis).get("majorTicks"):
        made: Tick = type(axis)._get_tick(axis, major)
        return made
    made = copy(axis.majorTicks[0])
    for part in made.get_children():
        if part.get_visible():
            name = next(name for name, value in vars(made).items() if value is part)
            setattr(made, name, copy(part))
    _lay_out_once(made.label1)
    return made


def _lay_out_once(label: Text) -> None:
    """Where a number's box lies is asked to place its axis's words, and once more to draw it.

    The same numbers stand at most axes of a page.
    """
    lay_out: Callable[..., Any] | None = getattr(type(label), "_get_layout", None)
    if lay_out is None:
        return

    def layout(renderer: object) -> Any:
        figure = label.get_figure()
        told = (
            *(label.get_text(), label.get_fontproperties(), label.get_rotation(), label.get_rotation_mode()),
            *(label.get_horizontalalignment(), label.get_verticalalignment(), figure and figure.dpi),
        )
        found = _LAYOUTS.get(told)
        if found is None:
            if len(_LAYOUTS) >= MOST_LAYOUTS:
                _LAYOUTS.clear()
            found = _LAYOUTS[told] = lay_out(label, renderer)
        return found

    vars(label)["_get_layout"] = layout


def _clip_alike(first: Tick, made: Tick) -> None:
    """Lines of the grid end where the panel does."""
    clip = vars(first.gridline)["_clippath"]
    if vars(made.gridline)["_clippath"] is not clip:
        made.gridline.set_clip_path(clip)


def _short_outline(match: re.Match[str]) -> str:
    numbers = _TOO_FINE.sub("", match.group(1))
    return f' d="{numbers.replace(chr(10), "").replace(" L ", "L").replace(" z", "z").strip()}"'


def _font_size(match: re.Match[str]) -> str:
    weight = match.group(1)
    return f"font-size: {match.group(2)}px" + (f"; font-weight: {weight}" if weight else "")


def _attribute(text: str) -> str:
    """Escape for an attribute, and for the replacement part of a regular expression."""
    import html

    return html.escape(text).replace("\\", "\\\\")


def logarithmic(axes: Axes, low: float, high: float) -> None:
    """Give a panel a logarithmic axis over [low, high] with plain numbers at 1, (2, 5,) 10 ..."""
    low, high = max(low, 1e-9), max(high, 1e-9)
    if high / low < 4.0:
        middle = math.sqrt(low * high)
        low, high = middle / 2.0, middle * 2.0
    axes.set_ylim(low, high)  # first: a scale that is chosen by values of 0 is none
    axes.set_yscale("log")
    ratio = high / low
    steps = (1.0, 1.5, 2.0, 3.0, 5.0, 7.0) if ratio < 8.0 else (1.0, 2.0, 5.0) if ratio < 60.0 else (1.0,)
    decades = range(math.floor(math.log10(low)), math.ceil(math.log10(high)) + 1)
    ticks = [step * 10.0**decade for decade in decades for step in steps]
    ticks = [tick for tick in ticks if low <= tick <= high]
    axes.set_yticks(ticks, [f"{tick:g}" for tick in ticks])
    axes.set_yticks([], minor=True)
