#!/usr/bin/env python3
"""make_balls.py X,Y,Z,RADIUS ... --edge E -o OFF: closed shells of the volume of balls, in mm, as surfaces of tumours.

Each shell is an icosahedron whose faces are cut into n x n triangles and moved onto the sphere; edges of about E, at least
80 triangles a ball. The same arguments give the same bytes.
"""
import argparse
import os

import numpy as np


def icosahedron():
    golden = (1 + 5**0.5) / 2
    corners = np.array([(0, a, b * golden) for a in (-1, 1) for b in (-1, 1)], dtype=float)
    corners = np.vstack([np.roll(corners, turn, axis=1) for turn in range(3)])
    faces = [(i, j, k) for i in range(12) for j in range(i) for k in range(j)
             if all(abs(np.linalg.norm(corners[a] - corners[b]) - 2) < 1e-9 for a, b in ((i, j), (j, k), (k, i)))]
    return corners, [f if np.linalg.det(corners[list(f)]) > 0 else (f[0], f[2], f[1]) for f in faces]


def unit_ball(cuts):
    """Corners [n, 3] and outward triangles [m, 3] of a shell around the origin with the volume of the unit ball."""
    corners, faces = icosahedron()
    index, points, triangles = {}, [], []

    def point(a, b, c, i, j):
        """The point i steps from a to b and j from a to c; points on shared edges are found again by their place."""
        place = corners[a] + (i * (corners[b] - corners[a]) + j * (corners[c] - corners[a])) / cuts
        place /= np.linalg.norm(place)
        key = tuple(np.round(place, 9) + 0.0)
        if key not in index:
            index[key] = len(points)
            points.append(place)
        return index[key]

    for face in faces:
        for i in range(cuts):
            for j in range(cuts - i):
                triangles.append([point(*face, i, j), point(*face, i + 1, j), point(*face, i, j + 1)])
                if i + j < cuts - 1:
                    triangles.append([point(*face, i + 1, j), point(*face, i + 1, j + 1), point(*face, i, j + 1)])
    points, triangles = np.array(points), np.array(triangles)
    volume = np.linalg.det(points[triangles]).sum() / 6
    return points * (4 / 3 * np.pi / volume) ** (1 / 3), triangles


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("ball", nargs="+")
    parser.add_argument("--edge", type=float, required=True)
    parser.add_argument("-o", "--output", required=True)
    arguments = parser.parse_args()
    points, triangles, count = [], [], 0
    for ball in arguments.ball:
        try:
            *centre, radius = (float(number) for number in ball.split(","))
            assert len(centre) == 3 and radius > 0
        except (ValueError, AssertionError):
            parser.error("%s: expected X,Y,Z,RADIUS with a positive radius, in mm" % ball)
        # An edge of the icosahedron is 1.05 radii long.
        corners, faces = unit_ball(max(2, round(1.05 * radius / arguments.edge)))
        points.append(np.array(centre) + radius * corners)
        triangles.append(faces + count)
        count += len(corners)
    points, triangles = np.vstack(points), np.vstack(triangles)
    with open(arguments.output + ".part", "w") as out:
        out.write("OFF\n%d %d 0\n" % (len(points), len(triangles)))
        out.writelines("%.17g %.17g %.17g\n" % tuple(p) for p in points)
        out.writelines("3 %d %d %d\n" % tuple(t) for t in triangles)
    os.replace(arguments.output + ".part", arguments.output)


if __name__ == "__main__":
    main()
