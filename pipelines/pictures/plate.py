#!/usr/bin/env python3
"""plate.py SCENE_FOLDER ... -o PNG: the plate at each scene's last frame, a panel each, as in the paper's figure 5."""
import os

import numpy as np

import offscreen
import picture_file
from picture_file import plt

COLOURS = plt.get_cmap("coolwarm")
EDGE, FORCE, ARROW = (0.25, 0.25, 0.25), "#111111", (0.07, 0.07, 0.07)


def last_frame(scene):
    time, organ_files, _ = offscreen.read_frames(scene)[-1]
    return time, offscreen.read_grids(organ_files)


def force_arrows(scene, time, points, size):
    """Forces of the tools on the plate, each ending (push) or starting (pull) at its contact; labels for them."""
    held = {}
    for row in offscreen.read_csv(os.path.join(scene, "contacts.csv")):
        if float(row["time_s"]) == time:
            held.setdefault(row["tool"], []).append((points[int(row["node"])], offscreen.vector(row, "force", "N")))
    actors, labels = [], []
    for contacts in held.values():
        weights = [np.linalg.norm(force) + 1e-12 for _, force in contacts]
        place = np.average([p for p, _ in contacts], axis=0, weights=weights)
        force = sum(f for _, f in contacts)
        if not force.any():
            continue
        direction = force / np.linalg.norm(force)
        reach = 0.17 * size * direction
        start = place - reach if direction[2] < 0 else place
        actors += offscreen.arrow(start, direction, 0.17 * size, 0.006 * size, ARROW)
        labels.append((place, start if direction[2] < 0 else start + reach, "%.2f N" % np.linalg.norm(force)))
    return actors, labels


def main():
    arguments = picture_file.arguments(__doc__, "scenes", nargs="+")
    frames = [last_frame(scene) for scene in arguments.scenes]
    heights = [offscreen.point_data(organ, "displacement")[:, 2] / offscreen.MILLIMETRE for _, organ in frames]
    largest = max(float(np.ceil(max(np.abs(h).max() for h in heights))), 1.0)  # mm

    figure, panels = plt.subplots(1, len(frames), figsize=(7.6 * len(frames), 5), squeeze=False)
    for panel, scene, (time, organ) in zip(panels[0], arguments.scenes, frames):
        points = offscreen.points_of(organ)
        offscreen.set_points(organ, points)
        surface = offscreen.surface_of(organ)
        shown = offscreen.point_data(surface, "displacement")[:, 2] / offscreen.MILLIMETRE
        size = np.linalg.norm(np.ptp(points, axis=0))
        arrows, labels = force_arrows(scene, time, points, size)
        actors = [offscreen.coloured_actor(surface, shown, (-largest, largest), COLOURS, edges=EDGE)] + arrows
        image, pixel = offscreen.render(actors, (0.45, -1.0, 0.62), size=(1200, 780), zoom=1.4,
                                        bounds=offscreen.bounds_of(np.vstack([points] + [o for _, o, _ in labels])), crop=60)
        panel.imshow(image)
        panel.axis("off")
        panel.set_title(os.path.basename(scene.rstrip("/")).replace("-", " "), fontsize=17)
        offscreen.label_arrows(panel, pixel, labels, [], fontsize=15, color=FORCE)
    bar = figure.colorbar(plt.cm.ScalarMappable(plt.Normalize(-largest, largest), COLOURS),
                          cax=figure.add_axes([0.915, 0.15, 0.014, 0.68]))
    bar.set_label("vertical displacement (mm)", fontsize=15)
    bar.ax.tick_params(labelsize=13)
    figure.subplots_adjust(left=0.005, right=0.9, bottom=0.01, top=0.92, wspace=0.01)
    picture_file.save(figure, arguments.output, arguments.scenes)


if __name__ == "__main__":
    main()
