#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""The loop of controller.cpp in Python: drives to the robot file's waypoints at 15 Hz by the wall clock.

    controller.py ROBOT FRAMES

Prints the processor time of the whole process and of its programs, in seconds per second, and whether the images of each frame
were at one address.
"""

import math
import resource
import sys
import time

import twocone


def cpu_s():
    return sum(r.ru_utime + r.ru_stime for r in map(resource.getrusage, (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)))


frames = int(sys.argv[2])
with twocone.open_robot(sys.argv[1]) as robot:
    localiser = twocone.Localiser(robot.description)
    goals = robot.description.waypoints
    goal = 0
    same = 0
    for i in range(frames):
        frame = robot.next_frame(timeout_s=60)
        report = localiser.update(frame)
        same += frame.lower().ctypes.data == frame.lower().ctypes.data and not frame.lower().flags.owndata
        if i == 14:  # the renderer has started
            begin_cpu_s = cpu_s()
            begin = due = time.monotonic()
        pose = report.track or report.odometry
        dx_m, dy_m = goals[goal].x_m - pose.x_m, goals[goal].y_m - pose.y_m
        if math.hypot(dx_m, dy_m) < 0.1:
            goal = (goal + 1) % len(goals)
        ahead_rad = math.remainder(math.atan2(dy_m, dx_m) - pose.heading_rad, 2 * math.pi)
        turns = abs(ahead_rad) > 0.5
        robot.set_velocity(0.0 if turns else 0.3, math.copysign(1.0, ahead_rad) if turns else 1.5 * ahead_rad)
        if i >= 14:
            due += 0.066667
            time.sleep(max(0.0, due - time.monotonic()))
    wall_s = time.monotonic() - begin
    print(f"rate {(frames - 14) / wall_s:.2f} cpu {(cpu_s() - begin_cpu_s) / wall_s:.4f} same_address {same}")
