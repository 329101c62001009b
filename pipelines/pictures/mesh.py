#!/usr/bin/env python3
"""mesh.py BUNDLE -o PNG: the organ's surface, and a cut that shows its tetrahedra."""
import argparse

import h5py
import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt  # noqa: E402
import numpy as np  # noqa: E402

import offscreen  # noqa: E402
from offscreen import vtk  # noqa: E402

TISSUE, INSIDE, EDGE, HELD = (0.82, 0.45, 0.38), (0.98, 0.87, 0.72), (0.35, 0.18, 0.15), (0.35, 0.50, 0.78)
# From the front or from behind, a little from the patient's right and above (LPS axes).
FRONT, BEHIND = (-0.35, -1.0, 0.30), (-0.35, 1.0, 0.50)


def boundary_faces(tetrahedra):
    """Faces of exactly one tetrahedron, pointing outward, [n, 3] node indices."""
    faces = tetrahedra[:, [[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]]].reshape(-1, 3)
    _, first, count = np.unique(np.sort(faces, axis=1), axis=0, return_index=True, return_counts=True)
    return faces[np.sort(first[count == 1])]


def triangles_actor(nodes, triangles, colour):
    data = vtk.vtkPolyData()
    offscreen.set_points(data, nodes)
    cells = np.hstack([np.full((len(triangles), 1), 3), triangles]).astype(np.int64).ravel()
    array = vtk.vtkCellArray()
    array.ImportLegacyFormat(offscreen.numpy_to_vtk(cells, deep=1, array_type=vtk.VTK_ID_TYPE))
    data.SetPolys(array)
    return offscreen.plain_actor(data, colour, edges=EDGE)


def cut_actors(nodes, tetrahedra, outer):
    """The whole tetrahedra behind a plane across y; faces of the outer surface keep its colour."""
    cut_at = nodes[:, 1].min() + 0.38 * np.ptp(nodes[:, 1])
    behind = boundary_faces(tetrahedra[nodes[tetrahedra].mean(axis=1)[:, 1] > cut_at])
    outer_keys = {tuple(face) for face in np.sort(outer, axis=1)}
    is_outer = np.array([tuple(face) in outer_keys for face in np.sort(behind, axis=1)])
    return [triangles_actor(nodes, behind[is_outer], TISSUE), triangles_actor(nodes, behind[~is_outer], INSIDE)]


def side_that_shows(nodes, triangles, held):
    """FRONT, unless the held triangles face away from it."""
    a, b, c = (nodes[triangles[held][:, i]] for i in range(3))
    outward = np.cross(b - a, c - a).sum(axis=0)
    return BEHIND if outward @ np.array(FRONT) < 0 else FRONT


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("bundle")
    parser.add_argument("-o", "--output", required=True)
    arguments = parser.parse_args()
    with h5py.File(arguments.bundle, "r") as file:
        nodes, tetrahedra = file["mesh/nodes"][:] / offscreen.MILLIMETRE, file["mesh/tetrahedra"][:]
        triangles, fixed = file["mesh/triangles"][:], file["boundary/fixed"][:].all(axis=1)
    held = fixed[triangles].all(axis=1)
    whole = [triangles_actor(nodes, triangles[~held], TISSUE), triangles_actor(nodes, triangles[held], HELD)]
    cut = cut_actors(nodes, tetrahedra, triangles)

    figure, panels = plt.subplots(1, 2, figsize=(15, 6.2))
    side = side_that_shows(nodes, triangles, held)
    seen = " from behind" if side is BEHIND else ""
    titles = ("surface%s: %s triangles; held part in blue" % (seen, format(len(triangles), ",")),
              "cut: %s tetrahedra, %s nodes" % (format(len(tetrahedra), ","), format(len(nodes), ",")))
    for panel, actors, title, look_from in zip(panels, (whole, cut), titles, (side, FRONT)):
        image, _ = offscreen.render(actors, look_from, size=(900, 700), zoom=1.45, bounds=offscreen.bounds_of(nodes))
        panel.imshow(image)
        panel.set_title(title, fontsize=16)
        panel.axis("off")
    figure.subplots_adjust(left=0.005, right=0.995, bottom=0.005, top=0.93, wspace=0.01)
    offscreen.save(figure, arguments.output)


if __name__ == "__main__":
    main()
