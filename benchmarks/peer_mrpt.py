"""MRPT's Rao-Blackwellized particle filter (Debian's ``mrpt-apps``) on a recording with odometry.

``rbpf-slam`` reads pairs of an odometry increment and a scan, which no converter of the package writes; they
are written here in MRPT's own serialization. Its settings are those that MRPT gives for the Intel building:
ten particles, each scan aligned by ICP with a map of points (Grisetti's proposal), an update every 0.2 m or
10 degrees. Poses between are led by the odometry.
"""

from __future__ import annotations

import gzip
import math
import shutil
import struct
import subprocess
import time
from pathlib import Path

import numpy as np

from pilotage.core.types import FloatArray, IntArray
from pilotage.kernels.geometry.motion import wrap
from pilotage.logs.laser_log import LaserLog

PROGRAM = "rbpf-slam"
UPDATE_M, UPDATE_RAD = 0.2, math.radians(10.0)
FAR_M = 81.0
TO_1970_S = 11_644_473_600
"""From 1601, where MRPT's time begins."""
DEADLINE_S = 3600.0
GAUSSIAN = 0.01, 0.0057, 0.01745, 0.05, 0.01, 0.0035
THRUN = 0.05, 0.001, 0.01, 0.0001, 0.001, 0.0009
"""Noise of the odometry, MRPT's defaults; the second model is written but not used."""
SETTINGS = """\
[MappingApplication]
rawlog_file={rawlog}
rawlog_offset=0
logOutput_dir={out}
LOG_FREQUENCY=1000000
SAVE_MAP_IMAGES=0
SAVE_3D_SCENE=0
SAVE_POSE_LOG=0
SAVE_ENOSE_READINGS=0
SHOW_PROGRESS_IN_WINDOW=0
insertionLinDistance=2.0
insertionAngDistance_deg=30.0
localizeLinDistance=0.01
localizeAngDistance_deg=0.5
PF_algorithm=2
adaptiveSampleSize=0
resamplingMethod=0
sampleSize=10
BETA=0.50
occupancyGrid_count=0
gasGrid_count=0
landmarksMap_count=0
beaconMap_count=0
pointsMap_count=1
likelihoodMapSelection=-1
pfOptimalProposal_mapSelection=3
ICPGlobalAlign_MinQuality=0.80
ICP_algorithm=icpLevenbergMarquardt
maxIterations=60
thresholdDist=1.0
thresholdAng_DEG=5
ALFA=0.5
smallestThresholdDist=0.10
onlyClosestCorrespondences=1
[MappingApplication_pointsMap_00_insertOpts]
minDistBetweenLaserPoints=0.05
fuseWithExisting=0
isPlanarMap=1
[MappingApplication_pointsMap_00_likelihoodOpts]
max_corr_distance=5.0
sigma_dist=0.05
"""


def is_installed() -> bool:
    """Say whether the program is on the path."""
    return shutil.which(PROGRAM) is not None


def rbpf_slam(log: LaserLog, folder: Path) -> tuple[float, FloatArray]:
    """Seconds that it took, and (N, 3) poses of the scanner by its best particle.

    Raises
    ------
    RuntimeError
        Where the program fails, or tells another number of poses than it was given scans.
    """
    odometry = log.odometry_at_scans()
    assert odometry is not None, "it is led by the odometry"
    chosen = updates(odometry)
    rawlog, out = folder / "scans.rawlog", folder / "out"
    rawlog.write_bytes(gzip.compress(serialized(log, odometry, chosen), 1))
    (folder / "rbpf.ini").write_text(SETTINGS.format(rawlog=rawlog, out=out), encoding="utf-8")
    began = time.perf_counter()
    done = subprocess.run(
        [PROGRAM, str(folder / "rbpf.ini"), str(rawlog)],
        stdin=subprocess.DEVNULL, capture_output=True, timeout=DEADLINE_S, check=False,
    )  # fmt: skip
    took_s = time.perf_counter() - began
    path = out / "most_likely_path.txt"
    if done.returncode != 0 or not path.is_file():
        raise RuntimeError(f"{PROGRAM} ended with {done.returncode}")
    found = np.loadtxt(path, ndmin=2)[1:]  # before them where it began
    if len(found) != len(chosen):
        raise RuntimeError(f"{PROGRAM}: {len(found)} poses of {len(chosen)} scans")
    return took_s, scanner_poses(log, odometry, chosen, found)


