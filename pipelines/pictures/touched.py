#!/usr/bin/env python3
"""touched.py SCENE_FOLDER -o PNG: the organ, or all organs, at the scene's largest force (of a scene that has cut, at its end), coloured by displacement,
with its outline at rest, the tools and obstacles, the tools' paths and the forces on both in one scale, a legend of what is seen, the links, the discs of
grasps and the needles, the lips of cuts and the edges of blades, from two sides."""
import os

import h5py
import numpy as np

import mesh
import offscreen
import picture_file
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from picture_file import plt
import views
from offscreen import vtk

COLOURS = plt.get_cmap("viridis")
STEEL, FORCE, EDGE, PATH, HATCH = (0.55, 0.58, 0.62), (0.85, 0.10, 0.10), (0.15, 0.15, 0.15), (0.95, 0.55, 0.1), (0.9, 0.9, 0.95)
LONGEST = 0.25  # of the organ's size: the arrow of the largest force; all others in proportion
OUTLINE = (0.25, 0.25, 0.25)
ONE_ROW = 5  # entries of the legend in a row
FORCE_HEX, BORDER = "#d91a1a", (0.0, 0.0, 0.0)
THREAD, THREAD_HEX, SLACK, DISC = (0.10, 0.25, 0.85), "#1a40d9", (0.65, 0.70, 0.85), (0.55, 0.15, 0.65)
LINE, TAUT, BROKEN = 3, 1, 2  # a VTK cell; conditions of a link
GLASS = 0.45  # opacity of an organ with a needle inside
BONE, BONE_GLASS = (0.86, 0.80, 0.66), 0.5  # an obstacle, through which the organ is seen
LIP, BLADE = (0.80, 0.16, 0.20), (0.05, 0.05, 0.05)
AROUND = 0.12  # of the organ's size: what of an obstacle is farther from the organ's box is not drawn


