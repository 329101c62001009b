#!/usr/bin/env python3
"""speed.py PALPATE_RUN BUNDLE -o FOLDER: plays one push of the liver under several contact models and prints what a step takes.

The scenes are written into FOLDER and played in turn, RUNS times each, with real-time priority where the system allows it. Printed: of
the runs' medians and 99th percentiles the least, which is what the machine does when nothing else disturbs it, and the worst step of
the middle run (half of the runs have a lower worst step, half a higher one)."""
import argparse
import json
import os
import pathlib
import statistics
import subprocess

PUSH = "[[0, 150, 15, 118], [0.5, 150, 24, 118], [1.3, 150, 36, 118], [1.6, 150, 36, 118], [2.4, 150, 15, 118]]"
STROKE = "[[0, 150, 15, 118], [0.5, 150, 24, 118], [0.9, 150, 32, 118], [2.1, 166, 32, 118], [2.6, 166, 15, 118]]"
BESIDE = "[[0, 175, 15, 118], [0.5, 175, 24, 118], [0.9, 175, 32, 118], [2.1, 160, 32, 118], [2.6, 160, 15, 118]]"
# What is printed, the scene's effects, and a path for each tool.
SCENES = {
    "point": ("a point (radius 0), sticks, collision at rest", 'contact = "point"', [PUSH]),
    "patch": ("a disc of 6 mm radius, sticks, collision at rest", 'contact = "patch"', [PUSH]),
    "deformed": ("the same, collision deformed", 'contact = "patch"\ncollision = "deformed"', [PUSH]),
    "coulomb": ("the same with friction 0.3, drawn over the surface", 'contact = "patch"\ncollision = "deformed"\nlaw = "coulomb"', [STROKE]),
    "two": ("two such discs side by side", 'contact = "patch"\ncollision = "deformed"\nlaw = "coulomb"', [STROKE, BESIDE]),
}


def scene_text(name, effects, paths):
    disc = ("" if name == "point" else "disc_radius = 6\n") + ("friction = 0.3\n" if "coulomb" in effects else "")
    tools = "".join(f'\n[[tool]]\nname = "probe {i}"\npoints = [[0, 0, 0]]\n{disc}path = {path}\n' for i, path in enumerate(paths, 1))
    return f'name = "{name}"\nunit = "mm"\n\n[effects]\n{effects}\n{tools}'


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("palpate_run")
    parser.add_argument("bundle")
    parser.add_argument("-o", type=pathlib.Path, required=True)
    parser.add_argument("--runs", type=int, default=7)
    arguments = parser.parse_args()
    arguments.o.mkdir(parents=True, exist_ok=True)
    for name, (_, effects, paths) in SCENES.items():
        (arguments.o / f"{name}.toml").write_text(scene_text(name, effects, paths))
    priority = "real-time priority"
    try:
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(50))
    except PermissionError:
        priority = "normal priority"
    timing = {name: [] for name in SCENES}
    nodes, steps = {}, 0
    for _ in range(arguments.runs):
        for name in SCENES:
            folder = arguments.o / name
            subprocess.run([arguments.palpate_run, arguments.o / f"{name}.toml", "--bundle", arguments.bundle, "-o", folder, "--quiet"], check=True)
            summary = json.loads((folder / "summary.json").read_text())
            timing[name].append(summary["timing_us"])
            nodes[name] = summary["most_contact_nodes"]
            steps = min(steps or summary["touches"], summary["touches"])
    print(f"{arguments.bundle}, {priority}, {arguments.runs} runs of {steps} touches and more, us: median, 99 %, worst")
    print("| contact | nodes under contact | touch | shape |\n|---|---|---|---|")
    for name, (words, _, _) in SCENES.items():
        cells = [", ".join(f"{v:.2g}" if v < 100 else f"{v:.0f}" for v in (min(t[half]["p50"] for t in timing[name]), min(t[half]["p99"] for t in timing[name]),
                                                                            statistics.median(t[half]["max"] for t in timing[name])))
                 for half in ("touch", "shape")]
        print(f"| {words} | {nodes[name]} | {cells[0]} | {cells[1]} |")


main()
