#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""move_landmarks.py ROBOT.yaml MAP.yaml STEM SEED: writes STEM.yaml and STEM.map.yaml, the robot on a map that has one
or two landmarks (an even or odd seed) 50 mm from where they are, and prints their names. A recording on the first map
is then one of a room in which these were moved."""
import math
import os
import random
import re
import sys

robot, map_file, stem, seed = sys.argv[1], sys.argv[2], sys.argv[3], int(sys.argv[4])
random.seed(seed)
lines = open(map_file).read().split("\n")
landmarks = [i for i, line in enumerate(lines) if re.search(r"name: \S+, colour", line)]
names = []
for i in random.sample(landmarks, 1 + seed % 2):
    angle = random.uniform(0, 2 * math.pi)
    found = re.search(r"x_m: (\S+), y_m: (\S+),", lines[i])
    x, y = float(found[1]) + 0.05 * math.cos(angle), float(found[2]) + 0.05 * math.sin(angle)
    lines[i] = lines[i].replace(found[0], f"x_m: {x!r}, y_m: {y!r},")
    names.append(re.search(r"name: (\S+),", lines[i])[1])


def absolute(text, key, folder):
    return re.sub(rf"\b{key}: (?!/)", f"{key}: {os.path.dirname(os.path.abspath(folder))}/", text)


text = absolute("\n".join(lines), "scene", map_file)
open(stem + ".map.yaml", "w").write(re.sub(r"^survey:.*\n", "", text, flags=re.M))
text = re.sub(r"^map: .*$", f"map: {os.path.basename(stem)}.map.yaml", open(robot).read(), flags=re.M)
open(stem + ".yaml", "w").write(absolute(text, "calibration", robot))
print(" ".join(sorted(names)))
