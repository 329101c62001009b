#!/usr/bin/env python3
"""force.py LINEAR_SCENE RESPONSE_SCENE -o PNG: force against indentation of one tool, linear and corrected."""
import argparse
import os

import numpy as np

import picture_file
from picture_file import plt


def force_against_indentation(scene):
    """(indentation mm, force N) of the first tool while it goes in: from the touch before its first contact to its deepest; one
    point at zero for a tool that never touched."""
    rows = picture_file.read_csv(os.path.join(scene, "forces.csv"))
    rows = [row for row in rows if row["tool"] == rows[0]["tool"]]
    first = next((i for i, row in enumerate(rows) if int(row["contacts"]) > 0), None)
    if first is None:
        return np.zeros(1), np.zeros(1)
    place = np.array([[float(row[a + "_m"]) for a in "xyz"] for row in rows]) * 1e3
    depth = np.linalg.norm(place - place[max(first - 1, 0)], axis=1)
    force = np.array([np.linalg.norm(picture_file.vector(row, "force", "N")) for row in rows])
    deepest = first + int(np.argmax(depth[first:] * (force[first:] > 0)))
    return depth[first:deepest + 1], force[first:deepest + 1]


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("linear")
    parser.add_argument("response")
    parser.add_argument("-o", "--output", required=True)
    arguments = parser.parse_args()
    figure, panel = plt.subplots(figsize=(8, 5.4))
    for scene, label, style in ((arguments.linear, "linear", dict(color="0.45", linestyle="--")),
                                (arguments.response, "corrected by the response curve", dict(color="#b2182b"))):
        panel.plot(*force_against_indentation(scene), label=label, linewidth=2.5, **style)
    picture_file.finish_plot(panel, "indentation (mm)", "force on the tool (N)")
    panel.legend(fontsize=14, frameon=False)
    figure.tight_layout()
    picture_file.save(figure, arguments.output, [arguments.linear, arguments.response])


if __name__ == "__main__":
    main()
