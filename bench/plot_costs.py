#!/usr/bin/env python3
"""plot_costs.py BENCH.json [BENCH.json ...] -o PNG: the time of touch and of shape against the number of contact nodes and the mesh size.

Each file is the output of runtime_bench (--benchmark_out) for one bundle. Processor time of one core; for shape the median."""
import argparse
import json

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt  # noqa: E402

CURVES = (("touch_held", "touch, same nodes as in the last tick", "o-"), ("touch_changing", "touch, new nodes in every tick", "s-"),
          ("shape_against_read", "shape, new nodes in every frame", "^-"))
SIZES = ((4, "-"), (30, "--"))  # contact nodes of the right panel, and their line


def read(file):
    """({curve: {contact nodes: microseconds}}, vertices) of one bundle."""
    with open(file) as stream:
        report = json.load(stream)
    costs = {name: {} for name, _, _ in CURVES}
    for run in report["benchmarks"]:
        parts = run["name"].split("/")
        if parts[0] in costs:
            costs[parts[0]][int(parts[1])] = run.get("median_us", run["cpu_time"])
    return costs, int(report["context"]["vertices"])


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("bench", nargs="+")
    parser.add_argument("-o", "--output", required=True)
    arguments = parser.parse_args()
    bundles = sorted((read(file) for file in arguments.bench), key=lambda bundle: bundle[1])
    figure, (contacts, sizes) = plt.subplots(1, 2, figsize=(13, 5.4), sharey=True)
    largest = bundles[-1]
    for name, label, style in CURVES:
        at = sorted(largest[0][name].items())
        line, = contacts.plot([n for n, _ in at], [t for _, t in at], style, label=label)
        for nodes, dash in SIZES:
            sizes.plot([v for _, v in bundles], [costs[name][nodes] for costs, _ in bundles], style[0] + dash,
                       color=line.get_color(), label=f"{label}: {nodes} nodes")
    contacts.set_title(f"Time of one step against the number of contact nodes, {largest[1]:,} vertices", loc="left", fontsize=11)
    contacts.set_xlabel("contact nodes")
    contacts.set_ylabel("processor time of one core, microseconds")
    sizes.set_title("Time of one step against the size of the mesh", loc="left", fontsize=11)
    sizes.set_xlabel("vertices of the mesh")
    for panel in (contacts, sizes):
        panel.set_xscale("log")
        panel.set_yscale("log")
        panel.axhline(1000, color="#475569", linewidth=1, linestyle=":")
        panel.annotate("1 ms: a haptic loop of 1 kHz", (0.99, 1000), xycoords=("axes fraction", "data"), xytext=(0, 3), ha="right",
                       textcoords="offset points", fontsize=8, color="#475569")
        panel.grid(True, which="both", alpha=0.25)
        panel.legend(fontsize=8, loc="upper left" if panel is contacts else "lower right")
    figure.text(0.01, 0.005, "Node contacts held by grips, collision off, sticking, store in f32. The step stays below 1 ms wherever a curve is below the dotted line.",
                fontsize=9)
    figure.tight_layout(rect=(0, 0.03, 1, 1))
    figure.savefig(arguments.output, dpi=90)


if __name__ == "__main__":
    main()
