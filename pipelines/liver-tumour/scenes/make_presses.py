#!/usr/bin/env python3
"""make_presses.py: writes presses.csv beside this file, the finger's path of palpate.toml."""
import os

FIRST, LAST, STEP, HEIGHT = 95, 190, 5, 118  # x of the presses and their z, mm
CLEAR, DEEPEST = 18, 34  # y before the surface, which lies at 24 to 28, and at the end of a press, mm

rows, time = [], 0.0
for x in range(FIRST, LAST + STEP, STEP):
    for y, duration in ((CLEAR, 0.1), (DEEPEST, 0.4), (CLEAR, 0.2)):
        time += duration
        rows.append("%.1f,%d,%d,%d" % (time, x, y, HEIGHT))
with open(os.path.join(os.path.dirname(os.path.abspath(__file__)), "presses.csv"), "w") as file:
    file.write("# A finger presses the front of the liver at places 5 mm apart, from right to left. Written by make_presses.py. mm\n"
               "time_s,x,y,z\n")
    file.write("\n".join(rows) + "\n")
