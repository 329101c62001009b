#!/usr/bin/env python3
"""palpation.py CASE COMPARED_CASE --region NAME -o PNG: the stiffness felt in a row of presses, and the tumours that cause it.

Left: the organ with the region inside it and the places of the presses. Right: the force at one depth of each press, in
CASE and in COMPARED_CASE, and how many times as large it is.
"""
import argparse
import os
import sys

import h5py
import numpy as np

import offscreen
import picture_file
from picture_file import plt
from mesh import boundary_faces, triangles_actor

TISSUE, REGION, PRESS = (0.82, 0.45, 0.38), (0.35, 0.13, 0.40), (0.85, 0.10, 0.10)
REGION_HEX, PRESS_HEX = "#592166", "#d91a1a"
LOOK_FROM = (0.05, -1.0, 0.35)


def presses(scene, depth):
    """[(point of first contact mm [3], force N at this depth)] of the first tool's presses, in their order. A press lasts from
    its first contact to its deepest point; the force of a press that does not reach the depth is NaN."""
    rows = offscreen.read_csv(os.path.join(scene, "forces.csv"))
    rows = [row for row in rows if row["tool"] == rows[0]["tool"]]
    places = np.array([[float(row[axis + "_m"]) for axis in "xyz"] for row in rows]) / offscreen.MILLIMETRE
    forces = np.array([np.linalg.norm(offscreen.vector(row, "force", "N")) for row in rows])
    touching = np.array([int(row["contacts"]) > 0 for row in rows])
    found = []
    for first in np.flatnonzero(touching[1:] & ~touching[:-1]) + 1:
        end = first + (np.argmin(touching[first:]) or len(rows) - first)
        travel = np.linalg.norm(places[first:end] - places[first - 1], axis=1)
        inward = slice(0, np.argmax(travel) + 1)
        found.append((places[first], np.interp(depth, travel[inward], forces[first:end][inward], right=np.nan)))
    return found


def organ_actors(bundle, region, places):
    with h5py.File(bundle, "r") as file:
        nodes, tetrahedra = file["mesh/nodes"][:] / offscreen.MILLIMETRE, file["mesh/tetrahedra"][:]
        triangles, of_region = file["mesh/triangles"][:], file["mesh/region"][:]
        names = file["material/names"][()].decode().splitlines()
    if region not in names:
        sys.exit("palpation.py: %s: expected a region called %s, found %s" % (bundle, region, ", ".join(names)))
    outside = triangles_actor(nodes, triangles, TISSUE)
    outside.GetProperty().SetOpacity(0.25)
    inside = triangles_actor(nodes, boundary_faces(tetrahedra[of_region == names.index(region)]), REGION)
    return [outside, inside] + [offscreen.sphere(place, 2.0, PRESS) for place in places], nodes


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("case")
    parser.add_argument("compared")
    parser.add_argument("--region", required=True)
    parser.add_argument("--scene", default="palpate")
    parser.add_argument("--depth", type=float, default=5, help="mm from the first contact; %(default)g")
    parser.add_argument("-o", "--output", required=True)
    arguments = parser.parse_args()
    scenes = [os.path.join(case, "scenes", arguments.scene) for case in (arguments.case, arguments.compared)]
    felt, compared = (presses(scene, arguments.depth) for scene in scenes)
    felt, compared = (felt, compared) if len(felt) == len(compared) else ([], [])  # other presses cannot be compared
    place = np.array([p for p, _ in felt]).reshape(-1, 3)
    force, other = np.array([f for _, f in felt]), np.array([f for _, f in compared])
    ratio = force / other
    if np.isfinite(ratio).any():
        peak = int(np.nanargmax(ratio))
        said = ("force at %g mm %.2f to %.2f times that of %s, most at x = %.0f mm"
                % (arguments.depth, np.nanmin(ratio), ratio[peak], arguments.compared, place[peak, 0]))
    else:
        peak, said = None, "no press of %g mm in both cases; choose a smaller --depth, or other paths" % arguments.depth
    print("%s: %s" % (arguments.case, said))

    figure, (left, right) = plt.subplots(1, 2, figsize=(15, 5.8), gridspec_kw=dict(width_ratios=(1.15, 1)))
    actors, nodes = organ_actors(os.path.join(arguments.case, "bundle.h5"), arguments.region, place)
    image, _ = offscreen.render(actors, LOOK_FROM, size=(1000, 760), zoom=1.4, bounds=offscreen.bounds_of(nodes), crop=15)
    left.imshow(image)
    left.axis("off")
    left.set_title("%s inside; red: where the finger presses" % arguments.region, fontsize=15)

    right.plot(place[:, 0], force, "o-", color=PRESS_HEX, linewidth=2.2, label="with %s" % arguments.region)
    right.plot(place[:, 0], other, "o--", color="0.45", linewidth=1.8, label="without, same mesh")
    right.set_ylim(bottom=0)
    right.set_xlabel("x of the press (mm)", fontsize=14)
    right.set_ylabel("force at %g mm of indentation (N)" % arguments.depth, fontsize=14)
    if peak is None:
        right.set_title(said, fontsize=12)
    else:
        times = right.twinx()
        times.plot(place[:, 0], ratio, color=REGION_HEX, linewidth=1.4)
        times.fill_between(place[:, 0], 1, ratio, color=REGION_HEX, alpha=0.15, linewidth=0)
        times.set_ylim(1, 1 + 2.2 * (ratio[peak] - 1))
        times.set_ylabel("times as large", fontsize=14, color=REGION_HEX)
        times.tick_params(labelsize=12, colors=REGION_HEX)
    right.tick_params(labelsize=12)
    right.legend(fontsize=13, frameon=False, loc="upper right")
    right.grid(color="0.92")
    figure.tight_layout()
    picture_file.save(figure, arguments.output, scenes)


if __name__ == "__main__":
    main()
