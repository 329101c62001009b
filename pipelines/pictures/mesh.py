#!/usr/bin/env python3
"""mesh.py BUNDLE -o PNG: the organ's surface, and a cut that shows its tetrahedra."""
import h5py
import numpy as np

import offscreen
import picture_file
from picture_file import plt

TISSUE, EDGE, HELD, STRIPES = (0.82, 0.45, 0.38), (0.35, 0.18, 0.15), (0.05, 0.42, 0.95), (0.02, 0.12, 0.35)
SOFT, STIFF = (0.88, 0.90, 0.92), (0.22, 0.28, 0.36)  # soft supports, by their stiffness
INSIDE = (0.98, 0.87, 0.72)  # of an organ of one tissue
# Of the surface of each region, in the bundle's order, where there are several; from the ninth on again. Inside they are paler.
OUTSIDE = (TISSUE, (0.55, 0.68, 0.36), (0.66, 0.48, 0.74), (0.93, 0.74, 0.30), (0.36, 0.66, 0.64), (0.88, 0.60, 0.70),
           (0.62, 0.55, 0.34), (0.80, 0.52, 0.26))
# What is seen from the side of small y, and from that of large y, in each frame.
SIDES = {"LPS": ("from the front", "from behind"), "RAS": ("from behind", "from the front"),
         "none": ("from small y", "from large y")}
# From the front or from behind, a little from the patient's right and above (LPS axes).
FRONT, BEHIND = (-0.35, -1.0, 0.30), (-0.35, 1.0, 0.50)


def boundary_faces(tetrahedra):
    """Faces of exactly one tetrahedron, pointing outward, [n, 3] node indices."""
    faces = tetrahedra[:, [[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]]].reshape(-1, 3)
    _, first, count = np.unique(np.sort(faces, axis=1), axis=0, return_index=True, return_counts=True)
    return faces[np.sort(first[count == 1])]


def region_of_triangles(triangles, tetrahedra, region):
    """The region of the element behind each triangle of the outer surface, [F]."""
    faces = np.sort(tetrahedra[:, [[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]]].reshape(-1, 3), axis=1)
    own = np.sort(triangles, axis=1)
    owners = dict(zip(map(tuple, faces), np.repeat(region, 4)))  # an outer face has one element
    return np.array([owners[tuple(face)] for face in own])


def colours_of_regions(names):
    """(outside, inside), a colour for each region. One region alone, and its inside, have the colours of tissue."""
    if len(names) == 1:
        return [TISSUE], [INSIDE]
    outside = [OUTSIDE[r % len(OUTSIDE)] for r in range(len(names))]
    return outside, [tuple(0.5 + 0.5 * part for part in colour) for colour in outside]


def name_regions(figure, names, colours):
    """The names in their colours, darkened so that they are read on white, in one line at the lower edge."""
    middle = (np.arange(len(names)) + 0.5) / len(names)
    for at, name, colour in zip(0.15 + 0.7 * middle, names, colours):
        figure.text(at, 0.02, "\u25a0 " + name, ha="center", fontsize=16, color=tuple(0.8 * part for part in colour))


def surface_actors(nodes, triangles, region, colours):
    return [triangles_actor(nodes, triangles[region == r], colours[r]) for r in np.unique(region)]


def view_of_all(nodes, triangles, parts):
    """Of cameras around the organ, above, level and below, the one that shows the part that is shown least as well as possible: of each
    part (a number for each triangle) the share of the pixels that it covers where it is seen best."""
    cameras = [np.array([np.sin(turn), -np.cos(turn), height]) for height in (0.38, 0, -0.6, -1.2)
               for turn in np.radians(range(-20, 340, 45))]
    numbers = np.unique(parts)
    shades = {part: (0.2 + 0.6 * i / len(numbers)) for i, part in enumerate(numbers)}  # grey, without light
    actors = []
    for part in numbers:
        actors.append(offscreen.plain_actor(offscreen.poly_data(nodes, triangles[parts == part]), (shades[part],) * 3))
        actors[-1].GetProperty().LightingOff()
    seen = []
    for camera in cameras:
        image, _ = offscreen.render(actors, camera, size=(120, 90), bounds=offscreen.bounds_of(nodes))
        seen.append([(np.abs(image[..., 0] / 255 - shades[part]) < 0.2 / len(numbers)).sum() for part in numbers])
    seen = np.array(seen) / np.maximum(np.max(seen, axis=0), 1)
    return tuple(cameras[np.argmax(seen.min(axis=1))])


