#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Figures of rendered robots as built (first-day.sh), against the truth that `twocone as-built` wrote.

  first_day.py KIND FOLDER...   KIND: uncalibrated, calibrated, numbers or causes; FOLDER: one robot, with the files of
                                first-day.sh

Prints lines KEY VALUE. Position errors are given in the map's true frame, and after the rigid motion that brings the
landmarks of the calibrated map onto the true ones; `floor` is what that motion alone moves the robot's true places.
"""
import cmath
import csv
import json
import math
import os
import re
import statistics
import sys


def landmarks(file):
    rows = re.findall(r"name: (\w+),.*?x_m: *([-+.\de]+), *y_m: *([-+.\de]+)", open(file).read())
    return {name: complex(float(x), float(y)) for name, x, y in rows}


def rigid_motion(from_map, to_map):
    """Returns the motion p -> turn * p + shift of least squares."""
    names = [n for n in from_map if n in to_map]
    a, b = [from_map[n] for n in names], [to_map[n] for n in names]
    mean_a, mean_b = sum(a) / len(a), sum(b) / len(b)
    turn = sum((p - mean_a).conjugate() * (q - mean_b) for p, q in zip(a, b))
    turn /= abs(turn)
    return turn, mean_b - turn * mean_a


def frames(run):
    """Yields each frame of a run: its row of fixes.csv and the true place and heading. An ambiguous frame has several rows."""
    truth = [[float(v) for v in line.split()] for line in open(f"{run}/truth.tum") if not line.startswith("#")]
    rows = {int(row["frame"]): row for row in csv.DictReader(open(f"{run}/fixes.csv"))}
    for frame, pose in enumerate(truth):
        yield rows[frame], complex(pose[1], pose[2]), 2 * math.atan2(pose[6], pose[7])


def squared_sigmas(off, row):
    xx, xy, yy = (float(row[k]) for k in ("var_x_m2", "cov_xy_m2", "var_y_m2"))
    return (yy * off.real**2 - 2 * xy * off.real * off.imag + xx * off.imag**2) / (xx * yy - xy * xy)


class Figures:
    def __init__(self):
        self.frames = self.fixes = self.beyond_5 = self.beyond_10 = 0
        self.error, self.aligned, self.floor, self.heading, self.shares, self.silent = [], [], [], [], [], 0

    def add(self, runs, motion):
        held = fixes = 0
        for run in runs:
            for row, place, heading in frames(run):
                self.frames += 1
                if row["verdict"] != "ok":
                    continue
                fixes += 1
                fix = complex(float(row["x_m"]), float(row["y_m"]))
                distance2 = squared_sigmas(fix - place, row)
                held += distance2 < 5.991
                self.beyond_5 += distance2 > 25
                self.beyond_10 += distance2 > 100
                self.error.append(abs(fix - place))
                turn, shift = motion or (1, 0)
                if motion:
                    self.aligned.append(abs(turn * fix + shift - place))
                    self.floor.append(abs(turn * place + shift - place))
                if row["heading_rad"]:
                    turned = float(row["heading_rad"]) - heading + cmath.phase(turn)
                    self.heading.append(abs(math.degrees(math.remainder(turned, math.tau))))
        self.fixes += fixes
        if fixes:
            self.shares.append(held / fixes)
        else:
            self.silent += 1

    def show(self):
        mean_mm = lambda values: f"{1e3 * statistics.mean(values):.2f}" if values else "none"
        robots = len(self.shares)
        error = statistics.stdev(self.shares) / math.sqrt(robots) if robots > 1 else 0
        print("robots", robots + self.silent)
        print("silent", self.silent)
        print("frames", self.frames)
        print("fixes_percent", f"{100 * self.fixes / max(1, self.frames):.2f}")
        print("true_frame_mm", mean_mm(self.error))
        print("floor_mm", mean_mm(self.floor))
        print("aligned_mm", mean_mm(self.aligned))
        print("heading_deg", f"{statistics.mean(self.heading):.4f}" if self.heading else "none")
        print("held_percent", f"{100 * statistics.mean(self.shares):.1f}" if robots else "none")
        print("held_error_percent", f"{100 * error:.1f}")
        print("beyond_5", self.beyond_5)
        print("beyond_10", self.beyond_10)
        print("ok", self.fixes)


def true_numbers(file):
    """Returns the true values of a robot as built, by their names in calibration.json."""
    text = open(file).read()
    number = lambda key, part: float(re.search(rf"\b{key}: ([-+.\de]+)", part)[1])
    pair = lambda key, part: [float(v) for v in re.search(rf"^ *{key}: \[(.*?)\]", part, re.M)[1].split(", ")[:2]]
    rig = re.search(r"^rig:\n((?: .*\n)*)", text, re.M)[1]
    drive = re.search(r"^drive:.*\n((?: .*\n)*)", text, re.M)[0]
    views = re.split(r"^  (?:lower|upper):\n", rig, flags=re.M)
    views = {"lower": views[1], "upper": views[2]}
    true = {}
    for view, part in views.items():
        true[f"{view}.centre_px.column"], true[f"{view}.centre_px.row"] = pair("centre_px", part)
        true[f"{view}.tilt_rad.x"], true[f"{view}.tilt_rad.y"] = pair("tilt_rad", part)
        true[f"{view}.apex_rad"] = float(re.search(r"apex_rad: ([-+.\de]+)", part)[1])
        for key in ("rim_radius_px", "mirror_radius_m", "lens_to_tip_m"):
            true[f"{view}.{key}"] = number(key, part)
    lower, upper = (pair("axis_offset_m", views[v]) for v in ("lower", "upper"))
    true["upper.axis_offset_minus_lower_m.x"] = upper[0] - lower[0]
    true["upper.axis_offset_minus_lower_m.y"] = upper[1] - lower[1]
    true["upper.azimuth_minus_lower_rad"] = number("azimuth_rad", views["upper"]) - number("azimuth_rad", views["lower"])
    true["mirror_separation_m"], true["lens_height_m"] = number("mirror_separation_m", rig), number("lens_height_m", rig)
    true["wheel_separation_m"] = number("wheel_separation_m", drive)
    time = lambda key, view: number(key, views[view]) if key in views[view] else 0
    true["latency_s"] = -time("late_s", "lower")
    true["upper.skew_s"] = time("late_s", "upper") - time("late_s", "lower")
    for view in views:
        true[f"{view}.readout_s"] = time("readout_s", view)
    return true


def show_distances(distances):
    """Prints how many of these distances from the truth, (sigmas, name), are within 4 sigma, and the farthest."""
    far = sorted(distances, key=lambda d: -abs(d[0]))
    print("count", len(far))
    print("within", sum(abs(sigmas) <= 4 for sigmas, _ in far))
    print("farthest", ", ".join(f"{name} {sigmas:.1f}" for sigmas, name in far[:3]))


def with_truth(folders, file):
    """Yields name, true numbers and the parsed JSON file of each robot that has one."""
    for folder in folders:
        if os.path.exists(f"{folder}/{file}"):
            yield os.path.basename(folder), true_numbers(f"{folder}/built.yaml"), json.load(open(f"{folder}/{file}"))


def off(value, true, name):
    return math.remainder(value - true, math.tau) if name.endswith("minus_lower_rad") else value - true


def numbers(folders):
    """Compares what calibrate observed with the truth. Slip shortens the wheels' way, so their radius is left out."""
    distances = []
    for robot, true, calibration in with_truth(folders, "calibrated.calibration.json"):
        for p in calibration["parameters"]:
            if p["observed"] and p["name"] in true:
                sigmas = off(p["after"], true[p["name"]], p["name"]) / p["sigma"]
                distances.append((sigmas, f"{robot} {p['name']}"))
    show_distances(distances)


