#!/usr/bin/env python3
"""obstacle_edges.py PALPATE_PRECOMPUTE: how deep the edges of obstacles sink in between the nodes of a block of 60 x 50 x 20 mm with edges of 5 mm, which
is held below. Each obstacle is pressed by 2 mm into the top, its edge along y; on a row of nodes, and in the middle between two."""
import itertools
import pathlib
import subprocess
import sys
import tempfile

import numpy as np
import palpate

CELLS, EDGE, TOP, SINK, STEPS = (12, 10, 4), 5, 0.020, 0.002, 60
ROW, BETWEEN, MIDDLE = 0.025, 0.0275, 0.025  # m: x of a row of nodes, and between two; y of the middle
ORGAN = """name = "block"
mesh_unit = "mm"
frame = "none"
element = "p1-anp"
[[region]]
name = "block"
young = { value = 10, unit = "kPa", source = "an example" }
poisson = { value = 0.45, source = "an example" }
"""
BOUNDARY = """name = "below"
[[fixed]]
dofs = "xyz"
select = { box = { min = [-1, -1, -1], max = [61, 51, 0.1] } }
"""


def write_mesh(file):
    """MSH 2.2, six tetrahedra a cell."""
    index = lambda i, j, k: (i * (CELLS[1] + 1) + j) * (CELLS[2] + 1) + k
    points = np.array([p for p in itertools.product(*(range(n + 1) for n in CELLS))]) * EDGE
    tetrahedra = []
    for cell in itertools.product(*(range(n) for n in CELLS)):
        for order in itertools.permutations(range(3)):
            at, corners = list(cell), [index(*cell)]
            for axis in order:
                at[axis] += 1
                corners.append(index(*at))
            x = points[corners]
            tetrahedra.append(corners if np.linalg.det(x[1:] - x[0]) > 0 else [corners[0], corners[2], corners[1], corners[3]])
    lines = ["$MeshFormat", "2.2 0 8", "$EndMeshFormat", "$PhysicalNames", "1", '3 1 "block"', "$EndPhysicalNames", "$Nodes", str(len(points))]
    lines += ["%d %g %g %g" % (n + 1, *p) for n, p in enumerate(points)] + ["$EndNodes", "$Elements", str(len(tetrahedra))]
    lines += ["%d 4 2 1 1 %d %d %d %d" % (e + 1, *(n + 1 for n in t)) for e, t in enumerate(tetrahedra)] + ["$EndElements", ""]
    file.write_text("\n".join(lines))


def prism(profile, length=0.02):
    """A closed surface along y; profile: x, z of its corners, counter-clockwise as seen against y, the lowest at 0, 0."""
    n = len(profile)
    points = [(x, y, z) for y in (-length, length) for x, z in profile]
    sides = [t for i in range(n) for t in ([i, (i + 1) % n, n + i], [(i + 1) % n, n + (i + 1) % n, n + i])]
    ends = [t for i in range(1, n - 1) for t in ([0, i + 1, i], [n, n + i, n + i + 1])]
    return np.array(points, np.float32), np.array(sides + ends, np.int32)


def ridge(degrees, height=0.02):
    half = height * np.tan(np.radians(degrees / 2))
    return prism([(0, 0), (-half, height), (half, height)])


def rib(radius, corners=48):
    return prism([(-radius * np.sin(a), radius - radius * np.cos(a)) for a in 2 * np.pi * np.arange(corners) / corners])


def depth(bundle, obstacle, orientation, lowest, x):
    """m: how far the edge at x is below the surface, where both are apart from the edge's ends; how many nodes press; N."""
    scene = palpate.Scene(bundle, collision="deformed", obstacles=[obstacle], max_contact_nodes=800, max_operations=10**8)
    contacts = scene.make_contacts()
    for step in range(STEPS + 1):
        place = (x - lowest[0], MIDDLE, TOP - lowest[2] + 1e-3 - (1e-3 + SINK) * step / STEPS)
        scene.set_obstacle_pose(0, place, orientation)
        scene.touch([], 0.001, contacts)
    positions = np.zeros((scene.shape_node_count, 3), np.float32)
    scene.shape(contacts, positions)
    state, triangles, rest = scene.obstacle_states()[0], np.array(bundle.triangles), np.array(bundle.nodes)
    top = triangles[(rest[triangles][:, :, 2] > TOP - 1e-9).all(axis=1)]
    deepest = max(height(positions.astype(float), top, x, y) - (TOP - SINK) for y in MIDDLE + np.linspace(-0.015, 0.015, 61))
    return deepest, state["nodes"], state["force"][2]


def height(positions, triangles, x, y):
    """Of the surface at x, y."""
    a, b, c = (positions[triangles[:, i]] for i in range(3))
    ab, ac, ap = b - a, c - a, np.array([x, y]) - a[:, :2]
    det = ab[:, 0] * ac[:, 1] - ab[:, 1] * ac[:, 0]
    s, t = (ap[:, 0] * ac[:, 1] - ap[:, 1] * ac[:, 0]) / det, (ab[:, 0] * ap[:, 1] - ab[:, 1] * ap[:, 0]) / det
    inside = (s > -1e-9) & (t > -1e-9) & (s + t < 1 + 1e-9)
    return (a[:, 2] + s * ab[:, 2] + t * ac[:, 2])[inside].max()


def main():
    with tempfile.TemporaryDirectory() as scratch:
        folder = pathlib.Path(scratch)
        write_mesh(folder / "block.msh")
        (folder / "organ.toml").write_text(ORGAN), (folder / "boundary.toml").write_text(BOUNDARY)
        subprocess.run([pathlib.Path(sys.argv[1]).resolve(), "block.msh", "--organ", "organ.toml", "--boundary", "boundary.toml", "-o", "block.h5", "--quiet"],
                       cwd=folder, check=True)
        bundle = palpate.Bundle(str(folder / "block.h5"))
    cases = [("ridge of %d degrees" % angle, palpate.Obstacle("mesh", mesh=ridge(angle)), (1, 0, 0, 0), np.zeros(3)) for angle in (60, 90, 120)]
    cases += [("rib of %d mm radius" % radius, palpate.Obstacle("mesh", mesh=rib(1e-3 * radius)), (1, 0, 0, 0), np.zeros(3)) for radius in (5, 10)]
    for tilt in (10, 20, 40):  # a plate's rim, its underside tilted
        half = np.radians(180 - tilt) / 2
        lowest = np.array([-0.02 * np.cos(np.radians(tilt)), 0, -0.02 * np.sin(np.radians(tilt))])
        plate = palpate.Obstacle("rectangle", (0.04, 0.04), position=(0, 0, 1))
        cases.append(("rim of a plate at %d degrees" % tilt, plate, (np.cos(half), 0, np.sin(half), 0), lowest))
    print("%-28s %14s %14s" % ("pressed in by 2 mm, depth", "on a row, mm", "between, mm"))
    for name, obstacle, orientation, lowest in cases:
        found = [depth(bundle, obstacle, orientation, lowest, x) for x in (ROW, BETWEEN)]
        print("%-28s %14.2f %14.2f" % (name, 1e3 * found[0][0], 1e3 * found[1][0]), flush=True)


if __name__ == "__main__":
    main()
