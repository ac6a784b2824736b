# SPDX-License-Identifier: Apache-2.0
"""Runs and tools from Python: what they return, and that they equal the command's."""

import os
import signal
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

import numpy as np

import twocone
from twocone.environment import DriveToGoals

ROOT = Path(__file__).resolve().parents[2]
SMALL = ROOT / "tests/end_to_end/data/small.yaml"


class Tools(unittest.TestCase):
    def setUp(self):
        self._folder = tempfile.TemporaryDirectory()
        self.addCleanup(self._folder.cleanup)
        self.folder = Path(self._folder.name)

    def drive(self, name="run", **options):
        return twocone.run(SMALL, out=self.folder / name, **{"frames": 5, "renderer": "native", **options})


class Runs(Tools):
    def test_a_run_is_arrays(self):
        seen = []
        run = self.drive(progress=seen.append, seed=3)
        self.assertEqual(run.truth.shape, (5, 4))
        self.assertEqual(len(run.fixes["error_m"]), 5)
        self.assertEqual(run.ranges["landmark"][0], "red")
        self.assertEqual(run.fixes["outliers"].dtype.kind, "U")  # also where all are empty
        self.assertEqual(run.summary["frames"], 5)
        self.assertEqual(seen[-1], 1)
        self.assertTrue(all(file.exists() for file in run.image_files(4)))
        again = twocone.read_run(run.folder)
        np.testing.assert_array_equal(again.fixes["x_m"], run.fixes["x_m"])

    def test_a_run_equals_that_of_the_command(self):
        run = self.drive(seed=4, changes={"effects.slip": 0.05})
        other = self.folder / "command"
        subprocess.run([os.environ["TWOCONE"], "run", "--robot", str(SMALL), "--frames", "5", "--seed", "4", "--out", str(other),
                        "--renderer", "native", "--set", "effects.slip=0.05"], check=True, capture_output=True)
        for file in ("drive.csv", "fixes.csv", "ranges.csv", "track.csv", "truth.tum", "odometry.tum", "estimate.tum"):
            mine, commands = (twocone.read_run(folder) for folder in (run.folder, other))
            self.assertEqual((run.folder / file).read_bytes(), (other / file).read_bytes(), file)
        np.testing.assert_array_equal(mine.sightings["column_px"], commands.sightings["column_px"])

    def test_localise_answers_the_same_images_by_another_method(self):
        run = self.drive()
        self.assertEqual(run.method, "outline")
        self.assertEqual(twocone.localise(run, method="paper").method, "paper")

    def test_a_controller_receives_poses_and_its_errors_arrive(self):
        poses = []

        def controller(pose, step_s):
            poses.append(pose)
            return twocone.Velocity(0.3, 0.0) if len(poses) % 2 else (0.3, 0.0)

        run = self.drive(behaviour=controller)
        self.assertEqual(len(poses), 5)
        self.assertGreater(run.truth[-1, 1], 0.05)  # it drove ahead

        def fails(pose, step_s):
            raise ZeroDivisionError("mine")

        with self.assertRaisesRegex(ZeroDivisionError, "mine"):
            self.drive("fails", behaviour=fails)
        with self.assertRaisesRegex(TypeError, "controller must return"):
            self.drive("wrong", behaviour=lambda pose, step_s: "fast")

    def test_wrong_settings_say_what_is_right(self):
        for options, text in (({"frames": 0}, "frames is 0, must be 1 to"), ({"behaviour": "fly"}, "must be one of wander"),
                              ({"method": "best"}, "no method 'best'"), ({"seed": -1}, "seed is -1, must be 0 to"),
                              ({"renderer": "gpu"}, "auto, native or povray"),
                              ({"landmarks": False, "method": "paper"}, "needs method outline"),
                              ({"landmarks": False, "changes": {"estimator.method": "paper"}}, "needs method outline")):
            with self.assertRaisesRegex(ValueError, text):
                self.drive("wrong", **options)
        self.drive()
        with self.assertRaisesRegex(twocone.FileError, "holds a run"):
            self.drive()
        with self.assertRaisesRegex(twocone.FileError, "none: no such folder"):
            twocone.read_run(self.folder / "none")

    def test_ctrl_c_ends_a_run_and_keeps_its_frames(self):
        program = f"""
import signal, twocone
signal.signal(signal.SIGINT, signal.default_int_handler)  # also where this test runs in the background
count = 0
def progress(done):
    global count
    count += 1
    if count == 10:
        print("driving", flush=True)
try:
    twocone.run({str(SMALL)!r}, out={str(self.folder / 'run')!r}, frames=100000, progress=progress)
except KeyboardInterrupt:
    print("interrupted", flush=True)
"""
        child = subprocess.Popen([sys.executable, "-c", program], stdout=subprocess.PIPE, text=True)
        self.assertEqual(child.stdout.readline(), "driving\n")
        child.send_signal(signal.SIGINT)
        rest, _ = child.communicate(timeout=60)
        self.assertTrue(rest.endswith("interrupted\n"), rest)
        self.assertEqual(child.returncode, 0)
        self.assertGreater(len(twocone.read_run(self.folder / "run").frames["frame"]), 0)


