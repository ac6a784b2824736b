#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""A controller of one's own: drives round the room by the track, and shows what it knows.

    python3 own_controller.py [ROBOT] [--frames N]

The robot may be simulated or real: nothing here depends on it.
"""

import argparse
import math

import numpy as np

import twocone

REACHED_M = 0.1


def towards(pose, goal):
    """Returns the speeds that lead from a pose to a goal: a turn on the spot if it is far to the side."""
    ahead = math.remainder(math.atan2(goal.y_m - pose.y_m, goal.x_m - pose.x_m) - pose.heading_rad, 2 * math.pi)
    return (0.0, math.copysign(1.0, ahead)) if abs(ahead) > 0.5 else (0.3, 1.5 * ahead)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("robot", nargs="?", default=twocone.shipped("robots/lab_sim.yaml"))
    parser.add_argument("--frames", type=int, default=450)
    options = parser.parse_args()

    with twocone.open_robot(options.robot) as robot:
        localiser = twocone.Localiser(robot.description)
        goals = robot.description.waypoints
        if not goals:
            raise SystemExit(f"{options.robot} has no waypoints_m: name some places to drive to")
        reached = 0
        for _ in range(options.frames):
            frame = robot.next_frame(timeout_s=2)
            report = localiser.update(frame)
            pose = report.track or report.odometry
            goal = goals[reached % len(goals)]
            if math.hypot(goal.x_m - pose.x_m, goal.y_m - pose.y_m) < REACHED_M:
                reached += 1
            robot.set_velocity(*towards(pose, goal))
            if frame.number % 30 == 0:
                sigma = "" if report.covariance is None else f" +- {1000 * math.sqrt(np.trace(report.covariance[:2, :2])):.2f} mm"
                seen = sum(r.verdict == twocone.RangeVerdict.OK for r in report.ranges)
                print(f"{frame.t_s:6.2f} s  ({pose.x_m:6.3f}, {pose.y_m:6.3f}) m{sigma}, {seen} landmarks ranged, {reached} goals reached")


if __name__ == "__main__":
    main()
