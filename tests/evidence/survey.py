#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Figures of surveys (survey.sh), against the truth that `twocone as-built` wrote.

  survey.py FOLDER...   one robot each: built.map.yaml, survey.survey.json, and perhaps own/ and true/ (the same frames localised on
                        the surveyed and on the true map)
  survey.py --tape FOLDER SEED   two landmarks of that survey that are about 3 m apart, and their true distance with an error of
                        2 mm, as twocone survey --distance wants them

  survey.py --track RUN MAP.yaml [LOCALISED]   the track and the last landmarks of a run without a map of landmarks, against the
                        truth; beside the track of the same images on the true map
  survey.py --mrpt PROGRAM RUN MAP.yaml   the map that MRPT's range-bearing SLAM (mrpt_slam.cpp) makes of the ranges and bearings of a
                        localised run, which it gets with the landmarks' identities, against the truth
  survey.py --cost COMMAND...   runs a command; prints its seconds and its greatest memory, MiB

Prints lines KEY VALUE, and a line of each robot to standard error. Errors of landmarks are those that remain after the best
similarity, and after the best rigid motion. Fixes on the own map are laid over the truth by the similarity of the landmarks.
"""
import cmath
import json
import math
import os
import random
import re
import resource
import statistics
import subprocess
import sys
import time

from first_day import frames, landmarks, squared_sigmas


def motion(here, there, is_rigid=False, weights=None):
    """Returns (turn, shift) of least squares: there = turn * here + shift."""
    weights = weights or [1] * len(here)
    mean_here, mean_there = (sum(w * p for w, p in zip(weights, places)) / sum(weights) for places in (here, there))
    turn = sum(w * (p - mean_here).conjugate() * (q - mean_there) for w, p, q in zip(weights, here, there))
    turn /= abs(turn) if is_rigid else sum(w * abs(p - mean_here) ** 2 for w, p in zip(weights, here))
    return turn, mean_there - turn * mean_here


def rms(values):
    return math.sqrt(sum(abs(v) ** 2 for v in values) / len(values))


def rms_mm(here, there, turn, shift):
    """Returns the distances that remain after that motion."""
    return 1000 * rms([turn * p + shift - q for p, q in zip(here, there)])


def nearest(truth, place):
    return min(truth, key=lambda name: abs(truth[name] - place))


def solve(matrix, columns):
    """Returns the solutions of matrix * x = column, by elimination with pivots."""
    size = len(matrix)
    rows = [list(matrix[i]) + [column[i] for column in columns] for i in range(size)]
    for i in range(size):
        pivot = max(range(i, size), key=lambda k: abs(rows[k][i]))
        rows[i], rows[pivot] = rows[pivot], rows[i]
        for k in range(size):
            if k != i:
                factor = rows[k][i] / rows[i][i]
                rows[k] = [a - factor * b for a, b in zip(rows[k], rows[i])]
    return [[rows[i][size + c] / rows[i][i] for i in range(size)] for c in range(len(columns))]


def dot(a, b):
    return sum(x * y for x, y in zip(a, b))


def chi_squared_of_shape(errors, covariance, places):
    """Returns chi-squared of the errors apart from place, direction and scale of the whole map."""
    slopes = [[1, 0] * len(places), [0, 1] * len(places)]
    slopes.append([v for p in places for v in (-p.imag, p.real)])
    slopes.append([v for p in places for v in (p.real, p.imag)])
    weighted = solve(covariance, [errors] + slopes)
    normal = [[dot(a, b) for b in weighted[1:]] for a in slopes]
    right = [dot(a, weighted[0]) for a in slopes]
    return dot(errors, weighted[0]) - dot(right, solve(normal, [right])[0])


def sigma_of_scale(covariance, places):
    """Returns the standard deviation of the map's scale, as least squares of the places give it."""
    mean = sum(places) / len(places)
    slopes = [v for p in places for v in ((p - mean).real, (p - mean).imag)]
    square = dot(slopes, slopes)
    return math.sqrt(dot(slopes, [dot(row, slopes) for row in covariance])) / square


