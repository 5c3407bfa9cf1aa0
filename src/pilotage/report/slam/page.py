"""The page itself: map, closures, uncertainty, numbers."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from pilotage.core.memory import give_back
from pilotage.core.whole_file import write_whole
from pilotage.records.numbers import number
from pilotage.records.slam_folder import SlamFolder, read_slam_folder
from pilotage.report import quantities
from pilotage.report.markup import (
    REPORT_FILE,
    ROW,
    VALUE,
    Section,
    escape,
    figure_sections,
    page,
    section,
    table,
)
from pilotage.report.replay.section import replay_section, script_source, source_of, style
from pilotage.report.slam import viewer
from pilotage.report.slam.closures import closures_figure, closures_section
from pilotage.report.slam.figures import (
    before_after_figure,
    growth_figure,
    map_figure,
    uncertainty_figure,
)
from pilotage.report.slam.replay import slam_scene
from pilotage.report.style import drawing_style

MEANINGS = {
    "scans": "scans of the recording, each with a pose in trajectory.tum",
    "scans_searched": "scans whose neighbourhood was searched because no guess of the motion fitted",
    "scans_lost": "scans that could not be aligned: their poses are guesses",
    "keyframes": "scans that are poses of the graph",
    "edges": "relative poses the graph is made of after the refinement",
    "closures_searched": "pairs of stretches that were compared",
    "closures_accepted": "pairs that count",
    "duration_s": "length of the recording",
    "path_length_m": "path of the scanner",
    "position_std_max_m": "largest standard deviation of a position, seen from the first scan",
    "stretches": "stretches of the recording that were searched all over the earlier map",
    "stretches_agreeing": "those that agree where the recording lies in it",
    "walls_agreement": "share of its points on walls of the earlier map, of those where that one saw",
    "keyframes_kept": "keyframes of the earlier map that are still in the graph",
    "keyframes_dropped": "keyframes of the earlier map that later ones made superfluous",
    "beam_spacing": "true angle between beams over the one the log tells, as the closures have it",
    "odometry_scale": "path by the map over path by the odometry",
    "odometry_turn_scale": "turn by the map over turn by the odometry",
    "front_end_times_real_time": "how much faster than the recording the front end ran",
    "times_real_time": "the same of reading, mapping and drawing the map together",
}
OF_EXTENSIONS = ("stretches", "stretches_agreeing", "walls_agreement", "keyframes_kept", "keyframes_dropped")


def write_slam_report(folder: Path) -> Path:
    """Write ``report.html`` into a folder of ``pilotage slam`` and return its path."""
    path = folder / REPORT_FILE
    give_back()
    write_whole(path, slam_page(read_slam_folder(folder)))
    return path


def slam_page(data: SlamFolder) -> str:
    """Return the page as HTML."""
    with drawing_style():
        figures = [
            map_figure(data),
            before_after_figure(data),
            growth_figure(data),
            closures_figure(data),
            uncertainty_figure(data),
        ]
    m = data.metrics
    sections = figure_sections(figures)
    if data.closures:
        sections.insert(4, closures_section(data))
    sections.insert(1, replay_section(slam_scene(data)))
    sections += [_numbers(m), _warnings(m)]
    loops = (
        f"{quantities.count(m['closures_accepted'])} of {quantities.count(m['closures_searched'])} compared "
        "pairs of stretches closed a loop"
    )
    headline = (
        f"{quantities.count(m['scans'])} scans over {m['path_length_m']:.0f}\u00a0m in "
        f"{quantities.duration(m['duration_s'])}; {loops if data.closures else 'a path without a loop'}."
    )
    if "extends" in m:
        headline += f" Joined to {Path(m['extends']).name} by {m['closures_joining']} of them."
    return page(
        sections,
        figures,
        title=f"Map of {m['log']}",
        eyebrow="pilotage slam",
        headline=headline,
        tiles=_tiles(m),
        rules=style() + viewer.STYLE,
        script_source=f"{script_source()} {source_of(viewer.script())}",
        footer=f"Made by pilotage from {data.folder.name}.",
    )


def _tiles(m: Mapping[str, Any]) -> list[tuple[str, str]]:
    return [
        ("map", f"{m['map_columns'] * m['resolution_m']:.0f} × {m['map_rows'] * m['resolution_m']:.0f} m"),
        ("closed loops", str(m["closures_accepted"])),
        ("least sure position", f"±{m['position_std_max_m']:.2f} m"),
        ("faster than real time", f"{m['times_real_time']:.0f} ×"),
    ]


def _numbers(m: Mapping[str, Any]) -> Section:
    rows = [
        (_name(key), _text(key, m.get(key)), meaning)
        for key, meaning in MEANINGS.items()
        if key in m or key not in OF_EXTENSIONS
    ]
    columns = (("what", ROW), ("value", VALUE), ("what it means", ""))
    return section("numbers", "Numbers", table(columns, rows, "metrics"))


def _warnings(m: Mapping[str, Any]) -> Section:
    lines = (f'<p class="absent">{escape(str(text))}.</p>' for text in m["warnings"])
    return section("warnings", "What the recording lacked", *lines)


def _name(key: str) -> str:
    words = (
        "position_std_largest" if key == "position_std_max_m" else key.removesuffix("_m").removesuffix("_s")
    )
    return words.replace("_", " ")


def _text(key: str, value: object) -> str:
    told = number(value)
    if key.endswith(("_m", "_s")):
        return quantities.length(told) if key.endswith("_m") else quantities.duration(told)
    return quantities.count(told) if isinstance(value, int) else quantities.significant(told, 4)