class OtherTools(Tools):
    def test_a_design_has_sigmas_by_distance_and_refuses_what_cannot_be(self):
        made = twocone.design(out=self.folder / "design", sigma_m=0.05, at_m=2.0)
        self.assertTrue(made.robot_file.exists())
        self.assertEqual(made.distances_m.shape, made.least_sigma_m.shape)
        self.assertTrue(np.nanmax(made.least_sigma_m) > 0)
        with self.assertRaisesRegex(twocone.Error, "and"):
            twocone.design(out=self.folder / "cannot", sigma_m=1e-4, at_m=8.0)
        with self.assertRaisesRegex(TypeError, "no requirement 'weight'"):
            twocone.design(out=self.folder / "other", weight=1.0)
        with self.assertRaisesRegex(ValueError, "width_px is 640.5, must be a whole number"):
            twocone.design(out=self.folder / "other", width_px=640.5)
        with self.assertRaisesRegex(ValueError, "name is '../other', must be letters"):
            twocone.design(out=self.folder / "other", name="../other")
        with self.assertRaisesRegex(twocone.FileError, "force=True"):
            twocone.design(out=self.folder / "design")

    def test_a_robot_as_built_differs_from_its_plan(self):
        believed = twocone.as_built(SMALL, out=self.folder / "built", seed=3)
        self.assertTrue(believed.exists())
        self.assertTrue((believed.parent / "built.yaml").exists())

    def test_wrong_arguments_of_tools_say_what_is_right(self):
        run = self.drive()
        out = self.folder / "out.yaml"
        with self.assertRaisesRegex(ValueError, "frames is 1, must be 4 to"):
            twocone.calibrate(run, out=out, frames=1)
        with self.assertRaisesRegex(ValueError, "runs is empty"):
            twocone.calibrate([], out=out)
        with self.assertRaisesRegex(ValueError, "need calibrate_to"):
            twocone.survey(run, out=out, distances=[("red", "blue", 2.0)])
        with self.assertRaisesRegex(ValueError, "takes a simulated run, or None"):
            twocone.compare(None, run, out=self.folder / "compared")
        with self.assertRaisesRegex(ValueError, "every is 0"):
            twocone.scan(run, every=0)
        with self.assertRaisesRegex(twocone.FileError, "nowhere"):
            twocone.tradeoff("nowhere.yaml", out=self.folder / "sweep")
        self.assertFalse(out.exists())


    def test_an_interrupted_calibration_writes_nothing(self):
        class Interrupted(Exception):
            pass

        def interrupt(number, frame):
            raise Interrupted

        run = self.drive(frames=40)
        before = signal.signal(signal.SIGALRM, interrupt)
        self.addCleanup(signal.signal, signal.SIGALRM, before)
        signal.setitimer(signal.ITIMER_REAL, 0.1)
        with self.assertRaises(Interrupted):
            twocone.calibrate(run, out=self.folder / "out.yaml", frames=40)
        self.assertFalse((self.folder / "out.yaml").exists())


class Environment(unittest.TestCase):
    def test_an_episode_is_repeatable_and_rewards_the_way_to_the_goal(self):
        rewards = []
        for _ in range(2):
            environment = DriveToGoals(SMALL, steps=5)
            self.addCleanup(environment.close)
            observation, _ = environment.reset(seed=5)
            self.assertTrue(environment.observation_space.contains(observation))
            steps = [environment.step([1.0, 0.0]) for _ in range(5)]
            rewards.append([step[1] for step in steps])
            self.assertTrue(steps[-1][3])  # truncated
            self.assertFalse(steps[0][3])
            self.assertEqual(environment.render().shape, (120, 320, 3))
        self.assertEqual(rewards[0], rewards[1])
        self.assertGreater(sum(rewards[0]), 0.01)  # its first goal is ahead
        with self.assertRaisesRegex(ValueError, "waypoints_m"):
            DriveToGoals(ROOT / "robots" / "furnished_sim.yaml")


if __name__ == "__main__":
    unittest.main()