def tops(file):
    """Returns the heights of the tops of a map's landmarks, by name."""
    return {found[1]: float(found[2]) for found in re.finditer(r"name: (\S+), .*? (?:top|line)_m: ([^,}]+)", open(file).read())}


def pairs_of(folder):
    """Returns the survey, the true places, and which landmark is which."""
    survey = json.load(open(f"{folder}/survey.survey.json"))
    truth = landmarks(f"{folder}/built.map.yaml")
    pairs = []
    for landmark in survey["landmarks"]:
        place = complex(landmark["x_m"], landmark["y_m"])
        name = nearest(truth, place)
        if abs(truth[name] - place) < 0.5 and name not in [other for _, other in pairs]:
            pairs.append((landmark, name))
    return survey, truth, pairs


def tape(folder, seed):
    _, truth, pairs = pairs_of(folder)
    apart = lambda pair: abs(truth[pair[0][1]] - truth[pair[1][1]])
    one, other = min(((p, q) for i, p in enumerate(pairs) for q in pairs[:i]), key=lambda pair: abs(apart(pair) - 3))
    error = random.Random(seed).gauss(0, 0.002)
    print(one[0]["name"], other[0]["name"], round(apart((one, other)) + error, 5))


def table(file):
    lines = [line.rstrip("\n").split(",") for line in open(file)]
    return [dict(zip(lines[0], line)) for line in lines[1:]]


def truth_of(run):
    truth = {}
    for line in open(f"{run}/truth.tum"):
        t, x, y, _, _, _, z, w = map(float, line.split())
        truth[round(t, 6)] = (x, y, 2 * math.atan2(z, w))
    return truth


def of_track(rows, truth, turn=1, shift=0):
    """Returns the distances of a track's positions, moved by a similarity, from the truth, mm, and its poses' normalised errors
    squared."""
    off, squares = [], []
    for row in rows:
        if not row["x_m"]:
            continue
        x, y, heading = truth[round(float(row["t_s"]), 6)]
        place = turn * complex(float(row["x_m"]), float(row["y_m"])) + shift
        off.append(1000 * abs(place - complex(x, y)))
        error = [float(row["x_m"]) - x, float(row["y_m"]) - y,
                 math.remainder(float(row["heading_rad"]) - heading, 2 * math.pi)]
        xx, xy, yy, xh, yh, hh = (float(row[key]) for key in (
            "var_x_m2", "cov_xy_m2", "var_y_m2", "cov_x_heading_m_rad", "cov_y_heading_m_rad", "var_heading_rad2"))
        if int(row["frame"]) >= 15:  # the start is exact
            squares.append(dot(error, solve([[xx, xy, xh], [xy, yy, yh], [xh, yh, hh]], [error])[0]))
    return off, squares


def track(run, map_file, localised=None):
    truth = truth_of(run)
    rows = table(f"{run}/track.csv")
    off, squares = of_track(rows, truth)
    places = landmarks(map_file)
    last = table(f"{run}/landmarks.csv")
    last = [row for row in last if row["frame"] == last[-1]["frame"]]
    pairs, weights, errors, of_places = [], [], [], []
    for row in last:
        place = complex(float(row["x_m"]), float(row["y_m"]))
        name = nearest(places, place)
        error = place - places[name]
        errors.append(1000 * abs(error))
        if abs(error) < 0.3:
            pairs.append((place, name))
            weights.append(1 / (float(row["var_x_m2"]) + float(row["var_y_m2"])))
            of_places.append(squared_sigmas(error, row))
    found = {name for _, name in pairs}
    print("mean_mm", round(statistics.mean(off), 2))
    print("last_mm", round(statistics.mean(off[-30:]), 2))
    print("nees", round(statistics.mean(squares), 2))
    print("beyond_percent", round(100 * statistics.mean(s > 7.81 for s in squares), 1))  # 95 % of chi-squared of 3
    print("landmarks", len(places))
    print("found", len(found))
    print("more", len(last) - len(found))
    print("landmark_mm", round(statistics.median(errors), 1))
    print("worst_landmark_mm", round(max(errors), 1))
    print("place_nees", round(statistics.mean(of_places), 2))
    if localised:
        half = len(rows) // 2
        on_true, _ = of_track(table(f"{localised}/track.csv")[half:], truth)
        similarity = motion([place for place, _ in pairs], [places[name] for _, name in pairs], weights=weights)
        laid, _ = of_track(rows[half:], truth, *similarity)
        print("half_mm", round(statistics.mean(off[half:]), 2))
        print("laid_mm", round(statistics.mean(laid), 2))
        print("true_mm", round(statistics.mean(on_true), 2))
        print("laid_ratio", round(statistics.mean(laid) / statistics.mean(on_true), 2))


