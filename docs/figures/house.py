#!/usr/bin/env python3
"""house.py REPOSITORY -o FILE.png: the rooms of the repository and which room includes headers of which, read from the sources.

An arrow goes from a room to the room that uses it: the direction in which data flows. Arrows that follow from others (A to B and
B to C stand for A to C) are left out. formats/ is used by every house and stands beside them."""
import argparse
import pathlib
import re

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt  # noqa: E402
from matplotlib.patches import FancyBboxPatch  # noqa: E402

INK, FACE = "#1c2530", {"meshing": "#f4e6d4", "precompute": "#e6eef5", "runtime": "#e2f0e6", "programs": "#efe6f4"}
HOUSES = ("meshing", "precompute", "runtime", "programs")
LIBRARIES = {"meshing": "CGAL, gmsh, ITK, libpng, VTK", "precompute": "PETSc, SuiteSparse, MPI, Eigen", "runtime": "Eigen's headers, nothing else",
             "programs": "the public headers"}
# Where a room stands between the left and the right of its house, so that no arrow runs through another room; others are spread evenly.
ACROSS = {"precompute": {"elements": 0.5, "solver": 0.5, "ranks": 0.2, "tensors": 0.62, "bundle_tool": 0.8, "journal": 0.43, "run": 0.35},
          "runtime": {"base": 0.5, "dense": 0.13, "pose": 0.33, "large": 0.51, "tissue": 0.69, "device": 0.89, "bundle": 0.13, "surface": 0.13, "query": 0.14, "contact": 0.36, "shape": 0.57,
                      "tool_shape": 0.84, "scene": 0.5}}


def rooms_of(root, house):
    return sorted(p.name for p in (root / house).iterdir() if p.is_dir() and p.name != "include" and any(p.rglob("*.cpp")))


def uses(root, house, rooms):
    """{room: rooms of the same house whose headers it includes}"""
    found = {room: set() for room in rooms}
    for room in rooms:
        for file in (root / house / room).rglob("*"):
            if file.suffix not in (".h", ".cpp"):
                continue
            for other in re.findall(rf'#include "{house}/(\w+)/', file.read_text()):
                if other != room and other in found:
                    found[room].add(other)
    return found


def reachable(graph, start):
    seen, todo = set(), list(graph[start])
    while todo:
        room = todo.pop()
        if room not in seen:
            seen.add(room)
            todo += graph[room]
    return seen


def levels_of(graph):
    """Of each room: 0 where it uses no other, else one more than the highest that it uses. Rooms that use one another share one."""
    together = {room: frozenset(r for r in reachable(graph, room) if room in reachable(graph, r)) | {room} for room in graph}
    known = {}

    def level(room):
        if together[room] not in known:
            known[together[room]] = 1 + max((level(r) for member in together[room] for r in graph[member] if r not in together[room]), default=-1)
        return known[together[room]]

    return {room: level(room) for room in graph}


def direct(graph, room):
    """The rooms that a room uses and no other of those already stands for."""
    return [other for other in graph[room]
            if not any(other in reachable(graph, between) for between in graph[room] if between != other and room not in reachable(graph, between))]


def draw_house(axes, root, house, left, width, top):
    graph = uses(root, house, rooms_of(root, house))
    level = levels_of(graph)
    rows = [sorted(r for r in graph if level[r] == k) for k in range(1 + max(level.values()))]
    axes.add_patch(FancyBboxPatch((left, 0), width, top, boxstyle="round,pad=0,rounding_size=0.1", facecolor=FACE[house], edgecolor=INK, linewidth=1))
    axes.text(left + width / 2, top - 0.28, f"{house}/", ha="center", fontsize=11.5, fontweight="bold", color=INK)
    axes.text(left + width / 2, top - 0.58, "may use " + LIBRARIES[house], ha="center", fontsize=7.2, color=INK)
    place, step = {}, (top - 1.5) / max(1, len(rows) - 1) if len(rows) > 1 else 0
    for k, row in enumerate(rows):
        for i, room in enumerate(row):
            across = ACROSS.get(house, {}).get(room, (i + 1) / (len(row) + 1))
            place[room] = (left + width * across, top - 1.15 - k * min(step, 0.98))
    for room in graph:
        for other in direct(graph, room):
            mutual = room in reachable(graph, other)
            (x0, y0), (x1, y1) = place[other], place[room]
            axes.annotate("", xy=(x1, y1 + 0.19), xytext=(x0, y0 - 0.19), arrowprops=dict(
                arrowstyle="-|>", color="#b03030" if mutual else INK, linewidth=1, linestyle="--" if mutual else "-",
                connectionstyle=f"arc3,rad={0.25 if y0 == y1 else 0}"))
    for room, (x, y) in place.items():
        half = 0.055 * max(len(room), 6) + 0.08
        axes.add_patch(FancyBboxPatch((x - half, y - 0.19), 2 * half, 0.38, boxstyle="round,pad=0,rounding_size=0.06", facecolor="white", edgecolor=INK,
                                      linewidth=0.8))
        axes.text(x, y, room, ha="center", va="center", fontsize=8.8, color=INK)
    mains = sorted(p.stem.replace("_", "-") for p in (root / house).glob("palpate_*.cpp"))
    if mains:
        axes.text(left + width / 2, 0.2, "mains:\n" + "\n".join(mains), ha="center", va="bottom", fontsize=7.6, color=INK, linespacing=1.3)


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("repository", type=pathlib.Path)
    parser.add_argument("-o", required=True)
    arguments = parser.parse_args()
    figure, axes = plt.subplots(figsize=(12.6, 6.2))
    axes.axis("off")
    top, left, widths = 6.6, 0.0, {"meshing": 2.7, "precompute": 3.6, "runtime": 4.2, "programs": 2.7}
    edges = {}
    for house in HOUSES:
        draw_house(axes, arguments.repository, house, left, widths[house], top)
        edges[house] = (left, left + widths[house])
        left += widths[house] + 1.0
    for start, end, file in (("meshing", "precompute", "mesh.msh"), ("precompute", "runtime", "bundle.h5"), ("runtime", "programs", "palpate.h")):
        x0, x1 = edges[start][1], edges[end][0]
        axes.annotate("", xy=(x1, top / 2), xytext=(x0, top / 2), arrowprops=dict(arrowstyle="-|>", color=INK, linewidth=2, shrinkA=0, shrinkB=0))
        axes.text((x0 + x1) / 2, top / 2 + 0.18, file, ha="center", fontsize=7.8, color=INK)
    whole = edges["programs"][1]
    axes.add_patch(FancyBboxPatch((0, -0.95), whole, 0.6, boxstyle="round,pad=0,rounding_size=0.1", facecolor="#eeeeee", edgecolor=INK, linewidth=1))
    axes.text(whole / 2, -0.65, "formats/   files on disk, configuration, errors: every house may use it (runtime: the bundle's layout and reader only); it uses none",
              ha="center", va="center", fontsize=9, color=INK)
    axes.set_xlim(-0.1, whole + 0.1)
    axes.set_ylim(-1.05, top + 0.1)
    figure.savefig(arguments.o, dpi=110, bbox_inches="tight", facecolor="white")


main()
