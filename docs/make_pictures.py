"""Draws the pictures of the README anew: ``python docs/make_pictures.py`` (a few minutes)."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
from make_site import picture

import pilotage as pl
from pilotage.core.types import FloatArray
from pilotage.logs.bags import read_bag
from pilotage.logs.laser_log import LaserLog, interpolate_poses

IMAGES = Path(__file__).parent / "images"
STAGES = (0.25, 0.55, 1.0)


def night_watch(work: Path) -> None:
    """The robot in an unknown trap, as its report draws it."""
    run = pl.run("museum-concave", seed=3, out=work, progress=False)
    (IMAGES / "museum-concave.svg").write_text(picture(run.folder), encoding="utf-8")


def slam(work: Path) -> None:
    """A map that grows: the night watch's scans, mapped without its map, at three moments."""
    import matplotlib.pyplot as plt

    run = pl.run("museum-1", out=work, progress=False)
    recording = pl.export(run, "mcap")
    mapped = pl.slam(recording, out=work)
    log, path = read_bag(recording), mapped.trajectory
    headings = np.arctan2(path.rotations[:, 1, 0], path.rotations[:, 0, 0])
    assert path.t_s is not None
    poses = interpolate_poses(path.t_s, np.column_stack([path.points_xyz_m[:, :2], headings]), log.t_s)
    plt.rcParams.update({"font.size": 12.0})  # on a phone the picture is half as wide
    figure, axes = plt.subplots(
        1, len(STAGES), figsize=(7.2, 2.9), layout="constrained", sharex=True, sharey=True
    )
    for panel, share in zip(axes, STAGES, strict=True):
        count = max(1, round(share * len(log)))
        points = np.concatenate([_points(log, poses[k], k) for k in range(count)])
        panel.plot(points[:, 0], points[:, 1], ",", color="0.25", alpha=0.35)
        panel.plot(poses[:count, 0], poses[:count, 1], color="#1f6fb4", linewidth=1.0)
        panel.plot(*poses[count - 1, :2], "o", color="#d0361e", markersize=4)
        panel.set(aspect="equal", title=f"after {log.t_s[count - 1] - log.t_s[0]:.0f} s", xlabel="x [m]")
    axes[0].set_ylabel("y [m]")
    figure.savefig(IMAGES / "slam-growing.png", dpi=150)


def _points(log: LaserLog, pose: FloatArray, scan: int) -> FloatArray:
    """The hits of a scan in the map."""
    ranges, angles = log.ranges_m[scan], log.angles_rad(scan)
    known = np.isfinite(ranges) & np.isfinite(angles)
    mount = log.mount
    bearing = angles[known] + mount.theta_rad
    x, y = mount.x_m + ranges[known] * np.cos(bearing), mount.y_m + ranges[known] * np.sin(bearing)
    c, s = np.cos(pose[2]), np.sin(pose[2])
    return np.column_stack([pose[0] + c * x - s * y, pose[1] + s * x + c * y])


if __name__ == "__main__":
    folder = Path(sys.argv[1] if len(sys.argv) > 1 else "build/pictures")
    night_watch(folder)
    slam(folder)
