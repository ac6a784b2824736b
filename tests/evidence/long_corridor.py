#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""A corridor that leads round a block, of a length for a number of landmarks: corridor.pov, corridor.map.yaml and corridor.yaml.

  long_corridor.py LANDMARKS FOLDER    a multiple of 6

Landmarks of six colours stand 2.5 m apart on both sides in turn, so that one colour returns every 15 m. The robot is that of
robots/corridor_sim.yaml. Prints the number of frames that one way round takes.
"""
import math
import os
import random
import re
import sys

COLOURS = {"red": (0.80, 0.03, 0.03), "green": (0.03, 0.80, 0.03), "magenta": (0.80, 0.03, 0.80),
           "blue": (0.03, 0.03, 0.80), "yellow": (0.80, 0.80, 0.03), "cyan": (0.03, 0.80, 0.80)}
HALF = 1.1  # of the corridor's width
SPEED = 0.28  # m/s, with the turns


def on_loop(side, way, margin):
    """Returns place and direction on the middle line: a square, from the middle of its south side, apart from its corners."""
    edge, along = divmod((way + side / 2) % (4 * side), side)
    along = min(max(along, margin), side - margin)
    direction = 1j ** int(edge)
    corner = side * [-0.5, 0.5, 0.5 + 1j, -0.5 + 1j][int(edge)]
    return corner + along * direction, direction


def main():
    count, folder = int(sys.argv[1]), sys.argv[2]
    side = 2.5 * count / 4
    random.seed(count)
    os.makedirs(folder, exist_ok=True)
    landmarks = []
    for i in range(count):
        place, direction = on_loop(side, 1.2 + 2.5 * i + random.uniform(-0.4, 0.4), margin=1.4)
        place += direction * 1j * (0.88 if i % 2 else -0.88)
        colour = list(COLOURS)[i % 6]
        landmarks.append((f"{colour}_{i // 6 + 1}", COLOURS[colour], place))
    west, east, south, north = -side / 2 - HALF, side / 2 + HALF, -HALF, side + HALF
    block = (west + 2 * HALF, south + 2 * HALF, east - 2 * HALF, north - 2 * HALF)
    scene = open("scenes/corridor.pov").read()
    head = scene[:scene.index("light_source")].replace("parts/robot.inc", "robot.inc")
    materials = scene[scene.index("#declare F_Matt"):scene.index("// ---", scene.index("#declare T_Rail"))]
    robot = scene[scene.index("// Heights above the floor"):]
    pipe = scene[scene.index("#macro Pipe"):scene.index("Pipe(-2.10")]
    box = lambda a, b, c, d, z0, z1, what: f"box {{ W({a}, {b}, {z0}) W({c}, {d}, {z1}) {what} no_shadow }}\n"
    wall = lambda a, b, c, d, what: box(a, b, c, d, 0, "WZ", f"texture {{ {what} }}")
    rooms = "".join(f"light_source {{ W({x * side}, {(y + 0.5) * side}, {2 + side}) color rgb 0.36 }}\n" for x in (-1, 1) for y in (-1, 1))
    rooms += materials
    rooms += box(west, south, east, north, -0.05, 0, "pigment { checker color rgb <0.50, 0.47, 0.42> color rgb <0.30, 0.29, 0.27> "
                 "scale 8 translate -100*y }")
    rooms += box(west, south, east, north, "WZ", "WZ+0.05", "pigment { color rgb 0.62 } finish { F_Glow }")
    rooms += wall(west, north, east, north + 0.1, "T_Wall") + wall(west, south - 0.1, east, south, "T_Wall")
    rooms += wall(east, south, east + 0.1, north, "T_Blue") + wall(west - 0.1, south, west, north, "T_Blue")
    rooms += wall(*block, "T_Wall")
    rooms += pipe
    for _, colour, p in landmarks:
        rooms += f"Pipe({p.real:.4f}, {p.imag:.4f}, {', '.join(map(str, colour))})\n"
    write = lambda name, text: open(os.path.join(folder, name), "w").write(text)
    write("corridor.pov", head + rooms + robot)
    text = f"scene: corridor.pov\nscene_paths: [{os.path.abspath('scenes/parts')}]\nunit_m: 0.05\nbounds_m: {{x: [{west}, {east}], y: [{south}, {north}]}}\nlandmark_sigma_m: 0\nlandmarks:\n"
    for name, colour, p in landmarks:
        text += f"  - {{name: {name}, colour: [{', '.join(map(str, colour))}], x_m: {p.real:.4f}, y_m: {p.imag:.4f}, radius_m: 0.06, top_m: 1.00}}\n"
    a, b, c, d = block
    write("corridor.map.yaml", text + f"obstacles:\n  - {{polygon_m: [[{a}, {b}], [{c}, {b}], [{c}, {d}], [{a}, {d}]]}}\neffects: {{}}\n")
    points = []
    for way in range(1, math.ceil(4 * side)):  # a point each metre keeps the robot on the middle line
        point, _ = on_loop(side, way, margin=0.4)
        points.append([round(point.real, 3), round(point.imag, 3)])
    robot = open("robots/corridor_sim.yaml").read().replace("../scenes/corridor.map.yaml", "corridor.map.yaml")
    write("corridor.yaml", re.sub(r"waypoints_m: .*", f"waypoints_m: {points}", robot))
    print(math.ceil(4 * side / SPEED * 15) + 300)


if __name__ == "__main__":
    main()