def updates(odometry: FloatArray) -> IntArray:
    """Scans (K,) that the robot moved far enough for since the one before, by its odometry (N, 3)."""
    chosen = [0]
    for k in range(1, len(odometry)):
        x, y, turn = increment(odometry[chosen[-1]], odometry[k])
        if math.hypot(x, y) > UPDATE_M or abs(turn) > UPDATE_RAD:
            chosen.append(k)
    return np.array(chosen, np.int64)


def increment(before: FloatArray, after: FloatArray) -> tuple[float, float, float]:
    """The second pose (3,) seen from the first."""
    c, s = math.cos(before[2]), math.sin(before[2])
    dx, dy = after[0] - before[0], after[1] - before[1]
    return c * dx + s * dy, c * dy - s * dx, wrap(after[2] - before[2])


def scanner_poses(log: LaserLog, odometry: FloatArray, chosen: IntArray, found: FloatArray) -> FloatArray:
    """(N, 3) of the scanner at all scans: the robot's at some (K, 3), and its odometry from there."""
    last = np.searchsorted(chosen, np.arange(len(log)), side="right") - 1
    steps = np.array([increment(odometry[chosen[i]], at) for i, at in zip(last, odometry, strict=True)])
    mount = np.tile(log.mount.as_array(), (len(log), 1))
    return composed(composed(found[last], steps), mount)


def composed(first: FloatArray, second: FloatArray) -> FloatArray:
    """Poses (N, 3): the second, which is seen from the first, as seen from the origin."""
    c, s = np.cos(first[:, 2]), np.sin(first[:, 2])
    x = first[:, 0] + c * second[:, 0] - s * second[:, 1]
    y = first[:, 1] + s * second[:, 0] + c * second[:, 1]
    return np.column_stack([x, y, first[:, 2] + second[:, 2]])


def serialized(log: LaserLog, odometry: FloatArray, chosen: IntArray) -> bytes:
    """Pairs of what the odometry (N, 3) says since the last chosen scan, and the scan."""
    parts, before = [], odometry[chosen[0]]
    for k in chosen:
        moved = increment(before, odometry[k])
        before = odometry[k]
        parts += [_action(moved, float(log.t_s[k])), _frame(log, int(k))]
    return b"".join(parts)


def _object(name: str, version: int, content: bytes) -> bytes:
    word = f"mrpt::{name}".encode()
    return bytes([0x80 | len(word)]) + word + bytes([version]) + content + b"\x88"


def _stamp(t_s: float) -> bytes:
    return struct.pack("<Q", round((t_s + TO_1970_S) * 1e7))


def _action(moved: tuple[float, float, float], t_s: float) -> bytes:
    content = struct.pack("<I", 0) + _object("poses::CPose2D", 1, struct.pack("<3d", *moved))
    content += struct.pack("<I6fI6f2B", 0, *GAUSSIAN, 300, *THRUN, 0, 0) + _stamp(t_s)
    action = _object("obs::CActionRobotMovement2D", 7, content)
    return _object("obs::CActionCollection", 0, struct.pack("<I", 1) + action)


def _frame(log: LaserLog, k: int) -> bytes:
    beams, step = int(log.beams[k]), float(log.angle_step_rad[k])
    ranges = log.ranges_m[k, :beams]
    hit = np.isfinite(ranges)
    # Its scans lie evenly about their middle.
    middle = float(log.first_angle_rad[k]) + 0.5 * step * (beams - 1) + log.mount.theta_rad
    c, s = math.cos(middle), math.sin(middle)
    pose = struct.pack("<12d", log.mount.x_m, log.mount.y_m, 0.0, c, -s, 0.0, s, c, 0.0, 0.0, 0.0, 1.0)
    content = struct.pack("<fBf", abs(step) * (beams - 1), step > 0.0, FAR_M)
    content += _object("poses::CPose3D", 3, pose) + struct.pack("<I", beams)
    content += np.where(hit, ranges, 0.0).astype("<f4").tobytes() + hit.astype("u1").tobytes()
    content += struct.pack("<f", 0.01) + _stamp(float(log.t_s[k])) + struct.pack("<fI", 0.0, 6) + b"FLASER"
    content += struct.pack("<dB", 0.0, 0)
    scan = _object("obs::CObservation2DRangeScan", 7, content)
    return _object("obs::CSensoryFrame", 2, struct.pack("<I", 1) + scan)
