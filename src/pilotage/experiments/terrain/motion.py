"""The rover's true way: driven to a pose by a control law, or along the curve of a planned path."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from pilotage.core.angles import wrap_to_pi
from pilotage.core.errors import InputError
from pilotage.core.types import FloatArray, Pose2
from pilotage.experiments.terrain.ground import Ground
from pilotage.experiments.terrain.oracles import shortest_curve
from pilotage.experiments.terrain.route import Route
from pilotage.missions.terrain import SplineConfig, TerrainMission
from pilotage.sim.rover_drive import drive
from pilotage.stack.control.polar_pose import POSE_CONTROLLERS, PolarPoseController
from pilotage.stack.planning.clear_spline import clear_spline, path_knots
from pilotage.stack.planning.quintic_spline import QuinticSpline


@dataclass(frozen=True, slots=True, eq=False)
class Motion:
    """A true way with times.

    Attributes
    ----------
    t_s
        (N,) times of the samples.
    poses
        (N, 3) x, y, theta; theta is not wrapped.
    v_m_s, w_rad_s, steering_rad
        (N,) what is commanded there.
    done, reason
        Whether the way leads to the goal, and what there is to say.
    """

    t_s: FloatArray
    poses: FloatArray
    v_m_s: FloatArray
    w_rad_s: FloatArray
    steering_rad: FloatArray
    done: bool
    reason: str


def drive_to_pose(mission: TerrainMission, ground: Ground) -> Motion:
    """Drive from start to goal by the mission's pose controller, sampled every ``run.dt_s``.

    Raises
    ------
    InputError
        Where the goal has no heading, or start or goal is on a hazard or outside.
    """
    goal, start = mission.world.goal, mission.world.start
    if goal.theta_rad is None:
        raise InputError("world.goal.theta_rad: expected a heading, for the drive is to a pose, found none")
    for name, place in (("start", start), ("goal", goal)):
        _check_free(f"world.{name}", place.x_m, place.y_m, ground)
    if "pose_controller" in mission.run.oracles:
        return _shortest(mission, ground)
    controller = pose_controller(mission)
    driven = drive(
        lambda x, y, theta: controller.command(x, y, theta),
        controller.distance_m,
        Pose2(start.x_m, start.y_m, start.theta_rad),
        mission.run.dt_s,
        goal.tolerance_m,
        mission.run.time_limit_s,
    )
    twists = [controller.command(x, y, theta) for x, y, theta in driven.poses.tolist()]
    steering = np.array([controller.steering_rad(twist) for twist in twists])
    reason = (
        f"within {goal.tolerance_m:g} m of the goal"
        if driven.arrived
        else f"time limit of {mission.run.time_limit_s:g} s reached"
    )
    v = np.array([twist.v_m_s for twist in twists])
    w = np.array([twist.w_rad_s for twist in twists])
    return Motion(driven.t_s, driven.poses, v, w, steering, driven.arrived, reason)


def _shortest(mission: TerrainMission, ground: Ground) -> Motion:
    """The shortest way to the goal pose at full speed, sampled about every ``run.dt_s``."""
    start, goal, speed = mission.world.start, mission.world.goal, mission.robot.speed_m_s
    assert goal.theta_rad is not None
    ends = Pose2(start.x_m, start.y_m, start.theta_rad), Pose2(goal.x_m, goal.y_m, goal.theta_rad)
    spline, reason = shortest_curve(*ends, ground)
    if spline is None:
        return _nowhere(mission, f"no clear way: {reason}")
    count = max(2, math.ceil(spline.length_m / (speed * mission.run.dt_s)) + 1)
    motion = _along(spline, count, mission, reason)
    in_time = int(np.searchsorted(motion.t_s, mission.run.time_limit_s, side="right"))
    if in_time == count:
        return motion
    t_s, poses, v, w, steering = (
        column[:in_time]
        for column in (motion.t_s, motion.poses, motion.v_m_s, motion.w_rad_s, motion.steering_rad)
    )
    return Motion(t_s, poses, v, w, steering, False, f"time limit of {mission.run.time_limit_s:g} s reached")


def pose_controller(mission: TerrainMission) -> PolarPoseController:
    """The mission's pose controller; the rover's speed and wheelbase hold unless it names its own."""
    choice, goal = mission.stack.pose_controller, mission.world.goal
    assert choice is not None
    assert goal.theta_rad is not None
    own = {"max_speed_m_s": mission.robot.speed_m_s, "wheelbase_m": mission.robot.wheelbase_m}
    config = POSE_CONTROLLERS.configure(choice.name, own | choice.parameters, "stack.pose_controller")
    theta = wrap_to_pi(goal.theta_rad)
    return POSE_CONTROLLERS.entry(choice.name).factory(config, Pose2(goal.x_m, goal.y_m, theta))


def along_route(mission: TerrainMission, config: SplineConfig, route: Route, ground: Ground) -> Motion:
    """Follow the curve of a planned path at the rover's speed (equations 5.1 to 5.6).

    Without a path, or a curve that keeps clear, the rover stays where it is.
    """
    if route.result.path is None:
        return _nowhere(mission, f"{route.result.status}: {route.result.reason}")
    cells = route.result.path.cells
    if len(cells) < 2:
        return _nowhere(mission, "start and goal are in the same cell: there is no curve")
    if config.clear:
        clear = clear_spline(path_knots(ground.hazards, cells), ground.hazards, ground.hazards.blocked())
        if clear.spline is None:
            return _nowhere(mission, f"no clear curve: {clear.reason}")
        spline, reason = clear.spline, f"clear curve with {clear.knots} knots"
    else:
        spline, reason = QuinticSpline(ground.hazards.points_m(cells)), "curve through all cells, not checked"
    return _along(spline, config.samples, mission, reason)


def _along(spline: QuinticSpline, samples: int, mission: TerrainMission, reason: str) -> Motion:
    """Follow a curve at the rover's speed (equations 5.1 to 5.6)."""
    speed = mission.robot.speed_m_s
    curve = spline.sampled(samples)
    poses = np.column_stack([curve.points_xy_m, curve.heading_rad])
    turn_rate = speed * curve.curvature_per_m
    steering = np.arctan(mission.robot.wheelbase_m * curve.curvature_per_m)
    t_s = curve.times_s(speed)
    return Motion(t_s, poses, np.full(len(t_s), speed), turn_rate, steering, True, reason)


