"""Every closure to be looked at: the points of both stretches, and the script that lays them together."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from importlib import resources

import numpy as np
from numpy.typing import NDArray

from pilotage.core.types import FloatArray, IntArray
from pilotage.records.slam_folder import ClosureRow, SlamFolder
from pilotage.report import replay
from pilotage.report.replay.packing import pack
from pilotage.report.style import BLUE, VERMILLION

MOST_POINTS, MOST_OF_ONE = 120_000, 400
"""Of all stretches together, and of one."""
MOST_CLOSURES = 6000
CENTRE_CM, STEP_M = 32768, 0.01


@dataclass(frozen=True, slots=True)
class ClosureBook:
    """What the viewer shows: a row a closure, stretches by number.

    ``points`` (P, 2) are whole centimetres above ``CENTRE_CM`` in each stretch's own frame, stretch s from
    ``starts[s]`` on; ``relative`` (C, 3) is the pose of the later stretch in the earlier one's frame.
    """

    numbers: IntArray
    earlier: IntArray
    later: IntArray
    relative: FloatArray
    said: tuple[str, ...]
    starts: IntArray
    points: NDArray[np.uint16]
    first: int
    colours: tuple[str, str] = (BLUE, VERMILLION)


@cache
def script() -> str:
    """Return the viewer's script."""
    files = (resources.files(replay) / "unpack.js", resources.files(__package__) / "viewer.js")
    return '"use strict";\n' + "\n".join(file.read_text("utf-8") for file in files)


def viewer(data: SlamFolder, closures: list[ClosureRow], said: list[str]) -> str:
    """Return the markup: a canvas, the choice, and all of the ``closures`` with a line ``said`` on each."""
    if not closures:
        return ""
    return (
        f'{_VIEWER}<script type="text/plain" id="closure-book">{pack(_book(data, closures, said))}</script>'
    )


def _book(data: SlamFolder, closures: list[ClosureRow], said: list[str]) -> ClosureBook:
    ends = np.array([(c.earlier_submap, c.later_submap) for c in closures], dtype=np.int64)
    stretches, rows = np.unique(ends, return_inverse=True)
    rows = rows.reshape(ends.shape)
    most = min(MOST_OF_ONE, max(1, MOST_POINTS // stretches.size))
    clouds = []
    for stretch in stretches:
        points = data.submap(int(stretch))
        clouds.append(points[:: max(1, -(-len(points) // most))])
    whole = np.rint(np.concatenate(clouds) / STEP_M) + CENTRE_CM
    widest = max(range(len(closures)), key=lambda k: (closures[k].accepted, closures[k].window_m))
    return ClosureBook(
        numbers=np.array([c.number for c in closures]),
        earlier=rows[:, 0],
        later=rows[:, 1],
        relative=np.array([c.relative for c in closures]),
        said=tuple(said),
        starts=np.concatenate([[0], np.cumsum([len(cloud) for cloud in clouds])]),
        points=np.clip(whole, 0, 2 * CENTRE_CM - 1).astype(np.uint16),
        first=closures[widest].number,
    )


_VIEWER = """<div class="closure-viewer" id="closure-viewer" role="group"
aria-label="A closure looked at" hidden>
<canvas role="img" aria-label="The two stretches of the chosen closure, one over the other"></canvas>
<p><button type="button" data-before aria-label="The closure before">◀</button>
<label>closure <input type="number" min="1" step="1"></label>
<button type="button" data-after aria-label="The next closure">▶</button>
<span data-said aria-live="polite"></span></p></div>"""
STYLE = """
.closure-viewer canvas{display:block;width:100%;height:min(26rem,60vh);border:1px solid var(--line);
border-radius:.5rem}
.closure-viewer input{font:inherit;width:6em}
.closure-viewer button{font:inherit;min-width:2.2rem}
tr:has([data-closure]){cursor:pointer}
tr[aria-selected=true]{background:var(--soft)}"""
