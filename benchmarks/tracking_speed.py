"""How fast a film is tracked on one core, without and with the annotated film.

    python -m benchmarks.tracking_speed FILM

Exit code 0 where tracking without the annotated film takes at least 60 frames a second of processor time.
"""

from __future__ import annotations

import os
import sys
import tempfile
import time
from pathlib import Path

from pilotage.tracking.opencv import opencv
from pilotage.tracking.output import annotated_film
from pilotage.tracking.scene import TrackOptions, learn_scene
from pilotage.tracking.track import follow

BAR = 60.0


def main(arguments: list[str]) -> int:
    """Track the film twice and print frames a second."""
    film = Path(arguments[0])
    if hasattr(os, "sched_setaffinity"):
        os.sched_setaffinity(0, {min(os.sched_getaffinity(0))})
    opencv().setNumThreads(1)
    start_s = time.process_time()
    track = follow(film, learn_scene(film, TrackOptions()))
    alone = track.frames / (time.process_time() - start_s)
    start_s = time.process_time()
    scene = learn_scene(film, TrackOptions())
    with tempfile.TemporaryDirectory() as folder, annotated_film(Path(folder), scene) as writer:
        follow(film, scene, writer)
    both = track.frames / (time.process_time() - start_s)
    print(f"{track.frames} frames, robot found in {len(track.path.frames)}")
    print(f"tracking {alone:.0f} frames a second; with the annotated film {both:.0f}")
    return 0 if alone >= BAR else 1


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
