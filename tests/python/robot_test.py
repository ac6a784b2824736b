# SPDX-License-Identifier: Apache-2.0
"""The public interface from Python: robots, frames, localisers."""

import atexit
import gc
import os
import pickle
import signal
import subprocess
import sys
import tempfile
import threading
import time
import unittest
from pathlib import Path

import numpy as np

import twocone

ROOT = Path(__file__).resolve().parents[2]
LAB = ROOT / "robots" / "lab_sim.yaml"
# A robot without a scene, whose images are generated in memory: no renderer is needed.


def drive(robot, frames=3):
    localiser = twocone.Localiser(robot.description)
    reports = []
    for _ in range(frames):
        frame = robot.next_frame(timeout_s=60)
        reports.append(localiser.update(frame))
        robot.set_velocity(0.2, 0.1)
    return frame, reports


class Robot(unittest.TestCase):
    def test_a_drive_has_images_ranges_fixes_and_a_track(self):
        with twocone.open_robot(LAB) as robot:
            frame, reports = drive(robot)
            truth = robot.true_pose()
        self.assertEqual(frame.number, 2)
        self.assertEqual(frame.lower().shape, (480, 640, 3))
        self.assertEqual(frame.lower().dtype, np.uint8)
        self.assertEqual([r.landmark for r in reports[-1].ranges], [l.name for l in robot.description.landmarks])
        self.assertEqual(reports[-1].fix.verdict, twocone.FixVerdict.OK)
        self.assertEqual(reports[-1].covariance.shape, (3, 3))
        self.assertLess(abs(reports[-1].track.x_m - truth.x_m), 0.01)

    def test_frames_are_views_of_the_programs_memory(self):
        with twocone.open_robot(LAB) as robot:
            frame = robot.next_frame(timeout_s=60)
            first, second = frame.lower(), frame.lower()
        self.assertEqual(first.__array_interface__["data"][0], second.__array_interface__["data"][0])
        self.assertFalse(first.flags.writeable)
        with self.assertRaises(ValueError):
            first[0, 0, 0] = 1
        expected = first.copy()
        del frame, second, robot
        gc.collect()
        np.testing.assert_array_equal(first, expected)  # the array keeps the frame alive

    def test_images_of_ones_own_give_the_same_answer(self):
        with twocone.open_robot(LAB) as robot:
            frame = robot.next_frame(timeout_s=60)
            report = twocone.Localiser(robot.description).update(frame)
            own = twocone.Localiser(robot.description).update_images(frame.lower(), frame.upper().copy(), t_s=0)
        self.assertEqual(own.fix.pose.x_m, report.fix.pose.x_m)
        np.testing.assert_array_equal(own.fix.covariance, report.fix.covariance)

    def test_wrong_images_are_named(self):
        localiser = twocone.Localiser(twocone.RobotDescription(LAB))
        image = np.zeros((480, 640, 3), np.uint8)
        with self.assertRaisesRegex(ValueError, r"upper is an array of float64 and shape \(480, 640, 3\), must be uint8"):
            localiser.update_images(image, image.astype(float), t_s=0)
        with self.assertRaisesRegex(twocone.DeviceError, "640"):
            localiser.update_images(image[:100], image, t_s=0)
        for number in (float("nan"), float("inf")):
            with self.assertRaisesRegex(twocone.DeviceError, "must be finite"):
                localiser.update_images(image, image, t_s=number)
        localiser.update_images(image, image, t_s=1)  # what was refused has left no trace
        with self.assertRaisesRegex(twocone.DeviceError, "must be later than 1 s"):
            localiser.update_images(image, image, t_s=1)
        with self.assertRaisesRegex(twocone.DeviceError, "must have wheel angles, or none"):
            localiser.update_images(image, image, t_s=2, wheels_rad=(0, 0))

    def test_errors_have_the_programs_texts(self):
        with self.assertRaisesRegex(twocone.FileError, "no_such.yaml"):
            twocone.open_robot("no_such.yaml")
        error = twocone.DeviceError("text", twocone.FailureCode.TIMEOUT)
        self.assertEqual(pickle.loads(pickle.dumps(error)).code, twocone.FailureCode.TIMEOUT)

    def test_a_closed_robot_says_so(self):
        robot = twocone.open_robot(LAB)
        frame = robot.next_frame(timeout_s=60)
        robot.close()
        robot.close()
        self.assertTrue(robot.closed)
        with self.assertRaisesRegex(twocone.DeviceError, "closed") as raised:
            robot.next_frame()
        self.assertEqual(raised.exception.code, twocone.FailureCode.INVALID_STATE)
        try:
            self.assertEqual(frame.lower().shape, (480, 640, 3))
        except twocone.DeviceError as error:  # its pixels had not arrived
            self.assertIn(error.code, (twocone.FailureCode.CANCELLED, twocone.FailureCode.DISCONNECTED))

    def test_robots_close_in_any_order_and_from_other_threads(self):
        robots = [twocone.open_robot(LAB, seed=seed) for seed in range(3)]
        frames = [robot.next_frame(timeout_s=60) for robot in robots]
        threads = [threading.Thread(target=robot.close) for robot in (robots[1], robots[2], robots[0])]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join(30)
            self.assertFalse(thread.is_alive())
        del robots
        gc.collect()
        for frame in frames:
            try:
                self.assertEqual(frame.upper().shape, (480, 640, 3))
            except twocone.DeviceError as error:  # its pixels had not arrived
                self.assertIn(error.code, (twocone.FailureCode.CANCELLED, twocone.FailureCode.DISCONNECTED))

    def test_waiting_releases_the_interpreters_lock(self):
        with twocone.open_robot(LAB) as robot:
            frame = robot.next_frame(timeout_s=60)
            counted = 0

            def count():
                nonlocal counted
                while not done.is_set():
                    counted += 1
                    time.sleep(0.001)

            done = threading.Event()
            counter = threading.Thread(target=count)
            counter.start()
            for _ in range(5):
                frame = robot.next_frame(timeout_s=60)
                frame.lower()
            done.set()
            counter.join()
        self.assertGreater(counted, 5)

    def test_a_fork_neither_uses_nor_ends_its_parents_robot(self):
        with twocone.open_robot(LAB) as robot:
            frame = robot.next_frame(timeout_s=60)
            child = os.fork()
            if child == 0:
                status = 1
                try:
                    robot.next_frame()
                except twocone.DeviceError as error:
                    status = 0 if "another process" in str(error) else 2
                del frame, robot
                gc.collect()
                os._exit(status)
            self.assertEqual(os.waitpid(child, 0)[1], 0)
            self.assertEqual(robot.next_frame(timeout_s=60).number, 1)

    def test_a_fork_that_has_dropped_the_robot_ends_well(self):
        robot = twocone.open_robot(LAB)
        child = os.fork()
        if child == 0:
            del robot
            gc.collect()
            atexit._run_exitfuncs()  # what the interpreter does at its end
            os._exit(0)
        self.assertEqual(os.waitpid(child, 0)[1], 0)
        self.assertEqual(robot.next_frame(timeout_s=60).number, 0)
        robot.close()


class Interrupt(unittest.TestCase):
    def test_ctrl_c_ends_a_wait_and_the_interpreter_goes_on(self):
        program = f"""
import signal, twocone
signal.signal(signal.SIGINT, signal.default_int_handler)  # also where this test runs in the background
robot = twocone.open_robot({str(LAB)!r})
print("ready", flush=True)
try:
    while True:
        robot.next_frame(timeout_s=60).lower()
except KeyboardInterrupt:
    print("interrupted", flush=True)
robot.close()
"""
        child = subprocess.Popen([sys.executable, "-c", program], stdout=subprocess.PIPE, text=True)
        self.assertEqual(child.stdout.readline(), "ready\n")
        time.sleep(0.5)
        child.send_signal(signal.SIGINT)
        rest, _ = child.communicate(timeout=30)
        self.assertEqual(rest, "interrupted\n")
        self.assertEqual(child.returncode, 0)


if __name__ == "__main__":
    unittest.main()
