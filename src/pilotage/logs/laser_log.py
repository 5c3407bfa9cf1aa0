"""What a laser SLAM needs of a recording, in one form for bags and CARMEN logs.

The readers (``logs.bags``, ``logs.carmen_laser``) hand over what was recorded as ``RawScan`` values;
``assemble`` brings it into order: scans by time, beams counter-clockwise, ranges of three kinds only. What it
had to put right is said in ``warnings``; nothing is dropped without a word.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from pilotage.core.angles import wrap_array_to_pi
from pilotage.core.errors import InputError
from pilotage.core.types import BoolArray, FloatArray, IntArray, Pose2
from pilotage.logs.scanner_mount import LARGEST
from pilotage.logs.stamps import apart, between_readings, increasing, keeps_order
from pilotage.sensors.lidar import LEAST_STEP_RAD

SCANNER_STEPS_DEG, STEP_ERROR = (1.0, 0.5, 1.0 / 3.0, 0.25), 1e-4
"""Angles between beams that planar scanners are built with, and the share a told one may be off from one."""
MOST_VIEW_RAD, MOST_FIRST_RAD = 4.0 * math.pi, 4.0 * math.pi
"""Beyond these the beams' angles are degrees or no angles."""


@dataclass(frozen=True, slots=True)
class RawScan:
    """One scan as it was recorded: beam ``k`` looks along ``first_angle_rad + k * angle_step_rad``.

    ``readings_before`` counts the readings of the odometry that were recorded before it; -1: unknown.
    ``odometry`` is its pose (3,) of the robot where the scan carries one.
    """

    t_s: float
    ranges_m: FloatArray
    first_angle_rad: float
    angle_step_rad: float
    range_min_m: float
    range_max_m: float
    readings_before: int = -1
    odometry: FloatArray | None = None


@dataclass(frozen=True, slots=True)
class LaserLog:
    """Scans with odometry, in the order of time, or of the file where stamps that go back are wrong.

    Attributes
    ----------
    name
        The file's name, for messages.
    t_s
        (N,) times of the scans, not decreasing; put right where those of the log go back and are wrong.
    ranges_m
        (N, B); a row shorter than B ends in NaN. Within [range_min_m, range_max_m], or ``inf``: nothing
        within reach, or ``nan``: no measurement (or nearer than the scanner can tell).
    beams
        (N,) how many entries of each row are beams.
    first_angle_rad, angle_step_rad
        (N,) direction of each scan's first beam, and the positive angle between two: counter-clockwise in the
        frame of ``mount``, an upside-down scanner's beams being turned round.
    range_min_m, range_max_m
        The scanner's limits.
    mount
        Pose of the scanner on the robot.
    upside_down
        Whether the scanner was mounted so; already accounted for in the angles.
    odometry_t_s, odometry
        (M,) increasing times and (M, 3) poses x, y, theta as logged; None without odometry.
    warnings
        What was missing, damaged or put right, a sentence each.
    stamps_s
        (N,) the scans' times as the log has them, where they were put right.
    told_angles
        (N, 2) first angles and steps as the log tells them, where others were taken for more probable.
    """

    name: str
    t_s: FloatArray
    ranges_m: FloatArray
    beams: IntArray
    first_angle_rad: FloatArray
    angle_step_rad: FloatArray
    range_min_m: float
    range_max_m: float
    mount: Pose2
    upside_down: bool
    odometry_t_s: FloatArray | None
    odometry: FloatArray | None
    warnings: tuple[str, ...] = ()
    stamps_s: FloatArray | None = None
    told_angles: FloatArray | None = None

    def __len__(self) -> int:
        return int(self.t_s.shape[0])

    def angles_rad(self, scan: int) -> FloatArray:
        """Return (B,) the directions of a scan's beams in the frame of ``mount``; NaN behind the last one."""
        k = np.arange(self.ranges_m.shape[1], dtype=np.float64)
        k[int(self.beams[scan]) :] = np.nan
        return np.asarray(self.first_angle_rad[scan] + self.angle_step_rad[scan] * k)

    def as_told(self) -> LaserLog:
        """Return the same with the beams where the log tells them."""
        if self.told_angles is None:
            return self
        step_deg = math.degrees(self.told_angles[0, 1])
        return replace(
            self,
            first_angle_rad=self.told_angles[:, 0],
            angle_step_rad=self.told_angles[:, 1],
            warnings=(*self.warnings, f"closed loops speak for the {step_deg:.5g} deg that were told"),
            told_angles=None,
        )

    def odometry_at_scans(self) -> FloatArray | None:
        """Return (N, 3) the odometry at the scans' times, or None without odometry.

        Position and heading are interpolated linearly (heading along the shorter arc); before the first and
        after the last reading that one stays.
        """
        if self.odometry_t_s is None or self.odometry is None:
            return None
        return interpolate_poses(self.odometry_t_s, self.odometry, self.t_s)


