#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""A robot as built: its mirrors are not where its file says. A drive among the landmarks finds where they are.

    python3 robot_as_built.py [--seed N] [--out FOLDER]
"""

import argparse
from pathlib import Path

import numpy as np

import twocone


def show(what, run):
    errors = 1000 * run.fixes["error_m"]
    found = np.isfinite(errors)
    print(f"{what}: fixes in {100 * found.mean():.0f} % of the frames, mean error {errors[found].mean():.1f} mm")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seed", type=int, default=2)
    parser.add_argument("--out", type=Path, default=Path("runs/robot_as_built"))
    options = parser.parse_args()

    believed = twocone.as_built(twocone.shipped("robots/lab_sim.yaml"), out=options.out, seed=options.seed, force=True)
    drive = twocone.run(believed, out=options.out / "drive", behaviour="waypoints", frames=300, force=True)
    show("as its file says it is", drive)

    calibration = twocone.calibrate(drive, out=options.out / "calibrated.yaml", distortion=True, force=True)
    print("found, in sigmas of what was believed:")
    moved = sorted(calibration.parameters.values(), key=lambda p: -abs(p.after - p.before) / p.prior_sigma)
    for p in moved[:5]:
        print(f"  {p.name:28} {p.before:10.4f} -> {p.after:10.4f} +- {p.sigma:.4f} ({(p.after - p.before) / p.prior_sigma:+.1f})")

    fresh = twocone.run(calibration.robot_file, out=options.out / "fresh", behaviour="wander", frames=150, seed=9, force=True)
    show("calibrated", fresh)


if __name__ == "__main__":
    main()
