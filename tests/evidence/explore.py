#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Drives of `--behaviour explore` in the study, whose map lists no furniture, among boxes and a moving crate.

explore.py make FOLDER SEED [plain]   writes robot, map and scene of one drive
explore.py judge FOLDER RUN           prints what the drive met and visited, from the truth, as one line of JSON
explore.py track RUN...               prints rows: errors and coverage of the tracks of several runs together
"""
import csv
import json
import math
import pathlib
import random
import re
import sys

BODY_M = 0.18
VISITED_M = 0.4     # floor within this distance of the robot's way is visited
CELL_M = 0.05
X = (-3.05, 3.05)
Y = (-2.55, 2.55)
LOW_M = 0.05        # the hearth, 0.03 m high, is floor that the robot drives over
REPOSITORY = pathlib.Path(__file__).resolve().parents[2]


def listed(map_text):
    """Returns the landmarks and the obstacles of a map file, as discs (x, y, radius) and polygons."""
    number = r"(-?[\d.]+)"
    discs = [tuple(map(float, m)) for m in re.findall(rf"x_m: +{number}, y_m: +{number}, radius_m: +{number}", map_text)]
    polygons = []
    for line in map_text.splitlines():
        if "hearth" in line:
            continue
        if circle := re.search(rf"circle_m: {{x: {number}, y: {number}, radius: {number}}}", line):
            discs.append(tuple(map(float, circle.groups())))
        if "polygon_m" in line:
            polygons.append([tuple(map(float, p)) for p in re.findall(rf"\[{number}, {number}\]", line)])
    return discs, polygons


def to_segment(p, a, b):
    along = (b[0] - a[0], b[1] - a[1])
    length2 = along[0] ** 2 + along[1] ** 2
    t = 0 if length2 == 0 else min(1, max(0, ((p[0] - a[0]) * along[0] + (p[1] - a[1]) * along[1]) / length2))
    return math.hypot(p[0] - a[0] - t * along[0], p[1] - a[1] - t * along[1])


def clearance(p, discs, polygons):
    """Returns the distance to the nearest wall or thing, negative inside one."""
    least = min(p[0] - X[0], X[1] - p[0], p[1] - Y[0], Y[1] - p[1])
    for x, y, radius in discs:
        least = min(least, math.hypot(p[0] - x, p[1] - y) - radius)
    for polygon in polygons:
        inside = False
        nearest = math.inf
        for a, b in zip(polygon, polygon[1:] + polygon[:1]):
            nearest = min(nearest, to_segment(p, a, b))
            if (a[1] > p[1]) != (b[1] > p[1]) and p[0] < a[0] + (b[0] - a[0]) * (p[1] - a[1]) / (b[1] - a[1]):
                inside = not inside
        least = min(least, -nearest if inside else nearest)
    return least


def make(folder, seed, plain):
    folder.mkdir(parents=True, exist_ok=True)
    choice = random.Random(seed)
    room = "study_plain" if plain else "study"
    map_text = (REPOSITORY / f"scenes/{room}.map.yaml").read_text()
    discs, polygons = listed(map_text)
    boxes = []
    while len(boxes) < 2:
        half = (choice.uniform(0.12, 0.25), choice.uniform(0.12, 0.25))
        middle = (choice.uniform(-2.2, 2.2), choice.uniform(-1.9, 1.9))
        wide = math.hypot(*half)
        if math.hypot(*middle) < 0.6 + wide or clearance(middle, discs, polygons) < 0.5 + wide:
            continue
        x, y = middle
        polygons.append([(x - half[0], y - half[1]), (x + half[0], y - half[1]), (x + half[0], y + half[1]),
                         (x - half[0], y + half[1])])
        boxes.append((x, y, *half, choice.uniform(0.2, 0.6)))
    # The crate goes to and fro between two places with nothing between them, and not over the robot's start.
    while True:
        a = (choice.uniform(-2.2, 2.2), choice.uniform(-1.8, 1.8))
        b = (choice.uniform(-2.2, 2.2), choice.uniform(-1.8, 1.8))
        way = [(a[0] + (b[0] - a[0]) * k / 20, a[1] + (b[1] - a[1]) * k / 20) for k in range(21)]
        if 1.2 < math.dist(a, b) < 2.5 and all(clearance(p, discs, polygons) > 0.3 and math.hypot(*p) > 0.7 for p in way):
            break
    speed = choice.uniform(0.1, 0.25)
    scene = (REPOSITORY / f"scenes/{room}.pov").read_text()
    things = [f"box {{ W({x - w}, {y - d}, 0) W({x + w}, {y + d}, {top}) Grains(<0.12, 0.11, 0.10>, <0.62, 0.58, 0.52>, 0.15) }}"
              for x, y, w, d, top in boxes]
    things.append("union {\n  //*PMName moving.crate\n  box { W(-0.12, -0.12, 0.02) W(0.12, 0.12, 0.55) "
                  "Grains(<0.10, 0.10, 0.11>, <0.60, 0.60, 0.62>, 0.15) }\n"
                  f"  rotate {-math.degrees(math.atan2(b[1] - a[1], b[0] - a[0]))}*y translate W({a[0]}, {a[1]}, 0)\n}}")
    # Before the cameras: the last of them is the default.
    scene = scene.replace("\ncamera {", "\n" + "\n".join(things) + "\ncamera {", 1)
    (folder / "room.pov").write_text(scene)
    lines = map_text.replace(f"scene: {room}.pov", f"scene: room.pov\nscene_paths: [{REPOSITORY}/scenes]").splitlines()
    head = lines[:next(k for k, line in enumerate(lines) if line.startswith("obstacles:"))]
    moving = (f"  - {{name: crate, path_m: [[{a[0]}, {a[1]}], [{b[0]}, {b[1]}]], speed_mps: {speed}, loop: true, "
              "radius_m: 0.17}")
    (folder / "room.map.yaml").write_text("\n".join([*head, "moving:", moving]) + "\n")
    robot = (REPOSITORY / f"robots/{'scout_plain_sim' if plain else 'scout_sim'}.yaml").read_text()
    (folder / "robot.yaml").write_text(re.sub(r"map: .*", "map: room.map.yaml", robot))
    (folder / "truth.json").write_text(json.dumps({"discs": discs, "polygons": polygons, "crate": [a, b, speed]}))


def judge(folder, run):
    truth = json.loads((folder / "truth.json").read_text())
    discs, polygons = truth["discs"], truth["polygons"]
    a, b, speed = truth["crate"]
    poses = [tuple(map(float, line.split()[:3])) for line in (run / "truth.tum").read_text().splitlines()]
    touches = []
    way_m = 0
    least_m = math.inf
    crate_m = math.inf
    for k, (t_s, x, y) in enumerate(poses):
        before = poses[k - 1][1:] if k else (x, y)
        way_m += math.dist((x, y), before)
        least_m = min(least_m, clearance((x, y), discs, polygons) - BODY_M)
        length = math.dist(a, b)
        phase = t_s * speed % (2 * length)
        share = (phase if phase < length else 2 * length - phase) / length
        crate = (a[0] + (b[0] - a[0]) * share, a[1] + (b[1] - a[1]) * share)
        gap_m = math.dist((x, y), crate) - 0.17 - BODY_M
        crate_m = min(crate_m, gap_m)
        if clearance((x, y), discs, polygons) < BODY_M:
            touches.append(("furniture", t_s, True))
        if gap_m < 0 and not (touches and touches[-1][0] == "crate"):
            # Whoever came nearer in the step to the first touch drove into the other.
            nearer_m = math.dist(before, crate) - math.dist((x, y), crate)
            touches.append(("crate", t_s, nearer_m > 0.01))
    columns = round((X[1] - X[0]) / CELL_M)
    rows = round((Y[1] - Y[0]) / CELL_M)
    middle = lambda cell: (X[0] + CELL_M * (cell[0] + 0.5), Y[0] + CELL_M * (cell[1] + 0.5))
    inside = lambda cell: 0 <= cell[0] < columns and 0 <= cell[1] < rows
    start = (int((poses[0][1] - X[0]) / CELL_M), int((poses[0][2] - Y[0]) / CELL_M))
    reached, front = {start}, [start]
    while front:
        column, row = front.pop()
        for cell in ((column + 1, row), (column - 1, row), (column, row + 1), (column, row - 1)):
            if inside(cell) and cell not in reached and clearance(middle(cell), discs, polygons) > BODY_M:
                reached.add(cell)
                front.append(cell)
    visited = sum(any(math.dist(middle(cell), pose[1:]) < VISITED_M for pose in poses) for cell in reached)
    driven_into = sorted({what for what, _, moves in touches if moves})
    run_into = sorted({what for what, _, moves in touches if not moves})
    print(json.dumps({"visited": visited / len(reached), "reachable_m2": len(reached) * CELL_M**2, "way_m": way_m,
                      "least_m": least_m, "crate_m": crate_m, "drove_into": driven_into, "was_run_into": run_into,
                      "first": touches[0] if touches else None, "seconds": poses[-1][0]}))


def track(runs):
    errors_m, headings_rad, held, held_heading, frames, worst = [], [], 0, 0, 0, {}
    for run in runs:
        truths = [list(map(float, line.split())) for line in (run / "truth.tum").read_text().splitlines()]
        inside = 0
        rows = list(csv.DictReader((run / "track.csv").open()))
        for row, truth in zip(rows, truths):
            frames += 1
            if not row["x_m"]:
                continue
            x, y = float(row["x_m"]) - truth[1], float(row["y_m"]) - truth[2]
            a, b, c = (float(row[key]) for key in ("var_x_m2", "cov_xy_m2", "var_y_m2"))
            off = float(row["heading_rad"]) - 2 * math.atan2(truth[6], truth[7])
            off = math.remainder(off, 2 * math.pi)
            errors_m.append(math.hypot(x, y))
            headings_rad.append(abs(off))
            inside += (c * x * x - 2 * b * x * y + a * y * y) / (a * c - b * b) < 5.991
            held_heading += abs(off) < 1.96 * math.sqrt(float(row["var_heading_rad2"]))
        held += inside
        worst[run.name] = inside / len(rows)
    n = len(errors_m)
    mean = lambda values: sum(values) / n
    met = lambda good: "yes" if good else "no"
    what = f"track by the floor plan alone, {len(runs)} runs"
    print(f"row | {what}: frames with a pose | {n} of {frames} | all | {met(n == frames)} |")
    print(f"row | {what}: mean error of the position | {1000 * mean(errors_m):.1f} mm | 20 mm | {met(mean(errors_m) <= 0.02)} |")
    heading = math.degrees(mean(headings_rad))
    print(f"row | {what}: mean error of the heading | {heading:.2f} degrees | 0.3 | {met(heading <= 0.3)} |")
    seeds = ", ".join(f"{100 * share:.0f}" for share in worst.values())
    print(f"row | {what}: 95 % ellipses hold the position (run by run) | {100 * held / n:.1f} % ({seeds}) | 92 to 98 % | {met(0.92 <= held / n <= 0.98)} |")
    print(f"row | {what}: 1.96 sigma hold the heading | {100 * held_heading / n:.1f} % | 92 to 98 % | {met(0.92 <= held_heading / n <= 0.98)} |")


if __name__ == "__main__":
    if len(sys.argv) >= 3 and sys.argv[1] == "track":
        track([pathlib.Path(run) for run in sys.argv[2:]])
    elif len(sys.argv) >= 4 and sys.argv[1] == "make":
        make(pathlib.Path(sys.argv[2]), int(sys.argv[3]), len(sys.argv) > 4)
    elif len(sys.argv) == 4 and sys.argv[1] == "judge":
        judge(pathlib.Path(sys.argv[2]), pathlib.Path(sys.argv[3]))
    else:
        sys.exit(__doc__)