def interpolate_poses(t_s: FloatArray, poses: FloatArray, at_s: FloatArray) -> FloatArray:
    """Return (K, 3) poses at the times ``at_s`` from poses (M, 3) at increasing times ``t_s`` (M,)."""
    heading = np.unwrap(poses[:, 2])
    columns = [np.interp(at_s, t_s, values) for values in (poses[:, 0], poses[:, 1], heading)]
    columns[2] = wrap_array_to_pi(columns[2])
    return np.column_stack(columns)


def assemble(
    name: str,
    scans: Sequence[RawScan],
    mount: Pose2,
    upside_down: bool,
    odometry_t_s: FloatArray,
    odometry: FloatArray,
    warnings: Sequence[str] = (),
) -> LaserLog:
    """Bring scans and odometry into order.

    Parameters
    ----------
    scans
        At least one, in the order of the file.
    odometry_t_s, odometry
        (M,), (M, 3) in the order of the file; M = 0: none was recorded.
    warnings
        What the reader has to say already.

    Raises
    ------
    InputError
        Where not one scan has a beam.
    """
    said = list(warnings)
    with_beams = [scan for scan in scans if scan.ranges_m.size and _is_usable(scan)]
    if len(with_beams) < len(scans):
        said.append(
            f"{len(scans) - len(with_beams)} scans without beams, times, angles or limits were left out"
        )
    if not with_beams:
        raise InputError(
            f"{name}: expected laser scans, found {len(scans)} scans without a usable beam (angles in "
            "radians, at most two turns; range_max above range_min)"
        )
    no_times, poses, readings_s = _in_order(odometry_t_s, odometry, said)
    with_beams, t_s, stamps_s = _ordered(with_beams, readings_s, said)
    carried = [scan.odometry for scan in with_beams if scan.odometry is not None]
    if len(carried) == len(with_beams):
        # Each scan has a reading of its own, also where many have one time.
        no_times = t_s = apart(t_s)
        poses = np.array(carried)
    beams = np.array([scan.ranges_m.size for scan in with_beams], dtype=np.int64)
    if beams.min() < beams.max():
        sizes = ", ".join(str(size) for size in np.unique(beams)[:8])
        said.append(f"the number of beams changes from scan to scan ({sizes})")
    nothing = sum(int(np.count_nonzero(np.isnan(scan.ranges_m))) for scan in with_beams)
    if nothing:
        share = nothing / int(beams.sum())
        said.append(f"{nothing} ranges are not numbers ({share:.1%}): no measurement")
    first = np.array([scan.first_angle_rad for scan in with_beams])
    # What a scan of one beam says of the next one is nothing, and may be anything.
    told = np.where(beams == 1, LEAST_STEP_RAD, [scan.angle_step_rad for scan in with_beams])
    step = _without_the_last_post(told, beams, said)
    ranges_m = np.full((beams.size, int(beams.max())), np.nan)
    # A turned-over scanner sees its beams mirrored; a scanner of falling angles counts them clockwise.
    clockwise = (step < 0.0) != upside_down
    for row, scan in enumerate(with_beams):
        ranges_m[row, : beams[row]] = scan.ranges_m[::-1] if clockwise[row] else scan.ranges_m
    sign = -1.0 if upside_down else 1.0

    def angles(step_rad: FloatArray) -> FloatArray:
        least = np.where(clockwise, first + step_rad * (beams - 1), first)
        return np.column_stack([sign * least, np.abs(step_rad)])

    taken = angles(step)
    range_min_m = float(np.median([scan.range_min_m for scan in with_beams]))
    range_max_m = float(np.median([scan.range_max_m for scan in with_beams]))
    if no_times is None:
        said.append("no odometry")
    elif no_times[0] > t_s[0] + 1.0 or no_times[-1] < t_s[-1] - 1.0:
        said.append(
            f"odometry covers {no_times[0]:.1f} s to {no_times[-1]:.1f} s, "
            f"the scans {t_s[0]:.1f} s to {t_s[-1]:.1f} s"
        )
    return LaserLog(
        name,
        t_s,
        _in_three_kinds(ranges_m, range_min_m, range_max_m),
        beams,
        taken[:, 0],
        taken[:, 1],
        range_min_m,
        range_max_m,
        mount,
        upside_down,
        no_times,
        poses,
        tuple(said),
        stamps_s,
        None if step is told else angles(told),
    )


def is_built_step(step_rad: FloatArray) -> BoolArray:
    """(N,) whether angles between beams are such as planar scanners are built with."""
    told = np.degrees(np.abs(step_rad))[:, None] / np.array(SCANNER_STEPS_DEG)
    return np.asarray(np.abs(told - 1.0).min(axis=1) < STEP_ERROR)


