"""The replay's part of the page: markup, the packed scene, the script, and the hash that lets it run."""

from __future__ import annotations

import base64
import hashlib
import math
from functools import cache
from importlib import resources

from pilotage.report.markup import Section, escape, section
from pilotage.report.replay.packing import pack
from pilotage.report.replay.scene import ReplayScene

SCRIPTS = ("unpack.js", "map.js", "series.js", "player.js")
TITLE = "Replay"
SLUG = "replay"
SPEEDS = (0.25, 0.5, 1.0, 2.0, 4.0, 8.0, 16.0, 32.0, 64.0)
SPEED = 4.0
LONG_SPEEDS = {
    60.0: "1 min/s",
    300.0: "5 min/s",
    900.0: "15 min/s",
    1800.0: "30 min/s",
    3600.0: "1 h/s",
    10800.0: "3 h/s",
    21600.0: "6 h/s",
    43200.0: "12 h/s",
    86400.0: "1 day/s",
    604800.0: "7 days/s",
}
LONG_S, PLAY_S = 7200.0, 75.0
"""A longer run is told in hours and days, as ``player.js`` does; any plays in about so much time at most."""


@cache
def script() -> str:
    """Return the player, one script for the page."""
    parts = [resources.files(__package__).joinpath(name).read_text("utf-8") for name in SCRIPTS]
    return '"use strict";\n' + "\n".join(parts)


@cache
def style() -> str:
    """Return the player's style sheet."""
    return resources.files(__package__).joinpath("player.css").read_text("utf-8")


def script_source() -> str:
    """Return the content security policy's source of the player: this script may run."""
    return source_of(script())


def source_of(text: str) -> str:
    """Return a content security policy's source: a script of this text may run, and no other."""
    digest = hashlib.sha256(text.encode("utf-8")).digest()
    return f"'sha256-{base64.b64encode(digest).decode('ascii')}'"


def replay_section(scene: ReplayScene | None) -> Section:
    """The section; without a scene a word about why there is none."""
    if scene is None:
        return section(SLUG, TITLE, '<p class="absent">The run left no poses over time to replay.</p>')
    long = float(scene.t_s[-1] - scene.t_s[0]) > LONG_S
    step = "ten minutes (with shift ten times that)" if long else "a second (with shift ten)"
    note = f" {escape(scene.note)}" if scene.note else ""
    return section(
        SLUG,
        TITLE,
        f"{_PLAYER.replace('{speeds}', _speeds(scene))}"
        '<noscript><p class="absent">The replay needs JavaScript; the rest of the page does not.</p>'
        "</noscript>"
        '<p class="absent" id="replay-trouble" role="alert" hidden></p>'
        f'<p class="replay-help">Space plays, ← → move by {step}, ↑ ↓ change the speed, '
        "+ − zoom, f follows, 0 shows all. Drag or pinch the map; the wheel zooms once the map is clicked. "
        f"A click on a curve goes to that moment.{note}</p>"
        f'<script type="text/plain" id="replay-scene">{pack(scene)}</script>'
        f"<script>{script()}</script>",
    )


def _speeds(scene: ReplayScene) -> str:
    """The choice of speeds: times real time, or for a long run its time in a second."""
    span_s = float(scene.t_s[-1] - scene.t_s[0])
    names = {s: f"{s:g} ×" for s in SPEEDS}
    chosen = next((s for s in SPEEDS if s >= SPEED and span_s <= PLAY_S * s), SPEEDS[-1])
    if span_s > LONG_S:
        names, chosen = LONG_SPEEDS, min(LONG_SPEEDS, key=lambda s: abs(math.log(s * PLAY_S / span_s)))
    return "".join(
        f'<option value="{s:.0f}"{" selected" if s == chosen else ""}>{name}</option>'
        if s >= 1.0
        else f'<option value="{s:g}">{name}</option>'
        for s, name in names.items()
    )


_PLAYER = """<div class="replay" id="replay-player" role="group" aria-label="Replay of the run" hidden>
<div class="replay-views"><div class="replay-stage">
<canvas data-replay-map tabindex="0" role="application" aria-label="Map: robot, estimate, scan, beacons \
and plan at the time of the slider; plus and minus zoom"></canvas>
<div class="replay-said"><span data-replay-state></span><span data-replay-absent></span>
<span data-replay-factor></span></div>
<div class="replay-zoom"><button type="button" data-replay-in aria-label="Zoom in">+</button>
<button type="button" data-replay-out aria-label="Zoom out">−</button>
<button type="button" data-replay-fit aria-label="Show the whole map">⤢</button></div></div>
<canvas data-replay-series role="application"
aria-label="Curves over time; a click goes to that moment"></canvas></div>
<div class="replay-time"><input type="range" data-replay-scrub aria-label="Time">
<div class="replay-ticks" data-replay-ticks aria-hidden="true"></div></div>
<div class="replay-bar"><button type="button" data-replay-play aria-pressed="false">▶ play</button>
<span data-replay-clock></span>
<label>speed <select data-replay-speed>{speeds}</select></label>
<label>ellipse <select data-replay-exaggerate><option value="auto">enlarged</option>
<option value="1">true size</option>
<option value="10">× 10</option><option value="100">× 100</option></select></label>
<label><input type="checkbox" data-replay-follow> follow the robot</label></div>
<p class="replay-event" data-replay-event aria-live="off"></p>
<div class="replay-layers" data-replay-layers role="group" aria-label="Layers shown"></div></div>"""
