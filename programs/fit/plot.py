#!/usr/bin/env python3
"""plot.py FIT.json -o FIT.svg: draws what palpate-fit found: measured against fitted forces, the modulus of each place, and the residual
against a fitted Poisson's ratio or ratio of moduli. The output's ending chooses the format (.svg, .png, .pdf)."""
import argparse
import json
import os

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt  # noqa: E402

matplotlib.rcParams.update({"svg.fonttype": "none", "svg.hashsalt": "palpate-fit", "axes.spines.top": False, "axes.spines.right": False})
ALL, BAND = "#2166ac", "#d1e5f0"  # the fit of all rows, its 95 % interval


def scaled(values, unit, prefixes=((1e9, "G"), (1e6, "M"), (1e3, "k"), (1, ""), (1e-3, "m"))):
    """A factor and a unit in which the largest value is at least 1."""
    factor, prefix = next((p for p in prefixes if max(map(abs, values)) >= p[0]), prefixes[-1])
    return 1 / factor, prefix + unit


def draw_forces(axes, fit):
    rows = fit["forces"]
    by, unit = scaled([row["measured_N"] for row in rows], "N")
    for place in range(len(fit["places"])):
        of_place = [row for row in rows if row["place"] == place]
        axes.plot([by * row["fitted_N"] for row in of_place], [by * row["measured_N"] for row in of_place], "o", alpha=0.75, markersize=5)
    axes.axline((0, 0), slope=1, color="#888888", linestyle="--", linewidth=1)
    axes.set(title="Forces, one colour a place", xlabel=f"fitted force, {unit}", ylabel=f"measured force, {unit}")


def draw_places(axes, fit):
    region = fit["regions"][0]
    values = [place["young_Pa"] for place in fit["places"]]
    young = region["young_Pa"]
    by, unit = scaled([young["value"]], "Pa")
    if young["low"] is not None:
        axes.axhspan(by * young["low"], by * young["high"], color=BAND)
    axes.axhline(by * young["value"], color=ALL)
    for place, value in enumerate(values):
        axes.plot([place + 1], [by * value], "o", alpha=0.75, markersize=5)
    axes.xaxis.get_major_locator().set_params(integer=True)
    axes.set(title="Each place on its own; blue: all, 95 %", xlabel="place, in the order of the file",
             ylabel=f"Young's modulus of {region['name']}, {unit}")


def draw_parameter(axes, parameter):
    fitted = parameter["fitted"]
    if fitted["low"] is not None:
        axes.axvspan(fitted["low"], fitted["high"], color=BAND)
    for value in parameter["of_bundles"]:
        axes.axvline(value, color="#bbbbbb", linestyle="--", linewidth=1)
    axes.plot([at["value"] for at in parameter["profile"]], [1e3 * at["residual_N"] for at in parameter["profile"]], color="black")
    axes.axvline(fitted["value"], color=ALL)
    axes.set(title="Residual; dashed: the bundles", xlabel=parameter["meaning"], ylabel="root mean square residual, mN")


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("fit", help="the JSON of palpate-fit --json")
    parser.add_argument("-o", "--output", required=True)
    arguments = parser.parse_args()
    with open(arguments.fit) as stream:
        fit = json.load(stream)
    panels = 3 if "parameter" in fit else 2
    figure, axes = plt.subplots(1, panels, figsize=(4.4 * panels, 4), layout="constrained")
    draw_forces(axes[0], fit)
    draw_places(axes[1], fit)
    if panels == 3:
        draw_parameter(axes[2], fit["parameter"])
    kind = os.path.splitext(arguments.output)[1].lstrip(".")
    figure.savefig(arguments.output + ".part", format=kind, metadata={"Date": None} if kind == "svg" else None)
    os.replace(arguments.output + ".part", arguments.output)


if __name__ == "__main__":
    main()
