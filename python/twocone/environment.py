# SPDX-License-Identifier: Apache-2.0
"""A simulated or real robot as an environment for learning, in the shape of Gymnasium's interface, without needing it."""

import math
from dataclasses import dataclass

import numpy as np

import twocone


@dataclass(frozen=True)
class Box:
    """Arrays of one shape within bounds, as gymnasium.spaces.Box."""

    low: np.ndarray
    high: np.ndarray

    @property
    def shape(self):
        return self.low.shape

    @property
    def dtype(self):
        return self.low.dtype

    def contains(self, value) -> bool:
        """Returns whether an array is one of this space."""
        value = np.asarray(value)
        return value.shape == self.shape and bool(np.all(value >= self.low) and np.all(value <= self.high))

    def sample(self, generator: np.random.Generator | None = None) -> np.ndarray:
        """Returns uniformly distributed numbers of this space; from -1 to 1 where it has no bounds."""
        generator = generator or np.random.default_rng()
        low, high = np.where(np.isfinite(self.low), self.low, -1), np.where(np.isfinite(self.high), self.high, 1)
        return generator.uniform(low, high).astype(self.dtype)


class DriveToGoals:
    """Drives from goal to goal by what the robot measures: an action is a velocity, an observation its own estimate.

    The observation is an array of float32: distance and bearing of the goal by the track; the standard deviations of the
    track's x, y and heading; and of each landmark of the map, in its order, the range and the bearing. What is not known
    is 0. The action is an array of the shares of the greatest forward speed and turn rate, from -1 to 1.

    The reward of a step is the way by which the goal came nearer, in metres, by the truth where there is one; a contact
    ends the episode with a reward of -1. A goal is reached at 0.1 m; the next one follows.

    :param robot_file: a robot file with ``waypoints_m``, which are the goals
    :param steps: number of frames of an episode, after which it is truncated
    """

    REACHED_M = 0.1
    metadata: dict = {"render_modes": ["rgb_array"]}

    def __init__(self, robot_file, *, steps: int = 450, forward_mps: float = 0.3, turn_radps: float = 1.5):
        self.robot_file = robot_file
        self.steps = steps
        self._limits = np.array([forward_mps, turn_radps])
        description = twocone.RobotDescription(robot_file)
        self._goals = [(p.x_m, p.y_m) for p in description.waypoints]
        if not self._goals:
            raise ValueError(f"{robot_file}: an environment needs goals: the key waypoints_m: [[x, y], ...] in metres")
        size = 5 + 2 * len(description.landmarks)
        self.observation_space = Box(np.full(size, -np.inf, np.float32), np.full(size, np.inf, np.float32))
        self.action_space = Box(-np.ones(2, np.float32), np.ones(2, np.float32))
        self._robot: twocone.ConnectedRobot | None = None

    def reset(self, *, seed: int | None = None, options: dict | None = None):
        """Begins an episode at the robot file's start. Returns the first observation and ``info``."""
        self.close()
        if seed is None:
            seed = int(np.random.default_rng().integers(2**63))
        self._robot = twocone.open_robot(self.robot_file, seed=seed)
        self._localiser = twocone.Localiser(self._robot.description)
        self._count = 0
        self._goal = 0
        self._look()
        self._left_m = self._distance_m()
        return self._observation(), self._info()

    def step(self, action):
        """Drives for a frame. Returns observation, reward, terminated, truncated and ``info``."""
        if self._robot is None:
            raise RuntimeError("an episode begins with reset()")
        forward, turn = np.clip(np.asarray(action, float), -1, 1) * self._limits
        self._robot.set_velocity(forward, turn)
        self._count += 1
        self._look()
        left_m = self._distance_m()
        reward = self._left_m - left_m
        if left_m < self.REACHED_M:
            self._goal = (self._goal + 1) % len(self._goals)
            left_m = self._distance_m()
        self._left_m = left_m
        terminated = bool(self._robot.contact)
        return self._observation(), -1.0 if terminated else reward, terminated, self._count >= self.steps, self._info()

    def render(self) -> np.ndarray:
        """Returns the newest images, the lower beside the upper."""
        return np.hstack([self._frame.lower(), self._frame.upper()])

    def close(self):
        """Closes the robot."""
        if self._robot is not None:
            self._robot.close()
            self._robot = None

    def _look(self):
        self._frame = self._robot.next_frame()
        self._report = self._localiser.update(self._frame)

    def _pose(self):
        return self._report.track or self._report.odometry

    def _distance_m(self):
        pose = self._robot.true_pose() or self._pose()
        x_m, y_m = self._goals[self._goal]
        return math.hypot(x_m - pose.x_m, y_m - pose.y_m)

    def _observation(self):
        pose = self._pose()
        x_m, y_m = self._goals[self._goal]
        ahead_rad = math.atan2(y_m - pose.y_m, x_m - pose.x_m) - pose.heading_rad
        covariance = self._report.covariance
        sigmas = np.zeros(3) if covariance is None else np.sqrt(np.diag(covariance))
        values = [math.hypot(x_m - pose.x_m, y_m - pose.y_m), math.remainder(ahead_rad, 2 * math.pi), *sigmas]
        for r in self._report.ranges:
            values += [r.range_m or 0.0, r.bearing_rad or 0.0]
        return np.array(values, np.float32)

    def _info(self):
        return {"report": self._report, "goal": self._goals[self._goal], "contact": self._robot.contact}
