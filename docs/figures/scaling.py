#!/usr/bin/env python3
"""scaling.py BIN -o FILE.png: time and memory of palpate-precompute from 149 to 10^6 vertices: measured on the liver, and predicted by
palpate-precompute --plan --vertices for one rank of a machine as fast as this one."""
import argparse
import json
import subprocess

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt  # noqa: E402

# Vertices: s by the clock, GB at the peak; one rank, boundary set right-side (docs/scaling.md). The last one: two ranks, abdomen, packed.
MEASURED = {
    "p1": {149: (0.03, 0.060), 563: (0.2, 0.062), 1696: (0.16, 0.075), 5287: (0.99, 0.124), 10479: (4.5, 0.216), 19656: (18.5, 0.428)},
    "p1-anp": {149: (0.11, 0.061), 563: (0.08, 0.067), 1696: (0.33, 0.096), 5287: (3.3, 0.222), 10479: (10.1, 0.448),
               19656: (31.3, 0.919), 98373: (1920, 12.5)},
}
SIZES = [150, 500, 1700, 5000, 20000, 100000, 300000, 1000000]
SOLVERS = {"factor": "-", "factor in single precision": "--", "multigrid": ":"}
COLOURS = {"p1": "#0b6fa4", "p1-anp": "#c2410c", "p2-p0": "#4d7c0f"}


def plan(program, vertices, element):
    command = [program, "--plan", "--vertices", str(vertices), "--element", element, "--ranks", "1", "--memory-per-node", "1e6", "--json", "-"]
    answer = json.loads(subprocess.run(command, check=True, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL).stdout)
    return {s["solver"]: s for s in answer["solvers"]}


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("bin")
    parser.add_argument("-o", "--output", required=True)
    options = parser.parse_args()
    figure, axes = plt.subplots(1, 2, figsize=(11, 4.6))
    for element, colour in COLOURS.items():
        plans = [plan(f"{options.bin}/palpate-precompute", v, element) for v in SIZES]
        for solver, style in SOLVERS.items():
            for axis, of in zip(axes, (lambda s: s["seconds"], lambda s: 1e-9 * s["machine_bytes"])):
                axis.plot(SIZES, [of(p[solver]) for p in plans], style, color=colour, linewidth=1.3)
        for vertices, figures in MEASURED.get(element, {}).items():
            for axis, figure_of in zip(axes, figures):
                axis.plot([vertices], [figure_of], "o", color=colour, markersize=5)
    axes[0].set_title("time, one rank")
    axes[1].set_title("memory, one rank")
    for value, name in ((60, "minute"), (3600, "hour"), (86400, "day"), (31.5e6, "year")):
        axes[0].axhline(value, color="#9aa3ad", linewidth=0.6)
        axes[0].text(130, 1.15 * value, name, color="#5b6570", fontsize=8)
    for value in (24, 256):
        axes[1].axhline(value, color="#9aa3ad", linewidth=0.6)
        axes[1].text(130, 1.15 * value, f"{value} GB", color="#5b6570", fontsize=8)
    axes[0].set_ylabel("s")
    axes[1].set_ylabel("GB")
    for axis in axes:
        axis.set_xscale("log")
        axis.set_yscale("log")
        axis.set_xlabel("vertices of the mesh")
        axis.axvspan(98373, 1.15e6, color="#f1f3f5", zorder=0)
        axis.grid(True, which="major", color="#e5e8eb", linewidth=0.5)
    lines = [plt.Line2D([], [], color=c, label=e) for e, c in COLOURS.items()]
    lines += [plt.Line2D([], [], color="#333", linestyle=s, label=n) for n, s in SOLVERS.items()]
    lines += [plt.Line2D([], [], color="#333", marker="o", linestyle="", label="measured")]
    axes[0].legend(handles=lines, fontsize=8, loc="lower right")
    figure.tight_layout()
    figure.savefig(options.output, dpi=120)


if __name__ == "__main__":
    main()
