"""Calls that are written in Python: what a bundle says of its axes, places by words, a scene's plan as text, and a press as a plot."""

import difflib

import numpy as np

# The patient's directions in a bundle of frame LPS; x and y have the other sign in RAS.
_WAYS = {"foremost": (0, -1, 0), "hindmost": (0, 1, 0), "leftmost": (1, 0, 0), "rightmost": (-1, 0, 0), "uppermost": (0, 0, 1), "lowest": (0, 0, -1)}


class Place:
    """A point of the surface that can be touched, as at = "foremost" of a scene file names it."""

    def __init__(self, point, normal):
        """__init__(self: Place, point: ndarray, normal: ndarray) -> None"""
        self._point, self._normal = point, normal

    point = property(lambda self: self._point, doc="float64 [3], m")
    normal = property(lambda self: self._normal, doc="float64 [3]: outward, of length 1")

    def under(self, depth):
        """under(self: Place, depth: float) -> ndarray

        The point so deep below the surface at rest, m; above it where depth is below 0."""
        return self.point - depth * self.normal

    def __repr__(self):
        return "<palpate.Place: %s m>" % np.array2string(self.point, precision=4)


def frame(bundle):
    """str: what x, y and z point to: "LPS" (the patient's left, back and head), "RAS" (right, front and head) or "none"."""
    return bundle.provenance.get("frame", "none")


def place(self, at):
    """place(self: Bundle, at: str) -> Place

    The touchable point that lies farthest in that direction of the patient: "foremost", "hindmost", "leftmost", "rightmost",
    "uppermost" or "lowest", as in a scene file. The bundle's frame has to be LPS or RAS."""
    if not isinstance(at, str) or at not in _WAYS:
        near = difflib.get_close_matches(str(at), _WAYS, 1)
        raise ValueError("at: expected one of %s; found %r%s" % (", ".join(_WAYS), at, "; did you mean %r?" % near[0] if near else ""))
    if self.frame not in ("LPS", "RAS"):
        raise ValueError("at: expected a bundle of frame LPS or RAS, which says where the patient's front is, found frame %r; "
                         "Scene.closest_point finds the place nearest to a point" % self.frame)
    way = np.array(_WAYS[at], float) * ((1, 1, 1) if self.frame == "LPS" else (-1, -1, 1))
    nodes, triangles = self.nodes[: self.surface_node_count], self.triangles
    corners = nodes[triangles]
    areas = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals = np.zeros_like(nodes)
    for corner in range(3):
        np.add.at(normals, triangles[:, corner], areas)
    touchable = np.isin(np.arange(len(nodes)), self.touchable)
    whole = touchable[triangles].all(axis=1)
    if not whole.any():
        raise ValueError("at: expected a surface that can be touched, found no triangle of three touchable nodes")
    inner = touchable.copy()
    inner[triangles[~whole]] = False  # nodes at the end of what can be touched are taken where there are no others
    allowed = inner if inner.any() else touchable
    far = np.where(allowed, nodes @ way, -np.inf)
    # Of nodes that lie equally far, as on a flat face, the one whose normal points best along the direction.
    equal = np.flatnonzero(far >= far.max() - 1e-6 * np.linalg.norm(np.ptp(nodes, axis=0)))
    units = normals[equal] / np.linalg.norm(normals[equal], axis=1, keepdims=True)
    best = int(np.argmax(units @ way))
    return Place(nodes[equal[best]].copy(), units[best])


def explain(self):
    """explain(self: Scene) -> str

    The plan as a table: what each half of a step does, the bytes that it maps of the bundle and takes for itself, and the sections
    that it reads. `palpate-run --explain` also measures the times."""
    rows = [("half", "pass", "maps", "memory", "sections")]
    rows += [(p.half, p.name, "%d kB" % (p.mapped_bytes / 1e3), "%d kB" % (p.memory_bytes / 1e3), p.sections) for p in self.plan]
    wide = [max(len(row[column]) for row in rows) for column in range(4)]
    lines = ["%-*s  %-*s  %*s  %*s  %s" % (wide[0], row[0], wide[1], row[1], wide[2], row[2], wide[3], row[3], row[4]) for row in rows]
    return "\n".join([line.rstrip() for line in lines] + ["a touch counts at most %d operations, whatever the tools do" % self.most_operations])


def plot_press(self, at, depth, file=None, disc_radius=0.005, speed=0.01):
    """plot_press(self: Scene, at: object, depth: float, file: object = None, disc_radius: float = 0.005, speed: float = 0.01) -> tuple

    Presses a disc in along the normal of a place, draws force against depth with matplotlib, and returns both: two float64 arrays, m
    and N, a row for each millisecond. at: a word of Bundle.place, or a Place; depth, disc_radius: m; speed: m/s; file: where the plot is
    written (.png, .svg, .pdf); None: it is left as the current figure. Afterwards the scene is as after reset."""
    tool_type, where = type(self)._tool_type, self.bundle.place(at) if isinstance(at, str) else at
    if not (depth > 0 and speed > 0):
        raise ValueError("plot_press: expected a depth and a speed above 0, found depth %r m, speed %r m/s" % (depth, speed))
    contacts = self.make_contacts()
    probe = tool_type(where.under(-0.002), disc_radius=disc_radius)
    depths = np.append(np.arange(0, depth, 1e-3 * speed), depth)
    forces = np.empty(len(depths))
    self.reset()
    self.touch([probe], 0.001, contacts)
    for step, now in enumerate(depths):
        probe.points[0] = where.under(now)
        self.touch([probe], 0.001, contacts)
        forces[step] = contacts.force[0] @ where.normal
    self.reset()
    import matplotlib.pyplot as plt

    figure, axis = plt.subplots(layout="constrained")
    axis.plot(1e3 * depths, forces)
    axis.set_xlabel("depth, mm")
    axis.set_ylabel("force along the normal, N")
    axis.set_title("%s, disc of %g mm radius" % (at if isinstance(at, str) else repr(at), 1e3 * disc_radius))
    axis.grid(alpha=0.3)
    if file is not None:
        figure.savefig(file)
        plt.close(figure)
    return depths, forces


def add_to(bundle_type, scene_type, tool_type):
    scene_type._tool_type = tool_type
    bundle_type.frame = property(frame, doc=frame.__doc__)
    bundle_type.place, scene_type.explain, scene_type.plot_press = place, explain, plot_press
