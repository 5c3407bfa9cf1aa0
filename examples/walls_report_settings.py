"""The night-watch report's figures 15 to 19 beside ours: its wall filter in its four settings, on one drive.

The robot drives the museum's route once, localized by ``ekf-walls``. Every other filter listens to the same
readings, so that what differs is the filter alone. Says how far each is off and how many lines it took; draws
``walls_report_settings.png``: the paths, the position's error, the heading's error with its own 2-sigma
band, and the share of the lines that were taken. The first argument may give another seed.
"""

import sys
from dataclasses import dataclass, field
from typing import cast

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from pilotage.experiments.floor.build import Experiment, build

from pilotage.core.angles import wrap_array_to_pi
from pilotage.core.types import STOP, FloatArray, Twist
from pilotage.experiments.mission import load_mission

SETTINGS = {15: (0.0039, 0.01), 16: (0.1, 0.5), 17: (1.0, 1.0), 18: (2.0, 5.0)}
"""Threshold of the Mahalanobis distance and variance of a wall's distance, by the report's figure."""
TAKEN_OVER_S = 2.0


@dataclass
class Listener:
    """A filter on the drive."""

    title: str
    experiment: Experiment
    poses: list[FloatArray] = field(default_factory=list)
    heading_vars: list[float] = field(default_factory=list)
    seen: list[float] = field(default_factory=list)
    taken: list[float] = field(default_factory=list)

    def note(self) -> None:
        """Keep what it believes now."""
        stack = self.experiment.stack
        journal = self.experiment.journal
        telemetry = dict(zip(journal.units, journal.row, strict=True))
        self.poses.append(stack.belief.pose.as_array())
        self.heading_vars.append(float(stack.belief.cov[2, 2]))
        self.seen.append(telemetry["lines_seen"])
        self.taken.append(telemetry["lines_accepted"])


def listeners(seed: int) -> list[Listener]:
    """Ours first, then the report's four."""
    ours = Listener("ours: ekf-walls", build(load_mission("museum-walls", [], seed)))
    theirs = []
    for number, (threshold, variance) in SETTINGS.items():
        overrides = [
            "stack.localizer.name=ekf-walls-report",
            f"stack.localizer.threshold_chi2={threshold}",
            f"stack.localizer.distance_var_m2={variance}",
        ]
        title = f"report fig. {number}: {threshold:g} and {variance:g} m²"
        theirs.append(Listener(title, build(load_mission("museum-walls", overrides, seed))))
    return [ours, *theirs]


def drive(filters: list[Listener]) -> tuple[FloatArray, FloatArray]:
    """Drive by the first filter, let all listen; returns times (N,) and true poses (N, 3)."""
    simulator, driver = filters[0].experiment.simulator, filters[0].experiment.stack
    times, truth, command = [], [], STOP
    while driver.status[0] == "running" and not simulator.body.collisions:
        readings = simulator.step(command)
        command = cast("Twist", driver.step(readings))
        for listener in filters[1:]:
            listener.experiment.stack.step(readings)
        for listener in filters:
            listener.note()
        times.append(readings.t_s)
        truth.append(simulator.truth.as_array())
    return np.array(times), np.array(truth)


def draw(columns: list[Axes], listener: Listener, t_s: FloatArray, truth: FloatArray) -> str:
    """One filter's four panels; returns its line of numbers."""
    poses = np.array(listener.poses)
    off = poses - truth
    distance = np.hypot(off[:, 0], off[:, 1])
    heading = wrap_array_to_pi(off[:, 2])
    way, position, turned, lines = columns
    walls = listener.experiment.floor.walls.segments_m.reshape(-1, 2, 2)
    way.add_collection(LineCollection(list(walls), colors="black", linewidths=0.8))
    way.plot(*truth[:, :2].T, color="#0072B2", linewidth=2.5, label="true")
    way.plot(*poses[:, :2].T, "--", color="#D55E00", linewidth=1.2, label="estimated")
    way.set(xlim=(-2, 30), ylim=(-2, 20), aspect="equal", title=listener.title)
    position.semilogy(t_s, np.maximum(distance, 1e-5), color="#D55E00")
    position.set(ylim=(1e-4, 1e2), ylabel="position error [m]")
    band = 2.0 * np.sqrt(np.array(listener.heading_vars))
    turned.fill_between(t_s, -band, band, color="#cbd5df", label="its own 2 sigma")
    turned.plot(t_s, heading, color="#D55E00", linewidth=1.0, label="error")
    limit = min(1.5, 1.3 * float(max(np.abs(heading[20:]).max(), band[20:].max())))
    turned.set(ylim=(-limit, limit), ylabel="heading error [rad]")
    # In windows: from scan to scan the share jumps between a few values.
    window = np.ones(round(TAKEN_OVER_S / float(t_s[1] - t_s[0])))
    seen = np.convolve(listener.seen, window, mode="same")
    share = np.convolve(listener.taken, window, mode="same") / np.maximum(seen, 1.0)
    lines.fill_between(t_s, share, color="#009E73")
    lines.set(ylim=(0, 1), ylabel="share of lines taken", xlabel="time [s]")
    taken = sum(listener.taken) / max(sum(listener.seen), 1.0)
    rmse = np.sqrt(np.mean(distance[20:] ** 2))
    return f"{listener.title:32s} {rmse:9.4f} {distance[20:].max():9.4f} {taken:8.0%}"


def main() -> None:
    """Drive, tell, draw."""
    filters = listeners(int(sys.argv[1]) if len(sys.argv) > 1 else 0)
    t_s, truth = drive(filters)
    figure, axes = plt.subplots(4, len(filters), figsize=(4 * len(filters), 12))
    print(f"{'threshold and variance':32s} {'RMSE [m]':>9s} {'max [m]':>9s} {'taken':>8s}")
    for listener, columns in zip(filters, axes.T, strict=True):
        print(draw(list(columns), listener, t_s, truth))
    axes[0, 0].legend(loc="upper left", fontsize=8)
    axes[2, 0].legend(loc="upper right", fontsize=8)
    figure.tight_layout()
    figure.savefig("walls_report_settings.png", dpi=100)
    print("drawn: walls_report_settings.png")


if __name__ == "__main__":
    main()
