#!/usr/bin/python3
"""How well the surface that is drawn meets a disc that presses a real organ, with the effect dent and without.

    PYTHONPATH=build/python /usr/bin/python3 bench/drawn_dent.py BUNDLE.h5 RENDER.ply --radius 6

Presses the disc 5 mm deep at random nodes that may be touched, along their normals, and measures the vertices below the disc against
the plane that it is drawn in (skin's disc_normals). Prints the share of places where all of these vertices are within 0.2 mm of the
plane, and the largest distance of each place: median, 90 % and worst, mm.
"""
import argparse

import numpy as np
import palpate
import vtkmodules.all as vtk
from vtkmodules.util.numpy_support import vtk_to_numpy

PUSH, ABOVE, STEPS, TICK = 0.005, 0.002, 140, 1e-3  # m, m, steps of the way down, s
THICK, WITHIN = 0.012, 2e-4  # m: farther vertices are of the organ's other side; what the disc should be met to


def read_mesh(path):
    reader = vtk.vtkPLYReader()
    reader.SetFileName(path)
    reader.Update()
    data = reader.GetOutput()
    triangles = vtk_to_numpy(data.GetPolys().GetConnectivityArray()).reshape(-1, 3)
    positions = vtk_to_numpy(data.GetPoints().GetData()).astype(np.float32)
    return positions * np.float32(1e-3 if np.abs(positions).max() > 1 else 1), triangles


def normals_of(positions, triangles):
    corner = positions[triangles]
    area = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
    normals = np.zeros_like(positions)
    for v in range(3):
        np.add.at(normals, triangles[:, v], area)
    return normals / np.linalg.norm(normals, axis=1)[:, None]


def pressed(bundle, mesh, place, outward, radius):
    """Largest distance from the disc's plane of the vertices below it, m: without dent, with it. None: nothing is below it."""
    scene = palpate.Scene(bundle, contact="patch", law="sticking", dent="discs", report="contacts", render_mesh=mesh)
    contacts, tool = scene.make_contacts(), palpate.Tool([place], disc_radius=radius)
    for step in range(STEPS + 1):
        tool.points = [place + (ABOVE - (ABOVE + PUSH) * step / STEPS) * outward]
        scene.touch([tool], TICK, contacts)
    displacements = np.zeros((bundle.surface_node_count, 3), np.float32)
    scene.shape(contacts, None, displacements)
    found = scene.report()[0]
    if len(found) != 1:
        return None
    drawn, normals, planes, distances = np.zeros_like(mesh[0]), np.zeros_like(mesh[0]), np.zeros((1, 3), np.float32), []
    for report in (scene.report_bytes(), None):  # the planes come with the dent
        scene.skin(displacements, drawn, normals, report, planes if report else None)
        plane = planes[0].astype(float)
        away = drawn - np.array(tool.points[0])
        height = away @ plane
        across = np.linalg.norm(away - np.outer(height, plane), axis=1)
        below = (across < radius) & (np.abs(height) < THICK) & (mesh[1] @ plane > 0.3)
        if not below.any():
            return None
        distances.append(np.abs(height[below]).max())
    return distances[::-1]


def main():
    arguments = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    arguments.add_argument("bundle")
    arguments.add_argument("render_mesh", help="PLY, the finer surface that is drawn")
    arguments.add_argument("--radius", type=float, default=6, help="of the disc, mm")
    arguments.add_argument("--places", type=int, default=60)
    asked = arguments.parse_args()
    bundle, (positions, triangles) = palpate.Bundle(asked.bundle), read_mesh(asked.render_mesh)
    mesh = positions, normals_of(positions, triangles).astype(np.float32)
    surface = normals_of(bundle.nodes[: bundle.surface_node_count], bundle.triangles)
    nodes = np.random.default_rng(1).choice(bundle.touchable, min(asked.places, len(bundle.touchable)), replace=False)
    measured = [pressed(bundle, mesh, bundle.nodes[n], surface[n], asked.radius * 1e-3) for n in nodes]
    without, with_dent = np.array([of for of in measured if of]).T * 1e3
    print(f"{len(without)} places, disc of {asked.radius:g} mm, push of {1e3 * PUSH:g} mm: within {1e3 * WITHIN:g} mm at "
          f"{100 * np.mean(with_dent < 1e3 * WITHIN):.0f} %")
    for name, of in (("without dent", without), ("with dent", with_dent)):
        print(f"{name}: median {np.median(of):.2f}, 90 % {np.quantile(of, 0.9):.2f}, worst {of.max():.2f} mm")


if __name__ == "__main__":
    main()
