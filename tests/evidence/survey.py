#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Figures of surveys (survey.sh), against the truth that `twocone as-built` wrote.

  survey.py FOLDER...   one robot each: built.map.yaml, survey.survey.json, own/ and true/ (the same frames localised on the surveyed
                        and on the true map)

Prints lines KEY VALUE, and a line of each robot to standard error. Errors of landmarks are those that remain after the best
similarity, and after the best rigid motion. Fixes on the own map are laid over the truth by the similarity of the landmarks.
"""
import cmath
import json
import math
import statistics
import sys

from first_day import frames, landmarks


def motion(here, there, is_rigid=False):
    """Returns (turn, shift) of least squares: there = turn * here + shift."""
    mean_here, mean_there = sum(here) / len(here), sum(there) / len(there)
    turn = sum((p - mean_here).conjugate() * (q - mean_there) for p, q in zip(here, there))
    turn /= abs(turn) if is_rigid else sum(abs(p - mean_here) ** 2 for p in here)
    return turn, mean_there - turn * mean_here


def rms(values):
    return math.sqrt(sum(abs(v) ** 2 for v in values) / len(values))


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


def figures_of(folder):
    survey = json.load(open(f"{folder}/survey.survey.json"))
    truth = landmarks(f"{folder}/built.map.yaml")
    belief = survey["belief"]
    found, pairs = survey["landmarks"], []
    for landmark in found:
        place = complex(landmark["x_m"], landmark["y_m"])
        nearest = min(truth, key=lambda name: abs(truth[name] - place))
        if abs(truth[nearest] - place) < 0.5 and nearest not in [name for _, name in pairs]:
            pairs.append((landmark, nearest))
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
        "similarity_mm": 1000 * rms([turn * p + shift - q for p, q in zip(here, there)]),
        "rigid_mm": 1000 * rms([rigid_turn * p + rigid_shift - q for p, q in zip(here, there)]),
        "chi_squared": chi_squared_of_shape(errors, covariance, here), "freedom": 2 * len(pairs) - 4,
        "scale_percent": 100 * (abs(turn) - 1)}
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
              f"rigid {r['rigid_mm']:.2f} mm, chi-squared {r['chi_squared']:.1f} of {r['freedom']}, scale {r['scale_percent']:+.2f} %, "
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
    print("ratio", round(statistics.median(r["own_mm"] / r["true_mm"] for r in robots), 2))


if __name__ == "__main__":
    main()
