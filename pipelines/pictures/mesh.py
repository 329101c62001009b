#!/usr/bin/env python3
"""mesh.py BUNDLE -o PNG: the organ's surface, and a cut that shows its tetrahedra."""
import argparse

import h5py
import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt  # noqa: E402
import numpy as np  # noqa: E402

import offscreen  # noqa: E402
import picture_file  # noqa: E402
from offscreen import vtk  # noqa: E402

TISSUE, EDGE, HELD, STRIPES = (0.82, 0.45, 0.38), (0.35, 0.18, 0.15), (0.35, 0.50, 0.78), (0.12, 0.20, 0.42)
SOFT, STIFF = (0.88, 0.90, 0.92), (0.22, 0.28, 0.36)  # soft supports, by their stiffness
# Inside, of each region in the bundle's order; from the ninth on again.
INSIDE = ((0.98, 0.87, 0.72), (0.45, 0.68, 0.45), (0.75, 0.58, 0.80), (0.60, 0.80, 0.88), (0.95, 0.75, 0.45), (0.70, 0.70, 0.40),
          (0.88, 0.62, 0.62), (0.55, 0.60, 0.75))
# From the front or from behind, a little from the patient's right and above (LPS axes).
FRONT, BEHIND = (-0.35, -1.0, 0.30), (-0.35, 1.0, 0.50)


def boundary_faces(tetrahedra):
    """Faces of exactly one tetrahedron, pointing outward, [n, 3] node indices."""
    faces = tetrahedra[:, [[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]]].reshape(-1, 3)
    _, first, count = np.unique(np.sort(faces, axis=1), axis=0, return_index=True, return_counts=True)
    return faces[np.sort(first[count == 1])]


def triangles_data(nodes, triangles):
    data = vtk.vtkPolyData()
    offscreen.set_points(data, nodes)
    cells = np.hstack([np.full((len(triangles), 1), 3), triangles]).astype(np.int64).ravel()
    array = vtk.vtkCellArray()
    array.ImportLegacyFormat(offscreen.numpy_to_vtk(cells, deep=1, array_type=vtk.VTK_ID_TYPE))
    data.SetPolys(array)
    return data


def triangles_actor(nodes, triangles, colour):
    return offscreen.plain_actor(triangles_data(nodes, triangles), colour, edges=EDGE)


def held_actors(nodes, triangles):
    """The held part: blue and striped."""
    data = triangles_data(nodes, triangles)
    return [offscreen.plain_actor(data, HELD, edges=EDGE), offscreen.hatch(data, np.linalg.norm(np.ptp(nodes, axis=0)), STRIPES)]


def cut_actors(nodes, tetrahedra, region, outer):
    """The whole tetrahedra behind a plane across y, inside in the colour of their region; faces of the outer surface keep its
    colour."""
    cut_at = nodes[:, 1].min() + 0.38 * np.ptp(nodes[:, 1])
    shown = nodes[tetrahedra].mean(axis=1)[:, 1] > cut_at
    outer_keys = {tuple(face) for face in np.sort(outer, axis=1)}
    actors, on_surface = [], []
    for r in np.unique(region[shown]):
        faces = boundary_faces(tetrahedra[shown & (region == r)])
        is_outer = np.array([tuple(face) in outer_keys for face in np.sort(faces, axis=1)])
        on_surface.append(faces[is_outer])
        actors.append(triangles_actor(nodes, faces[~is_outer], INSIDE[r % len(INSIDE)]))
    return [triangles_actor(nodes, np.vstack(on_surface), TISSUE)] + actors


def support_actors(nodes, triangles, stiffness):
    """Triangles on elastic foundations: the softest pale, the stiffest dark, by the logarithm of the stiffness."""
    values = np.unique(stiffness[stiffness > 0])
    shades = np.log(values / values[0]) / max(np.log(values[-1] / values[0]), 1e-9) if len(values) else []
    return [triangles_actor(nodes, triangles[stiffness == value], tuple((1 - shade) * np.array(SOFT) + shade * np.array(STIFF)))
            for value, shade in zip(values, shades)]


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
        region, frame = file["mesh/region"][:], file.attrs.get("frame", "none")
        triangles, fixed = file["mesh/triangles"][:], file["boundary/fixed"][:].all(axis=1)
        stiffness = file["boundary/foundation"][:].max(axis=1) if "boundary/foundation" in file else np.zeros(len(triangles))
    held = fixed[triangles].all(axis=1)
    stiffness[held] = 0
    free = ~held & (stiffness == 0)
    whole = [triangles_actor(nodes, triangles[free], TISSUE)] + (held_actors(nodes, triangles[held]) if held.any() else []) \
        + support_actors(nodes, triangles, stiffness)
    cut = cut_actors(nodes, tetrahedra, region, triangles)

    figure, panels = plt.subplots(1, 2, figsize=(15, 6.2))
    side = side_that_shows(nodes, triangles, ~free)
    seen = " from behind" if side is BEHIND else ""
    shown = [] if stiffness.any() and not held.any() else ["held part striped"]
    if stiffness.any():
        shown.append("soft supports grey, stiffer ones darker")
    titles = ("surface%s: %s triangles; %s" % (seen, format(len(triangles), ","), ", ".join(shown)),
              "cut: %s tetrahedra, %s nodes" % (format(len(tetrahedra), ","), format(len(nodes), ",")))
    for panel, actors, title, look_from in zip(panels, (whole, cut), titles, (side, FRONT)):
        image, pixel = offscreen.render(actors, look_from, size=(900, 700), zoom=1.35, bounds=offscreen.bounds_of(nodes))
        panel.imshow(image)
        offscreen.draw_scale(panel, image, pixel, nodes.mean(axis=0), look_from, np.linalg.norm(np.ptp(nodes, axis=0)), frame)
        panel.set_title(title, fontsize=14)
        panel.axis("off")
    figure.subplots_adjust(left=0.005, right=0.995, bottom=0.005, top=0.93, wspace=0.01)
    picture_file.save(figure, arguments.output)


if __name__ == "__main__":
    main()
