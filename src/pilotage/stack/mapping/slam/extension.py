"""A map made before, extended by a recording that may begin anywhere in it."""

from __future__ import annotations

from collections import Counter

import numpy as np

from pilotage.core.types import FloatArray, IntArray
from pilotage.logs.laser_log import LaserLog
from pilotage.stack.mapping.slam.back_end import REFINED_TRACK, ROBUST_STDS, LoopCloser, refined, solved
from pilotage.stack.mapping.slam.closures import USUAL_SLIP, Closure, Verdict
from pilotage.stack.mapping.slam.config import SlamConfig
from pilotage.stack.mapping.slam.earlier_map import EarlierMap, pruned
from pilotage.stack.mapping.slam.mapper import Mapped, OnStage, mapped, result_of, tracked
from pilotage.stack.mapping.slam.places import LEAST_AGREEING, RIVAL, Places, carried_to, links, places
from pilotage.stack.mapping.slam.result import Joined, NotJoined, SlamResult
from pilotage.stack.mapping.slam.submaps import Extent, extents
from pilotage.stack.mapping.slam.uncertainty import Edges

WINDOWS_M = (1.0, 1.0, 2.0, 2.0, 4.0)
"""Half a search window's side at most, round by round, once the recording's place is known."""


def extend_map(
    log: LaserLog, config: SlamConfig, earlier: EarlierMap, on_stage: OnStage | None = None
) -> SlamResult | NotJoined:
    """Map a recording and join it to an earlier map, in whose frame the answer is.

    The recording is mapped by itself. Stretches of it are searched all over the earlier map with any heading;
    where at least LEAST_AGREEING lie to each other as they do in the recording, and no other group rivals
    them, its place is known. Then closures between the two maps are searched and judged as any others, and
    both graphs are solved together. The earlier map is pruned before (``pruned``).

    Raises
    ------
    InputError
        As ``map_log``.
    """

    def say(text: str, share: float) -> None:
        if on_stage is not None:
            on_stage(text, share)

    local = tracked(log, config, say)
    if local.keyframes.size < 2:
        return NotJoined("the robot hardly moved: one keyframe tells no place", 0, 0)
    done = mapped(log, local, config, say)
    say("searching the map", 1.0)
    kept = pruned(earlier)
    found = places(kept, done.clouds, done.state, local.breaks, config)
    groups = _groups(done)
    located, doubt = _located(found, groups)
    while located:
        say("joining", 1.0)
        closer, base = _joined(kept, done, found, located, config)
        counts = Counter(_group_of(closure, len(kept), closer, groups) for closure in closer.closures)
        loose = [group for group in located if counts[group] < LEAST_AGREEING]
        if not loose:
            break
        for group in loose:
            doubt = f"of the closures there only {counts[group]} hold, {LEAST_AGREEING} are needed"
            del located[group]
    sound = int(found.sound.sum())
    if not located:
        return NotJoined(f"nothing joins it to the map: {doubt}", found.searched, sound)
    submaps = closer.submaps
    state = refined(closer, kept.clouds.and_more(done.clouds), base, since=len(kept))
    walls = found.walls(state.poses[len(kept) :])
    if walls < config.least_agreement:
        doubt = f"only {walls:.0%} of its points lie on walls where the map saw"
        return NotJoined(f"it contradicts the map: {doubt}", found.searched, sound)
    joined = Joined(
        kept,
        len(earlier) - len(kept),
        tuple(submaps.extents),
        len(submaps) - len(done.closer.submaps),
        tuple(closer.closures),
        found.searched,
        sum(chosen.size for chosen in located.values()),
        walls,
        tuple(_unfound(log, done, groups, located)),
    )
    say("drawing", 1.0)
    return result_of(config, done, state, joined)


def _groups(done: Mapped) -> list[set[int]]:
    """Pieces of the recording's track, those that closures join together."""
    extents = done.closer.submaps.extents
    groups = [{piece} for piece in range(done.local.breaks.size + 1)]
    for closure in done.closer.closures:
        if closure.verdict is Verdict.ACCEPTED:
            ends = {extents[k].piece for k in (closure.candidate.earlier, closure.candidate.later)}
            touched = [group for group in groups if group & ends]
            groups = [group for group in groups if not group & ends] + [set().union(*touched)]
    return sorted(groups, key=min)


def _located(found: Places, groups: list[set[int]]) -> tuple[dict[int, IntArray], str]:
    """Stretches that agree on the place of each group that has one, and what speaks against the others."""
    located: dict[int, IntArray] = {}
    doubt = ""
    for number, group in enumerate(groups):
        chosen, rivals = found.agreeing(group)
        if chosen.size < LEAST_AGREEING:
            doubt = doubt or (
                f"of {found.searched} stretches {int(found.sound.sum())} were found in one place alone, "
                f"and no {LEAST_AGREEING} agree"
            )
        elif rivals > RIVAL * chosen.size:
            doubt = f"{chosen.size} stretches agree on one place and {rivals} on another"
        else:
            located[number] = chosen
    return located, doubt


def _joined(
    earlier: EarlierMap, done: Mapped, found: Places, located: dict[int, IntArray], config: SlamConfig
) -> tuple[LoopCloser, Edges]:
    """Close loops between the two; the closer, and what stays beside the alignments of the refinement."""
    since = len(earlier)
    chosen = np.concatenate(list(located.values()))
    tied = links(found, chosen, earlier)
    own = _numbered_on(done.state.edges, since)
    known = earlier.edges.and_more(own)
    tied = Edges(tied.i, tied.j + since, tied.relative, tied.information, tied.closes)
    poses = np.concatenate([earlier.poses, carried_to(found, chosen, done.state.poses)])
    before = extents(earlier.poses, config.submap_length_m, earlier.breaks)
    after = [
        Extent(e.first + since, e.last + since, e.reference + since, e.piece + earlier.breaks.size + 1)
        for e in done.closer.submaps.extents
    ]
    closer = LoopCloser(config)
    state = solved(known.and_more(tied), poses, ROBUST_STDS)
    closer.take_joined(earlier.clouds.and_more(done.clouds), state, [*before, *after], len(before))
    for window_m in WINDOWS_M:
        closer.close(window_m, USUAL_SLIP)
    return closer, known.and_more(tied.scaled(REFINED_TRACK))


def _numbered_on(edges: Edges, by: int) -> Edges:
    """Return edges between poses that stand behind so many others."""
    return Edges(edges.i + by, edges.j + by, edges.relative, edges.information, edges.closes)


def _group_of(closure: Closure, since: int, closer: LoopCloser, groups: list[set[int]]) -> int:
    """Which group of pieces an accepted closure joins to the map; -1: it is not accepted."""
    if closure.verdict is not Verdict.ACCEPTED:
        return -1
    extents = closer.submaps.extents
    first = next(extent.piece for extent in extents if extent.first >= since)
    piece = extents[closure.candidate.later].piece - first
    return next(number for number, group in enumerate(groups) if piece in group)


def _unfound(log: LaserLog, done: Mapped, groups: list[set[int]], located: dict[int, IntArray]) -> list[str]:
    """Pieces of the recording whose place in the map is a guess."""
    starts = done.local.keyframes[[0, *done.local.breaks.tolist()]]
    times: FloatArray = log.t_s[starts]
    return [
        f"what begins at {times[min(group)]:.1f} s was not found in the map: where it lies is a guess"
        for number, group in enumerate(groups)
        if number not in located
    ]
