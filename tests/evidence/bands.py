#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Figures of banded landmarks (bands.sh).

  bands.py map ROOM.map.yaml       the map with a landmark that does not exist for each number that none has
  bands.py room KIND FOLDER        writes a scene and its map: the lab with six pipes, KIND: coloured or banded
  bands.py false RUN...            sightings, wrong numbers and wrong ranges of runs with such a map
  bands.py ranges RUN              by distance: how many are read, and the errors of those that are ranged
  bands.py errors RUN              errors of all ranges, and the time of a frame
  bands.py fixes RUN...            errors of fixes, and their chi-squared over two degrees of freedom
"""
import collections
import csv
import math
import os
import re
import statistics
import sys

NUMBERS = 64
RADIUS_M, TOP_M, LINE_M = 0.055, 1.00, 0.898
# Of the lab's six landmarks
PLACES = {
    "red": (-2.45, -0.35, (0.80, 0.03, 0.03)), "green": (-1.40, 1.95, (0.03, 0.80, 0.03)),
    "blue": (1.50, 1.95, (0.03, 0.03, 0.80)), "cyan": (2.45, 0.30, (0.03, 0.80, 0.80)),
    "magenta": (1.30, -1.95, (0.80, 0.03, 0.80)), "yellow": (-1.50, -1.95, (0.80, 0.80, 0.03))}


def rows(run, table):
    return csv.DictReader(open(f"{run}/{table}.csv"))


def decoys(file):
    text = open(file).read()
    folder = os.path.dirname(os.path.abspath(file))
    text = re.sub(r"^scene: (.*)$", rf"scene: {folder}/\1\nscene_paths: [{folder}]", text, flags=re.M)
    used = {int(number) for number in re.findall(r"bands: *(\d+)", text)}
    lines = "".join(
        f"  - {{name: none_{n}, bands: {n}, x_m: {-2.95 + 0.09 * n:.2f}, y_m: 2.54, radius_m: {RADIUS_M}, line_m: {LINE_M}}}\n"
        for n in range(1, NUMBERS + 1) if n not in used)
    print(text.replace("obstacles:\n", lines + "obstacles:\n"), end="")


def room(kind, folder, words):
    """words: the twelve cells of a number, by number, as the shipped scene has them"""
    lab = os.path.abspath("scenes")
    scene = open("scenes/lab.pov").read().replace("#version 3.7;", "#version 3.7;\n#declare Landmarks_Elsewhere = 1;", 1)
    scene += '\n#include "parts/bands.inc"\n'
    text = f"scene: {kind}.pov\nscene_paths: [{lab}]\nunit_m: 0.05\nbounds_m: {{x: [-3.05, 3.05], y: [-2.55, 2.55]}}\nlandmark_sigma_m: 0\nlandmarks:\n"
    for number, (name, (x, y, colour)) in enumerate(PLACES.items(), 1):
        rgb = ", ".join(map(str, colour))
        if kind == "coloured":
            scene += (f"cylinder {{ W({x}, {y}, 0) W({x}, {y}, {TOP_M}) {RADIUS_M}*M pigment {{ color rgb <{rgb}> }} "
                      "finish { ambient 0.30 diffuse 0.62 } }\n")
            text += f"  - {{name: {name}, colour: [{rgb}], x_m: {x}, y_m: {y}, radius_m: {RADIUS_M}, top_m: {TOP_M}}}\n"
        else:
            scene += f"Banded({x}, {y}, {RADIUS_M}, {TOP_M}, {words[number]})\n"
            text += f"  - {{name: {name}, bands: {number}, x_m: {x}, y_m: {y}, radius_m: {RADIUS_M}, line_m: {LINE_M}}}\n"
    obstacles = open("scenes/lab.map.yaml").read()
    text += obstacles[obstacles.index("obstacles:"):]
    open(f"{folder}/{kind}.pov", "w").write(scene)
    open(f"{folder}/{kind}.map.yaml", "w").write(text)


def shipped_words():
    lines = re.findall(r"^Banded\(.*?1\.00, (.*?)\) *// (\d+)$", open("scenes/furnished.pov").read(), flags=re.M)
    return {int(number): cells for cells, number in lines}


def false_numbers(runs):
    sightings = numbers = ranges = refused = 0
    for run in runs:
        for row in rows(run, "ranges"):
            if row["landmark"].startswith("none_"):
                refused += row["verdict"] != "not_seen" and not row["range_m"]
                numbers += bool(row["range_m"])
            elif row["range_m"]:
                sightings += 1
                off = abs(float(row["range_m"]) - float(row["true_range_m"]))
                ranges += off > 0.05 and off > 6 * float(row["sigma_range_m"])
    print("sightings", sightings)
    print("wrong_numbers", numbers)
    print("refused", refused)
    print("wrong_ranges", ranges)


def by_distance(run):
    bins = collections.defaultdict(list)
    for row in rows(run, "ranges"):
        bins[int(2 * float(row["true_range_m"])) / 2].append(row)
    print("range m      sightings   read %  ranged %   rms mm  median sigma mm  chi-squared")
    for at, found in sorted(bins.items()):
        read = sum(row["verdict"] != "not_seen" for row in found)
        off = [(float(r["range_m"]) - float(r["true_range_m"]), float(r["sigma_range_m"])) for r in found if r["range_m"]]
        line = f"{at:3.1f} to {at + 0.5:3.1f}  {len(found):9}  {100 * read / len(found):6.1f}  {100 * len(off) / len(found):8.1f}"
        if off:
            line += (f"  {1000 * math.sqrt(statistics.mean(o * o for o, _ in off)):7.2f}  {1000 * statistics.median(s for _, s in off):15.2f}"
                     f"  {statistics.mean((o / s) ** 2 for o, s in off):11.2f}")
        print(line)


def errors_of(run):
    off = [(float(r["range_m"]) - float(r["true_range_m"]), float(r["sigma_range_m"])) for r in rows(run, "ranges") if r["range_m"]]
    print("ranged", len(off))
    print("range_rms_mm", round(1000 * math.sqrt(statistics.mean(o * o for o, _ in off)), 3))
    print("range_median_mm", round(1000 * statistics.median(abs(o) for o, _ in off), 3))
    print("vision_ms", round(1000 * statistics.median(float(r["vision_s"]) for r in rows(run, "timing")), 2))


def fixes(runs):
    errors, squares = [], []
    for run in runs:
        for row in rows(run, "fixes"):
            if row["verdict"] != "ok":
                continue
            x, y = float(row["x_m"]) - float(row["true_x_m"]), float(row["y_m"]) - float(row["true_y_m"])
            xx, xy, yy = (float(row[k]) for k in ("var_x_m2", "cov_xy_m2", "var_y_m2"))
            errors.append(math.hypot(x, y))
            squares.append((yy * x * x - 2 * xy * x * y + xx * y * y) / (xx * yy - xy * xy))
    print("fixes", len(errors))
    print("mean_mm", round(1000 * statistics.mean(errors), 3))
    print("worst_mm", round(1000 * max(errors), 2))
    print("within_95", round(100 * statistics.mean(s <= 5.991 for s in squares), 1))


def main():
    kind, arguments = sys.argv[1], sys.argv[2:]
    if kind == "map":
        decoys(arguments[0])
    elif kind == "room":
        room(arguments[0], arguments[1], shipped_words())
    elif kind == "false":
        false_numbers(arguments)
    elif kind == "ranges":
        by_distance(arguments[0])
    elif kind == "errors":
        errors_of(arguments[0])
    else:
        fixes(arguments)


main()
