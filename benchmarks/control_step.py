"""What a step of each local controller costs, and how many times faster than real time the whole loop is.

    python -m benchmarks.control_step [--controller NAME ...] [--courses 6] [--json]

On own courses with openings of 0.60 m (``bench controllers bottleneck-0.60``): a laser of 720 beams at 20 Hz,
noisy odometry. Processor time of one core, as the loop runs, nothing repeated: the median step, so that what
else a machine does counts little. ``mppi`` draws 1,000 rollouts of 2 s a step. Exit code 0 where its median
step takes at most 3 ms and the loop with ``gap-horizon`` is at least 50 times faster than real time.
"""

from __future__ import annotations

import argparse
import json
import sys
import time

import numpy as np

from pilotage.core.types import Twist
from pilotage.experiments.build.build import build
from pilotage.experiments.build.robots import footprint_of, motion_of
from pilotage.experiments.controller_benchmark import CourseRequest, course_run_mission
from pilotage.experiments.course_driving import course_base
from pilotage.experiments.course_families import Course, Driver, make_course_of
from pilotage.experiments.loop import run_loop
from pilotage.experiments.mission import mission_of
from pilotage.stack.control.local import drive
from pilotage.stack.control.local.role import LOCAL_CONTROLLERS, LocalController, LocalView

FAMILY = "bottleneck-0.60"
STEP_MS, REAL_TIME = 3.0, 50.0


class Timed:
    """A local controller that notes the processor time of each step."""

    def __init__(self, inner: LocalController, took_s: list[float]) -> None:
        self._inner, self._took_s = inner, took_s

    @property
    def status(self) -> str:
        """As the controller has it."""
        return self._inner.status

    def step(self, view: LocalView) -> Twist:
        """Step it."""
        began = time.process_time()
        command = self._inner.step(view)
        self._took_s.append(time.process_time() - began)
        return command


def courses(count: int) -> list[Course]:
    """Courses that the robot of ``barn-course`` has a way through."""
    robot = mission_of(course_base(), ()).robot
    footprint = footprint_of(robot, "robot")
    driver = Driver(footprint, drive.polygon_around(footprint), motion_of(robot, "robot"))
    made = (make_course_of(FAMILY, number, 0, driver) for number in range(count))
    return [course for course in made if course is not None]


def measured(controller: str, driven: list[Course]) -> dict[str, float]:
    """Median step (ms), and simulated seconds for each second of processor time; one run before compiles."""
    took_s: list[float] = []
    simulated_s, loop_s = 0.0, 0.0
    plain = drive.LocalDrive.__init__

    def timed(self: drive.LocalDrive, inner: LocalController, *args: object, **more: object) -> None:
        plain(self, Timed(inner, took_s), *args, **more)  # type: ignore[arg-type]

    request = CourseRequest((FAMILY,), (controller,))
    drive.LocalDrive.__init__ = timed  # type: ignore[assignment,method-assign]
    try:
        for number, course in enumerate([driven[0], *driven]):
            experiment = build(course_run_mission(request, course_base(), course, 0, controller))
            began = time.process_time()
            finished = run_loop(experiment).finished
            if number == 0:
                took_s.clear()
                continue
            loop_s += time.process_time() - began
            simulated_s += finished.duration_s
    finally:
        drive.LocalDrive.__init__ = plain  # type: ignore[method-assign]
    return {"step_ms": 1e3 * float(np.median(took_s)), "times_real_time": simulated_s / loop_s}


def main() -> int:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n", maxsplit=1)[0] if __doc__ else None)
    parser.add_argument("--controller", action="append")
    parser.add_argument("--courses", type=int, default=6)
    parser.add_argument("--json", action="store_true")
    asked = parser.parse_args()
    driven = courses(asked.courses)
    rows = {name: measured(name, driven) for name in asked.controller or LOCAL_CONTROLLERS.names()}
    if asked.json:
        print(json.dumps(rows))
    else:
        for name, row in rows.items():
            print(f"{name:20s} {row['step_ms']:6.2f} ms a step  {row['times_real_time']:6.1f} x real time")
    mppi, ours = rows.get("mppi"), rows.get("gap-horizon")
    fast = (mppi is None or mppi["step_ms"] <= STEP_MS) and (
        ours is None or ours["times_real_time"] >= REAL_TIME
    )
    return 0 if fast else 1


if __name__ == "__main__":
    sys.exit(main())
