"""The night-watch report's figures 15 to 19 beside ours: its wall filter in its four settings, on one drive.

The robot drives the report's route by the clock; every filter listens to the same readings, so that what
differs is the filter alone. Says how far each is off and how many lines it took; draws
``walls_report_settings.png``: the paths, the position's error, the heading's error with its own 2-sigma
band, and the share of the lines that were taken; and ``walls_report_errors.png``: the report's error matrix
of one moment, a row for each line that was seen and a column for each of the 32 walls. The first argument may
give another seed.
"""

import sys
from dataclasses import dataclass, field

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection

from pilotage.core.angles import wrap_array_to_pi
from pilotage.core.types import STOP, Command, FloatArray
from pilotage.experiments.build.build import Experiment, build
from pilotage.experiments.mission import load_mission

SETTINGS = {15: (0.0039, 0.01), 16: (0.1, 0.5), 17: (1.0, 1.0), 18: (2.0, 5.0)}
"""Threshold of the Mahalanobis distance and variance of a wall's distance, by the report's figure."""
TAKEN_OVER_S, NO_ERROR, ASTRAY_M = 2.0, 99.0, 1.0


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
        stack, journal = self.experiment.team[0].stack, self.experiment.team[0].journal
        telemetry = dict(zip(journal.units, journal.row, strict=True))
        self.poses.append(stack.belief.pose.as_array())
        self.heading_vars.append(float(stack.belief.cov[2, 2]))
        self.seen.append(telemetry["lines_seen"])
        self.taken.append(telemetry["lines_accepted"])


def listeners(seed: int) -> list[Listener]:
    """Ours first, then the report's four."""
    settings = {"ours: ekf-walls": ["stack.localizer.name=ekf-walls"]}
    for number, (threshold, variance) in SETTINGS.items():
        settings[f"report fig. {number}: {threshold:g} and {variance:g} m²"] = [
            f"stack.localizer.threshold_chi2={threshold}",
            f"stack.localizer.distance_var_m2={variance}",
        ]
    return [
        Listener(title, build(load_mission("museum-walls-report", overrides, seed)))
        for title, overrides in settings.items()
    ]


def drive(filters: list[Listener]) -> tuple[FloatArray, FloatArray]:
    """Drive the route, let all listen; returns times (N,) and true poses (N, 3)."""
    simulator, driver = filters[0].experiment.simulator, filters[0].experiment.team[0].stack
    times, truth = [], []
    command: Command = STOP
    while driver.status[0] == "running":
        (readings,) = simulator.step([command])
        command = driver.step(readings)
        for listener in filters[1:]:
            listener.experiment.team[0].stack.step(readings)
        for listener in filters:
            listener.note()
        times.append(readings.t_s)
        truth.append(simulator.bodies[0].pose.as_array())
    return np.array(times), np.array(truth)


def draw(columns: list[Axes], listener: Listener, t_s: FloatArray, truth: FloatArray) -> str:
    """One filter's four panels; returns its line of numbers."""
    poses = np.array(listener.poses)
    off = poses - truth
    distance = np.hypot(off[:, 0], off[:, 1])
    heading = wrap_array_to_pi(off[:, 2])
    path, position, turned, lines = columns
    walls = listener.experiment.chart.walls.segments_m.reshape(-1, 2, 2)
    path.add_collection(LineCollection(list(walls), colors="black", linewidths=0.8))
    path.plot(*truth[:, :2].T, color="#0072B2", linewidth=2.5, label="true")
    path.plot(*poses[:, :2].T, "--", color="#D55E00", linewidth=1.2, label="estimated")
    path.set(xlim=(-2, 30), ylim=(-2, 20), aspect="equal", title=listener.title)
    position.semilogy(t_s, np.maximum(distance, 1e-5), color="#D55E00")
    position.axhline(ASTRAY_M, color="grey", linewidth=0.6)
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
    astray = np.flatnonzero(distance > ASTRAY_M)
    tracked = f"{t_s[astray[0]]:.1f}" if astray.size else "to the end"
    rmse = np.sqrt(np.mean(distance[20:] ** 2))
    return f"{listener.title:32s} {tracked:>11s} {rmse:9.4f} {distance[20:].max():9.4f} {taken:8.0%}"


def draw_errors(axes: Axes, errors_m: FloatArray) -> None:
    """The error matrix as a picture; where no wall lies on the same side it stays grey."""
    shown = np.ma.masked_greater_equal(np.abs(errors_m), NO_ERROR)
    axes.set_facecolor("#d3d9df")
    picture = axes.imshow(shown, cmap="viridis_r", aspect="auto", vmin=0.0, vmax=20.0)
    for row, values in enumerate(shown):
        for column in np.flatnonzero(~np.ma.getmaskarray(values)).tolist():
            colour = "white" if values[column] > 8.0 else "black"
            axes.text(
                column, row, f"{values[column]:.2g}", ha="center", va="center", fontsize=6, color=colour
            )
    axes.set(xlabel="wall of the map", ylabel="line seen", title="error matrix of one moment [m]")
    axes.set_xticks(range(0, errors_m.shape[1], 2), [str(k + 1) for k in range(0, errors_m.shape[1], 2)])
    axes.figure.colorbar(picture, ax=axes, label="|seen - expected| [m]")


def main() -> None:
    """Drive, tell, draw."""
    filters = listeners(int(sys.argv[1]) if len(sys.argv) > 1 else 0)
    t_s, truth = drive(filters)
    figure, axes = plt.subplots(4, len(filters), figsize=(4 * len(filters), 12))
    print(
        f"{'threshold and variance':32s} {'tracked [s]':>11s} {'RMSE [m]':>9s} {'max [m]':>9s} {'taken':>8s}"
    )
    for listener, columns in zip(filters, axes.T, strict=True):
        print(draw(list(columns), listener, t_s, truth))
    axes[0, 0].legend(loc="upper left", fontsize=8)
    axes[2, 0].legend(loc="upper right", fontsize=8)
    figure.tight_layout()
    figure.savefig("walls_report_settings.png", dpi=100)
    errors_m = filters[1].experiment.team[0].journal.results()["error_matrix_m"]
    figure, alone = plt.subplots(figsize=(12, 4))
    draw_errors(alone, np.asarray(errors_m))
    figure.tight_layout()
    figure.savefig("walls_report_errors.png", dpi=100)
    print("drawn: walls_report_settings.png, walls_report_errors.png")


if __name__ == "__main__":
    main()
