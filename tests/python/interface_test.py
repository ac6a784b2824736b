# SPDX-License-Identifier: Apache-2.0
"""The package has all public names of version 1.0, with their parameters and fields (docs/compatibility.md).

What is listed here is not changed when the package grows.
"""

import dataclasses
import inspect
import unittest

import twocone
from twocone import environment

FUNCTIONS = {
    "as_built": ["robot", "out", "seed", "unmodelled", "force"],
    "calibrate": ["runs", "out", "robot", "frames", "priors", "distortion", "figures", "force"],
    "compare": ["simulated", "real", "out", "scene", "poses"],
    "design": ["out", "name", "map", "force", "requirements"],
    "localise": ["folder", "method", "allow_missing"],
    "read_run": ["folder", "method"],
    "run": ["robot", "out", "behaviour", "frames", "method", "seed", "changes", "renderer", "landmarks", "real_time", "truth",
            "telemetry", "progress", "force"],
    "scan": ["run", "every", "clouds", "plan"],
    "shipped": ["name"],
    "survey": ["runs", "out", "robot", "calibrate_to", "distances", "distance_sigma_m", "refine", "frames", "force"],
    "tradeoff": ["robot", "out", "seed", "episodes", "fine"],
}
FIELDS = {
    "Belief": ["names", "values", "covariance"],
    "Calibration": ["robot_file", "parameters", "belief", "rms_before_px", "rms_after_px", "settled", "content"],
    "Comparison": ["folder", "within_limits", "differing", "rows", "gaps", "sources", "content"],
    "Design": ["robot_file", "distances_m", "least_sigma_m", "most_sigma_m", "content"],
    "Parameter": ["name", "before", "after", "sigma", "prior_sigma", "observed"],
    "Run": ["folder", "method", "robot_file", "map_file", "summary", "events", "frames", "drive", "ranges", "fixes", "sightings",
            "timing", "track", "truth", "odometry", "estimate"],
    "Survey": ["map_file", "names", "places_m", "sigmas_m", "belief", "left_out", "content"],
    "Sweep": ["folder", "settings", "content"],
}
COMPILED = {
    "CapturedFrame": ["number", "t_s", "lower", "upper"],
    "ConnectedRobot": ["description", "next_frame", "set_velocity", "true_pose", "contact", "close", "closed", "__enter__", "__exit__"],
    "FailureCode": ["NOT_FOUND", "UNAVAILABLE", "INVALID_STATE", "TIMEOUT", "DISCONNECTED", "BAD_DATA", "CANCELLED", "REFUSED"],
    "FixVerdict": ["OK", "GAP", "AMBIGUOUS", "TOO_FEW", "WEAK", "CONTRADICTORY", "OUT_OF_BOUNDS"],
    "FrameReport": ["ranges", "fix", "track", "covariance", "odometry"],
    "Landmark": ["name", "x_m", "y_m", "radius_m", "top_m"],
    "LandmarkObservation": ["x_m", "y_m", "range_m", "bearing_rad", "sigma_range_m", "sigma_bearing_rad"],
    "Localiser": ["update", "update_images"],
    "Pose": ["x_m", "y_m", "heading_rad"],
    "PoseAnswer": ["verdict", "pose", "covariance"],
    "RangeAnswer": ["landmark", "verdict", "range_m", "sigma_range_m", "bearing_rad", "sigma_bearing_rad"],
    "RangeVerdict": ["OK", "NOT_SEEN", "TRUNCATED", "NO_MATCH", "BEYOND_LIMIT", "SAME_COLOUR", "ONE_VIEW", "OCCLUDED", "SATURATED",
                     "TWO_CANDIDATES", "INCONSISTENT", "IMPOSSIBLE"],
    "RobotDescription": ["landmarks", "waypoints", "start"],
    "Velocity": ["forward_mps", "turn_radps"],
}
ENVIRONMENT = ["reset", "step", "render", "close", "REACHED_M", "metadata"]


class Interface(unittest.TestCase):
    def test_functions_have_their_parameters(self):
        for name, parameters in FUNCTIONS.items():
            known = inspect.signature(getattr(twocone, name)).parameters
            self.assertEqual([p for p in parameters if p not in known], [], name)
            required = [p.name for p in known.values()
                        if p.default is p.empty and p.kind not in (p.VAR_KEYWORD, p.VAR_POSITIONAL)]
            self.assertEqual([p for p in required if p not in parameters], [], f"{name} requires more")

    def test_results_have_their_fields(self):
        for name, fields in FIELDS.items():
            known = {field.name for field in dataclasses.fields(getattr(twocone, name))}
            self.assertEqual([f for f in fields if f not in known], [], name)

    def test_compiled_types_have_their_members(self):
        for name, members in COMPILED.items():
            self.assertEqual([m for m in members if not hasattr(getattr(twocone, name), m)], [], name)
        self.assertEqual([m for m in ENVIRONMENT if not hasattr(environment.DriveToGoals, m)], [])

    def test_errors_keep_their_kinds(self):
        self.assertTrue(issubclass(twocone.Error, RuntimeError))
        self.assertTrue(issubclass(twocone.FileError, twocone.Error))
        self.assertTrue(issubclass(twocone.DeviceError, twocone.Error))
        self.assertTrue(issubclass(twocone.DeviceTimeout, (twocone.DeviceError, TimeoutError)))

    def test_keywords_of_compiled_functions(self):
        seen = [twocone.LandmarkObservation(3, 0, range_m=3, bearing_rad=0, sigma_range_m=0.01, sigma_bearing_rad=0.01),
                twocone.LandmarkObservation(x_m=0, y_m=4, range_m=4, bearing_rad=1.5707963, sigma_range_m=0.01,
                                            sigma_bearing_rad=0.01)]
        answer = twocone.locate(observations=seen)
        self.assertEqual(answer.covariance.shape, (3, 3))
        self.assertAlmostEqual(answer.pose.x_m, 0, places=6)
        self.assertEqual(twocone.Pose(x_m=1, y_m=2, heading_rad=3).y_m, 2)
        self.assertEqual(twocone.Velocity(forward_mps=1, turn_radps=2).turn_radps, 2)


if __name__ == "__main__":
    unittest.main()