def mrpt(program, run, map_file):
    """MRPT knows one standard deviation of ranges and one of bearings: they get the medians of the run."""
    odometry = [list(map(float, line.split())) for line in open(f"{run}/odometry.tum")]
    poses = [(complex(x, y), 2 * math.atan2(z, w)) for _, x, y, _, _, _, z, w in odometry]
    truth = landmarks(map_file)
    names = list(truth)
    seen = {}
    sigmas = []
    for row in table(f"{run}/ranges.csv"):
        if row["verdict"] == "ok" and row["bearing_rad"]:
            seen.setdefault(int(row["frame"]), []).append(f"{names.index(row['landmark'])} {row['range_m']} {row['bearing_rad']}")
            sigmas.append((float(row["sigma_range_m"]), float(row["sigma_bearing_rad"])))
    lines, before = [], poses[0]
    for frame, (place, heading) in enumerate(poses):
        if frame not in seen:
            continue
        step = (place - before[0]) * cmath.exp(-1j * before[1])
        turn = math.remainder(heading - before[1], 2 * math.pi)
        before = (place, heading)
        # A slip of 3 % of the way and of the turn, and what encoders do not resolve.
        along = 0.03 * abs(step) + 0.0005
        lines.append(f"{step.real} {step.imag} {turn} {along} {along / 3} {0.03 * abs(turn) + 0.001} " + " ".join(seen[frame]))
    medians = [str(statistics.median(column)) for column in zip(*sigmas)]
    found = subprocess.run([program, *medians], input="\n".join(lines) + "\n", text=True, capture_output=True, check=True).stdout
    here, there = [], []
    for line in found.splitlines():
        number, x, y = line.split()
        here.append(complex(float(x), float(y)))
        there.append(truth[names[int(number)]])
    turn, shift = motion(here, there)
    print("found", len(here), "of", len(truth))
    print("similarity_mm", round(rms_mm(here, there, turn, shift), 2))
    print("scale_percent", round(100 * (abs(turn) - 1), 2))


def cost(command):
    begin = time.monotonic()
    status = subprocess.run(command, stdout=sys.stderr).returncode
    print("seconds", round(time.monotonic() - begin, 1))
    print("mib", round(resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss / 1024))
    sys.exit(status)


