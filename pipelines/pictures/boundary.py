#!/usr/bin/env python3
"""boundary.py BUNDLE -o PNG: what may be touched, what is held and what is softly supported, from the front and from behind."""
import re

import h5py
import numpy as np

import mesh
import offscreen
import picture_file
from picture_file import plt
from mesh import BEHIND, FRONT, HELD, SIDES, STRIPES, TISSUE, triangles_actor

NEITHER, SUPPORTED, SPRING = (0.80, 0.80, 0.80), (0.72, 0.62, 0.66), (0.25, 0.35, 0.65)
PLACE = r"\(([^,()]+), ([^,()]+), ([^,()]+)\) mm"


def springs_of(attributes, nodes):
    """[(name, N/m, start, end)], mm. A spring to its nodes' own places has no direction: its coil points away from the middle."""
    springs, middle, size = [], nodes.mean(axis=0), np.linalg.norm(np.ptp(nodes, axis=0))
    for key in sorted(attributes):
        if not key.startswith("spring "):
            continue
        places = np.array(re.findall(PLACE, attributes[key].rsplit("; from", 1)[1]), float)
        end = places[1] if len(places) > 1 else places[0] + 0.12 * size * (places[0] - middle) / np.linalg.norm(places[0] - middle)
        springs.append((key.removeprefix("spring "), float(attributes[key].split()[0]), places[0], end))
    return springs


def areas_of(nodes, triangles):
    a, b, c = (nodes[triangles[:, i]] for i in range(3))
    return np.linalg.norm(np.cross(b - a, c - a), axis=1) / 2


def box_text(points):
    low, high = points.min(axis=0), points.max(axis=0)
    return ", ".join("%s %.0f .. %.0f" % (axis, low[d], high[d]) for d, axis in enumerate("xyz")) + " mm"


def main():
    arguments = picture_file.arguments(__doc__, "bundle")
    with h5py.File(arguments.bundle, "r") as file:
        nodes, triangles = file["mesh/nodes"][:] / offscreen.MILLIMETRE, file["mesh/triangles"][:]
        fixed, touchable = file["boundary/fixed"][:].any(axis=1), np.zeros(len(nodes), bool)
        touchable[file["tensors/nodes"][:]] = True
        tetrahedra, region = file["mesh/tetrahedra"][:], file["mesh/region"][:]
        names = mesh.names_of_regions(file)
        frame = file.attrs.get("frame", "none")
        springs = springs_of(file.attrs, nodes)
        soft = file["boundary/foundation"][:].any(axis=1) if "boundary/foundation" in file else np.zeros(len(triangles), bool)
    # A triangle with held and touchable nodes is shown as neither. What is softly supported may be touched as well.
    held = fixed[triangles].all(axis=1)
    touched = touchable[triangles].all(axis=1) & ~held
    soft &= ~held
    outside, _ = mesh.colours_of_regions(names)
    of_triangle = mesh.region_of_triangles(triangles, tetrahedra, region)
    groups = [(held, HELD), (~held & ~touched & ~soft, NEITHER)]
    for r, colour in enumerate(outside):
        supported_here = SUPPORTED if len(names) == 1 else tuple(0.5 * (np.array(colour) + SUPPORTED))
        groups += [(touched & ~soft & (of_triangle == r), colour), (soft & (of_triangle == r), supported_here)]
    actors = [triangles_actor(nodes, triangles[which], colour) for which, colour in groups if which.any()]
    size = np.linalg.norm(np.ptp(nodes, axis=0))
    if held.any():
        actors.append(offscreen.hatch(offscreen.poly_data(nodes, triangles[held]), size, STRIPES))
    actors += [offscreen.coil(start, end, size / 40, SPRING) for _, _, start, end in springs]

    sides = list(zip((FRONT, BEHIND), SIDES.get(frame, SIDES["none"])))
    if len(names) > 1:
        sides.append((mesh.view_of_all(nodes, triangles, of_triangle), "where all tissues are seen"))
    figure, panels = plt.subplots(1, len(sides), figsize=(7.5 * len(sides), 6.8))
    for panel, (look_from, title) in zip(panels, sides):
        mesh.show_side(panel, actors, look_from, title, nodes, frame, zoom=1.1)
    areas = areas_of(nodes, triangles)
    lines = []
    supported = np.zeros(len(nodes), bool)
    supported[triangles[soft]] = True
    dark = (0.3, 0.3, 0.3)
    for name, which, colour in (("touchable", touchable, TISSUE if len(names) == 1 else dark), ("held", fixed, HELD),
                                ("softly supported", supported, SUPPORTED)):
        share = (which[triangles].mean(axis=1) * areas).sum()  # a node has a third of each triangle around it
        if which.any():
            lines.append(("%s: %.0f mm2, %.0f %% of the surface; %s"
                          % (name, share, 100 * share / areas.sum(), box_text(nodes[which])), colour))
    if springs:
        lines.append(("springs: " + "; ".join("%s %.3g N/m" % (name, stiffness) for name, stiffness, _, _ in springs), SPRING))
    low = 0.03 if len(names) == 1 else 0.075
    if len(names) > 1:
        mesh.name_regions(figure, names, outside)
    for row, (text, colour) in enumerate(lines):
        figure.text(0.5, low + 0.04 * (len(lines) - 1 - row), text, ha="center", fontsize=15, color=tuple(0.75 * c for c in colour))
    figure.subplots_adjust(left=0.005, right=0.995, bottom=low + 0.01 + 0.04 * max(len(lines), 2), top=0.94, wspace=0.01)
    picture_file.save(figure, arguments.output)


if __name__ == "__main__":
    main()