def causes(folders):
    """Compares the causes that compare names with the truth: the real robot's number of each."""
    to_si = {"deg": math.pi / 180, "mm": 1e-3, "ms": 1e-3}
    distances, named = [], 0
    # Neither robot has these: none loses a frame, and stamps say nothing of what is late.
    invented = []
    for robot, true, comparison in with_truth(folders, "compared/compare.json"):
        for source in comparison["sources"]:
            if source["verdict"] != "differs":
                continue
            named += 1
            if source["name"].endswith("frames lost") or source["name"] in ("frame rate", "stamped skew"):
                invented.append(f"{robot} {source['name']}")
            for c in source["components"]:
                if c["name"] in true:
                    unit = to_si.get(c["unit"], 1)
                    sigmas = off(c["real"] * unit, true[c["name"]], c["name"]) / (c["sigma"] * unit)
                    distances.append((sigmas, f"{robot} {c['name']}"))
    print("named", named)
    print("invented", ", ".join(invented) or "none")
    show_distances(distances)


def main():
    kind, folders = sys.argv[1], sys.argv[2:]
    if kind in ("numbers", "causes"):
        return {"numbers": numbers, "causes": causes}[kind](folders)
    figures = Figures()
    for folder in folders:
        runs, motion = [f"{folder}/drive"], None
        if kind == "calibrated":
            runs = [f"{folder}/fresh1", f"{folder}/fresh2"]
            if os.path.exists(f"{folder}/calibrated.map.yaml"):
                motion = rigid_motion(landmarks(f"{folder}/calibrated.map.yaml"), landmarks(f"{folder}/built.map.yaml"))
        runs = [run for run in runs if os.path.exists(f"{run}/fixes.csv")]
        if runs:
            figures.add(runs, motion)
        else:
            figures.silent += 1
    figures.show()


if __name__ == "__main__":
    main()
