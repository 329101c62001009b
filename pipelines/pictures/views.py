"""Where a picture is seen from, what its edges are called, and where a tool's shaft goes. Directions are in the bundle's frame."""
import numpy as np

# The letters of the negative and the positive end of x, y and z.
LETTERS = {"LPS": ("RL", "AP", "IS"), "RAS": ("LR", "PA", "IS")}
# Cameras around the organ, a little above it: from the front (small y) on, against the clock as seen from above.
CAMERAS = [np.array([np.sin(angle), -np.cos(angle), 0.38]) for angle in np.radians([17, 62, 107, 152, 197, 242, 287, 332])]


def unit(vector):
    length = np.linalg.norm(vector)
    return np.asarray(vector, float) / length if length > 0 else np.zeros(3)


def screen_axes(look_from):
    """The directions to the right and up in a picture that is seen from there, with z up."""
    right = unit(np.cross((0, 0, 1), look_from))
    return right, np.cross(unit(look_from), right)


def letters_of(frame, direction):
    """The anatomical letters of a direction, the largest part first, such as "L" or "LA"; "" in a frame that is not the body's. A
    part below 0.4 of the direction is left out."""
    if frame not in LETTERS:
        return ""
    parts = unit(direction)
    order = sorted(range(3), key=lambda d: -abs(parts[d]))
    return "".join(LETTERS[frame][d][int(parts[d] > 0)] for d in order if abs(parts[d]) > 0.4)


def two_views(normals):
    """Two of CAMERAS that together see the surface at all places best. normals: [n, 3] outward. The first one sees most places by
    itself. Without places: from the front and from behind."""
    if len(normals) == 0:
        return CAMERAS[0], CAMERAS[4]
    seen = np.minimum([[unit(n) @ unit(camera) for camera in CAMERAS] for n in normals], 0.7)
    # The second one at least 90 degrees away, so that it shows what the first one cannot.
    pairs = [(first, (first + turn) % 8) for first in range(8) for turn in (2, 3, 4, 5, 6)]
    first, second = max(pairs, key=lambda pair: np.maximum(seen[:, pair[0]], seen[:, pair[1]]).sum() + 0.1 * seen[:, pair[0]].sum())
    return CAMERAS[first], CAMERAS[second]


def shaft(path, contact, normal):
    """The direction from a tool's tip to its handle: back along the way on which the tool came to its first contact. Where the
    tool did not move by 2 mm before it, or came from inside, the outward normal of the surface.
    path: [n, 3] mm, the tool in each touch; contact: index of its first contact, or None."""
    came = path[0] - path[contact] if contact else np.zeros(3)
    if np.linalg.norm(came) < 2 or unit(came) @ unit(normal) < 0.2:
        return unit(normal)
    return unit(came)


def beside(direction, shaft, look_from):
    """Where an arrow along direction goes so that a shaft does not hide it: to the side of the shaft, as seen from look_from. Zero for
    an arrow that leaves the shaft at more than 37 degrees."""
    if unit(direction) @ unit(shaft) < 0.8:
        return np.zeros(3)
    side = np.cross(look_from, shaft)
    if np.linalg.norm(side) < 1e-6 * np.linalg.norm(look_from):  # seen along the shaft: any side
        side = np.cross(shaft, np.eye(3)[np.argmin(np.abs(shaft))])
    return unit(side)


def overlap(one, two):
    """Whether two boxes (left, top, right, bottom) have a place in common."""
    return one[0] < two[2] and two[0] < one[2] and one[1] < two[3] and two[1] < one[3]


def around(middle, size):
    half = np.asarray(size) / 2
    return (*(np.asarray(middle) - half), *(np.asarray(middle) + half))


def free_places(wanted, sizes, taken, picture):
    """Where texts go: the middles of their boxes, each as near as possible to where it is wanted, inside the picture and so that no
    box covers another one or one of those taken. wanted: [n, 2]; sizes: [n, 2], width and height; taken: boxes (left, top, right,
    bottom); picture: its width and height. A text for which there is no free place stays where it is wanted."""
    rings = [(0, 0)] + [(radius * np.cos(turn), radius * np.sin(turn)) for radius in range(10, 400, 10)
                        for turn in np.linspace(0, 2 * np.pi, 16, endpoint=False)]
    taken, placed = list(taken), []
    for middle, size in zip(wanted, sizes):
        boxes = [around(np.add(middle, ring), size) for ring in rings]
        inside = [box for box in boxes if box[0] >= 0 and box[1] >= 0 and box[2] <= picture[0] and box[3] <= picture[1]]
        box = next((box for box in inside if not any(overlap(box, other) for other in taken)), boxes[0])
        taken.append(box)
        placed.append(((box[0] + box[2]) / 2, (box[1] + box[3]) / 2))
    return placed


def largest_zoom(points_on_screen, margin):
    """The factor by which a view may be enlarged so that all points, in -1 .. 1 across and up, stay within 1 - margin."""
    return (1 - margin) / max(np.abs(points_on_screen).max(), 1e-9)
