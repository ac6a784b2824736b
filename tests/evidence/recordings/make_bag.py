#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Writes a run as a bag of ROS 1, by Debian's rosbag (python3-rosbag, python3-sensor-msgs, python3-nav-msgs, python3-rospy).

    make_bag.py RUN BAG      with PYTHONPATH of the twocone package
"""

import math
import sys

import rosbag
import rospy
from nav_msgs.msg import Odometry
from sensor_msgs.msg import CompressedImage

import twocone

BEGIN_S = 1_700_000_000  # of the recording's clock

run = twocone.read_run(sys.argv[1])
with rosbag.Bag(sys.argv[2], "w") as bag:
    for frame, t_s in enumerate(run.frames["t_s"]):
        stamp = rospy.Time.from_sec(BEGIN_S) + rospy.Duration.from_sec(float(t_s))
        for view, file in zip(("lower", "upper"), run.image_files(frame)):
            image = CompressedImage()
            image.header.stamp = stamp
            image.format = "png"
            image.data = file.read_bytes()
            bag.write(f"/camera/{view}/image_raw/compressed", image, stamp)
        odometry = Odometry()
        odometry.header.stamp = stamp
        _, x_m, y_m, heading_rad = run.odometry[frame]
        odometry.pose.pose.position.x, odometry.pose.pose.position.y = x_m, y_m
        odometry.pose.pose.orientation.z, odometry.pose.pose.orientation.w = math.sin(heading_rad / 2), math.cos(heading_rad / 2)
        bag.write("/odom", odometry, stamp)
