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


def set_up(thing, **settings):
    """A VTK object with its settings: Radius=2 calls SetRadius(2)."""
    for name, value in settings.items():
        getattr(thing, "Set" + name)(value)
    return thing


def made_by(kind, **settings):
    """The VTK data that a source, reader or filter of this kind makes: InputData=... is what it begins with."""
    source = set_up(getattr(vtk, "vtk" + kind)(), **settings)
    source.Update()
    return source.GetOutput()


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
    return made_by("XMLUnstructuredGridReader", FileName=file)


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
    return points_in(grid) / MILLIMETRE


def point_data(grid, name):
    return vtk_to_numpy(grid.GetPointData().GetArray(name))


def read_if_there(scene, name):
    """The rows of a CSV file of a scene; none where the scene has no such file."""
    file = os.path.join(scene, name)
    return read_csv(file) if os.path.exists(file) else []


def frame_of_peak(scene):
    """The frame at which the forces on tools and obstacles and the links' tensions together are largest; of a scene that has cut, the last one."""
    if any(int(row["faces"]) + int(row["removed"]) > 0 for row in read_if_there(scene, "cut.csv")):
        return read_frames(scene)[-1]
    total = {}
    for row in read_csv(os.path.join(scene, "forces.csv")):
        time = float(row["time_s"])
        total[time] = total.get(time, 0) + np.linalg.norm(vector(row, "force", "N"))
    for row in read_if_there(scene, "links.csv"):
        total[float(row["time_s"])] += abs(float(row["tension_N"]))
    for row in read_if_there(scene, "obstacles.csv"):
        total[float(row["time_s"])] += np.linalg.norm(vector(row, "force", "N"))
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
    return made_by("PolyDataNormals", InputData=made_by("DataSetSurfaceFilter", InputData=grid), FeatureAngle=50)


def triangles_of(surface):
    """[n, 3] points of the triangles of an outer surface."""
    return vtk_to_numpy(surface.GetPolys().GetConnectivityArray()).reshape(-1, 3)


def split_by_lips(surface):
    """(The surface without the lips of cuts, the lips): VTK data with the points of an outer surface; None where there are no lips."""
    lip = surface.GetCellData().GetArray("lip")
    if lip is None or not vtk_to_numpy(lip).any():
        return surface, None
    triangles, is_lip = triangles_of(surface), vtk_to_numpy(lip) > 0
    parts = []
    for chosen in (~is_lip, is_lip):
        part = poly_data(surface.GetPoints(), triangles[chosen])
        part.GetPointData().DeepCopy(surface.GetPointData())
        parts.append(part)
    return parts


def plain_actor(data, colour, opacity=1.0, edges=None):
    actor = set_up(vtk.vtkActor(), Mapper=set_up(vtk.vtkDataSetMapper(), InputData=data, ScalarVisibility=False))
    look = set_up(actor.GetProperty(), Color=colour, Opacity=opacity, Ambient=0.25, Diffuse=0.8, Specular=0.12, SpecularPower=20)
    if edges:
        set_up(look, EdgeVisibility=True, EdgeColor=edges, LineWidth=1.2)
    return actor


def coloured_actor(data, values, limits, colour_map, edges=None):
    """values: one number per point of data."""
    array = numpy_to_vtk(np.ascontiguousarray(values, dtype=float), deep=1)
    array.SetName("shown")
    data.GetPointData().SetScalars(array)
    table = set_up(vtk.vtkLookupTable(), NumberOfTableValues=256, Range=limits)
    for i in range(256):
        table.SetTableValue(i, *colour_map(i / 255.0))
    actor = plain_actor(data, (1, 1, 1), edges=edges)
    set_up(actor.GetProperty(), Ambient=0.45, Diffuse=0.62)  # colours must stay readable in the shade
    set_up(actor.GetMapper(), ScalarVisibility=True, LookupTable=table, ScalarRange=limits, InterpolateScalarsBeforeMapping=True)
    return actor


def sphere(centre, radius, colour):
    return plain_actor(made_by("SphereSource", Center=centre, Radius=radius, ThetaResolution=32, PhiResolution=32), colour)


def rod(start, end, radius, colour):
    line = made_by("LineSource", Point1=start, Point2=end)
    return plain_actor(made_by("TubeFilter", InputData=line, Radius=radius, NumberOfSides=32, Capping=True), colour)


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
    cone = made_by("ConeSource", Direction=direction, Height=head, Radius=2.2 * radius, Resolution=32,
                   Center=start + direction * (length - head / 2))
    return [rod(start, start + direction * (length - head), radius, colour), plain_actor(cone, colour)]


def hatch(data, size, colour):
    """Stripes over a surface (VTK data with cells), a fiftieth of size apart, so that it is told from others without colours."""
    points = points_in(data)
    normal = np.array([0.5, 0.5, 0.7071])
    along = points @ normal
    cutter = set_up(vtk.vtkCutter(), InputData=data, CutFunction=set_up(vtk.vtkPlane(), Normal=normal))
    cutter.GenerateValues(max(int(np.ptp(along) / (size / 50)), 2), along.min(), along.max())
    cutter.Update()
    return line_actor(cutter.GetOutput(), colour)


