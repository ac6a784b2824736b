#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""The paper's experiment: a robot wanders for 30 s at 15 frames per second, and its position is found in each frame.

    python3 paper_experiment.py [--frames N] [--out FOLDER]

Both methods answer the same images: that of the paper, and the least-squares fit to outlines.
"""

import argparse
from pathlib import Path

import numpy as np

import twocone


def errors_mm(fixes):
    """Returns the errors of a table's fixes, and their number of frames without one."""
    errors = 1000 * fixes["error_m"]
    return errors[np.isfinite(errors)], int(np.sum(~np.isfinite(errors)))


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--frames", type=int, default=450)
    parser.add_argument("--out", type=Path, default=Path("runs/paper_experiment"))
    options = parser.parse_args()

    run = twocone.run(twocone.shipped("robots/lab_sim.yaml"), out=options.out, behaviour="wander", frames=options.frames,
                      method="paper", force=True)
    paper, without = errors_mm(run.fixes)
    print(f"method paper:   mean {paper.mean():6.2f} mm, 95 % below {np.quantile(paper, 0.95):6.2f} mm, {without} frames without")

    again = twocone.localise(options.out, method="outline")
    outline, without = errors_mm(again.fixes)
    print(f"method outline: mean {outline.mean():6.2f} mm, 95 % below {np.quantile(outline, 0.95):6.2f} mm, {without} frames without")
    print("the paper's own: mean 29.97 mm on its robot")


if __name__ == "__main__":
    main()