def figures_of(folder):
    survey, truth, pairs = pairs_of(folder)
    belief = survey["belief"]
    found = survey["landmarks"]
    heights = tops(f"{folder}/built.map.yaml")
    here = [complex(l["x_m"], l["y_m"]) for l, _ in pairs]
    there = [truth[name] for _, name in pairs]
    index = {name: i for i, name in enumerate(belief["names"])}
    columns = [index[f"landmark {l['name']} {axis}"] for l, _ in pairs for axis in ("x_m", "y_m")]
    covariance = [[belief["covariance"][i][k] for k in columns] for i in columns]
    errors = [v for p, q in zip(here, there) for v in ((q - p).real, (q - p).imag)]
    turn, shift = motion(here, there)
    rigid_turn, rigid_shift = motion(here, there, is_rigid=True)
    answer = {
        "landmarks": len(truth), "found": len(pairs), "ghosts": len(found) - len(pairs),
        "similarity_mm": rms_mm(here, there, turn, shift), "rigid_mm": rms_mm(here, there, rigid_turn, rigid_shift),
        "chi_squared": chi_squared_of_shape(errors, covariance, here), "freedom": 2 * len(pairs) - 4,
        "scale_percent": 100 * (abs(turn) - 1), "scale_sigma_percent": 100 * sigma_of_scale(covariance, here),
        "tops_mm": 1000 * rms([l["top_m"] - heights[name] for l, name in pairs]), "own_mm": math.nan, "true_mm": math.nan}
    if not os.path.exists(f"{folder}/own"):
        return answer
    for kind, (t, s) in (("own", (turn, shift)), ("true", (1, 0))):
        off = []
        for row, place, _ in frames(f"{folder}/{kind}"):
            if row["x_m"]:
                off.append(abs(t * complex(float(row["x_m"]), float(row["y_m"])) + s - place))
        answer[f"{kind}_mm"] = 1000 * statistics.mean(off) if off else math.inf
        answer[f"{kind}_fixes"] = len(off)
    return answer


def main():
    robots = []
    for folder in sys.argv[1:]:
        try:
            robots.append(figures_of(folder))
        except OSError as error:
            print(f"{folder}: {error}", file=sys.stderr)
            continue
        r = robots[-1]
        print(f"{folder.split('/')[-1]}: {r['found']} of {r['landmarks']}, {r['ghosts']} ghosts, {r['similarity_mm']:.2f} mm, "
              f"rigid {r['rigid_mm']:.2f} mm, chi-squared {r['chi_squared']:.1f} of {r['freedom']}, scale {r['scale_percent']:+.2f} % "
              f"+- {r['scale_sigma_percent']:.2f} %, tops {r['tops_mm']:.2f} mm, "
              f"fixes {r['own_mm']:.2f} mm on the own map, {r['true_mm']:.2f} mm on the true one", file=sys.stderr)
    if not robots:
        return
    total = lambda key: sum(r[key] for r in robots)
    print("robots", len(robots), "of", len(sys.argv) - 1)
    print("landmarks", total("landmarks"))
    print("found", total("found"))
    print("ghosts", total("ghosts"))
    print("similarity_mm", round(statistics.median(r["similarity_mm"] for r in robots), 2))
    print("worst_mm", round(max(r["similarity_mm"] for r in robots), 2))
    print("within_2_mm", sum(r["similarity_mm"] <= 2 for r in robots))
    print("within_3_mm", sum(r["similarity_mm"] <= 3 for r in robots))
    print("chi_squared", round(total("chi_squared"), 1))
    print("freedom", total("freedom"))
    print("rigid_mm", round(statistics.median(r["rigid_mm"] for r in robots), 2))
    print("worst_rigid_mm", round(max(r["rigid_mm"] for r in robots), 2))
    print("rigid_within_3_mm", sum(r["rigid_mm"] <= 3 for r in robots))
    print("tops_mm", round(statistics.median(r["tops_mm"] for r in robots), 2))
    print("scale_chi_squared", round(sum((r["scale_percent"] / r["scale_sigma_percent"]) ** 2 for r in robots), 1))
    print("worst_scale_sigmas", round(max(abs(r["scale_percent"] / r["scale_sigma_percent"]) for r in robots), 1))
    print("scale_percent", round(statistics.median(abs(r["scale_percent"]) for r in robots), 2))
    print("scale_sigma_percent", round(statistics.median(r["scale_sigma_percent"] for r in robots), 2))
    print("ratio", round(statistics.median(r["own_mm"] / r["true_mm"] for r in robots), 2))


if __name__ == "__main__":
    if sys.argv[1] == "--tape":
        tape(sys.argv[2], int(sys.argv[3]))
    elif sys.argv[1] == "--track":
        track(*sys.argv[2:])
    elif sys.argv[1] == "--mrpt":
        mrpt(*sys.argv[2:])
    elif sys.argv[1] == "--cost":
        cost(sys.argv[2:])
    else:
        main()
