#!/usr/bin/env python3
"""cylinder.py --case RATE FOLDER CURVE.csv ... [--relaxing RATE SCENE CURVE.csv ...] -o PNG: the simulated cylinder's force and mid-height radial displacement
over the measured curves. Exits with 3 when a simulated point is farther from its curve than the bound.

Bounds, as shares of the curve's largest value. Force, 0.1 %: the prism's section has the circle's area, so its linear force
is the round cylinder's to the 1e-9 of the solve and only the fit of Q (degree 8: 0.05 %) and the straight lines between the
curve's rows (f'' h^2 / 8: 0.013 %) are left. Radial, 0.5 %: the ring's nodes are corners of a polygon of 32 sides, 0.32 %
farther out than the circle, and P rises 1.3 times as fast there as on average.
"""
import argparse
import os
import sys

import numpy as np

import offscreen
import picture_file
from picture_file import plt

HEIGHT = 13.0  # mm
FORCE_BOUND, RADIAL_BOUND = 0.001, 0.005
COLOURS = ("#b2182b", "#2166ac", "#4d9221")


def read_curve(file):
    rows = offscreen.read_csv(file)
    return [np.array([float(row[name]) for row in rows]) for name in ("displacement_mm", "force_N", "radial_mm")]


def played_force(scene):
    """(compression mm, force N) at every touch."""
    rows = offscreen.read_csv(os.path.join(scene, "forces.csv"))
    height = np.array([float(row["z_m"]) for row in rows]) / offscreen.MILLIMETRE
    force = np.array([np.linalg.norm(offscreen.vector(row, "force", "N")) for row in rows])
    return height[0] - height, force


def played_radius(scene):
    """(compression mm, mean radial displacement mm of the ring of surface nodes at mid-height) at every frame."""
    compression, radial = [], []
    for _, organ_files, _ in offscreen.read_frames(scene):
        organ = offscreen.read_grids(organ_files)
        moved = offscreen.point_data(organ, "displacement") / offscreen.MILLIMETRE
        rest = offscreen.points_of(organ) - moved
        ring = np.abs(rest[:, 2] - HEIGHT / 2) < 1e-3
        outward = rest[ring, :2] / np.linalg.norm(rest[ring, :2], axis=1, keepdims=True)
        compression.append(-moved[np.argmax(rest[:, 2]), 2])
        radial.append((moved[ring, :2] * outward).sum(axis=1).mean())
    return np.array(compression), np.array(radial)


def worst_distance(played, curve_x, curve_y):
    """Largest distance from the curve, as a share of the curve's largest value."""
    x, y = played
    return np.abs(y - np.interp(x, curve_x, curve_y)).max() / curve_y.max()


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--case", nargs=3, action="append", required=True, metavar=("RATE", "FOLDER", "CURVE.csv"))
    parser.add_argument("--relaxing", nargs=3, action="append", default=[], metavar=("RATE", "SCENE", "CURVE.csv"))
    parser.add_argument("-o", "--output", required=True)
    arguments = parser.parse_args()
    figure, (force_panel, radial_panel) = plt.subplots(1, 2, figsize=(14, 5.6))
    worst_force = worst_radial = 0.0
    linear = os.path.join(arguments.case[0][1], "scenes", "compress-linear")
    scenes = [os.path.join(folder, "scenes", "compress") for _, folder, _ in arguments.case] + [linear]
    scenes += [scene for _, scene, _ in arguments.relaxing]
    for (rate, folder, curve), colour in zip(arguments.case, COLOURS):
        x, force, radial = read_curve(curve)
        played = played_force(os.path.join(folder, "scenes", "compress"))
        distance = worst_distance(played, x, force)
        force_panel.plot(x, force, color=colour, linewidth=7, alpha=0.3)
        force_panel.plot(*played, color=colour, linewidth=1.6, label="%s mm/min" % rate)
        swollen = played_radius(os.path.join(folder, "scenes", "compress"))
        radial_distance = worst_distance(swollen, x, radial)
        print("%s mm/min: force within %.3f %%, radial within %.3f %% of the measured curve's largest value"
              % (rate, 100 * distance, 100 * radial_distance))
        worst_force, worst_radial = max(worst_force, distance), max(worst_radial, radial_distance)
    for (rate, scene, curve), colour in zip(arguments.relaxing, COLOURS):
        x, force, _ = read_curve(curve)
        played = played_force(scene)
        distance = worst_distance(played, x, force)
        force_panel.plot(*(values[::max(1, len(values) // 12)] for values in played), "o", color=colour, markersize=6,
                         markerfacecolor="none", label="%s mm/min, relaxing" % rate)
        print("%s mm/min, relaxing: force within %.3f %% of the measured curve's largest value" % (rate, 100 * distance))
        worst_force = max(worst_force, distance)
    x, _, radial = read_curve(arguments.case[0][2])
    force_panel.plot(*played_force(linear), color="0.45", linestyle="--", linewidth=1.6, label="linear model")
    radial_panel.plot(x, radial, color=COLOURS[0], linewidth=7, alpha=0.3)
    radial_panel.plot(*played_radius(os.path.join(arguments.case[0][1], "scenes", "compress")), color=COLOURS[0],
                      linewidth=1.6)
    radial_panel.plot(*played_radius(linear), color="0.45", linestyle="--", linewidth=1.6)
    picture_file.finish_plot(force_panel, "compression (mm)", "force (N)")
    picture_file.finish_plot(radial_panel, "compression (mm)", "radial displacement at mid-height (mm)")
    force_panel.legend(fontsize=13, frameon=False, title="thin: simulated; wide: measured (model)", title_fontsize=13)
    figure.suptitle("Swine brain cylinder, 30 mm wide, 13 mm high: at most %.2f %% from Miller and Chinzei's curves "
                    "(their model of the measurements)" % (100 * max(worst_force, worst_radial)), fontsize=14)
    figure.tight_layout()
    if worst_force > FORCE_BOUND or worst_radial > RADIAL_BOUND:
        print("cylinder.py: expected force and radial displacement within %g %% and %g %% of the measured curves, found "
              "%.3f %% and %.3f %%" % (100 * FORCE_BOUND, 100 * RADIAL_BOUND, 100 * worst_force, 100 * worst_radial),
              file=sys.stderr)
        return 3
    picture_file.save(figure, arguments.output, scenes)
    return 0


if __name__ == "__main__":
    sys.exit(main())