def _nowhere(mission: TerrainMission, reason: str) -> Motion:
    start = mission.world.start
    zero = np.zeros(1)
    pose = np.array([[start.x_m, start.y_m, start.theta_rad]])
    return Motion(zero, pose, zero, zero, zero, False, reason)


def _check_free(where: str, x_m: float, y_m: float, ground: Ground) -> None:
    grid = ground.hazards
    (row, column), *_ = grid.cells_at(np.array([[x_m, y_m]])).tolist()
    if not (0 <= row < grid.rows and 0 <= column < grid.columns):
        width, height = grid.size_m
        raise InputError(
            f"{where}: expected a place on the ground ({width:g} x {height:g} m from "
            f"({grid.origin.x_m:g}, {grid.origin.y_m:g})), found ({x_m:g}, {y_m:g})"
        )
    if grid.blocked()[row, column]:
        raise InputError(f"{where}: expected free ground, found a hazard at ({x_m:g}, {y_m:g})")


def hazard_contacts(motion: Motion, ground: Ground) -> int:
    """How many samples lie on a hazard or off the ground."""
    grid = ground.hazards
    cells = grid.cells_at(motion.poses[:, :2])
    inside = (cells >= 0).all(axis=1) & (cells[:, 0] < grid.rows) & (cells[:, 1] < grid.columns)
    blocked = grid.blocked()
    on_hazard = blocked[cells[inside, 0], cells[inside, 1]]
    return int(np.count_nonzero(~inside) + np.count_nonzero(on_hazard))


def way_m(motion: Motion) -> FloatArray:
    """(N,) way up to each sample."""
    steps = np.hypot(*np.diff(motion.poses[:, :2], axis=0).T)
    return np.concatenate([[0.0], np.cumsum(steps)])


def goal_errors(mission: TerrainMission, motion: Motion) -> dict[str, object]:
    """How far the last sample is from the goal."""
    goal, (x, y, theta) = mission.world.goal, motion.poses[-1].tolist()
    errors: dict[str, object] = {"goal_error_m": math.hypot(x - goal.x_m, y - goal.y_m)}
    if goal.theta_rad is not None:
        errors["goal_error_rad"] = abs(wrap_to_pi(theta - goal.theta_rad))
    return errors
