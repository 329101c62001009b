#!/usr/bin/env python3
"""plot_costs.py BENCH.json [BENCH.json ...] -o PNG: what touch and shape cost against contact nodes and against mesh size.

Each file is runtime_bench's own (--benchmark_out) for one bundle. Processor time; for shape the median."""
import argparse
import json

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt  # noqa: E402

CURVES = (("touch_held", "touch, the same nodes", "o-"), ("touch_changing", "touch, other nodes in every tick", "s-"),
          ("shape_against_read", "shape, other nodes in every frame", "^-"))


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
        for nodes, dash in ((4, "-"), (30, "--")):
            sizes.plot([v for _, v in bundles], [costs[name][nodes] for costs, _ in bundles], style[0] + dash,
                       color=line.get_color(), label=f"{label.split(',')[0]}, {label.split(', ')[1].split(' in ')[0]}, {nodes}")
    contacts.set_xlabel(f"contact nodes ({largest[1]:,} vertices)")
    contacts.set_ylabel("microseconds")
    sizes.set_xlabel("vertices of the mesh (4 and 30 contact nodes)")
    for panel in (contacts, sizes):
        panel.set_xscale("log")
        panel.set_yscale("log")
        panel.grid(True, which="both", alpha=0.25)
        panel.legend(fontsize=8)
    figure.tight_layout()
    figure.savefig(arguments.output, dpi=110)


if __name__ == "__main__":
    main()
