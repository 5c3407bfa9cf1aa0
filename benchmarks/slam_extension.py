"""A map extended by a second recording, on real buildings: errors, and growth.

    python -m benchmarks.slam_extension ../shared/data/slam --log intel fr079 --again 3

Each log is cut into halves. The first is mapped; the second, whose odometry has an origin and a heading of
its own, extends it (``--backwards``: the other way round). Relations are those of both halves, the mapped
one's scans hanging on the keyframes of theirs that were kept. Then the new half extends the answer over and
over (``--again``): the graph must not grow.
``--other`` extends a half by another building's, which must be refused.
"""

from __future__ import annotations

import argparse
import resource
import tempfile
import time
from dataclasses import replace
from pathlib import Path

import numpy as np

from benchmarks.slam_logs import chosen
from pilotage.core.types import FloatArray
from pilotage.evaluation.relations import relation_errors
from pilotage.kernels.slam.frames import between, composed
from pilotage.logs.laser_log import LaserLog
from pilotage.logs.laser_recordings import read_laser_log
from pilotage.logs.relations import read_relations
from pilotage.logs.trajectories import read_tum, write_planar_tum
from pilotage.stack.mapping.slam.config import SlamConfig
from pilotage.stack.mapping.slam.extension import extend_map
from pilotage.stack.mapping.slam.mapper import map_log
from pilotage.stack.mapping.slam.result import Joined, NotJoined, SlamResult

OTHER_START = np.array([5.0, -3.0, 2.1])
"""Where the second recording's odometry believes it begins."""


def half(log: LaserLog, second: bool, moved: bool) -> LaserLog:
    """One half; where it is ``moved`` its odometry has an origin and a heading of its own."""
    middle = len(log) // 2
    which = np.arange(middle, len(log)) if second else np.arange(middle)
    out = chosen(log, which)
    if log.odometry is None or log.odometry_t_s is None:
        return out
    near = (log.odometry_t_s >= out.t_s[0] - 1.0) & (log.odometry_t_s <= out.t_s[-1] + 1.0)
    odometry = log.odometry[near]
    if moved:
        odometry = np.array([composed(OTHER_START, between(odometry[0], pose)) for pose in odometry])
    return replace(out, odometry=odometry, odometry_t_s=log.odometry_t_s[near])


def rehung(first: SlamResult, joined: Joined, poses: FloatArray) -> FloatArray:
    """(N, 3) scans of the first recording where the joint map has them."""
    stamps = first.t_s[first.keyframes]
    kept = np.flatnonzero(np.isin(stamps, joined.earlier.scans.t_s))
    anchor = np.searchsorted(0.5 * (kept[1:] + kept[:-1]), first.known.owner)
    old = first.known.graph.poses[kept]
    pairs = zip(anchor, first.poses, strict=True)
    return np.array([composed(poses[a], between(old[a], pose)) for a, pose in pairs])


def error_m(t_s: FloatArray, poses: FloatArray, relations: Path) -> str:
    """Mean translational error of the relations whose moments are there, and how many are."""
    with tempfile.TemporaryDirectory() as draft:
        path = Path(draft) / "trajectory.tum"
        order = np.argsort(t_s, kind="stable")
        stamps = t_s[order] + 1e-6 * np.arange(t_s.size) * np.append(False, np.diff(t_s[order]) <= 0.0)
        write_planar_tum(path, stamps, poses[order])
        errors = relation_errors(read_tum(path), read_relations(relations))
    found = errors.summary()
    return f"{found['trans_mean_m']:.4f} m (most {found['trans_max_m']:.2f}, {found['relations']} relations)"


def memory_mb() -> float:
    """Most resident memory of this process so far."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024.0


def measured(folder: Path, name: str, again: int, other: str | None, backwards: bool) -> None:
    """Print the lines of a building."""
    log, relations = read_laser_log(folder / f"{name}.bag"), folder / f"{name}.relations"
    config = SlamConfig()
    first, second = half(log, backwards, False), half(log, not backwards, True)
    began = time.process_time()
    mapped = map_log(first, config)
    print(f"{name} mapped half: {error_m(mapped.t_s, mapped.poses, relations)}", flush=True)
    if other is not None:
        answer = extend_map(
            half(read_laser_log(folder / f"{other}.bag"), True, True), config, mapped.earlier_map()
        )
        print(
            f"{name} extended by {other}: {answer if isinstance(answer, NotJoined) else 'JOINED'}", flush=True
        )
    between_s = time.process_time()
    answer = extend_map(second, config, mapped.earlier_map())
    if isinstance(answer, NotJoined) or answer.joined is None:
        print(f"{name} extended: {answer}")
        return
    took_s = time.process_time() - between_s
    joined = answer.joined
    before = rehung(mapped, joined, answer.known.graph.poses[: len(joined.earlier)])
    t_s, poses = np.concatenate([first.t_s, second.t_s]), np.concatenate([before, answer.poses])
    print(
        f"{name} extended: {error_m(t_s, poses, relations)}, new half alone "
        f"{error_m(answer.t_s, answer.poses, relations)}; "
        f"{joined.agreeing} of {joined.stretches} stretches agree, "
        f"walls {joined.walls:.2f}, "
        f"{(second.t_s[-1] - second.t_s[0]) / took_s:.0f} x real time (processor time); "
        f"{'; '.join(answer.warnings)}; mapped half {between_s - began:.0f} s, {memory_mb():.0f} MB at most",
        flush=True,
    )
    for number in range(again + 1):
        graph = answer.known.graph
        points = answer.clouds.points.shape[0]
        print(
            f"{name} after {number + 1}: {len(graph)} keyframes, {graph.i.size} edges, {points} points, "
            f"new half {error_m(answer.t_s, answer.poses, relations)}",
            flush=True,
        )
        if number == again:
            break
        following = extend_map(second, config, answer.earlier_map())
        if isinstance(following, NotJoined):
            print(f"{name} again: {following}")
            return
        answer = following


def main() -> None:
    """Print the lines of each building."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--log", nargs="+", default=["intel", "fr079"])
    parser.add_argument("--again", type=int, default=0)
    parser.add_argument("--other")
    parser.add_argument("--backwards", action="store_true", help="the first half extends the second")
    asked = parser.parse_args()
    for name in asked.log:
        measured(asked.folder, name, asked.again, asked.other, asked.backwards)


if __name__ == "__main__":
    main()
