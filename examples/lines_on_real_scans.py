"""Straight lines extracted from real laser scans, drawn over the scans.

Two Radish recordings with a SICK scanner of 180 beams: the Intel Research Lab and the FHW museum. The
extraction is that of ``ekf-walls``, told of a coarser scanner: 2 cm of noise, and lines of six points, since
a wall 5 m away has a point every 9 cm only. Says how much of the scans the lines explain, how far the points
lie from them, and how many lines the next scan shows again. Needs the folders ``intel`` and ``fhw_museum`` in
``../shared/data``, or where the first argument says. Draws ``lines_on_real_scans.png``.
"""

import itertools
import math
import sys
from dataclasses import dataclass
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection

from pilotage.core.types import FloatArray, IntArray
from pilotage.logs.carmen import CarmenLog, read_carmen
from pilotage.sensors.lidar import LidarConfig
from pilotage.stack.perception.lines import DetectedLines, LineExtractionConfig, LineExtractor

LOGS = {
    "Intel Research Lab": "intel/intel-corrected.log.gz",
    "FHW museum": "fhw_museum/fhw-corrected.log.gz",
}
RANGE_STD_M = 0.02
EXTRACTION = LineExtractionConfig(cluster_points=6, line_points=6)
CLOSE_UPS = 3


@dataclass(frozen=True)
class Scan:
    """A scan's lines (L, 4) and points (N, 2), both in the map frame, and what each point belongs to."""

    found: DetectedLines
    lines_m: FloatArray
    points_m: FloatArray
    returned: IntArray
    pose: FloatArray


def lines_of(log: CarmenLog) -> list[Scan]:
    """Extract the lines of every scan, at the poses that the log gives."""
    angles = log.angles_rad(0)
    beams, step = angles.size, float(log.angle_step_rad[0])
    # The library's fans are even about the x axis; this scanner's first beam looks a little farther right.
    aside = float(angles[0]) + 0.5 * step * (beams - 1)
    scanner = LidarConfig(beams=beams, field_of_view_rad=step * (beams - 1), range_var_m2=RANGE_STD_M**2)
    extractor = LineExtractor(EXTRACTION, scanner, scanner.range_var_m2, np.random.default_rng(0))
    scans = []
    for ranges, pose in zip(log.ranges_m, log.laser_poses, strict=True):
        found = extractor.extract(ranges)
        c, s = math.cos(pose[2] + aside), math.sin(pose[2] + aside)
        turn = np.array([[c, s], [-s, c]])
        lines = (found.ends_m.reshape(-1, 2) @ turn + pose[:2]).reshape(-1, 4)
        returned = np.flatnonzero(ranges < scanner.sure_range_m)
        scans.append(Scan(found, lines, found.points_m @ turn + pose[:2], returned, pose))
    return scans


def residuals_m(scan: Scan) -> FloatArray:
    """Distances of the points from the lines that they belong to."""
    members = scan.found.members
    on = np.flatnonzero(members >= 0)
    rho, alpha = scan.found.rho_alpha[members[on]].T
    x, y = scan.found.points_m[on].T
    return np.asarray(x * np.cos(alpha) + y * np.sin(alpha) - rho)


def seen_again(before: Scan, after: Scan) -> tuple[int, int]:
    """How many lines the next scan shows again, and how many it could: those that it has points beside.

    Again means: turned by less than 5 degrees, and the middle within 15 cm of the other's infinite line.
    """
    again = could = 0
    for line in before.lines_m:
        middle = 0.5 * (line[:2] + line[2:])
        if np.hypot(*(after.points_m[after.returned] - middle).T).min() > 0.3:
            continue
        could += 1
        along = after.lines_m[:, 2:] - after.lines_m[:, :2]
        normals = np.column_stack([-along[:, 1], along[:, 0]]) / np.hypot(*along.T)[:, None]
        away = np.abs(np.sum(normals * (middle - after.lines_m[:, :2]), axis=1))
        own = line[2:] - line[:2]
        across = np.abs(normals @ own) / np.hypot(*own)
        again += bool(((away < 0.15) & (across < math.sin(math.radians(5.0)))).any())
    return again, could


def told(name: str, scans: list[Scan]) -> str:
    """One line of numbers."""
    share = np.mean([(scan.found.members >= 0).sum() / max(len(scan.returned), 1) for scan in scans])
    off = np.concatenate([residuals_m(scan) for scan in scans])
    pairs = np.array([seen_again(a, b) for a, b in itertools.pairwise(scans)])
    return (
        f"{name}: {len(scans)} scans, {sum(len(scan.found) for scan in scans)} lines, "
        f"{share:.0%} of the returns on a line, {1e3 * float(np.sqrt(np.mean(off**2))):.0f} mm from it, "
        f"{pairs[:, 0].sum() / pairs[:, 1].sum():.0%} of the lines seen again by the next scan"
    )


def draw_all(axes: Axes, name: str, scans: list[Scan]) -> None:
    """All points, and all lines over them."""
    points = np.concatenate([scan.points_m[scan.returned] for scan in scans])
    axes.plot(points[:, 0], points[:, 1], ".", color="#b4bec9", markersize=0.4, rasterized=True)
    lines = np.concatenate([scan.lines_m for scan in scans]).reshape(-1, 2, 2)
    axes.add_collection(LineCollection(list(lines), colors="#0072B2", linewidths=0.6, alpha=0.5))
    axes.set_title(f"{name}: all scans and lines", loc="left")


def draw_one(axes: Axes, scan: Scan, number: int) -> None:
    """One scan: its points by cluster, and its lines over them."""
    members = scan.found.clusters[scan.returned]
    points = scan.points_m[scan.returned]
    axes.plot(*points[members < 0].T, ".", color="#9aa5b1", markersize=4)
    for label in np.unique(members[members >= 0]):
        axes.plot(*points[members == label].T, ".", markersize=5)
    axes.add_collection(LineCollection(list(scan.lines_m.reshape(-1, 2, 2)), colors="black", linewidths=1.2))
    axes.plot(*scan.pose[:2], marker=(3, 0, math.degrees(scan.pose[2]) - 90.0), color="black", markersize=9)
    axes.set_title(f"scan {number}: {len(scan.found)} lines", loc="left")


def main() -> None:
    """Read, extract, tell, draw."""
    data = Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).parents[2] / "shared" / "data"
    logs = {name: data / file for name, file in LOGS.items() if (data / file).is_file()}
    if not logs:
        print(f"nothing to show: no data in {data}")
        return
    figure, rows = plt.subplots(len(logs), 1 + CLOSE_UPS, figsize=(18, 5 * len(logs)), squeeze=False)
    for row, (name, path) in zip(rows, logs.items(), strict=True):
        scans = lines_of(read_carmen(path))
        print(told(name, scans))
        draw_all(row[0], name, scans)
        for axes, part in zip(row[1:], (0.2, 0.5, 0.8), strict=True):
            number = int(part * len(scans))
            draw_one(axes, scans[number], number)
        for axes in row:
            axes.set_aspect("equal", adjustable="datalim")
            axes.tick_params(labelsize=8)
    figure.tight_layout()
    figure.savefig("lines_on_real_scans.png", dpi=110)
    print("drawn: lines_on_real_scans.png")


if __name__ == "__main__":
    main()
