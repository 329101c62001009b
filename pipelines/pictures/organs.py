#!/usr/bin/env python3
"""organs.py BUNDLE ... -o PNG: several bundles of one image together, each in a colour of its own, from the front and from behind."""
import h5py
import numpy as np

import mesh
import offscreen
import picture_file
from picture_file import plt


def read(bundle):
    """(name of its tissues, nodes in mm, triangles, frame)"""
    with h5py.File(bundle, "r") as file:
        return (", ".join(mesh.names_of_regions(file)), file["mesh/nodes"][:] / offscreen.MILLIMETRE, file["mesh/triangles"][:],
                file.attrs.get("frame", "none"))


def main():
    arguments = picture_file.arguments(__doc__, "bundle", nargs="+")
    organs = [read(bundle) for bundle in arguments.bundle]
    frames = sorted({frame for *_, frame in organs})
    if len(frames) > 1:
        raise SystemExit("organs.py: expected bundles of one frame, found %s" % ", ".join(frames))
    nodes = np.vstack([own for _, own, _, _ in organs])
    colours = [mesh.OUTSIDE[i % len(mesh.OUTSIDE)] for i in range(len(organs))]
    actors = [mesh.triangles_actor(own, triangles, colour) for (_, own, triangles, _), colour in zip(organs, colours)]

    first = np.cumsum([0] + [len(own) for _, own, _, _ in organs])
    all_triangles = np.vstack([triangles + begin for (_, _, triangles, _), begin in zip(organs, first)])
    part = np.repeat(np.arange(len(organs)), [len(triangles) for _, _, triangles, _ in organs])
    sides = list(zip((mesh.FRONT, mesh.BEHIND), mesh.SIDES.get(frames[0], mesh.SIDES["none"])))
    sides.append((mesh.view_of_all(nodes, all_triangles, part), "where all organs are seen"))
    figure, panels = plt.subplots(1, len(sides), figsize=(7.5 * len(sides), 6.6))
    for panel, (look_from, title) in zip(panels, sides):
        mesh.show_side(panel, actors, look_from, title, nodes, frames[0], zoom=1.2)
    mesh.name_regions(figure, [name for name, *_ in organs], colours)
    figure.subplots_adjust(left=0.005, right=0.995, bottom=0.07, top=0.94, wspace=0.01)
    picture_file.save(figure, arguments.output)


if __name__ == "__main__":
    main()