def triangles_actor(nodes, triangles, colour):
    return offscreen.plain_actor(offscreen.poly_data(nodes, triangles), colour, edges=EDGE)


def held_actors(nodes, triangles):
    """The held part: blue and striped."""
    data = offscreen.poly_data(nodes, triangles)
    return [offscreen.plain_actor(data, HELD, edges=EDGE), offscreen.hatch(data, np.linalg.norm(np.ptp(nodes, axis=0)), STRIPES)]


def cut_actors(nodes, tetrahedra, region, outer, outside, inside):
    """The whole tetrahedra behind a plane across y, inside in the colour of their region; faces of the outer surface keep its
    colour."""
    cut_at = nodes[:, 1].min() + 0.38 * np.ptp(nodes[:, 1])
    shown = nodes[tetrahedra].mean(axis=1)[:, 1] > cut_at
    outer_keys = {tuple(face) for face in np.sort(outer, axis=1)}
    actors = []
    for r in np.unique(region[shown]):
        faces = boundary_faces(tetrahedra[shown & (region == r)])
        is_outer = np.array([tuple(face) in outer_keys for face in np.sort(faces, axis=1)])
        actors += [triangles_actor(nodes, faces[which], colours[r]) for which, colours in ((is_outer, outside), (~is_outer, inside))
                   if which.any()]
    return actors


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


def names_of_regions(file):
    return [name for name in file["material/names"].asstr()[()].split("\n") if name]


def show_side(panel, actors, look_from, title, nodes, frame, zoom, fontsize=15):
    """One view of the whole body, with its letters and its scale. nodes: mm."""
    image, pixel = offscreen.render(actors, look_from, size=(900, 700), zoom=zoom, bounds=offscreen.bounds_of(nodes))
    panel.imshow(image)
    panel.set_title(title, fontsize=fontsize)
    panel.axis("off")
    offscreen.draw_scale(panel, image, pixel, nodes.mean(axis=0), look_from, np.linalg.norm(np.ptp(nodes, axis=0)), frame)


def main():
    arguments = picture_file.arguments(__doc__, "bundle")
    with h5py.File(arguments.bundle, "r") as file:
        nodes, tetrahedra = file["mesh/nodes"][:] / offscreen.MILLIMETRE, file["mesh/tetrahedra"][:]
        region, frame = file["mesh/region"][:], file.attrs.get("frame", "none")
        names = names_of_regions(file)
        triangles, fixed = file["mesh/triangles"][:], file["boundary/fixed"][:].all(axis=1)
        stiffness = file["boundary/foundation"][:].max(axis=1) if "boundary/foundation" in file else np.zeros(len(triangles))
    held = fixed[triangles].all(axis=1)
    stiffness[held] = 0
    if len(names) > 1:  # the surface shows the regions; boundary.py shows the supports
        stiffness[:] = 0
    free = ~held & (stiffness == 0)
    outside, inside = colours_of_regions(names)
    of_triangle = region_of_triangles(triangles, tetrahedra, region)
    whole = surface_actors(nodes, triangles[free], of_triangle[free], outside) \
        + (held_actors(nodes, triangles[held]) if held.any() else []) + support_actors(nodes, triangles, stiffness)
    cut = cut_actors(nodes, tetrahedra, region, triangles, outside, inside)

    figure, panels = plt.subplots(1, 2, figsize=(15, 6.2))
    side = side_that_shows(nodes, triangles, ~free) if len(names) == 1 else view_of_all(nodes, triangles, of_triangle)
    seen = " from behind" if side is BEHIND else ""
    shown = [] if stiffness.any() and not held.any() else ["held part striped"]
    if stiffness.any():
        shown.append("soft supports grey, stiffer ones darker")
    titles = ("surface%s: %s triangles; %s" % (seen, format(len(triangles), ","), ", ".join(shown)),
              "cut: %s tetrahedra, %s nodes" % (format(len(tetrahedra), ","), format(len(nodes), ",")))
    for panel, actors, title, look_from in zip(panels, (whole, cut), titles, (side, FRONT)):
        show_side(panel, actors, look_from, title, nodes, frame, zoom=1.35, fontsize=14)
    if len(names) > 1:
        name_regions(figure, names, outside)
    figure.subplots_adjust(left=0.005, right=0.995, bottom=0.005 if len(names) == 1 else 0.07, top=0.93, wspace=0.01)
    picture_file.save(figure, arguments.output)


if __name__ == "__main__":
    main()
