#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Calls every function of the package with arguments that are wrong, most of them in type, sign, size or number.

    wrong_arguments.py TIMES SEED

A call must end with an exception of Python or of twocone, or with a value; an exception of twocone has a text of one line.
A crash of the interpreter ends this program. It prints how many calls ended in which way.
"""

import collections
import itertools
import math
import os
import random
import sys
import tempfile
import warnings
from pathlib import Path

import numpy as np

import twocone
from twocone import environment

ROOT = Path(__file__).resolve().parents[2]
SMALL = ROOT / "tests/end_to_end/data/small.yaml"


class Hostile:
    """An object whose methods raise, or return what they must not."""

    def __init__(self, random_):
        self._random = random_

    def __fspath__(self):
        return self._random.choice([5, None, "\0", b"\xff"])

    def __index__(self):
        return self._random.choice([2**70, -1, "text"])

    def __float__(self):
        raise RuntimeError("no number")

    def __iter__(self):
        return itertools.repeat(self, 3)

    def __len__(self):
        return -1

    def __bool__(self):
        raise RuntimeError("no truth")

    def __array__(self, *_, **__):
        raise RuntimeError("no array")


def wrong_values(random_, folder):
    """Returns a function that makes a wrong value: of the type of the right one, or of any."""
    numbers = [0, -1, 1, 2**31, -2**31 - 1, 2**63, 2**64, 2**70, math.nan, math.inf, -math.inf, 1e308, -1e-320, 0.5, True, 1j]
    texts = ["", "\0", "x" * 5000, "/dev/null", "/proc", "none.yaml", str(folder), str(folder / "robot.yaml"), "\ud800", "é"]

    def array():
        shape = tuple(random_.choice([0, 1, 3, 4, 120, 160]) for _ in range(random_.randrange(4)))
        kind = random_.choice([np.uint8, np.int8, np.float64, np.complex64, object, "U3", np.bool_, "M8[s]"])
        made = np.zeros(shape, kind)
        return random_.choice([lambda a: a, lambda a: a.T, lambda a: a[..., ::-1] if a.ndim else a, np.asfortranarray])(made)

    def image():
        shape = random_.choice([(120, 160, 3), (120, 160, 3), (120, 160, 4), (0, 0, 3), (160, 120, 3)])
        return np.asarray(np.broadcast_to(np.uint8(random_.randrange(256)), shape))

    def near(right):
        if isinstance(right, (bool, int, float)):
            return random_.choice(numbers)
        if isinstance(right, (str, Path)):
            return random_.choice([str, Path])(random_.choice(texts))
        if isinstance(right, np.ndarray):
            return random_.choice([array, image])()
        if isinstance(right, (list, tuple)) and len(right) > 0:
            return type(right)(near(item) for item in right) * random_.choice([0, 1, 2])
        if isinstance(right, dict):
            return {near("key"): near(value) for value in right.values()}
        return random_.choice(makers)()

    makers = [
        lambda: random_.choice(numbers), lambda: random_.choice(texts), lambda: None, lambda: b"bytes", lambda: object(),
        lambda: Hostile(random_), array, image, lambda: [], lambda: {}, lambda: (), lambda: [make() for _ in range(random_.randrange(4))],
        lambda: {random_.choice(["x", 5, None]): make()}, lambda: Path(random_.choice(texts)), lambda: int, lambda: (lambda *_: make()),
        lambda: twocone.Pose(), lambda: twocone.LandmarkObservation(random_.choice(numbers[8:14]), 1.0, range_m=2.0, bearing_rad=math.nan),
        lambda: folder, lambda: {"sigma_m": make()}, lambda: [("a", "b", make())], lambda: range(3)]

    def make(right=None):
        return near(right) if random_.randrange(4) else random_.choice(makers)()

    return make


def known_calls(robot, frame, closed, gym, folder):
    """Returns functions, each with arguments that are right but for what makes it end soon: a folder that is no run."""
    description = twocone.RobotDescription(SMALL)
    localiser = twocone.Localiser(description)
    image = frame.lower()
    out = folder / "robot.yaml" / "out.yaml"
    native = twocone._native
    drive = {"robot": SMALL, "out": out, "behaviour": "wander", "frames": 3, "method": "", "seed": 1, "renderer": "",
             "landmarks": True, "real_time": False, "truth": False, "telemetry": False, "progress": None}
    return [
        (twocone.run, drive | {"changes": {"effects.slip": 0.1}, "force": True}),
        (native.run, drive | {"changes": ["effects.slip=0.1"], "controller": None, "force": True}),
        (twocone.localise, {"folder": folder, "method": "outline", "allow_missing": True}),
        (native.localise, {"folder": folder, "method": "outline", "allow_missing": True}),
        (twocone.read_run, {"folder": folder, "method": ""}),
        (native.read_run, {"folder": folder, "method": ""}),
        (twocone.calibrate, {"runs": [folder], "out": out, "robot": SMALL, "frames": 9, "priors": {"tilt_rad": 0.01}}),
        (native.calibrate, {"runs": [folder], "out": out, "robot": SMALL, "frames": 9, "priors": {"tilt_rad": 0.01},
                            "distortion": True, "figures": "", "force": True}),
        (twocone.survey, {"runs": [folder], "out": out, "calibrate_to": out, "distances": [("a", "b", 1.0)],
                          "distance_sigma_m": 0.1, "refine": True, "frames": 9}),
        (native.survey, {"runs": [folder], "out": out, "robot": SMALL, "calibrated": out, "distances": [("a", "b", 1.0)],
                         "distance_sigma_m": 0.1, "refines": True, "frames": 9, "force": True}),
        (twocone.design, {"out": out, "name": "x", "map": folder, "sigma_m": 0.1, "width_px": 640}),
        (native.design, {"out": out, "name": "x", "map": folder, "requirements": {"sigma_m": 0.1, "width_px": 640}, "force": True}),
        (twocone.as_built, {"robot": folder / "robot.yaml", "out": out, "seed": 1, "unmodelled": True}),
        (native.as_built, {"robot": folder / "robot.yaml", "out": out, "seed": 1, "unmodelled": True, "force": True}),
        (twocone.scan, {"run": folder, "every": 1, "clouds": True, "plan": True}),
        (native.scan, {"run": folder, "every": 1, "clouds": True, "plan": True}),
        (twocone.tradeoff, {"robot": folder / "robot.yaml", "out": out, "seed": 1, "episodes": 3, "fine": True}),
        (native.tradeoff, {"robot": folder / "robot.yaml", "out": out, "seed": 1, "episodes": 3, "fine": True}),
        (twocone.compare, {"simulated": folder, "real": folder, "out": out, "scene": "", "poses": ""}),
        (native.compare, {"simulated": folder, "real": folder, "out": out, "scene": "", "poses": ""}),
        (twocone.shipped, {"name": "none"}),
        (twocone.open_robot, {"robot_file": folder / "robot.yaml", "seed": 1}),
        (twocone.RobotDescription, {"robot_file": folder / "robot.yaml"}),
        (twocone.Localiser, {"description": description}),
        (twocone.Pose, {"x_m": 1.0, "y_m": 2.0, "heading_rad": 3.0}),
        (twocone.Velocity, {"forward_mps": 1.0, "turn_radps": 2.0}),
        (twocone.LandmarkObservation, {"x_m": 1.0, "y_m": 2.0, "range_m": 1.0, "bearing_rad": None, "sigma_range_m": 0.1}),
        (twocone.locate, {"observations": [twocone.LandmarkObservation(1.0, 0.0, range_m=1.0, sigma_range_m=0.1)] * 3}),
        (localiser.update, {"frame": frame}),
        (localiser.update_images, {"lower": image, "upper": image, "t_s": 0.0, "wheels_rad": (0.0, 0.0)}),
        (robot.next_frame, {"timeout_s": 0.0}),
        (robot.set_velocity, {"forward_mps": 0.1, "turn_radps": 0.1}),
        (closed.next_frame, {"timeout_s": 0.0}),
        (closed.set_velocity, {"forward_mps": 0.1, "turn_radps": 0.1}),
        (closed.__exit__, {"type": None}),
        (frame.lower, {}), (frame.upper, {}), (robot.true_pose, {}),
        (twocone.CapturedFrame, {}), (twocone.ConnectedRobot, {}), (twocone.Run, {"folder": folder}),
        (twocone.FixVerdict, {"value": 1}), (twocone.FailureCode, {"value": 1}),
        (twocone.DeviceError, {"message": "text", "code": twocone.FailureCode.TIMEOUT}),
        (environment.DriveToGoals, {"robot_file": SMALL, "steps": 3, "forward_mps": 0.3}),
        (gym.step, {"action": [0.1, 0.2]}), (gym.observation_space.contains, {"value": [1.0]}),
    ]


def call(random_, make, function, right):
    """Calls a function with at least one argument that is wrong, missing or too many."""
    arguments = dict(right)
    for _ in range(random_.choice([1, 1, 1, 2, 3])):
        what = random_.randrange(12)
        if what == 0 or not arguments:
            arguments[random_.choice(["unknown", "", "seed"])] = make()
        elif what == 1:
            del arguments[random_.choice(list(arguments))]
        else:
            name = random_.choice(list(arguments))
            arguments[name] = make(arguments[name])
    if random_.randrange(4) == 0:
        return function(*arguments.values())
    return function(**arguments)


def main():
    times, seed = int(sys.argv[1]), int(sys.argv[2])
    random_ = random.Random(seed)
    warnings.simplefilter("ignore")  # NumPy's, of comparisons with what is no number
    with tempfile.TemporaryDirectory() as work:
        folder = Path(work) / "folder"
        folder.mkdir()
        (folder / "robot.yaml").write_text("name: [wrong\n")
        make = wrong_values(random_, folder)
        os.chdir(work)  # some calls make folders
        closed = twocone.open_robot(SMALL)
        closed.close()
        ended = collections.Counter()
        with twocone.open_robot(SMALL) as robot:
            calls = known_calls(robot, robot.next_frame(timeout_s=60), closed, environment.DriveToGoals(SMALL), folder)
            for _ in range(times):
                function, right = random_.choice(calls)
                try:
                    call(random_, make, function, right)
                    ended["a value"] += 1
                except SystemError as error:  # the interpreter found an error of the compiled part
                    raise AssertionError(f"{function}") from error
                except Exception as error:
                    if isinstance(error, twocone.Error) and "\n" in str(error):
                        raise AssertionError(f"{function}: a text of several lines") from error
                    ended[type(error).__name__] += 1
            robot.next_frame(timeout_s=60)  # it still works
        print(", ".join(f"{kind} {count}" for kind, count in ended.most_common()))


if __name__ == "__main__":
    main()