def region_lines(bundle, points):
    """Lines on the outer surface between the regions of the bundle; none where the bundle has one region or is not there.
    points: where the bundle's nodes are, mm."""
    if not os.path.exists(bundle):
        return []
    with h5py.File(bundle, "r") as file:
        tetrahedra, region, triangles = (file["mesh/" + name][:] for name in ("tetrahedra", "region", "triangles"))
    if region.max() == 0:
        return []
    of_triangle = mesh.region_of_triangles(triangles, tetrahedra, region)
    edges = np.sort(triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    order = np.lexsort(edges.T)
    edges, owners = edges[order].reshape(-1, 2, 2)[:, 0], np.repeat(of_triangle, 3)[order].reshape(-1, 2)
    between = edges[owners[:, 0] != owners[:, 1]]
    return [offscreen.line_actor(offscreen.poly_data(points, between, "Lines"), BORDER, width=7)]


def contact_centres(scene, time, points, first):
    """The point at which each tool holds the organs, mm: the mean of its nodes in contact, weighted by their force. first: of the
    nodes of each organ in points. Nodes inside the organ, which needles hold, are not in points."""
    nodes, end = {}, dict(zip(first, list(first.values())[1:] + [len(points)]))
    for row in offscreen.read_csv(os.path.join(scene, "contacts.csv")):
        place = first[row.get("organ")] + int(row["node"])
        if float(row["time_s"]) == time and place < end[row.get("organ")]:
            weight = np.linalg.norm(offscreen.vector(row, "force", "N")) + 1e-12
            nodes.setdefault(row["tool"], []).append((weight, points[place]))
    return {tool: np.average([p for _, p in held], axis=0, weights=[w for w, _ in held])
            for tool, held in nodes.items()}


def read_paths(scene, time):
    """Of each tool: [n, 3] mm, its place in each touch until then; the index of its first contact, or None; its force then, N."""
    rows = {}
    for row in offscreen.read_csv(os.path.join(scene, "forces.csv")):
        if float(row["time_s"]) <= time:
            rows.setdefault(row["tool"], []).append(row)
    paths = {}
    for tool, own in rows.items():
        places = np.array([[float(row[axis + "_m"]) for axis in "xyz"] for row in own]) / offscreen.MILLIMETRE
        first = next((i for i, row in enumerate(own) if int(row["contacts"]) > 0), None)
        paths[tool] = places, first, offscreen.vector(own[-1], "force", "N")
    return paths


def radius_of(tool, size):
    """Of the shaft that is drawn, mm."""
    if tool.get("capsule"):
        return tool["capsule"]["radius_m"] / offscreen.MILLIMETRE
    return tool["radius_m"] / offscreen.MILLIMETRE if "radius_m" in tool else 0.011 * size


def tool_actors(tool, points, shaft, size):
    """A capsule is drawn as it is, a single point as the tip of a thin rod along shaft, a disc as the flat end of a rod, and
    several points as balls."""
    if tool.get("capsule"):
        capsule = tool["capsule"]
        radius = capsule["radius_m"] / offscreen.MILLIMETRE
        axis = np.array(capsule["axis"])
        ends = points[-capsule["samples"]] + radius * axis, points[-1] - radius * axis
        return [offscreen.rod(*ends, radius, STEEL)] + [offscreen.sphere(end, radius, STEEL) for end in ends]
    radius = radius_of(tool, size)
    if len(points) == 1 and "radius_m" in tool:  # a flat disc: the end of the rod
        return [offscreen.rod(points[0], points[0] + 0.3 * size * shaft, radius, STEEL)]
    if len(points) == 1:
        start = points[0] + radius * shaft
        end = start + 0.3 * size * shaft
        return [offscreen.sphere(start, radius, STEEL), offscreen.rod(start, end, radius, STEEL)]
    return [offscreen.sphere(point + radius * shaft, radius, STEEL) for point in points]


def grip_actors(place, shaft, size):
    """Two jaws that hold a place, at the end of a thin rod along shaft."""
    radius = 0.008 * size
    across = views.unit(np.cross(shaft, (0.31, 0.95, 0.1)))
    joint = place + 5 * radius * shaft
    jaws = [offscreen.rod(place + side * 1.5 * radius * across, joint, 0.7 * radius, STEEL) for side in (-1, 1)]
    return jaws + [offscreen.rod(joint, joint + 0.25 * size * shaft, radius, STEEL)]


def jaw_actors(middles, normals, centre, size):
    """A grasp's shaft, on one disc along its normal; between two discs a jaw to each, and the shaft away from the organ's centre."""
    radius = 0.008 * size
    if len(middles) == 1:
        return [offscreen.rod(middles[0], middles[0] + 0.3 * size * normals[0], radius, STEEL)]
    apart, out = views.unit(middles[1] - middles[0]), np.mean(middles, axis=0) - centre
    out = out - apart * (apart @ out)
    out = views.unit(out) if np.linalg.norm(out) > 0.01 * size else views.unit(np.cross(apart, np.eye(3)[np.argmin(np.abs(apart))]))
    outer = [middle + 0.02 * size * normal for middle, normal in zip(middles, normals)]
    joint = np.mean(outer, axis=0) + (0.10 * size + 0.5 * np.linalg.norm(outer[1] - outer[0])) * out
    return [offscreen.rod(end, joint, radius, STEEL) for end in outer] + [offscreen.rod(joint, joint + 0.2 * size * out, radius, STEEL)]


def needles_in(held_files):
    """Of each tool with a needle: where its tip and its handle are, mm."""
    needles = {}
    for file in filter(os.path.exists, held_files):
        grid = offscreen.read_grid(file)
        points, data = offscreen.points_of(grid), grid.GetCellData()
        for cell in range(grid.GetNumberOfCells()):
            if grid.GetCellType(cell) == LINE and data.GetArray("link").GetTuple1(cell) < 0:
                needles[int(data.GetArray("tool").GetTuple1(cell))] = [points[grid.GetCell(cell).GetPointId(i)] for i in range(2)]
    return needles


def needle_actors(tip, handle, radius, size):
    """The shaft, no thinner than can be seen, and a ball at its tip."""
    radius = max(radius, 0.004 * size)
    return [offscreen.rod(tip, handle, radius, STEEL), offscreen.sphere(tip, 1.6 * radius, STEEL)]


def held_actors(held_file, surface, size, lift=0.012):
    """Actors of the links and of the discs of grasps; labels (place, place, text) of the stretches that bear a force; the outward
    normals at them. A link that is broken is not drawn. lift: of the organ's size, by which lines are drawn above the surface."""
    if not os.path.exists(held_file):
        return [], [], []
    grid = offscreen.read_grid(held_file)
    points = offscreen.points_of(grid)
    actors, labels, places, discs = [], [], [], {}
    for cell in range(grid.GetNumberOfCells()):
        ids = [grid.GetCell(cell).GetPointId(i) for i in range(grid.GetCell(cell).GetNumberOfPoints())]
        if grid.GetCellType(cell) == LINE and grid.GetCellData().GetArray("link").GetTuple1(cell) < 0:
            continue  # a needle
        condition, tension = (grid.GetCellData().GetArray(name).GetTuple1(cell) for name in ("condition", "tension"))
        if grid.GetCellType(cell) == LINE:
            if condition == BROKEN:
                continue
            ends = points[ids]
            # A line between two places of a bent surface lies inside it: it is drawn above them.
            above = lift * size * views.unit(sum(normals_at(surface, ends)))
            actors.append(offscreen.rod(*(ends + above), 0.004 * size, THREAD if condition == TAUT else SLACK))
            actors += [offscreen.sphere(end + above, 0.007 * size, THREAD) for end in ends]
            places += [ends[0]]
            if tension != 0:
                labels.append((ends[0] + above, ends[1] + above, "%.2f N" % (round(tension, 2) + 0.0)))  # not -0.00
        else:
            rim = points[ids]
            middle, normal = rim.mean(axis=0), views.unit(np.cross(rim[0] - rim[6], rim[3] - rim[9]))
            radius = np.linalg.norm(rim[0] - middle)
            actors.append(offscreen.rod(middle - 0.01 * size * normal, middle + 0.01 * size * normal, radius, DISC))
            places.append(middle)
            discs.setdefault(grid.GetCellData().GetArray("tool").GetTuple1(cell), []).append(middle)
    for middles in discs.values():
        actors += jaw_actors(middles, normals_at(surface, middles), offscreen.points_in(surface).mean(axis=0), size)
    return actors, labels, normals_at(surface, places)


def obstacle_actors(file, now, size):
    """The obstacles, as far as they are near the organ."""
    if not os.path.exists(file):
        return []
    grid = offscreen.read_grid(file)
    offscreen.set_points(grid, offscreen.points_of(grid))
    low, high, near = now.min(axis=0) - AROUND * size, now.max(axis=0) + AROUND * size, grid
    for axis in np.eye(3):  # plane by plane, since triangles may be larger than the whole box
        for corner, inward in ((low, axis), (high, -axis)):
            near = offscreen.made_by("ClipDataSet", InputData=near, ClipFunction=offscreen.set_up(vtk.vtkPlane(), Origin=corner, Normal=inward))
    if near.GetNumberOfCells() == 0:
        return []
    edges = offscreen.made_by("FeatureEdges", InputData=offscreen.surface_of(near), BoundaryEdges=True, FeatureEdges=True, FeatureAngle=25, ManifoldEdges=False)
    return [offscreen.plain_actor(near, BONE, opacity=BONE_GLASS), offscreen.line_actor(edges, EDGE, width=3)]


def blade_actors(file, size):
    """The edges of blades."""
    if not os.path.exists(file):
        return []
    grid = offscreen.read_grid(file)
    points = offscreen.points_of(grid)
    cells = [grid.GetCell(cell) for cell in range(grid.GetNumberOfCells())]
    return [offscreen.path_line(points[[cell.GetPointId(i) for i in range(cell.GetNumberOfPoints())]], 0.006 * size, BLADE) for cell in cells]


def obstacle_forces(scene, time, points, first):
    """Of each obstacle that an organ presses: the middle of the nodes that do, mm, weighted by their force; the force on it, N."""
    numbers, forces, nodes = {}, {}, {}
    for row in offscreen.read_if_there(scene, "obstacles.csv"):
        if float(row["time_s"]) == time:
            names = numbers.setdefault(row.get("organ"), [])  # in the order of the organ's obstacles
            names.append(row["obstacle"])
            forces[row["obstacle"]] = forces.get(row["obstacle"], 0) + np.array(offscreen.vector(row, "force", "N"))
    for row in offscreen.read_csv(os.path.join(scene, "contacts.csv")) if forces else []:
        if float(row["time_s"]) == time and row["tool"] == "obstacle":
            organ, weight = row.get("organ"), np.linalg.norm(offscreen.vector(row, "force", "N"))
            nodes.setdefault(numbers[organ][int(row["point"])], []).append((weight, points[first[organ] + int(row["node"])]))
    return [(np.average([p for _, p in held], axis=0, weights=[w for w, _ in held]), forces[name])
            for name, held in nodes.items() if sum(w for w, _ in held) > 0]


def torque_of(scene, tool, time):
    """N m, its length."""
    for row in offscreen.read_csv(os.path.join(scene, "forces.csv")):
        if float(row["time_s"]) == time and row["tool"] == tool:
            return np.linalg.norm([float(row["torque_%s_Nm" % axis]) for axis in "xyz"])
    return 0.0


def normals_at(surface, places):
    locator = vtk.vtkPointLocator()
    locator.SetDataSet(surface)
    locator.BuildLocator()
    return [np.array(surface.GetPointData().GetNormals().GetTuple(locator.FindClosestPoint(place))) for place in places]


def tools_and_forces(scene, summary, time, surface, now, first, tool_grid, needles, size):
    """Actors of the tools and their paths; their forces and those on obstacles, for force_arrows; the outward normals where they act; the largest force, N."""
    centres, paths = contact_centres(scene, time, now, first), read_paths(scene, time)
    owners = offscreen.point_data(tool_grid, "tool") if tool_grid.GetNumberOfPoints() else np.zeros(0)
    tool_points = offscreen.points_of(tool_grid)
    pressed = obstacle_forces(scene, time, now, first)
    strongest = max(np.linalg.norm(force) for force in [*(force for _, _, force in paths.values()), *(force for _, force in pressed)])
    actors, forces, normals = [], [], []
    for place, force in pressed:
        strength, normal = np.linalg.norm(force), normals_at(surface, [place])[0]
        normals.append(normal)
        forces.append((place, force / strength, size * LONGEST * strength / strongest, normal, normal, 0.0, "%.2f N" % strength))
    for index, tool in enumerate(summary["tools"]):
        torque = torque_of(scene, tool["name"], time) if tool.get("grasp") else 0
        path, first, force = paths[tool["name"]]
        mine, strength = tool_points[owners == index], np.linalg.norm(force)
        if index in needles:
            tip, handle = needles[index]
            out = views.unit(handle - tip)
            actors += needle_actors(tip, handle, tool["needle"]["radius_m"] / offscreen.MILLIMETRE, size)
            normals.append(normals_at(surface, [tip + tool["needle"]["deepest_m"] / offscreen.MILLIMETRE * out])[0])
            if strength > 0:
                forces.append((handle, force / strength, size * LONGEST * strength / strongest, out, out, 0.0, "%.2f N" % strength))
            continue
        place = centres.get(tool["name"], path[-1])
        normal = normals_at(surface, [place])[0]
        normals += [normal] if tool["name"] in centres else []
        shaft = views.shaft(path, first, normal)
        if len(mine):
            actors += tool_actors(tool, mine, shaft, size)
        elif tool["name"] in centres and not tool.get("grasp"):
            actors += grip_actors(place, shaft, size)
        if np.linalg.norm(np.ptp(path, axis=0)) > 2:
            actors.append(offscreen.path_line(path, 0.0025 * size, PATH))
        if strength > 0 and tool["name"] in centres:
            forces.append((place, force / strength, size * LONGEST * strength / strongest, normal, shaft,
                           radius_of(tool, size) if len(mine) else 0.04 * size,
                           "%.2f N" % strength + (", %.2g N mm" % (1e3 * torque) if torque else "")))
    return actors, forces, normals, strongest


def force_arrows(forces, look_from, size):
    """The arrows as they are seen from there, and their labels. An arrow that would lie inside its tool's shaft stands beside it."""
    actors, labels = [], []
    for place, direction, length, normal, shaft, radius, text in forces:
        reach = direction * length
        # A pull would put the arrow inside the organ: there it ends at the contact.
        start = place if direction @ normal > 0 else place - reach
        start = start + (radius + 0.02 * size) * views.beside(start + reach / 2 - place, shaft, look_from)
        actors += offscreen.arrow(start, direction, length, 0.006 * size, FORCE)
        labels.append((start, start + reach, text) if direction @ normal > 0 else (start + reach, start, text))
    return actors, labels


def main():
    arguments = picture_file.arguments(__doc__, "scene")
    summary = offscreen.read_summary(arguments.scene)
    time, organ_files, tools_file = offscreen.frame_of_peak(arguments.scene)
    organ = offscreen.read_grids(organ_files)
    organs = summary.get("organs", [dict(summary, name=None)])
    first = dict(zip([each["name"] for each in organs],
                     np.cumsum([0] + [offscreen.read_grid(file).GetNumberOfPoints() for file in organ_files])))
    length = np.linalg.norm(offscreen.point_data(organ, "displacement"), axis=1) / offscreen.MILLIMETRE
    now = offscreen.points_of(organ)
    offscreen.set_points(organ, now)
    size = np.linalg.norm(np.ptp(now, axis=0))
    largest = max(float(np.ceil(length.max())), 1.0)  # mm; nothing moves where nothing was touched

    surface = offscreen.surface_of(organ)
    rest = offscreen.points_in(surface) - offscreen.point_data(surface, "displacement") / offscreen.MILLIMETRE
    triangles = offscreen.triangles_of(surface)
    shown = np.linalg.norm(offscreen.point_data(surface, "displacement"), axis=1) / offscreen.MILLIMETRE
    needles = needles_in([file.replace("organ_", "held_") for file in organ_files])
    own, lips = offscreen.split_by_lips(surface)
    actors = [offscreen.coloured_actor(own, shown, (0, largest), COLOURS, edges=EDGE)]
    actors += [offscreen.plain_actor(lips, LIP, edges=EDGE)] if lips else []
    actors[0].GetProperty().SetOpacity(GLASS if needles else 1)
    held = offscreen.cells_where(surface, offscreen.point_data(surface, "fixed") > 0)
    if held.GetNumberOfCells():
        actors += [offscreen.plain_actor(held, mesh.HELD, edges=EDGE), offscreen.hatch(held, size, HATCH)]
    borders = region_lines(organs[0]["bundle"], now) if len(organs) == 1 else []
    actors += borders
    more, forces, normals, strongest = tools_and_forces(arguments.scene, summary, time, surface, now, first, offscreen.read_grid(tools_file), needles,
                                             size)
    actors += more
    obstacles = obstacle_actors(tools_file.replace("tools_", "obstacles_"), now, size)
    actors += obstacles
    blades = [actor for file in organ_files for actor in blade_actors(file.replace("organ_", "blades_"), size)]
    actors += blades
    tensions = []
    for organ_file in organ_files:
        more, labels, seen = held_actors(organ_file.replace("organ_", "held_"), surface, size)
        actors, tensions, normals = actors + more, tensions + labels, normals + seen

    # Links between organs are lines through the air, which the side that they end on does not show.
    more, labels, _ = held_actors(tools_file.replace("tools_", "links_"), surface, size, lift=0)
    actors, tensions = actors + more, tensions + labels

    figure, panels = plt.subplots(1, 2, figsize=(16, 7.2))
    figure.subplots_adjust(left=0.003, right=0.928, top=0.95, wspace=0.01)
    for panel, look_from in zip(panels, views.two_views(np.array(normals))):
        arrows, labels = force_arrows(forces, look_from, size)
        image, pixel = offscreen.render(actors + arrows, look_from, size=(1000, 860), zoom=None)
        panel.imshow(image)
        panel.axis("off")
        offscreen.draw_outline(panel, pixel, rest, triangles, image.shape[:2], OUTLINE)
        written = offscreen.draw_scale(panel, image, pixel, now.mean(axis=0), look_from, size, organs[0]["provenance"].get("frame"))
        written = offscreen.label_arrows(panel, pixel, labels, written, fontsize=15, color=FORCE_HEX, weight="bold")
        offscreen.label_arrows(panel, pixel, tensions, written, fontsize=13, color=THREAD_HEX, weight="bold")
    bar = figure.colorbar(plt.cm.ScalarMappable(plt.Normalize(0, largest), COLOURS),
                          cax=figure.add_axes([0.935, 0.14, 0.014, 0.68]))
    bar.set_label("displacement (mm)", fontsize=16)
    bar.ax.tick_params(labelsize=14)
    figure.suptitle("%s at %.2f s, from two sides" % (summary["scene"], time), fontsize=16, y=0.99)
    newtons = strongest / (LONGEST * size)  # for each mm of an arrow
    bearers = "tools and obstacles" if obstacles else "tools" if len(summary["tools"]) > 1 else "tool"
    legend = [(Line2D([], [], color=FORCE_HEX, linewidth=4), "force on the %s: 20 mm of an arrow are %.2g N" % (bearers, 20 * newtons))] if strongest > 0 else []
    legend += [(Line2D([], [], color=OUTLINE, linestyle="dashed"), "the organ%s at rest" % ("s" if len(organs) > 1 else "")),
               (Line2D([], [], color=PATH, linewidth=3), "path of a tool")]
    legend += [(Patch(facecolor=mesh.HELD, hatch="//"), "held")] if held.GetNumberOfCells() else []
    legend += [(Line2D([], [], color=BORDER, linewidth=3), "between tissues")] if borders else []
    legend += [(Line2D([], [], color=THREAD_HEX, linewidth=3), "link")] if any(each.get("links") for each in [*organs, summary]) else []
    legend += [(Patch(facecolor=BONE), "obstacle")] if obstacles else []
    legend += [(Patch(facecolor=LIP), "lip of a cut")] if lips else []
    legend += [(Line2D([], [], color=BLADE, linewidth=4), "edge of a blade")] if blades else []
    legend += [(Patch(facecolor=STEEL), "needle")] if needles else []
    legend += [(Patch(facecolor=DISC), "disc of a grasp")] if any(tool.get("grasp") for tool in summary["tools"]) else []
    handles, names = zip(*legend)
    rows = 1 if len(legend) <= ONE_ROW else 2
    figure.subplots_adjust(bottom=0.065 if rows == 1 else 0.1)
    figure.legend(handles, names, loc="lower center", ncols=-(-len(legend) // rows), fontsize=14, frameon=False, bbox_to_anchor=(0.47, 0.0))
    picture_file.save(figure, arguments.output, [arguments.scene])


if __name__ == "__main__":
    main()
