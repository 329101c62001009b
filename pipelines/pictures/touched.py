#!/usr/bin/env python3
"""touched.py SCENE_FOLDER -o PNG: the organ at the scene's largest force, coloured by displacement, with the tools and the
forces that they feel."""
import argparse
import os

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt  # noqa: E402
import numpy as np  # noqa: E402

import offscreen  # noqa: E402
from offscreen import vtk  # noqa: E402

COLOURS = plt.get_cmap("viridis")
STEEL, FORCE, EDGE = (0.55, 0.58, 0.62), (0.85, 0.10, 0.10), (0.15, 0.15, 0.15)
FORCE_HEX = "#d91a1a"


def contact_centres(scene, time, points):
    """The point at which each tool holds the organ, mm: the mean of its nodes in contact, weighted by their force."""
    nodes = {}
    for row in offscreen.read_csv(os.path.join(scene, "contacts.csv")):
        if float(row["time_s"]) == time:
            weight = np.linalg.norm(offscreen.vector(row, "force", "N")) + 1e-12
            nodes.setdefault(row["tool"], []).append((weight, points[int(row["node"])]))
    return {tool: np.average([p for _, p in held], axis=0, weights=[w for w, _ in held])
            for tool, held in nodes.items()}


def tool_actors(tool, points, lean, size):
    """A capsule is drawn as it is, a single point as the tip of a thin rod along lean, a disc as the flat end of a rod, and
    several points as balls."""
    if tool.get("capsule"):
        capsule = tool["capsule"]
        radius = capsule["radius_m"] / offscreen.MILLIMETRE
        axis = np.array(capsule["axis"])
        ends = points[-capsule["samples"]] + radius * axis, points[-1] - radius * axis
        return [offscreen.rod(*ends, radius, STEEL)] + [offscreen.sphere(end, radius, STEEL) for end in ends]
    radius = tool["radius_m"] / offscreen.MILLIMETRE if "radius_m" in tool else 0.011 * size
    if len(points) == 1 and "radius_m" in tool:  # a flat disc: the end of the rod
        return [offscreen.rod(points[0], points[0] + 0.42 * size * lean, radius, STEEL)]
    if len(points) == 1:
        start = points[0] + radius * lean
        end = start + 0.42 * size * lean
        return [offscreen.sphere(start, radius, STEEL), offscreen.rod(start, end, radius, STEEL)]
    return [offscreen.sphere(point + radius * lean, radius, STEEL) for point in points]


def lean_of_tools(look_from):
    """The direction of drawn rods, so that they hide little: towards the viewer, up and to the right."""
    look = np.array(look_from) / np.linalg.norm(look_from)
    right = np.cross((0, 0, 1), look)
    lean = 0.5 * look + 0.45 * right / np.linalg.norm(right) + np.array([0, 0, 0.7])
    return lean / np.linalg.norm(lean)


def normal_near(surface, point):
    locator = vtk.vtkPointLocator()
    locator.SetDataSet(surface)
    locator.BuildLocator()
    return np.array(surface.GetPointData().GetNormals().GetTuple(locator.FindClosestPoint(point)))


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("scene")
    parser.add_argument("-o", "--output", required=True)
    parser.add_argument("--look-from", nargs=3, type=float, default=(0.30, -1.0, 0.38))
    arguments = parser.parse_args()
    summary = offscreen.read_summary(arguments.scene)
    time, organ_file, tools_file = offscreen.frame_of_peak(arguments.scene)
    organ, tools = offscreen.read_grid(organ_file), offscreen.read_grid(tools_file)
    displacement = offscreen.point_data(organ, "displacement") / offscreen.MILLIMETRE
    now = offscreen.points_of(organ)
    offscreen.set_points(organ, now)
    length = np.linalg.norm(displacement, axis=1)
    size = np.linalg.norm(np.ptp(now, axis=0))
    largest = float(np.ceil(length.max()))

    surface = offscreen.surface_of(organ)
    shown = np.linalg.norm(offscreen.point_data(surface, "displacement"), axis=1) / offscreen.MILLIMETRE
    actors = [offscreen.coloured_actor(surface, shown, (0, largest), COLOURS, edges=EDGE)]

    forces = {row["tool"]: offscreen.vector(row, "force", "N")
              for row in offscreen.read_csv(os.path.join(arguments.scene, "forces.csv")) if float(row["time_s"]) == time}
    strongest = max(np.linalg.norm(f) for f in forces.values())
    centres = contact_centres(arguments.scene, time, now)
    owners = offscreen.point_data(tools, "tool") if tools.GetNumberOfPoints() else np.zeros(0)
    tool_points = offscreen.points_of(tools)
    labels = []
    for index, tool in enumerate(summary["tools"]):
        force = forces[tool["name"]]
        strength = np.linalg.norm(force)
        direction = force / strength if strength > 0 else force
        mine = tool_points[owners == index]
        if len(mine):
            actors += tool_actors(tool, mine, lean_of_tools(arguments.look_from), size)
        if strength > 0 and tool["name"] in centres:
            place = centres[tool["name"]]
            reach = direction * size * (0.10 + 0.15 * strength / strongest)
            # A pull would put the arrow inside the organ: there it ends at the contact.
            start = place if direction @ normal_near(surface, place) > 0 else place - reach
            actors += offscreen.arrow(start, direction, np.linalg.norm(reach), 0.006 * size, FORCE)
            labels.append((place, start + reach if start is place else start, "%.2f N" % strength))

    image, pixel = offscreen.render(actors, arguments.look_from, size=(1500, 1000), zoom=1.35,
                                    bounds=offscreen.bounds_of(np.vstack([now] + [outer for _, outer, _ in labels])), crop=75)
    figure, panel = plt.subplots(figsize=(11.5, 7.8))
    panel.imshow(image)
    panel.axis("off")
    offscreen.draw_scale(panel, image, pixel, now.mean(axis=0), arguments.look_from, size)
    offscreen.label_arrows(panel, pixel, labels, color=FORCE_HEX, fontsize=17, weight="bold")
    bar = figure.colorbar(plt.cm.ScalarMappable(plt.Normalize(0, largest), COLOURS),
                          cax=figure.add_axes([0.90, 0.14, 0.022, 0.68]))
    bar.set_label("displacement (mm)", fontsize=16)
    bar.ax.tick_params(labelsize=14)
    panel.set_title("%s, %.2f s; red: force of the organ on the %s"
                    % (summary["scene"], time, "tools" if len(summary["tools"]) > 1 else "tool"), fontsize=16)
    figure.subplots_adjust(left=0.005, right=0.89, bottom=0.01, top=0.94)
    offscreen.save(figure, arguments.output)


if __name__ == "__main__":
    main()
