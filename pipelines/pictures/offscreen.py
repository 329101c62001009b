"""Renders VTK actors without a display into numpy images, which matplotlib then labels.

Debian's python3-vtk9 renders through X only (it aborts without one), so a virtual X server is started for the process.
"""
import atexit
import ctypes
import json
import os
import signal
import subprocess
import xml.etree.ElementTree

import numpy as np

import views
from picture_file import read_csv, vector

MILLIMETRE = 1e-3


def end_with_parent():
    ctypes.CDLL(None).prctl(1, signal.SIGTERM)  # PR_SET_PDEATHSIG: a killed script leaves no server behind


def start_display():
    """Starts Xvfb on a display number that it picks itself, so that pictures can be made in parallel."""
    read_end, write_end = os.pipe()
    server = subprocess.Popen(["Xvfb", "-displayfd", str(write_end), "-screen", "0", "1280x1024x24", "-nolisten", "tcp",
                               "-noreset"],  # else it starts anew after each window, and the next one may not find it
                              pass_fds=[write_end], preexec_fn=end_with_parent,
                              stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    os.close(write_end)
    with os.fdopen(read_end) as pipe:
        number = pipe.readline().strip()
    if not number:
        raise SystemExit("offscreen.py: Xvfb did not start; is Debian's package xvfb installed?")
    os.environ["DISPLAY"] = ":" + number
    atexit.register(server.terminate)


start_display()
import vtk  # noqa: E402
from vtk.util.numpy_support import numpy_to_vtk, vtk_to_numpy  # noqa: E402


# ---- what a played scene wrote -------------------------------------------------------------------------------------


def read_summary(scene):
    with open(os.path.join(scene, "summary.json")) as stream:
        return json.load(stream)


def read_frames(scene):
    """[(time, organ files, tools file)] of shapes.pvd; of a scene of one organ one file."""
    frames = {}
    for entry in xml.etree.ElementTree.parse(os.path.join(scene, "shapes.pvd")).iter("DataSet"):
        organs, tools = frames.setdefault(float(entry.get("timestep")), ([], []))
        kind = os.path.basename(entry.get("file")).split("_")[0]
        if kind in ("organ", "tools"):
            (organs if kind == "organ" else tools).append(os.path.join(scene, entry.get("file")))
    return [(time, organs, tools[0]) for time, (organs, tools) in sorted(frames.items())]


def read_grid(file):
    reader = vtk.vtkXMLUnstructuredGridReader()
    reader.SetFileName(file)
    reader.Update()
    return reader.GetOutput()


def read_grids(files):
    """Several grids as one, whose points follow one another."""
    if len(files) == 1:
        return read_grid(files[0])
    together = vtk.vtkAppendFilter()
    for file in files:
        together.AddInputData(read_grid(file))
    together.Update()
    return together.GetOutput()


def points_in(data):
    """[n, 3] as they stand in VTK data."""
    return vtk_to_numpy(data.GetPoints().GetData()).astype(float)


def points_of(grid):
    """[n, 3] in mm."""
    if grid.GetNumberOfPoints() == 0:
        return np.zeros((0, 3))
    return vtk_to_numpy(grid.GetPoints().GetData()).astype(float) / MILLIMETRE


def point_data(grid, name):
    return vtk_to_numpy(grid.GetPointData().GetArray(name))


def frame_of_peak(scene):
    """The frame at which the tools' forces and the links' tensions together are largest."""
    total = {}
    for row in read_csv(os.path.join(scene, "forces.csv")):
        time = float(row["time_s"])
        total[time] = total.get(time, 0) + np.linalg.norm(vector(row, "force", "N"))
    links = os.path.join(scene, "links.csv")
    for row in read_csv(links) if os.path.exists(links) else []:
        total[float(row["time_s"])] += abs(float(row["tension_N"]))
    return max(read_frames(scene), key=lambda frame: total[frame[0]])


# ---- actors --------------------------------------------------------------------------------------------------------


def poly_data(points, cells, kind="Polys"):
    """VTK data of cells, [n, k] point indices. points: VTK points or [m, 3] mm. kind: or "Lines"."""
    cells = np.asarray(cells)
    data, array = vtk.vtkPolyData(), vtk.vtkCellArray()
    data.SetPoints(points) if isinstance(points, vtk.vtkPoints) else set_points(data, points)
    array.ImportLegacyFormat(numpy_to_vtk(np.hstack([np.full((len(cells), 1), cells.shape[1]), cells]).astype(np.int64).ravel(), deep=1,
                                          array_type=vtk.VTK_ID_TYPE))
    getattr(data, "Set" + kind)(array)
    return data


def set_points(grid, points):
    copy = vtk.vtkPoints()
    copy.SetData(numpy_to_vtk(np.ascontiguousarray(points), deep=1))
    grid.SetPoints(copy)


def surface_of(grid):
    """Outer surface with smooth normals."""
    surface = vtk.vtkDataSetSurfaceFilter()
    surface.SetInputData(grid)
    normals = vtk.vtkPolyDataNormals()
    normals.SetInputConnection(surface.GetOutputPort())
    normals.SetFeatureAngle(50)
    normals.Update()
    return normals.GetOutput()


def plain_actor(data, colour, opacity=1.0, edges=None):
    mapper = vtk.vtkDataSetMapper()
    mapper.SetInputData(data)
    mapper.ScalarVisibilityOff()
    actor = vtk.vtkActor()
    actor.SetMapper(mapper)
    look = actor.GetProperty()
    look.SetColor(*colour)
    look.SetOpacity(opacity)
    look.SetAmbient(0.25)
    look.SetDiffuse(0.8)
    look.SetSpecular(0.12)
    look.SetSpecularPower(20)
    if edges:
        look.EdgeVisibilityOn()
        look.SetEdgeColor(*edges)
        look.SetLineWidth(1.2)
    return actor


def coloured_actor(data, values, limits, colour_map, edges=None):
    """values: one number per point of data."""
    array = numpy_to_vtk(np.ascontiguousarray(values, dtype=float), deep=1)
    array.SetName("shown")
    data.GetPointData().SetScalars(array)
    table = vtk.vtkLookupTable()
    table.SetNumberOfTableValues(256)
    for i in range(256):
        table.SetTableValue(i, *colour_map(i / 255.0))
    table.SetRange(*limits)
    actor = plain_actor(data, (1, 1, 1), edges=edges)
    actor.GetProperty().SetAmbient(0.45)  # colours must stay readable in the shade
    actor.GetProperty().SetDiffuse(0.62)
    mapper = actor.GetMapper()
    mapper.ScalarVisibilityOn()
    mapper.SetLookupTable(table)
    mapper.SetScalarRange(*limits)
    mapper.InterpolateScalarsBeforeMappingOn()
    return actor


def sphere(centre, radius, colour):
    source = vtk.vtkSphereSource()
    source.SetCenter(*centre)
    source.SetRadius(radius)
    source.SetThetaResolution(32)
    source.SetPhiResolution(32)
    source.Update()
    return plain_actor(source.GetOutput(), colour)


def rod(start, end, radius, colour):
    line = vtk.vtkLineSource()
    line.SetPoint1(*start)
    line.SetPoint2(*end)
    tube = vtk.vtkTubeFilter()
    tube.SetInputConnection(line.GetOutputPort())
    tube.SetRadius(radius)
    tube.SetNumberOfSides(32)
    tube.CappingOn()
    tube.Update()
    return plain_actor(tube.GetOutput(), colour)


def coil(start, end, width, colour):
    """A coil spring from start to end, mm."""
    start, along = np.asarray(start, float), np.asarray(end, float) - start
    length = np.linalg.norm(along)
    across = np.linalg.svd(along[None] / length)[2][1:]
    turns = max(3, int(round(length / width)))
    share = np.linspace(0, 1, 24 * turns)
    angle, radius = 2 * np.pi * turns * share, 0.5 * width * np.minimum(1, 12 * np.minimum(share, 1 - share))
    places = start + share[:, None] * along + radius[:, None] * (np.cos(angle)[:, None] * across[0] + np.sin(angle)[:, None] * across[1])
    return path_line(places, 0.12 * width, colour)


def arrow(start, direction, length, radius, colour):
    """Two actors: a shaft and a head whose tip is at start + length * direction."""
    direction = np.asarray(direction) / np.linalg.norm(direction)
    head = min(4 * radius, 0.5 * length)
    cone = vtk.vtkConeSource()
    cone.SetDirection(*direction)
    cone.SetHeight(head)
    cone.SetRadius(2.2 * radius)
    cone.SetCenter(*(start + direction * (length - head / 2)))
    cone.SetResolution(32)
    cone.Update()
    return [rod(start, start + direction * (length - head), radius, colour), plain_actor(cone.GetOutput(), colour)]


def hatch(data, size, colour):
    """Stripes over a surface (VTK data with cells), a fiftieth of size apart, so that it is told from others without colours."""
    points = points_in(data)
    normal = np.array([0.5, 0.5, 0.7071])
    along = points @ normal
    plane = vtk.vtkPlane()
    plane.SetNormal(*normal)
    cutter = vtk.vtkCutter()
    cutter.SetInputData(data)
    cutter.SetCutFunction(plane)
    cutter.GenerateValues(max(int(np.ptp(along) / (size / 50)), 2), along.min(), along.max())
    cutter.Update()
    return line_actor(cutter.GetOutput(), colour)


def line_actor(data, colour, width=3):
    """Lines that lie in a surface (VTK data)."""
    actor = plain_actor(data, colour)
    actor.GetProperty().LightingOff()
    actor.GetProperty().SetLineWidth(width)
    # Lines are drawn in front of the triangles in which they lie.
    actor.GetMapper().SetResolveCoincidentTopologyToPolygonOffset()
    actor.GetMapper().SetRelativeCoincidentTopologyLineOffsetParameters(-6, -6)
    return actor


def cells_where(data, chosen):
    """The triangles of VTK data whose points are all chosen ([points] of bool), as VTK data."""
    ids = vtk_to_numpy(data.GetPolys().GetConnectivityArray()).reshape(-1, 3)
    return poly_data(data.GetPoints(), ids[chosen[ids].all(axis=1)])


def path_line(points, radius, colour):
    """A thin tube along places that a tool was at, mm."""
    tube = vtk.vtkTubeFilter()
    tube.SetInputData(poly_data(np.asarray(points, dtype=float), [range(len(points))], "Lines"))
    tube.SetRadius(radius)
    tube.SetNumberOfSides(12)
    tube.Update()
    return plain_actor(tube.GetOutput(), colour)


# ---- image ---------------------------------------------------------------------------------------------------------


def zoom_to_all(camera, actors, size):
    """The largest factor with which the boxes of all actors stay in the picture, 3 % from its edges."""
    corners = np.array([[b[i], b[2 + j], b[4 + k], 1] for b in (actor.GetBounds() for actor in actors)
                        for i in (0, 1) for j in (0, 1) for k in (0, 1)])
    transform = camera.GetCompositeProjectionTransformMatrix(size[0] / size[1], -1, 1)
    matrix = np.array([[transform.GetElement(i, j) for j in range(4)] for i in range(4)])
    on_screen = corners @ matrix.T
    # Camera.Zoom divides the view's angle, whose tangent decides; at 20 degrees both are the same within 1 %, which the margin covers.
    return views.largest_zoom(on_screen[:, :2] / on_screen[:, 3:], margin=0.03)


def render(actors, look_from, up=(0, 0, 1), zoom=1.0, size=(1500, 1100), bounds=None, crop=None):
    """Returns (image [rows, columns, 3] of bytes on white, function from a point in mm to its pixel (column, row)).

    look_from: direction from the object to the camera. bounds: what the view is fitted to, (xmin, xmax, ymin, ...); None:
    all actors. zoom: None for the largest with which no actor is cut off. crop: pixels of white to keep around what is shown; None: all. The window is rendered at twice the size and
    averaged.
    """
    renderer = vtk.vtkRenderer()
    renderer.SetBackground(1, 1, 1)
    for actor in actors:
        renderer.AddActor(actor)
    window = vtk.vtkRenderWindow()
    window.SetOffScreenRendering(1)
    window.SetMultiSamples(0)
    window.SetSize(2 * size[0], 2 * size[1])
    window.AddRenderer(renderer)

    camera = renderer.GetActiveCamera()
    camera.SetFocalPoint(0, 0, 0)
    camera.SetPosition(*look_from)
    camera.SetViewUp(*up)
    camera.SetViewAngle(20)
    renderer.ResetCamera(bounds) if bounds else renderer.ResetCamera()
    camera.Zoom(zoom or zoom_to_all(camera, actors, size))
    renderer.ResetCameraClippingRange()
    lights = vtk.vtkLightKit()
    lights.SetKeyToFillRatio(2)
    lights.SetKeyToBackRatio(2.5)
    lights.AddLightsToRenderer(renderer)
    window.Render()

    grab = vtk.vtkWindowToImageFilter()
    grab.SetInput(window)
    grab.ReadFrontBufferOff()
    grab.Update()
    columns, rows, _ = grab.GetOutput().GetDimensions()
    pixels = vtk_to_numpy(grab.GetOutput().GetPointData().GetScalars()).reshape(rows, columns, -1)[::-1, :, :3]
    image = pixels.reshape(rows // 2, 2, columns // 2, 2, 3).mean(axis=(1, 3)).astype(np.uint8)

    transform = camera.GetCompositeProjectionTransformMatrix(size[0] / size[1], -1, 1)
    matrix = np.array([[transform.GetElement(i, j) for j in range(4)] for i in range(4)])

    left = top = 0
    if crop is not None:
        shown_rows, shown_columns = np.nonzero((image < 250).any(axis=2))
        top, left = max(shown_rows.min() - crop, 0), max(shown_columns.min() - crop, 0)
        image = image[top:shown_rows.max() + crop, left:shown_columns.max() + crop]

    def pixel(point):
        x, y, _, w = matrix @ np.append(point, 1)
        return (x / w + 1) / 2 * size[0] - left, (1 - y / w) / 2 * size[1] - top

    return image, pixel


def text_size(panel, text, fontsize):
    """(width, height) of a line of bold text in the pixels of the panel's image."""
    left, right = panel.get_xlim()
    panel_inches = panel.get_position().width * panel.figure.get_size_inches()[0]
    point = abs(right - left) / panel_inches / 72  # pixels of the image
    return 0.68 * len(text) * fontsize * point + 6, 1.3 * fontsize * point + 6


def label_arrows(panel, pixel, labels, taken, fontsize, **style):
    """labels: [(end at the organ, free end, text)]. Each text stands beyond its arrow's free end, or near it where another text or one
    of the boxes taken is in the way. Returns all boxes that are taken then. Call when the panel has its place in the figure."""
    sizes = [text_size(panel, text, fontsize) for *_, text in labels]
    wanted = []
    for (inner, outer, _), size in zip(labels, sizes):
        at, away = np.array(pixel(outer)), np.array(pixel(outer)) - np.array(pixel(inner))
        away = away / np.linalg.norm(away) if np.linalg.norm(away) > 1 else np.array([1.0, 0])
        wanted.append(at + (0.5 * np.abs(away) @ size + 10) * away)
    picture = abs(np.diff(panel.get_xlim())[0]), abs(np.diff(panel.get_ylim())[0])
    places = views.free_places(wanted, sizes, taken, picture)
    for at, (*_, text) in zip(places, labels):
        panel.text(*at, text, ha="center", va="center", bbox=dict(facecolor="white", edgecolor="none", alpha=0.7, pad=1.5),
                   fontsize=fontsize, **style)
    return list(taken) + [views.around(at, size) for at, size in zip(places, sizes)]


def emptiest_corner(image, side):
    """The middle of the square of that side in pixels, in one of the image's corners, which shows least; (column, row).
    Of equals the lower right one: the scale's bar is at the lower left."""
    rows, columns = image.shape[:2]
    corners = [(column, row) for row in (rows - side, 0) for column in (columns - side, 0)]
    column, row = min(corners, key=lambda c: (image[c[1]:c[1] + side, c[0]:c[0] + side] < 250).any(axis=2).sum())
    return np.array([column + side / 2, row + side / 2])


def draw_scale(panel, image, pixel, centre, look_from, size, frame=None):
    """Draws a bar of a round length in mm at the lower edge, which holds at the depth of centre, the middle of what is shown. In a
    body's frame ("LPS", "RAS") each edge has the letters of the side that lies there (R right, L left, A front, P back, I below,
    S above, of the patient); else the axes stand in an empty corner. size: its diagonal, mm. Returns the boxes of what it wrote, (left,
    top, right, bottom) in pixels of the image."""
    right, up = views.screen_axes(look_from)
    pixels_per_mm = np.linalg.norm(np.subtract(pixel(centre + size * right), pixel(centre))) / size
    length = max(n for n in (1, 2, 5, 10, 20, 50, 100, 200) if n <= max(0.25 * size, 1))
    rows, columns = image.shape[:2]
    begin, end, low = 20, 20 + length * pixels_per_mm, rows - 15
    panel.plot([begin, end], [low, low], color="black", linewidth=3, solid_capstyle="butt", scalex=False, scaley=False)
    panel.text((begin + end) / 2, low - 10, "%d mm" % length, ha="center", va="bottom", fontsize=14)
    written = [(0, rows - 65, max(end, (begin + end) / 2 + 60) + 10, rows)]

    if frame in views.LETTERS:
        for direction, at, sides in ((-right, (8, rows / 2), ("left", "center")), (right, (columns - 8, rows / 2), ("right", "center")),
                                     (up, (columns / 2, 8), ("center", "top")), (-up, (columns / 2, rows - 8), ("center", "bottom"))):
            letters = views.letters_of(frame, direction)
            written.append(views.around((np.clip(at[0], 32, columns - 32), np.clip(at[1], 24, rows - 24)), (64, 48)))
            panel.text(*at, letters, ha=sides[0], va=sides[1], fontsize=17, weight="bold", color="#2b4a7a",
                       bbox=dict(facecolor="white", edgecolor="none", alpha=0.6, pad=1))
        return written
    reach = 55  # pixels of an axis that lies in the plane of the picture
    corner = emptiest_corner(image, 3 * reach)
    written.append(views.around(corner, (3 * reach, 3 * reach)))
    start = corner + np.array([-0.4 * reach, 0.4 * reach])
    for name, axis in zip("xyz", np.eye(3)):
        along = np.subtract(pixel(centre + 0.1 * size * axis), pixel(centre)) * reach / (0.1 * size * pixels_per_mm)
        panel.annotate("", start + along, start, arrowprops=dict(arrowstyle="-|>", color="black", linewidth=1.5, shrinkA=0, shrinkB=0))
        panel.text(*(start + along + 16 * along / max(np.linalg.norm(along), 20)), name, ha="center", va="center", fontsize=14)
    return written


def bounds_of(points):
    low, high = points.min(axis=0), points.max(axis=0)
    return [low[0], high[0], low[1], high[1], low[2], high[2]]
