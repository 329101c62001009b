#!/usr/bin/env python3
"""dataflow.py -o FILE.png: the files, the programs and the two loops of Palpate, in the order in which data passes through them."""
import argparse

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt  # noqa: E402
from matplotlib.patches import FancyBboxPatch  # noqa: E402

FILE, PROGRAM, LOOP, HOST = "#e6eef5", "#0b6fa4", "#2f7d4f", "#f4e6d4"
INK = "#1c2530"


def box(axes, x, y, width, height, title, detail="", face=FILE, ink=INK):
    axes.add_patch(FancyBboxPatch((x - width / 2, y - height / 2), width, height, boxstyle="round,pad=0,rounding_size=0.08",
                                  facecolor=face, edgecolor=INK, linewidth=0.8))
    axes.text(x, y + (0.16 if detail else 0), title, ha="center", va="center", color=ink, fontsize=10, fontweight="bold")
    if detail:
        axes.text(x, y - 0.18, detail, ha="center", va="center", color=ink, fontsize=7.8, linespacing=1.15)


def arrow(axes, start, end, words="", offset=(0, 0.12), dashed=False):
    axes.annotate("", xy=end, xytext=start, arrowprops=dict(arrowstyle="-|>", color=INK, linewidth=1.2, shrinkA=0, shrinkB=0,
                                                            linestyle="--" if dashed else "-"))
    if words:
        axes.text((start[0] + end[0]) / 2 + offset[0], (start[1] + end[1]) / 2 + offset[1], words, ha="center", va="center",
                  fontsize=7.8, color=INK, linespacing=1.15)


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("-o", required=True)
    output = parser.parse_args().o
    figure, axes = plt.subplots(figsize=(11, 5.6))
    axes.set_xlim(0, 13.2)
    axes.set_ylim(-0.1, 6.7)
    axes.axis("off")

    axes.text(0.1, 6.45, "Offline: once for each organ and each set of supports", fontsize=10.5, color=INK)
    files = [(1.1, "label image", "voxels with labels\nNRRD, NIfTI, INR ..."), (4.6, "surface.ply", "closed triangles"),
             (8.1, "mesh.msh", "tetrahedra, regions"), (11.9, "bundle.h5", "$T^u$, $T^f$ of every\ntouchable node")]
    for x, title, detail in files:
        box(axes, x, 5.6, 1.9, 0.95, title, detail)
    for x, name, room in ((2.85, "palpate-\nsurface", "meshing/"), (6.35, "palpate-\ntetrahedra", "meshing/"), (10.0, "palpate-\nprecompute", "precompute/")):
        axes.text(x, 5.82, name, ha="center", va="bottom", fontsize=8, color=PROGRAM, fontweight="bold", linespacing=1.0)
        axes.text(x, 5.38, room, ha="center", va="top", fontsize=7.8, color=PROGRAM)
    for x0, x1 in ((2.05, 3.65), (5.55, 7.15), (9.05, 10.95)):
        arrow(axes, (x0, 5.6), (x1, 5.6))
    box(axes, 7.6, 4.15, 4.5, 0.85, "organ.toml, boundary/*.toml", "material, element; what is held, what is touchable")
    arrow(axes, (9.3, 4.58), (9.9, 5.13))
    axes.plot([0.1, 13.1], [3.55, 3.55], color="#9aa7b4", linewidth=0.8, linestyle=":")

    axes.text(0.1, 3.25, "At run time: in your program, linked with the library in runtime/", fontsize=10.5, color=INK)
    box(axes, 11.9, 2.35, 1.9, 0.9, "scene", "effects, plan,\nall the memory")
    arrow(axes, (11.9, 5.12), (11.9, 2.8), "mapped,\nread only", (-0.55, -0.75))
    box(axes, 1.1, 1.55, 1.9, 0.95, "haptic device", "tool positions, force", HOST)
    box(axes, 4.6, 1.55, 2.1, 0.95, "touch", "collision, contacts,\nforce: 1 kHz", LOOP, "white")
    box(axes, 8.1, 1.55, 2.1, 0.95, "shape", "deformed nodes:\n60 Hz", LOOP, "white")
    box(axes, 8.1, 0.35, 2.1, 0.7, "renderer", "", HOST)
    arrow(axes, (2.05, 1.75), (3.55, 1.75), "tools")
    arrow(axes, (3.55, 1.35), (2.05, 1.35), "force, N", (0, -0.15))
    arrow(axes, (5.65, 1.55), (7.05, 1.55), "contacts\n(mailbox)", (0, 0.27))
    arrow(axes, (8.1, 1.07), (8.1, 0.7), "positions", (0.55, 0))
    axes.plot([4.6, 4.6, 10.95], [2.03, 2.45, 2.45], color=INK, linewidth=0.9, linestyle="--")
    axes.plot([8.1, 8.1], [2.03, 2.45], color=INK, linewidth=0.9, linestyle="--")
    axes.text(6.35, 2.62, "each loop uses its own half of the scene", ha="center", fontsize=7.8, color=INK)
    figure.savefig(output, dpi=110, bbox_inches="tight", facecolor="white")


main()
