# SPDX-License-Identifier: Apache-2.0
"""A robot that sees in all directions with two cone mirrors, simulated or real."""

from twocone.errors import DeviceError, DeviceTimeout, Error, FileError
from twocone._native import (CapturedFrame, ConnectedRobot, FailureCode, FixVerdict, FrameReport, Landmark, LandmarkObservation,
                             Localiser, Pose, PoseAnswer, RangeAnswer, RangeVerdict, RobotDescription, Velocity, __version__,
                             locate, open_robot)
from twocone.runs import Run, localise, read_run, run, shipped
from twocone.tools import (Belief, Calibration, Comparison, Design, Parameter, Survey, Sweep, as_built, calibrate, compare, design,
                           scan, survey, tradeoff)
