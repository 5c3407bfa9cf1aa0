"""What a track leaves in a folder: JSON, CSV, pictures, text maps and a film that browsers play."""

from __future__ import annotations

import csv
import io
import json
import queue
import threading
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import Any

from pilotage.core.errors import InputError
from pilotage.core.hushed import hushed
from pilotage.core.whole_file import draft_of
from pilotage.maps.cell_map_text import features_only, format_cell_map
from pilotage.tracking.drawing import Annotator, top_view
from pilotage.tracking.film import Image
from pilotage.tracking.opencv import opencv
from pilotage.tracking.robot_finder import Sighting
from pilotage.tracking.scene import Scene
from pilotage.tracking.track import Track

FILM_NAME = "annotated.webm"
_COLUMNS = ("frame", "t_s", "x_px", "y_px", "x_m", "y_m", "std_m")
_WAITING = 8


@contextmanager
def annotated_film(folder: Path, scene: Scene) -> Iterator[AnnotatedFilm]:
    """The film that appears in a folder under its name when it is complete; else nothing is left of it."""
    with draft_of(folder / FILM_NAME, end=".webm") as draft:
        film = AnnotatedFilm(draft, scene)
        try:
            yield film
            film.finish()
        finally:
            # Whatever struck while it was finished: the process must not end before what encodes in it.
            film.end()


class AnnotatedFilm:
    """Writes the annotated film while the robot is followed.

    VP8 in WebM, at the size that tracking works at: the pip builds of OpenCV can write it everywhere, and
    every browser plays it; what they write into .mp4 (MPEG-4 part 2) browsers do not play.
    Encoding runs in a thread of its own, behind a short queue.

    Parameters
    ----------
    path
        Where it is written.
    scene
        What was learned of the film.
    """

    def __init__(self, path: Path, scene: Scene) -> None:
        cv2 = opencv()
        height, width = scene.film.samples[0].shape[:2]
        # VP8 halves the colours' resolution: odd sizes are cut by a pixel.
        self._size = (width - width % 2, height - height % 2)
        self._annotator = Annotator(scene)
        code = cv2.VideoWriter_fourcc(*"VP80")
        with hushed():
            self._writer = cv2.VideoWriter(str(path), code, scene.film.fps, self._size)
        if not self._writer.isOpened():
            raise InputError(
                "this OpenCV cannot write VP8 video; leave out --out, or install its pip package"
            )
        self._queue: queue.Queue[tuple[Image, Sighting | None] | None] = queue.Queue(_WAITING)
        self._failure: BaseException | None = None
        self._thread = threading.Thread(target=self._write_all, daemon=True)
        self._thread.start()

    def __call__(self, reduced_frame: Image, sighting: Sighting | None) -> None:
        """Take one frame."""
        self._queue.put((reduced_frame, sighting))

    def finish(self) -> None:
        """Wait until all is written; raise what failed on the way."""
        self.end()
        if self._failure is not None:
            raise self._failure

    def end(self) -> None:
        """End what encodes; once more is no harm."""
        self._queue.put(None)
        self._thread.join()
        self._writer.release()

    def _write_all(self) -> None:
        width, height = self._size
        while (item := self._queue.get()) is not None:
            if self._failure is None:
                try:
                    self._writer.write(self._annotator.draw(*item)[:height, :width])
                except Exception as error:
                    self._failure = error


def write_track(folder: Path, track: Track) -> list[Path]:
    """Write everything but the film; returns what was written."""
    values = track.as_dict()
    good, png = opencv().imencode(".png", top_view(track))
    if not good:
        raise InputError("this OpenCV cannot write PNG pictures")
    contents: dict[str, bytes] = {
        "track.json": (json.dumps(values, allow_nan=False) + "\n").encode(),
        "path.csv": _csv(values["path"]).encode(),
        "floor_map.txt": format_cell_map(features_only(track.cells)).encode(),
        "visited_map.txt": format_cell_map(track.cells).encode(),
        "map.png": png.tobytes(),
    }
    with ExitStack() as drafts:  # all of them take their places, or none
        for name, content in contents.items():
            drafts.enter_context(draft_of(folder / name)).write_bytes(content)
    return [folder / name for name in contents]


def _csv(rows: list[dict[str, Any]]) -> str:
    text = io.StringIO()
    writer = csv.DictWriter(text, _COLUMNS, lineterminator="\n")
    writer.writeheader()
    writer.writerows(rows)
    return text.getvalue()
