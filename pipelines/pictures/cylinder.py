#!/usr/bin/env python3
"""cylinder.py --case RATE FOLDER CURVE.csv ... -o PNG: the simulated cylinder's force and mid-height radial displacement
over the measured curves. Exits with 3 when a simulated point is farther from its curve than the bound.

Bound: 1 % of the curve's largest value. The corrected force is Q of the linear force of a prism whose section has the
circle's area, so only the fit of Q (degree 8) and the 1e-9 of the solve separate the two; the radial displacement is read
at the polygon's corners, 0.3 % (32 sides) farther out than the circle.
"""
import argparse
import csv
import os
import sys

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt  # noqa: E402
import numpy as np  # noqa: E402

import offscreen  # noqa: E402

HEIGHT = 13.0  # mm
BOUND = 0.01
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
    for _, organ_file, _ in offscreen.read_frames(scene):
        organ = offscreen.read_grid(organ_file)
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


def finish(panel, ylabel):
    panel.set_xlabel("compression (mm)", fontsize=15)
    panel.set_ylabel(ylabel, fontsize=15)
    panel.tick_params(labelsize=13)
    panel.set_xlim(left=0)
    panel.set_ylim(bottom=0)
    panel.grid(color="0.9")
    for side in ("top", "right"):
        panel.spines[side].set_visible(False)


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--case", nargs=3, action="append", required=True, metavar=("RATE", "FOLDER", "CURVE.csv"))
    parser.add_argument("-o", "--output", required=True)
    arguments = parser.parse_args()
    figure, (force_panel, radial_panel) = plt.subplots(1, 2, figsize=(14, 5.6))
    worst = 0.0
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
        worst = max(worst, distance, radial_distance)
    linear = os.path.join(arguments.case[0][1], "scenes", "compress-linear")
    force_panel.plot(*played_force(linear), color="0.45", linestyle="--", linewidth=1.6, label="linear model")
    radial_panel.plot(x, radial, color=COLOURS[0], linewidth=7, alpha=0.3)
    radial_panel.plot(*played_radius(os.path.join(arguments.case[0][1], "scenes", "compress")), color=COLOURS[0],
                      linewidth=1.6)
    radial_panel.plot(*played_radius(linear), color="0.45", linestyle="--", linewidth=1.6)
    finish(force_panel, "force (N)")
    finish(radial_panel, "radial displacement at mid-height (mm)")
    force_panel.legend(fontsize=13, frameon=False, title="thin: simulated; wide: measured", title_fontsize=13)
    figure.suptitle("Swine brain cylinder, 30 mm wide, 13 mm high (Miller and Chinzei 1997); at most %.2f %% from the curves"
                    % (100 * worst), fontsize=16)
    figure.tight_layout()
    offscreen.save(figure, arguments.output)
    if worst > BOUND:
        print("cylinder.py: expected every point within %g %% of the measured curve, found %.2f %%"
              % (100 * BOUND, 100 * worst), file=sys.stderr)
        os.remove(arguments.output)
        return 3
    return 0


if __name__ == "__main__":
    sys.exit(main())