def _without_the_last_post(step_rad: FloatArray, beams: IntArray, said: list[str]) -> FloatArray:
    """(N,) angles between beams, put right where a field of view of n steps was divided by n - 1.

    Converters that know the field of view alone take the n-th beam for its far edge. A scanner of 180 beams a
    degree apart then turns by half a per cent too much, and looks half a degree aside. There are scanners,
    above all simulated ones, that do space their beams so: closed loops can tell (``LaserLog.as_told``).
    """
    true_rad = step_rad * (beams - 1) / beams
    if is_built_step(step_rad).any() or not is_built_step(true_rad).all():
        return step_rad
    said.append(
        f"{beams[0]} beams are told to be {math.degrees(abs(step_rad[0])):.5g} deg apart: taken as "
        f"{math.degrees(abs(true_rad[0])):.5g} deg, the same field of view in as many steps as beams"
    )
    return true_rad


def are_beams(first_angle_rad: float, angle_step_rad: float, beams: int) -> bool:
    """Whether a scanner can look so; NaN is in no range."""
    apart = beams == 1 or abs(angle_step_rad) >= LEAST_STEP_RAD
    return (
        apart
        and abs(first_angle_rad) <= MOST_FIRST_RAD
        and abs(angle_step_rad) * (beams - 1) <= MOST_VIEW_RAD
    )


def _is_usable(scan: RawScan) -> bool:
    """Whether a scanner could have made it; NaN is in no range, a limit of infinity is one."""
    reaches = scan.range_max_m > max(scan.range_min_m, 0.0)
    looks = are_beams(scan.first_angle_rad, scan.angle_step_rad, scan.ranges_m.size)
    return math.isfinite(scan.t_s) and looks and reaches


def _in_three_kinds(ranges_m: FloatArray, least: float, most: float) -> FloatArray:
    """Ranges as REP 117 has them, in place: measured, infinite (nothing in reach), NaN (not measured)."""
    with np.errstate(invalid="ignore"):
        ranges_m[ranges_m > most] = np.inf
        # Zero is what many drivers write for no measurement, also where the least range is zero.
        ranges_m[(ranges_m < least) | (ranges_m <= 0.0)] = np.nan
    return ranges_m


def _ordered(
    scans: list[RawScan], readings_s: FloatArray, said: list[str]
) -> tuple[list[RawScan], FloatArray, FloatArray | None]:
    """Scans in their order, their times, and the stamps where those are others."""
    told_s = np.array([scan.t_s for scan in scans])
    order = _by_time(told_s, "scans", said, lambda: _ranges(scans))
    if order is not None:
        return [scans[k] for k in order], told_s[order], None
    before = np.array([scan.readings_before for scan in scans], np.int64)
    return scans, increasing(between_readings(told_s, before, readings_s)), told_s


def _ranges(scans: list[RawScan]) -> FloatArray:
    """(N, B) of scans, beams beyond the shortest one's left out."""
    beams = min(scan.ranges_m.size for scan in scans)
    return np.array([scan.ranges_m[:beams] for scan in scans])


def _by_time(
    t_s: FloatArray, what: str, said: list[str], values: Callable[[], FloatArray]
) -> IntArray | None:
    """Return the order of time, equal times in that of the file; None where the file's order is right."""
    back = np.diff(t_s)
    wrong = np.flatnonzero(back < 0.0)
    order = np.argsort(t_s, kind="stable")
    if wrong.size:
        keep = keeps_order(values(), order)
        done = "the order of the file counts" if keep else "sorted by time"
        said.append(f"{wrong.size} times of the {what} go back (by {-back.min():.3f} s at most): {done}")
        if keep:
            return None
    same = int(np.count_nonzero(np.diff(t_s[order]) == 0.0))
    if same:
        said.append(f"{same} of the {what} carry the time of the one before")
    return order


def _in_order(
    t_s: FloatArray, poses: FloatArray, said: list[str]
) -> tuple[FloatArray | None, FloatArray | None, FloatArray]:
    """Odometry by increasing times, all possible; of two readings of a time the later counts.

    The third are the times of all readings in the order of the file, where that is the order of time.
    """
    poses = poses.reshape(-1, 3)
    possible = np.isfinite(t_s) & (np.abs(poses) <= LARGEST).all(axis=1)
    if not possible.all():
        said.append(f"{int(np.count_nonzero(~possible))} odometry readings that are no places were left out")
    count = np.cumsum(possible)
    t_s, poses = t_s[possible], poses[possible]
    if t_s.size == 0:
        return None, None, np.zeros(0)
    notes: list[str] = []
    order = _by_time(t_s, "odometry", notes, lambda: poses[:, :2])
    said.extend(note for note in notes if "go back" in note)
    if order is None:
        t_s = increasing(t_s)
    else:
        t_s, poses = t_s[order], poses[order]
    in_file = order is None or bool((order == np.arange(order.size)).all())
    readings_s = t_s[np.maximum(count - 1, 0)] if in_file else np.zeros(0)
    kept = np.append(np.diff(t_s) > 0.0, True)
    out = poses[kept]
    out[:, 2] = wrap_array_to_pi(out[:, 2])
    return t_s[kept], out, readings_s