def line_actor(data, colour, width=3):
    """Lines that lie in a surface (VTK data)."""
    actor = plain_actor(data, colour)
    set_up(actor.GetProperty(), Lighting=False, LineWidth=width)
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
    line = poly_data(np.asarray(points, dtype=float), [range(len(points))], "Lines")
    return plain_actor(made_by("TubeFilter", InputData=line, Radius=radius, NumberOfSides=12), colour)


# ---- image ---------------------------------------------------------------------------------------------------------


def projection(camera, size):
    """[4, 4]: from a point in mm to the screen, from -1 to 1."""
    transform = camera.GetCompositeProjectionTransformMatrix(size[0] / size[1], -1, 1)
    return np.array([[transform.GetElement(i, j) for j in range(4)] for i in range(4)])


def zoom_to_all(camera, actors, size):
    """The largest factor with which the boxes of all actors stay in the picture, 3 % from its edges."""
    corners = np.array([[b[i], b[2 + j], b[4 + k], 1] for b in (actor.GetBounds() for actor in actors)
                        for i in (0, 1) for j in (0, 1) for k in (0, 1)])
    on_screen = corners @ projection(camera, size).T
    # Camera.Zoom divides the view's angle, whose tangent decides; at 20 degrees both are the same within 1 %, which the margin covers.
    return views.largest_zoom(on_screen[:, :2] / on_screen[:, 3:], margin=0.03)


def render(actors, look_from, up=(0, 0, 1), zoom=1.0, size=(1500, 1100), bounds=None, crop=None):
    """Returns (image [rows, columns, 3] of bytes on white, function from a point in mm to its pixel (column, row)).

    look_from: direction from the object to the camera. bounds: what the view is fitted to, (xmin, xmax, ymin, ...); None:
    all actors. zoom: None for the largest with which no actor is cut off. crop: pixels of white to keep around what is shown; None: all. The window is rendered at twice the size and
    averaged.
    """
    renderer = set_up(vtk.vtkRenderer(), Background=(1, 1, 1))
    for actor in actors:
        renderer.AddActor(actor)
    window = set_up(vtk.vtkRenderWindow(), OffScreenRendering=1, MultiSamples=0, Size=(2 * size[0], 2 * size[1]))
    window.AddRenderer(renderer)

    camera = set_up(renderer.GetActiveCamera(), FocalPoint=(0, 0, 0), Position=look_from, ViewUp=up, ViewAngle=20)
    renderer.ResetCamera(bounds) if bounds else renderer.ResetCamera()
    camera.Zoom(zoom or zoom_to_all(camera, actors, size))
    renderer.ResetCameraClippingRange()
    set_up(vtk.vtkLightKit(), KeyToFillRatio=2, KeyToBackRatio=2.5).AddLightsToRenderer(renderer)
    window.Render()

    grabbed = made_by("WindowToImageFilter", Input=window, ReadFrontBuffer=False)
    columns, rows, _ = grabbed.GetDimensions()
    pixels = vtk_to_numpy(grabbed.GetPointData().GetScalars()).reshape(rows, columns, -1)[::-1, :, :3]
    image = pixels.reshape(rows // 2, 2, columns // 2, 2, 3).mean(axis=(1, 3)).astype(np.uint8)

    matrix = projection(camera, size)
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


def covered(pixels, triangles, shape):
    """Which pixels of a picture (rows, columns) the triangles cover. pixels: [n, 2], the column and the row of each point."""
    mask = np.zeros(shape, bool)
    for corners in np.asarray(pixels)[triangles]:
        low = np.clip(np.floor(corners.min(axis=0)).astype(int), 0, np.array(shape)[::-1])
        high = np.clip(np.ceil(corners.max(axis=0)).astype(int) + 1, 0, np.array(shape)[::-1])
        x, y = np.meshgrid(np.arange(low[0], high[0]), np.arange(low[1], high[1]))
        sides = [(b[0] - a[0]) * (y - a[1]) - (b[1] - a[1]) * (x - a[0]) for a, b in zip(corners, np.roll(corners, -1, axis=0))]
        mask[low[1]:high[1], low[0]:high[0]] |= np.all([side >= 0 for side in sides], axis=0) | np.all([side <= 0 for side in sides], axis=0)
    return mask


def draw_outline(panel, pixel, points, triangles, shape, colour):
    """A dashed line around what the triangles cover; points in mm."""
    mask = covered([pixel(point) for point in points], triangles, shape)
    if mask.any() and not mask.all():
        panel.contour(mask, levels=[0.5], colors=[colour], linestyles="dashed", linewidths=1.6)


def bounds_of(points):
    low, high = points.min(axis=0), points.max(axis=0)
    return [low[0], high[0], low[1], high[1], low[2], high[2]]
