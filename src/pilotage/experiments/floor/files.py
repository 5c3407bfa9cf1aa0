"""What a run on a floor keeps beside its trace: the world as it was, and the plans."""

from __future__ import annotations

import numpy as np

from pilotage.experiments.floor.recorder import RunRecord
from pilotage.records.plans import Plan, Plans
from pilotage.records.world import RobotOutline, World, landmarks_of


def world_of(record: RunRecord) -> World:
    """Walls, landmarks, what the robot was not told of, start and goal."""
    experiment = record.experiment
    mission, world = experiment.mission, experiment.world
    start, goal = mission.world.start, mission.world.goal
    robot = RobotOutline(
        radius_m=mission.robot.body.radius_m,
        start=(start.x_m, start.y_m, start.theta_rad),
        goals=() if goal is None else ((goal.x_m, goal.y_m, goal.theta_rad),),
    )
    return World(
        segments_m=world.known.segments_m,
        circles_m=world.known.circles_m,
        bounds_m=world.known.bounds_m,
        landmarks=landmarks_of(world.landmarks.ids, world.landmarks.points_xy_m),
        obstacle_segments_m=world.obstacle_segments_m,
        obstacle_circles_m=world.obstacle_circles_m,
        obstacle_polygons_m=tuple(experiment.obstacles.polygons_m),
        robots=(robot,),
    )


def plans_of(record: RunRecord) -> Plans:
    """Every plan adopted, the obstacle points mapped, the exact shortest path."""
    stack, shortest = record.experiment.stack, record.outcome.shortest
    return Plans(
        tuple(
            Plan(p.states, p.waypoints, p.tree_edges_m, p.t_s, p.length_m, p.planning_time_s)
            for p in stack.plans
        ),
        stack.mapped_circles_m[:, :2],
        np.zeros((0, 2)) if shortest is None else shortest.points_xy_m,
    )
